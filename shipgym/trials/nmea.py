"""NMEA 0183 logs: position, speeds, heading, rate of turn, rudder, shaft and wind of whatever talkers there are.

The sentences are parsed by pynmea2; those that hold no channel (AIS, depth, satellites) are passed over.
"""

import re
from collections import defaultdict
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats
from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, check_readable, read_text
from shipgym.trials.clock_texts import DAY, read_clock
from shipgym.trials.csv_reader import LONGEST_LINE, MOST_LINES

KNOT, DEGREE = 1852.0 / 3600.0, np.pi / 180.0
#: Sentences that are read.
SENTENCES = ("RMC", "GGA", "GLL", "ZDA", "VTG", "HDT", "THS", "HDG", "ROT", "RSA", "RPM", "VBW", "VHW", "MWV")
#: Share of wrong checksums from which a log is refused.
MOST_WRONG = 0.1

_SENTENCE = re.compile(r"^(.*?)(\$[A-Z]{2}(?:%s),.*)$" % "|".join(SENTENCES))
_ANY = re.compile(r"^[^\n]{0,60}[$!][A-Z]{4,5},", re.MULTILINE)
_SPEEDS = {"N": KNOT, "K": 1.0 / 3.6, "M": 1.0}
#: Of the sources of heading, the first that there is counts: true, then magnetic with the variation.
_HEADINGS = ("HDT", "THS", "VHW", "HDG")


class Reading(NamedTuple):
    """One value of a channel."""

    line: int
    time: float  # s since 1970 or of the day; nan where the sentence has none
    value: float


class Log(NamedTuple):
    """What a log holds: columns on the clock of all readings, blank where a sentence says nothing."""

    columns: dict[str, Floats]  # by channel in SI units, positions in degrees; nan where blank; ``t`` too
    lines: list[int]  # of the file behind each row
    dated: bool  # whether t counts from 1970, else from midnight
    notes: list[str]  # what was left out


def is_nmea(path: Path) -> bool:
    """Whether a file begins as a log of NMEA sentences, from whatever line."""
    check_readable(path, "CSV file")
    with path.open("rb") as file:
        return len(_ANY.findall(file.read(4096).decode("latin-1").replace("\r", "\n"))) >= 2


def parse_log(path: Path) -> Log:
    """Read a log; raises InputError for a damaged one and one without time or channels."""
    lines = read_text(path, "log of NMEA 0183", LARGEST_CSV, latin=True).splitlines()
    if len(lines) > MOST_LINES:
        raise InputError(f"{path}: {len(lines)} lines found, expected at most {MOST_LINES}; split the file")
    readings: dict[tuple[str, str], list[Reading]] = defaultdict(list)
    stamps: dict[str, list[Reading]] = defaultdict(list)
    wrong, total, first_wrong = 0, 0, 0
    library = _library()
    for number, line in enumerate(lines, start=1):
        found = _SENTENCE.match(line) if len(line) < LONGEST_LINE else None
        if found is None:
            continue
        total += 1
        try:
            message = library.parse(found[2], check=True)
            kind = str(message.sentence_type)
            time, values = _time_of(message), dict(_CHANNELS.get(kind, _nothing)(message))
        except (library.ParseError, ValueError, TypeError, AttributeError, IndexError, OverflowError):
            wrong, first_wrong = wrong + 1, first_wrong or number
            continue
        if (logged := _logger_stamp(found[1])) is not None:
            stamps["logger"].append(Reading(number, logged, logged))
        source = f"{message.talker}{kind}"
        if time is not None:
            stamps[source].append(Reading(number, time, time))
        for channel, value in values.items():
            readings[channel, source].append(Reading(number, np.nan if time is None else time, value))
    if wrong > MOST_WRONG * total:
        raise InputError(
            f"{path}: {wrong} of {total} sentences are damaged (the first in line {first_wrong}), by their "
            "checksums or fields, expected hardly any; the log was cut or copied as text: take the original"
        )
    notes = [f"{wrong} of {total} sentences with a wrong checksum were left out"] if wrong else []
    return _assembled(path, readings, stamps, notes)


def _library() -> ModuleType:
    """pynmea2, which does not know THS by itself."""
    try:
        library = import_module("pynmea2")
    except ModuleNotFoundError:
        raise InputError(
            "pynmea2, which reads NMEA 0183, is not installed; install it with: pip install 'shipgym[logs]'"
        ) from None
    if "THS" not in vars(library):
        fields = (("True heading", "heading"), ("Mode", "mode"))
        vars(library)["THS"] = type("THS", (library.TalkerSentence,), {"fields": fields})
    return library


def _logger_stamp(text: str) -> float | None:
    """The time that a logger put before a sentence: Unix, ISO 8601, or a TAG block's c:."""
    text = text.strip(" ,;\t[]")
    tag = re.match(r"\\.*?c:(\d{9,13})", text)
    if not text or (text.startswith("\\") and not tag):
        return None
    try:
        seconds = float(tag[1] if tag else text)
        return seconds / 1000.0 if seconds > 1e11 else seconds
    except ValueError:
        pass
    try:
        seconds, dated = read_clock([text])
        return float(seconds[0]) if dated else None
    except ValueError:
        return None


def _time_of(message: Any) -> float | None:
    """Seconds since 1970 where the sentence has a date, else of the day; None without a time."""
    clock = getattr(message, "timestamp", None)
    if not hasattr(clock, "hour"):
        return None
    if message.sentence_type == "ZDA":
        moment = datetime(int(message.year), int(message.month), int(message.day), tzinfo=UTC)
    elif hasattr(date := getattr(message, "datestamp", None), "year"):
        moment = datetime(date.year, date.month, date.day, tzinfo=UTC)
    else:
        moment = datetime(1970, 1, 1, tzinfo=UTC)
    return float(
        moment.timestamp() + 3600 * clock.hour + 60 * clock.minute + clock.second + 1e-6 * clock.microsecond
    )


Found = Iterable[tuple[str, float]]


def _nothing(_: Any) -> Found:
    return ()


def _position(message: Any) -> Found:
    fine = message.gps_qual not in (0, None) if message.sentence_type == "GGA" else message.status == "A"
    if fine and message.lat and message.lon:
        yield from (("lat", message.latitude), ("lon", message.longitude))


def _recommended(message: Any) -> Found:
    if message.status != "A":
        return
    yield from _position(message)
    if message.spd_over_grnd not in (None, ""):
        yield "sog", KNOT * float(message.spd_over_grnd)
    if message.true_course not in (None, ""):
        yield "cog", DEGREE * float(message.true_course)


def _track(message: Any) -> Found:
    if message.spd_over_grnd_kts not in (None, "") and message.true_track not in (None, ""):
        yield from (
            ("sog", KNOT * float(message.spd_over_grnd_kts)),
            ("cog", DEGREE * float(message.true_track)),
        )


def _heading(message: Any) -> Found:
    if message.heading in (None, "") or getattr(message, "mode", "A") == "V":
        return
    value = float(message.heading)
    if message.sentence_type == "HDG":
        for size, side in ((message.deviation, message.dev_dir), (message.variation, message.var_dir)):
            value += {"E": 1.0, "W": -1.0}.get(side, 0.0) * float(size or 0.0)
    yield "psi", DEGREE * value


def _water(message: Any) -> Found:
    if message.water_speed_knots not in (None, ""):
        yield "stw", KNOT * float(message.water_speed_knots)
    if message.heading_true not in (None, ""):
        yield "psi", DEGREE * float(message.heading_true)


def _two_axes(message: Any) -> Found:
    if message.data_validity_water_spd == "A":
        yield "stw", KNOT * float(message.lon_water_spd)
        if message.trans_water_spd not in (None, ""):
            yield "v", KNOT * float(message.trans_water_spd)


def _turn(message: Any) -> Found:
    if message.status == "A" and message.rate_of_turn not in (None, ""):
        yield "r", DEGREE / 60.0 * float(message.rate_of_turn)


def _rudder(message: Any) -> Found:
    if message.rsa_starboard_status == "A" and message.rsa_starboard not in (None, ""):
        yield "delta", DEGREE * float(message.rsa_starboard)


def _shaft(message: Any) -> Found:
    if message.status == "A" and message.source == "S":
        yield "n", float(message.speed) / 60.0


def _wind(message: Any) -> Found:
    if message.status == "A" and message.wind_speed_units in _SPEEDS:
        ending = "" if message.reference == "T" else "_relative"
        yield f"wind_from{ending}", DEGREE * float(message.wind_angle)
        yield f"wind_speed{ending}", _SPEEDS[message.wind_speed_units] * float(message.wind_speed)


_CHANNELS: dict[str, Callable[[Any], Found]] = {
    "RMC": _recommended, "GGA": _position, "GLL": _position, "VTG": _track, "HDT": _heading, "THS": _heading,
    "HDG": _heading, "VHW": _water, "VBW": _two_axes, "ROT": _turn, "RSA": _rudder, "RPM": _shaft,
    "MWV": _wind,
}  # fmt: skip


def _assembled(
    path: Path,
    readings: dict[tuple[str, str], list[Reading]],
    stamps: dict[str, list[Reading]],
    notes: list[str],
) -> Log:
    if not readings:
        raise InputError(
            f"{path}: no sentence of a ship's motion found, expected some of {quoted(SENTENCES)}"
        )
    if not stamps:
        raise InputError(
            f"{path}: no time that can be read, expected RMC, GGA, GLL or ZDA, or a logger's time before "
            "each "
            "sentence; log one of these too"
        )
    clock = max(stamps, key=lambda name: _rank(name, stamps[name]))
    times, first = np.unique(
        np.maximum.accumulate([stamp.time for stamp in stamps[clock]]), return_index=True
    )
    lines = np.array([stamp.line for stamp in stamps[clock]])[first]
    chosen: dict[str, tuple[Floats, npt.NDArray[np.intp], Floats]] = {}
    for channel in dict.fromkeys(channel for channel, _ in readings):
        source = _best([name for c, name in readings if c == channel], channel, readings)
        line, time, value = np.array(readings[channel, source]).T
        at = np.interp(line, lines, times)
        own = np.isfinite(time) & (clock != "logger")
        time = np.where(own, time + DAY * np.round((at - time) / DAY), at)
        time, first = np.unique(np.round(time, 3), return_index=True)
        chosen[channel] = time, line[first].astype(int), value[first]
        others = sorted({name for c, name in readings if c == channel} - {source})
        if others:
            notes.append(f"{channel} is from {source}; {', '.join(others)} left out")
    _absolute_wind(chosen)
    every = np.unique(np.concatenate([time for time, *_ in chosen.values()]))
    columns, at_line = {"t": every}, np.zeros(every.size, dtype=int)
    for channel, (time, line, value) in chosen.items():
        place = np.searchsorted(every, time)
        columns[channel] = np.full(every.size, np.nan)
        columns[channel][place], at_line[place] = value, line
    return Log(columns, at_line.tolist(), bool(times[0] > 2.0 * DAY), notes)


def _best(sources: list[str], channel: str, readings: dict[tuple[str, str], list[Reading]]) -> str:
    """The source that is most direct; of the headings first a true one, of the water's speed first VBW."""
    order = {name: -k for k, name in enumerate(_HEADINGS)} if channel == "psi" else {"VBW": 1}
    return max(sorted(sources), key=lambda s: (order.get(s[2:], 0), *_rank(s, readings[channel, s])))


def _rank(source: str, readings: list[Reading]) -> tuple[bool, bool, bool, int]:
    """By this sources are preferred: the logger, those with dates, no display that passes on others' (II), "
    "most.
    """
    dated = readings[0].time > 2.0 * DAY
    times = {one.line if np.isnan(one.time) else one.time for one in readings}
    return source == "logger", dated, not source.startswith("II"), len(times)


def _absolute_wind(chosen: dict[str, tuple[Floats, npt.NDArray[np.intp], Floats]]) -> None:
    """Put the wind over ground in place of the one seen from the ship, where heading and velocity are "
    "known.
    """
    told = chosen.pop("wind_from_relative", None), chosen.pop("wind_speed_relative", None)
    if "wind_from" in chosen and "psi" in chosen:  # theoretical wind, from the bow
        time, line, angle = chosen["wind_from"]
        chosen["wind_from"] = time, line, angle + _at(time, chosen["psi"], angle=True)
        return
    chosen.pop("wind_from", None), chosen.pop("wind_speed", None)
    if told[0] is None or told[1] is None or not {"psi", "sog", "cog"} <= chosen.keys():
        return
    time, line, angle = told[0]
    speed, course = _at(time, chosen["sog"]), _at(time, chosen["cog"], angle=True)
    toward = -told[1][2] * np.exp(1j * (angle + _at(time, chosen["psi"], angle=True)))
    wind = toward + speed * np.exp(1j * course)
    chosen["wind_from"], chosen["wind_speed"] = (time, line, np.angle(-wind)), (time, line, np.abs(wind))


def _at(time: Floats, series: tuple[Floats, npt.NDArray[np.intp], Floats], angle: bool = False) -> Floats:
    values = np.unwrap(series[2]) if angle else series[2]
    return np.asarray(np.interp(time, series[0], values))
