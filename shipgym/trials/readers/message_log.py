"""Logs of messages of a ship's buses, read as a table of channels.

The messages are sentences of NMEA 0183, PGNs of NMEA 2000 and deltas of Signal K, also
mixed, with or without a time before each.
"""

from pathlib import Path

import numpy as np

from shipgym.checks import placed
from shipgym.errors import InputError
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.message_clock import log_clock
from shipgym.trials.readers.message_tracks import (
    Track,
    choose_tracks,
    wind_over_ground,
)
from shipgym.trials.readers.messages import Heard, is_wind
from shipgym.trials.readers.nmea0183 import hear_sentences
from shipgym.trials.readers.nmea2000 import hear_pgns
from shipgym.trials.readers.signalk import hear_deltas
from shipgym.trials.readers.text_files import text_lines


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
    chosen = choose_tracks(heard, clock)
    tracks = dict(chosen.by_channel)
    winds = {name: tracks.pop(name) for name in chosen.by_channel if is_wind(name)}
    if winds and "psi" in tracks:
        tracks |= wind_over_ground(winds, tracks)
    notes += chosen.notes
    if not tracks:
        raise InputError(
            f"{path}: expected several values of a ship's motion (RMC, HDT, HDG, ROT,"
            " RSA and others), got too few: log these too"
        )
    return _table(path, tracks, notes, magnetic=chosen.magnetic)


def _check_damage(path: Path, heard: Heard) -> list[str]:
    """Refuse a log of many damaged messages; a note of few."""
    damaged = len(heard.damaged)
    if damaged > 0.1 * heard.count:
        raise InputError(
            f"{path}: line {heard.damaged[0]}: expected hardly any damaged sentences,"
            f" got {damaged} of {heard.count} with a wrong or no checksum or broken"
            " fields, this the first; the log was damaged on the way: take the original"
        )
    if not damaged:
        return []
    return [
        f"{damaged} of {heard.count} sentences with a wrong checksum or broken"
        " fields left out"
    ]


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
        own_clocks=True,
        magnetic=magnetic,
    )
