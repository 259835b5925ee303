"""What a log says is checked, put right where that is asked for, or refused."""

import math
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from shipgym import InputError, ShipFile, Trial, example_ship
from tests.shipgym.one_zigzag import sailed

NAN, DEGREE = math.nan, math.pi / 180.0


def written(path, **columns):
    """A CSV file, missing values as empty cells."""
    rows = zip(*columns.values(), strict=True)
    cells = [
        ["" if math.isnan(one) else repr(float(one)) for one in row] for row in rows
    ]
    path.write_text("\n".join([",".join(columns), *map(",".join, cells)]) + "\n")
    return path


def refusal(path, **settings):
    with pytest.raises(InputError) as caught:
        Trial.from_csv(path, **settings)
    return str(caught.value)


T = np.arange(0.0, 200.0)
TURN = 0.02 * T
SWING = 0.5 * np.sin(0.05 * T)
RATE = np.gradient(SWING)
U, V = np.full(T.size, 5.0), np.zeros(T.size)
X, Y = 5.0 * np.sin(TURN) / 0.02, 5.0 * (1.0 - np.cos(TURN)) / 0.02
ROUND = 0.1 * np.clip(T - 100.0, 0.0, 60.0)  # after a dull stretch


def at(values, row, value):
    """Values with another one in a row."""
    return np.where(np.arange(values.size) == row, value, values)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"u": at(U, 3, -60.0)}, "line 5 (data row 4), column 'u': expected u of at"),
        (
            {"r": at(RATE, 3, 1.5)},
            "got 1.5 rad/s; likely a wrong unit",
        ),
        ({"psi": np.where(T > 99.0, 1.1, 0.0)}, "within 1 s; empty the wrong cells"),
        ({"psi": 57.3 * SWING}, 'declare psi = { column = "psi", unit = "deg" }'),
        ({"psi": SWING, "r": -RATE}, "got opposite signs; change the sign of the"),
        ({"psi": SWING, "r": RATE / 5.3}, "changes 5.3 times as fast as the yaw rate"),
        ({"psi": TURN, "x": X, "y": Y, "u": U / 0.514, "v": V}, 'unit = "knots" }'),
        (
            {"psi": TURN, "x": X, "y": Y, "stw": U / 0.514},
            "0.514 times as much over ground, which no current does; likely a wrong"
            ' unit, declare stw = { column = "stw", unit = "knots" }',
        ),
        ({"psi": TURN, "x": X, "y": Y, "u": 3.6 * U}, 'unit = "km/h" }'),
        (
            {"psi": TURN, "sog": U, "cog": TURN + 0.2 * SWING, "stw": 2.0 * U},
            '"knots" }',
        ),
        (
            {"psi": TURN, "x": X, "y": Y, "u": 5 * np.cos(TURN), "v": 5 * np.sin(TURN)},
            'got velocities in the earth frame; declare velocity_frame = "earth"',
        ),
        ({"psi": SWING, "lat": 57 + 1e-8 * T, "lon": 11 + V}, "she is at berth or at"),
        (
            {"psi": SWING, "lat": at(57 + 5e-5 * T, 9, 58.0), "lon": 11 + V},
            "line 11 (data row 10), column 'lat': expected a position that a ship",
        ),
        (
            {"psi": SWING, "lat": 57 + 0.01 * (T % 2), "lon": 11 + V},
            "expected the track of one ship, got a position that jumps",
        ),
        ({"psi": SWING, "sog": U, "cog": 1.2 + V}, "over ground by -40 deg; name the"),
        (
            {"psi": SWING, "sog": U, "cog": 2.0 * TURN},
            "course over ground, got another",
        ),
        ({"psi": TURN, "sog": U, "cog": TURN}, "less than 0.3 deg of difference in a"),
        ({"psi": TURN, "sog": U, "cog": 0.1 - TURN}, "it turns the other way; change"),
        ({"psi": TURN, "lat": U}, "columns: expected lat and lon, got lat alone"),
        ({"psi": SWING, "delta": np.where(T < 50, NAN, 0.0)}, "expected a number, got"),
        ({"ground": U}, "no column is named like a channel"),
        ({"psi": 2.0 * TURN, "delta": V - 0.5, "u": U}, "with the rudder to one side"),
        ({"psi": ROUND, "delta": -5.0 * np.gradient(ROUND)}, "rudder to one side"),
    ],
)
def test_what_no_ship_does_is_refused_with_a_remedy(tmp_path, columns, message):
    assert message in refusal(written(tmp_path / "run.csv", **{"t": T, **columns}))


def test_an_outlier_of_the_heading_or_position_is_filled_and_counted(tmp_path):
    columns = {"lat": at(57 + 5e-5 * T, 9, 58.0), "lon": 11 + V, "psi": at(V, 30, 1.0)}
    path = written(tmp_path / "run.csv", t=T, **columns)
    trial = Trial.from_csv(path, repair="interpolate")
    assert trial.repaired == {"x": 1, "y": 1, "psi": 1}
    np.testing.assert_allclose(np.diff(trial["x"]), 5.57, atol=0.01)


# --- conventions


def test_forces_and_motion_are_moved_from_the_centre_of_gravity_to_midship(tmp_path):
    """Of a body that turns about a point 2 m ahead of midship."""
    at_cg = {"x": 10.0, "y": 20.0, "psi": np.pi / 6, "v": 1.0, "r": 0.1, "u": 3.0}
    columns = {name: np.full(4, one) for name, one in at_cg.items()}
    columns["psi"] = columns["psi"] + 0.1 * np.arange(4.0)
    path = written(tmp_path / "run.csv", t=np.arange(4.0), **columns)
    trial = Trial.from_csv(path, origin="cg", xg=2.0)
    assert trial["v"][0] == pytest.approx(0.8)
    assert trial["x"][0] == pytest.approx(10.0 - math.sqrt(3.0))
    assert trial["y"][0] == pytest.approx(19.0)
    for name, other in (("v", "r"), ("x", "psi"), ("N", "Y")):
        written(path, t=np.arange(4.0), **{name: np.zeros(4)})
        message = f"expected {other} to convert {name} of origin"
        assert message in refusal(path, origin="cg", xg=2.0)


@pytest.mark.parametrize("turned_deg", [30.0, 300.0])
def test_a_current_is_what_speed_over_ground_has_more_than_the_log(
    tmp_path, turned_deg
):
    """A ship without leeway, in a current of 0.5 m/s north and 0.2 m/s west."""
    psi = np.linspace(0.3, 0.3 + turned_deg * DEGREE, T.size)
    velocity = 6.0 * np.exp(1j * psi) + 0.5 - 0.2j
    ground = {"sog": np.abs(velocity), "cog": np.angle(velocity)}
    stw = np.full(T.size, 6.0)
    path = written(tmp_path / "run.csv", t=T, psi=psi, stw=stw, **ground)
    trial = Trial.from_csv(path)
    np.testing.assert_allclose(trial["v"], 0.0, atol=1e-9)
    assert "0.54 m/s (1.05 knots) towards 338 deg, 0.00 m/s" in " ".join(trial.notes)


def test_a_heading_follows_from_its_rate_where_there_is_no_position(tmp_path):
    t = np.arange(9.0)
    trial = Trial.from_csv(written(tmp_path / "run.csv", t=t, r=0.01 + 0.01 * t))
    np.testing.assert_allclose(trial["psi"], 0.01 * t + 0.005 * t**2, atol=1e-12)
    assert trial.derived == {"psi"}


# --- clocks


def test_channels_at_different_rates_are_read_each_where_it_has_values(tmp_path):
    path = tmp_path / "run.csv"
    rows = [f"{k / 2},{1.0 + k / 10},{'' if k % 2 else k / 2}" for k in range(20)]
    path.write_text("\n".join(["t,u,x", *rows]))
    trial = Trial.from_csv(path)
    np.testing.assert_allclose(trial.t, np.arange(10.0))  # the slower one's
    np.testing.assert_allclose(trial["u"], 1.0 + trial.t / 5.0)
    swapped = [rows[0], rows[1], rows[4], rows[3], rows[2], *rows[5:]]
    path.write_text("\n".join(["t,u,x", *swapped]))
    assert "expected time to increase from row to row" in refusal(path)


def record(step):
    """Time, heading, yaw rate and rudder of 800 samples of a zigzag."""
    rows = [(one.t, one.psi, one.r, one.rudder) for one in sailed(800, step)]
    t, *angles = np.array(rows).T
    psi, r, delta = np.radians(angles)
    return {"t": t, "psi": psi, "r": r, "delta": delta}


def test_a_rudder_of_the_other_sign_is_refused(tmp_path):
    zigzag = record(step=0.5)
    path = written(tmp_path / "run.csv", **{**zigzag, "delta": -zigzag["delta"]})
    assert 'write rudder_positive = "port" in [conventions]' in refusal(path)
    trial = Trial.from_csv(path, rudder_positive="port")
    np.testing.assert_allclose(trial["delta"], zigzag["delta"])


@pytest.mark.parametrize("turning", ["psi", "r"])
def test_a_rudder_in_radians_that_is_declared_in_degrees_is_refused(tmp_path, turning):
    zigzag = record(step=0.5)
    columns = {name: zigzag[name] for name in ("t", turning, "delta")}
    path = written(tmp_path / "run.csv", **columns)
    named = {turning: turning, "delta": {"column": "delta", "unit": "deg"}}
    message = refusal(path, columns=named)
    assert "got at most 0.35 deg; likely a wrong unit" in message
    assert 'declare delta = { column = "delta", unit = "rad" }' in message


# --- parts of a log


def cut_trials(folder, cut, t="t"):
    delta = np.zeros(601)
    for begin, end in ((100, 140), (190, 199)):  # quiet for under a minute
        delta[begin:end] = 3.1 * DEGREE
    delta[300:310] = 20.0 * DEGREE  # too short for a manoeuvre
    delta[400:432] = -10.0 * DEGREE
    rows = [f"{k},{34200 + k},{one!r}" for k, one in enumerate(delta.tolist())]
    if t == "clock":
        rows = [
            f"{k},{9 + (1800 + k) // 3600:02d}:{(30 + k // 60) % 60:02d}:{k % 60:02d},"
            f"{one!r}"
            for k, one in enumerate(delta.tolist())
        ]
    (folder / "run.csv").write_text("\n".join(["t,clock,delta", *rows]))
    (folder / "ship.toml").write_text(
        f'[ship]\nlength = 100.0\n[columns]\nt = "{t}"\ndelta = "delta"\n'
        f'[[trials]]\nfile = "run.csv"\ncut = {cut}\n'
    )
    return ShipFile.load(folder / "ship.toml").trials()


@pytest.mark.parametrize(
    ("cut", "t", "spans"),
    [
        ("[[10, 20], [30, 32]]", "t", [(10, 20), (30, 32)]),
        ("[[60, 120]]", "clock", [(60, 120)]),
        ('"rudder"', "t", [(70, 228), (370, 461)]),
    ],
)
def test_a_log_is_cut_into_trials(tmp_path, cut, t, spans):
    trials = cut_trials(tmp_path, cut, t)
    assert [(one.t[0], one.t[-1]) for one in trials] == spans


@pytest.mark.parametrize(
    ("cut", "t", "message"),
    [
        (
            "[[1, 2, 3]]",
            "t",
            'if not "rudder"): expected a list of numbers, size any x 2',
        ),
        ("[[10, 11]]", "t", "from 0 to 600 s, got 10 to 11, which holds no trial"),
        ("[[700, 800]]", "clock", "from 0 to 600 s, got 700 to 800, which holds no"),
        ('[["09:31", "09:32"]]', "clock", "expected a list of numbers"),
    ],
)
def test_a_cut_that_holds_no_trial_is_refused(tmp_path, cut, t, message):
    with pytest.raises(InputError) as refused:
        cut_trials(tmp_path, cut, t)
    assert message in str(refused.value)


# --- what is missing


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2.0 * math.pi)])
def test_a_heading_is_filled_across_north(unit, turn, tmp_path):
    psi = 0.97 + 0.01 * np.array([0.0, 1.0, NAN, 3.0, 4.0, 5.0])
    path = written(tmp_path / "run.csv", t=np.arange(6.0), psi=psi % 1.0 * turn)
    columns = {"psi": {"column": "psi", "unit": unit}}
    trial = Trial.from_csv(path, columns, repair="interpolate")
    expected = 2.0 * math.pi * (0.97 + 0.01 * np.arange(6.0))
    np.testing.assert_allclose(trial["psi"], expected)


def test_a_long_hole_stays_a_hole(tmp_path):
    psi = np.where((T > 49.0) & (T < 80.0), NAN, SWING)
    path = written(tmp_path / "run.csv", t=T, psi=psi, u=U)
    trial = Trial.from_csv(path, repair="interpolate")
    assert (len(trial), np.diff(trial.t).max()) == (170, 31.0)
    assert "psi has 1 holes, of up to 31 s; nothing is put there" in trial.notes


def test_time_that_stands_still_or_goes_back_is_refused(tmp_path):
    for t, message in (
        ([0.0, 1.0, 1.0, 2.0], "line 4 (data row 3), column 't': expected time to"),
        ([0.0, 1.0, 0.5, 2.0], "got one that goes back from 1 s to 0.5 s; sort the"),
        ([0.0, 1.0], "expected at least 3 rows below the header, got 2"),
    ):
        path = written(tmp_path / "run.csv", t=np.array(t), u=np.ones(len(t)))
        assert message in refusal(path)


@pytest.mark.parametrize("factor", [3.28, 100.0, 1e-3])
def test_positions_in_a_wrong_unit_are_refused(factor, tmp_path):
    """In feet, cm and km: no current and no unit of speed explains it."""
    folder = tmp_path / "mariner"
    shutil.copytree(Path(example_ship()).parent, folder)
    path = folder / "zigzag_20_20.csv"
    log = pd.read_csv(path)
    log[["gnss_north_m", "gnss_east_m"]] *= factor
    log.to_csv(path, index=False)
    with pytest.raises(
        InputError, match=r"positions that change .* likely a wrong unit"
    ):
        ShipFile.load(folder / "ship.toml").trials()


def test_rows_that_are_missing_are_told(tmp_path):
    kept = (T < 100.0) | (T > 124.0)
    columns = {"t": T[kept], "psi": SWING[kept], "delta": np.zeros(kept.sum())}
    trial = Trial.from_csv(written(tmp_path / "log.csv", **columns))
    assert "no rows for 26 s from 99 s on" in " ".join(trial.notes)
