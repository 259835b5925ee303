"""Currents are found from velocities over ground, wind from ship and columns."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification import Uncertainty, identify
from identification.judging.sentences import current_text, sea_sentences
from identification.report.predictions import track_figure
from identification.samples.current import estimate_current
from identification.samples.still_water import in_still_water
from identification.samples.surge_sway import (
    MEAN,
    Coefficients,
    SurgeSwayInputs,
    accelerations,
)
from identification.samples.trial_currents import currents_of, wald_probability
from identification.samples.velocities import through_water
from identification.samples.wind import measured_wind
from shipgym import ShipModel, Trial
from shipgym.errors import InputError
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.models.simulate import open_loop
from shipgym.sea import Current, Weather, Wind
from shipgym.sea.mobility import mobility_matrix
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.trials.conventions import Conventions
from shipgym.trials.midship import to_project_conventions
from shipgym.trials.resampling import Log

NORTH, EAST = 0.3, -0.4  # m/s
CURRENT = Weather(Current(0.5, np.degrees(np.arctan2(EAST, NORTH))))


def log(run: Trial, seed: int = 0) -> Trial:
    """GNSS positions, gyro and rudder at 1 Hz; u, v and r are derived from them."""
    rng, every = np.random.default_rng(seed), slice(None, None, 2)
    noise = {"x": 0.3, "y": 0.3, "psi": np.radians(0.1), "delta": np.radians(0.1)}
    channels = {
        name: run[name][every] + size * rng.standard_normal(len(run.t[every]))
        for name, size in noise.items()
    }
    recorded = Log(run.t[every], channels, "log", [])
    to_project_conventions(recorded, Conventions())
    facts = {"kind": run.kind, "use": run.use, "derived": recorded.derived}
    return Trial(recorded.t, recorded.channels, name=run.name, **facts)


@pytest.fixture(scope="module")
def logs(mariner: ShipModel) -> list[Trial]:
    """A turn to fit, a zigzag to fit and one held out, in a current."""
    runs = [turning_circle(mariner, 35.0, 700.0, 0.5, weather=CURRENT)]
    runs += [
        zigzag(mariner, 20, 20, port, 500.0, 0.5, weather=CURRENT)
        for port in (False, True)
    ]
    names, uses = ("turn", "zigzag", "held out"), ("fit", "fit", "validate")
    return [
        log(run.with_(name=name, use=use), k)
        for k, (run, name, use) in enumerate(zip(runs, names, uses, strict=True))
    ]


def test_a_current_is_found_and_taken_out(
    mariner: ShipModel, logs: list[Trial]
) -> None:
    """To centimetres per second, also of a held-out trial; the track follows."""
    found, report = in_still_water(logs, mariner.particulars)
    row = report["currents"]["held out"]
    errors = np.array([row["north"] - NORTH, row["east"] - EAST])
    assert np.hypot(*errors) < 0.03
    assert np.all(np.abs(errors) < 3.0 * np.array(row["standard_errors"]))
    assert row["taken_out"]
    assert not found[0].over_ground
    drift = (
        (logs[0]["x"] - found[0]["x"])[-1] / found[0].duration,
        (logs[0]["y"] - found[0]["y"])[-1] / found[0].duration,
    )
    np.testing.assert_allclose(drift, (row["north"], row["east"]))
    assert found[0].raw.sha256 == logs[0].sha256
    fit = SimpleNamespace(model=SimpleNamespace(provenance=report), trials=found)
    figure = track_figure(fit)
    assert [trace.name for trace in figure.data[:3]] == [
        "over ground",
        "through the water",
        "the water meanwhile",
    ]
    assert figure.layout.annotations[0].text.startswith("turn: 0.5")
    away = np.array([[row["east"]], [row["north"]]]) * found[0].duration * [0.0, 1.0]
    ends = np.array([[found[0]["y"][-1]], [found[0]["x"][-1]]]) + away
    np.testing.assert_allclose([figure.data[2].x, figure.data[2].y], ends, rtol=1e-6)
    assert track_figure(SimpleNamespace(model=mariner, trials=found)) is None
    told = sea_sentences(report)[0]
    assert told.startswith("turn, zigzag, held out: current of 0.5")
    assert told.endswith("which differs from zero; removed")


def test_each_trial_may_have_a_current_of_its_own(
    mariner: ShipModel, logs: list[Trial]
) -> None:
    """Trials that contradict one current have two, a held-out trial one by these."""
    other = turning_circle(
        mariner, -35.0, 700.0, 0.5, weather=Weather(Current(0.8, 90.0))
    )
    trials = [logs[0], log(other, 5).with_(name="other"), logs[2]]
    _, report = in_still_water(trials, mariner.particulars)
    rows = {
        name: (row["north"], row["east"]) for name, row in report["currents"].items()
    }
    np.testing.assert_allclose(rows["turn"], (NORTH, EAST), atol=0.05)
    np.testing.assert_allclose(rows["other"], (0.0, 0.8), atol=0.05)
    np.testing.assert_allclose(rows["held out"], (NORTH, EAST), atol=0.2)
    assert {row["source"] for row in report["currents"].values()} == {"trial"}


def test_still_water_stays_still(mariner: ShipModel) -> None:
    """A current that does not differ from zero is reported and left in."""
    calm = log(turning_circle(mariner, 35.0, 700.0, 0.5))
    (found,), report = in_still_water([calm], mariner.particulars)
    assert found is calm
    row = report["currents"][calm.name]
    assert np.hypot(row["north"], row["east"]) < 0.05
    assert "which does not differ from zero; left in" in sea_sentences(report)[0]


def test_velocities_through_the_water_keep_theirs(mariner: ShipModel) -> None:
    """A logged speed is through the water: only the track changes."""
    run = zigzag(mariner, 20, 20, duration=300.0, dt=1.0, weather=CURRENT)
    (found,), report = in_still_water([run], mariner.particulars)
    assert report["currents"][run.name]["source"] == "columns"
    np.testing.assert_array_equal(found["u"], run["u"])
    still = zigzag(mariner, 20, 20, duration=300.0, dt=1.0)
    np.testing.assert_allclose(found["x"], still["x"], atol=1e-6)


def test_a_given_current_and_a_logged_speed(mariner: ShipModel) -> None:
    """With a speed log and positions only the sway that was derived changes."""
    run = zigzag(mariner, 20, 20, duration=300.0, dt=0.5, weather=CURRENT)
    channels = {name: run[name] for name in ("x", "y", "psi", "r", "delta", "u")}
    recorded = Log(run.t, channels, "log", [])
    to_project_conventions(recorded, Conventions())
    mixed = Trial(run.t, recorded.channels, derived=recorded.derived)
    assert mixed.over_ground
    found = through_water(mixed, NORTH, EAST)
    np.testing.assert_array_equal(found["u"], run["u"])
    np.testing.assert_allclose(found["v"], run["v"], atol=0.01)


def straight(psi_deg: float) -> Trial:
    """A trial of 100 s over ground, its second half the mirror image of the first."""
    psi = np.radians(np.repeat([psi_deg, -psi_deg], 50))
    channels = {
        "u": np.full(100, 2.0),
        "v": np.zeros(100),
        "r": np.zeros(100),
        "psi": psi,
        "delta": psi,
    }
    return Trial(np.arange(100.0), channels, name="run", over_ground=True)


def test_a_current_is_estimated_from_trials_of_five_ship_lengths() -> None:
    """99 s at 2 m/s."""
    for length, is_known in ((39.5, True), (39.7, False)):
        found = currents_of([straight(40.0)], length, 2.0, "shared")
        assert ("run" in found) == is_known


@pytest.mark.parametrize(
    ("psi_deg", "one_heading"),
    [(32.0, False), (31.5, True)],  # cos 32 deg is 0.848, cos 31.5 deg 0.853
)
def test_a_current_is_known_by_several_headings(
    psi_deg: float, one_heading: bool
) -> None:
    ship: Any = {"length": 7.0, "speed": 2.0}
    _, report = in_still_water([straight(psi_deg)], ship)
    remarks = report.get("sea_remarks", [])
    keeps = any("the trials keep to one heading" in remark for remark in remarks)
    assert keeps == one_heading


def test_a_current_in_columns_and_one_given_agree_to_a_decimetre_per_second() -> None:
    logged = straight(40.0).with_channels(
        {"current_north": np.full(100, 0.2), "current_east": np.zeros(100)}
    )
    near: Any = {"north": 0.2, "east": 0.099}
    assert currents_of([logged], 7.0, 2.0, near)["run"].source == "columns"
    far: Any = {"north": 0.2, "east": 0.101}
    with pytest.raises(
        InputError, match=r"current_north.*got means of 0\.20 and 0\.00"
    ):
        currents_of([logged], 7.0, 2.0, far)


@pytest.mark.parametrize(
    ("option", "which", "said"),
    [
        ("slack", [0], r"current: .*'auto', 'shared', 'trial', 'none'"),
        ({"north": 1.0}, [0], "east"),
        (
            {"north": 9.0, "east": 0.0},
            [0],
            "expected less than the ship's speed of 7.72 m/s, got 9",
        ),
        ("shared", [1], "the trials keep to one heading; add a turn of a whole circle"),
    ],
)
def test_currents_that_cannot_be(
    mariner: ShipModel, logs: list[Trial], option, which, said
) -> None:
    with pytest.raises(InputError, match=said):
        in_still_water([logs[k] for k in which], mariner.particulars, option)


def test_columns_that_contradict_a_given_current(
    mariner: ShipModel, logs: list[Trial]
) -> None:
    columns = {
        name: np.full(len(logs[0]), 0.5) for name in ("current_north", "current_east")
    }
    with pytest.raises(
        InputError, match=r"current = { north = 0\.1.*means of 0\.50 and 0\.50"
    ):
        in_still_water(
            [logs[0].with_channels(columns)],
            mariner.particulars,
            {"north": 0.1, "east": 0.0},
        )


def test_one_heading_is_left_as_it_is_with_a_word(
    mariner: ShipModel, logs: list[Trial]
) -> None:
    (found,), report = in_still_water([logs[1]], mariner.particulars)
    assert found is logs[1]
    assert "zigzag: no current is removed: the trials keep" in report["sea_remarks"][0]
    (row,) = report["currents"].values()
    assert not {"standard_errors", "probability"} & row.keys()
    assert (
        "a guess without an interval, as the trials keep to one heading; left in"
        in sea_sentences(report)[0]
    )


def test_measured_wind_is_taken_out(mariner: ShipModel) -> None:
    """The run in wind is that of her equations with the force, not without."""
    run = zigzag(
        mariner,
        10,
        10,
        duration=300.0,
        dt=0.5,
        weather=Weather(wind=Wind(12.0, 60.0, gust=False)),
    )
    (windy,), report = in_still_water([run], mariner.particulars)
    assert report["wind"]["mean_speeds"][run.name] == pytest.approx(12.0)
    ahead = windy["u"] + 12.0 * np.cos(run["wind_from"] - run["psi"])
    aside = windy["v"] + 12.0 * np.sin(run["wind_from"] - run["psi"])
    curves = wind_curves(mariner.particulars)
    pressure, angle = (
        0.5 * AIR_DENSITY * (ahead**2 + aside**2),
        np.arctan2(aside, ahead),
    )
    surge = pressure * np.interp(angle, curves.angle, curves.X, period=2.0 * np.pi)
    surge -= 0.5 * AIR_DENSITY * curves.X[0] * windy["u"] ** 2
    np.testing.assert_allclose(
        windy["wind_udot"], mobility_matrix(mariner)[0, 0] * surge, rtol=1e-9
    )
    with_wind = open_loop(mariner, windy)["psi"] - run["psi"]
    without = open_loop(mariner, run)["psi"] - run["psi"]
    assert np.abs(with_wind).max() < 0.1 * np.abs(without).max()
    fit = {
        "particulars": mariner.particulars,
        "steering": mariner.steering,
        "uncertainty": Uncertainty(model_error=False),
    }
    found, left_in = (
        identify([run], wind=wind, **fit).coefficients for wind in ("auto", "none")
    )
    names = ("Y_v", "Y_r", "Y_d", "N_v", "N_r", "N_d")
    far, near = (
        sum(abs(one[name] / mariner.coefficients[name] - 1.0) for name in names)
        for one in (left_in, found)
    )
    assert near < 0.2 * far


def test_a_constant_wind_of_each_trial(mariner: ShipModel) -> None:
    """A yaw acceleration of one of two trials is what the fit finds between them."""
    runs = [
        zigzag(mariner, 15, 15, port, 300.0, 0.5).with_(name=str(port))
        for port in (False, True)
    ]
    pushed = open_loop(
        mariner, runs[0].with_channels({"wind_rdot": np.full(len(runs[0]), 2e-6)})
    )
    fit = identify(
        [pushed, runs[1]],
        wind="constant",
        particulars=mariner.particulars,
        steering=mariner.steering,
        uncertainty=Uncertainty(model_error=False),
    )
    found = fit.model.provenance["wind"]["accelerations"]
    assert found["False"]["wind_rdot"] - found["True"]["wind_rdot"] == pytest.approx(
        2e-6, rel=0.1
    )
    assert "False: constant acceleration removed, vdot" in " ".join(
        sea_sentences(fit.model.provenance)
    )


def test_wind_without_what_it_needs(mariner: ShipModel) -> None:
    run = zigzag(
        mariner, 10, 10, duration=200.0, dt=1.0, weather=Weather(wind=Wind(9.0, 60.0))
    )
    bare = replace(mariner.particulars, beam=None)
    with pytest.raises(
        InputError, match="weather without the particulars it needs: beam"
    ):
        in_still_water([run], bare, wind="blendermann")
    (found,), report = in_still_water([run], bare)
    assert "wind_udot" not in found
    assert report["sea_remarks"][0].startswith(
        "the logged wind is not removed: weather without"
    )
    with pytest.raises(
        InputError, match="wind: expected columns wind_speed and wind_from"
    ):
        in_still_water(
            [zigzag(mariner, 10, 10, duration=200.0, dt=1.0)],
            bare,
            wind="blendermann",
        )


def test_the_wind_that_a_ship_feels_is_that_of_her_way_over_ground(
    mariner: ShipModel,
) -> None:
    """In sway and yaw alike, over ground or through a current in columns."""
    t = np.arange(0.0, 40.0, 0.5)
    psi, north, east = 0.05 * t, 0.8, -0.5
    own = {
        "psi": psi,
        "delta": 0.0 * t,
        "r": 0.05 + 0.0 * t,
        "wind_speed": 9.0 + 0.0 * t,
        "wind_from": 1.0 + 0.0 * t,
    }
    drift = {"current_north": north + 0.0 * t, "current_east": east + 0.0 * t}
    ahead, aside = (
        north * np.cos(psi) + east * np.sin(psi),
        east * np.cos(psi) - north * np.sin(psi),
    )
    through = Trial(
        t, {**own, **drift, "u": 7.0 + 0.0 * t, "v": -0.3 + 0.0 * t}, over_ground=False
    )
    ground = Trial(t, {**own, "u": 7.0 + ahead, "v": aside - 0.3}, over_ground=True)
    felt = [
        measured_wind(trial, mariner.particulars, "auto") for trial in (through, ground)
    ]
    for name in ("wind_vdot", "wind_rdot"):
        np.testing.assert_allclose(felt[0][name], felt[1][name], rtol=1e-9)
        assert np.abs(felt[0][name]).max() > 0.0


def test_the_jackknife_is_as_wide_as_estimates_scatter(mariner: ShipModel) -> None:
    """Of ten logs with noise of their own the errors are of the size that is told."""
    scaled = []
    for seed in range(10):
        run = turning_circle(mariner, 35.0, 500.0, 0.5, weather=CURRENT)
        found = estimate_current([log(run, seed)], 160.9, 7.7, shared=True)
        error = found.mean - [NORTH, EAST]
        scaled.append(error / np.sqrt(np.diag(found.covariance)))
        np.testing.assert_allclose(found.covariance, found.covariance.T)
    assert 0.2 < np.sqrt(np.mean(np.square(scaled))) < 2.0


def test_trials_share_a_current_or_have_each_their_own(
    mariner: ShipModel, logs: list[Trial]
) -> None:
    one = estimate_current(logs[:2], 160.9, 7.7, shared=True)
    np.testing.assert_array_equal(one.mean[:2], one.mean[2:])
    each = estimate_current(logs[:2], 160.9, 7.7, shared=False)
    assert not np.array_equal(each.mean[:2], each.mean[2:])
    # the coefficients of an estimate are not fitted again
    known = estimate_current(logs[2:], 160.9, 7.7, True, one.coefficients)
    np.testing.assert_allclose(known.coefficients, one.coefficients, atol=1e-2)


def test_values_differ_from_zero_by_their_covariance() -> None:
    """Of two normal numbers the squared distance is exponential: exp(-d^2 / 2)."""
    assert wald_probability(np.zeros(2), np.eye(2)) == 1.0
    near = wald_probability(np.array([0.3, 0.0]), 0.01 * np.eye(2))
    assert near == pytest.approx(np.exp(-4.5))
    correlated = np.array([[2.0, 1.0], [1.0, 2.0]])
    far = wald_probability(np.array([3.0, 3.0]), correlated)
    assert far == pytest.approx(np.exp(-3.0))


def test_captive_trials_and_those_of_unknown_speed_keep_their_current(
    mariner: ShipModel,
) -> None:
    t = np.arange(50.0)
    drift = {"current_north": np.full(50, 0.2), "current_east": np.zeros(50)}
    track = {"x": 5.0 * t, "y": 0.0 * t, "psi": 0.0 * t}
    towed = Trial(
        t,
        {**track, **drift, "u": 5.0 + 0.0 * t, "v": 0.0 * t},
        name="towed",
        kind="captive",
    )
    (found,), report = in_still_water([towed], mariner.particulars)
    assert found is towed
    assert report == {}
    slow = Trial(t, {**track, **drift}, name="slow")
    (found,), report = in_still_water([slow], {"length": 7.0})
    assert found is slow
    assert report == {}
    (found,), report = in_still_water([slow], {"length": 7.0, "speed": 2.0})
    np.testing.assert_allclose(found["x"], 4.8 * t)
    assert report["currents"]["slow"]["taken_out"]


def test_what_a_ship_of_the_prior_does_is_the_same_to_both_sides() -> None:
    """Sway changes sign with drift, turn, rudder and wind; surge does not."""
    c = Coefficients(*np.random.default_rng(0).normal(size=len(MEAN)))._replace(Y_0=0.0)
    at = SurgeSwayInputs(r=0.4, delta=0.3, n=1.1, ahead=0.02, aside=0.05)
    mirrored = at._replace(r=-0.4, delta=-0.3, aside=-0.05)
    surge, sway = accelerations(0.9, 0.2, at, c)
    expected = (pytest.approx(surge), pytest.approx(-sway))
    assert accelerations(0.9, -0.2, mirrored, c) == expected
    # at her speed ahead on a straight course only the propeller and the wind act
    straight_on = accelerations(1.1, 0.0, at._replace(r=0.0, delta=0.0), c)
    assert straight_on == (
        pytest.approx(c.X_0 + 0.02 * c.wind),
        pytest.approx(0.05 * c.wind),
    )


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (
            {
                "source": "trial",
                "standard_errors": (0.01, 0.02),
                "probability": 0.009,
                "taken_out": True,
            },
            (
                "its own, north 0.300 ± 0.020, east -0.400 ± 0.039 m/s (95 %), which"
                " differs from zero; removed"
            ),
        ),
        (
            {
                "source": "all trials",
                "standard_errors": (0.1, 0.2),
                "probability": 0.0101,
                "taken_out": False,
            },
            (
                "one for all, north 0.300 ± 0.196, east -0.400 ± 0.392 m/s (95 %),"
                " which does not differ from zero; left in"
            ),
        ),
        (
            {"source": "all trials", "taken_out": False},
            (
                "one for all, a guess without an interval, as the trials keep to one"
                " heading; left in"
            ),
        ),
        ({"source": "given", "taken_out": True}, "as given; removed"),
        ({"source": "columns", "taken_out": True}, "from columns; removed"),
    ],
)
def test_a_current_is_told_with_set_and_drift_and_what_became_of_it(row, said):
    """A knot is 0.514444 m/s; the water sets to the north-west, 53 deg from north."""
    told = current_text({"north": NORTH, "east": EAST, **row})
    assert told == f"current of 0.50 m/s (0.97 knots) towards 307 deg, {said}"


def test_winds_are_told_by_their_range_and_by_what_was_removed_of_each_trial():
    wind = {
        "mean_speeds": {"a": 4.24, "b": 12.3},
        "accelerations": {"runs/a.csv": {"wind_vdot": 0.0123, "wind_rdot": -2.5e-5}},
    }
    assert sea_sentences({"wind": wind}) == [
        "wind of 4.2 to 12 m/s on average: its forces are removed",
        "a.csv: constant acceleration removed, vdot 0.012 m/s², rdot -2.5e-05 rad/s²",
    ]
    assert sea_sentences({}) == []
