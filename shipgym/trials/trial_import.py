"""Conversion of the table of a log to channels in SI units, at midship."""

import math
from collections.abc import Collection, Mapping

import numpy as np

from shipgym.trials.columns import Column
from shipgym.trials.conventions import Conventions
from shipgym.trials.midship import to_project_conventions
from shipgym.trials.plausibility.agreement import (
    check_over_ground,
    check_speed_units,
    check_steps,
    check_track,
    check_velocity,
    check_yaw_rate,
)
from shipgym.trials.plausibility.values import check_rudder_unit, frozen_heading
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.recording import read_recording
from shipgym.trials.resampling import Log
from shipgym.trials.rudder_sign import check_rudder_side
from shipgym.trials.units import QUANTITIES

#: What a log lacks, by the channels of which it has none.
_LACKING = {
    ("delta", "delta_command", "X"): (
        "no rudder angle in this log: without rudder nothing can be identified from it,"
        " it can only be looked at; log the rudder too (in NMEA 0183 the sentence RSA)"
    ),
    ("psi", "r"): (
        "no heading in this log: without it turning and drift cannot be told, and"
        " nothing can be identified; log the heading too (in NMEA 0183 the sentence"
        " HDT)"
    ),
    ("x", "u", "v", "stw", "ground_north", "X"): (
        "no speed is known: the log has neither positions nor a speed, and counts as"
        " sailed at the service speed of the ship file"
    ),
}
_MAGNETIC = (
    "the heading stays magnetic: the log has no variation; write variation_deg (east"
    " positive) in [sensors], or drift and current cannot be told from it"
)


def import_table(
    table: LogTable,
    columns: Mapping[str, Column] | None,
    conventions: Conventions,
) -> Log:
    """Read channels from the table of a log.

    Without columns every one is read that is named like a channel. The channels have
    the project's signs and are in the body frame, at midship. Anything wrong with a
    file is an InputError that names line, column, value and remedy.
    """
    log = read_recording(table, columns, conventions.repair)
    if conventions.rudder_positive == "port":
        for name in log.channels.keys() & {"delta", "delta_command"}:
            log.channels[name] = -log.channels[name]
    if conventions.frame == "enu":
        _turn_frame(log, conventions.velocity_frame)

    remarks = _check_channels(log, conventions)
    has_offset = conventions.installation.heading_offset != 0.0
    log.magnetic = log.locator.is_magnetic and not has_offset
    if log.magnetic:
        log.notes.append(_MAGNETIC)
    log.notes += remarks
    to_project_conventions(log, conventions)
    known = [name for name in QUANTITIES if name in log.channels]
    log.channels = {name: log.channels[name] for name in known}
    log.repaired = {
        name: log.repaired[name] for name in known if log.repaired.get(name)
    }
    return log


def lacking(known: Collection[str]) -> list[str]:
    """What is to be logged too, of a log with these channels."""
    return [
        words
        for channels, words in _LACKING.items()
        if not any(name in known for name in channels)
    ]


def _turn_frame(log: Log, velocity_frame: str) -> None:
    """Make angles that count from east to port those from north to starboard.

    As ROS has them: x east and y north, body forward and to port. Latitudes and
    longitudes became x and y as they should be.
    """
    channels = log.channels
    in_body = velocity_frame == "body"
    turned = {"psi", "r", "Y", "N", *(["v"] if in_body else [])}
    for name in channels.keys() & turned:
        zero = 0.5 * math.pi if name == "psi" else 0.0
        channels[name] = zero - channels[name]
    pairs = [] if in_body else [("u", "v")]
    if "lat" not in log.locator.columns:
        pairs.append(("x", "y"))
    for east, north in pairs:
        if log.has(east, north):
            channels[east], channels[north] = channels[north], channels[east]


def _check_channels(log: Log, conventions: Conventions) -> list[str]:
    """Refuse impossible and contradictory channels; remarks on what is odd."""
    locator = log.locator
    remarks = lacking(log.channels)
    remarks += frozen_heading(log)
    remarks += check_steps(log.t, locator)
    if log.has("delta") and np.ptp(log.channels["delta"]) == 0.0:
        remarks.append(
            "the rudder stays where it is: nothing can be identified from this log, it"
            " can only be looked at"
        )
    tells_turning = log.has("psi") or log.has("r")
    if log.has("x", "y") or log.has("ground_north"):
        check_over_ground(log, conventions, locator)
        check_speed_units(log, locator)
    if "lat" in locator.columns and log.has("ground_north", "psi"):
        check_track(log, locator)
    if tells_turning:
        check_rudder_unit(log, locator)
    if log.has("psi", "r"):
        check_yaw_rate(log, locator)
    if log.has("x", "y", "psi", "u", "v"):
        check_velocity(log, conventions.velocity_frame, locator)
    if tells_turning and log.has("delta"):
        check_rudder_side(log)
    return remarks
