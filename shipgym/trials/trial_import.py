"""Conversion of the tables of a log to channels in SI units, at midship."""

import math
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
from shipgym.trials.plausibility.agreement import (
    check_steps,
    check_velocity,
    check_yaw_rate,
)
from shipgym.trials.plausibility.frozen import frozen_heading
from shipgym.trials.plausibility.over_ground import check_over_ground
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.recording import Recording, read_recording
from shipgym.trials.resampling import (
    Log,
    Signal,
    Signals,
    on_one_clock,
    share_clock,
)
from shipgym.trials.rudder_sign import check_rudder_sign
from shipgym.trials.units import QUANTITIES

_NO_RUDDER = (
    "no rudder angle in this log: without rudder nothing can be identified from it, it"
    " can only be looked at; log the rudder too (in NMEA 0183 the sentence RSA)"
)
_NO_HEADING = (
    "no heading in this log: without it turning and drift cannot be told, and nothing"
    " can be identified; log the heading too (in NMEA 0183 the sentence HDT)"
)

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
    recordings = []
    remarks: list[str] = []
    for table in tables:
        recording = read_recording(table, columns, conventions.repair, part=is_part)
        recordings.append(recording)
        remarks += [*table.notes, *recording.notes]

    first, *others = recordings
    signals = dict(first.signals)
    for other in others:
        signals |= _on_first_clock(other, first, signals)
    if conventions.rudder_positive == "port":
        _turn_rudder(signals)
    if conventions.frame == "enu":
        _turn_frame(signals, recordings, conventions.velocity_frame)

    log = on_one_clock(signals, first.locator.path)
    motion_remarks = _check_motion(log, recordings, conventions)
    late = find_late_channels(log)
    if late:
        log, clock_remarks = _corrected(log, signals, late, conventions)
        motion_remarks += clock_remarks
    _check_agreement(log, first.locator, conventions)
    check_rudder_sign(log)

    is_magnetic = any(table.magnetic for table in tables)
    offset = conventions.installation.heading_offset
    log.magnetic = is_magnetic and offset == 0.0
    if log.magnetic:
        remarks.append(_MAGNETIC)
    log.notes = remarks + log.notes + motion_remarks
    to_project_conventions(log, conventions)
    _complete(log, recordings)
    return log


def _on_first_clock(
    other: Recording,
    first: Recording,
    known: Signals,
) -> Signals:
    """Channels of another file of a log on the clock of the first one.

    Raises InputError for channels that are known already, and for other times.
    """
    path = other.locator.table.path
    if (first.start is None) != (other.start is None):
        raise InputError(
            f"{path}: expected times that count from one moment in all files of"
            " this log, got clock times in one of two only"
        )
    repeated = known.keys() & other.signals.keys()
    if repeated:
        names = quoted(sorted(repeated))
        raise InputError(
            f"{path}: expected each channel in one file of this log, got"
            f" {names} again; name the file of the one to read: {{ column = ..., file ="
            f' "{path.name}" }}'
        )

    first_start = first.start or 0.0
    other_start = other.start or 0.0
    shift = other_start - first_start
    moved = {}
    for name, (t, values) in other.signals.items():
        moved[name] = Signal(t + shift, values)
    time_column = other.locator.columns["t"]
    _check_overlap(known, moved, str(path), time_column.name)
    return moved


def _check_overlap(known: Signals, moved: Signals, path: str, column: str) -> None:
    """Refuse a file that does not overlap in time with the others, all on one clock, s.

    `column` is its column of the time.
    """
    (begin, end), (other_begin, other_end) = map(_span, (known, moved))
    if other_begin < end and other_end > begin:
        return
    half_hour = 1800.0
    largest_zone = 14.0 * 3600.0
    shift = half_hour * round((other_begin + other_end - begin - end) / 2.0 / half_hour)
    remedy = "name files that were written at the same time"
    overlaps = other_begin - shift < end and other_end - shift > begin
    if abs(shift) <= largest_zone and overlaps:
        sign = "-" if shift < 0.0 else "+"
        hours, minutes = divmod(int(abs(shift) // 60.0), 60)
        remedy = (
            "likely its clock is in another time zone: write"
            f' t = {{ column = "{column}", zone = "{sign}{hours:02d}:{minutes:02d}" }}'
        )
    raise InputError(
        f"{path}: expected a file of the same time as the other of this log, got one"
        f" that begins {other_begin - begin:.6g} s after it and does not overlap with"
        f" it; {remedy}"
    )


def _span(signals: Signals) -> tuple[float, float]:
    """First and last time of channels, s."""
    begins = [float(signal.t[0]) for signal in signals.values()]
    ends = [float(signal.t[-1]) for signal in signals.values()]
    return min(begins), max(ends)


def _turn_rudder(signals: Signals) -> None:
    """Make a rudder that is positive to port positive to starboard."""
    for name in signals.keys() & {"delta", "delta_command"}:
        signal = signals[name]
        signals[name] = signal._replace(values=0.0 - signal.values)


def _turn_frame(
    signals: Signals, recordings: Sequence[Recording], velocity_frame: str
) -> None:
    """Make angles that count from east to port those from north to starboard.

    As ROS has them: x east and y north, body forward and to port.
    """
    in_body = velocity_frame == "body"
    to_port = {"psi", "r", "Y", "N", "v"} if in_body else {"psi", "r", "Y", "N"}
    for name in signals.keys() & to_port:
        signal = signals[name]
        zero = 0.5 * math.pi if name == "psi" else 0.0
        signals[name] = signal._replace(values=zero - signal.values)

    pairs = [] if in_body else [("u", "v")]
    if not any("lat" in one.locator.columns for one in recordings):
        pairs.append(("x", "y"))
    for east, north in pairs:
        if {east, north} <= signals.keys():
            signals[east], signals[north] = signals[north], signals[east]


def _check_motion(
    log: Log, recordings: Sequence[Recording], conventions: Conventions
) -> list[str]:
    """Remarks on rudder, time and motion over ground, refused where impossible."""
    locator = recordings[0].locator
    has_positions = False
    for recording in recordings:
        columns = recording.locator.columns
        has_positions |= "lat" in columns

    remarks = []
    if not log.has("delta") and not log.has("delta_command") and not log.has("X"):
        remarks.append(_NO_RUDDER)
    if not log.has("psi") and not log.has("r"):
        remarks.append(_NO_HEADING)
    remarks += frozen_heading(log)
    remarks += check_steps(log.t, locator)
    if has_positions or log.has("ground_north"):
        remarks += check_over_ground(log, conventions, locator)
    return remarks


def _check_agreement(log: Log, locator: Locator, conventions: Conventions) -> None:
    """Refuse channels that contradict each other."""
    if log.has("psi", "r"):
        check_yaw_rate(log, locator)
    if log.has("x", "y", "psi", "u", "v"):
        check_velocity(log, conventions.velocity_frame, locator)


def _corrected(
    log: Log,
    signals: Signals,
    late: Sequence[LateChannel],
    conventions: Conventions,
) -> tuple[Log, list[str]]:
    """The log with late channels corrected where asked, and remarks on all."""
    choice = conventions.installation.clock_offsets
    is_one_clock = share_clock(signals)
    corrected = dict(signals)
    remarks = []
    for one in late:
        treatment = "left as logged"
        if is_corrected(one, choice, log.where, is_one_clock=is_one_clock):
            treatment = "corrected"
            signal = signals[one.channel]
            corrected[one.channel] = signal._replace(t=signal.t - one.delay)
        remarks.append(f"{one.evidence}; {treatment}")
    return on_one_clock(corrected, log.where), remarks


def _complete(log: Log, recordings: Sequence[Recording]) -> None:
    """Order the channels, and add the clock and the counts of values filled in."""
    ordered = {}
    for name in QUANTITIES:
        values = log.channels.get(name)
        if values is not None:
            ordered[name] = values
    log.channels = ordered

    for recording in recordings:
        for name, count in recording.filled.items():
            if count and name in ordered:
                log.repaired[name] = count

    first = recordings[0]
    if first.start is not None:
        time_column = first.locator.columns["t"]
        ahead = zone_seconds(time_column.zone, log.where)
        log.start = first.start + ahead
