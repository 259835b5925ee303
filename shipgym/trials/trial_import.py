"""Conversion of the tables of a log to channels in SI units, at midship."""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.trials.columns import Column
from shipgym.trials.conventions import Conventions
from shipgym.trials.midship import to_project_conventions
from shipgym.trials.plausibility.agreement import (
    check_over_ground,
    check_speed_units,
    check_steps,
    check_velocity,
    check_yaw_rate,
)
from shipgym.trials.plausibility.values import check_rudder_unit, frozen_heading
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.recording import Recording, read_recording
from shipgym.trials.resampling import Log, Signal, Signals, on_one_clock
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
        "no speed is known: the log has neither positions nor a speed; give the service"
        " speed in the ship file"
    ),
}
_MAGNETIC = (
    "the heading stays magnetic: the log has no variation; write variation_deg (east"
    " positive) in [sensors], or drift and current cannot be told from it"
)


def import_tables(
    tables: Sequence[LogTable],
    columns: Mapping[str, Column] | None,
    conventions: Conventions,
) -> Log:
    """Read channels from the tables of one log, as a rule one.

    Without columns every one is read that is named like a channel. The channels have
    the project's signs and are in the body frame, at midship. Anything wrong with a
    file is an InputError that names line, column, value and remedy.
    """
    is_part = len(tables) > 1
    recordings = [
        read_recording(table, columns, conventions.repair, part=is_part)
        for table in tables
    ]
    first, *others = recordings
    signals = dict(first.signals)
    for other in others:
        signals |= _on_first_clock(other, first, signals)
    if conventions.rudder_positive == "port":
        for name in signals.keys() & {"delta", "delta_command"}:
            _turn(signals, name)
    if conventions.frame == "enu":
        _turn_frame(signals, recordings, conventions.velocity_frame)

    log = on_one_clock(signals, first.locator.path)
    remarks = _check_channels(log, recordings, conventions)
    notes = [note for one in recordings for note in one.notes]
    log.magnetic = any(one.is_magnetic for one in recordings)
    log.magnetic &= conventions.installation.heading_offset == 0.0
    if log.magnetic:
        notes.append(_MAGNETIC)
    log.notes = notes + log.notes + remarks
    to_project_conventions(log, conventions)
    _complete(log, recordings)
    return log


def lacking(known: Collection[str]) -> list[str]:
    """What is to be logged too, of a log with these channels."""
    return [
        words
        for channels, words in _LACKING.items()
        if not any(name in known for name in channels)
    ]


def _on_first_clock(other: Recording, first: Recording, known: Signals) -> Signals:
    """Channels of another file of a log on the clock of the first one.

    Raises InputError for channels that are known already, and for other times.
    """
    path = other.locator.table.path
    repeated = known.keys() & other.signals.keys()
    if repeated:
        names = quoted(sorted(repeated))
        raise InputError(
            f"{path}: expected each channel in one file of this log, got"
            f" {names} again; name the file of the one to read: {{ column = ..., file ="
            f' "{path.name}" }}'
        )

    shift = (other.start or 0.0) - (first.start or 0.0)
    moved = {
        name: Signal(t + shift, values) for name, (t, values) in other.signals.items()
    }
    begin, end = _span(known)
    other_begin, other_end = _span(moved)
    if other_begin >= end or other_end <= begin:
        raise InputError(
            f"{path}: expected a file of the same time as the other of this log, got"
            f" one that begins {other_begin - begin:.6g} s after it and does not"
            " overlap with it; name files that were written at the same time, by clocks"
            " of one zone"
        )
    return moved


def _span(signals: Signals) -> tuple[float, float]:
    """First and last time of signals, s."""
    times = np.concatenate([signal.t for signal in signals.values()])
    return float(times.min()), float(times.max())


def _turn(signals: Signals, name: str, zero: float = 0.0) -> None:
    """Let a channel count to the other side, from another zero."""
    signals[name] = signals[name]._replace(values=zero - signals[name].values)


def _turn_frame(
    signals: Signals, recordings: Sequence[Recording], velocity_frame: str
) -> None:
    """Make angles that count from east to port those from north to starboard.

    As ROS has them: x east and y north, body forward and to port.
    """
    in_body = velocity_frame == "body"
    for name in signals.keys() & {"psi", "r", "Y", "N", *(["v"] if in_body else [])}:
        _turn(signals, name, 0.5 * math.pi if name == "psi" else 0.0)
    pairs = [] if in_body else [("u", "v")]
    if not any("lat" in one.locator.columns for one in recordings):
        pairs.append(("x", "y"))
    for east, north in pairs:
        if {east, north} <= signals.keys():
            signals[east], signals[north] = signals[north], signals[east]


def _check_channels(
    log: Log, recordings: Sequence[Recording], conventions: Conventions
) -> list[str]:
    """Refuse impossible and contradictory channels; remarks on what is odd."""
    locator = recordings[0].locator
    remarks = lacking(log.channels)
    remarks += frozen_heading(log)
    remarks += check_steps(log.t, locator)
    has_positions = any("lat" in one.locator.columns for one in recordings)
    if has_positions or log.has("ground_north"):
        check_over_ground(log, conventions, locator)
    tells_speed = log.has("x", "y") or log.has("ground_north")
    tells_turning = log.has("psi") or log.has("r")
    for one in recordings:
        if tells_speed:
            check_speed_units(log, one.locator)
        if tells_turning:
            check_rudder_unit(log, one.locator)
    if log.has("psi", "r"):
        check_yaw_rate(log, locator)
    if log.has("x", "y", "psi", "u", "v"):
        check_velocity(log, conventions.velocity_frame, locator)
    check_rudder_side(log)
    return remarks


def _complete(
    log: Log,
    recordings: Sequence[Recording],
) -> None:
    """Order the channels, and add the clock and the counts of values filled in."""
    log.channels = {
        name: log.channels[name] for name in QUANTITIES if name in log.channels
    }
    for recording in recordings:
        for name, count in recording.filled.items():
            if count and name in log.channels:
                log.repaired[name] = count

    log.start = recordings[0].start
