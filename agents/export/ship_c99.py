"""Ship models as C99, translated from the functions that the environments compile."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.interface import model_hash
from agents.controllers.memory import from_columns
from agents.export.c_structures import Label, leaf_paths
from agents.export.c_syntax import comment, free
from agents.export.source import (
    Source,
    Variables,
    c_source,
    checked_name,
    render,
    variables_of,
)
from agents.export.translator import Translator
from shipgym import ShipModel
from shipgym.engine.motion import Motion, Push, Ship, lost, sail
from shipgym.engine.records import Record, field_types
from shipgym.models.simulate import LONGEST_STEP
from shipgym.ships.grey_boxes import GreyBox
from shipgym.ships.term_functions import speed_power


class ShipInput(NamedTuple):
    """Input of a ship, held over a step."""

    rudder: float  # rad, rudder order, to starboard positive
    shaft: float  # 1/s, ordered shaft speed
    current_north: float  # m/s, current
    current_east: float  # m/s, current


SHIP_INPUTS = variables_of(ShipInput)
SHIP_STATES = variables_of(Motion)


class Parameters(NamedTuple):
    """Constants of a ship."""

    ship: Ship
    coefficients: Any


def advance(motion: Motion, given: ShipInput, h: float, c: Any, ship: Ship) -> Motion:
    """State after a step in a steady current, as `simulate` sails it."""
    current = Push(0.0, 0.0, 0.0, 0.0, given.current_north, given.current_east)
    return sail(motion, given.rudder, given.shaft, h, current, c, ship)


def ship_source(
    model: ShipModel,
    name: str | None = None,
    water_depth: float = np.inf,
) -> Source:
    """Write a ship model as C99, by default under the model's name.

    `water_depth`: m. Raises InputError for a name that C does not take, shallow water
    that the model does not know, and equations of one's own that use more than
    arithmetic.
    """
    name = checked_name(name or model.name)
    longest = LONGEST_STEP * model.travel_time
    numbers = iter(model.ship_numbers(water_depth, longest))
    p = Parameters(
        ship=from_columns(Ship, numbers),
        coefficients=from_columns(model.compiled.coefficients, numbers),
    )
    without = set() if "n" in model.command_names else {"shaft"}
    inputs = _started(model, SHIP_INPUTS.keys() - without, SHIP_INPUTS)
    shown = {*model.state_names, *model.command_names}
    outputs = _started(model, shown, SHIP_STATES)
    c = Translator({**model.compiled.hooks(), "HAS_SEA": True}, name)
    c.structures.labels |= coefficient_labels(model)
    title = f"Ship model '{model.name}'"
    data = {
        "title": comment(title),
        "sha256": model_hash(model),
        "inputs": inputs,
        "outputs": outputs,
        "all_inputs": SHIP_INPUTS,
        "all_states": SHIP_STATES,
        "step": longest,
        "speed": model.particulars["speed"],
        "shaft": _start(model)["shaft"],
        "limit": model.steering.limit,
        **_translated(c, model, p),
    }
    return Source(
        name=name,
        header=render("ship.h.j2", name, **data),
        source=c_source("ship.c.j2", name, **data),
        inputs=inputs,
        outputs=outputs,
        step=longest,
        ship=True,
        title=title,
        sha256=model_hash(model),
    )


def _translated(c: Translator, model: ShipModel, p: Parameters) -> dict[str, Any]:
    """Functions and structures of a ship in C, for the templates."""
    structures = c.structures
    start = _start(model)
    begin = Motion(*[start.get(state, 0.0) for state in Motion._fields])
    given = ShipInput(0.0, 0.0, 0.0, 0.0)
    for ending, value in (("state", begin), ("input", given)):
        structures.types[structures.kind_of(value)] = f"{structures.prefix}_{ending}"
    header = structures.declared(parameters=p)
    parameters = structures.initialiser(p)
    step = c.function(advance, begin, given, 0.0, p.coefficients, p.ship)
    has_lost = c.function(lost, begin, p.ship)
    return {
        "begin": structures.initialiser(begin),
        "parameters": parameters,
        "parameter_structures": header,
        "state_paths": list(leaf_paths(begin)),
        "structures": structures.texts,
        "functions": c.functions,
        "advance": step.name,
        "lost": has_lost.name,
    }


def _start(model: ShipModel) -> dict[str, float]:
    """States and orders straight ahead at service speed, by name."""
    states = zip(model.state_names, model.service_state.tolist(), strict=True)
    shaft = float(model.service_shaft_speed)
    return {"n": shaft, "shaft": shaft, **dict(states)}


def _started(model: ShipModel, names: set[str], variables: Variables) -> Variables:
    """Variables of these names, with their values at the beginning."""
    start = _start(model)
    return {
        name: variable._replace(start=start.get(name, 0.0))
        for name, variable in variables.items()
        if name in names
    }


def coefficient_labels(model: ShipModel) -> dict[Record, Mapping[str, Label]]:
    """Names of the numbered coefficients of a ship's terms, and of her reference's."""
    dynamics: Any = model.dynamics
    record = model.compiled.coefficients
    labels: dict[Record, Mapping[str, Label]] = {}
    if isinstance(dynamics, GreyBox):
        reference: Any = dynamics.ship
        labels |= coefficient_labels(reference)
        record = field_types(record)["terms"]

    numbered = getattr(record, "_fields", ())
    if numbered and all(re.fullmatch(r"c\d+", name) for name in numbered):
        labels[record] = dict(zip(numbered, _term_labels(dynamics), strict=True))
    return labels


def _term_labels(dynamics: Any) -> list[Label]:
    """Labels of the terms of a table's equations, in order: `vdot_abs_v_r`."""
    labels: dict[str, Label] = {}
    for equation, terms in dynamics.equations.items():
        for term in terms:
            letters = re.sub(r"\|(\w+)\|", r"abs_\1_", term.name)
            letters = re.sub(r"\W", "_", letters, flags=re.ASCII).strip("_")
            name = free(f"{equation}dot_{letters[:30]}", labels)
            power = 0
            if dynamics.normalisation == "prime":
                power = speed_power(equation, term)
            product = f"{term.name} U^{power}" if power else term.name
            labels[name] = Label(
                name,
                f"of {product} in the rate of {equation}",
            )
    return list(labels.values())
