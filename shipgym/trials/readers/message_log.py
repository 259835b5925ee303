"""Logs of messages of a ship's buses, read as a table of channels.

The messages are sentences of NMEA 0183, PGNs of NMEA 2000 and deltas of Signal K, also
mixed, with or without a time before each.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import placed
from shipgym.errors import InputError
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.message_clock import Clock, log_clock, times_of
from shipgym.trials.readers.messages import Heard, Value
from shipgym.trials.readers.nmea0183 import hear_sentences
from shipgym.trials.readers.nmea2000 import hear_pgns
from shipgym.trials.readers.signalk import hear_deltas
from shipgym.trials.readers.text_files import text_lines
from shipgym.trials.resampling import FEWEST_SAMPLES
from shipgym.trials.units import DEGREE

#: Preferred kinds of sentences: true headings, of speeds through the water the log with
#: two axes, and of positions what has their date.
_PREFERENCE = {"HDT": 3, "THS": 2, "VHW": 1, "VBW": 2, "RMC": 1}


class Track(NamedTuple):
    """Values of a channel over time, with the lines in which they stand."""

    t: Floats
    lines: Floats
    values: Floats
    source: str

    @property
    def words(self) -> str:
        """The source, and how many values it has."""
        return f"{self.source} ({self.t.size} value{'s' * (self.t.size != 1)})"

    @property
    def covered(self) -> float:
        """Time, s, for which a value is not older than a few seconds."""
        longest = 3.0
        steps = np.append(np.diff(self.t), longest)
        return float(np.minimum(steps, longest).sum())

    def at(self, t: Floats) -> Floats:
        """Values at other times, between those of the track on straight lines."""
        return np.interp(t, self.t, self.values)


def _choose_tracks(
    heard: Heard, clock: Clock, notes: list[str]
) -> tuple[dict[str, Track], bool]:
    """Channels of a log, each of its best source; whether the heading is magnetic."""
    tracks = {}
    longest = 0.0
    left_out = []
    for channel, sources in heard.channels.items():
        of_source = [
            _track(source, sources[source], clock) for source in sorted(sources)
        ]
        longest = max(longest, *(track.covered for track in of_source))
        best = tracks[channel] = _best(channel, of_source)
        others = ", ".join(track.words for track in of_source if track is not best)
        if others and channel != "variation":
            name = channel.removesuffix("_magnetic")
            left_out.append(f"{name} is from {best.words}; {others} left out")

    is_magnetic = _choose_heading(tracks, left_out)
    tracks.pop("variation", None)
    for channel, track in list(tracks.items()):
        is_needed = channel in ("psi", "delta") or track.covered >= 0.1 * longest
        if not is_needed or track.t.size < FEWEST_SAMPLES:
            del tracks[channel]
            left_out.append(
                f"{channel} of {track.source} left out: only {track.t.size} values"
            )
    notes += left_out
    return tracks, is_magnetic


def _track(source: str, values: list[Value], clock: Clock) -> Track:
    """Values of a source at the times of their lines.

    Those of a time that it said before are left out, unless it says each several times.
    """
    lines, own, numbers = np.array(values).T
    _, firsts = np.unique(own, return_index=True)
    kept = np.sort(firsts)
    if kept.size < 0.6 * own.size:
        kept = np.arange(own.size)
    # to a tenth of a millisecond
    times = np.round(times_of(lines[kept], clock), 4)
    t, first = np.unique(times, return_index=True)
    kept = kept[first]
    return Track(t, lines[kept], numbers[kept], source)


def _best(channel: str, tracks: Sequence[Track]) -> Track:
    """The source to read, by the most important criterion first."""
    most = max(track.covered for track in tracks)

    def rank(track: Track) -> tuple[object, ...]:
        """II is a display that repeats others; of two rudders one may stand still."""
        return (
            track.covered >= 0.5 * most,
            channel != "delta" or np.ptp(track.values) > 0.5 * DEGREE,
            _PREFERENCE.get(track.source[2:5], 0),
            not track.source.startswith("II"),
            track.t.size,
            not track.source.endswith(" port"),
        )

    return max(tracks, key=rank)


def _choose_heading(tracks: dict[str, Track], notes: list[str]) -> bool:
    """Take the heading by compass where no true one is logged for most of the time.

    The variation is added where the log has one; else it is True: the heading stays
    magnetic.
    """
    compass = tracks.pop("psi_magnetic", None)
    true = tracks.get("psi")
    if compass is None:
        return False
    if true is not None:
        is_true = true.covered >= 0.5 * compass.covered
        read, other = (true, compass) if is_true else (compass, true)
        if true.source != compass.source:
            notes.append(f"psi is from {read.words}; {other.words} left out")
        if is_true:
            return False
    tracks["psi"] = compass
    variation = tracks.get("variation")
    if variation is None:
        return True
    added = variation.at(compass.t)
    tracks["psi"] = compass._replace(values=compass.values + added)
    middle = float(np.median(added)) / DEGREE
    notes.append(
        f"psi is the magnetic heading of {compass.source} with the variation of"
        f" {variation.source} added, {abs(middle):.1f} deg"
        f" {'E' if middle >= 0.0 else 'W'}"
    )
    return False


def read_messages(path: Path, content: bytes) -> LogTable:
    """Read a log's channels: SI units, positions in degrees, nan where absent.

    Of several sources of a channel the best is taken, and a note names the others.
    Raises InputError for a damaged log and one without time or channels.
    """
    lines = text_lines(path, content)
    heard = Heard()
    hear_sentences(lines, heard)
    with placed(str(path)):
        hear_pgns(lines, heard)
    hear_deltas(lines, heard)
    notes = _check_damage(path, heard) + heard.notes
    clock = log_clock(path, heard, notes) if heard.count else None
    if not heard.count and any("!AIVD" in line for line in lines):
        raise InputError(
            f"{path}: this looks like a log of AIS: positions of other ships, without"
            " their rudders; expected the own ship's sentences (RMC, HDT, RSA)"
        )
    if clock is None:
        raise InputError(
            f"{path}: expected sentences with a time (RMC, GGA, GLL or ZDA) or a time"
            " before each line, got none; log these too"
        )
    tracks, is_magnetic = _choose_tracks(heard, clock, notes)
    if not tracks:
        raise InputError(
            f"{path}: expected several values of a ship's motion (RMC, HDT, HDG, ROT,"
            " RSA and others), got too few: log these too"
        )
    table = _table(path, tracks, notes, magnetic=is_magnetic)
    return replace(table, sources={"t": clock.source, **table.sources})


def _check_damage(path: Path, heard: Heard) -> list[str]:
    """Refuse a log of many damaged messages; a note of few."""
    number = len(heard.damaged)
    damaged = f"{number} of {heard.count}"
    if number > 0.1 * heard.count:
        raise InputError(
            f"{path}: line {heard.damaged[0]}: expected hardly any damaged sentences,"
            f" got {damaged} with a wrong or no checksum or broken fields, this the"
            " first; the log was damaged on the way: take the original"
        )
    note = f"{damaged} sentences with a wrong checksum or broken fields left out"
    return [note] if number else []


def _table(
    path: Path, tracks: dict[str, Track], notes: list[str], *, magnetic: bool
) -> LogTable:
    """One row for each time at which some channel has a value."""
    t = np.unique(np.concatenate([track.t for track in tracks.values()]))
    columns = {"t": t}
    first_lines = np.full_like(t, np.inf)
    for channel, track in tracks.items():
        rows = np.searchsorted(t, track.t)
        columns[channel] = np.full_like(t, np.nan)
        columns[channel][rows] = track.values
        first_lines[rows] = np.minimum(first_lines[rows], track.lines)
    return LogTable(
        path=path,
        cells=columns,
        rows=first_lines.astype(int).tolist(),
        place_words="line {line}",
        units={"t": "unix"},
        notes=tuple(notes),
        sources={channel: track.source for channel, track in tracks.items()},
        own_clocks=True,
        magnetic=magnetic,
    )
