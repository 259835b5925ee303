from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identification import LSSVM, IdentificationResult, Samples, identify
from identification.judging.diagnostics import (
    autocorrelation,
    diagnose,
    variance_inflation,
    without_overlap,
)
from identification.samples.checks import check_trials, is_still
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag
from shipgym.ships import get_structure


def test_variance_inflation_of_two_correlated_features() -> None:
    rng = np.random.default_rng(0)
    a, b, c = np.linalg.qr(rng.standard_normal((400, 3)))[0].T * 20.0
    correlated = 0.8 * a + 0.6 * b
    factors = variance_inflation(np.column_stack([a, correlated, c]))
    np.testing.assert_allclose(
        factors, [1 / (1 - 0.64), 1 / (1 - 0.64), 1.0], rtol=1e-9
    )
    twice, alone = variance_inflation(np.column_stack([a, -a, c]))[[0, 2]]
    assert twice > 1e10
    assert alone == pytest.approx(1.0)


def test_autocorrelation_of_a_moving_average() -> None:
    white = np.random.default_rng(0).standard_normal(20000)
    found = autocorrelation(white[1:] - white[:-1], 3)
    assert found == pytest.approx((-0.5, 0.0, 0.0), abs=0.03)


def test_fit_without_noise_explains_everything(cao_fit: IdentificationResult) -> None:
    for fit in cao_fit.diagnostics.values():
        assert fit.r_squared > 1.0 - 1e-9
        assert fit.samples == 1000
        assert fit.dropped == ()
        assert 100.0 < fit.condition_number < 250.0
    assert max(cao_fit.diagnostics["v"].variance_inflation.values()) > 100.0


def test_collinear_terms_of_a_zigzag_are_named(cao_fit: IdentificationResult) -> None:
    pairs = {
        (first, second) for first, second, _ in cao_fit.diagnostics["v"].collinear_pairs
    }
    assert ("Y_d", "Y_ddd") in pairs


def test_diagnostics_are_plain_values(noisy_fit: IdentificationResult) -> None:
    text = json.dumps(
        {q: fit.to_dict() for q, fit in noisy_fit.diagnostics.items()}, allow_nan=False
    )
    assert json.loads(text)["r"]["terms"] == 15


def with_rudder(delta_deg: np.ndarray, step: float = 0.5) -> Trial:
    channels = {name: np.zeros(len(delta_deg)) for name in "uvr"} | {
        "delta": np.radians(delta_deg)
    }
    return Trial(step * np.arange(len(delta_deg)), channels, name="straight.csv")


@pytest.mark.parametrize("samples", [40, 400, 20000])
@pytest.mark.parametrize("noise", [0.05, 0.15, 0.4])
def test_noise_on_a_constant_rudder_moves_nothing(
    mariner: ShipModel, samples: int, noise: float
) -> None:
    for seed in range(5):
        delta = 10.0 + noise * np.random.default_rng(seed).standard_normal(samples)
        with pytest.raises(
            InputError, match=r"straight\.csv.*stays at (9\.[789]|10\.[0123]).*zigzag"
        ):
            check_trials([with_rudder(delta)], mariner.table)


@pytest.mark.parametrize("noise", [0.0, 0.15])
@pytest.mark.parametrize("row", [0, 150, 399])
def test_an_outlier_on_a_constant_rudder_moves_nothing(
    mariner: ShipModel, row: int, noise: float
) -> None:
    delta = -5.0 + noise * np.random.default_rng(0).standard_normal(400)
    delta[row] = 30.0
    with pytest.raises(InputError, match=r"stays at -(4\.9|5\.0)\d deg throughout"):
        check_trials([with_rudder(delta)], mariner.table)


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("every", [1, 10, 50])
def test_small_zigzags_and_coarse_ones_move(
    mariner: ShipModel, record: Callable[..., Trial], every: int, noise: float
) -> None:
    run = zigzag(mariner, 5, 1, duration=300, dt=0.1)
    check_trials([record(run, every=every, noise=noise)], mariner.table)


def test_a_short_zigzag_in_a_long_record_moves(mariner: ShipModel) -> None:
    delta = 0.15 * np.random.default_rng(0).standard_normal(20000)
    delta[9000:9150] += (
        zigzag(mariner, 10, 10, duration=150, dt=1.0)["delta"][:150] * 180.0 / np.pi
    )
    check_trials([with_rudder(delta)], mariner.table)


def test_orders_at_every_sample_are_no_noise(mariner: ShipModel) -> None:
    check_trials(
        [with_rudder(np.random.default_rng(0).choice([-10.0, 10.0], 300))],
        mariner.table,
    )


@pytest.mark.parametrize("apart", [1e-9, 1e-6, 4e-5])
def test_times_that_nearly_coincide_are_refused(
    mariner: ShipModel, noisy_trials: list[Trial], apart: float
) -> None:
    run = noisy_trials[0]
    t = np.insert(run.t, 101, run.t[100] + apart)
    twice = Trial(
        t,
        {c: np.insert(v, 101, v[100]) for c, v in run.channels.items()},
        name="twice.csv",
    )
    message = (
        r"twice\.csv': expected samples about 1 s apart, got .* remove the repeated"
        r" row"
    )
    with pytest.raises(InputError, match=message):
        identify([twice], particulars=mariner.particulars)


def test_each_equation_tells_its_numbers() -> None:
    """Two orthogonal features (0.01, 100); alternating errors of 0.5 in one of them."""
    rows = np.arange(400)
    a = np.where(rows % 2 == 0, 0.01, -0.01)
    b = np.where(rows // 2 % 2 == 0, 100.0, -100.0)
    error = 0.5 * np.where(rows // 4 % 2 == 0, 1.0, -1.0)
    X, y = np.column_stack([a, b]), 300.0 * a + error
    samples = Samples(
        {"r": X}, {"r": y}, 1.0 * rows, np.ones(400), np.zeros(400, dtype=np.int64), 1
    )
    fit = LSSVM(C=np.inf, fit_intercept=False).fit(X, y)
    found = diagnose({"r": fit}, samples, get_structure("nomoto"))["r"]
    assert (found.samples, found.terms, found.rank) == (400, 2, 2)
    assert found.condition_number == pytest.approx(1.0)
    assert found.residual_rms == pytest.approx(0.5)
    assert found.r_squared == pytest.approx(1.0 - 0.25 / 9.25)
    assert list(found.variance_inflation.values()) == pytest.approx([1.0, 1.0])
    assert found.collinear_pairs == ()
    assert found.residual_autocorrelation[3] == pytest.approx(-0.99)
    assert len(found.residual_autocorrelation) == 10
    alike = replace(samples, features={"r": np.column_stack([a, a + 1e-6 * b])})
    ((first, second, correlation),) = diagnose(
        {"r": fit}, alike, get_structure("nomoto")
    )["r"].collinear_pairs
    assert (first, second) == get_structure("nomoto").names("r")
    assert correlation == pytest.approx(1.0, abs=1e-3)


def test_rows_without_overlap_are_a_window_apart() -> None:
    def apart(window: int) -> list[int]:
        none = np.zeros(7)
        samples = Samples({}, {}, none, none, none.astype(np.int64), window)
        return without_overlap(samples).tolist()

    assert apart(1) == [0, 1, 2, 3, 4, 5, 6]  # steps
    assert apart(4) == [0, 2, 4, 6]  # half windows apart
    assert apart(3) == [0, 3, 6]


@pytest.mark.parametrize(
    ("noise_deg", "limit_deg"), [(0.0, 0.5), (0.08, 0.5), (0.2, 1.2), (0.6, 3.0)]
)
def test_a_rudder_moves_by_half_a_degree_and_six_times_its_noise_but_for_three_degrees(
    noise_deg: float, limit_deg: float
) -> None:
    """A plateau of some samples: two beside each other are outliers."""
    noise = noise_deg * np.random.default_rng(4).standard_normal(400)
    for size, samples, still in ((0.3, 40, True), (1.6, 40, False), (9.0, 2, True)):
        plateau = np.zeros(400)
        plateau[200 : 200 + samples] = size * limit_deg
        assert is_still(with_rudder(plateau + noise)) == still


def test_the_shortest_step_is_a_ten_thousandth_of_the_usual_one(
    mariner: ShipModel,
) -> None:
    def stepping(shortest: float) -> Trial:
        t = 2.0 * np.arange(9.0)
        channels = {name: np.ones(10) for name in ("u", "v", "r")}
        channels["delta"] = np.sin(np.arange(10.0))
        return Trial(np.append(t, t[-1] + shortest), channels, name="run")

    check_trials([stepping(2.05e-4)], mariner.table)
    with pytest.raises(InputError, match=r"about 2 s apart, got 0\.00019 s from 16 to"):
        check_trials([stepping(1.9e-4)], mariner.table)
