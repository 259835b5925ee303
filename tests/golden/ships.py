"""Golden sections `derivatives` and `manoeuvres`: the physics of every ship, without an
environment.

`models.json` has ships beside the shipped ones: one of each printed structure with
made-up coefficients, and two grey boxes, as `ShipModel.save` wrote them.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, is_dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

import shipgym
from shipgym import manoeuvres
from tests.golden.store import Floats, numbers_in, vector

MORE_SHIPS = Path(__file__).parent / "models.json"
N_STATES = 20
DEPTHS = (1.3, 2.0, 5.0)  # draughts
N_DRAWS = 4  # of an identified ship in the criteria
STEPS, EVERY = 1500, 75  # of simulations, and steps between their samples
REFUSED = (shipgym.InputError, shipgym.ManoeuvreError, shipgym.UnstableModelError)


@cache
def more_ships() -> dict[str, Any]:
    """Content of the model files of ships that are not shipped, by name."""
    return dict(json.loads(MORE_SHIPS.read_text(encoding="utf-8")))


def ship_named(name: str) -> Any:
    """A shipped model, or one of `models.json`."""
    if name not in more_ships():
        return shipgym.load_model(name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.json"
        path.write_text(json.dumps(more_ships()[name]), encoding="utf-8")
        return shipgym.load_model(path)


def all_ships() -> dict[str, str]:
    """Names of all ships, by the name of their case."""
    return {name: name for name in (*shipgym.list_models(), *more_ships())}


def shipped() -> dict[str, str]:
    """Names of shipped models, by the name of their case."""
    return {name: name for name in shipgym.list_models()}


def record_derivatives(name: str) -> dict[str, Floats]:
    """Derivatives of random states, in deep and, where a ship knows it,
    shallow water."""
    model = ship_named(name)
    states, commands = random_motions(model)
    found = {"deep": model.derivatives(states, commands)}
    if name == "tanker":
        draught = model.particulars["draught"]
        found |= {
            f"depth {d:g} T": model.derivatives(states, commands, d * draught)
            for d in DEPTHS
        }
        commands[:, 1] *= -1.0
        found["astern"] = model.derivatives(states, commands)
    return {
        f"{water}: {quantity} dot": vector(column)
        for water, rates in found.items()
        for quantity, column in zip(model.state_names, rates.T, strict=True)
    }


def random_motions(model: Any) -> tuple[Floats, Floats]:
    """States and commands as ships have them, hard turns among them."""
    random = np.random.default_rng(7)
    length, speed = model.particulars["length"], model.particulars["speed"]
    rudder, shaft = np.radians(35.0), model.service_shaft_speed
    ranges = {
        "x": (-1e3, 1e3),
        "y": (-1e3, 1e3),
        "psi": (-4.0, 4.0),
        "u": (0.4 * speed, 1.1 * speed),
        "v": (-0.25 * speed, 0.25 * speed),
        "r": (-0.6 * speed / length, 0.6 * speed / length),
        "p": (-0.02, 0.02),
        "phi": (-0.3, 0.3),
        "q": (-1e-4, 1e-4),
        "delta": (-rudder, rudder),
        "n": (0.5 * shaft, 1.1 * shaft),
    }
    motions = [
        np.stack(
            [random.uniform(*ranges[quantity], N_STATES) for quantity in names], axis=-1
        )
        for names in (model.state_names, model.command_names)
    ]
    return motions[0], motions[1]


def record_manoeuvres(name: str) -> dict[str, Floats]:
    """Indices of the standard manoeuvres, criteria, trials in calm water and sea."""
    model = ship_named(name)
    found: dict[str, Floats] = {}
    judged: dict[str, Callable[[], Any]] = {
        what: lambda one=one: one.evaluate(model)
        for what, one in manoeuvres.standard_manoeuvres(model).items()
    }
    judged["zigzag 20/10 in a rough sea"] = lambda: manoeuvres.zigzag_indices(
        manoeuvres.zigzag(model, 20.0, 10.0, dt=0.5, weather="rough", seed=5)
    )
    judged["turning circle in a rough sea"] = lambda: manoeuvres.turning_indices(
        manoeuvres.turning_circle(model, 30.0, dt=0.5, weather="rough", seed=6)
    )
    draws = N_DRAWS if model.covariance is not None else 0
    judged["criteria"] = lambda: manoeuvres.imo_assessment(model, draws, seed=1)
    if name == "tanker":
        depth = 1.5 * model.particulars["draught"]
        judged |= {
            f"shallow {what}": lambda one=one: replace(
                one, sail=partial(one.sail, water_depth=depth)
            ).evaluate(model)
            for what, one in manoeuvres.standard_manoeuvres(model).items()
        }
    for what, judge in judged.items():
        found |= told(what, judge)
    for weather in (None, "rough"):
        found |= simulated(model, weather)
    return found


def told(what: str, judge: Callable[[], Any]) -> dict[str, Floats]:
    """The numbers of a judgement, or that it was refused."""
    try:
        outcome = judge()
    except REFUSED as error:
        return {f"{what}: {type(error).__name__}": vector(1.0)}
    if isinstance(outcome, Mapping):
        return numbers_in({key: one.to_dict() for key, one in outcome.items()}, what)
    return numbers_in(asdict(outcome) if is_dataclass(outcome) else outcome, what)


def simulated(model: Any, weather: str | None) -> dict[str, Floats]:
    """Samples of all channels of a trial with a swinging rudder, by the ship's own
    time."""
    dt = model.particulars["length"] / model.particulars["speed"] / 50.0
    commands = np.repeat(model.service_command[None], STEPS, axis=0)
    commands[:, 0] = np.radians(15.0) * np.sin(2.0 * np.pi * np.arange(STEPS) / 400.0)
    where = f"simulated in {weather or 'calm'}"
    try:
        trial = model.simulate(commands, dt, weather=weather, seed=11)
    except REFUSED as error:
        return {f"{where}: {type(error).__name__}": vector(1.0)}
    channels = {channel: np.asarray(trial[channel]) for channel in trial.channels}
    return {
        f"{where}: {channel}": np.append(values[::EVERY], values.mean())
        for channel, values in channels.items()
    }
