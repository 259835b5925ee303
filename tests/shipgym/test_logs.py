"""Logs as bridges make them become trials in SI units; faults are named."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from shipgym.errors import InputError
from shipgym.trials.navigation import local_metres
from shipgym.trials.ship_file import ShipFile
from shipgym.trials.trial import Trial

DATA = Path(__file__).parents[2].parent / "shared" / "data"
KNOT, DEGREE = 1852.0 / 3600.0, math.pi / 180.0
FORWARD, STARBOARD = 25.0, 3.0
LAT, LON = 57.687, 11.74


def sail(n=1201, step=0.5, current=(0.3, -0.4)):
    """A ship of 150 m, T rdot + r = K delta, that turns to and fro in a current."""
    t = step * np.arange(n)
    psi, r, acceleration = np.full(n, 0.5), np.zeros(n), np.zeros(n)
    for frequency, size in ((0.07, 0.2), (0.023, 0.6)):
        psi += size * np.sin(frequency * t)
        r += size * frequency * np.cos(frequency * t)
        acceleration -= size * frequency**2 * np.sin(frequency * t)
    delta = (12.0 * acceleration + r) / 0.08
    u, v = np.full(n, 7.0) - 400.0 * r**2, -45.0 * r
    velocity = (u + 1j * v) * np.exp(1j * psi) + complex(*current)
    position = cumulative_trapezoid(velocity, t, initial=0.0)
    return {
        "t": t,
        "delta": delta,
        "r": r,
        "psi": psi,
        "u": u,
        "v": v,
        "x": position.real,
        "y": position.imag,
        "north": velocity.real,
        "east": velocity.imag,
    }


def at_antenna(s):
    """Latitude, longitude, SOG and COG of an antenna forward of midship."""
    c, sn = np.cos(s["psi"]), np.sin(s["psi"])
    x = s["x"] + c * FORWARD - sn * STARBOARD
    y = s["y"] + sn * FORWARD + c * STARBOARD
    north = s["north"] - s["r"] * (sn * FORWARD + c * STARBOARD)
    east = s["east"] + s["r"] * (c * FORWARD - sn * STARBOARD)
    per = local_metres(np.array([LAT + 1e-3]), np.array([LON + 1e-3]), (LAT, LON))
    return {
        "lat": LAT + 1e-3 * x / per[0][0],
        "lon": LON + 1e-3 * y / per[1][0],
        "sog": np.hypot(north, east),
        "cog": np.arctan2(east, north) % (2 * np.pi),
    }


SAILED = sail()
GNSS = at_antenna(SAILED)
COLUMNS = {
    "t": "Zeit",
    "lat": "Breite",
    "lon": "Länge",
    "sog": {"column": "SOG [kn]", "unit": "knots"},
    "cog": {"column": "COG [°]", "unit": "deg"},
    "psi": {"column": "Gyro [°]", "unit": "deg"},
    "delta": {"column": "Ruder [°]", "unit": "deg"},
}


def bridge_log(path):
    """ISO time, decimal comma, Latin-1.

    GNSS at 1 Hz, gyro and rudder (to port, half degrees) at 2 Hz.
    """
    lines = ["Zeit;Breite;Länge;SOG [kn];COG [°];Gyro [°];Ruder [°]"]
    for k, t in enumerate(SAILED["t"]):
        here = ["", "", "", ""]
        if k % 2 == 0:
            minutes = ((abs(GNSS["lat"][k]) % 1) * 60, (abs(GNSS["lon"][k]) % 1) * 60)
            here = [
                f"57°{minutes[0]:.4f}'N",
                f"011°{minutes[1]:.4f}'E",
                f"{GNSS['sog'][k] / KNOT:.2f}",
            ]
            here.append(f"{GNSS['cog'][k] / DEGREE:.1f}")
        ship = [
            f"{SAILED['psi'][k] / DEGREE % 360:.1f}",
            f"{-round(SAILED['delta'][k] / DEGREE * 2) / 2:.1f}",
        ]
        clock = f"2024-05-31T09:{30 + int(t) // 60:02d}:{t % 60:04.1f}+02:00"
        lines.append(";".join([clock, *here, *ship]).replace(".", ","))
    path.write_bytes(("\n".join(lines) + "\n").encode("latin-1"))
    return path


ANTENNA = {"gnss_antenna": {"forward": FORWARD, "starboard": STARBOARD}}


def error(trial, name):
    return float(
        np.sqrt(
            np.mean((trial[name] - np.interp(trial.t, SAILED["t"], SAILED[name])) ** 2)
        )
    )


def test_a_bridge_log_becomes_a_trial_at_midship_on_one_clock(tmp_path):
    path = bridge_log(tmp_path / "bridge.csv")
    trial = Trial.from_csv(path, COLUMNS, "port", sensors=ANTENNA)
    assert np.diff(trial.t) == pytest.approx(1.0)
    assert trial.over_ground
    assert error(trial, "psi") < 0.05 * DEGREE
    assert error(trial, "delta") < 0.3 * DEGREE
    c, s = np.cos(trial["psi"]), np.sin(trial["psi"])
    truth = {
        name: np.interp(trial.t, SAILED["t"], SAILED[name])
        for name in ("u", "v", "x", "y")
    }
    assert np.std(trial["u"] - truth["u"] - (0.3 * c - 0.4 * s)) < 0.03
    assert np.std(trial["v"] - truth["v"] - (-0.3 * s - 0.4 * c)) < 0.03
    for name in ("x", "y"):
        assert (
            np.ptp(trial[name] - truth[name]) < 1.5
        )  # by rounding and the tangent plane
    shifted = Trial.from_csv(path, COLUMNS, "port")
    assert np.std(shifted["v"] - truth["v"] - (-0.3 * s - 0.4 * c)) > 0.2


# --- kinds of files


def frame():
    pandas = pytest.importorskip("pandas")
    times = pandas.Timestamp("2024-05-31 09:30") + pandas.to_timedelta(
        SAILED["t"][::2], unit="s"
    )
    return pandas.DataFrame(
        {
            "time": times,
            **{name: SAILED[name][::2] for name in ("psi", "u", "v", "delta")},
        }
    )


def test_every_kind_of_table_gives_the_same_trial(tmp_path):
    from scipy.io import savemat

    table = frame()
    columns = {"t": "time"} | {name: name for name in ("psi", "u", "v", "delta")}
    expected = Trial.from_frame(table, columns)
    table.to_excel(tmp_path / "log.xlsx", index=False)
    table.to_parquet(tmp_path / "log.parquet")
    table.to_csv(tmp_path / "log.csv", index=False)
    savemat(
        tmp_path / "log.mat",
        {"time": SAILED["t"][::2], "name": "x"}
        | {c: table[c].to_numpy() for c in table if c != "time"},
    )
    for ending in ("xlsx", "parquet", "csv", "mat"):
        trial = Trial.from_csv(tmp_path / f"log.{ending}", columns)
        for name in ("t", "psi", "u", "v", "r", "delta"):
            np.testing.assert_allclose(
                trial[name], expected[name], atol=1e-6, err_msg=ending
            )
    unix = table.assign(time=1.7e9 + SAILED["t"][::2])
    trial = Trial.from_frame(unix, columns | {"t": {"column": "time", "unit": "unix"}})
    np.testing.assert_allclose(trial.t, expected.t, atol=1e-6)
    with pytest.raises(
        InputError, match="frame: expected a pandas DataFrame, got a list"
    ):
        Trial.from_frame([1, 2])


@pytest.mark.skipif(
    not DATA.is_dir(), reason="the real log lies beside the checkout and is absent here"
)
def test_the_real_log_is_read_and_says_that_it_has_no_rudder():
    trial = Trial.from_csv(DATA / "nmea0183" / "hakefjord.txt")
    assert 1300 < trial.duration < 1320
    assert any(
        note.startswith("no rudder angle in this log: without rudder nothing")
        for note in trial.notes
    )
    assert any("set and drift" in note for note in trial.notes)


# --- ship files


SHIP = """
[ship]
length = 150.0
beam = 22.0
speed = 7.0

[columns]
t = "t"
psi = "psi"
delta = "delta"
r = "r"
u = "u"
v = "v"
"""


def ship_file(tmp_path, text):
    (tmp_path / "ship.toml").write_text(text)
    return ShipFile.load(tmp_path / "ship.toml")


def test_files_of_one_log_are_joined_and_another_time_zone_is_named(tmp_path):
    table = frame()
    table[["time", "psi", "u", "v"]].to_csv(tmp_path / "gyro.csv", index=False)
    table[["time", "delta"]].to_csv(tmp_path / "rudder.csv", index=False)
    columns = SHIP.replace('t = "t"', 't = "time"').replace('r = "r"\n', "")
    files = '[[trials]]\nfile = ["gyro.csv", "rudder.csv"]\n'
    (trial,) = ship_file(tmp_path, columns + files).trials()
    assert error(trial, "delta") < 1e-6
    table.assign(time=table["time"] + np.timedelta64(2, "h"))[["time", "delta"]].to_csv(
        tmp_path / "rudder.csv", index=False
    )
    with pytest.raises(InputError, match="begins 7200 s after it and does not overlap"):
        ship_file(tmp_path, columns + files).trials()
