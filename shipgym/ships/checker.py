"""What is wrong with a ship model: a battery that any model, a user's own included, can be put through."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import Findings
from shipgym.errors import InputError, UnstableModelError
from shipgym.ships.catalogue import load_model
from shipgym.ships.equations import ShipEquations
from shipgym.ships.grey_boxes import GreyBox
from shipgym.ships.manoeuvring_model import ship_of
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.simulate import orders
from shipgym.ships.term_table import ANGULAR, EQUATION_NAMES, Structure
from shipgym.trials.trial import Trial

SAMPLES = 512
#: Range of the states looked at, in service speed and service speed by length.
SURGE, SWAY, YAW_RATE = (0.2, 1.1), 0.3, 0.8
ROLL_RATE, HEEL, MEMORY = (
    0.5,
    np.radians(15.0),
    0.5,
)  # the memory of yaw by (service speed by length)^2
CAPSIZED = np.radians(60.0)
STEP = 0.02  # of the time to sail a ship length
STRAIGHT_LENGTHS, TURN_LENGTHS = 30.0, 40.0
SMALL_RUDDER = np.radians(5.0)
RESPONSE_LENGTHS = 3.0
AGREEMENT = 1e-9
ASYMMETRIC = 0.1
SPEED_KEPT = (0.7, 1.3)  # straight ahead, of service speed


@dataclass(frozen=True)
class ModelCheck(Findings):
    """What a check of a model found."""

    # root mean square of the accelerations' port/starboard difference over twice their
    # own, over states that a manoeuvre passes: 0 for a symmetric ship; nan where it
    # could not be evaluated
    asymmetry: float = field(kw_only=True)

    @property
    def verdict(self) -> str:
        """Whether it is sound, and how far port and starboard differ."""
        return (
            f"{super().verdict}; port/starboard asymmetry"
            f" {100.0 * self.asymmetry:.1f} %"
        )


def check_ship_model(model: ShipModel | str | Path) -> ModelCheck:
    """Check a model for errors.

    The file and its coefficients; the inertia; accelerations over the states that a
    manoeuvre passes (finite, as the table of terms says, alike to both sides); straight
    running; the side to which the rudder turns the ship; hard turns to both sides; the
    covariance.

    Given is a model, a shipped model's name or the path of a model file. A file that
    cannot be loaded, because a coefficient is missing for instance, is a problem found.
    """
    name = str(model)
    try:
        model = model if isinstance(model, ShipModel) else load_model(model)
        name = model.name
        model.ship_numbers()
        problems = list(_wrong_accelerations(model))
    except InputError as error:  # a file, numbers or equations that cannot be used
        return ModelCheck(name, (str(error),), asymmetry=float("nan"))
    remarks: list[str] = []
    asymmetry = float("nan")
    if not problems:
        asymmetry = _asymmetry(model)
        problems += [*_wrong_courses(model), *_wrong_rudder(model)]
        remarks += _unusual(model, asymmetry)
    problems += _wrong_covariance(model)
    return ModelCheck(name, tuple(problems), tuple(remarks), asymmetry=asymmetry)


def _states(model: ShipModel) -> dict[str, Floats]:
    """States and commands over the range of hard manoeuvres, each of shape (n,), always the same."""
    random = np.random.default_rng(0)
    length, speed = model.particulars["length"], model.particulars["speed"]

    def drawn(low: float = -1.0, high: float = 1.0) -> Floats:
        return random.uniform(low, high, SAMPLES)

    u = speed * drawn(*SURGE)
    return {
        "u": u,
        "delta": model.steering.limit * drawn(),
        "v": SWAY * u * drawn(),
        "r": YAW_RATE * u / length * drawn(),
        "p": ROLL_RATE * u / length * drawn(),
        "phi": HEEL * drawn(),
        "q": MEMORY * (speed / length) ** 2 * drawn(),
        "n": np.full(SAMPLES, model.service_shaft_speed),
    }


def _rates(model: ShipModel) -> list[str]:
    """Velocities of the model, and its memory of yaw: what has an acceleration."""
    return [name for name in EQUATION_NAMES if name in model.state_names]


def _accelerations(model: ShipModel, channels: dict[str, Floats]) -> Floats:
    """Accelerations in the order of `_rates`, shape (n, n_rates)."""
    rates = model.rates(channels)
    return np.stack([rates[name] for name in _rates(model)], axis=-1)


def _wrong_accelerations(model: ShipModel) -> Iterator[str]:
    channels = _states(model)
    found = _accelerations(model, channels)
    if not np.all(np.isfinite(found)):
        row, axis = np.argwhere(~np.isfinite(found))[0]
        known = [
            name
            for name in (*EQUATION_NAMES, "phi", "delta")
            if name in model.state_names
        ]
        state = ", ".join(f"{name} = {channels[name][row]:.4g}" for name in known)
        look = "for coefficients that are far too large"
        if isinstance(model.dynamics, ShipEquations):
            there = {name: float(values[row]) for name, values in channels.items()}
            look = (
                f"at {model.dynamics.fault(there, model.coefficients, ship_of(model))}"
            )
        yield (
            f"derivatives: {found[row, axis]} found for the acceleration of"
            f" '{_rates(model)[axis]}' at {state} (SI units), expected a number; look"
            f" {look}"
        )
        return
    if isinstance(model.dynamics, Structure):
        written = _from_table(model, model.dynamics, channels)
        scale = np.abs(written).max(axis=0) + np.finfo(float).tiny
        worst = float((np.abs(found - written) / scale).max())
        if not worst < AGREEMENT:
            yield (
                f"derivatives: the compiled accelerations differ by {worst:.1e} from"
                f" those of the table, expected less than {AGREEMENT:g}; empty the"
                " cache of compiled ships"
            )


def _from_table(
    model: ShipModel, table: Structure, channels: dict[str, Floats]
) -> Floats:
    """Accelerations as sums of the table's terms, shape (n, n_rates)."""
    ship = model.particulars, model.service_shaft_speed
    found = {name: np.zeros(SAMPLES) for name in _rates(model)}
    found |= {name: -channels[name] / model.travel_time for name in "vr"}
    weights = np.split(
        table.term_numbers(model.coefficients, *ship),
        np.cumsum([len(t) for t in table.equations.values()]),
    )
    for equation, theta in zip(table.equations, weights, strict=False):
        found[equation] = table.features(equation, channels, *ship) @ theta
    if isinstance(table, GreyBox):
        for equation, known in table.converted_accelerations(channels, *ship).items():
            found[equation] = known + (
                found[equation] if equation in table.equations else 0.0
            )
    elif "q" in found:
        found["r"] = found["r"] + channels["q"]
    return np.stack([*found.values()], axis=-1)


def _asymmetry(model: ShipModel) -> float:
    """Difference of the accelerations from their mirror image over their size, all in the prime system."""
    channels = _states(model)
    odd = ("v", "r", "p", "phi", "q", "delta")
    mirrored = channels | {name: -channels[name] for name in odd}
    rates = _rates(model)
    sign = [-1.0 if name in odd else 1.0 for name in rates]
    ours, image = (
        _accelerations(model, channels),
        _accelerations(model, mirrored) * sign,
    )
    length, speed = model.particulars["length"], model.particulars["speed"]
    unit = [
        (length if q in ANGULAR else 1.0) * (length / speed if q == "q" else 1.0)
        for q in rates
    ]
    difference, size = (ours - image) * unit, (ours * unit)
    total = float(np.sqrt(np.mean(size**2)))
    return (
        float(np.sqrt(np.mean(difference**2))) / (2.0 * total) if total > 0.0 else 0.0
    )


def _run(model: ShipModel, rudder: float, lengths: float) -> Trial:
    """From service with the rudder held, over so many ship lengths at service speed."""
    return model.simulate(
        orders(model, np.full(round(lengths / STEP), rudder)), STEP * model.travel_time
    )


def _wrong_courses(model: ShipModel) -> Iterator[str]:
    limit = model.steering.limit
    courses = {
        "straight ahead": (0.0, STRAIGHT_LENGTHS),
        f"rudder {np.degrees(limit):.0f} deg to starboard": (limit, TURN_LENGTHS),
        f"rudder {np.degrees(limit):.0f} deg to port": (-limit, TURN_LENGTHS),
    }
    for name, (rudder, lengths) in courses.items():
        try:
            trial = _run(model, rudder, lengths)
            wrong, heel = (
                "",
                float(np.abs(trial["phi"]).max()) if "phi" in trial else 0.0,
            )
        except UnstableModelError as error:
            wrong, heel = str(error), abs(error.state.get("phi", 0.0))
        if not heel < CAPSIZED:
            yield (
                f"{name}: heel of {np.degrees(heel):.3g} deg found, expected less than"
                f" {np.degrees(CAPSIZED):.0f} deg: look at the terms of roll, whose"
                " coefficient of phi rights the ship where it is negative; identify it"
                " from trials with more roll"
            )
        elif wrong:
            yield (
                f"{name}: {wrong}; identify it from trials with larger rudder angles,"
                " or with fewer terms"
            )


def _wrong_rudder(model: ShipModel) -> Iterator[str]:
    if not _steers(model):
        return
    try:
        turned = [
            _run(model, side * SMALL_RUDDER, RESPONSE_LENGTHS)["r"][-1]
            for side in (1.0, -1.0)
        ]
    except UnstableModelError:
        return  # the courses say so
    if not turned[0] > turned[1]:
        port, starboard = np.degrees(turned[1]), np.degrees(turned[0])
        yield (
            f"rudder: {np.degrees(SMALL_RUDDER):.0f} deg to starboard give a yaw rate"
            f" of {starboard:.3g} deg/s, as much to port {port:.3g} deg/s, expected the"
            " first to be larger: a positive rudder turns to starboard; read the"
            " trials with rudder_positive='port', or turn the signs of the terms odd"
            " in the rudder"
        )


def _steers(model: ShipModel) -> bool:
    """Whether the model has a rudder and can turn."""
    table = model.dynamics
    return not isinstance(table, Structure) or (
        table.has_rudder and "r" in table.equations
    )


def _unusual(model: ShipModel, asymmetry: float) -> Iterator[str]:
    if asymmetry > ASYMMETRIC:
        yield (
            f"port and starboard differ by {100.0 * asymmetry:.0f} % of the"
            " accelerations: more than the propeller of a single-screw ship explains;"
            " identify from trials that begin to both sides"
        )
    if not _steers(model):
        yield "no rudder turns this model: an autopilot has nothing to do on it"
    try:
        final = (
            float(_run(model, 0.0, STRAIGHT_LENGTHS)["u"][-1])
            / model.particulars["speed"]
        )
    except UnstableModelError:
        return
    if not SPEED_KEPT[0] < final < SPEED_KEPT[1]:
        yield (
            "straight ahead with the rudder amidships its speed becomes"
            f" {100.0 * final:.0f} % of service speed: look at the terms of surge, the"
            " service speed and the shaft speed"
        )


def _wrong_covariance(model: ShipModel) -> Iterator[str]:
    if model.covariance is None:
        return
    variances = np.diag(model.covariance)
    for name, value in zip(model.coefficients, variances, strict=True):
        if not value >= 0.0:
            yield f"covariance: variance of '{name}' is {value:g}, expected at least 0"
            return
    scale = np.where(variances > 0.0, np.sqrt(variances), 1.0)
    least = float(np.linalg.eigvalsh(model.covariance / np.outer(scale, scale)).min())
    if not least > -1e-6:
        yield (
            f"covariance: least eigenvalue of the correlations {least:.2g}, expected"
            " none below 0"
        )
