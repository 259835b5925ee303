"""Files of one log that were not written at one time."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from shipgym.trials.plausibility.refusal import implausible
from shipgym.trials.resampling import Signal


class _Span(NamedTuple):
    """First and last time at which channels were logged, s."""

    begin: float
    end: float

    def overlaps(self, other: "_Span", shift: float = 0.0) -> bool:
        """Return whether this span, moved back by `shift`, overlaps another."""
        return self.begin - shift < other.end and self.end - shift > other.begin


def check_overlap(
    signals: Mapping[str, Signal],
    others: Mapping[str, Signal],
    path: Path,
    column: str,
) -> None:
    """Refuse a file that does not overlap in time with the others, all on one clock, s.

    `path` and `column` are that file and its column of the time.
    """
    own = _span(signals)
    other = _span(others)
    if other.overlaps(own):
        return

    half_hour = 1800.0
    largest_zone = 14.0 * 3600.0
    middle_apart = (other.begin + other.end - own.begin - own.end) / 2.0
    shift = half_hour * round(middle_apart / half_hour)
    remedy = "name files that were written at the same time"
    if abs(shift) <= largest_zone and other.overlaps(own, shift):
        zone = _zone(shift)
        remedy = (
            "likely its clock is in another time zone: write"
            f' t = {{ column = "{column}", zone = "{zone}" }}'
        )
    apart = other.begin - own.begin
    raise implausible(
        str(path),
        "expected a file of the same time as the other of this log, got one that"
        f" begins {apart:.6g} s after it and does not overlap with it",
        remedy,
    )


def _span(signals: Mapping[str, Signal]) -> _Span:
    begins = []
    ends = []
    for signal in signals.values():
        begins.append(float(signal.t[0]))
        ends.append(float(signal.t[-1]))
    return _Span(min(begins), max(ends))


def _zone(shift: float) -> str:
    """A time zone as text, such as "+05:30"."""
    sign = "-" if shift < 0.0 else "+"
    hours, minutes = divmod(int(abs(shift) // 60.0), 60)
    return f"{sign}{hours:02d}:{minutes:02d}"
