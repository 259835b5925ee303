"""Ships and autopilots as C99: a header and a source, without allocation and without dependencies."""

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
from agents.controllers.wheel_over import STEEPEST
from agents.deployment.autopilot import VARIABLES, Autopilot, bounds
from agents.deployment.translator import KEYWORDS, Translator, literal
from agents.policies.policy import ORDERS, LearnedPolicy
from shipgym import InputError, ShipModel, Weather, Wind
from shipgym.engine.mathematics import sin_cos
from shipgym.engine.motion import Motion, Push, Ship, lost, sail
from shipgym.engine.records import flat, leaves
from shipgym.sea.open_sea import Sea, SeaParameters, push, sea_functions
from shipgym.sea.weather_column import CALM, weather_column
from shipgym.ships.simulate import LONGEST_STEP
from shipgym.tasks.steering import INTEGRAL_ZONE
from shipgym.trials.units import UNITS

LONGEST_NAME = 31  # characters, so that what is made of it stays within the 63 of C99
LAWS = (
    "lq-scheduled",
    "lqg",
    "turn-rate",
    "pid-filtered",
)  # with a law of their own in the template
GUIDES = ("los", "ilos", "alos", "wheel-over")
SINGLE = "{:.9e}f".format  # a number in single precision as C writes it
Variables = dict[str, tuple[str, str, float]]  #: unit, meaning and first value


@dataclass(frozen=True)
class Source:
    """A header and a source file by a name, and what a wrapper needs to know of them."""

    name: str
    header: str
    source: str
    inputs: Variables
    outputs: Variables
    # s, of an autopilot its control interval, of a ship the longest advised step
    step: float
    ship: bool
    notes: tuple[str, ...] = ()  # what was left out, and why


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
    """A ship model as C99, by default of the model's name, in water of a depth in m.

    A ship with too few particulars for wind forces is written without them, as
    `Source.notes` says. Raises InputError for a name that C does not take, shallow
    water that the model does not know, and equations of one's own that use more than
    arithmetic.
    """
    name, compiled, p = (
        checked_name(name or model.name),
        model.compiled,
        model.particulars,
    )
    notes: tuple[str, ...] = ()
    without = set() if "n" in model.command_names else {"shaft"}
    try:
        column = weather_column(
            model, Weather(wind=Wind(1.0, 0.0, gust=False)), 1.0, water_depth
        )
    except InputError as error:
        without |= {"wind_speed", "wind_from"}
        notes, column = (f"wind is left out: {error}",), np.array(flat(CALM))
    column[leaves(SeaParameters).index("wind_speed")] = 0.0  # it is given
    types: dict[Any, str] = {Motion: f"{name}_state", ShipInput: f"{name}_input"}
    c = Translator({**compiled.hooks(), **sea_functions(True)}, name, types)
    longest = LONGEST_STEP * p["length"] / p["speed"]
    numbers = iter([*model.ship_numbers(water_depth, longest), *column])
    kinds = {"SHIP": Ship, "COEFFICIENTS": compiled.coefficients, "SEA": SeaParameters}
    first = dict(zip(model.state_names, model.service_state.tolist(), strict=True))
    begin = {
        "n": model.service_shaft_speed,
        "shaft": model.service_shaft_speed,
        **first,
    }
    known = {*ShipInput._fields, *model.state_names, *model.command_names} - without
    inputs, outputs = (
        {
            one: (*about, begin.get(one, 0.0))
            for one, about in VARIABLES[kind].items()
            if one in known
        }
        for kind in ("ship_input", "ship_state")
    )
    return _written(
        "ship",
        f"Ship model '{model.name}'",
        name,
        inputs,
        outputs,
        longest,
        constants={
            one: (c.type(kind), c.constant(kind, numbers))
            for one, kind in kinds.items()
        },
        advance=c.function(
            advance,
            Motion,
            ShipInput,
            float,
            compiled.coefficients,
            Ship,
            SeaParameters,
        )[0],
        lost=c.function(lost, Motion, Ship)[0],
        structures=c.structures,
        functions=c.functions,
        notes=notes,
        begin=c.constant(Motion, (begin.get(one, 0.0) for one in Motion._fields)),
        variables=VARIABLES,
        speed=p["speed"],
        shaft=begin["shaft"],
        limit=model.steering.limit,
    )


def autopilot_source(agent: Any, name: str | None = None) -> Source:
    """A controller or a learned policy as C99, with the integral of the heading error.

    Its law is a list of gains ("pid", "lq", one of your own with `feedback`) or one of
    `LAWS`, guidance of `GUIDES` over one of these, or a policy that commands the
    rudder, with or without one of these as its base. Raises InputError for any other
    controller, and for a name that C does not take.
    """
    policy = agent if isinstance(agent, LearnedPolicy) else None
    base = agent if policy is None else policy.base
    guide = base if isinstance(base, Guided) else None
    pilot = base if guide is None else guide.autopilot
    linear = isinstance(pilot, Controller) and type(pilot).steer is Controller.steer
    law = "linear" if linear else getattr(pilot, "kind", "")
    fault = pilot if pilot is not None and not linear and law not in LAWS else None
    if fault := guide if guide is not None and guide.kind not in GUIDES else fault:
        raise InputError(
            f"controller '{getattr(fault, 'name', type(fault).__name__)}' found, which"
            " is not a closed-form law and cannot be written as C. Export 'pid', 'lq',"
            f" {', '.join(map(repr, LAWS))}, {', '.join(map(repr, GUIDES))} over one of"
            " these, or a learned policy"
        )
    bridge = Autopilot(agent)
    inputs = {one: (*VARIABLES["autopilot_input"][one], 0.0) for one in bridge.inputs}
    outputs = {
        one: (*about, 0.0) for one, about in VARIABLES["autopilot_output"].items()
    }
    wave = (
        pilot.design.get("wave_frequency", 0.0)
        if isinstance(pilot, Controller)
        else 0.0
    )
    return _written(
        "autopilot",
        f"Autopilot '{agent.name}' for model '{agent.model_name}'",
        checked_name(name or agent.name),
        inputs,
        outputs,
        bridge.dt,
        limit=bridge.limit,
        zone=INTEGRAL_ZONE,
        reach=bridge.scales["heading_error_integral"],
        law=law,
        policy=policy,
        guide=guide,
        pilot=pilot,
        bounds=bounds(),
        orders=ORDERS,
        steepest=STEEPEST,
        memory=getattr(pilot, "memory_size", 0),
        band=notch_band(wave * bridge.dt),
    )


def _written(
    kind: str,
    title: str,
    name: str,
    inputs: Variables,
    outputs: Variables,
    step: float,
    notes: tuple[str, ...] = (),
    **data: Any,
) -> Source:
    title = re.sub(r"[^\w .,()+-]", "_", title, flags=re.ASCII)[
        :120
    ]  # what a comment of C may hold
    data |= {"title": title, "inputs": inputs, "outputs": outputs, "step": step}
    header, source = (render(f"{kind}.{suffix}.j2", name, **data) for suffix in "hc")
    return Source(name, header, source, inputs, outputs, step, kind == "ship", notes)


def checked_name(name: str) -> str:
    """A name as C takes it, other characters replaced by underscores.

    Raises InputError for one that begins with no letter, is a word of C, or is too
    long.
    """
    found = re.sub(r"\W", "_", name, flags=re.ASCII)
    if (
        not re.match("[A-Za-z]", found)
        or found in KEYWORDS
        or len(found) > LONGEST_NAME
    ):
        raise InputError(
            f"name: {name[:60]!r} found, expected at most {LONGEST_NAME} letters,"
            " digits and underscores, a letter first, and no word of C; give another"
            " with --name"
        )
    return found


def _rows(values: Any, number: Any = literal) -> str:
    """Numbers of an array as C initialises it."""
    return (
        "{"
        + ", ".join(
            number(one) if np.ndim(one) == 0 else _rows(one, number) for one in values
        )
        + "}"
    )


@cache
def _environment() -> Environment:
    folder = files("agents.deployment") / "templates"
    loader = FunctionLoader(lambda name: (folder / name).read_text(encoding="utf-8"))
    made = Environment(
        loader=loader,
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {
        "c": literal,
        "float32": SINGLE,
        "array": _rows,
        "floats": lambda one: _rows(one, SINGLE),
        "deg": lambda angle: round(np.degrees(angle), 4),
        "knots": lambda speed: round(speed / UNITS["speed"]["kn"], 4),
        "heading": lambda angle: round(np.degrees(angle) % 360.0, 4) % 360.0,
    }
    return made


def render(template: str, name: str = "", **data: Any) -> str:
    """A text of C, XML or NMEA 0183 made from a template."""
    made = _environment().get_template(template)
    return made.render(
        **data, name=name, NAME=name.upper(), version=shipgym.__version__
    )
