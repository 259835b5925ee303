"""Golden section `readers`: logs of every kind as trials, and what is wrong in them, in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache, partial, reduce
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from shipgym.ships.particulars import Particulars
from shipgym.trials import (
    angle_texts,
    clock_texts,
    cuts,
    sensors,
    units,
)
from shipgym.trials.columns import parse_columns
from shipgym.trials.conventions import Conventions
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.guesses import guess_columns, guess_trial
from shipgym.trials.readers.csv_file import read_csv
from shipgym.trials.readers.frames import read_frame
from shipgym.trials.readers.kinds import read_log, recognise_kind
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.resampling import Log
from shipgym.trials.scale import check_scale
from shipgym.trials.ship_file import ShipFile
from shipgym.trials.trial import Trial
from shipgym.trials.trial_import import import_tables
from tests.golden.answers import Questions, asked, plain, refused
from tests.golden.store import Floats

CORPUS = Path(__file__).parents[1] / "corpus"
DEGREE, KNOT = np.pi / 180.0, 1852.0 / 3600.0
LAT, LON = -33.8614, 151.2099
AROUND = (0.8, 0.9, 0.97, 1.03, 1.1, 1.2)  # a limit
Answers = dict[str, Any]


@cache
def sailed(n: int = 481, step: float = 0.5) -> dict[str, Floats]:
    """Zigzags of a ship of 150 m and a leg on another course, in a current; midship, SI units."""
    t = step * np.arange(n)
    steady = ((t > 95.0) & (t < 145.0)) | (t > 200.0)
    delta = np.where(steady, 0.01, 0.24 * np.tanh(4.0 * np.sin(t / 8.0 + 0.3)) + 0.01)
    delta[(t > 147.0) & (t <= 200.0)] = 0.26
    r, psi = np.zeros(n), np.full(n, 6.1)
    for k in range(1, n):
        r[k] = r[k - 1] + step * (0.09 * delta[k - 1] - r[k - 1]) / (
            3.0 if steady[k] else 7.0
        )
        psi[k] = psi[k - 1] + 0.5 * step * (r[k] + r[k - 1])
    u, v = 6.7 - 500.0 * r**2, -40.0 * r + 0.05
    north = u * np.cos(psi) - v * np.sin(psi) + 0.31
    east = u * np.sin(psi) + v * np.cos(psi) - 0.47
    x, y = (np.r_[0.0, np.cumsum(0.5 * step * (a[1:] + a[:-1]))] for a in (north, east))
    return {
        "t": t,
        "delta": delta,
        "r": r,
        "psi": psi,
        "u": u,
        "v": v,
        "x": x,
        "y": y,
        "n": 1.7 + 0.2 * np.sin(t / 50.0),
        "north": north,
        "east": east,
        "phi": 0.06 * np.sin(t / 9.0),
        "stw": u + 0.02 * np.cos(t / 11.0),
    }


@cache
def gnss(forward: float = 25.0, starboard: float = -3.0) -> dict[str, Floats]:
    """Latitude, longitude, and speed and course over ground of an antenna."""
    s = sailed()
    c, sn = np.cos(s["psi"]), np.sin(s["psi"])
    x, y = s["x"] + c * forward - sn * starboard, s["y"] + sn * forward + c * starboard
    north, east = (
        s["north"] - s["r"] * (sn * forward + c * starboard),
        s["east"] + s["r"] * (c * forward - sn * starboard),
    )
    per = 111_000.0, 92_400.0
    return {
        "lat": LAT + x / per[0],
        "lon": LON + y / per[1],
        "sog": np.hypot(north, east),
        "cog": np.arctan2(east, north) % (2.0 * np.pi),
    }


def csv(
    name: str, content: Mapping[str, Any], delimiter: str = ",", digits: int = 7
) -> str:
    """Write columns, numbers or texts; the name of the file."""
    rows = zip(*(list(values) for values in content.values()), strict=True)
    cells = [
        [one if isinstance(one, str) else f"{one:.{digits}g}" for one in row]
        for row in rows
    ]
    lines = [delimiter.join(row) for row in [list(content), *cells]]
    Path(name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return name


def own_names(**changed: Any) -> dict[str, Any]:
    """Columns named like channels, some of them changed; None leaves one out."""
    found = {
        name: sailed()[name] for name in ("t", "x", "y", "psi", "u", "v", "r", "delta")
    } | changed
    return {name: values for name, values in found.items() if values is not None}


def blank(values: Floats, *rows: int) -> list[str]:
    """Values with empty cells."""
    return ["" if k in rows else f"{one:.7g}" for k, one in enumerate(values)]


def log_csv() -> Answers:
    """Units, signs, frames, origins, repairs and derived channels of one log."""
    s, g = sailed(), gnss()
    psi, read = s["psi"], partial(Trial.from_csv, name="log")
    in_units = {
        "t": {"column": "minutes", "unit": "min"},
        "x": {"column": "km", "unit": "km"},
        "y": {"column": "ft", "unit": "ft"},
        "psi": {"column": "deg", "unit": "deg"},
        "u": {"column": "kn", "unit": "knots"},
        "v": {"column": "km/h", "unit": "km/h"},
        "r": {"column": "deg/min", "unit": "deg/min"},
        "n": {"column": "rpm", "unit": "rpm"},
        "delta": "rad",
    }
    other_units = {
        "minutes": s["t"] / 60.0,
        "km": s["x"] / 1e3,
        "ft": s["y"] / 0.3048,
        "deg": psi / DEGREE % 360.0,
        "kn": s["u"] / KNOT,
        "km/h": s["v"] * 3.6,
        "deg/min": s["r"] / DEGREE * 60.0,
        "rpm": 60.0 * s["n"],
        "rad": -s["delta"],
    }
    csv("units.csv", other_units, digits=10)
    csv("own.csv", own_names(), digits=10)
    csv("earth.csv", own_names(u=s["north"], v=s["east"]), digits=10)
    cg = {
        "x": s["x"] + 4.2 * np.cos(psi),
        "y": s["y"] + 4.2 * np.sin(psi),
        "v": s["v"] + 4.2 * s["r"],
    }
    csv(
        "cg.csv",
        own_names(**cg, Y=300.0 * s["v"], N=5e3 * s["r"], X=20.0 * s["u"]),
        digits=10,
    )
    csv("position.csv", own_names(u=None, v=None, r=None), digits=10)
    csv("rate.csv", {name: s[name] for name in ("t", "u", "r", "delta")}, digits=10)
    csv(
        "holes.csv",
        own_names(
            psi=blank(psi % (2 * np.pi), 0, 1, 40, 41, 42, 120), u=blank(s["u"], 7, 480)
        ),
    )
    csv(
        "semicolons.csv",
        {"t": s["t"], "u": [f"{one:.4f}".replace(".", ",") for one in s["u"]]},
        ";",
    )
    north = {
        "t": s["t"],
        "lat": s["x"] / 110_574.0,
        "lon": s["y"] / 111_320.0,
        "psi": psi,
    }
    csv("equator.csv", north, digits=10)
    plain_columns = {
        name: name for name in ("t", "lat", "lon", "sog", "cog", "psi", "delta")
    }
    knots = {
        "sog": {"column": "sog", "unit": "kn"},
        "cog": {"column": "cog", "unit": "deg"},
    }
    over_ground = {**g, "sog": g["sog"] / KNOT, "cog": g["cog"] / DEGREE}
    csv(
        "gnss.csv",
        {
            "t": s["t"],
            **over_ground,
            "psi": psi + 0.06,
            "delta": s["delta"],
            "stw": s["stw"],
        },
        digits=12,
    )
    antenna = {"gnss_antenna": {"forward": 25.0, "starboard": -3.0}}
    estimated = antenna | {"heading_offset_deg": "estimate", "rudder_offset_deg": 0.4}
    drift = {**plain_columns, **knots, "stw": "stw"}
    gyro_only = {
        name: plain_columns[name] for name in ("t", "lat", "lon", "psi", "delta")
    }
    return {
        "units, port": lambda: read("units.csv", in_units, "port"),
        "own": lambda: read("own.csv", kind="zigzag", use="validate", length=151.5),
        "earth": lambda: read("earth.csv", velocity_frame="earth"),
        "centre of gravity": lambda: read("cg.csv", origin="cg", xg=4.2),
        "position": lambda: read("position.csv"),
        "rate": lambda: read("rate.csv"),
        "equator": lambda: read("equator.csv"),
        "holes": lambda: read("holes.csv", repair="interpolate"),
        "semicolons": lambda: read("semicolons.csv"),
        "over ground": lambda: read("gnss.csv", {**plain_columns, **knots}),
        "antenna": lambda: read(
            "gnss.csv", {**plain_columns, **knots}, sensors=antenna
        ),
        "estimated": lambda: read(
            "gnss.csv", {**plain_columns, **knots}, sensors=estimated
        ),
        "rudder estimated": lambda: read(
            "gnss.csv",
            {**plain_columns, **knots},
            sensors={"rudder_offset_deg": "estimate"},
        ),
        "speed log": lambda: read("gnss.csv", drift, sensors=antenna),
        "track alone": lambda: read(
            "gnss.csv", gyro_only, sensors=antenna | {"heading_offset_deg": 3.4}
        ),
        "without rudder": lambda: read(
            "gnss.csv", {n: n for n in ("t", "lat", "lon", "psi")}
        ),
    }


def refusals() -> Answers:
    """What is wrong in a log, a file or its conventions."""
    s, g = sailed(), gnss()
    psi, n = s["psi"], len(s["t"])
    found: Answers = {}

    def tried(name: str, content: Mapping[str, Any], *words: Any, **more: Any) -> None:
        found[name] = asked(
            lambda: (
                Trial.from_csv(csv("log.csv", content, digits=10), *words, **more).notes
            )
        )

    def text(name: str, content: str | bytes) -> None:
        Path("log.csv").write_bytes(
            content if isinstance(content, bytes) else content.encode()
        )
        found[name] = asked(lambda: Trial.from_csv("log.csv").notes)

    tried("degrees", own_names(psi=psi / DEGREE))
    tried(
        "degrees for radians of the rate", own_names(psi=None, r=s["r"] / DEGREE * 3.0)
    )
    tried("rudder in degrees", own_names(delta=s["delta"] / DEGREE))
    tried("knots", own_names(u=s["u"] * 20.0))
    tried("rate of the other sign", own_names(r=-s["r"]))
    tried("rate in degrees", own_names(r=np.clip(s["r"] / DEGREE, -1.0, 1.0), x=None))
    tried(
        "rate per minute",
        {**own_names(r=s["r"] / DEGREE * 60.0)},
        {**{k: k for k in own_names()}, "r": {"column": "r", "unit": "deg/s"}},
    )
    tried("earth for body", own_names(u=s["north"], v=s["east"]))
    tried("body for earth", own_names(), velocity_frame="earth")
    tried("velocities in knots", own_names(u=s["u"] / KNOT, v=s["v"] / KNOT))
    tried(
        "one heading",
        own_names(psi=np.where(np.arange(n) == 33, psi + 1.3, psi), x=None, r=None),
    )
    tried("missing value", own_names(u=blank(s["u"], 12, 13)))
    tried("missing time", own_names(t=blank(s["t"], 12)), repair="interpolate")
    tried("hole", own_names(u=blank(s["u"], *range(50, 80))), repair="interpolate")
    tried(
        "mostly empty",
        own_names(u=blank(s["u"], *(k for k in range(n) if k % 3))),
        repair="interpolate",
    )
    tried("time back", own_names(t=np.where(np.arange(n) == 9, 2.0, s["t"])))
    tried("time stands", own_names(t=np.where(np.arange(n) == 9, 4.0, s["t"])))
    tried("two rows", {name: values[:2] for name, values in own_names().items()})
    tried("text", own_names(v=[*blank(s["v"])[:-1], "fast"]))
    tried("no time", own_names(t=["yesterday"] * n))
    tried("no such column", own_names(), {"t": "t", "psi": "heading"})
    tried("no channel", own_names(), {"t": "t"})
    tried("unknown channel", own_names(), {"t": "t", "heading": "psi"})
    tried("unit", own_names(), {"psi": {"column": "psi", "unit": "knots"}})
    tried("no unit", own_names(), {"psi": {"column": "psi", "unit": "degrees"}})
    tried("entry", own_names(), {"psi": 3})
    tried("key", own_names(), {"psi": {"column": "psi", "date": "d"}})
    tried("zone", own_names(), {"t": {"column": "t", "zone": "CET"}, "psi": "psi"})
    tried("rudder positive", own_names(), None, "left")
    tried("frame", own_names(), None, "port", "ned")
    tried("origin", own_names(), origin="bow")
    tried("repair", own_names(), repair="guess")
    tried("no xg", own_names(), origin="cg")
    tried("xg", own_names(), origin="cg", xg=float("nan"))
    tried("cg without rate", {k: s[k] for k in ("t", "v", "u")}, origin="cg", xg=1.0)
    tried(
        "earth without heading",
        {k: s[k] for k in ("t", "v", "u")},
        velocity_frame="earth",
    )
    tried("latitude alone", {"t": s["t"], "lat": g["lat"]})
    tried("speed alone", {"t": s["t"], "sog": g["sog"]})
    tried("no position", {"t": s["t"], "lat": ["57 north"] * n, "lon": g["lon"]})
    far = np.where(np.isin(np.arange(n), [20, 77]), g["lat"] + 0.2, g["lat"])
    tried("outlier", {"t": s["t"], "lat": far, "lon": g["lon"], "psi": psi})
    tried(
        "outlier repaired",
        {"t": s["t"], "lat": far, "lon": g["lon"], "psi": psi},
        repair="interpolate",
    )
    tried(
        "beyond the pole",
        {"t": s["t"], "lat": g["lat"] - 57.0, "lon": g["lon"], "psi": psi},
    )
    tried(
        "two ships",
        {
            "t": s["t"],
            "lat": g["lat"] + 0.2 * (np.arange(n) % 2),
            "lon": g["lon"],
            "psi": psi,
        },
    )
    tried("berth", {"t": s["t"], "sog": 0.01 * g["sog"], "cog": g["cog"], "psi": psi})
    tried(
        "course as heading",
        {"t": s["t"], "sog": g["sog"], "cog": g["cog"], "psi": g["cog"] + 0.001},
    )
    tried(
        "mirrored heading", {"t": s["t"], "sog": g["sog"], "cog": g["cog"], "psi": -psi}
    )
    tried(
        "turned heading",
        {"t": s["t"], "sog": g["sog"], "cog": g["cog"], "psi": psi + 0.9},
    )
    tried(
        "offset",
        {
            "t": s["t"],
            "sog": g["sog"],
            "cog": g["cog"],
            "psi": psi + 0.09,
            "delta": s["delta"],
        },
    )
    magnetic = {"t": "t", "sog": "sog", "cog": "cog", "psi": "mag"}
    tried(
        "magnetic",
        {"t": s["t"], "sog": g["sog"], "cog": g["cog"], "mag": psi},
        magnetic,
    )
    tried("no heading", {"t": s["t"], "sog": g["sog"], "cog": g["cog"], "u": s["u"]})
    tried("against the rudder", own_names(delta=-s["delta"]))
    circle = np.linspace(0.0, 2.0, n)
    tried(
        "circle against the rudder",
        {"t": s["t"], "psi": -circle, "delta": 0.3 + 0.0 * circle},
    )
    tried("late rudder", own_names(delta=np.interp(s["t"] - 4.0, s["t"], s["delta"])))
    tried("late rate", own_names(r=np.interp(s["t"] - 2.2, s["t"], s["r"])))
    for choice in ("correct", "keep"):
        content = own_names(r=np.interp(s["t"] + 2.2, s["t"], s["r"]))
        path = csv("log.csv", content, digits=10)
        found[f"early rate, {choice}"] = asked(
            lambda path=path, choice=choice: Trial.from_csv(
                path, sensors={"clock_offsets": choice}
            )
        )
    wide = {"t": s["t"], "psi": psi, "delta": s["delta"]}
    tried("estimate", wide, sensors={"heading_offset_deg": "estimate"})
    tried("clocks", wide, sensors={"clock_offsets": "maybe"})
    tried("offset's type", wide, sensors={"rudder_offset_deg": "some"})
    tried("offset's size", wide, sensors={"rudder_offset_deg": -181.0})
    tried("sensors", wide, sensors={"antenna": 1.0})
    tried("header twice", {"t": s["t"], " t": s["t"]})
    for name, content in {
        "empty": "",
        "blank": "\n \n",
        "numbers": "1,2\n3,4\n",
        "binary": b"t,u\n1,\x002\n",
        "ragged": "t,u\n1,2\n2,3,4\n",
        "quoted": 't,u\n1,"2"\n2,"3",4\n',
        "unprintable": "t,u\x07\n1,2\n",
        "unnamed": "a,b\n1,2\n2,3\n",
        "wide": ",".join(f"c{k}" for k in range(1001)) + "\n",
        "a line": "t,u\n1," + "2" * 100_001 + "\n",
    }.items():
        text(name, content)
    found["none"] = asked(lambda: Trial.from_csv("none.csv"))
    found["folder"] = asked(lambda: Trial.from_csv("."))
    return found


def clocks() -> Answers:
    """Times, dates, zones and angles as instruments write them."""
    times = {
        "iso": ["2024-05-31T09:30:00Z", "", "2024-05-31T09:30:01.5Z"],
        "zones": ["2024-05-31T11:30:00+02:00", "2024-05-31T09:30:07Z"],
        "day first": ["31.05.2024 09:30:00", "31.05.2024 09:30:01"],
        "either": ["03/04/2024 23:59:59", "04/04/2024 00:00:01"],
        "of the day": ["23:59:58", "23:59:59,5", "", "00:00:01"],
        "minutes": ["9:30", "09:31"],
        "nothing": ["", ""],
        "words": ["09:30:00", "noon"],
        "date": ["2024-05-31", "2024-06-01"],
    }
    angles = {
        "degrees": ["57.6872", "-11.5", "", "+3,25"],
        "minutes": ["57°41.234'N", "11 44.5 W", "S 033°10'30\""],
        "nmea": ["5741.234N", "01144.5W", "0002.5S"],
        "seconds": ["57°41'14.04\"N", "57 41 14.04"],
        "wrong": ["57°61'N"],
        "text": ["57 north"],
        "seconds too many": ["57°10'60\""],
        "both": ["-57.5S", "-12.25N"],
    }
    start = clock_texts.read_clock(["2024-05-31T09:30:00Z"]).seconds[0]
    s, ticks = (
        sailed(),
        [
            datetime(2024, 5, 31, 9, 30, tzinfo=UTC) + timedelta(seconds=0.5 * k)
            for k in range(481)
        ],
    )
    dated = {
        "date": [one.strftime("%d.%m.%Y") for one in ticks],
        "time": [one.strftime("%H:%M:%S.%f") for one in ticks],
        "u": s["u"],
    }
    csv("dated.csv", dated)
    csv("unix.csv", {"clock": 1e12 + 500.0 * np.arange(481), "u": s["u"]}, digits=16)
    csv("both.csv", {"clock": 1e9 + 0.5 * np.arange(481), "u": s["u"]}, digits=16)
    zone = {"t": {"column": "time", "date": "date", "zone": "+03:30"}, "u": "u"}

    def started(path: str, given: dict[str, Any]) -> Any:
        log = import_tables([read_log(path)], parse_columns(given), Conventions())
        return log.t, log.start

    def angle_error(values: list[str]) -> Any:
        try:
            return plain(angle_texts.read_angles(values))
        except ValueError as error:
            return f"ValueError {error}"

    def clock_error(values: list[str]) -> Any:
        try:
            return plain(tuple(clock_texts.read_clock(values)))
        except ValueError as error:
            return f"ValueError {error}"

    return {
        "clocks": {name: clock_error(values) for name, values in times.items()},
        "angles": {name: angle_error(values) for name, values in angles.items()},
        "as minutes": lambda: angle_texts.read_angles(["12.5", "145.25"], True),
        "zones": [
            lambda one=one: clock_texts.zone_seconds(one, "here")
            for one in ("UTC", "+02:00", "-03:30", "CET", "")
        ],
        "words": [
            clock_texts.clock_text(one).replace("-", " ")
            for one in (start, start + 0.26, 34_200.0, 86_399.0, 172_799.0, 200_000.0)
        ],
        "dated": lambda: started("dated.csv", zone),
        "unix ms": lambda: started(
            "unix.csv", {"t": {"column": "clock", "unit": "unix ms"}, "u": "u"}
        ),
        "unix": lambda: started(
            "both.csv", {"t": {"column": "clock", "unit": "unix"}, "u": "u"}
        ),
    }


def derivatives() -> Answers:
    """Signals of more and less noise, on even and uneven clocks, long and short."""
    random = np.random.default_rng(3)
    t = np.cumsum(random.uniform(0.2, 0.4, 240)) + 13.0
    signal = 1.7 * np.sin(0.11 * t) + 0.002 * t**2
    noise = random.standard_normal(240)
    found = {
        f"noise {size:g}": time_derivative(t, signal + size * noise)
        for size in (0.0, 1e-3, 0.02, 0.3)
    }
    walk = np.cumsum(noise)
    found |= {
        "walk": time_derivative(t, signal + 0.003 * walk),
        "short": time_derivative(t[:5], signal[:5] + 0.01 * noise[:5]),
    }
    found |= {
        f"{n} samples": time_derivative(t[:n], signal[:n] + 0.02 * noise[:n])
        for n in (3, 15, 16, 17, 24, 25, 40)
    }
    found |= {"nothing": time_derivative(t, 0.0 * t)}
    steep = [
        np.abs(
            time_derivative(t, signal + size * noise) - time_derivative(t, signal)
        ).max()
        for size in np.geomspace(1e-4, 0.1, 13)
    ]
    return {
        name: asked(lambda one=one: one)
        for name, one in (found | {"error": np.array(steep)}).items()
    }


def sentence(text: str) -> str:
    """A sentence of NMEA 0183 with its checksum."""
    return f"${text}*{reduce(lambda a, b: a ^ b, map(ord, text)):02X}"


def nmea_logs() -> Answers:
    """Logs of NMEA 0183: every sentence, several talkers, damage, no dates, winds of all kinds."""
    s, g = sailed(), gnss()

    def log(
        name: str,
        *more: str,
        every: int = 4,
        clock: str = "310524",
        start: int = 34_170,
    ) -> str:
        lines = ["!AIVDM,1,1,,B,13u=gHP3CWPlvs2Q8sHW:5fD0h6a,0*1B"]
        for k in range(0, 240, every):
            now = start + k // 2
            told = f"{now // 3600 % 24:02d}{now // 60 % 60:02d}{now % 60:02d}"
            lat, lon = (abs(g[one][k]) for one in ("lat", "lon"))
            place = f"{int(lat):02d}{lat % 1 * 60:07.4f},S,{int(lon):03d}{lon % 1 * 60:07.4f},E"
            values = {
                "told": told,
                "place": place,
                "date": clock,
                "sog": g["sog"][k] / KNOT,
                "cog": g["cog"][k] / DEGREE,
                "psi": s["psi"][k] / DEGREE % 360.0,
                "mag": (s["psi"][k] / DEGREE - 7.0) % 360.0,
                "rot": s["r"][k] / DEGREE * 60.0,
                "rudder": s["delta"][k] / DEGREE,
                "stw": s["stw"][k] / KNOT,
                "rpm": 60.0 * s["n"][k],
            }
            lines += [sentence(one.format(**values)) for one in more]
        Path(name).write_text("\r\n".join(lines) + "\r\n")
        return name

    rmc = "GPRMC,{told}.00,A,{place},{sog:.2f},{cog:.1f},{date},,,A"
    gga, gll = (
        "IIGGA,{told}.00,{place},1,08,1.0,20.0,M,,M,,",
        "GPGLL,{place},{told}.00,A,A",
    )
    motion = (
        "HETHS,{psi:.2f},A",
        "HCHDG,{mag:.1f},1.5,W,8.5,E",
        "TIROT,{rot:.2f},A",
        "RIRSA,{rudder:.1f},A,,",
        "ERRPM,S,1,{rpm:.1f},100.0,A",
    )
    waters = ("VWVHW,{psi:.1f},T,,M,{stw:.2f},N,,K", "VDVBW,{stw:.2f},-0.21,A,,,V")
    winds = ("WIMWV,030.0,R,10.0,N,A", "WIMWV,051.0,R,9.0,K,A")
    true_wind, empty = (
        ("WIMWV,044.0,T,12.5,M,A",),
        (
            "GPGLL,,,,,{told}.00,V,N",
            "HETHS,,V",
            "GPVTG,,T,,M,,N,,K,N",
            "WIMWV,030.0,R,10.0,X,A",
        ),
    )

    def table(name: str) -> Any:
        found = read_log(name)
        return (
            {one: found.numbers(one) for one in found.header},
            found.notes,
            list(found.rows[:3]),
            found.place(2),
            found.units.get("t", "s"),
        )

    log("all.nmea", rmc, gga, *motion, *waters, *winds)
    log(
        "true.nmea",
        gll,
        "GPVTG,{cog:.1f},T,,M,{sog:.2f},N,,K,A",
        "HEHDT,{psi:.2f},T",
        *true_wind,
        *motion[2:4],
    )
    log("midnight.nmea", gll, "HEHDG,{psi:.2f},,,,", *waters[:1], start=86_370)
    log("empty.nmea", rmc, *motion, *empty)
    log("no wind.nmea", gga, *winds, "HEHDT,{psi:.2f},T")
    damaged = (
        Path(log("damaged.nmea", rmc, *motion[:1], every=6)).read_text().splitlines()
    )
    for count in (7, 8, 9):
        Path(f"damaged {count}.nmea").write_text(
            "\n".join(
                [
                    one[:-1] + "Z" if k < count + 1 else one
                    for k, one in enumerate(damaged)
                ]
            )
        )
    Path("infinite.nmea").write_text(
        "\n".join(
            [
                *damaged,
                sentence("GPVTG,inf,T,,M,5.0,N,,K,A"),
                damaged[1],
                "$GPRMC,broken",
            ]
        )
    )
    Path("dark.nmea").write_text("\n".join(sentence("HEHDT,30.0,T") for _ in range(5)))
    Path("still.nmea").write_text(
        "\n".join(sentence("GPZDA,093000,31,05,2024,00,00") for _ in range(5))
    )
    sight = {"gnss_antenna": {"forward": 25.0, "starboard": -3.0}}
    names = (
        "all",
        "true",
        "midnight",
        "empty",
        "no wind",
        "damaged",
        "damaged 7",
        "damaged 8",
        "damaged 9",
        "infinite",
        "dark",
        "still",
    )
    return (
        {
            f"{name} table": asked(lambda name=name: table(f"{name}.nmea"))
            for name in names
        }
        | {
            name: lambda name=name: Trial.from_csv(
                f"{name}.nmea", sensors=sight, name=name
            )
            for name in ("all", "true", "midnight")
        }
        | {
            "corpus": lambda: table(str(CORPUS / "log" / "bridge.nmea")),
            "is": [
                recognise_kind(Path(one)) == "nmea" for one in ("all.nmea", "dark.nmea")
            ],
        }
    )


def kinds_of_files() -> Answers:
    """Excel, Parquet, MATLAB and frames; damaged ones too."""
    found: Answers = {}
    for ending in ("csv", "xlsx", "parquet", "mat"):
        path = CORPUS / "log" / f"bridge.{ending}"
        table = read_log(path)
        cells = {name: " ".join(table.texts(name)[::4]) for name in table.header}
        found[ending] = asked(
            lambda t=table, c=cells: [
                t.header,
                c,
                t.place(2),
                list(t.rows[:4]),
                t.decimal_comma,
                t.notes,
                t.units.get("t", "s"),
            ]
        )
        if ending != "csv":
            Path(f"cut.{ending}").write_bytes(
                path.read_bytes()[: path.stat().st_size // 3]
            )
            found[f"cut {ending}"] = asked(
                lambda e=ending: read_log(f"cut.{e}").header
            ).__class__.__name__
    numbers_of = {name: sailed()[name][:30] for name in ("t", "psi", "u")}
    frame = pd.DataFrame(numbers_of)
    found["frame"] = asked(
        lambda: Trial.from_frame(
            frame.assign(u=frame["u"].astype(object)), name="frame"
        )
    )
    found["indexed"] = asked(
        lambda: Trial.from_frame(
            frame.set_index("t"),
            {"t": "t", "u": {"column": "u", "unit": "kn"}},
            name="frame",
        )
    )
    found["place"] = asked(lambda: read_frame(frame, "sheet", 3).place(4))
    found["no frame"] = asked(lambda: read_frame([1.0]))
    found["empty frame"] = asked(lambda: read_frame(frame[:0]))
    found["numbers"] = asked(
        lambda: read_log(CORPUS / "log" / "bridge.mat").numbers("psi")
    )
    found["again"] = asked(
        lambda: read_log(read_log(CORPUS / "log" / "bridge.csv")).numbers("psi [deg]")
    )
    for name in ("own", "semicolons"):
        found[name] = asked(
            lambda name=name: Trial.from_csv(CORPUS / "trial" / f"{name}.csv")
        )
    Path("seven.mat").write_bytes(b"MATLAB 7.3 MAT-file" + bytes(200))
    found["seven"] = asked(lambda: read_log("seven.mat"))
    Path("empty.mat").write_bytes(b" " * 124 + b"\0\1IM")
    found["empty"] = asked(lambda: read_log("empty.mat"))
    found["missing"] = asked(lambda: read_log("none.xlsx"))
    texts = LogTable(
        Path("cells"),
        {"a": np.array(["1,5", " NA ", "", "2.25", "n/a"], dtype=object)},
        range(5),
        decimal_comma=True,
    )
    found["cells"] = [
        asked(lambda: texts.numbers("a")),
        asked(lambda: texts.texts("a")),
        asked(lambda: replace(texts, decimal_comma=False).numbers("a")),
    ]
    return found


def instruments() -> Answers:
    """What sensors of all errors show of a trial."""
    s = sailed()
    names = ("x", "y", "psi", "u", "v", "r", "delta", "n")
    more = {
        "delta_command": np.where(s["t"] % 40.0 < 13.0, 0.2, -0.1),
        "psi_wave": 0.02 * np.sin(s["t"]),
        "wind_speed": 0.0 * s["t"] + 7.0,
    }
    trial = Trial(
        s["t"],
        {name: s[name] for name in names} | more,
        name="sea trial",
        kind="zigzag",
        length=150.0,
    )
    errors = {
        "u": sensors.Sensor(0.1, 0.05, 0.2, 40.0, 0.1, 3.0, 1.3),
        "r": sensors.Sensor(outlier_probability=0.3, outlier_size=0.1),
        "psi": sensors.Sensor(drift=0.05, drift_time_s=70.0),
        "delta": sensors.Sensor(resolution=0.07),
        "n": sensors.Sensor(latency_s=6.5),
    }

    def made(**given: float) -> Any:
        return sensors.Sensors(**given)  # type: ignore[arg-type]

    return {
        "sea trial": lambda: made().measure(trial, 3),
        "errors": lambda: made(by_channel=errors).measure(trial),
        "sampled": (
            lambda: made(
                sampling_s=1.3, dropout_probability=0.1, dropout_samples=2.5
            ).measure(trial, 5)
        ),
        "sampling": refused(
            lambda one: made(sampling_s=one).measure(trial),
            (100.0, 119.0, 120.0, 121.0, 140.0, 0.0),
        ),
        "gaps": (
            lambda: made(
                sampling_s=70.0, dropout_probability=0.9, dropout_samples=9.0
            ).measure(trial)
        ),
        "sensor": [
            lambda one=one: sensors.Sensor(**one)
            for one in (
                {"noise": -0.1},
                {"drift_time_s": 0.0},
                {"outlier_probability": 1.1},
                {"latency_s": float("inf")},
            )
        ],
        "sensors": [
            lambda one=one: made(**one)
            for one in (
                {"dropout_probability": 1.0},
                {"dropout_samples": 0.9},
                {"by_channel": {"u": 3.0}},
                {"by_channel": {"speed": sensors.GNSS}},
            )
        ],
        "seed": lambda: made().measure(trial, -1),
        "process": lambda: sensors.gauss_markov(
            np.array([0.0, 1.0, 4.0, 4.5]), 3.0, np.random.default_rng(0)
        ),
        "orders": lambda: sensors.orders_at(
            np.array([0.2, 1.0, 2.9]),
            np.array([0.0, 1.0, 2.0]),
            np.array([5.0, 7.0, 11.0]),
        ),
    }


def guessed() -> Answers:
    """Columns of logs by name and size."""
    s = sailed()
    content = {
        "Zeit": s["t"] + 1.6e9,
        "Heading (deg)": s["psi"] / DEGREE % 360.0,
        "Gyro 2": s["psi"] / DEGREE,
        "ROT": s["r"] / DEGREE * 60.0,
        "Speed_kn": s["u"] / KNOT,
        "SOG [knots]": s["u"] / KNOT,
        "COG": s["psi"] / DEGREE % 360.0,
        "Rudder Order": s["delta"] / DEGREE,
        "Rudder angle [°]": s["delta"] / DEGREE,
        "Shaft RPM": 60.0 * s["n"],
        "rpm": 60.0 * s["n"],
        "Wind speed [m/s]": 7.0 + 0.0 * s["t"],
        "Wind dir": 40.0 + 0.0 * s["t"],
        "lat": ["57°41.2'N"] * s["t"].size,
        "Roll": s["phi"],
    }
    csv("bridge.csv", content, digits=14)
    simple = {
        "time": s["t"],
        "heading": s["psi"] % 6.28,
        "u": s["u"],
        "v": s["v"],
        "yaw rate": s["r"],
        "rudder": -s["delta"] / DEGREE,
        "x": s["x"],
        "y": s["y"],
    }
    csv("simple.csv", simple, digits=14)
    csv("nothing.csv", {"a": s["t"], "b": s["t"]})

    def sizes(name: str, limit: float) -> list[str]:
        made = LogTable(Path("t"), {name: np.zeros(3)}, range(3))
        return [
            guess_columns(replace(made, cells={name: np.full(3, -size)}))[0].unit
            for size in (0.93 * limit, limit, 1.04 * limit)
        ]

    def read(path: str | Path) -> tuple[Any, ...]:
        found = guess_trial(path)
        return (
            found.columns,
            next(
                (
                    one.value
                    for one in found.conventions
                    if one.name == "rudder_positive"
                ),
                "starboard",
            ),
            found.trial,
        )

    limits = {
        "t": 1e8,
        "psi": 6.3,
        "r": 0.2,
        "n": 10.0,
        "delta": 1.0,
        "delta_command": 1.0,
        "phi": 1.0,
    }
    return {
        "columns": lambda: guess_columns(read_csv("bridge.csv")),
        "quoted": [one.quoted for one in guess_columns(read_csv("bridge.csv"))],
        "trial": lambda: read("simple.csv"),
        "corpus": lambda: read(CORPUS / "log" / "bridge.csv"),
        "nmea": lambda: read(CORPUS / "log" / "bridge.nmea")[:2],
        "nothing": lambda: read("nothing.csv"),
        "sizes": {name: sizes(name, limit) for name, limit in limits.items()},
    }


def _as_written(columns: Any) -> dict[str, Any]:
    return {
        channel: {"column": one.name, "unit": one.unit} if one.unit else one.name
        for channel, one in columns.items()
    }


def parts() -> Answers:
    """Stretches of a log, by seconds, clock and rudder."""
    t = np.arange(0.0, 900.0, 0.5)

    def cut(given: Any, start: float | None = None, delta: Floats | None = None) -> Any:
        cuts.check_cut(given, "[[trials]] 1")
        log = Log(
            t, {} if delta is None else {"delta": delta}, "log.csv", [], start=start
        )
        return [
            [one.start, one.stop] for one in cuts.cut_log(given, log, "[[trials]] 1")
        ]

    def helm(*active: tuple[float, float], size: float = 3.2) -> Floats:
        return 0.02 + DEGREE * size * np.any(
            [(t >= a) & (t < b) for a, b in active], axis=0
        )

    morning = 1_717_147_800.0
    return {
        "whole": lambda: [[0, t.size]],
        "seconds": lambda: cut([[60, 120.25], [300.5, 899]]),
        "clock": lambda: cut(
            [["09:31:00", "09:40:30"], ["2024-05-31T09:32:00Z", 200]], morning
        ),
        "of the day": lambda: cut(
            [["23:59:00", "00:03:00"], ["23:40", "00:02"]], 86_340.0 - 60.0
        ),
        "rudder": lambda: cut(
            "rudder",
            delta=helm(
                (100.0, 150.0),
                (170.0, 215.0),
                (300.0, 340.0),
                (500.0, 520.0),
                (700.0, 731.0),
            ),
        ),
        "size": refused(
            lambda one: cut("rudder", delta=helm((100.0, 150.0), size=one)),
            (2.7, 2.95, 3.05, 3.3),
        ),
        "length": refused(
            lambda one: cut("rudder", delta=helm((100.0, 100.0 + one))),
            (28.0, 30.0, 31.0, 34.0),
        ),
        "quiet": [
            lambda one=one: cut(
                "rudder", delta=helm((100.0, 150.0), (150.0 + one, 300.0))
            )
            for one in (55.0, 59.0, 60.0, 61.0, 66.0)
        ],
        "edges": lambda: cut("rudder", delta=helm((0.0, 50.0), (860.0, 900.0))),
        "wrong": {
            str(one): lambda one=one: cut(one)
            for one in (
                "helm",
                [],
                [[1]],
                [[1, None]],
                [[10, 9]],
                [["a", "b"]],
                [["09:30:00", 90]],
                3,
            )
        },
        "late": lambda: cut([["12:00:00", "12:10:00"]], morning),
    }


SHIP = """[ship]
name = "Model"
length = 151.0
beam = 24.5
draught = 8.1
mass = 1.7e7
xg = -1.25
speed = 6.9
propeller_diameter = 5.1
[ship.added_mass]
Y_vdot = -0.0091
[steering]
rudder_limit_deg = 33.0
rudder_rate_deg_s = 3.1
[columns]
psi = { column = "psi", unit = "rad" }
u = "u"
v = "v"
r = "r"
delta = "delta"
[conventions]
rudder_positive = "starboard"
[sensors]
rudder_offset_deg = 0.5
[identify]
method = "ls"
C = 7.0
[wind]
speed = 3.0
[[trials]]
file = "a.csv"
kind = "zigzag"
cut = [[20, 90], [100, 200.5]]
[[trials]]
file = "b.csv"
use = "validate"
rudder_positive = "port"
origin = "cg"
columns = { x = "x", y = "y" }
sensors = { heading_offset_deg = 2.0 }
[[trials]]
file = "c.csv"
use = "skip"
"""


def ship_files() -> Answers:
    """A ship file, its trials, and it with one thing wrong."""
    csv("a.csv", own_names())
    csv("b.csv", own_names(delta=-sailed()["delta"]))
    Path("ship.toml").write_text(SHIP)
    ship = ShipFile.load("ship.toml")
    wrong = {
        "[ship]": "[vessel]",
        "length = 151.0": "breadth = 1.0",
        "[steering]": "[rudder]",
        "mass = 1.7e7": "mass = 1.7e4",
        "speed = 6.9": "estimated = []",
        "draught = 8.1": "draught = 80.0",
        "rudder_limit_deg = 33.0": "rudder_limit_deg = 93.0",
        'unit = "rad"': 'unit = "m"',
        'u = "u"': 'speed = "u"',
        'rudder_positive = "starboard"': 'rudder_positive = "left"',
        "rudder_offset_deg = 0.5": "rudder = 1.0",
        'file = "a.csv"': 'file = "d.csv"',
        'kind = "zigzag"': 'kind = "zag"',
        "cut = [[20, 90], [100, 200.5]]": 'cut = "helm"',
        'use = "validate"': 'use = "test"',
        'file = "b.csv"': 'name = "b.csv"',
        'origin = "cg"': 'origin = "bow"',
        'file = "c.csv"\n': 'file = "b.csv"\ncolumns = 3\n',
        "Y_vdot = -0.0091": "Y_vdot = 0.0091",
        "heading_offset_deg = 2.0": "heading_offset_deg = 200.0",
        "columns = { x": "columns = { q",
        "propeller_diameter = 5.1": "Y_vdot = -0.01",
    }
    found: Answers = {}
    for old, new in wrong.items():
        Path("wrong.toml").write_text(SHIP.replace(old, new, 1))
        found[new.strip()] = asked(lambda: ShipFile.load("wrong.toml").trials("fit"))
    for name, text in {
        "no trials": SHIP.partition("[[trials]]")[0],
        "one trial": SHIP.partition("[[trials]]")[0] + 'trials = "a.csv"',
        "skipped": (
            SHIP.partition("[[trials]]")[0]
            + '[[trials]]\nfile = "c.csv"\nuse = "skip"\n'
        ),
        "of two": SHIP.replace('"b.csv"', '["a.csv", "b.csv"]', 1),
        "twice": SHIP.replace('"b.csv"', '"./b.csv"').replace('"c.csv"', '"b.csv"'),
        "fast": (
            SHIP.replace("length = 151.0", "length = 1900.0").replace(
                "mass = 1.7e7", "mass = 2e8"
            )
        ),
    }.items():
        Path("wrong.toml").write_text(text)
        found[name] = asked(lambda: ShipFile.load("wrong.toml").trials())
    return {
        "particulars": asked(ship.completed_particulars),
        "steering": lambda: ship.steering,
        "identify": lambda: ship.identify,
        "trials": asked(ship.trials),
        "fit": lambda: [one.name for one in ship.trials("fit")],
        "one": lambda: ship.trial("b.csv"),
        "use": lambda: ship.trials("test"),
        "trial": lambda: ship.trial("d.csv"),
        "entries": lambda: [
            [e.file, e.cut, e.kind, e.use, _as_written(e.columns), e.where]
            for e in ship.entries
        ],
        "wrong": found,
        "corpus": (
            lambda: ShipFile.load(
                CORPUS / "ship-file" / "mariner" / "ship.toml"
            ).structure.to_dict()
        ),
    }


def trials() -> Answers:
    """Trials made of arrays, their copies and parts."""
    t = np.array([0.0, 0.5, 1.7, 2.0])
    one = Trial(
        t,
        {"u": [6.0, 6.1, 6.2, 6.4], "r": [0.01, 0.02, 0.0, -0.01]},
        name="one",
        kind="zigzag",
        derived=["u"],
        repaired={"u": 2},
        notes=["told"],
        length=7.0,
    )
    other = one.with_channels(
        {"u": [5.0, 5.1, 5.2, 5.3], "psi": [0.0, 0.1, 0.2, 0.1]},
        repaired={"u": 3, "psi": 1},
    )
    wrong: dict[str, Callable[[], Any]] = {
        "short": lambda: Trial([0.0, 1.0], {"u": [1.0, 1.0]}),
        "back": lambda: Trial([0.0, 2.0, 1.0], {"u": [1.0, 1.0, 1.0]}),
        "none": lambda: Trial(t, {}),
        "length": lambda: Trial(t, {"u": [1.0]}),
        "channel": lambda: Trial(t, {"speed": t}),
        "nan": lambda: Trial(t, {"u": t * np.nan}),
        "shape": lambda: Trial(t[:, None], {"u": t}),
        "kind": lambda: Trial(t, {"u": t}, kind="zag"),
        "use": lambda: Trial(t, {"u": t}, use="test"),
        "derived": lambda: Trial(t, {"u": t}, derived=["v"]),
        "lat": lambda: Trial(t, {"lat": t}),
        "size": lambda: Trial(t, {"u": t}, length=0.0),
        "name": lambda: Trial(t, {"u": t}, name=" "),
        "get": lambda: one["v"],
        "with": lambda: one.with_(t=3),
        "csv": lambda: one.to_csv("no/such/folder.csv"),
    }
    one.to_csv("one.csv")
    return {
        "one": lambda: one,
        "other": lambda: other,
        "raw": lambda: other.raw,
        "raws": other.with_channels({"u": t}).raw is one,
        "part": lambda: one.part(slice(0, 3)),
        "named": lambda: one.part(slice(1, 4), "part"),
        "changed": lambda: one.with_(
            name="two", use="skip", over_ground=False, length=None
        ),
        "facts": [one.duration, len(one), "t" in one, "v" in one, repr(one)],
        "text": Path("one.csv").read_text(),
        "times": lambda: one.with_channels({"u": t[:3], "r": t[:3]}, t=t[:3]),
        "over ground": [
            Trial(t, {"u": t}, derived=d, over_ground=o).over_ground
            for d in ((), ("u",))
            for o in (None, False, True)
        ],
        "wrong": {name: asked(question) for name, question in wrong.items()},
        "hashes": [
            one.sha256 == other.sha256,
            one.sha256 == one.with_(name="x").sha256,
        ],
    }


def scales() -> Answers:
    """From where on a trial is another ship's, and names of units and options that are none."""
    t = np.arange(0.0, 100.0)
    full = Trial(
        t,
        {
            "u": 0.0 * t + 6.0,
            "v": 0.0 * t + 0.5,
            "r": 0.01 + 0.0 * t,
            "n": 2.0 + 0.0 * t,
        },
    )

    def sized(trial: Trial = full, **ship: Any) -> None:
        check_scale(trial, Particulars(**({"length": 150.0} | ship)), "ship.toml")

    def turning(r: float) -> None:
        sized(Trial(t, {"u": full["u"], "r": np.where(t == 0.0, 9.0 * r, r)}))

    words = ("m", "deg", "kn", "knot", "rpm", "parsec", "rad/s")
    return {
        "slender": refused(lambda b: sized(beam=b), (90.0, 98.0, 101.0, 110.0)),
        "turn": refused(turning, np.array(AROUND) * 3.0 * 6.0 / 150.0),
        "slow": refused(
            lambda s: sized(speed=s), (2.7, 2.95, 3.05, 3.3, 28.0, 29.9, 30.3, 33.0)
        ),
        "knots": lambda: sized(speed=11.7),
        "froude": refused(
            lambda s: sized(length=s, speed=11.7), (130.0, 153.0, 158.0, 170.0)
        ),
        "near": [lambda s=s: sized(speed=s) for s in (10.5, 10.7, 12.8, 13.2)],
        "tip": refused(lambda d: sized(propeller_diameter=d), (14.0, 15.7, 16.1, 18.0)),
        "words": [
            lambda: sized(speed=40.0),
            lambda: sized(propeller_diameter=30.0),
            lambda: turning(0.3),
            lambda: sized(beam=120.0),
        ],
        "few": lambda: sized(Trial(t, {"psi": t})),
        "units": {
            f"{name} {unit}": lambda n=name, u=unit: units.si_factor(n, u)
            for name in ("x", "r", "u", "n", "t")
            for unit in words
        },
        "channels": [
            lambda: units.check_channel("headin", "here"),
            lambda: units.check_channel("t", "here", time=False),
            units.si_unit("r"),
            lambda: units.LARGEST_MAGNITUDES,
        ],
    }


QUESTIONS = Questions(
    {
        "log": log_csv,
        "refusals": refusals,
        "clocks": clocks,
        "derivatives": derivatives,
        "nmea": nmea_logs,
        "kinds of files": kinds_of_files,
        "instruments": instruments,
        "guessed": guessed,
        "parts": parts,
        "ship files": ship_files,
        "trials": trials,
        "scales": scales,
    }
)
