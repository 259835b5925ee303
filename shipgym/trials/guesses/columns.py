"""Guesses of the column of a log that holds a channel, by its name."""

import json
import re
from collections.abc import Iterable
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from shipgym.files import shipped_toml
from shipgym.trials.column_values import without_sentinels
from shipgym.trials.columns import Column
from shipgym.trials.guesses.attitudes import Quaternion, quaternion
from shipgym.trials.guesses.steering import other_rudder, steering_command
from shipgym.trials.guesses.units import (
    UNKNOWN,
    UnitGuess,
    named_unit,
    names_another_quantity,
    unit_by_size,
    unknown_unit,
)
from shipgym.trials.readers.cell_texts import number_with_unit
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.units import QUANTITIES, spelled_units, split_unit

_WITH_UNIT = "with_unit"  # not a language
#: Channels that stand still in no trial.
_MOVING = ("t", "psi", "cog", "r", "delta", "delta_command")
#: Words of a path whose x, y and z are no positions.
_OF_TURNS = re.compile(r"orientation|quaternion|angular|accel|magnetic|rotation")
_SIGNAL_K = re.compile(r"(navigation|steering|propulsion|environment)\.", re.IGNORECASE)
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
    *(
        "std",
        "accuracy",
        "deviation",
        "variation",
        "raw",
        "quality",
        "status",
        "mode",
        "header",
    ),
}


class ColumnGuess(NamedTuple):
    """The column and unit of a channel, and why that unit."""

    channel: str
    column: str
    unit: str
    reason: str
    #: other keys of the declaration
    extra: tuple[tuple[str, str | float | tuple[str, ...]], ...] = ()

    @property
    def is_named(self) -> bool:
        """True if the column's name ends with the unit."""
        return UnitGuess(self.unit, self.reason).is_named

    @property
    def quoted(self) -> str:
        """The name of the column as TOML has it."""
        return json.dumps(self.column, ensure_ascii=False)

    @property
    def declaration(self) -> str:
        """The column as the ship file declares it."""
        parts = [f"column = {self.quoted}"]
        parts.append(f'unit = "{self.unit}"')
        for key, value in self.extra:
            written = json.dumps(value, ensure_ascii=False)
            parts.append(f"{key} = {written}")
        joined = ", ".join(parts)
        return f"{{ {joined} }}"

    @property
    def as_column(self) -> Column:
        """The column for the reader."""
        keys = dict[str, object](self.extra)
        return Column(self.column, self.unit, **keys)  # type: ignore[arg-type]


class _Names(NamedTuple):
    """Names of columns by channel, as `fnmatch` patterns in the order of trial."""

    known: dict[str, list[str]]
    with_unit: dict[str, list[str]]  # only with a unit of the channel


def _column_names() -> _Names:
    languages = shipped_toml("shipgym.trials.guesses", "column_names.toml")
    with_unit = languages.pop(_WITH_UNIT)
    known: dict[str, list[str]] = {}
    for names in languages.values():
        for channel, patterns in names.items():
            others = known.get(channel, [])
            known[channel] = others + patterns
    return _Names(known, with_unit)


def guess_columns(table: LogTable) -> list[ColumnGuess]:
    """Guess the column of each channel by its name; empty where no name is known.

    A column whose name ends with a unit of another quantity is not taken: a gyro in
    deg/s shows no heading.
    """
    names = _column_names()
    free = list(table.header)
    guesses: dict[str, ColumnGuess] = {}

    def take(channel: str, patterns: str) -> None:
        found = _first_match(
            table,
            free,
            channel,
            names,
            patterns,
        )
        if found is not None:
            guesses[channel] = found
            free.remove(found.column)

    for channel in names.known:
        if channel == "n" and not {"delta", "delta_command"} & guesses.keys():
            command = steering_command(table, free)
            if command is not None:
                guesses["delta"] = ColumnGuess("delta", *command)
        is_speed_alone = channel == "v" and "u" not in guesses
        if channel in QUANTITIES and not is_speed_alone:
            take(channel, channel)
    if "psi" not in guesses:
        attitude = quaternion(table, free)
        if attitude is not None:
            guesses["psi"] = _heading_of(attitude)
            free = [one for one in free if one not in {attitude.w, *attitude.others}]
    if "psi" not in guesses:
        take("psi", "course")
    elif "cog" not in guesses:
        take("cog", "course")
    if "sog" not in guesses and "u" not in guesses:
        if "cog" in guesses:
            take("sog", "speed")
        elif "stw" not in guesses:
            take("stw", "speed")
    if "t" not in guesses:
        even = _even_column(table, free)
        if even is not None:
            guesses["t"] = even
    if "t" in guesses:
        guesses["t"] = _with_date(table, guesses["t"], free, names)
    _settle_rudder(table, guesses)
    for channel in ("delta", "delta_command"):
        if channel in guesses:
            guesses[channel] = _with_other_rudder(table, guesses[channel], free)
    return [guesses[channel] for channel in names.known if channel in guesses]


def _heading_of(attitude: Quaternion) -> ColumnGuess:
    """The heading of a quaternion."""
    reason = "of a quaternion, whose four columns have length 1"
    extra = (("quaternion", attitude.others),)
    return ColumnGuess("psi", attitude.w, "rad", reason, extra)


def _settle_rudder(table: LogTable, guesses: dict[str, ColumnGuess]) -> None:
    """Take a small rudder in degrees where the heading is and hardly changes."""
    for channel in ("delta", "delta_command"):
        guess = guesses.get(channel)
        heading = guesses.get("psi")
        if guess is None or heading is None:
            continue
        by_size = guess.reason.startswith("from its s")
        units = (guess.unit, heading.unit)
        psi = table.likely_numbers(heading.column, sided=True)
        if not by_size or units != ("rad", "deg") or psi is None:
            continue

        known = psi[np.isfinite(psi)]
        heading_deg = np.unwrap(known, period=360.0)
        turned = np.ptp(heading_deg) if known.size else 0.0
        if turned < 10.0:
            reason = (
                f"{guess.reason}, with a heading in deg that changes by"
                f" {turned:.3g} alone"
            )
            guesses[channel] = guess._replace(unit="deg", reason=reason)


def _with_other_rudder(
    table: LogTable, guess: ColumnGuess, free: list[str]
) -> ColumnGuess:
    """The mean with the rudder of the other side, where that has a column."""
    other = other_rudder(table, guess.column, free)
    if other is None:
        return guess
    free.remove(other)
    between = table.numbers(guess.column, sided=True)
    between = between - table.numbers(other, sided=True)
    difference = float(np.nanmean(between))
    reason = (
        f"{guess.reason}; the mean with '{other}', which shows {abs(difference):.2g}"
        f" {guess.unit} {'less' if difference > 0.0 else 'more'} in the mean"
    )
    return guess._replace(reason=reason, extra=(("mean_with", other),))


def _first_match(
    table: LogTable,
    free: list[str],
    channel: str,
    names: _Names,
    patterns: str,
) -> ColumnGuess | None:
    """Guess of a channel by the first of its patterns that a column has."""
    fitting: dict[str, UnitGuess] = {}
    for column in free:
        unit = _unit_where_fitting(table, column, channel)
        if unit is not None and _may_be(table, column, channel):
            fitting[column] = unit
    known_first = sorted(fitting.items(), key=lambda one: one[1].unit == UNKNOWN)
    for pattern in names.known[patterns]:
        for column, unit in known_first:
            if _matches(_forms(column, channel), [pattern]):
                return ColumnGuess(channel, column, *unit)
    for column, unit in fitting.items():
        of_unit = names.with_unit.get(channel, [])
        if unit.is_named and _matches(_forms(column, channel), of_unit):
            return ColumnGuess(channel, column, *unit)
    return None


def _unit_where_fitting(table: LogTable, column: str, channel: str) -> UnitGuess | None:
    """Unit of a column, were it a channel's; None where it is of another quantity."""
    text = _spaced(column)
    units = split_unit(text).units
    if names_another_quantity(units, channel) or _is_no_measurement(text, channel):
        return None
    unit = named_unit(units, channel)
    unknown = None if unit else unknown_unit(column.lower())
    below = table.unit_row.get(column)
    if below is not None:
        row_unit = split_unit(f"x [{_spaced(below)}]").units
        if names_another_quantity(row_unit, channel):
            return None
        unit = named_unit(row_unit, channel, "from the row of units") or unit
        unknown = unknown or (None if unit else unknown_unit(f"x [{below.lower()}]"))
    if unknown is not None:
        return UnitGuess(UNKNOWN, f"'{unknown}' is not known")
    if unit is None and channel == "t":
        glued = re.search(r"(?:time|stamp|clock)s?([mun]s)$", text)
        unit = UnitGuess(glued[1]) if glued else None
    if unit is not None and (channel != "t" or _is_duration(table, column, unit)):
        return unit
    return _unit_by_cells(table, column, channel)


def _is_no_measurement(name: str, channel: str) -> bool:
    """Return whether words of a name are those of another quantity, or of an order."""
    words = {*re.findall(r"[^\W\d_]+", name)}
    if words & _OTHER_QUANTITY or _ASKED_FOR.search(name):
        return True
    may_be_ordered = channel in ("psi", "sog", "stw", "cog")
    return may_be_ordered and not words.isdisjoint(_NO_MEASUREMENT)


def _unit_by_cells(table: LogTable, column: str, channel: str) -> UnitGuess:
    """Unit of a column whose name tells none, by its recorder or its values."""
    if _SIGNAL_K.match(column) and channel not in ("t", "lat", "lon"):
        size = unit_by_size(None, channel)
        return size._replace(reason="paths of Signal K are in SI units")
    in_cells = _unit_in_cells(table, column, channel) or _of_recorder(table, column)
    values = table.likely_numbers(column, sided=True)
    if values is not None and channel != "t":
        values, _ = without_sentinels(channel, values, factor=1.0)
    return in_cells or unit_by_size(values, channel)


def _of_recorder(table: LogTable, column: str) -> UnitGuess | None:
    """Unit that a recorder has by definition: MAVLink's attitude, ArduPilot's STER."""
    name = _plain(column.lower())
    values = table.likely_numbers(column)
    if values is None or np.nanmax(np.abs(values), initial=0.0) > 6.3:
        return None
    if name.endswith("attitudeyaw"):
        return UnitGuess("rad", "of MAVLink's attitude")
    if name.endswith("attitudeyawspeed"):
        return UnitGuess("rad/s", "of MAVLink's attitude")
    has_steering = any(one.endswith("SteerOut") for one in table.header)
    if name.endswith("turnrate") and has_steering:
        return UnitGuess("deg/s", "of ArduPilot's message STER")
    return None


def _may_be(table: LogTable, column: str, channel: str) -> bool:
    """Return whether the values of a column may be a channel's, whatever its name."""
    values = table.likely_numbers(column, sided=True)
    if values is None:  # texts, such as times and positions
        return True
    known = values[np.isfinite(values)]
    if known.size < 3:
        return False
    if channel in _MOVING and np.ptp(known) == 0.0:
        return False
    largest_change_deg = 20.0  # of positions in a log
    if channel in ("lat", "lon") and np.abs(known).max() < 360.0:
        low, high = np.quantile(known, [0.02, 0.98])
        return bool(high - low < largest_change_deg)
    goes_back = np.mean(known < -0.5) > 0.05
    return not (channel in ("sog", "stw", "wind_speed") and goes_back)


def _is_duration(table: LogTable, column: str, unit: UnitGuess) -> bool:
    """Return whether times may be in the unit of their name, and do not need another.

    Seconds of 1.7e9 count from 1970.
    """
    values = table.likely_numbers(column, sided=True)
    if values is None:
        return False
    by_size = unit_by_size(values, "t").unit
    if unit.unit == "s":
        return by_size in ("s", "ms", "us", "ns")
    return by_size != f"unix {unit.unit}"


def _unit_in_cells(table: LogTable, column: str, channel: str) -> UnitGuess | None:
    """Unit that stands in the first cell, as in "13.6 kn"."""
    first = table.first_text(column)
    if table.decimal_comma:
        first = first.replace(",", ".")
    measured = number_with_unit(first)
    if measured is None:
        return None
    units = spelled_units(measured.unit.lower())
    return named_unit(units, channel, "from its cells")


def _with_date(
    table: LogTable, time: ColumnGuess, free: list[str], names: _Names
) -> ColumnGuess:
    """The time with the column of its date or of the GPS week, where there is one."""
    first = table.first_text(time.column)
    is_of_day = _TIME_OF_DAY.fullmatch(first) is not None
    forms = _forms(time.column, "t")
    is_of_week = _matches(forms, ["*tow", "*timeofweek*"])
    if is_of_week:
        unit = "gps tow ms" if time.unit == "ms" else "gps tow"
        reason = "seconds of the GPS week, by its name"
        time = time._replace(unit=unit, reason=reason)
    part = _second_of(time.column, free)
    if part is not None:
        free.remove(part)
        return time._replace(extra=(("nanoseconds", part),))
    if not is_of_day and not is_of_week:
        return time
    for pattern in names.known["date"]:
        for column in free:
            forms = _forms(column, "t")
            if not _matches(forms, [pattern]):
                continue
            date = table.first_text(column)
            is_date = _DATE.fullmatch(date) is not None
            if is_of_week:
                is_date = date.isdigit()
            if is_date:
                free.remove(column)
                return time._replace(extra=(("date", column),))
    return time


def _second_of(column: str, free: list[str]) -> str | None:
    """Column of the nanoseconds beside the seconds of a stamp of ROS; None without."""
    stem = re.sub(r"secs?$", "", column, flags=re.IGNORECASE)
    if stem == column:
        return None
    others = {f"{stem}{ending}" for ending in ("nanosec", "nanosecs", "nsec", "nsecs")}
    return next((one for one in free if one in others), None)


def _even_column(table: LogTable, free: list[str]) -> ColumnGuess | None:
    """A column without a known name that increases evenly, as time does."""
    numbers_of_rows = ("", "index", "row", "no", "nr", "id", "seq", "sample")
    for column in free:
        values = table.likely_numbers(column, sided=True)
        if values is None:
            continue
        values = values[np.isfinite(values)]
        if values.size < 10:
            continue
        steps = np.diff(values)
        is_even = np.all(steps > 0.0) and np.ptp(steps) <= 0.01 * steps.max()
        is_count = values[0] in (0.0, 1.0) and np.all(steps == 1.0)
        if is_even and not (is_count and column.lower() in numbers_of_rows):
            free.remove(column)
            unit = unit_by_size(values, "t")
            reason = f"{unit.reason}; the time, as it increases evenly"
            return ColumnGuess("t", column, unit.unit, reason)
    return None


@lru_cache(maxsize=10_000)
def _forms(column: str, channel: str) -> list[str]:
    """The name of a column without blanks: whole, without its unit, its last part.

    Only the beginning of one that is longer than any name.
    """
    column = column[:200]
    text = column.lower().replace("_", " ")
    bare, units = split_unit(text)
    forms = [_plain(text)]
    if "(:," not in column:  # of a matrix
        before_bracket = re.sub(r"[\[(].*", "", text)
        forms.append(_plain(before_bracket))
    if named_unit(units, channel) is not None:
        forms.append(_plain(bare))
    is_path = re.search(r"[^\W\d_][./:][^\W\d_]", column)
    if is_path and " " not in column:
        last = re.split(r"[./:]", text)[-1]
        if len(last) > 1 or not _OF_TURNS.search(text):
            forms.append(_plain(last))
    return forms


def _spaced(name: str) -> str:
    """A name in lower case with blanks for underscores and before its capitals."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", " ", name)
    return apart.replace("_", " ").lower()


def _plain(name: str) -> str:
    return re.sub(r"[ ._()\[\]#%:/'\"-]", "", name)


def _matches(forms: Iterable[str], patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(form, one) for form in forms for one in patterns)
