"""Trials of the Mariner and fits to them that several tests look at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import shipgym
from identification import IdentificationResult, identify
from shipgym import ShipModel, Trial
from shipgym.manoeuvres import zigzag

MEASURED = ("x", "y", "psi", "u", "v", "r", "delta")
NOISE = {
    "x": 1.0,
    "y": 1.0,
    "psi": np.radians(0.05),
    "u": 0.03,
    "v": 0.03,
    "r": np.radians(0.01),
    "delta": np.radians(0.05),
}


def measured(
    trial: Trial, every: int = 1, noise: float = 0.0, seed: int = 0, **changes: str
) -> Trial:
    """What sensors would have recorded of a simulated trial: no orders, every so many
    samples, noise."""
    rng = np.random.default_rng(seed)
    t = trial.t[::every]
    channels = {
        name: trial[name][::every] + noise * NOISE[name] * rng.standard_normal(len(t))
        for name in MEASURED
    }
    return Trial(t, channels, kind=trial.kind, **changes)


@pytest.fixture(scope="session")
def record() -> Callable[..., Trial]:
    return measured


@pytest.fixture(scope="session")
def mariner() -> ShipModel:
    return shipgym.load_model("mariner")


@pytest.fixture(scope="session")
def cao_zigzag(mariner: ShipModel) -> Trial:
    """The 15/15 zigzag of Cao 2015: 500 s by Runge-Kutta steps of 0.1 s, recorded every
    0.5 s."""
    return measured(
        zigzag(mariner, 15, 15, duration=500, dt=0.1), every=5, name="zigzag_15_15"
    )


@pytest.fixture(scope="session")
def cao_fit(mariner: ShipModel, cao_zigzag: Trial) -> IdentificationResult:
    return identify([cao_zigzag], particulars=mariner.particulars)


@pytest.fixture(scope="session")
def noisy_trials(mariner: ShipModel) -> list[Trial]:
    """Three zigzags to fit and one to validate, with the noise of good sensors."""
    plan = [(10, 10, "fit"), (20, 20, "fit"), (30, 20, "fit"), (15, 15, "validate")]
    return [
        measured(
            zigzag(
                mariner, rudder, heading, duration=400, dt=0.1, port_first=i % 2 == 1
            ),
            every=10,
            noise=1.0,
            seed=i,
            name=f"zigzag_{rudder}_{heading}",
            use=use,
        )
        for i, (rudder, heading, use) in enumerate(plan)
    ]


@pytest.fixture(scope="session")
def noisy_fit(mariner: ShipModel, noisy_trials: list[Trial]) -> IdentificationResult:
    return identify(
        noisy_trials, particulars=mariner.particulars, steering=mariner.steering
    )
