"""A controller as it stands on a bridge: numbers of one ship in SI units in, the ordered rudder out."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.los_autopilot import Guided
from agents.controllers.memory import gathered
from agents.controllers.wheel_over import COURSE_ERROR
from shipgym import InputError
from shipgym.engine.records import field_types
from shipgym.files import read_toml
from shipgym.tasks import path_following
from shipgym.tasks.contract import Seen
from shipgym.tasks.guidance import wrapped
from shipgym.tasks.steering import Extras, Helm
from shipgym.tasks.task import rounded_interval

#: Unit and meaning of variables by name, of ships and autopilots.
VARIABLES = read_toml(Path(__file__).with_name("variables.toml"), "table of variables")
INPUTS = VARIABLES["autopilot_input"]
#: Observations that an autopilot makes itself.
OWN = (
    "heading_error_sin",
    "heading_error_cos",
    "last_command",
    "heading_error_integral",
)


def _reads(agent: Any) -> set[str]:
    """What a controller reads of the ship beside her heading."""
    if isinstance(agent, Guided):
        return {*agent.reads, *agent.turns_ahead} | _reads(agent.autopilot)
    if not isinstance(agent, Controller):
        base = getattr(agent, "base", None)
        seen = {*agent.observation_names, *(() if base is None else _reads(base))} - {
            *OWN
        }
        return {"course" if one in COURSE_ERROR else one for one in seen}
    if type(agent).steer is not Controller.steer:
        return {*agent.reads}
    used = [signal for gain, (signal, _) in agent.feedback.items() if agent.gains[gain]]
    return {one for one in used if one in INPUTS}


@cache
def bounds() -> dict[str, tuple[float, float]]:
    """Bounds of observations by name, in multiples of their scale."""
    records = Helm, Extras, path_following.Observation
    notes = [
        note for record in records for note in field_types(record, notes=True).items()
    ]
    seen = [
        (name, one) for name, note in notes for one in getattr(note, "__metadata__", ())
    ]
    return {name: (one.low, one.high) for name, one in seen if isinstance(one, Seen)}


class Autopilot:
    """Any controller or policy, stepped once in each control interval `dt` in double precision.

    It adds what an environment would: the integral of the heading error, and the last
    command. `inputs` names what it reads. Guidance is given the direction of the path
    beside the ship as its set-point, a policy that learned to follow paths the course
    that its environment shows: of legs without arcs the leg's less atan(cross-track
    error / lookahead).

    Raises InputError for a policy that commands the shaft too, or reads what no ship is
    known to show.
    """

    def __init__(self, agent: Any) -> None:
        names = {"set_point", "heading", *_reads(agent)}
        if (
            getattr(agent, "action", "rudder") == "rudder-shaft"
            or not names <= INPUTS.keys()
        ):
            raise InputError(
                "autopilot: a policy that commands"
                f" {getattr(agent, 'action', 'rudder')} and reads"
                f" {', '.join(sorted(names))[:200]} found, expected rudder alone, by"
                f" {', '.join(INPUTS)}"
            )
        self.agent, self.inputs = agent, [name for name in INPUTS if name in names]
        self.pilot: Any = agent.autopilot if isinstance(agent, Guided) else agent
        self.scales = dict(
            zip(agent.observation_names, agent.observation_scales, strict=True)
        )
        self.limit, given = (
            float(self.scales["rudder"]),
            getattr(agent, "env_options", {}).get("dt"),
        )
        self.largest = self.limit  # of its orders, rad; may be set lower
        self.dt = float(
            given or rounded_interval(1.0 / self.scales["yaw_rate"])
        )  # of the environment
        if isinstance(agent, Controller):
            self.dt = float(agent.design["dt"])
        self.begins, self.integral, self.last_command = True, 0.0, 0.0
        self.guided = np.zeros(
            (1, getattr(agent, "remembers", 0))
        )  # what guidance remembers
        size = self.pilot.memory_size if isinstance(self.pilot, Controller) else None
        self.memory: Any = None if size is None else np.zeros((1, size))

    def step(self, given: Mapping[str, float]) -> float:
        """Ordered rudder, rad, at most `largest`, for the numbers named in `inputs`."""
        error = wrapped(given["set_point"] - given["heading"])
        if isinstance(self.agent, Guided):
            error = self._led(given, error)
        reach = self.scales["heading_error_integral"]
        self.integral = float(
            gathered(self.integral, error, self.begins, self.dt, reach)
        )
        own = (
            float(np.sin(error)),
            float(np.cos(error)),
            self.last_command,
            self.integral,
        )
        off = given["set_point"] - given.get("course", 0.0)
        courses = dict(zip(COURSE_ERROR, (np.sin(off), np.cos(off)), strict=True))
        order = self._order({**given, **dict(zip(OWN, own, strict=True)), **courses})
        self.begins, self.last_command = (
            False,
            min(max(order, -self.largest), self.largest),
        )
        return self.last_command

    def _led(self, given: Mapping[str, float], error: Any) -> Any:
        """Heading error against the course of guidance, for that against the path's beside the ship, rad."""
        arrays = {name: np.array([given[name]]) for name in self.inputs}
        shift = self.agent.shift([arrays[name] for name in self.agent.turns_ahead])
        shown = shift - np.arctan2(
            arrays["cross_track"], self.agent.gains["task_lookahead"]
        )
        arrays["heading_error"] = wrapped(error + shown)
        off = given["set_point"] + shown - given.get("course", 0.0)
        arrays |= dict(zip(COURSE_ERROR, (np.sin(off), np.cos(off)), strict=True))
        course, self.guided = self.agent.course(arrays, self.guided)
        return wrapped(error + shift + course)[0]

    def _order(self, seen: Mapping[str, float]) -> float:
        pilot = self.pilot
        if isinstance(pilot, Controller):
            names = {*pilot.observation_names, *pilot.reads}
            arrays = {name: np.array([seen.get(name, 0.0)]) for name in names}
            order, self.memory = pilot.steer(
                arrays, self.memory, np.array([self.begins])
            )
            return float(order[0])
        pairs = zip(pilot.observation_names, pilot.observation_scales, strict=True)
        shown = [np.clip(seen[name] / scale, *bounds()[name]) for name, scale in pairs]
        action, self.memory = pilot.predict(
            np.array(shown, dtype=np.float32), self.memory, self.begins
        )
        return float(action[0]) * self.limit
