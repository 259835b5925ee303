"""Captive tests of a ship model: the motion is prescribed, the forces are measured.

The tests are those of the planar motion mechanism (ITTC 7.5-02-06-02). The forces are
the model's inertia times what the free ship would accelerate beyond what is prescribed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.models.forces import rigid_body_forces
from shipgym.arrays import integral
from shipgym.models import ShipModel
from shipgym.ships.inertia import inertia, rigid_inertia
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]


def oscillate(
    model: ShipModel,
    mean: ArrayLike,
    amplitude: ArrayLike,
    period_s: float,
    cycles: int = 3,
    samples: int = 200,
    model_inertia: bool = True,
) -> Trial:
    """Let velocities (u, v, r), m/s and rad/s, swing about their mean as a cosine."""
    frequency = 2.0 * np.pi / period_s
    t = period_s / samples * np.arange(cycles * samples + 1, dtype=float)
    swing = np.asarray(amplitude, dtype=float)
    velocity = np.array(mean) + np.outer(np.cos(frequency * t), swing)
    acceleration = -frequency * np.outer(np.sin(frequency * t), swing)
    return tow(model, t, velocity, acceleration, model_inertia)


def tow(
    model: ShipModel,
    t: Floats,
    velocity: Floats,
    acceleration: Floats,
    model_inertia: bool = True,
) -> Trial:
    """Tow a ship, rudder amidships; velocities and their rates of shape (n, 3).

    Returns the trial with the motion and the forces X, Y (N) and N (N m); without
    `model_inertia` those of the water alone.
    """
    u, v, r = velocity.T
    channels = {"psi": integral(t, r), "u": u, "v": v, "r": r, "delta": 0.0 * u}
    rates = model.rates(channels)
    beyond = np.zeros((len(t), 4))
    for column, axis in enumerate("uvr"):
        beyond[:, column] = rates[axis] - acceleration[:, column]
    forces = inertia(model) @ beyond.T
    if not model_inertia:
        rigid = rigid_inertia(model)
        forces += rigid_body_forces(rigid, velocity.T, acceleration.T)
    channels |= zip("XYN", forces, strict=True)
    return Trial(t, channels, kind="captive", length=model.particulars["length"])
