"""Times that a recorder puts before each line: TAG blocks, dates, clocks, seconds."""

import re
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.clock_texts import read_clock, unit_since_1970
from shipgym.trials.units import UNITS

_TAG = re.compile(r"[\\,]c:(\d{9,14}(?:\.\d+)?)")
_CLOCK = re.compile(
    r"(?<!\d)(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})?[-T ,;_Z]*"
    r"(\d\d?:\d\d:\d\d(?:[.,]\d+)?)"
    r" ?(Z|UTC|[+-]\d\d:?\d\d)?"
)
#: Seconds or fractions of them since 1970, or seconds with decimals since some start.
_NUMBER = re.compile(r"(?<![\w.:/-])A?(\d{9,19}(?:\.\d+)?|\d+\.\d+)(?![\w.:/])")


def stamp_text(before: str) -> str:
    r"""The time in what a recorder wrote before a message; empty where there is none.

    Examples are ``2021-05-03 09:59:50.123``, ``[12:00:01]``, ``1620035990123;A;``,
    ``(1620035990.123) can0`` and ``\s:gyro,c:1620035990*3F\``.
    """
    tag = _TAG.search(before)
    if tag is not None:
        return tag[1]
    clock = _CLOCK.search(before)
    if clock is None:
        number = _NUMBER.search(before)
        return "" if number is None else number[1]
    date, time, zone = clock.groups("")
    if date[:4].isdigit():
        date = re.sub("[/.]", "-", date)
    zone = "" if zone in ("Z", "UTC") or not date else zone
    return f"{date} {time.replace(',', '.')}{zone}".strip()


def read_stamps(texts: Sequence[str]) -> Floats:
    """Seconds since 1970, of the day or since some start, nan for another form.

    Numbers that are too large for seconds are milli-, micro- or nanoseconds.
    """
    is_clock = np.array([":" in text for text in texts], dtype=bool)
    seconds = np.full(len(texts), np.nan)
    mostly_clocks = is_clock.mean() > 0.5
    rows = np.flatnonzero(is_clock == mostly_clocks)
    chosen = [texts[row] for row in rows.tolist()]
    if not mostly_clocks:
        numbers = np.array(chosen, dtype=np.float64)
        unit = unit_since_1970(float(np.median(numbers)))
        seconds[rows] = numbers * UNITS["time"][unit or "s"]
        return seconds
    with suppress(ValueError):  # such as 25:00:00
        seconds[rows] = read_clock(chosen)
    return seconds
