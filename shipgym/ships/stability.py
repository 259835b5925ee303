"""Whether a ship holds a straight course by itself: the straight-line stability of naval architecture.

Sources: Davidson & Schiff 1946, Turning and course-keeping qualities, Trans. SNAME 54; Lewis 1989,
Principles of Naval Architecture III, chapter IX, section 4 (the criterion C).
"""

from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.ships.inertia import inertia
from shipgym.ships.linear import linearise, straight_running
from shipgym.ships.ship_model import ShipModel

SIDES = {"starboard": 1, "port": -1}


@dataclass(frozen=True)
class StraightLineStability:
    """Straight-line stability with the rudder held."""

    # of sway and yaw for the smallest turns to `starboard` and to `port`, 1/s, the largest real part first.
    # They are the same for a ship alike to both sides
    eigenvalues: dict[str, tuple[complex, ...]]
    # C = Y_v (N_r - m xG) - N_v (Y_r - m) of either side, prime system: positive for a stable ship. None
    # where the particulars do not tell the mass
    criterion: dict[str, float] | None

    @property
    def index(self) -> float:
        """Largest real part of the eigenvalues of either side, 1/s: negative for a stable ship."""
        return max(values[0].real for values in self.eigenvalues.values())

    @property
    def stable(self) -> bool:
        """Whether a disturbance to either side dies out."""
        return self.index < 0.0

    @property
    def unstable_sides(self) -> tuple[str, ...]:
        """Sides to which the ship leaves her course by herself."""
        return tuple(side for side, values in self.eigenvalues.items() if not values[0].real < 0.0)


def straight_line_stability(model: ShipModel) -> StraightLineStability:
    """Straight-line stability of a ship about straight running, rudder, speed and shaft fixed, roll at once.

    The criterion is the determinant of the linear derivatives of force, which is that of the inertia times
    that of the linearised accelerations; the inertia is positive, so both tell the same. Raises InputError if
    the model has no straight course.
    """
    at = straight_running(model)
    matrices = {name: linearise(model, at, side)[0] for name, side in SIDES.items()}
    eigenvalues = {
        name: tuple(sorted(np.linalg.eigvals(A).tolist(), key=lambda value: -complex(value).real))
        for name, A in matrices.items()
    }
    return StraightLineStability(eigenvalues, _criterion(model, matrices))


def _criterion(model: ShipModel, matrices: dict[str, Floats]) -> dict[str, float] | None:
    """Determinant of the force derivatives of sway and yaw, prime system; None without sway or mass."""
    if "q" in model.state_names:
        return None
    try:
        M = inertia(model)[1:, 1:3]
        p = model.particulars.completed()
        unit = 0.5 * p.require("water_density") * p.length**3
    except InputError:
        return None
    length, speed = p.length, model.particulars["speed"]
    size = unit**2 * length**2 * (speed / length) ** 2
    return {name: float(np.linalg.det(M) * np.linalg.det(A) / size) for name, A in matrices.items()}
