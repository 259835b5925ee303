"""Ship models as C99, their equations translated from the functions that the environments compile."""

from typing import Any, NamedTuple

import numpy as np

from agents.deployment.autopilot import VARIABLES
from agents.deployment.c99 import (
    Source,
    Variable,
    Variables,
    checked_name,
    comment,
    render,
)
from agents.deployment.translator import Translator
from shipgym import InputError, ShipModel, Weather, Wind
from shipgym.arrays import Floats
from shipgym.engine.mathematics import sin_cos
from shipgym.engine.motion import Motion, Push, Ship, lost, sail
from shipgym.engine.records import flat, leaves
from shipgym.sea.open_sea import Sea, SeaParameters, push, sea_functions
from shipgym.sea.weather_column import CALM, weather_column
from shipgym.ships.simulate import LONGEST_STEP


class ShipInput(NamedTuple):
    """What is given to a ship, held over a step (`variables.toml`)."""

    rudder: float
    shaft: float
    current_north: float
    current_east: float
    wind_speed: float
    wind_from: float


def advance(
    motion: Motion, given: ShipInput, h: float, c: Any, ship: Ship, p: SeaParameters
) -> Motion:
    """State after a step in a steady current and wind, as `simulate` sails it."""
    sine, cosine = sin_cos(given.wind_from)
    north, east, zero = given.current_north, given.current_east, 0.0
    sea = Sea(
        zero,
        zero,
        cosine,
        sine,
        1.0,
        zero,
        north,
        east,
        given.wind_speed,
        zero,
        zero,
        zero,
        zero,
        zero,
        zero,
        zero,
        zero,
        zero,
    )
    pushed = (
        push(motion, sea, p)
        if given.wind_speed > 0.0
        else Push(zero, zero, zero, zero, north, east)
    )
    return sail(motion, given.rudder, given.shaft, h, pushed, c, ship)


def ship_source(
    model: ShipModel, name: str | None = None, water_depth: float = np.inf
) -> Source:
    """Write a ship model as C99, by default under the model's name, in water of a depth in m.

    A ship with too few particulars for wind forces is written without them, as
    `Source.notes` says. Raises InputError for a name that C does not take, shallow
    water that the model does not know, and equations of one's own that use more than
    arithmetic.
    """
    name = checked_name(name or model.name)
    longest = LONGEST_STEP * model.travel_time
    weather, note = _weather(model, water_depth)
    inputs, outputs = _variables(model, windy=not note)

    coefficients = model.compiled.coefficients
    c = Translator({**model.compiled.hooks(), **sea_functions(True)}, name)
    c.structures.types |= {Motion: f"{name}_state", ShipInput: f"{name}_input"}
    kinds = {"SHIP": Ship, "COEFFICIENTS": coefficients, "SEA": SeaParameters}
    numbers = iter([*model.ship_numbers(water_depth, longest), *weather])
    constants = {
        constant: (c.structures.type(kind), c.structures.initialiser(kind, numbers))
        for constant, kind in kinds.items()
    }
    step = c.function(
        advance, Motion, ShipInput, float, coefficients, Ship, SeaParameters
    )
    has_lost = c.function(lost, Motion, Ship)

    start = _start(model)
    data = {
        "title": comment(f"Ship model '{model.name}'"),
        "inputs": inputs,
        "outputs": outputs,
        "variables": VARIABLES,
        "step": longest,
        "speed": model.particulars["speed"],
        "shaft": start["shaft"],
        "limit": model.steering.limit,
        "begin": c.structures.initialiser(
            Motion, iter([start.get(one, 0.0) for one in Motion._fields])
        ),
        "constants": constants,
        "structures": c.structures.texts,
        "functions": c.functions,
        "advance": step.name,
        "lost": has_lost.name,
    }
    return Source(
        name=name,
        header=render("ship.h.j2", name, **data),
        source=render("ship.c.j2", name, **data),
        inputs=inputs,
        outputs=outputs,
        step=longest,
        ship=True,
        notes=(note,) if note else (),
    )


def _weather(model: ShipModel, water_depth: float) -> tuple[Floats, str]:
    """Numbers of a weather whose wind is given later; why there is none, where there is none."""
    wind = Weather(wind=Wind(1.0, 0.0, gust=False))
    note = ""
    try:
        column = weather_column(model, wind, 1.0, water_depth)
    except InputError as error:
        note = f"wind is left out: {error}"
        column = np.array(flat(CALM))
    column[leaves(SeaParameters).index("wind_speed")] = 0.0
    return column, note


def _start(model: ShipModel) -> dict[str, float]:
    """States and orders straight ahead at service speed, by name."""
    states = zip(model.state_names, model.service_state.tolist(), strict=True)
    shaft = float(model.service_shaft_speed)
    return {"n": shaft, "shaft": shaft, **dict(states)}


def _variables(model: ShipModel, windy: bool) -> tuple[Variables, Variables]:
    """Inputs that have an effect on a ship, and states that she has or is ordered."""
    without = set() if windy else {"wind_speed", "wind_from"}
    if "n" not in model.command_names:
        without.add("shaft")
    start = _start(model)
    inputs = {
        name: Variable(unit, meaning, start.get(name, 0.0))
        for name, (unit, meaning) in VARIABLES["ship_input"].items()
        if name not in without
    }
    outputs = {
        name: Variable(unit, meaning, start.get(name, 0.0))
        for name, (unit, meaning) in VARIABLES["ship_state"].items()
        if name in (*model.state_names, *model.command_names)
    }
    return inputs, outputs
