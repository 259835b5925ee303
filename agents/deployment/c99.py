"""Ships and autopilots as C99: a header and a source, without allocation and without dependencies."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from jinja2 import Environment, FunctionLoader, StrictUndefined

import shipgym
from agents.deployment.translator import KEYWORDS, Translator, literal
from shipgym.engine.mathematics import sin_cos
from shipgym.engine.motion import Motion, Push, Ship, lost, sail
from shipgym.engine.records import flat, leaves
from shipgym.errors import InputError
from shipgym.sea.conditions import Weather, Wind
from shipgym.sea.open_sea import Sea, SeaParameters, push, sea_functions
from shipgym.sea.weather_column import CALM, weather_column
from shipgym.ships import ShipModel
from shipgym.ships.simulate import LONGEST_STEP

LONGEST_NAME = 63  # characters that C99 tells names apart by
#: Unit and meaning of a ship's state.
STATE = {
    "x": ("m", "north"), "y": ("m", "east"), "psi": ("rad", "heading"), "u": ("m/s", "surge"),
    "v": ("m/s", "sway"), "r": ("rad/s", "yaw rate"), "p": ("rad/s", "roll rate"), "phi": ("rad", "heel"),
    "q": ("rad/s^2", "memory of yaw"), "delta": ("rad", "rudder angle"), "n": ("1/s", "shaft speed"),
}  # fmt: skip
#: Unit and meaning of what is given to a ship.
SHIP_INPUTS = {
    "rudder": ("rad", "rudder order, positive to starboard"), "shaft": ("1/s", "ordered shaft speed"),
    "current_north": ("m/s", "current"), "current_east": ("m/s", "current"),
    "wind_speed": ("m/s", "10 m above the sea; 0: no wind forces"),
    "wind_from": ("rad", "direction the wind comes from"),
}  # fmt: skip


@dataclass(frozen=True)
class Source:
    """A header and a source file, and what a wrapper needs to know of them.

    Attributes
    ----------
    name : str
        Begins all names, and those of the files.
    header, source : str
        Their text.
    inputs, outputs, parameters : dict of str to (str, str, float)
        Unit, meaning and first value of each number that is given, read, or set before the first step.
    step : float
        s; of an autopilot its control interval, of a ship the longest advised step.
    notes : tuple of str
        What was left out, and why.
    """

    name: str
    header: str
    source: str
    inputs: dict[str, tuple[str, str, float]]
    outputs: dict[str, tuple[str, str, float]]
    parameters: dict[str, tuple[str, str, float]]
    step: float
    notes: tuple[str, ...] = ()


class ShipInput(NamedTuple):
    """What is given to a ship, held over a step; the fields of `SHIP_INPUTS`."""

    rudder: float
    shaft: float
    current_north: float
    current_east: float
    wind_speed: float
    wind_from: float


def advance(motion: Motion, given: ShipInput, h: float, c: Any, ship: Ship, p: SeaParameters) -> Motion:
    """State after a step in a steady current and wind, as `simulate` sails it."""
    sine, cosine = sin_cos(given.wind_from)
    north, east = given.current_north, given.current_east
    sea = Sea(
        0.0, 0.0, cosine, sine, 1.0, 0.0, north, east, given.wind_speed, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        0.0, 0.0,
    )  # fmt: skip
    calm = Push(0.0, 0.0, 0.0, 0.0, north, east)
    return sail(
        motion,
        given.rudder,
        given.shaft,
        h,
        push(motion, sea, p) if given.wind_speed > 0.0 else calm,
        c,
        ship,
    )


def ship_source(model: ShipModel, name: str | None = None, water_depth: float = np.inf) -> Source:
    """A ship model as C99.

    Parameters
    ----------
    model : ShipModel
        Any: a table of terms, equations of her own, a grey box.
    name : str, optional
        By which the C knows her; by default that of the model.
    water_depth : float
        m; for ships that know shallow water.

    Raises
    ------
    InputError
        For a name that C does not take, shallow water that the model does not know, and equations that use
        more than arithmetic.
    """
    name, vessel, notes, sea = checked_name(name or model.name), model.vessel, (), CALM
    try:
        weather = Weather(wind=Wind(1.0, 0.0, gust=False))
        column = weather_column(model, weather, 1.0, water_depth)
        windy = True
    except InputError as error:
        notes, windy, column = (f"wind is left out: {error}",), False, np.array(flat(sea))
    column[leaves(SeaParameters).index("wind_speed")] = 0.0  # it is given
    c = Translator(
        {**vessel.parts(), **sea_functions(True)}, name, {Motion: f"{name}_state", ShipInput: f"{name}_input"}
    )
    numbers = model.ship_numbers(water_depth)
    n_ship = len(Ship._fields)
    kinds = (Ship, vessel.coefficients, SeaParameters)
    types = [c.type(kind) for kind in kinds]
    constants = [
        c.constant(kind, part)
        for kind, part in zip(kinds, (numbers[:n_ship], numbers[n_ship:], column), strict=True)
    ]
    begin = dict(zip(model.state_names, model.service_state.tolist(), strict=True))
    begin.setdefault("n", model.service_shaft_speed)
    unused = set() if "n" in model.command_names else {"shaft"}
    unused |= set() if windy else {"wind_speed", "wind_from"}
    data = {
        "title": f"Ship model '{_one_line(model.name)}'", "name": name, "version": shipgym.__version__,
        "state": STATE, "states": model.state_names, "inputs": SHIP_INPUTS, "used": SHIP_INPUTS.keys() - unused,
        "longest_step": LONGEST_STEP * model.particulars["length"] / model.particulars["speed"],
        "speed": model.particulars["speed"], "shaft": model.service_shaft_speed,
        "rudder_limit": model.steering.limit,
        "advance": c.function(advance, [Motion, ShipInput, float, vessel.coefficients, Ship, SeaParameters])[0],
        "lost": c.function(lost, [Motion, Ship])[0],
        "structures": c.structures, "functions": c.functions,
        "ship_type": types[0], "coefficients_type": types[1], "sea_type": types[2],
        "ship": constants[0], "coefficients": constants[1], "sea": constants[2],
        "begin": c.constant(Motion, [begin.get(one, 0.0) for one in Motion._fields]),
    }  # fmt: skip
    first = {"shaft": model.service_shaft_speed}
    known = {one: STATE[one] for one in (*model.state_names, *({"n"} & set(model.command_names)))}
    return Source(
        name,
        render("ship.h.j2", **data),
        render("ship.c.j2", **data),
        inputs={
            one: (*about, first.get(one, 0.0)) for one, about in SHIP_INPUTS.items() if one not in unused
        },
        outputs={one: (*about, begin[one]) for one, about in known.items()},
        parameters={
            f"initial_{one}": (unit, f"{text} at the beginning", begin[one])
            for one, (unit, text) in known.items()
        },
        step=data["longest_step"],
        notes=notes,
    )


def _one_line(text: str) -> str:
    """A text that a comment of C may hold: letters, digits and a few signs."""
    return re.sub(r"[^\w .,()+-]", "_", text, flags=re.ASCII)[:LONGEST_NAME]


def checked_name(name: str) -> str:
    """A name as C takes it, other characters replaced by underscores.

    Raises InputError for one that begins with no letter, is a word of C, or is too long.
    """
    found = re.sub(r"\W", "_", name, flags=re.ASCII)
    if not re.match("[A-Za-z]", found) or found in KEYWORDS or len(found) > LONGEST_NAME // 2:
        raise InputError(
            f"name: {name!r} found, expected at most {LONGEST_NAME // 2} letters, digits and underscores, "
            "a letter first, and no word of C; give another with --name"
        )
    return found


@cache
def _environment() -> Environment:
    folder = files("agents.deployment") / "templates"
    loader = FunctionLoader(lambda name: (folder / name).read_text(encoding="utf-8"))
    environment = Environment(
        loader=loader, undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )  # noqa: S701 - C, not HTML
    environment.filters["c"] = literal
    return environment


def render(template: str, **data: Any) -> str:
    """A text of C or XML made from a template."""
    return _environment().get_template(template).render(**data, NAME=data["name"].upper())
