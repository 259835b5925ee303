from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline

from identification.samples.preprocess import (
    Reinsch,
    noise_level,
    repaired,
    smooth,
)
from shipgym import Trial


def signal(noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5, 1.5, 600))
    truth = np.sin(t / 20.0)
    return t, truth, truth + noise * rng.standard_normal(600)


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 1e-1])
def test_noise_level_is_found_at_irregular_times(noise: float) -> None:
    t, _, values = signal(noise)
    assert noise_level(t, values) == pytest.approx(noise, rel=0.15)


def test_smooth_signal_has_no_noise_and_is_left_alone() -> None:
    t, truth, _ = signal(0.0)
    assert noise_level(t, truth) < 1e-5
    assert smooth(t, truth) is not None
    np.testing.assert_array_equal(smooth(t, truth), truth)


def test_smoothing_takes_away_more_than_half_of_the_noise() -> None:
    t, truth, values = signal(0.05)
    assert np.std(smooth(t, values) - truth) < 0.4 * 0.05


def test_smoothing_spline_is_that_of_scipy() -> None:
    t, _, values = signal(0.05)
    np.testing.assert_allclose(
        Reinsch(t).smoothed(values, 30.0),
        make_smoothing_spline(t, values, lam=30.0)(t),
        atol=1e-9,
    )


def test_outliers_and_short_dropouts_are_repaired_and_told(
    noisy_trials: list[Trial],
) -> None:
    trial = noisy_trials[0]
    u = trial["u"].copy()
    u[[50, 200]] += 3.0
    kept = np.ones(len(trial), dtype=bool)
    kept[100:103] = False
    wrong = Trial(
        trial.t[kept],
        {c: v[kept] for c, v in (dict(trial.channels) | {"u": u}).items()},
        name="w",
    )
    mended = repaired(wrong)
    assert mended.raw is wrong
    assert mended.repaired["u"] >= 5
    np.testing.assert_allclose(mended.t, trial.t)
    assert np.abs(mended["u"] - trial["u"]).max() < 0.2
    assert repaired(mended)["u"].max() < 9.0


def test_clean_trials_are_left_alone(cao_zigzag: Trial) -> None:
    assert repaired(cao_zigzag) is cao_zigzag
    assert cao_zigzag.raw is cao_zigzag
