"""Guesses of the column of a log that holds a channel, and of its unit."""

import re
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache, lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.files import shipped_toml
from shipgym.trials.clock_texts import unit_since_1970
from shipgym.trials.column_values import without_sentinels
from shipgym.trials.columns import ColumnGuess
from shipgym.trials.guesses.steering import steering_command
from shipgym.trials.readers.cell_texts import units_in_cell
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.units import (
    QUANTITIES,
    UNITS,
    si_unit,
    spelled_units,
    split_unit,
)

#: Size from which on a channel or quantity is not in SI units, and the unit that it has
#: then.
_BY_SIZE = {
    "delta": (1.0, "deg"),
    "delta_command": (1.0, "deg"),
    "phi": (1.0, "deg"),
    "angle": (6.3, "deg"),
    "angular rate": (0.2, "deg/min"),
    "shaft speed": (10.0, "rpm"),
}
#: Days from 1954 to 2119 in spreadsheets, from 1916 in MATLAB.
_DAYS = {
    "excel days": (20_000.0, 80_000.0),
    "matlab days": (7e5, 8e5),
    "days": (-1.0, 2.0),
}


_FROM_SIZE = "from its size"
#: Stands for a unit that is none of those which are known.
UNKNOWN = "?"
#: What stands in brackets behind a name and is no unit.
_QUALIFIERS = re.compile(
    r"\W*|[a-z]|true|mag(netic)?|port|st(ar)?b(oar)?d|left|right|[spnew]\+|\+.*|gps|gnss"
    r"|imu|ins|gyro|log|utc.*|gmt.*|local.*|lt|avg|mean|min|max|raw|act(ual)?|ist|soll"
    r"|feedback|order|set|body|earth|ground|water|north|east|main|\d+|iso.*"
    r"|[ymdhs:./ -]+|.*(over|through|water|ground|north).*|unitless|none|string|float.*"
)
#: Units that a name may have in round brackets too.
_FOREIGN = re.compile(
    r".*[%‰/].*|gon|mils?|percent|pct|prozent|counts?|ticks|steps|turns|m?v|ma|bits?"
    r"|bft|beaufort|yds?|yards|cables?"
)


class UnitGuess(NamedTuple):
    """A unit, and why."""

    unit: str
    reason: str = "from its name"


def named_unit(
    units: list[str], channel: str, reason: str = "from its name"
) -> UnitGuess | None:
    """Unit of a channel among those with which a name ends; None if there is none."""
    quantity = QUANTITIES[channel]
    of_channel = UNITS[quantity]
    fitting = (UnitGuess(unit, reason) for unit in units if unit in of_channel)
    return next(fitting, None)


def unknown_unit(name: str) -> str | None:
    """Text in brackets at the end of a name that is a unit, but none that is known."""
    match = re.search(r"([\[(])\s*([^\[\]()]*?)\s*[\])]\s*$", name)
    if match is None or spelled_units(match[2]):
        return None
    is_unit = _FOREIGN.fullmatch(match[2]) is not None
    is_square = match[1] == "[" and not _QUALIFIERS.fullmatch(match[2])
    return match[2] if is_unit or is_square else None


def unit_by_size(values: Floats | None, channel: str) -> UnitGuess:
    """SI unit of a channel unless its largest value is too large for that.

    Values that are texts are None.
    """
    unit = si_unit(channel)
    if values is None:
        return UnitGuess(unit, "from its content")
    if channel == "t":
        return _time_by_size(values)
    known = values[np.isfinite(values)]
    largest = np.abs(known).max(initial=0.0)
    of_quantity = _BY_SIZE.get(QUANTITIES[channel], (np.inf, ""))
    limit, other = _BY_SIZE.get(channel, of_quantity)
    if largest > limit:
        unit = other
    return UnitGuess(unit, f"{_FROM_SIZE}, up to {largest:.4g}")


def _time_by_size(values: Floats) -> UnitGuess:
    """Unit of times by their size and by how far the rows are apart."""
    known = values[np.isfinite(values)]
    least, largest = known.min(initial=np.inf), known.max(initial=0.0)
    steps = np.diff(known)
    step = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 1.0
    found = "s"
    for days, (first, last) in _DAYS.items():
        # apart by less than three minutes, and far less than a row in seconds
        if first < least and largest < last and step < 2e-3:
            found = days
    for finer in ("ns", "us", "ms"):
        if step > 20.0 and 0.005 <= step * UNITS["time"][finer] <= 20.0:
            found = finer
    since_1970 = unit_since_1970(float(least)) if known.size else None
    if since_1970 and step * UNITS["time"][since_1970] < 3600.0:
        found = since_1970
    by_step = f"{_FROM_SIZE}, up to {largest:.4g}, and rows {step:.3g} apart"
    return UnitGuess(found, by_step)


RUDDERS = ("delta", "delta_command")
#: Channels that stand still in no trial.
_MOVING = ("t", "psi", "cog", "r", *RUDDERS)
#: Words of a path whose x, y and z are no positions.
_NO_PLACE = re.compile(
    r"orientation|quaternion|angular|accel|magnetic|rotation|linear|velocity|twist|wind"
)
_SIGNAL_K = re.compile(r"(navigation|steering|propulsion|environment)\.", re.IGNORECASE)
#: Devices, whose names may stand before that of what they measure.
_DEVICE = re.compile(r"(gps|gnss|ais|log|nav|ins|ship|vessel|own|main) (?=..)")
_TIME_OF_DAY = re.compile(r"\d\d?:\d\d.*")
_DATE = re.compile(r"\d+\W+\w+\W+\d+.*|\d{6}|\d{8}")
#: Words in the name of another quantity than the rest of the name says.
_OTHER_QUANTITY = {
    *("acc", "accel", "acceleration", "reset", "relative", "apparent", "counter"),
    *("covariance", "variance", "bias", "valid", "temp", "temperature", "gain"),
}
_ASKED_FOR = re.compile(
    r"(^|[^a-z])(des|desired|dem|target|tgt|ref|set|cmd)(yaw|head|hdg|course|turn|speed)"
)
#: Words in the name of what a ship should do, or of what is no measured value.
_NO_MEASUREMENT = {
    *("set", "setpoint", "sp", "desired", "target", "command", "commanded", "cmd"),
    *("order", "ordered", "ref", "reference", "demand", "error", "err", "rate"),
    *("std", "accuracy", "deviation", "variation", "raw", "quality", "status"),
    *("mode", "header"),
}
#: Last letters or numbers of the columns w, x, y and z of a quaternion.
_QUATERNIONS = ("wxyz", "0123", "1234")


@cache
def _column_names() -> dict[str, dict[str, list[str]]]:
    """Names of columns by channel, as `fnmatch` patterns in the order of trial.

    Those of "known" channels, "with_unit" only beside a unit of the channel, and
    "units" that a name has by definition.
    """
    languages = shipped_toml("shipgym.trials.guesses", "column_names.toml")
    names = {key: languages.pop(key) for key in ("with_unit", "units")}
    known: dict[str, list[str]] = {}
    for language in languages.values():
        for channel, patterns in language.items():
            known.setdefault(channel, []).extend(patterns)
    return names | {"known": known}


def guess_columns(table: LogTable) -> list[ColumnGuess]:
    """Guess the column of each channel by its name; empty where no name is known.

    A column whose name ends with a unit of another quantity is not taken: a gyro in
    deg/s shows no heading.
    """
    known = _column_names()["known"]
    free = list(table.header)
    guesses: dict[str, ColumnGuess] = {}

    def take(channel: str, patterns: str, *, still: bool = False) -> None:
        found = _first_match(table, free, channel, known[patterns], still=still)
        if found is not None:
            guesses[channel] = found
            free.remove(found.name)

    for channel in known:
        if channel == "n" and guesses.keys().isdisjoint(RUDDERS):
            command = steering_command(table, free)
            if command is not None:
                guesses["delta"] = command
        is_speed_alone = channel == "v" and "u" not in guesses
        is_channel = channel in QUANTITIES and not is_speed_alone
        if is_channel:
            take(channel, channel)
    if guesses.keys().isdisjoint(RUDDERS):
        take("delta", "delta", still=True)
    if "psi" not in guesses:
        attitude = _quaternion(table, free)
        if attitude is None:
            take("psi", "course")
        else:
            guesses["psi"] = attitude
    elif "cog" not in guesses:
        take("cog", "course")
    alone = "sog" if "cog" in guesses else "stw"
    has_speed = not guesses.keys().isdisjoint(("sog", "u", alone))
    if not has_speed:
        take(alone, "speed")
    if "t" in guesses:
        guesses["t"] = _with_date(table, guesses["t"], free)
    _guess_speeds(table, guesses)
    return [guesses[channel] for channel in known if channel in guesses]


def _guess_speeds(table: LogTable, guesses: dict[str, ColumnGuess]) -> None:
    """Take the usual unit of speeds that neither a name nor positions tell.

    A speed over ground without its course is not compared with positions.
    """
    channels = ["sog", "stw", "u", "v"]
    if not guesses.keys().isdisjoint(("lat", "x")):
        channels = [] if "cog" in guesses else ["sog"]
    found = [guesses[channel] for channel in channels if channel in guesses]
    unknown = [one for one in found if one.reason.startswith(_FROM_SIZE)]
    columns = [np.array(table.likely_numbers(one.name), float) for one in unknown]
    largest = max((np.nanmax(np.abs(column)) for column in columns), default=0.0)
    is_si = any(guess.unit in ("rad", "rad/s") for guess in guesses.values())
    fastest = 15.0 if is_si else 3.0  # that is likelier in m/s
    beside = ", with angles in rad" if is_si else ""
    reason = (
        f"is a guess: no positions tell, up to {largest:.4g}{beside}; knots, m/s or"
        " km/h"
    )
    unit = "m/s" if largest <= fastest else "knots"
    for one in unknown:
        guesses[one.channel] = replace(one, unit=unit, reason=reason)


def _quaternion(table: LogTable, free: list[str]) -> ColumnGuess | None:
    """A heading of four columns of one name whose squares sum to 1; or None."""
    for first, endings in product(free, _QUATERNIONS):
        stem, found, bracket = first.rpartition(endings[0])
        names = [stem + one + bracket for one in endings]
        if not found or not set(names) <= {*free}:
            continue
        parts = [table.likely_numbers(name) for name in names]
        known = [one for one in parts if one is not None]
        if len(known) < 4:
            continue
        length = np.sum(np.square(known), axis=0)
        is_unit = np.abs(length[np.isfinite(length)] - 1.0) < 0.02
        moves = np.nanstd(known[0]) > 1e-6
        if moves and np.mean(is_unit) > 0.99:
            return ColumnGuess(
                names[0],
                "rad",
                quaternion=tuple(names[1:]),
                channel="psi",
                reason="of a quaternion, whose four columns have length 1",
            )
    return None


def _first_match(
    table: LogTable,
    free: list[str],
    channel: str,
    patterns: list[str],
    *,
    still: bool,
) -> ColumnGuess | None:
    """Guess of a channel by the first of its patterns that a column has.

    Unless it may stand `still`, a column that never changes is no rudder or heading.
    """
    fitting: list[ColumnGuess] = []
    for column in free:
        unit = _unit_where_fitting(table, column, channel)
        if unit is not None and _may_be(table, column, channel, still=still):
            fitting.append(ColumnGuess(column, channel=channel, **unit._asdict()))
    fitting.sort(key=lambda one: one.unit == UNKNOWN)
    of_unit = _column_names()["with_unit"].get(channel, [])
    for pattern in (*patterns, *of_unit):
        for guess in fitting:
            may_be = guess.is_named or pattern not in of_unit
            if may_be and _is_named(guess.name, channel, pattern):
                return guess
    return None


def _unit_where_fitting(table: LogTable, column: str, channel: str) -> UnitGuess | None:
    """Unit of a column, were it a channel's; None where it is of another quantity."""
    name = _spaced(column)
    if _is_no_measurement(name, channel):
        return None
    unit = unknown = None
    for text, reason in (
        (name, "from its name"),
        (f"x [{_spaced(table.unit_row.get(column, ''))}]", "from the row of units"),
    ):
        units = split_unit(text).units
        named = named_unit(units, channel, reason)
        # a single letter may be no unit, as in "Heading M"
        if named is None and any(len(one) > 1 for one in units):
            return None
        unit = named or unit
        unknown = unknown or unknown_unit(text)
    if unit is None and unknown is not None:
        return UnitGuess(UNKNOWN, f"'{unknown}' is not known")
    if unit is None and channel == "t":
        glued = re.search(r"(?:time|stamp|clock)s?([mun]s)$", name)
        unit = UnitGuess(glued[1]) if glued else None
    if unit is not None and (channel != "t" or _is_duration(table, column, unit)):
        return unit
    in_cells = units_in_cell(table.first_text(column))
    named = named_unit(in_cells, channel, "from its cells")
    return named or _unit_by_size(table, column, channel)


def _is_no_measurement(name: str, channel: str) -> bool:
    """Return whether words of a name are those of another quantity, or of an order."""
    words = {*re.findall(r"[^\W\d_]+", name)}
    if words & _OTHER_QUANTITY or _ASKED_FOR.search(name):
        return True
    may_be_ordered = channel in ("psi", "sog", "stw", "cog")
    return may_be_ordered and not words.isdisjoint(_NO_MEASUREMENT)


def _unit_by_size(table: LogTable, column: str, channel: str) -> UnitGuess:
    """Unit of a column whose name tells none, by its recorder or its values."""
    if _SIGNAL_K.match(column) and channel not in ("t", "lat", "lon"):
        size = unit_by_size(None, channel)
        return size._replace(reason="paths of Signal K are in SI units")
    values = table.likely_numbers(column)
    if values is not None and np.nanmax(np.abs(values), initial=0.0) < 6.3:
        for unit, patterns in _column_names()["units"].items():
            plain = _plain(column.lower())
            named = named_unit([unit], channel, "of its recorder, by its name")
            if named and any(fnmatchcase(plain, pattern) for pattern in patterns):
                return named
    if values is not None and channel != "t":
        values, _ = without_sentinels(channel, values, factor=1.0)
    return unit_by_size(values, channel)


def _may_be(table: LogTable, column: str, channel: str, *, still: bool) -> bool:
    """Return whether the values of a column may be a channel's, whatever its name."""
    values = table.likely_numbers(column)
    if values is None:  # texts, such as times and positions
        return True
    known = values[np.isfinite(values)]
    has_to_move = channel in _MOVING and not still
    if known.size < 3 or (has_to_move and np.ptp(known) == 0.0):
        return False
    largest_change_deg = 20.0  # of positions in a log
    if channel in ("lat", "lon") and np.abs(known).max() < 360.0:
        low, high = np.quantile(known, [0.02, 0.98])
        return bool(high - low < largest_change_deg)
    goes_back = np.mean(known < -0.5) > 0.05
    return not (channel in ("sog", "stw", "wind_speed") and goes_back)


def _is_duration(
    table: LogTable,
    column: str,
    unit: UnitGuess,
) -> bool:
    """Return whether times may be in the unit of their name, and do not need another.

    Seconds of 1.7e9 count from 1970.
    """
    values = table.likely_numbers(column)
    if values is None:
        return False
    by_size = unit_by_size(values, "t").unit
    if unit.unit == "s":
        return by_size in ("s", "ms", "us", "ns")
    return by_size != f"unix {unit.unit}"


def _with_date(table: LogTable, time: ColumnGuess, free: list[str]) -> ColumnGuess:
    """The time with the column of its date where there is one."""
    if not _TIME_OF_DAY.fullmatch(table.first_text(time.name)):
        return time
    for pattern in _column_names()["known"]["date"]:
        for column in free:
            is_named = _is_named(column, "t", pattern)
            date = table.first_text(column)
            if is_named and _DATE.fullmatch(date):
                free.remove(column)
                return replace(time, date=column)
    return time


@lru_cache(maxsize=10_000)
def _forms(column: str, channel: str) -> list[str]:
    """The name of a column without blanks: whole, without its unit, its last part.

    Only the beginning of one that is longer than any name.
    """
    column = column[:200]
    text = column.lower().replace("_", " ")
    bare, units = split_unit(text)
    forms = [text]
    if "(:," not in column:  # of a matrix
        forms.append(re.sub(r"[\[(].*", "", text))
    if named_unit(units, channel) is not None:
        forms.append(bare)
    is_path = re.search(r"[^\W\d_][./:][^\W\d_]", column)
    if is_path and " " not in column:
        last = re.split(r"[./:]", text)[-1]
        if len(last) > 1 or not _NO_PLACE.search(text):
            forms.append(last)
    forms += [_DEVICE.sub("", form, count=1) for form in forms]
    return [_plain(form) for form in dict.fromkeys(forms)]


def _spaced(name: str) -> str:
    """A name in lower case with blanks for underscores and before its capitals."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", " ", name)
    return apart.replace("_", " ").lower()


def _plain(name: str) -> str:
    return re.sub(r"[ ._()\[\]#%:/'\"-]", "", name)


def _is_named(column: str, channel: str, pattern: str) -> bool:
    return any(fnmatchcase(form, pattern) for form in _forms(column, channel))
