"""Steering linearised about straight running: state space, Nomoto's forms and course stability.

Sources: Nomoto, Taguchi, Honda & Hirano 1957, On the steering qualities of ships,
International Shipbuilding Progress 4; Fossen 2011, Handbook of Marine Craft
Hydrodynamics and Motion Control, 7.2 (second-order transfer function, T = T1 + T2 -
T3). Whether a ship holds a straight course by itself: Davidson & Schiff 1946, Turning
and course-keeping qualities, Trans. SNAME 54; Lewis 1989, Principles of Naval
Architecture III, chapter IX, section 4 (the criterion C).
"""

from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.ships.inertia import inertia
from shipgym.ships.ship_model import ShipModel

STEP = 1e-4  # of the finite differences, prime system; the error is its square
SLOWEST, FASTEST = (
    0.75,
    1.25,
)  # speed of straight running over service speed where surge is to be believed
LARGEST_RUDDER = np.radians(
    20.0
)  # neutral rudder beyond which a model is not that of a ship
LARGEST_SWAY = 0.5  # over service speed, likewise
AT_REST = 1e-8  # prime acceleration that counts as zero
SIDES = {"starboard": 1, "port": -1}
# rate that each unknown brings to 0
BALANCED_BY = {"u": "u", "v": "v", "delta": "r", "phi": "p", "q": "q", "n": "n"}


@dataclass(frozen=True)
class StraightRunning:
    """The steady state in which a ship holds its course."""

    # speeds along the body's axes, m/s
    surge: float
    sway: float
    rudder: float  # the neutral rudder, rad, positive to starboard
    heel: float = 0.0  # rad, starboard down; 0 where the model knows no roll
    shaft_speed: float = 0.0  # 1/s; 0 where the model's shaft has no dynamics
    memory: float = (
        0.0  # yaw acceleration that a table with a memory `q` keeps, rad/s^2
    )

    def state(self, model: ShipModel) -> Floats:
        """The state vector, in the order of `model.state_names`, shape (n_state,)."""
        values = {
            "u": self.surge,
            "v": self.sway,
            "delta": self.rudder,
            "phi": self.heel,
            "n": self.shaft_speed,
            "q": self.memory,
        }
        return np.array([values.get(name, 0.0) for name in model.state_names])


@dataclass(frozen=True)
class Nomoto:
    """Nomoto's transfer function from rudder to yaw rate, positive to starboard.

        r / delta = K (1 + T3 s) / ((1 + T1 s) (1 + T2 s)),    about    K / (1 + T s).

    K and T are positive for a ship stable on its course and negative for one that is
    not.
    """

    K: float  # gain, 1/s
    # time constants, the larger magnitude first, s; nan where the poles are a complex
    # pair
    T1: float
    T2: float
    T3: float  # time constant of the zero, s
    T: float  # time constant of the first-order form, T1 + T2 - T3, s

    @property
    def rudder_effect(self) -> float:
        """K / T, 1/s^2: yaw acceleration per rudder angle in the first-order form."""
        return self.K / self.T


def straight_running(model: ShipModel, speed: float | None = None) -> StraightRunning:
    """Speed, drift and neutral rudder at which a ship runs straight.

    A single-screw ship needs a little rudder to run straight (Mariner 1.1 degrees to
    port). Where the model's surge equation has no steady speed near service speed, that
    of service is kept; so is `speed`, m/s, where given, with the shaft as at service
    speed: a ship that has lost speed in a turn or in weather. Raises InputError if the
    model has no straight course within physical drift and rudder angles.
    """
    found = None
    if speed is None:
        found = _balance(
            model, [name for name in BALANCED_BY if name in model.state_names]
        )
    if found is None or not SLOWEST < found["u"] / model.particulars["speed"] < FASTEST:
        others = [
            name for name in BALANCED_BY if name in model.state_names and name != "u"
        ]
        found = _balance(model, others, speed)
    if found is None:
        held = speed or model.particulars["speed"]
        raise InputError(
            f"model {model.name!r}: no straight course found with less than "
            f"{np.degrees(LARGEST_RUDDER):.0f} deg of rudder at {held:g} m/s; identify "
            "it from trials that turn to both sides, or check the sign of the rudder"
        )
    rest = (found.get(name, 0.0) for name in ("phi", "n", "q"))
    return StraightRunning(found["u"], found["v"], found["delta"], *rest)


def steady_turn_rudder(
    model: ShipModel, rate: float, slowed: bool = True
) -> float | None:
    """Rudder angle, rad, of the steady turn at a yaw rate, rad/s; None if none is found.

    `slowed`: whether the ship loses speed as her surge equation has it, or keeps that
    of service.
    """
    unknowns = [
        name
        for name in BALANCED_BY
        if name in model.state_names and (slowed or name != "u")
    ]
    found = _balance(model, unknowns, rate=rate, drift=1.0)
    return found["delta"] if found is not None and found.get("u", 1.0) > 0.0 else None


def _balance(
    model: ShipModel,
    unknowns: list[str],
    speed: float | None = None,
    rate: float = 0.0,
    drift: float = LARGEST_SWAY,
) -> dict[str, float] | None:
    """State without accelerations at a yaw rate, found from a speed by changing the unknowns; SI units.

    `drift`: largest sway over service speed; a state in a turn may have more rudder
    than straight running.
    """
    from scipy.optimize import root

    columns = [model.state_names.index(name) for name in unknowns]
    balances = [model.state_names.index(BALANCED_BY[name]) for name in unknowns]
    scales = _scales(model)

    def state_with(deviations: Floats) -> Floats:
        state = model.service_state.copy()
        if speed is not None and "u" in model.state_names:
            state[model.state_names.index("u")] = speed
        state[model.state_names.index("r")] = rate
        state[columns] += deviations * scales[columns]
        return state

    def imbalance(deviations: Floats) -> Floats:
        return _rates(model, state_with(deviations))[balances]

    found = root(imbalance, np.zeros(len(unknowns)), tol=1e-12)
    state = dict(zip(model.state_names, state_with(found.x).tolist(), strict=True))
    at_rest = bool(np.all(np.abs(imbalance(found.x)) < AT_REST))
    small = abs(state["v"]) < drift * model.particulars["speed"]
    return (
        state
        if at_rest and small and (rate or abs(state["delta"]) < LARGEST_RUDDER)
        else None
    )


def _scales(model: ShipModel) -> Floats:
    """Unit of each state in the prime system (the shaft's: its service speed), shape (n_state,)."""
    length, speed = model.particulars["length"], model.particulars["speed"]
    units = {
        "u": speed,
        "v": speed,
        "r": speed / length,
        "p": speed / length,
        "q": (speed / length) ** 2,
        "n": model.service_shaft_speed or 1.0,
    }
    return np.array([units.get(name, 1.0) for name in model.state_names])


def _rates(model: ShipModel, states: Floats) -> Floats:
    """Prime time derivatives of states (..., n_state), the rudder held and the shaft at service speed."""
    commands = np.broadcast_to(
        model.service_command, (*states.shape[:-1], len(model.command_names))
    ).copy()
    rudder = states[..., model.state_names.index("delta")]
    commands[..., 0] = np.clip(
        rudder, -0.5 * np.pi, 0.5 * np.pi
    )  # a search may go beyond any rudder
    return np.asarray(
        model.derivatives(states, commands) * model.travel_time / _scales(model)
    )


def linearise(
    model: ShipModel, at: StraightRunning, side: int = 0
) -> tuple[Floats, Floats]:
    """Linear steering dynamics about a state without yaw rate, by differences.

    Speed and shaft are kept. Roll, where the model knows it, is taken to follow at
    once. Where even the smallest turns to either side differ, as with the flow at
    KVLCC2's rudder, the mean of both is taken (`side` 0), or the turns to starboard (1)
    or to port (-1).

    Returns A, shape (2, 2), and B, (2, 1), of d/dt (v, r) = A (v, r) + B delta:
    deviations in SI units, delta positive to starboard. In a table with a memory q of
    yaw, whose ship does not drift, q stands in place of v.
    """
    first = "q" if "q" in model.state_names else "v"
    names = (first, "r", *(name for name in ("p", "phi") if name in model.state_names))
    varied = [model.state_names.index(name) for name in (*names, "delta")]
    n = len(names)
    scales = _scales(model)
    signs = side * np.array([-1.0] + n * [1.0]) if side else np.ones(n + 1)
    steps = np.zeros((n + 1, len(scales)))
    steps[range(n + 1), varied] = STEP * signs * scales[varied]
    state = at.state(model)
    behind = np.tile(state, (n + 1, 1)) if side else state - steps
    change = (_rates(model, state + steps) - _rates(model, behind))[:, varied[:n]]
    jacobian = change.T / (STEP * signs * (1.0 if side else 2.0))
    if n > 2:
        follows = np.linalg.solve(jacobian[2:, 2:n], jacobian[2:][:, [0, 1, n]])
        jacobian = jacobian[:2][:, [0, 1, n]] - jacobian[:2, 2:n] @ follows
    units = scales[varied[:2]]
    per_time = model.particulars["speed"] / model.particulars["length"]
    A = per_time * units[:, None] * jacobian[:, :2] / units
    B = per_time * units[:, None] * jacobian[:, 2:]
    return A, B


def steering_state_space(
    model: ShipModel, speed: float | None = None
) -> tuple[Floats, Floats]:
    """Linear steering dynamics about straight running: A and B of `linearise`.

    Speed in m/s, the service speed by default. Raises InputError if the model has no
    straight course.
    """
    return linearise(model, straight_running(model, speed))


def nomoto_of(A: Floats, B: Floats) -> Nomoto:
    """Nomoto's form of d/dt (v, r) = A (v, r) + B delta (Fossen 2011, equations 7.40 to 7.44).

    Raises InputError if a steady rudder does not turn the ship.
    """
    determinant, trace = float(np.linalg.det(A)), float(np.trace(A))
    numerator = float(A[1, 0] * B[0, 0] - A[0, 0] * B[1, 0])
    if numerator == 0.0 or determinant == 0.0:
        raise InputError(
            "nomoto: the rudder has no steady effect on the ship, or the ship no"
            " damping"
        )
    poles = np.linalg.eigvals(A)
    time_constants = -1.0 / poles if np.all(np.isreal(poles)) else np.full(2, np.nan)
    T1, T2 = sorted(np.real(time_constants).tolist(), key=abs, reverse=True)
    T3 = float(B[1, 0]) / numerator
    return Nomoto(
        K=numerator / determinant, T1=T1, T2=T2, T3=T3, T=-trace / determinant - T3
    )


def nomoto(model: ShipModel) -> Nomoto:
    """Nomoto's transfer function of a ship about straight running.

    Raises InputError if the model has no straight course, or its rudder no effect.
    """
    return nomoto_of(*steering_state_space(model))


def is_course_stable(model: ShipModel) -> bool:
    """Whether the ship, with the rudder fixed, comes back to a straight course after a disturbance.

    Raises InputError if the model has no straight course.
    """
    A, _ = steering_state_space(model)
    return bool(np.all(np.linalg.eigvals(A).real < 0.0))


@dataclass(frozen=True)
class StraightLineStability:
    """Straight-line stability with the rudder held."""

    # of sway and yaw for the smallest turns to `starboard` and to `port`, 1/s, the
    # largest real part first. They are the same for a ship alike to both sides
    eigenvalues: dict[str, tuple[complex, ...]]
    # C = Y_v (N_r - m xG) - N_v (Y_r - m) of either side, prime system: positive for a
    # stable ship. None where the particulars do not tell the mass
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
        return tuple(
            side
            for side, values in self.eigenvalues.items()
            if not values[0].real < 0.0
        )


def straight_line_stability(model: ShipModel) -> StraightLineStability:
    """Straight-line stability of a ship about straight running, rudder, speed and shaft fixed, roll balanced.

    The criterion is the determinant of the linear derivatives of force, which is that
    of the inertia times that of the linearised accelerations; the inertia is positive,
    so both tell the same. Raises InputError if the model has no straight course.
    """
    at = straight_running(model)
    matrices = {name: linearise(model, at, side)[0] for name, side in SIDES.items()}
    eigenvalues = {
        name: tuple(
            sorted(
                np.linalg.eigvals(A).tolist(), key=lambda value: -complex(value).real
            )
        )
        for name, A in matrices.items()
    }
    return StraightLineStability(eigenvalues, _criterion(model, matrices))


def _criterion(
    model: ShipModel, matrices: dict[str, Floats]
) -> dict[str, float] | None:
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
    return {
        name: float(np.linalg.det(M) * np.linalg.det(A) / size)
        for name, A in matrices.items()
    }
