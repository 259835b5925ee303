"""Files of one log that were not written at one time."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from shipgym.trials.plausibility.finding import LogFinding
from shipgym.trials.resampling import Signal

_HALF_HOUR_S = 1800.0
_LARGEST_ZONE_S = 14.0 * 3600.0


def check_overlap(
    signals: Mapping[str, Signal],
    others: Mapping[str, Signal],
    path: Path,
    column: str,
) -> Iterator[LogFinding]:
    """Find a file that does not overlap in time with the others, all on one clock, s.

    `path` and `column` are that file and its column of the time.
    """
    first, last = _span(signals)
    begin, end = _span(others)
    if begin < last and end > first:
        return
    middle_apart = (begin + end - first - last) / 2.0
    shift = _HALF_HOUR_S * round(middle_apart / _HALF_HOUR_S)
    would_overlap = begin - shift < last and end - shift > first
    remedy = "name files that were written at the same time"
    if would_overlap and abs(shift) <= _LARGEST_ZONE_S:
        remedy = (
            f'likely its clock is in another time zone: write t = {{ column = "{column}",'
            f' zone = "{_zone(shift)}" }}'
        )
    yield LogFinding(
        where=str(path),
        evidence=(
            "expected a file of the same time as the other of this log, got one that"
            f" begins {begin - first:.6g} s after it and does not overlap with it"
        ),
        remedy=remedy,
    )


def _span(signals: Mapping[str, Signal]) -> tuple[float, float]:
    clocks = [signal.t for signal in signals.values()]
    first = min(clock[0] for clock in clocks)
    last = max(clock[-1] for clock in clocks)
    return float(first), float(last)


def _zone(shift: float) -> str:
    """A time zone as text, such as "+05:30"."""
    sign = "-" if shift < 0.0 else "+"
    hours, minutes = divmod(int(abs(shift) // 60.0), 60)
    return f"{sign}{hours:02d}:{minutes:02d}"
