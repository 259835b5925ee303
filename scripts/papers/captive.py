"""Captive tests of a ship model: the motion is prescribed, the forces are measured.

The tests are those of the planar motion mechanism (ITTC 7.5-02-06-02). The forces are
the model's inertia times what the free ship would accelerate beyond what is prescribed.
A coefficient that stands in several equations (`shipgym.ships.shared_structure`) has
one column; the rows of X, Y and N are stacked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from identification.arrays import root_mean_square
from identification.estimators.linear import Estimator
from shipgym.arrays import integral
from shipgym.models import ShipModel
from shipgym.ships.inertia import inertia
from shipgym.ships.particulars import Particulars
from shipgym.ships.shared_structure import AXES, SharedStructure
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FORCES = ("X", "Y", "N")


def oscillate(
    model: ShipModel,
    mean: ArrayLike,
    amplitude: ArrayLike,
    period_s: float,
    cycles: int = 3,
    samples: int = 200,
) -> Trial:
    """Let velocities (u, v, r), m/s and rad/s, swing about their mean as a cosine.

    The rudder is amidships. The trial has the motion and the forces X, Y (N) and N (N
    m), the ship's inertia among them.
    """
    frequency = 2.0 * np.pi / period_s
    t = period_s / samples * np.arange(cycles * samples + 1, dtype=float)
    swing = np.asarray(amplitude, dtype=float)
    velocity = np.array(mean) + np.outer(np.cos(frequency * t), swing)
    acceleration = -frequency * np.outer(np.sin(frequency * t), swing)

    u, v, r = velocity.T
    channels = {"psi": integral(t, r), "u": u, "v": v, "r": r, "delta": 0.0 * u}
    rates = model.rates(channels)
    beyond = np.zeros((len(t), 4))
    for column, axis in enumerate("uvr"):
        beyond[:, column] = rates[axis] - acceleration[:, column]
    forces = inertia(model)[:3] @ beyond.T
    channels |= zip("XYN", forces, strict=True)
    return Trial(t, channels, kind="captive", length=model.particulars["length"])


@dataclass(frozen=True, eq=False)
class ForceRegression:
    """Forces of captive tests as a linear function of the coefficients, prime system.

    Attributes
    ----------
    features : array of shape (n_rows, n_coefficients)
        The share of each coefficient; rows of all X, then all Y, then all N.
    targets : array of shape (n_rows,)
        Hydrodynamic force or moment.
    names : tuple of str
        Of the coefficients, in the order of the columns.
    equation : array of shape (n_rows,)
        0, 1, 2 for X, Y, N.
    trial : array of shape (n_rows,)
        Index of the trial.
    """

    features: Floats
    targets: Floats
    names: tuple[str, ...]
    equation: Integers
    trial: Integers

    def __len__(self) -> int:
        return len(self.targets)

    def scales(self) -> Floats:
        """Root mean square of each row's force over all tests, shape (n_rows,)."""
        own = [self.targets[self.equation == i] for i in range(len(FORCES))]
        by_force = np.array([root_mean_square(targets) for targets in own])
        return by_force[self.equation]


def force_regression(
    trials: Sequence[Trial], structure: SharedStructure, particulars: Particulars
) -> ForceRegression:
    """Stack the forces of captive tests over X, Y and N.

    Trials have the channels u, v, r, X, Y, N; accelerations are those of splines
    through the velocities, which a carriage prescribes.
    """
    ship = particulars.completed()
    motions = [_prime_motion(trial, ship) for trial in trials]
    features = [_shares(motion, structure) for motion in motions]
    targets = [
        _prime_forces(trial, motion, ship)
        for trial, motion in zip(trials, motions, strict=True)
    ]
    index = np.repeat(np.arange(len(trials)), [len(trial) for trial in trials])
    names = structure.coefficient_names
    return ForceRegression(
        features=np.concatenate(features, axis=1).reshape(-1, len(names)),
        targets=np.concatenate(targets, axis=1).ravel(),
        names=names,
        equation=np.repeat(np.arange(len(FORCES)), len(index)),
        trial=np.tile(index, len(FORCES)),
    )


def _prime_motion(trial: Trial, ship: Particulars) -> dict[str, Floats]:
    """Velocities, their sizes, and accelerations of a carriage, prime system."""
    length = ship.length
    speed = np.hypot(trial["u"], trial["v"])
    motion = {}
    for name, scale in {"u": 1.0, "v": 1.0, "r": length}.items():
        rate = CubicSpline(trial.t, trial[name])(trial.t, nu=1)
        prime = trial[name] * scale / speed
        motion[name] = prime
        motion[f"|{name}|"] = np.abs(prime)
        motion[f"{name}dot"] = rate * length / speed**2 * scale
    return motion


def _prime_forces(trial: Trial, motion: dict[str, Floats], ship: Particulars) -> Floats:
    """Hydrodynamic X, Y and N, prime system, without the inertia of the ship herself.

    Her inertia is that of a rigid body about midship (Fossen 2011, 3.3). Shape (3,
    n_samples).
    """
    speed = np.hypot(trial["u"], trial["v"])
    unit = 0.5 * ship.require("water_density") * ship.length**2 * speed**2
    m, yaw = ship.mass_prime, ship.inertia_prime
    static = m * ship.xg_prime
    u, v, r = (motion[name] for name in AXES)
    ahead = motion["udot"] - v * r
    aside = motion["vdot"] + u * r
    return np.array(
        [
            trial["X"] / unit + m * ahead - static * r * r,
            trial["Y"] / unit + m * aside + static * motion["rdot"],
            trial["N"] / unit / ship.length + yaw * motion["rdot"] + static * aside,
        ]
    )


def _shares(motion: dict[str, Floats], structure: SharedStructure) -> Floats:
    """Share of each coefficient in X, Y and N, shape (3, n_samples, n_coefficients)."""
    names = structure.coefficient_names
    found = np.zeros((len(AXES), len(motion["u"]), len(names)))
    for i, axis in enumerate(AXES):
        for share in structure.shares[axis]:
            powers = [motion[symbol] ** float(n) for symbol, n in share.term.powers]
            column = names.index(share.coefficient)
            found[i, :, column] += share.sign * np.prod(powers, axis=0)
    return found


def fit_forces(
    regression: ForceRegression, estimator: Estimator
) -> tuple[Floats, Floats]:
    """Coefficients and their covariance.

    X, Y and N weigh the same, each by its root mean square. `estimator` has no
    intercept. The covariance is for white errors of the size of each force's residuals.
    """
    scales = regression.scales()
    features = regression.features / scales[:, None]
    targets = regression.targets / scales
    estimator.fit(features, targets)

    residuals = targets - estimator.predict(features)
    half = features @ estimator.inverse_moment_
    leverages = np.sum(half * features, axis=1)
    variances = np.empty_like(targets)
    for i in range(len(FORCES)):
        own = regression.equation == i
        freedom = np.sum(1.0 - leverages[own])
        variances[own] = np.sum(residuals[own] ** 2) / freedom
    covariance = (half.T * variances) @ half
    return estimator.coef_, 0.5 * (covariance + covariance.T)
