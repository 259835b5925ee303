from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification import IdentificationResult, Samples, build_samples, identify
from identification.samples.integrals import (
    broken_spline,
)
from identification.samples.rudder import straight
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag
from shipgym.models.simulate import open_loop


def mismatch(model: ShipModel, samples: Samples) -> float:
    """Largest violation of the regression by the truth, by the largest change."""
    table = model.table
    theta = table.acceleration_matrix(model.particulars) @ np.array(
        list(model.coefficients.values())
    )
    worst, first = 0.0, 0
    for q in table.equations:
        size = samples.features[q].shape[1]
        left = samples.targets[q] - samples.features[q] @ theta[first : first + size]
        worst = max(worst, float(np.abs(left).max() / np.abs(samples.targets[q]).max()))
        first += size
    return worst


@pytest.mark.parametrize(
    ("structure", "bound"), [("euler", 1e-1), ("integral", 2e-2), ("spline", 3e-5)]
)
def test_true_coefficients_satisfy_the_regression(
    mariner: ShipModel, cao_zigzag: Trial, structure: str, bound: float
) -> None:
    samples = build_samples([cao_zigzag], mariner.table, mariner.particulars, structure)
    assert len(samples) == 1000
    assert bound / 100 < mismatch(mariner, samples) < bound


def test_window_follows_the_noise(
    mariner: ShipModel, cao_zigzag: Trial, noisy_trials: list[Trial]
) -> None:
    p = mariner.particulars
    clean = build_samples([cao_zigzag], mariner.table, p)
    noisy = build_samples(noisy_trials[:1], mariner.table, p)
    assert clean.window == 1
    assert noisy.window == int(p["length"] / p["speed"] / 3.0)  # samples are 1 s apart


def without(trial: Trial, *holes: tuple[float, float]) -> Trial:
    """The trial without its samples in some intervals of time."""
    kept = np.all(
        [(trial.t < start) | (trial.t >= end) for start, end in holes], axis=0
    )
    return Trial(
        trial.t[kept], {c: v[kept] for c, v in trial.channels.items()}, name="holes.csv"
    )


@pytest.mark.parametrize(
    "hole", [(100.0, 150.0), (203.0, 253.0), (120.3, 220.0), (496.0, 499.9)]
)
def test_a_hole_in_the_record_spoils_nothing(
    mariner: ShipModel,
    cao_zigzag: Trial,
    cao_fit: IdentificationResult,
    hole: tuple[float, float],
) -> None:
    broken = without(cao_zigzag, hole)
    fit = identify([broken], particulars=mariner.particulars)
    for name, value in fit.coefficients.items():
        assert value == pytest.approx(cao_fit.coefficients[name], rel=0.01), name
    truth = zigzag(mariner, 20, 20, duration=400)
    predicted = open_loop(fit.model, truth)
    assert np.abs(predicted["psi"] - truth["psi"]).max() < np.radians(0.01)


def test_a_record_of_nothing_but_gaps_is_refused(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    holes = [(start + 4.0, start + 20.0) for start in np.arange(0.0, 500.0, 20.0)]
    message = r"holes\.csv': expected 10 samples somewhere .* got 2[45] gaps"
    with pytest.raises(InputError, match=message):
        build_samples([without(cao_zigzag, *holes)], mariner.table, mariner.particulars)


@pytest.mark.parametrize(
    ("corner", "smoothness"), [(5.3, 0), (5.3, 1), (9.8, 0), (1.4, 0), (7.0, 0)]
)
def test_a_spline_breaks_where_the_rudder_does(corner: float, smoothness: int) -> None:
    """Beyond a jump of the rudder's rate a square grows, of its acceleration a cube."""
    t, fine = np.arange(13.0), np.linspace(0.0, 12.0, 241)

    def motion(times: np.ndarray) -> np.ndarray:
        return (
            2.0
            - 0.3 * times
            + 0.01 * times**3
            + np.maximum(times - corner, 0.0) ** (2 + smoothness)
        )

    smooth = straight(t, np.zeros(13))
    broken = replace(
        smooth, corners=np.array([corner]), smoothness=np.array([smoothness])
    )
    np.testing.assert_allclose(
        broken_spline(t, motion(t), broken)(fine), motion(fine), atol=1e-9
    )
    assert np.abs(broken_spline(t, motion(t), smooth)(fine) - motion(fine)).max() > 1e-3
