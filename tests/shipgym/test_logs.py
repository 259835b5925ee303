"""Logs as bridges make them become trials in SI units; faults are named."""

import math
from pathlib import Path

import numpy as np
import pytest

from shipgym.errors import InputError
from shipgym.trials.navigation import local_metres
from shipgym.trials.ship_file import ShipFile
from shipgym.trials.trial import Trial

DATA = Path(__file__).parents[2].parent / "shared" / "data"
KNOT, DEGREE = 1852.0 / 3600.0, math.pi / 180.0
FORWARD, STARBOARD = 25.0, 3.0
LAT, LON = 57.687, 11.74


def sail(n=1201, step=0.5, current=(0.3, -0.4)):
    """A ship of 150 m in zigzags on two courses with straight parts, in a current."""
    t = step * np.arange(n)
    order = (
        15
        * DEGREE
        * np.sign(np.sin(2 * np.pi * t / 90.0))
        * (((t > 60) & (t < 240)) | ((t > 400) & (t < 560)))
    )
    order += 14 * DEGREE * ((t > 260) & (t < 330))
    delta, r, psi = np.zeros(n), np.zeros(n), np.full(n, 0.5)
    for k in range(1, n):
        delta[k] = delta[k - 1] + np.clip(
            order[k] - delta[k - 1], -2.5 * DEGREE * step, 2.5 * DEGREE * step
        )
        r[k] = r[k - 1] + step * (0.08 * delta[k - 1] - r[k - 1]) / 12.0
        psi[k] = psi[k - 1] + step * 0.5 * (r[k] + r[k - 1])
    u, v = np.full(n, 7.0) - 400.0 * r**2, -45.0 * r
    north = u * np.cos(psi) - v * np.sin(psi) + current[0]
    east = u * np.sin(psi) + v * np.cos(psi) + current[1]
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
        "north": north,
        "east": east,
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


def bridge_log(path, keep=lambda row: row, gyro=1.0):
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
            f"{gyro * SAILED['psi'][k] / DEGREE % 360:.1f}",
            f"{-round(SAILED['delta'][k] / DEGREE * 2) / 2:.1f}",
        ]
        row = keep(
            [
                f"2024-05-31T09:{30 + int(t) // 60:02d}:{t % 60:04.1f}+02:00",
                *here,
                *ship,
            ]
        )
        lines.append(";".join(row).replace(".", ","))
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


# --- NMEA 0183


def sentence(text):
    from functools import reduce

    return f"${text}*{reduce(lambda a, b: a ^ b, map(ord, text)):02X}"


def nmea_log(path, rudder=True, end=600):
    lines = ["!AIVDM,1,1,,B,13u=gHP3CWPlvs2Q8sHW:5fD0h6a,0*1B"]
    for k in range(0, 2 * end, 2):
        clock = f"09{30 + k // 120:02d}{k // 2 % 60:02d}"
        lat, lon = ((abs(GNSS[name][k]) % 1) * 60 for name in ("lat", "lon"))
        place = f"57{lat:07.4f},N,011{lon:07.4f},E"
        knots = GNSS["sog"][k] / KNOT
        course = GNSS["cog"][k] / DEGREE
        lines.append(f"GPRMC,{clock}.00,A,{place},{knots:.2f},{course:.1f},310524,,,A")
        lines.append(f"IIGGA,{clock}.00,{place},1,08,1.0,20.0,M,,M,,")
        for j in (k, k + 1):
            heading = SAILED["psi"][j] / DEGREE % 360
            lines += [
                f"HETHS,{heading:.2f},A",
                f"HCHDG,{(heading - 5) % 360:.1f},0.0,E,3.0,E",
            ]
            lines.append(f"TIROT,{SAILED['r'][j] / DEGREE * 60:.2f},A")
            lines += [f"RIRSA,{SAILED['delta'][j] / DEGREE:.1f},A,,"] if rudder else []
        lines += [
            "ERRPM,S,1,90.0,100.0,A",
            "WIMWV,030.0,R,10.0,M,A",
            "VWVHW,,T,,M,13.6,N,,K",
        ]
    path.write_text(
        "\r\n".join(line if line[0] == "!" else sentence(line) for line in lines)
        + "\r\n"
    )
    return path


def test_an_nmea_log_becomes_a_trial(tmp_path):
    """The gyro's heading, not the compass's; log speed as u; sway without current."""
    trial = Trial.from_csv(nmea_log(tmp_path / "log.nmea"), sensors=ANTENNA)
    assert error(trial, "psi") < 0.5 * DEGREE
    assert error(trial, "delta") < 1.0 * DEGREE
    assert trial["n"] == pytest.approx(1.5)
    assert trial["u"] == pytest.approx(13.6 * KNOT)
    assert not trial.over_ground
    assert error(trial, "v") < 0.1
    assert (
        "psi is from HETHS (1200 values); HCHDG (1200 values) left out" in trial.notes
    )
    assert any(
        "set and drift" in note and "toward 3" in note for note in trial.notes
    ), trial.notes
    expected = (
        10.0 * np.exp(1j * (SAILED["psi"][0] + 30 * DEGREE))
        - (SAILED["north"] + 1j * SAILED["east"])[0]
    )
    assert trial["wind_speed"][0] == pytest.approx(abs(expected), abs=0.1)
    assert trial["wind_from"][0] == pytest.approx(np.angle(expected), abs=0.02)


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


# --- clocks


def written(path, **changed):
    """A CSV in SI units of the ship's own record, some channels changed."""
    names = ("t", "psi", "r", "delta", "u", "v")
    columns = [np.asarray(changed.get(name, SAILED[name])) for name in names]
    rows = (
        ",".join(f"{value:.7g}" for value in row) for row in zip(*columns, strict=True)
    )
    path.write_text("\n".join([",".join(names), *rows]) + "\n")
    return path


def late(name, seconds):
    return np.interp(SAILED["t"] - seconds, SAILED["t"], SAILED[name])


def test_a_late_rudder_is_named_and_put_right_where_that_is_asked_for(tmp_path):
    name, seconds, within = "delta", 3.0, 0.6
    path = written(tmp_path / "run.csv", **{name: late(name, seconds)})
    with pytest.raises(
        InputError, match=r'is [0-9.]+ s late against .* clock_offsets = "correct"'
    ):
        Trial.from_csv(path)
    kept = Trial.from_csv(path, sensors={"clock_offsets": "keep"})
    assert [note for note in kept.notes if note.endswith("left as logged")]
    trial = Trial.from_csv(path, sensors={"clock_offsets": "correct"})
    (note,) = (note for note in trial.notes if note.endswith("corrected"))
    assert float(note.split(" is ")[1].split()[0]) == pytest.approx(seconds, abs=within)
    assert error(trial, name) < 0.3 * error(kept, name)
    assert not Trial.from_csv(written(tmp_path / "fine.csv")).notes


def test_a_yaw_rate_or_heading_of_the_wrong_sign_is_not_taken_for_the_rudders(tmp_path):
    for changed in ({"r": -SAILED["r"]}, {"psi": -SAILED["psi"]}):
        path = written(tmp_path / "run.csv", **changed)
        with pytest.raises(
            InputError,
            match=r"\(heading\) and 'r' \(yaw rate\) to be positive .* opposite signs",
        ):
            Trial.from_csv(path)


@pytest.mark.parametrize("shown", [("psi", "r", "delta"), ("psi", "u", "v", "x", "y")])
def test_time_in_milliseconds_or_minutes_is_named_and_no_other_unit(tmp_path, shown):
    for unit, scale in (("ms", 1e3), ("min", 1.0 / 60.0)):
        columns = {"t": scale * SAILED["t"], **{name: SAILED[name] for name in shown}}
        rows = (
            ",".join(f"{value:.9g}" for value in row)
            for row in zip(*columns.values(), strict=True)
        )
        (tmp_path / "run.csv").write_text("\n".join([",".join(columns), *rows]))
        with pytest.raises(
            InputError,
            match=(
                r'wrong unit(:| of time,) declare t = { column = "t", unit ='
                rf' "{unit}" }}'
            ),
        ):
            Trial.from_csv(tmp_path / "run.csv")


# --- mistakes


def test_a_circle_away_from_the_rudder_is_named(tmp_path):
    """In a turning circle only its side tells the sign of the rudder."""
    t = np.arange(0.0, 400.0, 1.0)
    circle = {
        "psi": 0.01 * t,
        "delta": np.full(t.size, -0.5),
        "u": np.full(t.size, 5.0),
        "v": 0.0 * t,
    }
    Trial(t, circle).to_csv(path := tmp_path / "circle.csv")
    with pytest.raises(
        InputError,
        match=r'with the rudder to one side.*write rudder_positive = "port" in',
    ):
        Trial.from_csv(path)
    assert Trial.from_csv(path, rudder_positive="port")["delta"][0] == 0.5


def changed(column, value):
    def keep(row):
        return [
            value(cell) if k == column and cell else cell for k, cell in enumerate(row)
        ]

    return keep


def refusal(path, columns=COLUMNS, **settings):
    with pytest.raises(InputError) as caught:
        Trial.from_csv(path, columns, "port", **settings)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_no_time_that_can_be_read_is_named_by_its_line(tmp_path):
    path = bridge_log(
        tmp_path / "log.csv",
        changed(0, lambda cell: "noon" if "30:02" in cell else cell),
    )
    message = refusal(path)
    assert "line 6 (data row 5), column 'Zeit': expected a number, ISO 8601" in message
    assert message.endswith("got 'noon'")


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


def test_a_log_is_cut_into_trials_by_rudder_by_seconds_and_by_the_clock(tmp_path):
    written(tmp_path / "run.csv")
    by_rudder = ship_file(
        tmp_path, SHIP + '[[trials]]\nfile = "run.csv"\ncut = "rudder"\n'
    ).trials()
    assert [round(trial.t[0], -1) for trial in by_rudder] == [30.0, 370.0]
    assert by_rudder[0].name == "run.csv 32-364 s"
    marks = '[[trials]]\nfile = "run.csv"\ncut = [[0, 250], [390, 600]]\n'
    assert [trial.t[-1] for trial in ship_file(tmp_path, SHIP + marks).trials()] == [
        250.0,
        600.0,
    ]
    table = frame()
    table.to_csv(tmp_path / "clock.csv", index=False)
    clock = SHIP.replace('t = "t"', 't = { column = "time", zone = "+02:00" }').replace(
        'r = "r"\n', ""
    )
    marks = '[[trials]]\nfile = "clock.csv"\ncut = [["09:31", "2024-05-31 09:34:00"]]\n'
    (trial,) = ship_file(tmp_path, clock + marks).trials()
    assert trial.t[[0, -1]] == pytest.approx([60.0, 240.0])
    with pytest.raises(
        InputError,
        match="2024-05-31 09:30:00 to 2024-05-31 09:40:00, got 11:00 to 11:10",
    ):
        ship_file(
            tmp_path,
            clock + '[[trials]]\nfile = "clock.csv"\ncut = [["11:00", "11:10"]]',
        ).trials()


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
    with pytest.raises(
        InputError,
        match=r'another time zone: write t = \{ column = "time", zone = "\+02:00" \}',
    ):
        ship_file(tmp_path, columns + files).trials()


def test_an_antenna_outside_the_ship_is_refused(tmp_path):
    text = (
        SHIP + "[sensors]\ngnss_antenna = { forward = 125.0 }\n[[trials]]\nfile ="
        ' "run.csv"\n'
    )
    with pytest.raises(
        InputError,
        match=(
            r"\[sensors\] gnss_antenna.forward: expected at most 90 m .*, got 125 m"
        ),
    ):
        ship_file(tmp_path, text)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "speed = 7.0",
            "speed = 13.6",
            "got 13.6, which in knots is 6.99. m/s.*write speed = 6.99",
        ),
        ("length = 150.0", "length = 28.0", "got 28 m by 22 m.*an antenna's height"),
    ],
)
def test_knots_for_metres_per_second_and_a_height_for_the_length_are_named(
    tmp_path, old, new, message
):
    written(tmp_path / "run.csv")
    with pytest.raises(InputError, match=message):
        ship_file(
            tmp_path, SHIP.replace(old, new) + '[[trials]]\nfile = "run.csv"\n'
        ).trials()
