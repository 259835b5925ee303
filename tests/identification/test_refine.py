"""Output error: a model fitted to the motion that it simulates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from identification import IdentificationResult, Refinement, identify
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag


def test_without_noise_the_refinement_finds_the_ship(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    found = identify(
        [cao_zigzag],
        method=Refinement(pull=0.0),
        particulars=mariner.particulars,
        steering=mariner.steering,
    )
    truth = np.array(list(mariner.coefficients.values()))
    errors = np.array(list(found.coefficients.values())) / truth - 1.0
    assert np.median(np.abs(errors)) < 5e-3


@pytest.fixture(scope="module")
def refined_fits(
    mariner: ShipModel, record: Callable[..., Trial]
) -> dict[str, list[IdentificationResult]]:
    """Three repetitions of noisy trials, by regression and refined."""
    runs = [
        zigzag(mariner, a, b, duration=400, dt=0.1, port_first=a == 20)
        for a, b in ((10, 10), (20, 20), (30, 20))
    ]
    fits: dict[str, list[IdentificationResult]] = {"ls": [], "output-error": []}
    for seed in range(3):
        trials = [
            record(run, 10, 1.0, 10 * seed + i, name=f"zz{i}")
            for i, run in enumerate(runs)
        ]
        for method, found in fits.items():
            found.append(
                identify(
                    trials,
                    method=method,
                    particulars=mariner.particulars,
                    steering=mariner.steering,
                )
            )
    return fits


def test_refined_coefficients_are_nearer_to_the_truth(
    refined_fits: dict[str, list[IdentificationResult]], mariner: ShipModel
) -> None:
    truth = np.array(list(mariner.coefficients.values()))
    errors = {
        method: (
            np.array([list(fit.coefficients.values()) for fit in fits]) / truth - 1.0
        )
        for method, fits in refined_fits.items()
    }
    size = {
        method: np.sqrt(np.mean(error**2, axis=0)) for method, error in errors.items()
    }
    assert np.median(size["output-error"] / size["ls"]) < 0.8


def test_intervals_of_a_refined_model_hold_the_truth(
    refined_fits: dict[str, list[IdentificationResult]], mariner: ShipModel
) -> None:
    truth = np.array(list(mariner.coefficients.values()))
    hits = [
        np.abs(np.array(list(fit.coefficients.values())) - truth)
        < 1.96 * np.array(list(fit.standard_errors.values()))
        for fit in refined_fits["output-error"]
    ]
    assert np.mean(hits) > 0.88


def test_residuals_are_those_of_the_sensors_and_the_provenance_tells(
    refined_fits: dict[str, list[IdentificationResult]],
) -> None:
    for fit in refined_fits["output-error"]:
        assert fit.stable
        report = (fit.model.provenance or {})["refinement"]
        noise = {"u": 0.03, "v": 0.03, "r": np.radians(0.01), "psi": np.radians(0.05)}
        assert report["residual_rms"] == pytest.approx(noise, rel=0.1)
        assert report["decision"] == "refined"


def test_a_memory_of_yaw_cannot_be_refined(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    with pytest.raises(InputError, match=r"without a memory of yaw, .* got 'nomoto2'"):
        identify(
            [cao_zigzag],
            "nomoto2",
            "output-error",
            particulars=mariner.particulars,
        )
