"""A posterior by sampling: the sampler, its diagnostics, and models that keep draws."""

from __future__ import annotations

import numpy as np
import pytest
from sensors import Sensors

from identification import Uncertainty, identify
from identification.judging.posterior import mixing_of
from identification.judging.warnings import model_warnings
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.manoeuvres import zigzag


@pytest.fixture(scope="module")
def nomoto() -> ShipModel:
    """A stable ship of 100 m by the first-order equation."""
    return ShipModel(
        "first-order",
        "nomoto",
        Particulars(length=100.0, speed=8.0),
        SteeringGear(),
        {"c_r": -0.06, "c_d": 0.004},
    )


@pytest.fixture(scope="module")
def trials(nomoto: ShipModel) -> list[Trial]:
    sensors = Sensors(sampling_s=2.0)
    found = []
    for seed, (angle, port) in enumerate([(10.0, False), (20.0, True), (15.0, False)]):
        run = zigzag(nomoto, angle, angle, port, 240.0, 0.5)
        found.append(sensors.measure(run, seed).with_(name=f"trial {seed}"))
    return found


def identified(nomoto, trials, **settings):
    asked = Uncertainty("posterior", **{"steps": 100, **settings})
    return identify(
        trials,
        "nomoto",
        particulars=nomoto.particulars,
        steering=nomoto.steering,
        uncertainty=asked,
    )


@pytest.fixture(scope="module")
def result(nomoto, trials):
    return identified(nomoto, trials)


def test_the_truth_lies_in_the_posterior_of_a_first_order_ship(nomoto, result):
    """The model keeps draws; their covariance is the model's; the report says how."""
    model = result.model
    low, high = np.quantile(model.draws, (0.005, 0.995), axis=0)
    true = np.array(list(nomoto.coefficients.values()))
    assert ((low < true) & (true < high)).all()
    spread = np.sqrt(np.diag(model.covariance))
    np.testing.assert_allclose(model.draws.std(axis=0), spread, rtol=0.25)
    report = result.metrics["posterior"]
    assert report["kept"]
    assert 0.0 < report["power"] <= 1.0
    assert report["effective_samples"] > 150.0
    assert len(model.draws) == 256
    assert "effective samples" in result.summary()
    assert not [text for text in model_warnings(result) if "walkers" in text]


def test_draws_of_a_posterior_are_sampled_saved_and_of_a_seed(
    nomoto, trials, result, tmp_path
):
    model = result.model
    drawn = model.sample(200, seed=3)
    kept = {tuple(row) for row in model.draws.tolist()}
    found = {tuple(one.coefficients.values()) for one in drawn}
    assert len(found) > 180  # a walker may stay where it is for a while
    assert found <= kept
    assert len(model.sample(300, 0)) == 300
    assert drawn[0].draws is None

    model.save(tmp_path / "model.json")
    assert (tmp_path / "model.json").stat().st_size < 100_000
    loaded = ShipModel.load(tmp_path / "model.json")
    np.testing.assert_array_equal(loaded.draws, model.draws)
    assert loaded.sample(1, 7)[0].coefficients == model.sample(1, 7)[0].coefficients

    again = identified(nomoto, trials).model
    np.testing.assert_array_equal(again.draws, model.draws)


def test_too_few_trials_are_refused(nomoto, trials):
    with pytest.raises(InputError, match="at least 3 trials to fit for a posterior"):
        identified(nomoto, trials[:2])


def test_walkers_that_do_not_mix_leave_the_covariance():
    rng = np.random.default_rng(0)
    moving = rng.standard_normal((100, 128, 2))
    assert mixing_of(moving).is_enough
    stuck = np.tile(moving[0], (100, 1, 1))
    assert not mixing_of(stuck).is_enough
    assert not mixing_of(moving + np.linspace(0.0, 3.0, 100)[:, None, None]).is_enough


def test_a_posterior_is_not_for_a_kernel(nomoto, trials):
    with pytest.raises(InputError, match="expected 'analytic' with a kernel"):
        identify(trials, kernel="rbf", uncertainty="posterior")
    with pytest.raises(InputError, match=r"uncertainty\.steps: expected"):
        Uncertainty("posterior", steps=3)
