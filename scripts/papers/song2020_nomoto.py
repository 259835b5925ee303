"""Hual Trooper's Nomoto equations of Song 2020, their zigzags and their regression."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

from shipgym.manoeuvres import zigzag
from shipgym.models import ShipModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

PARTICULARS = Particulars(
    name="Hual Trooper",
    length=190.0,
    beam=32.26,
    draught=6.9,
    block_coefficient=0.535,
    speed=20.8 * 1852.0 / 3600.0,
    rudder_area=34.1,
)
K, T, ALPHA, BETA = 0.15, 47.61, 13.27, 11087.2
#: rdot = c_r r + c_r3 r^3 + c_d delta, equations 2-16 and 3-1
TRUTH = {
    "nomoto": {"c_r": -1.0 / T, "c_d": K / T},
    "norrbin": {"c_r": -ALPHA * K / T, "c_r3": -BETA * K / T, "c_d": K / T},
}
ANGLE = {
    "nomoto": 10,
    "norrbin": 20,
}  # deg, of the zigzag: the cube of r wants a large one
DURATION, INTERVAL = 2000.0, 0.4  # s
OMEGA = 0.5  # between the printed bounds 0.1 and 1
SEED = 2020
#: Standard deviations of white noise: rate gyro, compass, rudder angle, position; rad,
#: m.
NOISE = {
    "r": np.radians(0.05),
    "psi": np.radians(0.1),
    "delta": np.radians(0.05),
    "x": 1.0,
    "y": 1.0,
}


def ship(structure: str, coefficients: Mapping[str, float] | None = None) -> ShipModel:
    """Hual Trooper by Nomoto's equation (`nomoto`), or with r^3 (`norrbin`)."""
    values = dict(coefficients or TRUTH[structure])
    return ShipModel(PARTICULARS.name, structure, PARTICULARS, SteeringGear(), values)


@cache
def trial(structure: str, noisy: bool = False) -> Trial:
    """A sampled zigzag, as it is or as instruments show it."""
    angle = ANGLE[structure]
    run = zigzag(ship(structure), angle, angle, duration=DURATION, dt=0.1)
    return logged(run, f"zigzag {angle}/{angle}", noise=NOISE if noisy else {})


def logged(
    run: Trial,
    name: str,
    constants: Mapping[str, float] | None = None,
    noise: Mapping[str, float] = NOISE,
) -> Trial:
    """A simulated zigzag as sampled, with noise and with constant channels."""
    every = round(INTERVAL / 0.1)
    channels = {
        channel: run[channel][::every].copy()
        for channel in ("x", "y", "psi", "u", "v", "r", "delta")
    }
    t = run.t[::every]
    random = np.random.default_rng(SEED)
    for channel, size in noise.items():
        channels[channel] += size * random.standard_normal(len(t))
    for channel, value in (constants or {}).items():
        channels[channel] = np.full(len(t), value)
    return Trial(t, channels, name=name, kind="zigzag", length=run.length)


def regression(structure: str, run: Trial) -> tuple[Floats, Floats]:
    """Equation 3-2: the difference of r on r, r^3 and delta at its end.

    Returns
    -------
    X : array of shape (n_samples, n_terms)
    y : array of shape (n_samples,)
    """
    r, delta = run["r"], run["delta"]
    columns = (r, delta) if structure == "nomoto" else (r, r**3, delta)
    return np.column_stack(columns)[1:], np.diff(r) / INTERVAL


def indices(coefficients: Mapping[str, float]) -> dict[str, float]:
    """K and T of the linear equation; alpha and beta of the other."""
    c_r = coefficients["c_r"]
    c_d = coefficients["c_d"]
    if "c_r3" in coefficients:
        c_r3 = coefficients["c_r3"]
        return {"alpha": -c_r / c_d, "beta": -c_r3 / c_d}
    return {"K": -c_d / c_r, "T": -1.0 / c_r}


def errors(found: Mapping[str, float], truth: Mapping[str, float]) -> dict[str, float]:
    """How far off each number is, %."""
    return {
        name: 100.0 * abs(found[name] / value - 1.0) for name, value in truth.items()
    }
