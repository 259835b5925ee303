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
from agents.controllers.controller import Controller
from agents.controllers.filtered_pid import notch_band
from agents.controllers.los_autopilot import Guided
from agents.deployment.autopilot import Autopilot, bounds
from agents.deployment.translator import KEYWORDS, Translator, literal
from agents.policies.policy import ORDERS, LearnedPolicy
from shipgym.engine.mathematics import sin_cos
from shipgym.engine.motion import Motion, Push, Ship, lost, sail
from shipgym.engine.records import flat, leaves
from shipgym.errors import InputError
from shipgym.sea.conditions import Weather, Wind
from shipgym.sea.open_sea import Sea, SeaParameters, push, sea_functions
from shipgym.sea.weather_column import CALM, weather_column
from shipgym.ships import ShipModel
from shipgym.ships.simulate import LONGEST_STEP
from shipgym.tasks.steering import INTEGRAL_ZONE

LONGEST_NAME = 31  # characters, so that what is made of it stays within the 63 of C99
LAWS = ("lq-scheduled", "lqg", "pid-filtered")  # with a law of their own in the template
#: Unit and meaning of a ship's state, and of what is given to her.
STATE = {
    "x": ("m", "north"), "y": ("m", "east"), "psi": ("rad", "heading"), "u": ("m/s", "surge"),
    "v": ("m/s", "sway"), "r": ("rad/s", "yaw rate"), "p": ("rad/s", "roll rate"), "phi": ("rad", "heel"),
    "q": ("rad/s2", "memory of yaw"), "delta": ("rad", "rudder angle"), "n": ("1/s", "shaft speed"),
}  # fmt: skip
SHIP_INPUTS = {
    "rudder": ("rad", "rudder order, to starboard positive"), "shaft": ("1/s", "ordered shaft speed"),
    "current_north": ("m/s", "current"), "current_east": ("m/s", "current"),
    "wind_speed": ("m/s", "10 m above the sea; 0: no wind forces"),
    "wind_from": ("rad", "direction the wind comes from"),
}  # fmt: skip


class Variable(NamedTuple):
    """A number that is given to what was exported, or read of it."""

    unit: str
    about: str
    start: float = 0.0


@dataclass(frozen=True)
class Source:
    """A header and a source file by a name, and what a wrapper needs to know of them."""

    name: str
    header: str
    source: str
    inputs: dict[str, Variable]
    outputs: dict[str, Variable]
    #: of an autopilot its control interval, of a ship the longest advised step, s
    step: float
    ship: bool
    notes: tuple[str, ...] = ()  # what was left out, and why


class ShipInput(NamedTuple):
    """What is given to a ship, held over a step (`SHIP_INPUTS`)."""

    rudder: float
    shaft: float
    current_north: float
    current_east: float
    wind_speed: float
    wind_from: float


def advance(motion: Motion, given: ShipInput, h: float, c: Any, ship: Ship, p: SeaParameters) -> Motion:
    """State after a step in a steady current and wind, as `simulate` sails it."""
    sine, cosine = sin_cos(given.wind_from)
    north, east, zero = given.current_north, given.current_east, 0.0
    sea = Sea(
        zero, zero, cosine, sine, 1.0, zero, north, east, given.wind_speed, zero, zero, zero, zero, zero,
        zero, zero, zero, zero,
    )  # fmt: skip
    pushed = push(motion, sea, p) if given.wind_speed > 0.0 else Push(zero, zero, zero, zero, north, east)
    return sail(motion, given.rudder, given.shaft, h, pushed, c, ship)


def ship_source(model: ShipModel, name: str | None = None, water_depth: float = np.inf) -> Source:
    """A ship model as C99: a table of terms, equations of her own, a grey box.

    Parameters
    ----------
    model : ShipModel
        The ship; with particulars too few for wind forces, these are left out.
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
    name, vessel, p = checked_name(name or model.name), model.vessel, model.particulars
    notes: tuple[str, ...] = ()
    try:
        column = weather_column(model, Weather(wind=Wind(1.0, 0.0, gust=False)), 1.0, water_depth)
    except InputError as error:
        notes, column = (f"wind is left out: {error}",), np.array(flat(CALM))
    column[leaves(SeaParameters).index("wind_speed")] = 0.0  # it is given
    c = Translator(
        {**vessel.parts(), **sea_functions(True)}, name, {Motion: f"{name}_state", ShipInput: f"{name}_input"}
    )
    numbers = iter([*model.ship_numbers(water_depth), *column])
    kinds = {"SHIP": Ship, "COEFFICIENTS": vessel.coefficients, "SEA": SeaParameters}
    begin = dict(zip(model.state_names, model.service_state.tolist(), strict=True))
    begin.setdefault("n", model.service_shaft_speed)
    without = ({"shaft"} - {"shaft"} if "n" in model.command_names else {"shaft"}) | (
        {"wind_speed", "wind_from"} if notes else set()
    )
    used = {one: Variable(*about) for one, about in SHIP_INPUTS.items() if one not in without}
    if "shaft" in used:
        used["shaft"] = used["shaft"]._replace(start=begin["n"])
    shown = [one for one in Motion._fields if one in model.state_names or (one == "n" and "shaft" in used)]
    step = LONGEST_STEP * p["length"] / p["speed"]
    data = {
        "constants": {one: (c.type(kind), c.constant(kind, numbers)) for one, kind in kinds.items()},
        "advance": c.function(advance, Motion, ShipInput, float, vessel.coefficients, Ship, SeaParameters)[0],
        "lost": c.function(lost, Motion, Ship)[0],
        "begin": c.constant(Motion, (begin.get(one, 0.0) for one in Motion._fields)),
        "state": STATE, "states": model.state_names, "inputs": SHIP_INPUTS, "used": used, "step": step,
        "speed": p["speed"], "shaft": begin["n"], "limit": model.steering.limit,
        "structures": c.structures, "functions": c.functions,
    }  # fmt: skip
    title = f"Ship model '{_comment(model.name)}'"
    header, source = (render(f"ship.{kind}.j2", name, title=title, **data) for kind in "hc")
    outputs = {one: Variable(*STATE[one], begin[one]) for one in shown}
    return Source(name, header, source, used, outputs, step, True, notes)


def autopilot_source(agent: Any, name: str | None = None) -> Source:
    """A controller or a learned policy as C99, with the integral of the heading error.

    Parameters
    ----------
    agent : Controller or LearnedPolicy
        One whose law is a list of gains ("pid", "lq", one of your own with `feedback`), "lq-scheduled",
        "lqg", "pid-filtered", guidance over one of these, or a policy that commands the rudder, with or
        without one of these as its base.
    name : str, optional
        By which the C knows it; by default that of the controller.

    Raises
    ------
    InputError
        For any other controller, and for a name that C does not take.
    """
    policy = agent if isinstance(agent, LearnedPolicy) else None
    base = agent if policy is None else policy.base
    guide = base if isinstance(base, Guided) else None
    pilot = base if guide is None else guide.autopilot
    linear = isinstance(pilot, Controller) and type(pilot).steer is Controller.steer
    if pilot is not None and not linear and getattr(pilot, "kind", "") not in LAWS:
        raise InputError(
            f"controller '{getattr(pilot, 'name', type(pilot).__name__)}': found, which cannot be written as C: it is "
            f"no closed law. Export one of 'pid', 'lq', {', '.join(map(repr, LAWS))}, 'los', 'ilos' or 'alos' "
            "over one of these, or a learned policy"
        )
    name, bridge = checked_name(name or agent.name), Autopilot(agent)
    memory = getattr(pilot, "memory_size", 0)
    wave = pilot.design.get("wave_frequency", 0.0) if isinstance(pilot, Controller) else 0.0
    data = {
        "inputs": bridge.inputs, "dt": bridge.dt, "limit": bridge.limit, "zone": INTEGRAL_ZONE,
        "reach": bridge.scales["heading_error_integral"], "policy": policy, "guide": guide, "pilot": pilot,
        "law": "linear" if linear else getattr(pilot, "kind", ""), "memory": memory, "bounds": bounds(),
        "band": notch_band(wave * bridge.dt), "orders": ORDERS,
    }  # fmt: skip
    title = f"Autopilot '{_comment(agent.name)}' for model '{_comment(agent.model_name)}'"
    header, source = (render(f"autopilot.{kind}.j2", name, title=title, **data) for kind in "hc")
    inputs = {one: Variable(*about) for one, about in bridge.inputs.items()}
    order = {"order": Variable("rad", "ordered rudder, to starboard positive")}
    return Source(name, header, source, inputs, order, bridge.dt, False)


def _comment(text: str) -> str:
    """A text that a comment of C may hold: letters, digits and a few signs."""
    return re.sub(r"[^\w .,()+-]", "_", text, flags=re.ASCII)[:60]


def checked_name(name: str) -> str:
    """A name as C takes it, other characters replaced by underscores.

    Raises InputError for one that begins with no letter, is a word of C, or is too long.
    """
    found = re.sub(r"\W", "_", name, flags=re.ASCII)
    if not re.match("[A-Za-z]", found) or found in KEYWORDS or len(found) > LONGEST_NAME:
        raise InputError(
            f"name: {name[:60]!r} found, expected at most {LONGEST_NAME} letters, digits and underscores, "
            "a letter first, and no word of C; give another with --name"
        )
    return found


def _single(value: float) -> str:
    """A number in single precision as C writes it."""
    text = f"{float(value):.9g}"
    return f"{text}f" if set(text) & set(".e") else f"{text}.0f"


def _rows(values: Any, number: Any) -> str:
    """Numbers of an array as C initialises it."""
    return "{" + ", ".join(number(one) if np.ndim(one) == 0 else _rows(one, number) for one in values) + "}"


@cache
def _environment() -> Environment:
    folder = files("agents.deployment") / "templates"
    loader = FunctionLoader(lambda name: (folder / name).read_text(encoding="utf-8"))
    made = Environment(loader=loader, undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
    made.filters |= {
        "c": literal, "float32": _single, "array": lambda values: _rows(values, literal),
        "floats": lambda values: _rows(values, _single),
    }  # fmt: skip
    return made


def render(template: str, name: str, **data: Any) -> str:
    """A text of C or XML made from a template."""
    made = _environment().get_template(template)
    return made.render(**data, name=name, NAME=name.upper(), version=shipgym.__version__)
