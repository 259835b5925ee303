"""Ship models as C99, translated from the functions that the environments compile."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.interface import model_hash
from agents.controllers.memory import from_columns
from agents.export.c_structures import Label, leaf_paths
from agents.export.c_syntax import comment
from agents.export.source import (
    Source,
    Variables,
    c_source,
    checked_name,
    render,
    variables_of,
)
from agents.export.translator import Translator
from shipgym import InputError, ShipModel, Weather, Wind
from shipgym.arrays import Floats
from shipgym.engine.mathematics import sin_cos
from shipgym.engine.motion import Motion, Push, Ship, lost, sail
from shipgym.engine.records import Record, field_types, flat, leaves
from shipgym.models.simulate import LONGEST_STEP
from shipgym.sea.open_sea import OPEN_SEA, Sea, SeaParameters, push
from shipgym.sea.weather_column import CALM, weather_column
from shipgym.ships.grey_boxes import GreyBox
from shipgym.ships.term_functions import speed_power


class ShipInput(NamedTuple):
    """Input of a ship, held over a step."""

    rudder: float  # rad, rudder order, to starboard positive
    shaft: float  # 1/s, ordered shaft speed
    current_north: float  # m/s, current
    current_east: float  # m/s, current
    wind_speed: float  # m/s, 10 m above the sea; 0: no wind forces
    wind_from: float  # rad, direction the wind comes from


SHIP_INPUTS = variables_of(ShipInput)
SHIP_STATES = variables_of(Motion)


class Parameters(NamedTuple):
    """Constants of a ship."""

    ship: Ship
    coefficients: Any
    sea: SeaParameters


def advance(
    motion: Motion, given: ShipInput, h: float, c: Any, ship: Ship, p: SeaParameters
) -> Motion:
    """State after a step in a steady current and wind, as `simulate` sails it."""
    north = given.current_north
    east = given.current_east
    pushed = Push(u=0.0, v=0.0, r=0.0, p=0.0, north=north, east=east)
    if given.wind_speed > 0.0:
        pushed = push(motion, steady_sea(given), p)
    return sail(motion, given.rudder, given.shaft, h, pushed, c, ship)


def steady_sea(given: ShipInput) -> Sea:
    """Sea of a steady current and wind, without waves or gusts."""
    sine, cosine = sin_cos(given.wind_from)
    return Sea(
        mean_north=0.0,
        mean_east=0.0,
        wind_north=cosine,
        wind_east=sine,
        waves_north=1.0,
        waves_east=0.0,
        current_north=given.current_north,
        current_east=given.current_east,
        gust=given.wind_speed,
        drift=0.0,
        heading_displacement=0.0,
        heading_velocity=0.0,
        roll_displacement=0.0,
        roll_velocity=0.0,
        psi_wave=0.0,
        r_wave=0.0,
    )


def ship_source(
    model: ShipModel,
    name: str | None = None,
    water_depth: float = np.inf,
) -> Source:
    """Write a ship model as C99, by default under the model's name.

    `water_depth`: m. A ship with too few particulars for wind forces is written without
    them, as `Source.notes` says. Raises InputError for a name that C does not take,
    shallow water that the model does not know, and equations of one's own that use more
    than arithmetic.
    """
    name = checked_name(name or model.name)
    longest = LONGEST_STEP * model.travel_time
    weather, note = _weather(model, water_depth)
    numbers = iter([*model.ship_numbers(water_depth, longest), *weather])
    p = Parameters(
        ship=from_columns(Ship, numbers),
        coefficients=from_columns(model.compiled.coefficients, numbers),
        sea=from_columns(SeaParameters, numbers),
    )
    without = {"wind_speed", "wind_from"} if note else set()
    if "n" not in model.command_names:
        without.add("shaft")
    inputs = _started(model, SHIP_INPUTS.keys() - without, SHIP_INPUTS)
    shown = {*model.state_names, *model.command_names}
    outputs = _started(model, shown, SHIP_STATES)
    c = Translator({**model.compiled.hooks(), **OPEN_SEA.functions}, name)
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
        notes=(note,) if note else (),
    )


def _translated(c: Translator, model: ShipModel, p: Parameters) -> dict[str, Any]:
    """Functions and structures of a ship in C, for the templates."""
    structures = c.structures
    start = _start(model)
    begin = Motion(*[start.get(state, 0.0) for state in Motion._fields])
    given = ShipInput(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for ending, value in (("state", begin), ("input", given)):
        structures.types[structures.kind_of(value)] = f"{structures.prefix}_{ending}"
    header = structures.declared(parameters=p)
    parameters = structures.initialiser(p)
    step = c.function(advance, begin, given, 0.0, p.coefficients, p.ship, p.sea)
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


def _weather(model: ShipModel, water_depth: float) -> tuple[Floats, str]:
    """Numbers of a weather whose wind comes later, and a note if it has no wind."""
    wind = Wind(1.0, 0.0, gust=False)
    weather = Weather(wind=wind)
    note = ""
    try:
        column = weather_column(model, weather, 1.0, water_depth)
    except InputError as error:
        note = f"wind is left out: {error}"
        column = np.array(flat(CALM))
    wind_speed = leaves(SeaParameters).index("wind_speed")
    column[wind_speed] = 0.0
    return column, note


def _start(model: ShipModel) -> dict[str, float]:
    """States and orders straight ahead at service speed, by name."""
    states = zip(model.state_names, model.service_state.tolist(), strict=True)
    shaft = float(model.service_shaft_speed)
    return {"n": shaft, "shaft": shaft, **dict(states)}


def _started(model: ShipModel, names: set[str], variables: Variables) -> Variables:
    """Variables of these names, with their values at the beginning."""
    start = _start(model)
    started = {}
    for name, variable in variables.items():
        if name in names:
            started[name] = variable._replace(start=start.get(name, 0.0))
    return started


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
            name = f"{equation}dot_{letters[:30]}"
            while name in labels:
                name += "_"
            power = 0
            if dynamics.normalisation == "prime":
                power = speed_power(equation, term)
            product = f"{term.name} U^{power}" if power else term.name
            labels[name] = Label(name, f"of {product} in the rate of {equation}")
    return list(labels.values())
