"""Checks for any ship model, including a user's own."""

from collections.abc import Iterator
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

STRAIGHT_LENGTHS = 30.0  # ship lengths of a run


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
    problems += _wrong_courses(model)
    problems += _wrong_rudder(model)
    return Findings(
        name,
        tuple(problems),
        tuple(_unusual(model)),
    )


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


def _run(model: ShipModel, rudder: float, lengths: float) -> Trial:
    """Run from service with the rudder held, over a number of ship lengths."""
    step = 0.02  # ship lengths
    n_steps = round(lengths / step)
    held = orders(model, np.full(n_steps, rudder))
    return model.simulate(held, step * model.travel_time)


def _wrong_courses(model: ShipModel) -> Iterator[str]:
    limit = model.steering.limit
    turn_lengths = 40.0
    capsized = np.radians(60.0)
    courses = {
        "straight ahead": (0.0, STRAIGHT_LENGTHS),
        f"rudder {np.degrees(limit):.0f} deg to starboard": (limit, turn_lengths),
        f"rudder {np.degrees(limit):.0f} deg to port": (-limit, turn_lengths),
    }
    for name, (rudder, lengths) in courses.items():
        try:
            trial = _run(model, rudder, lengths)
            heel = float(np.abs(trial["phi"]).max()) if "phi" in trial else 0.0
            wrong = ""
        except UnstableModelError as error:
            heel = abs(error.state.get("phi", 0.0))
            wrong = (
                f"{error}; identify it from trials with larger rudder angles, or with"
                " fewer terms"
            )
        if not heel < capsized:
            wrong = (
                f"expected a heel of less than {np.degrees(capsized):.0f} deg, got"
                f" {np.degrees(heel):.3g} deg; look at the terms of roll, whose"
                " coefficient of phi rights the ship where it is negative; identify it"
                " from trials with more roll"
            )
        if wrong:
            yield f"{name}: {wrong}"


def _wrong_rudder(model: ShipModel) -> Iterator[str]:
    """Say if a rudder to starboard turns the ship less than one to port."""
    rudder = np.radians(5.0)
    lengths = 3.0
    try:
        starboard = np.degrees(_run(model, rudder, lengths)["r"][-1])
        port = np.degrees(_run(model, -rudder, lengths)["r"][-1])
    except UnstableModelError:
        return  # the courses say so
    if _steers(model) and not starboard > port:
        yield (
            "rudder: expected a larger yaw rate for a rudder to starboard than to port,"
            f" got {starboard:.3g} deg/s for {np.degrees(rudder):.0f} deg to starboard"
            f" and {port:.3g} deg/s for as much to port; a positive rudder turns to"
            " starboard: read the trials with rudder_positive='port', or turn the signs"
            " of the terms odd in the rudder"
        )


def _steers(model: ShipModel) -> bool:
    """True where the model has a rudder and can turn."""
    table = model.dynamics
    return not isinstance(table, Structure) or (
        table.has_rudder and "r" in table.equations
    )


def _unusual(model: ShipModel) -> Iterator[str]:
    if not _steers(model):
        yield "no rudder turns this model: an autopilot has nothing to do on it"
    try:
        straight = _run(model, 0.0, STRAIGHT_LENGTHS)
    except UnstableModelError:
        return
    kept = float(straight["u"][-1]) / model.particulars["speed"]
    if not 0.7 < kept < 1.3:
        yield (
            "straight ahead with the rudder amidships its speed becomes"
            f" {100.0 * kept:.0f} % of service speed: look at the terms of surge, the"
            " service speed and the shaft speed"
        )
