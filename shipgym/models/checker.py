"""Checks for any ship model, including a user's own."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError, UnstableModelError
from shipgym.findings import Findings
from shipgym.models.catalogue import load_model
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import orders
from shipgym.ships.equations import ShipEquations
from shipgym.ships.manoeuvring_model import ship_of
from shipgym.ships.term_table import Structure
from shipgym.trials.trial import Trial

STEPS = 50  # of simulations, a ship length
#: Courses, and their rudders by the limit.
SIDES = {
    "straight ahead": 0.0,
    "full rudder to starboard": 1.0,
    "full rudder to port": -1.0,
}


def check_ship_model(model: ShipModel | str | Path) -> Findings:
    """Check a model for errors.

    The file and its coefficients; the inertia; accelerations over the states that a
    manoeuvre passes (finite); straight running; the side to which
    the rudder turns the ship; hard turns to both sides; the covariance.

    Given is a model, a shipped model's name or the path of a model file. A file that
    cannot be loaded, because a coefficient is missing for instance, is a problem found.
    """
    name = str(model)
    try:
        if not isinstance(model, ShipModel):
            model = load_model(model)
        name = model.name
        model.ship_numbers()
        problems = list(_wrong_accelerations(model))
    except InputError as error:  # a file, numbers or equations that cannot be used
        return Findings(name, (str(error),))
    if problems:
        return Findings(name, tuple(problems))
    runs = {}
    for side, rudder in SIDES.items():
        try:
            runs[side] = _run(model, rudder * model.steering.limit)
        except UnstableModelError as error:
            problems.append(
                f"{side}: {error}; identify it from trials with larger rudder angles,"
                " or with fewer terms"
            )
    problems += _capsized(runs)
    if _steers(model):
        problems += _wrong_rudder(runs)
    return Findings(name, tuple(problems), tuple(_unusual(model, runs)))


def _states(model: ShipModel) -> dict[str, Floats]:
    """States and commands over the range of hard manoeuvres, each of shape (n,)."""
    random = np.random.default_rng(0)
    L = model.particulars["length"]
    U0 = model.particulars["speed"]
    samples = 512
    u = U0 * random.uniform(0.2, 1.1, samples)
    largest = {
        "delta": model.steering.limit,
        "v": 0.3 * u,
        "r": 0.8 * u / L,
        "p": 0.5 * u / L,
        "phi": np.radians(15.0),
        "q": 0.5 * (U0 / L) ** 2,
    }
    states = {"u": u, "n": np.full(samples, model.service_shaft_speed)}
    for name, amplitude in largest.items():
        states[name] = amplitude * random.uniform(-1.0, 1.0, samples)
    return states


def _wrong_accelerations(model: ShipModel) -> Iterator[str]:
    channels = _states(model)
    for rate, values in model.rates(channels).items():
        wrong = np.flatnonzero(~np.isfinite(values))
        if not wrong.size:
            continue
        row = wrong[0]
        at = {name: float(values[row]) for name, values in channels.items()}
        state = ", ".join(f"{name} = {value:.4g}" for name, value in at.items())
        yield (
            f"derivatives: expected a number for the acceleration of '{rate}' at"
            f" {state} (SI units), got {values[row]}; look {_where_to_look(model, at)}"
        )
        return


def _where_to_look(model: ShipModel, at: dict[str, float]) -> str:
    if not isinstance(model.dynamics, ShipEquations):
        return "for coefficients that are far too large"
    numbers = model.dynamics.numbers(
        model.coefficients, model.particulars, model.service_shaft_speed
    )
    return f"at {model.dynamics.fault(at, numbers.tolist(), ship_of(model))}"


def _run(model: ShipModel, rudder: float) -> Trial:
    """Run from service with the rudder held, over 40 ship lengths."""
    held = orders(model, np.full(40 * STEPS, rudder))
    return model.simulate(held, model.travel_time / STEPS)


def _capsized(runs: Mapping[str, Trial]) -> Iterator[str]:
    for side, run in runs.items():
        if "phi" not in run:
            return
        heel_deg = np.degrees(np.abs(run["phi"]).max())
        if heel_deg >= 60.0:
            yield (
                f"{side}: expected a heel of less than 60 deg, got {heel_deg:.3g} deg;"
                " look at the terms of roll, whose coefficient of phi rights the ship"
                " where it is negative; identify it from trials with more roll"
            )


def _wrong_rudder(runs: Mapping[str, Trial]) -> Iterator[str]:
    """Say if a rudder to starboard turns the ship less than one to port."""
    turned = [run["r"][3 * STEPS] for side, run in runs.items() if SIDES[side]]
    if len(turned) == 2 and not turned[0] > turned[1]:
        starboard, port = np.degrees(turned)
        yield (
            "rudder: expected a larger yaw rate to starboard than to port, got"
            f" {starboard:.3g} deg/s with full rudder to starboard and {port:.3g} deg/s"
            " to port; a positive rudder turns to starboard: read the trials with"
            " rudder_positive='port', or turn the signs of the terms odd in the rudder"
        )


def _steers(model: ShipModel) -> bool:
    """True where the model has a rudder and can turn."""
    table = model.dynamics
    return not isinstance(table, Structure) or (
        table.has_rudder and "r" in table.equations
    )


def _unusual(model: ShipModel, runs: Mapping[str, Trial]) -> Iterator[str]:
    if not _steers(model):
        yield "no rudder turns this model: an autopilot has nothing to do on it"
    ahead = runs.get("straight ahead")
    kept = 1.0 if ahead is None else ahead["u"][-1] / model.particulars["speed"]
    if not 0.7 < kept < 1.3:
        yield (
            "straight ahead with the rudder amidships its speed becomes"
            f" {100.0 * kept:.0f} % of service speed: look at the terms of surge, the"
            " service speed and the shaft speed"
        )
