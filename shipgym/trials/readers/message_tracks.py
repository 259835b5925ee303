"""Of several sources of a channel the one to read, and a log's channels over time."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.clock_texts import is_dated
from shipgym.trials.readers.message_clock import Clock, times_of
from shipgym.trials.readers.messages import BySource, Heard, port_source
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
        of_source = _tracks_of(sources, clock)
        longest = max(longest, *(track.covered for track in of_source.values()))
        seconds = {port_source(source) for source in sources}
        singles = {name: sources[name] for name in sources if name not in seconds}
        best = _best_source(of_source, singles)
        tracks[channel] = of_source[best]
        if channel != "variation":
            name = channel.removesuffix("_magnetic")
            found.notes += _note_others(name, best, singles)
        if channel == "delta":
            _choose_rudder(found, of_source, best)

    if {"sog", "cog"} <= tracks.keys():  # at rest there is no course
        sog, cog = tracks["sog"], tracks["cog"]
        t, of_sog, of_cog = np.intersect1d(sog.t, cog.t, return_indices=True)
        lines = sog.lines[of_sog]
        tracks["sog"] = Track(t, lines, sog.values[of_sog], sog.source)
        tracks["cog"] = Track(t, lines, cog.values[of_cog], cog.source)
    _choose_heading(found)
    tracks.pop("variation", None)
    _leave_out_rare(found, longest)
    by_source: dict[str, list[str]] = {}
    for channel, track in tracks.items():
        by_source.setdefault(track.source, []).append(channel)
    read = [f"{', '.join(names)} from {source}" for source, names in by_source.items()]
    found.notes.insert(0, f"{'; '.join(read)}; time from {clock.source}")
    return found


def _leave_out_rare(found: Tracks, longest: float) -> None:
    """Leave out channels with hardly any values, with a note."""
    for channel, track in list(found.by_channel.items()):
        count = track.t.size
        is_needed = channel in ("psi", "delta")
        is_rare = track.covered < 0.1 * longest
        if (is_rare and not is_needed) or count < FEWEST_SAMPLES:
            del found.by_channel[channel]
            found.notes.append(
                f"{channel} of {track.source} left out: only {count} values"
            )


def _tracks_of(sources: BySource, clock: Clock) -> dict[str, Track]:
    """Values of each source at their own times, else at those of their lines."""
    tracks = {}
    for source in sorted(sources):
        values = sources[source]
        lines, _, numbers = np.array(values).T
        # to a tenth of a millisecond
        t = np.round(times_of(values, clock), 4)
        t, first = np.unique(t, return_index=True)
        tracks[source] = Track(t, lines[first], numbers[first], source)
    return tracks


def _best_source(tracks: dict[str, Track], sources: BySource) -> str:
    most = max(tracks[source].covered for source in sources)

    def rank(source: str) -> tuple[bool, int, bool, bool, int]:
        """The most important criterion first; II is a display that repeats others."""
        (first, *_) = sources[source]
        return (
            tracks[source].covered >= 0.5 * most,
            _PREFERENCE.get(source[2:5], 0),
            is_dated(first.time),
            not source.startswith("II"),
            tracks[source].t.size,
        )

    return max(sorted(sources), key=rank)


def _note_others(channel: str, best: str, sources: BySource) -> list[str]:
    counts = {}
    for source in sorted(sources):
        count = len(sources[source])
        counts[source] = f"{source} ({count} {'values' if count != 1 else 'value'})"
    chosen = counts.pop(best)
    if not counts:
        return []
    return [f"{channel} is from {chosen}; {', '.join(counts.values())} left out"]


def _choose_rudder(found: Tracks, tracks: dict[str, Track], best: str) -> None:
    """The rudder, of two the mean, unless one of them stands still."""
    track = tracks[best]
    speaker, *_ = best.split()
    if best == port_source(speaker):
        found.notes.append(f"delta is the rudder in the port field of {speaker}")
    port = tracks.get(port_source(best))
    if port is None:
        return
    moves = np.ptp(track.values) > 0.5 * DEGREE
    port_moves = np.ptp(port.values) > 0.5 * DEGREE
    if moves != port_moves:
        side, still = ("starboard", "port") if moves else ("port", "starboard")
        found.notes.append(
            f"delta is the {side} rudder of {best}: the {still} one is still"
        )
        if port_moves:
            found.by_channel["delta"] = port
        return
    of_port = port.at(track.t)
    apart_deg = np.mean(track.values - of_port) / DEGREE
    found.notes.append(
        f"delta is the mean of two rudders of {best}; the starboard one shows"
        f" {apart_deg:.2g} deg more than the port one on average"
    )
    mean = 0.5 * (track.values + of_port)
    found.by_channel["delta"] = track._replace(values=mean)


def _choose_heading(found: Tracks) -> None:
    """Take the heading by compass where no true one is logged for most of the time.

    The variation is added where the log has one; else the heading stays magnetic.
    """
    tracks = found.by_channel
    compass = tracks.pop("psi_magnetic", None)
    if compass is None:
        return
    true = tracks.get("psi")
    if true is not None:
        counts = [f"{one.source} ({one.t.size} values)" for one in (true, compass)]
        is_true = true.covered >= 0.5 * compass.covered
        if not is_true:
            counts.reverse()
        if true.source != compass.source:
            found.notes.append(f"psi is from {counts[0]}; {counts[1]} left out")
        if is_true:
            return
    tracks["psi"] = compass
    variation = tracks.get("variation")
    found.magnetic = variation is None
    if variation is None:
        return
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
