"""Tracks in GPX: times and positions, to look at."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from shipgym.errors import InputError
from shipgym.trials.readers.damage import damage_reported
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.text_files import read_log_bytes


def read_gpx(path: Path) -> LogTable:
    """Read the points of a GPX track that have a time.

    Raises InputError for broken XML and a track without times.
    """
    content = read_log_bytes(path, "GPX track")
    with damage_reported(path, "a GPX track", "export it again"):
        root = ElementTree.fromstring(content)
    times, lat, lon = [], [], []
    for point in root.iter():
        if not point.tag.endswith("trkpt"):
            continue
        time = point.findtext("{*}time")
        if time:
            times.append(time)
            lat.append(point.get("lat", ""))
            lon.append(point.get("lon", ""))
    if not times:
        raise InputError(
            f"{path}: expected track points with a time, got none in this GPX file;"
            " export the track, not the route"
        )
    return LogTable(
        path=path,
        cells={"t": times, "lat": lat, "lon": lon},
        rows=list(np.arange(len(times)) + 1),
        place_words="track point {line}",
        units={"lat": "deg", "lon": "deg"},
        notes=(
            "this looks like a GPX track: it has neither rudder nor heading, the track"
            " can only be looked at; to identify the ship log heading and rudder too,"
            " for instance the sentences of NMEA 0183 (HDT, RSA)",
        ),
    )
