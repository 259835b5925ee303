"""A controller on a bridge: measured quantities of one ship in SI units in, the rudder order out."""

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
#: Observations that an autopilot computes itself.
OWN = (
    "heading_error_sin",
    "heading_error_cos",
    "last_command",
    "heading_error_integral",
)


def _reads(agent: Any) -> set[str]:
    """Inputs that an autopilot reads, beside set-point and heading."""
    if isinstance(agent, Guided):
        return {*agent.reads, *agent.turns_ahead} | _reads(agent.autopilot)
    if isinstance(agent, Controller):
        if type(agent).steer is not Controller.steer:
            return set(agent.reads)
        signals: set[str] = set()
        for gain, (signal, _) in agent.feedback.items():
            if agent.gains[gain]:
                signals.add(signal)
        return {signal for signal in signals if signal in INPUTS}

    names: set[str] = set(agent.observation_names)
    base = getattr(agent, "base", None)
    if base is not None:
        names |= _reads(base)
    if names & {*COURSE_ERROR}:
        names.add("course")
    return names - {*OWN, *COURSE_ERROR}


@cache
def bounds() -> dict[str, tuple[float, float]]:
    """Bounds of observations by name, in multiples of their scale."""
    found = {}
    for record in (Helm, Extras, path_following.Observation):
        for name, note in field_types(record, notes=True).items():
            for about in getattr(note, "__metadata__", ()):
                if isinstance(about, Seen):
                    found[name] = (about.low, about.high)
    return found


class Autopilot:
    """Any controller or policy, stepped once in each control interval in double precision.

    It adds what an environment would: the integral of the heading error, and the last
    command. The set-point of guidance is the direction of the path beside the ship; a
    policy that learned to follow paths gets the course that its environment shows: of
    legs without arcs the leg's less atan(cross-track error / lookahead).

    Raises InputError for a policy that commands the shaft too, or reads what no
    instrument measures.

    Attributes
    ----------
    inputs : list of str
        Names of what it reads (`variables.toml`).
    dt : float
        Control interval, s.
    limit : float
        Rudder limit of the ship, rad.
    largest : float
        Largest rudder order, rad; may be set lower than `limit`.
    """

    def __init__(self, agent: Any) -> None:
        names = {"set_point", "heading", *_reads(agent)}
        action = getattr(agent, "action", "rudder")
        if action == "rudder-shaft" or not names <= INPUTS.keys():
            raise InputError(
                f"autopilot: expected one that commands the rudder by {', '.join(INPUTS)},"
                f" got one that commands {action} by {', '.join(sorted(names))[:200]}"
            )
        self.agent = agent
        self.pilot: Any = agent.autopilot if isinstance(agent, Guided) else agent
        self.inputs = [name for name in INPUTS if name in names]
        self.scales = dict(
            zip(agent.observation_names, agent.observation_scales, strict=True)
        )
        self.limit = float(self.scales["rudder"])
        self.largest = self.limit
        self.dt = _control_interval(agent, self.scales)

        self.begins = True
        self.integral = 0.0  # of the heading error, rad s
        self.last_command = 0.0  # rad
        self.guidance_memory = np.zeros((1, getattr(agent, "remembers", 0)))
        self.memory: Any = None  # of the pilot
        if isinstance(self.pilot, Controller) and self.pilot.memory_size is not None:
            self.memory = np.zeros((1, self.pilot.memory_size))

    def step(self, given: Mapping[str, float]) -> float:
        """Rudder order, rad, at most `largest`, for the quantities named in `inputs`."""
        error = wrapped(given["set_point"] - given["heading"])
        if isinstance(self.agent, Guided):
            error = self._guided_error(given, error)
        reach = self.scales["heading_error_integral"]
        self.integral = float(
            gathered(self.integral, error, self.begins, self.dt, reach)
        )

        course_error = given["set_point"] - given.get("course", 0.0)
        observed = {
            **given,
            "heading_error_sin": float(np.sin(error)),
            "heading_error_cos": float(np.cos(error)),
            "last_command": self.last_command,
            "heading_error_integral": self.integral,
            **_sine_and_cosine(course_error),
        }
        if isinstance(self.pilot, Controller):
            order = self._controller_order(observed)
        else:
            order = self._policy_order(observed)
        self.begins = False
        self.last_command = min(max(order, -self.largest), self.largest)
        return self.last_command

    def _guided_error(self, given: Mapping[str, float], error: Any) -> Any:
        """Heading error against the course of guidance, from that against the path beside the ship, rad."""
        agent = self.agent
        arrays = {name: np.array([given[name]]) for name in self.inputs}
        shift = agent.shift([arrays[name] for name in agent.turns_ahead])

        # the course that the environment shows, relative to the path beside the ship
        lookahead = agent.gains["task_lookahead"]
        shown = shift - np.arctan2(arrays["cross_track"], lookahead)
        arrays["heading_error"] = wrapped(error + shown)
        course_error = given["set_point"] + shown - given.get("course", 0.0)
        arrays |= _sine_and_cosine(course_error)

        course, self.guidance_memory = agent.course(arrays, self.guidance_memory)
        return wrapped(error + shift + course)[0]

    def _controller_order(self, observed: Mapping[str, float]) -> float:
        pilot = self.pilot
        arrays = {}
        for name in (*pilot.observation_names, *pilot.reads):
            arrays[name] = np.array([observed.get(name, 0.0)])
        begins = np.array([self.begins])
        order, self.memory = pilot.steer(arrays, self.memory, begins)
        return float(order[0])

    def _policy_order(self, observed: Mapping[str, float]) -> float:
        scales = dict(
            zip(
                self.pilot.observation_names,
                self.pilot.observation_scales,
                strict=True,
            )
        )
        observation = []
        for name, scale in scales.items():
            low, high = bounds()[name]
            observation.append(np.clip(observed[name] / scale, low, high))
        shown = np.array(observation, dtype=np.float32)
        action, self.memory = self.pilot.predict(shown, self.memory, self.begins)
        return float(action[0]) * self.limit


def _control_interval(agent: Any, scales: Mapping[str, float]) -> float:
    """Control interval of a controller, or of the environment that a policy learned in, s."""
    if isinstance(agent, Controller):
        return float(agent.design["dt"])
    options = getattr(agent, "env_options", {})
    if options.get("dt"):
        return float(options["dt"])
    return rounded_interval(1.0 / scales["yaw_rate"])


def _sine_and_cosine(course_error: Any) -> dict[str, Any]:
    """Observations of a course error, rad."""
    return dict(
        zip(COURSE_ERROR, (np.sin(course_error), np.cos(course_error)), strict=True)
    )
