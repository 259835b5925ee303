"""From the tables of one log to channels in SI units with the project's signs, frame and origin."""

from collections.abc import Mapping, Sequence
from typing import Any

from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.trials.clock_texts import zone_seconds
from shipgym.trials.conventions import Conventions
from shipgym.trials.late_channels import (
    LateChannel,
    find_late_channels,
    is_corrected,
)
from shipgym.trials.midship import to_project_conventions
from shipgym.trials.plausibility.agreement import check_velocity, check_yaw_rate
from shipgym.trials.plausibility.finding import settle
from shipgym.trials.plausibility.over_ground import (
    check_over_ground,
    velocity_over_ground,
)
from shipgym.trials.plausibility.overlap import check_overlap
from shipgym.trials.plausibility.rudder import check_has_rudder
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


def import_tables(
    tables: Sequence[LogTable],
    columns: Mapping[str, Any] | None,
    conventions: Conventions,
) -> Log:
    """Read channels from the tables of one log, as a rule one.

    The columns are given as :func:`shipgym.trials.columns.choose_columns` takes them.
    The channels have the project's signs and are in the body frame, at midship.
    Anything wrong with a file is an InputError that names line, column, value and
    remedy.
    """
    is_part = len(tables) > 1
    recordings = [
        read_recording(table, columns, conventions.repair, part=is_part)
        for table in tables
    ]
    first = recordings[0]
    signals = _joined(recordings) if is_part else first.signals
    if conventions.rudder_positive == "port":
        _turn_rudder(signals)

    log = on_one_clock(signals, first.locator.path)
    has_positions = any(one.has_positions for one in recordings)
    remarks = _check_motion(log, first, conventions, has_positions=has_positions)
    late = find_late_channels(log)
    if late:
        log, notes = _corrected(log, signals, late, conventions)
        remarks += notes
    reader_notes = [note for table in tables for note in table.notes]
    log.notes = [*reader_notes, *log.notes, *remarks]

    _check_agreement(log, first, conventions)
    to_project_conventions(log, conventions)
    log.channels = {
        name: log.channels[name] for name in QUANTITIES if name in log.channels
    }
    log.repaired = _filled(recordings, log)
    if first.start is not None:
        zone = first.locator.columns["t"].zone
        log.start = first.start + zone_seconds(zone, log.where)
    return log


def _joined(recordings: Sequence[Recording]) -> Signals:
    """Channels of all files of a log on the clock of the first."""
    base = recordings[0]
    signals = dict(base.signals)
    for other in recordings[1:]:
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
        moved = {
            name: Signal(t + shift, values)
            for name, (t, values) in other.signals.items()
        }
        column = other.locator.columns["t"].name
        settle(check_overlap(signals, moved, path, column))
        signals |= moved
    return signals


def _turn_rudder(signals: Signals) -> None:
    """Make a rudder that is positive to port positive to starboard."""
    for name in ("delta", "delta_command"):
        if name in signals:
            t, values = signals[name]
            signals[name] = Signal(t, 0.0 - values)


def _check_motion(
    log: Log, first: Recording, conventions: Conventions, *, has_positions: bool
) -> list[str]:
    """Remarks on rudder, time and motion over ground; InputError for what cannot be right."""
    remarks = []
    if has_positions:
        remarks += settle(check_has_rudder(log))
    if not is_usual(usual_step(log.t)):
        remarks += settle(check_steps(log.t, first.locator))
    velocity = velocity_over_ground(log, has_positions=has_positions)
    if velocity is not None:
        findings = check_over_ground(
            log, velocity, conventions.installation, first.locator
        )
        remarks += settle(findings)
    return remarks


def _check_agreement(log: Log, first: Recording, conventions: Conventions) -> None:
    """Refuse channels that contradict each other."""
    channels = log.channels.keys()
    if {"psi", "r"} <= channels:
        settle(check_yaw_rate(log, first.locator))
    if {"x", "y", "psi", "u", "v"} <= channels:
        settle(check_velocity(log, conventions.velocity_frame, first.locator))


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


def _filled(recordings: Sequence[Recording], log: Log) -> dict[str, int]:
    """How many values of each channel of a log were filled in, where some were."""
    counts = {}
    for recording in recordings:
        for name, count in recording.filled.items():
            if count and name in log.channels:
                counts[name] = count
    return counts
