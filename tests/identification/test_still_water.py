"""Currents are found from velocities over ground, wind from ship and columns."""

from __future__ import annotations

import numpy as np
import pytest

from identification import Uncertainty, identify
from identification.judging.warnings import sea_sentences
from identification.samples.still_water import in_still_water
from shipgym import ShipModel, Trial
from shipgym.errors import InputError
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.models.simulate import open_loop
from shipgym.sea import Current, Weather, Wind
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
    told = sea_sentences(report)[0]
    assert told.startswith("turn, zigzag, held out: current of 0.5")
    assert told.endswith("m/s east); removed")


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
    assert sea_sentences(report)[0].endswith("left in")


def test_velocities_through_the_water_keep_theirs(mariner: ShipModel) -> None:
    """A logged speed is through the water: only the track changes."""
    run = zigzag(mariner, 20, 20, duration=300.0, dt=1.0, weather=CURRENT)
    (found,), report = in_still_water([run], mariner.particulars)
    assert report["currents"][run.name]["source"] == "columns"
    np.testing.assert_array_equal(found["u"], run["u"])
    still = zigzag(mariner, 20, 20, duration=300.0, dt=1.0)
    np.testing.assert_allclose(found["x"], still["x"], atol=1e-6)


@pytest.mark.parametrize(
    ("option", "which", "said"),
    [
        ("slack", [0], r"current: .*'auto', 'none'"),
        ({"north": 1.0}, [0], "east"),
        (
            {"north": 9.0, "east": 0.0},
            [0],
            "expected less than the ship's speed of 7.72 m/s, got 9",
        ),
    ],
)
def test_currents_that_cannot_be(
    mariner: ShipModel, logs: list[Trial], option, which, said
) -> None:
    with pytest.raises(InputError, match=said):
        identify(
            [logs[k] for k in which],
            "nomoto",
            particulars=mariner.particulars,
            current=option,
        )


def test_a_current_on_one_heading_is_taken_out_with_a_word(
    mariner: ShipModel, logs: list[Trial]
) -> None:
    """Where the water stands still nothing is taken out."""
    (found,), report = in_still_water([logs[1]], mariner.particulars)
    (row,) = report["currents"].values()
    errors = np.array([row["north"] - NORTH, row["east"] - EAST])
    assert row["taken_out"]
    assert np.all(np.abs(errors) < 3.0 * np.array(row["standard_errors"]))
    assert not found.over_ground
    assert "though the trials keep to one heading" in report["sea_remarks"][0]
    calm = log(zigzag(mariner, 20, 20, duration=500.0, dt=0.5))
    (found,), report = in_still_water([calm], mariner.particulars)
    assert found is calm
    assert "sea_remarks" not in report


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
