"""From the tables of a log to channels in SI units, at midship."""

from collections.abc import Mapping, Sequence

from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.trials.clock_texts import zone_seconds
from shipgym.trials.columns import Column, Locator
from shipgym.trials.conventions import Conventions
from shipgym.trials.late_channels import (
    LateChannel,
    find_late_channels,
    is_corrected,
)
from shipgym.trials.midship import to_project_conventions
from shipgym.trials.plausibility.agreement import check_velocity, check_yaw_rate
from shipgym.trials.plausibility.over_ground import check_over_ground
from shipgym.trials.plausibility.overlap import check_overlap
from shipgym.trials.plausibility.sampling import check_steps, is_usual
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.recording import Recording, read_recording
from shipgym.trials.resampling import (
    Log,
    Signal,
    Signals,
    on_one_clock,
    share_clock,
    usual_step,
)
from shipgym.trials.units import QUANTITIES

_NO_RUDDER = (
    "no rudder angle in this log: without rudder nothing can be identified from it, it"
    " can only be looked at; log the rudder too (in NMEA 0183 the sentence RSA)"
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
    recordings = []
    for table in tables:
        is_part = len(tables) > 1
        recording = read_recording(table, columns, conventions.repair, part=is_part)
        recordings.append(recording)
    signals = _joined(recordings)
    if conventions.rudder_positive == "port":
        _turn_rudder(signals)

    log = on_one_clock(signals, str(tables[0].path))
    locator = recordings[0].locator
    remarks = _check_motion(log, recordings, conventions)
    late = find_late_channels(log)
    if late:
        log, notes = _corrected(log, signals, late, conventions)
        remarks += notes
    _check_agreement(log, locator, conventions)
    log.notes = [note for table in tables for note in table.notes] + log.notes + remarks

    to_project_conventions(log, conventions)
    _complete(log, recordings)
    return log


def _joined(recordings: Sequence[Recording]) -> Signals:
    """Channels of all files of a log on the clock of the first."""
    base, *others = recordings
    signals = dict(base.signals)
    for other in others:
        path = other.locator.table.path
        if (base.start is None) != (other.start is None):
            raise InputError(
                f"{path}: expected times that count from one moment in all files of"
                " this log, got clock times in one of two only"
            )
        repeated = signals.keys() & other.signals.keys()
        if repeated:
            raise InputError(
                f"{path}: expected each channel in one file of this log, got"
                f" {quoted(sorted(repeated))} again; rename the column that is not to"
                " be read"
            )
        shift = (other.start or 0.0) - (base.start or 0.0)
        moved = {}
        for name, (t, values) in other.signals.items():
            moved[name] = Signal(t + shift, values)
        check_overlap(signals, moved, path, other.locator.columns["t"].name)
        signals |= moved
    return signals


def _turn_rudder(signals: Signals) -> None:
    """Make a rudder that is positive to port positive to starboard."""
    for name in signals.keys() & {"delta", "delta_command"}:
        t, values = signals[name]
        signals[name] = Signal(t, 0.0 - values)


def _check_motion(
    log: Log, recordings: Sequence[Recording], conventions: Conventions
) -> list[str]:
    """Remarks on rudder, time and motion over ground, refused where impossible."""
    locator = recordings[0].locator
    has_positions = any("lat" in one.locator.columns for one in recordings)
    remarks = []
    if has_positions and "delta" not in log.channels:
        remarks.append(_NO_RUDDER)
    if not is_usual(usual_step(log.t)):
        remarks += check_steps(log.t, locator)
    if has_positions or "ground_north" in log.channels:
        remarks += check_over_ground(log, conventions.installation, locator)
    return remarks


def _check_agreement(log: Log, locator: Locator, conventions: Conventions) -> None:
    """Refuse channels that contradict each other."""
    channels = log.channels.keys()
    if {"psi", "r"} <= channels:
        check_yaw_rate(log, locator)
    if {"x", "y", "psi", "u", "v"} <= channels:
        check_velocity(log, conventions.velocity_frame, locator)


def _corrected(
    log: Log,
    signals: Signals,
    late: Sequence[LateChannel],
    conventions: Conventions,
) -> tuple[Log, list[str]]:
    """The log with those late channels put right that are to be, and remarks on all."""
    choice = conventions.installation.clock_offsets
    is_one_clock = share_clock(signals)
    corrected = dict(signals)
    notes = []
    for one in late:
        if is_corrected(one, choice, log.where, is_one_clock=is_one_clock):
            t, values = signals[one.channel]
            corrected[one.channel] = Signal(t - one.delay, values)
            notes.append(f"{one.evidence}; corrected")
        else:
            notes.append(f"{one.evidence}; left as logged")
    return on_one_clock(corrected, log.where), notes


def _complete(log: Log, recordings: Sequence[Recording]) -> None:
    """Order the channels, and add the clock and the counts of values filled in."""
    channels = {}
    for name in QUANTITIES:
        if name in log.channels:
            channels[name] = log.channels[name]
    log.channels = channels
    for recording in recordings:
        for name, count in recording.filled.items():
            if count and name in channels:
                log.repaired[name] = count
    first = recordings[0]
    if first.start is not None:
        zone = first.locator.columns["t"].zone
        log.start = first.start + zone_seconds(zone, log.where)
