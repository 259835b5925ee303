"""Linearise steering about straight running: state space, Nomoto, course stability.

Sources: Nomoto, Taguchi, Honda & Hirano 1957, On the steering qualities of ships,
International Shipbuilding Progress 4; Fossen 2011, Handbook of Marine Craft
Hydrodynamics and Motion Control, 7.2 (second-order transfer function, T = T1 + T2 -
T3).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.models.ship_model import ShipModel

#: Largest neutral rudder, rad: beyond, a model is not that of a ship.
LARGEST_RUDDER = np.radians(20.0)
# unknowns of a balance, and the rate that each brings to 0
OTHERS = ("phi", "n", "q")
BALANCED_BY = {"u": "u", "v": "v", "delta": "r", "phi": "p", "q": "q", "n": "n"}


@dataclass(frozen=True)
class StraightRunning:
    """The steady state in which a ship holds its course."""

    # speeds along the body's axes, m/s
    surge: float
    sway: float
    rudder: float  # the neutral rudder, rad, positive to starboard
    # of heel, shaft and memory of yaw, by the names of states
    others: Mapping[str, float] = field(default_factory=dict)

    @property
    def named(self) -> dict[str, float]:
        """States by name; those that are absent are 0."""
        own = {"u": self.surge, "v": self.sway, "delta": self.rudder}
        return {**self.others, **own}

    def state(self, model: ShipModel) -> Floats:
        """The state vector, in the order of `model.state_names`, shape (n_state,)."""
        values = self.named
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


def straight_running(model: ShipModel) -> StraightRunning:
    """Speed, drift and neutral rudder at which a ship runs straight.

    A single-screw ship needs a little rudder to run straight (Mariner 1.1 degrees to
    port). Where the model's surge equation has no steady speed near service speed, that
    of service is kept. Raises InputError if the model has no straight course within
    physical drift and rudder angles.
    """
    service = model.particulars["speed"]
    unknowns = [name for name in BALANCED_BY if name in model.state_names]
    found = None
    if _feels_speed(model):
        found = _balance(model, unknowns)
    # where surge is not to be believed, the speed is kept
    if found is None or not 0.75 < found["u"] / service < 1.25:
        kept = [name for name in unknowns if name != "u"]
        found = _balance(model, kept)
    if found is None:
        most_deg = np.degrees(LARGEST_RUDDER)
        raise InputError(
            f"model {model.name!r}: expected a straight course with less than"
            f" {most_deg:.0f} deg of rudder at {service:g} m/s, got none;"
            " identify it from trials that turn to both sides, or check the sign of the"
            " rudder"
        )
    others = {name: value for name, value in found.items() if name in OTHERS}
    return StraightRunning(found["u"], found["v"], found["delta"], others)


def _feels_speed(model: ShipModel) -> bool:
    """True where surge depends on the speed, so that there is a steady one."""
    service = dict(zip(model.state_names, model.service_state.tolist(), strict=True))
    slower = service | {"u": 0.9 * service["u"]}
    return _prime_rates(model, slower)["u"] != _prime_rates(model, service)["u"]


def _balance(model: ShipModel, unknowns: list[str]) -> dict[str, float] | None:
    """State without accelerations and yaw rate, SI units; None where there is none."""
    from scipy.optimize import root

    first = dict(zip(model.state_names, model.service_state.tolist(), strict=True))
    units = _units(model)

    def state_with(deviations: Floats) -> dict[str, float]:
        changes = zip(unknowns, deviations.tolist(), strict=True)
        return first | {name: first[name] + units[name] * by for name, by in changes}

    def imbalance(deviations: Floats) -> Floats:
        rates = _prime_rates(model, state_with(deviations))
        return np.array([rates[BALANCED_BY[name]] for name in unknowns])

    solution = root(imbalance, np.zeros(len(unknowns)), tol=1e-12).x
    state = state_with(solution)
    if not np.all(np.abs(imbalance(solution)) < 1e-8):
        return None
    drifts = abs(state["v"]) >= 0.5 * model.particulars["speed"]
    if drifts or abs(state["delta"]) >= LARGEST_RUDDER:
        return None
    return state


def _units(model: ShipModel) -> dict[str, float]:
    """Unit of each state in the prime system; that of a shaft is its service speed."""
    speed = model.particulars["speed"]
    turn_rate = speed / model.particulars["length"]
    prime = {
        "u": speed,
        "v": speed,
        "r": turn_rate,
        "p": turn_rate,
        "q": turn_rate**2,
        "n": model.service_shaft_speed or 1.0,
    }
    return {name: prime.get(name, 1.0) for name in model.state_names}


def _prime_rates(model: ShipModel, state: dict[str, float]) -> dict[str, float]:
    """Rates by name at a state, prime system, shaft as in service."""
    rates = model.plain_rates(state)
    units = _units(model)
    return {name: rates[name] * model.travel_time / units[name] for name in rates}


def linearise(model: ShipModel, at: StraightRunning) -> tuple[Floats, Floats]:
    """Linear steering dynamics about a state without yaw rate, by differences.

    Speed and shaft are kept. Roll, where the model knows it, is taken to follow at
    once. Where even the smallest turns to either side differ, as with the flow at
    KVLCC2's rudder, the mean of both is taken.

    Returns A, shape (2, 2), and B, (2, 1), of d/dt (v, r) = A (v, r) + B delta:
    deviations in SI units, delta positive to starboard. In a table with a memory q of
    yaw, whose ship does not drift, q stands in place of v.
    """
    sway = "q" if "q" in model.state_names else "v"
    roll = [name for name in ("p", "phi") if name in model.state_names]
    jacobian = _jacobian(model, at, [sway, "r", *roll])
    by_inputs = jacobian[:, [0, 1, -1]]  # sway, yaw rate, rudder
    steering = by_inputs[:2]
    if roll:
        # roll is balanced, 0 = R_s s + R_p p, s = (v, r, delta): p = -R_p^-1 R_s s
        by_roll = jacobian[:, 2:-1]
        steering = steering - by_roll[:2] @ np.linalg.solve(by_roll[2:], by_inputs[2:])

    prime_units = _units(model)
    units = np.array([prime_units[name] for name in (sway, "r")])
    rates = steering * units[:, None] / model.travel_time
    A = rates[:, :2] / units
    B = rates[:, 2:]
    return A, B


def _jacobian(model: ShipModel, at: StraightRunning, names: list[str]) -> Floats:
    """Derivatives of the rates of states by these and the rudder, prime system.

    A row a rate.
    """
    step = 1e-4  # prime system; the error of central differences is its square
    units = _units(model)
    state = dict.fromkeys(model.state_names, 0.0) | at.named
    columns = []
    for name in (*names, "delta"):
        off = step * units[name]
        ahead = _prime_rates(model, state | {name: state[name] + off})
        behind = _prime_rates(model, state | {name: state[name] - off})
        columns.append([(ahead[rate] - behind[rate]) / (2.0 * step) for rate in names])
    return np.array(columns).T


@lru_cache(maxsize=16)  # a search designs on one ship often
def small_motions(model: ShipModel) -> tuple[StraightRunning, Floats, Floats]:
    """Straight running, and A and B of `linearise` about it.

    Raises InputError if the model has no straight course.
    """
    about = straight_running(model)
    A, B = linearise(model, about)
    return about, A, B


def steering_state_space(model: ShipModel) -> tuple[Floats, Floats]:
    """Linear steering dynamics about straight running: A and B of `linearise`.

    Raises InputError if the model has no straight course.
    """
    _, A, B = small_motions(model)
    return A.copy(), B.copy()


def nomoto_of(A: Floats, B: Floats) -> Nomoto:
    """Nomoto's form of d/dt (v, r) = A (v, r) + B delta (Fossen 2011, 7.40 to 7.44).

    Raises InputError if a steady rudder does not turn the ship.
    """
    determinant = float(np.linalg.det(A))
    trace = float(np.trace(A))
    # r / delta = (b_2 s + numerator) / (s^2 - trace s + determinant)
    numerator = float(A[1, 0] * B[0, 0] - A[0, 0] * B[1, 0])
    if numerator == 0.0 or determinant == 0.0:
        raise InputError(
            "nomoto: expected a ship with damping, whose rudder has a steady effect,"
            " got none"
        )
    T1 = T2 = np.nan
    poles = np.linalg.eigvals(A)
    is_real = np.isrealobj(poles)
    if is_real:
        times = -1.0 / poles
        T1, T2 = sorted(times.tolist(), key=abs, reverse=True)
    T3 = float(B[1, 0]) / numerator
    return Nomoto(
        K=numerator / determinant,
        T1=T1,
        T2=T2,
        T3=T3,
        T=-trace / determinant - T3,
    )


def nomoto(model: ShipModel) -> Nomoto:
    """Nomoto's transfer function of a ship about straight running.

    Raises InputError if the model has no straight course, or its rudder no effect.
    """
    return nomoto_of(*steering_state_space(model))


def is_course_stable(model: ShipModel) -> bool:
    """True where the ship, rudder fixed, returns to a straight course.

    Raises InputError if the model has no straight course.
    """
    A, _ = steering_state_space(model)
    return bool(np.all(np.linalg.eigvals(A).real < 0.0))
