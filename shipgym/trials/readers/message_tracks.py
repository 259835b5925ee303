"""Of several sources of a channel the one to read, and a log's channels over time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.clock_texts import is_dated
from shipgym.trials.readers.message_clock import Clock, times_of
from shipgym.trials.readers.messages import Heard, Value
from shipgym.trials.resampling import FEWEST_SAMPLES
from shipgym.trials.units import DEGREE

#: Preferred kinds of sentences: true headings, and of speeds through the water the log
#: with two axes.
_PREFERENCE = {"HDT": 3, "THS": 2, "VHW": 1, "VBW": 2}


class Track(NamedTuple):
    """Values of a channel over time, with the lines in which they stand."""

    t: Floats
    lines: Floats
    values: Floats
    source: str
    has_dates: bool = False

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


@dataclass
class Tracks:
    """The channels of a log, each of one source, and what was left out."""

    by_channel: dict[str, Track] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    magnetic: bool = False  # the heading counts from magnetic north


def choose_tracks(heard: Heard, clock: Clock) -> Tracks:
    """Channels of a log, each of its best source, on the clock of the log."""
    found = Tracks()
    tracks = found.by_channel
    longest = 0.0
    for channel, sources in heard.channels.items():
        of_source = [
            _track(source, sources[source], clock) for source in sorted(sources)
        ]
        longest = max(longest, *(track.covered for track in of_source))
        best = tracks[channel] = _best(channel, of_source)
        others = [track.words for track in of_source if track is not best]
        if others and channel != "variation":
            name = channel.removesuffix("_magnetic")
            found.notes.append(
                f"{name} is from {best.words}; {', '.join(others)} left out"
            )

    _choose_heading(found)
    tracks.pop("variation", None)
    for channel, track in list(tracks.items()):
        is_needed = channel in ("psi", "delta") or track.covered >= 0.1 * longest
        if not is_needed or track.t.size < FEWEST_SAMPLES:
            del tracks[channel]
            found.notes.append(
                f"{channel} of {track.source} left out: only {track.t.size} values"
            )
    by_source: dict[str, list[str]] = {}
    for channel, track in tracks.items():
        by_source.setdefault(track.source, []).append(channel)
    read = [f"{', '.join(names)} from {source}" for source, names in by_source.items()]
    found.notes.insert(0, f"{'; '.join(read)}; time from {clock.source}")
    return found


def _track(source: str, values: list[Value], clock: Clock) -> Track:
    """Values of a source at their own times, else at those of their lines."""
    lines, times, numbers = np.array(values).T
    # to a tenth of a millisecond
    t, first = np.unique(np.round(times_of(values, clock), 4), return_index=True)
    return Track(t, lines[first], numbers[first], source, is_dated(times[0]))


def _best(channel: str, tracks: Sequence[Track]) -> Track:
    """The source to read, by the most important criterion first."""
    most = max(track.covered for track in tracks)

    def rank(track: Track) -> tuple[object, ...]:
        """II is a display that repeats others; of two rudders one may stand still."""
        return (
            track.covered >= 0.5 * most,
            channel != "delta" or np.ptp(track.values) > 0.5 * DEGREE,
            _PREFERENCE.get(track.source[2:5], 0),
            track.has_dates,
            not track.source.startswith("II"),
            track.t.size,
            not track.source.endswith(" port"),
        )

    return max(tracks, key=rank)


def _choose_heading(found: Tracks) -> None:
    """Take the heading by compass where no true one is logged for most of the time.

    The variation is added where the log has one; else the heading stays magnetic.
    """
    tracks = found.by_channel
    compass = tracks.pop("psi_magnetic", None)
    true = tracks.get("psi")
    if compass is None:
        return
    if true is not None:
        is_true = true.covered >= 0.5 * compass.covered
        read, other = (true, compass) if is_true else (compass, true)
        if true.source != compass.source:
            found.notes.append(f"psi is from {read.words}; {other.words} left out")
        if is_true:
            return
    tracks["psi"] = compass
    variation = tracks.get("variation")
    found.magnetic = variation is None
    if variation is not None:
        added = variation.at(compass.t)
        tracks["psi"] = compass._replace(values=compass.values + added)
        middle = float(np.median(added)) / DEGREE
        found.notes.append(
            f"psi is the magnetic heading of {compass.source} with the variation of"
            f" {variation.source} added, {abs(middle):.1f} deg"
            f" {'E' if middle >= 0.0 else 'W'}"
        )


def wind_over_ground(
    winds: Mapping[str, Track], tracks: Mapping[str, Track]
) -> dict[str, Track]:
    """Wind over ground from that off the bow; empty where the velocity is missing."""
    true = {"wind_angle", "wind_speed"} <= winds.keys()
    kind = "wind" if true else "apparent_wind"
    if not {f"{kind}_angle", f"{kind}_speed"} <= winds.keys():
        return {}
    if not true and not {"sog", "cog"} <= tracks.keys():
        return {}

    angle, speed = winds[f"{kind}_angle"], winds[f"{kind}_speed"]
    bearing = angle.values + _continuous(tracks["psi"]).at(angle.t)
    if true:
        return {"wind_from": angle._replace(values=bearing), "wind_speed": speed}
    # complex: north + i east
    course = _continuous(tracks["cog"]).at(angle.t)
    own = tracks["sog"].at(angle.t) * np.exp(1j * course)
    wind = speed.values * np.exp(1j * bearing) - own
    return {
        "wind_from": angle._replace(values=np.angle(wind)),
        "wind_speed": angle._replace(values=np.abs(wind)),
    }


def _continuous(track: Track) -> Track:
    """An angle without jumps."""
    return track._replace(values=np.unwrap(track.values))
