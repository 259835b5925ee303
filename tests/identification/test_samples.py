from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from identification import Samples, build_samples
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag


def mismatch(model: ShipModel, samples: Samples) -> float:
    """Largest violation of the regression by the true coefficients, relative to the largest change."""
    table = model.table
    theta = table.acceleration_matrix(model.particulars) @ np.array(list(model.coefficients.values()))
    worst, first = 0.0, 0
    for q in table.equations:
        size = samples.features[q].shape[1]
        left = samples.targets[q] - samples.features[q] @ theta[first : first + size]
        worst = max(worst, float(np.abs(left).max() / np.abs(samples.targets[q]).max()))
        first += size
    return worst


@pytest.mark.parametrize(("structure", "bound"), [("euler", 1e-1), ("integral", 2e-2), ("spline", 3e-5)])
def test_true_coefficients_satisfy_the_regression(
    mariner: ShipModel, cao_zigzag: Trial, structure: str, bound: float
) -> None:
    samples = build_samples([cao_zigzag], mariner.table, mariner.particulars, structure)
    assert len(samples) == 1000
    assert bound / 100 < mismatch(mariner, samples) < bound


def test_irregular_samples_and_windows_satisfy_it_too(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    fine = record(zigzag(mariner, 15, 15, duration=300, dt=0.1), name="fine")
    rows = np.sort(np.random.default_rng(0).choice(len(fine), 900, replace=False))
    sparse = Trial(fine.t[rows], {name: values[rows] for name, values in fine.channels.items()})
    for window in (1, 7):
        samples = build_samples([sparse], mariner.table, mariner.particulars, window=window)
        assert mismatch(mariner, samples) < 1e-4
        assert samples.window == window


def test_trials_are_stacked_with_their_own_steps_and_never_across(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    run = zigzag(mariner, 20, 20, duration=200, dt=0.1)
    trials = [record(run, every=5, name="a"), record(run, every=10, name="b")]
    samples = build_samples(trials, mariner.table, mariner.particulars)
    assert np.bincount(samples.trial).tolist() == [400, 200]
    assert np.unique(samples.duration.round(9)).tolist() == [0.5, 1.0]
    assert mismatch(mariner, samples) < 1e-4


def test_window_follows_the_noise(mariner: ShipModel, cao_zigzag: Trial, noisy_trials: list[Trial]) -> None:
    p = mariner.particulars
    clean = build_samples([cao_zigzag], mariner.table, p)
    noisy = build_samples(noisy_trials[:1], mariner.table, p)
    assert clean.window == 1
    assert noisy.window == int(p["length"] / p["speed"] / 3.0)  # samples are 1 s apart


def test_wrong_arguments_are_named(mariner: ShipModel, cao_zigzag: Trial) -> None:
    def build(**arguments: object) -> None:
        build_samples([cao_zigzag], mariner.table, mariner.particulars, **arguments)  # type: ignore[arg-type]

    with pytest.raises(InputError, match="samples: 'cubic' found, expected one of euler, integral, spline"):
        build(samples="cubic")
    with pytest.raises(InputError, match="window: 0"):
        build(window=0)
    with pytest.raises(InputError, match="'zigzag_15_15': 1001 samples found, expected more than the window"):
        build(window=1001)
