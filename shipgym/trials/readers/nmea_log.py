"""Logs of NMEA 0183, of any talkers: position, motion, rudder, shaft and wind.

The sentences stand in `shipgym/trials/nmea.toml`; those without a channel
(AIS, depth, satellites) are passed over.
"""

import re
from collections import defaultdict
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.clock_texts import DAY
from shipgym.trials.nmea import (
    NMEA_QUANTITIES,
    NMEA_SENTENCES,
    Sentence,
    logged_numbers,
    parse_sentence,
)
from shipgym.trials.readers.csv_file import read_lines
from shipgym.trials.readers.log_table import LogTable

#: Preferred kinds of sentences: true headings, and of speeds through the water the log
#: with two axes.
_PREFERENCE = {"HDT": 3, "THS": 2, "VHW": 1, "VBW": 2}
_WINDS = ("wind_angle", "wind_speed", "apparent_wind_angle", "apparent_wind_speed")
#: Kinds of sentences that hold a channel.
_KINDS = [
    kind
    for kind, sentence in NMEA_SENTENCES.items()
    if any(NMEA_QUANTITIES[quantity].channel for quantity in sentence.fields)
]
_SENTENCE = re.compile(rf"\$[A-Z]{{2}}(?:{'|'.join(_KINDS)}),.*")
_TIME = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:\.\d*)?)")


class _Value(NamedTuple):
    """One value of a channel, or one time."""

    line: int
    time: float  # s since 1970 or of the day; nan where the sentence has none
    value: float


class _Track(NamedTuple):
    """Values of a channel over time, with the lines in which they stand."""

    t: Floats
    lines: Floats
    values: Floats


_BySource = dict[str, list[_Value]]  # by talker and kind, such as HEHDT


def _by_source() -> _BySource:
    return defaultdict(list)


@dataclass
class _Heard:
    """Contents of the sentences of a log."""

    times: _BySource = field(default_factory=_by_source)
    channels: dict[str, _BySource] = field(
        default_factory=lambda: defaultdict(_by_source)
    )
    count: int = 0
    damaged: list[int] = field(default_factory=list)  # lines


def read_nmea(path: Path) -> LogTable:
    """Read a log's channels: SI units, positions in degrees, nan where absent.

    Of several sources of a channel the best is taken, and a note names the others.
    Raises InputError for a damaged log and one without time or channels.
    """
    lines = read_lines(path, "log of NMEA 0183")
    heard = _listen(lines)
    notes = _check_damage(path, heard)
    _check_content(path, heard)

    clock = _main_clock(heard.times)
    tracks = {}
    for channel, sources in heard.channels.items():
        best = _best_source(sources)
        tracks[channel] = _track(sources[best], clock)
        notes += _note_others(channel, best, sources)

    winds = {}
    for name in _WINDS:
        if name in tracks:
            winds[name] = tracks.pop(name)
    if winds and "psi" in tracks:
        tracks |= _wind_over_ground(winds, tracks)
    return _table(path, tracks, notes)


def _listen(lines: list[str]) -> _Heard:
    """Take times and channels out of the sentences of a log."""
    heard = _Heard()
    for number, line in enumerate(lines, start=1):
        match = _SENTENCE.search(line)
        if match is None:
            continue
        heard.count += 1
        try:
            sentence = parse_sentence(match[0])
            time = _time(sentence)
            values = _channel_values(sentence)
        except ValueError:
            heard.damaged.append(number)
            continue

        source = sentence.talker + sentence.kind
        if np.isfinite(time):
            heard.times[source].append(_Value(number, time, time))
        for channel, value in values.items():
            heard.channels[channel][source].append(_Value(number, time, value))
    return heard


def _time(sentence: Sentence) -> float:
    """Seconds since 1970 with a date, else of the day; nan without a time."""
    kind = NMEA_SENTENCES[sentence.kind]
    match = _TIME.fullmatch(_field(sentence, kind.time))
    if match is None:
        return np.nan
    hours, minutes, seconds = map(float, match.groups())
    of_day = 3600.0 * hours + 60.0 * minutes + seconds

    date = _field(sentence, kind.date)
    if not date:
        return of_day
    midnight = datetime.strptime(date, "%d%m%y")
    midnight = midnight.replace(tzinfo=UTC)
    return midnight.timestamp() + of_day


def _field(sentence: Sentence, at: int | None) -> str:
    """The field at a place; empty where a sentence is shorter or has no such field."""
    if at is None or at >= len(sentence.fields):
        return ""
    return sentence.fields[at]


def _channel_values(sentence: Sentence) -> dict[str, float]:
    """Values by channel, positions in degrees; winds from the bow by quantity."""
    numbers = logged_numbers(sentence)
    if "compass_heading" in numbers:
        numbers["compass_heading"] += numbers.get("deviation", 0.0)
        numbers["compass_heading"] += numbers.get("variation", 0.0)

    values = {}
    for quantity, number in numbers.items():
        channel = NMEA_QUANTITIES[quantity].channel
        if quantity in _WINDS:
            values[quantity] = number
        elif channel in ("lat", "lon"):
            values[channel] = float(np.degrees(number))
        elif channel is not None:
            values[channel] = number
    return values


def _check_damage(path: Path, heard: _Heard) -> list[str]:
    """Refuse a log of many damaged sentences; a note of few."""
    damaged = len(heard.damaged)
    if damaged > 0.1 * heard.count:
        raise InputError(
            f"{path}: line {heard.damaged[0]}: expected hardly any damaged sentences,"
            f" got {damaged} of {heard.count} with a wrong checksum or broken fields,"
            " this the first; the log was damaged on the way: take the original"
        )
    if damaged:
        return [f"{damaged} of {heard.count} sentences with a wrong checksum left out"]
    return []


def _check_content(path: Path, heard: _Heard) -> None:
    if not heard.times:
        raise InputError(
            f"{path}: expected sentences with a time (RMC, GGA or GLL), got none; log"
            " these too"
        )
    if not heard.channels.keys() - set(_WINDS):
        raise InputError(
            f"{path}: expected sentences of a ship's motion ({', '.join(_KINDS)}), got"
            " none; log these too"
        )


class _Rank(NamedTuple):
    """Rank of a source, by the most important criterion first."""

    preference: int  # by its kind
    is_dated: bool
    is_original: bool  # no display (II) that repeats others' sentences
    moments: int  # at which it says something


def _rank(source: str, values: list[_Value]) -> _Rank:
    kind = source[2:]
    moments = set()
    for one in values:
        moment = one.line if np.isnan(one.time) else one.time
        moments.add(moment)
    return _Rank(
        preference=_PREFERENCE.get(kind, 0),
        is_dated=values[0].time > 2.0 * DAY,
        is_original=not source.startswith("II"),
        moments=len(moments),
    )


def _best_source(sources: _BySource) -> str:
    return max(sorted(sources), key=lambda source: _rank(source, sources[source]))


def _note_others(channel: str, best: str, sources: _BySource) -> list[str]:
    others = sorted(sources.keys() - {best})
    if not others:
        return []
    left_out = ", ".join(others)
    return [f"{channel} is from {best}; {left_out} left out"]


def _main_clock(times: _BySource) -> _Track:
    """Times of the best source, s, which never go back, and go on at midnight."""

    def rank(source: str) -> _Rank:
        return _rank(source, times[source])

    best = max(times, key=rank)
    lines, clock, _ = np.array(times[best]).T
    is_dated = clock[0] > 2.0 * DAY
    if not is_dated:
        clock = np.unwrap(clock, period=DAY)
    never_back = np.maximum.accumulate(clock)
    t, first = np.unique(never_back, return_index=True)
    return _Track(t, lines[first], values=t)


def _track(values: list[_Value], clock: _Track) -> _Track:
    """Values of a source at their own times, else at those of their lines."""
    lines, own_time, numbers = np.array(values).T
    by_line = np.interp(lines, clock.lines, clock.t)
    # a time of the day is that of the day on which its line stands
    days = np.round((by_line - own_time) / DAY)
    with_day = own_time + DAY * days
    t = np.where(np.isnan(own_time), by_line, with_day)

    milliseconds = np.round(t, 3)
    t, first = np.unique(milliseconds, return_index=True)
    return _Track(
        t=t,
        lines=lines[first],
        values=numbers[first],
    )


def _wind_over_ground(
    winds: dict[str, _Track], tracks: dict[str, _Track]
) -> dict[str, _Track]:
    """Wind over ground from that off the bow; empty where the velocity is missing."""
    if {"wind_angle", "wind_speed"} <= winds.keys():
        angle = winds["wind_angle"]
        heading = _angle_at(angle.t, tracks["psi"])
        return {
            "wind_from": angle._replace(values=angle.values + heading),
            "wind_speed": winds["wind_speed"],
        }
    has_wind = {"apparent_wind_angle", "apparent_wind_speed"} <= winds.keys()
    has_velocity = {"sog", "cog"} <= tracks.keys()
    if not has_wind or not has_velocity:
        return {}

    # complex: north + i east
    angle = winds["apparent_wind_angle"]
    heading = _angle_at(angle.t, tracks["psi"])
    bearing = np.exp(1j * (angle.values + heading))
    apparent = winds["apparent_wind_speed"].values * bearing
    over_ground = tracks["sog"]
    speed = np.interp(angle.t, over_ground.t, over_ground.values)
    course = _angle_at(angle.t, tracks["cog"])
    wind = apparent - speed * np.exp(1j * course)
    return {
        "wind_from": angle._replace(values=np.angle(wind)),
        "wind_speed": angle._replace(values=np.abs(wind)),
    }


def _angle_at(t: Floats, track: _Track) -> Floats:
    """An angle at other times, rad."""
    return np.interp(t, track.t, np.unwrap(track.values))


def _table(path: Path, tracks: dict[str, _Track], notes: list[str]) -> LogTable:
    """One row for each time at which some channel has a value."""
    clocks = [track.t for track in tracks.values()]
    all_times = np.concatenate(clocks)
    t = np.unique(all_times)
    columns = {"t": t}
    lines = np.zeros(t.size, dtype=int)
    for channel, track in tracks.items():
        rows = np.searchsorted(t, track.t)
        values = np.full(t.size, np.nan)
        values[rows] = track.values
        columns[channel] = values
        lines[rows] = track.lines
    return LogTable(
        path=path,
        cells=columns,
        rows=lines.tolist(),
        place_words="line {line}",
        units={"t": "unix"},
        notes=tuple(notes),
    )
