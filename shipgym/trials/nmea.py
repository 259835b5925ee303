"""NMEA 0183 logs: position, speeds, heading, rate of turn, rudder, shaft and wind, of whatever talkers.

pynmea2 parses the sentences; those that hold no channel (AIS, depth, satellites) are
passed over.
"""

import re
from collections import defaultdict
from collections.abc import Iterator
from datetime import UTC, datetime, time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, read_bytes, read_text, shipped_toml
from shipgym.trials.clock_texts import DAY
from shipgym.trials.csv_reader import MOST_LINES, Table, column_table
from shipgym.trials.units import si_factor

#: Share of damaged sentences from which a log is refused.
MOST_DAMAGED = 0.1

SENTENCES: dict[str, dict[str, list[str]]] = shipped_toml(
    "shipgym.trials", "sentences.toml"
)
_SPEEDS = {"N": "knots", "K": "km/h", "M": "m/s"}
#: The better sources: of heading true ones, of the speed through the water the log with
#: two axes.
_BETTER = {"HDT": 3, "THS": 2, "VHW": 1, "VBW": 2}
_SENTENCE = re.compile(rf"\$[A-Z]{{2}}(?:{'|'.join(SENTENCES)}),.*")
_ANY = re.compile(r"^[^\n]{0,60}[$!][A-Z]{4,5},", re.MULTILINE)


class Reading(NamedTuple):
    """One value of a channel: the line, its time (s since 1970 or of the day, or nan), the value."""

    line: int
    time: float
    value: float


Series = tuple[Floats, Floats, Floats]  # time, line and value
Readings = dict[
    str, dict[str, list[Reading]]
]  # by channel and source, the talker with the sentence


def is_nmea(path: Path) -> bool:
    """Whether a file begins with sentences of NMEA 0183."""
    head = read_bytes(path, "CSV file", LARGEST_CSV)[:4096].decode("latin-1")
    return len(_ANY.findall(head.replace("\r", "\n"))) >= 2


def read_nmea(path: Path) -> Table:
    """The channels of a log in SI units, positions in degrees, nan where a row has none.

    Raises InputError for a damaged log and one without time or channels.
    """
    import pynmea2

    if not hasattr(pynmea2, "THS"):  # which pynmea2 does not know
        fields = (("True heading", "heading"), ("Mode", "mode"))
        vars(pynmea2)["THS"] = type(
            "THS", (pynmea2.TalkerSentence,), {"fields": fields}
        )
    lines = read_text(path, "log of NMEA 0183", LARGEST_CSV, latin=True).splitlines()
    if len(lines) > MOST_LINES:
        raise InputError(
            f"{path}: {len(lines)} lines found, expected at most {MOST_LINES}; split"
            " the file"
        )
    readings: Readings = defaultdict(lambda: defaultdict(list))
    damaged, total = [], 0
    for number, line in enumerate(lines, start=1):
        found = _SENTENCE.search(line)
        if found is None:
            continue
        total += 1
        try:
            message = pynmea2.parse(found[0], check=True)
            time, values = _time_of(message), list(_values_of(message))
        except (
            pynmea2.ParseError,
            ValueError,
            TypeError,
            AttributeError,
            IndexError,
            OverflowError,
        ):
            damaged.append(number)
            continue
        source = f"{message.talker}{message.sentence_type}"
        if np.isfinite(time):
            readings["t"][source].append(Reading(number, time, time))
        for channel, value in values:
            readings[channel][source].append(Reading(number, time, value))
    if len(damaged) > MOST_DAMAGED * total:
        raise InputError(
            f"{path}: {len(damaged)} of {total} sentences have a wrong checksum or"
            f" broken fields (the first in line {damaged[0]}), expected hardly any; the"
            " log was damaged on the way: take the original"
        )
    notes = (
        [f"{len(damaged)} of {total} sentences with a wrong checksum left out"]
        if damaged
        else []
    )
    return _assembled(path, readings, notes)


def _values_of(message: Any) -> Iterator[tuple[str, float]]:
    """The channels of a sentence that is valid; ValueError for an infinite number."""
    kind = message.sentence_type
    fields = dict(SENTENCES[kind])
    flag, valid = fields.pop("valid", ("", ""))
    if flag and str(getattr(message, flag) or " ") not in valid:
        return
    for channel, (field, unit) in fields.items():
        told = getattr(message, field)
        if told in (None, "") or not getattr(
            message, field[:3], " "
        ):  # the latitude of an empty lat
            continue
        value = si_factor(channel, unit) * float(told)
        if np.isinf(value) or "_" in str(told):
            raise ValueError(told)
        if kind == "HDG":
            for size, side in (
                (message.deviation, message.dev_dir),
                (message.variation, message.var_dir),
            ):
                value += (
                    si_factor("psi", "deg")
                    * {"E": 1.0, "W": -1.0}.get(side, 0.0)
                    * float(size or 0.0)
                )
        elif kind == "MWV":
            if message.wind_speed_units not in _SPEEDS:  # damaged where no checksum is
                return
            if channel == "wind_speed":
                value *= si_factor(channel, _SPEEDS[message.wind_speed_units])
            channel += "" if message.reference == "T" else "_relative"
        yield channel, value


def _time_of(message: Any) -> float:
    """Seconds since 1970 where the sentence has a date, else of the day; nan without a time."""
    clock = getattr(message, "timestamp", None)
    if not isinstance(clock, time):
        return np.nan
    date = getattr(message, "datestamp", None) or datetime(1970, 1, 1)
    day = datetime(date.year, date.month, date.day, tzinfo=UTC).timestamp()
    return (
        day
        + 3600 * clock.hour
        + 60 * clock.minute
        + clock.second
        + 1e-6 * clock.microsecond
    )


def _assembled(path: Path, readings: Readings, notes: list[str]) -> Table:
    clocks = readings.pop("t", {})
    if not readings or not clocks:
        found = "sentence of a ship's motion" if clocks else "time that can be read"
        wanted = quoted(SENTENCES) if clocks else "RMC, GGA or GLL"
        raise InputError(
            f"{path}: no {found} in this log, expected some of {wanted}; log these too"
        )
    main = max(clocks, key=lambda name: _rank(name, clocks[name]))
    stamps = np.array([(stamp.line, stamp.time) for stamp in clocks[main]])
    counted = (
        stamps[:, 1]
        if stamps[0, 1] > 2.0 * DAY
        else np.unwrap(stamps[:, 1], period=DAY)
    )
    times, first = np.unique(np.maximum.accumulate(counted), return_index=True)
    chosen: dict[str, Series] = {}
    for channel, sources in readings.items():
        source = max(
            sorted(sources),
            key=lambda s: (_BETTER.get(s[2:], 0), *_rank(s, sources[s])),
        )
        line, clock, value = np.array(sources[source]).T
        at = np.interp(line, stamps[first, 0], times)
        clock = np.where(
            np.isfinite(clock), clock + DAY * np.round((at - clock) / DAY), at
        )
        clock, kept = np.unique(np.round(clock, 3), return_index=True)
        chosen[channel] = clock, line[kept], value[kept]
        if others := sorted(sources.keys() - {source}):
            notes.append(f"{channel} is from {source}; {', '.join(others)} left out")
    _absolute_wind(chosen)
    every = np.unique(np.concatenate([clock for clock, *_ in chosen.values()]))
    columns, lines = {"t": every}, np.zeros(every.size, dtype=int)
    for channel, (clock, line, value) in chosen.items():
        place = np.searchsorted(every, clock)
        columns[channel] = np.full(every.size, np.nan)
        columns[channel][place], lines[place] = value, line
    return column_table(
        path,
        columns,
        lines.tolist(),
        "line {line}",
        time_unit="unix",
        notes=tuple(notes),
    )


def _rank(source: str, readings: list[Reading]) -> tuple[bool, bool, int]:
    """What is preferred: dates, no display that passes others' sentences on (II), many times."""
    times = {one.line if np.isnan(one.time) else one.time for one in readings}
    return readings[0].time > 2.0 * DAY, not source.startswith("II"), len(times)


def _absolute_wind(chosen: dict[str, Series]) -> None:
    """Make the wind that is told from the bow one over ground, where heading and velocity are known."""
    angle, speed = (
        chosen.pop("wind_from_relative", None),
        chosen.pop("wind_speed_relative", None),
    )
    theoretical = chosen.pop("wind_from", None), chosen.pop("wind_speed", None)

    def at(clock: Floats, name: str) -> Floats:
        times, _, values = chosen[name]
        return np.interp(clock, times, values if name == "sog" else np.unwrap(values))

    if "psi" not in chosen:
        return
    if theoretical[0] is not None and theoretical[1] is not None:
        clock, line, value = theoretical[0]
        chosen |= {
            "wind_from": (clock, line, value + at(clock, "psi")),
            "wind_speed": theoretical[1],
        }
    elif angle is not None and speed is not None and {"sog", "cog"} <= chosen.keys():
        clock, line, value = angle
        seen = speed[2] * np.exp(1j * (value + at(clock, "psi")))  # where it comes from
        wind = seen - at(clock, "sog") * np.exp(1j * at(clock, "cog"))
        chosen |= {
            "wind_from": (clock, line, np.angle(wind)),
            "wind_speed": (clock, line, np.abs(wind)),
        }
