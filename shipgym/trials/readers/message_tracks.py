"""Of several sources of a channel the one to read, and a log's channels over time."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.readers.message_clock import Clock, is_dated, times_of
from shipgym.trials.readers.messages import BySource, Heard, Value, port_source
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


class _Rank(NamedTuple):
    """Rank of a source, by the most important criterion first."""

    has_data: bool
    preference: int  # by its kind
    is_dated: bool
    is_original: bool  # no display (II) that repeats others' sentences
    moments: int  # at which it says something


@dataclass(frozen=True)
class Tracks:
    """The channels of a log, each of one source, and what was left out."""

    by_channel: dict[str, Track]
    notes: list[str]
    magnetic: bool = False  # the heading counts from magnetic north


def choose_tracks(heard: Heard, clock: Clock) -> Tracks:
    """Channels of a log, each of its best source, on the clock of the log."""
    notes: list[str] = []
    tracks: dict[str, Track] = {}
    chosen = {}
    longest = 0.0
    for channel, sources in heard.channels.items():
        of_source = _tracks_of(sources, clock)
        for track in of_source.values():
            covered = _covered(track)
            longest = max(longest, covered)
        if channel == "delta":
            tracks[channel], chosen[channel] = _rudder(of_source, sources, notes)
            continue
        best = _best_source(of_source, sources)
        tracks[channel] = of_source[best]
        chosen[channel] = best
        if channel != "variation":
            name = channel.removesuffix("_magnetic")
            notes += _note_others(name, best, sources)

    if {"sog", "cog"} <= tracks.keys():
        tracks |= _at_common_times(tracks["sog"], tracks["cog"])
    is_magnetic = _true_heading(tracks, chosen, notes)
    tracks.pop("variation", None)
    notes += _leave_out_rare(tracks, chosen, longest)
    read = _read_from(tracks, chosen)
    origins = f"{read}; time from {clock.source}"
    return Tracks(
        by_channel=tracks,
        notes=[origins, *notes],
        magnetic=is_magnetic,
    )


def _read_from(tracks: Mapping[str, Track], chosen: Mapping[str, str]) -> str:
    """Channels by their source: ``psi from HEHDT, delta from AGRSA``."""
    by_source: dict[str, list[str]] = {}
    for channel in tracks:
        by_source.setdefault(chosen[channel], []).append(channel)
    phrases = []
    for source, channels in by_source.items():
        names = ", ".join(channels)
        phrases.append(f"{names} from {source}")
    return "; ".join(phrases)


def _leave_out_rare(
    tracks: dict[str, Track], chosen: Mapping[str, str], longest: float
) -> list[str]:
    """Leave out channels with hardly any values; notes of them."""
    notes = []
    for channel, track in list(tracks.items()):
        count = track.t.size
        is_needed = channel in ("psi", "delta")
        is_rare = _covered(track) < 0.1 * longest
        is_left_out = is_rare and not is_needed
        if is_left_out or count < FEWEST_SAMPLES:
            del tracks[channel]
            notes.append(
                f"{channel} of {chosen[channel]} left out: only {count} values"
            )
    return notes


def _at_common_times(sog: Track, cog: Track) -> dict[str, Track]:
    """Speed and course over ground where both are there: at rest there is no course."""
    t, of_sog, of_cog = np.intersect1d(sog.t, cog.t, return_indices=True)
    lines = sog.lines[of_sog]
    return {
        "sog": Track(t, lines, sog.values[of_sog]),
        "cog": Track(t, lines, cog.values[of_cog]),
    }


def _tracks_of(sources: BySource, clock: Clock) -> dict[str, Track]:
    """Values of each source at their own times, else at those of their lines."""
    tracks = {}
    for source in sorted(sources):
        values = sources[source]
        lines, _, numbers = np.array(values).T
        # to a tenth of a millisecond
        t = np.round(times_of(values, clock), 4)
        t, first = np.unique(t, return_index=True)
        tracks[source] = Track(t, lines[first], numbers[first])
    return tracks


def _best_source(tracks: dict[str, Track], sources: BySource) -> str:
    covered = {source: _covered(tracks[source]) for source in sources}
    most = max(covered.values())

    def rank(source: str) -> _Rank:
        kind = source[2:5]
        first, *_ = sources[source]
        return _Rank(
            has_data=covered[source] >= 0.5 * most,
            preference=_PREFERENCE.get(kind, 0),
            is_dated=is_dated(first.time),
            is_original=not source.startswith("II"),
            moments=tracks[source].t.size,
        )

    return max(sorted(sources), key=rank)


def _covered(track: Track) -> float:
    """Time, s, for which a value is not older than a few seconds."""
    longest = 3.0
    steps = np.append(np.diff(track.t), longest)
    return float(np.minimum(steps, longest).sum())


def _note_others(channel: str, best: str, sources: BySource) -> list[str]:
    others = []
    for source in sorted(sources.keys() - {best}):
        count = _count(sources[source])
        others.append(f"{source} ({count})")
    if not others:
        return []
    left_out = ", ".join(others)
    count = _count(sources[best])
    return [f"{channel} is from {best} ({count}); {left_out} left out"]


def _count(values: list[Value]) -> str:
    count = len(values)
    return f"{count} values" if count != 1 else "1 value"


def _rudder(
    tracks: dict[str, Track], sources: BySource, notes: list[str]
) -> tuple[Track, str]:
    """The rudder, of two the mean, unless one of them stands still."""
    seconds = {port_source(source) for source in tracks}
    singles = {}
    for source in tracks.keys() - seconds:
        singles[source] = sources[source]
    best = _best_source(tracks, singles)
    notes += _note_others("delta", best, singles)
    track = tracks[best]
    second = port_source(best)
    port = tracks.get(second)
    speaker, *_ = best.split()
    if best == port_source(speaker):
        notes.append(f"delta is the rudder in the port field of {speaker}")
    if port is None:
        return track, best

    moves = _moves(track)
    port_moves = _moves(port)
    if moves and not port_moves:
        notes.append(f"delta is the starboard rudder of {best}: the port one is still")
        return track, best
    if port_moves and not moves:
        notes.append(f"delta is the port rudder of {best}: the starboard one is still")
        return port, second

    of_port = np.interp(track.t, port.t, port.values)
    apart_deg = np.mean(track.values - of_port) / DEGREE
    notes.append(
        f"delta is the mean of two rudders of {best}; the starboard one shows"
        f" {apart_deg:.2g} deg more than the port one on average"
    )
    mean = 0.5 * (track.values + of_port)
    return track._replace(values=mean), best


def _moves(track: Track) -> bool:
    return bool(np.ptp(track.values) > 0.5 * DEGREE)


def _true_heading(
    tracks: dict[str, Track], chosen: dict[str, str], notes: list[str]
) -> bool:
    """Take the heading by compass where no true one is logged for most of the time.

    The variation is added where the log has one; else True is returned: the heading
    stays magnetic.
    """
    compass = tracks.pop("psi_magnetic", None)
    if compass is None:
        return False
    source = chosen["psi_magnetic"]
    true = tracks.get("psi")
    if true is not None and _covered(true) >= 0.5 * _covered(compass):
        if source != chosen["psi"]:
            notes.append(_heading_note(chosen["psi"], true, source, compass))
        return False

    if true is not None:
        notes.append(_heading_note(source, compass, chosen["psi"], true))
    chosen["psi"] = source
    variation = tracks.get("variation")
    if variation is None:
        tracks["psi"] = compass
        return True

    added = np.interp(compass.t, variation.t, variation.values)
    tracks["psi"] = compass._replace(values=compass.values + added)
    middle = float(np.median(added)) / DEGREE
    side = "E" if middle >= 0.0 else "W"
    notes.append(
        f"psi is the magnetic heading of {source} with the variation of"
        f" {chosen['variation']} added, {abs(middle):.1f} deg {side}"
    )
    return False


def _heading_note(best: str, track: Track, other: str, left_out: Track) -> str:
    count = track.t.size
    count_left_out = left_out.t.size
    return (
        f"psi is from {best} ({count} values); {other} ({count_left_out} values) left"
        " out"
    )
