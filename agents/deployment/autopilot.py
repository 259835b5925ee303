"""An autopilot as it stands on a bridge: numbers of one ship in SI units in, the ordered rudder out.

What it adds to a controller's law are plain functions on records too, which
`agents.deployment.autopilot_c99` writes as C.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.guided import COURSE_ERROR, Guided, shown_course
from agents.controllers.law import (
    Law,
    Nothing,
    Number,
    PathSignals,
    Signals,
    Turns,
    gathered,
    wrapped,
)
from agents.controllers.memory import from_columns
from shipgym import InputError
from shipgym.engine.records import field_types
from shipgym.files import read_toml
from shipgym.tasks import path_following
from shipgym.tasks.contract import ObservationSpec
from shipgym.tasks.scales import rounded_interval
from shipgym.tasks.steering import Extras, Helm

#: Unit and meaning of variables by name, of ships and autopilots.
VARIABLES = read_toml(Path(__file__).with_name("variables.toml"), "table of variables")
#: Inputs that show a signal or an observation of another name.
SHOWN_BY = {"drift": "course", **dict.fromkeys(COURSE_ERROR, "course")}


class BridgeInput(NamedTuple):
    """What an autopilot is given, with units and signs as in `variables.toml`."""

    set_point: Number
    heading: Number
    yaw_rate: Number = 0.0
    sway: Number = 0.0
    surge: Number = 0.0
    rudder: Number = 0.0
    rate_of_turn: Number = 0.0
    cross_track: Number = 0.0
    course: Number = 0.0
    roll: Number = 0.0
    roll_rate: Number = 0.0
    shaft_speed: Number = 0.0
    next_turn_distance: Number = 0.0
    next_turn_angle: Number = 0.0
    second_turn_distance: Number = 0.0
    second_turn_angle: Number = 0.0


class BridgeState(NamedTuple):
    """What an autopilot remembers; all zeros when it is switched on."""

    integral: Number  # rad s, of the heading error
    last_command: Number  # rad
    started: Number  # 0 before the first step, else 1
    memory: Any  # of its law
    guidance: Any  # of its guidance law


class BridgeParameters(NamedTuple):
    """What the functions below need to know of an autopilot."""

    dt: float  # s
    reach: float  # rad s, largest integral of the heading error
    limit: float  # rad, largest rudder
    task_lookahead: float  # m, of the environment that a policy learned in
    path_radius: float  # m
    law: Any  # parameters of its law
    guide: Any  # parameters of its guidance law


class OwnObservations(NamedTuple):
    """Observations that an autopilot makes of its set-point and of what it remembers."""

    heading_error_sin: Number
    heading_error_cos: Number
    last_command: Number  # rad
    heading_error_integral: Number  # rad s
    course_error_sin: Number
    course_error_cos: Number


Step = tuple[Number, BridgeState]


def heading_step(
    given: BridgeInput, state: BridgeState, p: BridgeParameters, law: Law
) -> Step:
    """Order of an autopilot that keeps a heading, and its next state."""
    error = wrapped(given.set_point - given.heading)
    order, after = heading_order(error, given, state, p, law)
    return limited(order, after, p)


def path_step(
    given: BridgeInput, state: BridgeState, p: BridgeParameters, guide: Law, law: Law
) -> Step:
    """Order of guidance, whose set-point is the direction of the path beside the ship, and its next state."""
    error = wrapped(given.set_point - given.heading)
    order, after = path_order(error, given, state, p, guide, law)
    return limited(order, after, p)


def base_path_step(
    given: BridgeInput, state: BridgeState, p: BridgeParameters, guide: Law, law: Law
) -> Step:
    """Order of guidance that a policy adds to, whose set-point is the course that its environment shows."""
    error = wrapped(given.set_point - given.heading)
    seen = path_signals(error, given)
    from_path = wrapped(error - shown_course(seen, p.task_lookahead, p.path_radius))
    order, after = path_order(from_path, given, state, p, guide, law)
    return limited(order, after, p)


def heading_order(
    error: Number, given: BridgeInput, state: BridgeState, p: BridgeParameters, law: Law
) -> Step:
    """Rudder for a heading error, rad, not yet limited."""
    integral = gathered(state.integral, error, state.started, p.dt, p.reach)
    seen = Signals(
        sway=given.sway,
        yaw_rate=given.yaw_rate,
        heading_error=error,
        rudder=given.rudder,
        heading_error_integral=integral,
        surge=given.surge,
        rate_of_turn=given.rate_of_turn,
    )
    order, memory = law(seen, state.memory, p.law)
    return order, state._replace(integral=integral, memory=memory)


def path_order(
    error: Number,
    given: BridgeInput,
    state: BridgeState,
    p: BridgeParameters,
    guide: Law,
    law: Law,
) -> Step:
    """Rudder for a heading error against the direction of the path, rad, not yet limited."""
    course, guidance = guide(path_signals(error, given), state.guidance, p.guide)
    order, after = heading_order(wrapped(error + course), given, state, p, law)
    return order, after._replace(guidance=guidance)


def path_signals(error: Number, given: BridgeInput) -> PathSignals:
    """What guidance is told of the ship."""
    return PathSignals(
        heading_error=error,
        cross_track=given.cross_track,
        drift=wrapped(given.course - given.heading),
        sway=given.sway,
        surge=given.surge,
        yaw_rate=given.yaw_rate,
        rudder=given.rudder,
        turns=Turns(
            given.next_turn_distance,
            given.next_turn_angle,
            given.second_turn_distance,
            given.second_turn_angle,
        ),
    )


def limited(order: Number, state: BridgeState, p: BridgeParameters) -> Step:
    """Order within the limit, and the state in which it is the last command."""
    command = np.clip(order, -p.limit, p.limit)
    return command, state._replace(last_command=command, started=1.0)


def own_observations(
    error: Number, integral: Number, given: BridgeInput, last_command: Number
) -> OwnObservations:
    """Observations of the heading error, rad, and of the course over ground against the set-point."""
    course_error = given.set_point - given.course
    return OwnObservations(
        np.sin(error),
        np.cos(error),
        last_command,
        integral,
        np.sin(course_error),
        np.cos(course_error),
    )


def policy_observations(
    given: BridgeInput, state: BridgeState, p: BridgeParameters
) -> tuple[OwnObservations, BridgeState]:
    """Observations that a policy is shown of its set-point and memory, and its state with the new integral."""
    error = wrapped(given.set_point - given.heading)
    integral = gathered(state.integral, error, state.started, p.dt, p.reach)
    own = own_observations(error, integral, given, state.last_command)
    return own, state._replace(integral=integral)


@cache
def observation_bounds() -> dict[str, tuple[float, float]]:
    """Bounds of observations by name, in multiples of their scale."""
    bounds = {}
    for record in (Helm, Extras, path_following.Observation):
        for name, kind in field_types(record, notes=True).items():
            for note in getattr(kind, "__metadata__", ()):
                if isinstance(note, ObservationSpec):
                    bounds[name] = (note.low, note.high)
    return bounds


class Autopilot:
    """Any controller or policy, stepped once in each control interval in double precision.

    Guidance is given the direction of the path beside the ship as its set-point, a
    policy that learned to follow paths the course that its environment shows.

    Raises InputError for a policy that commands the shaft too, or reads what no ship is
    known to show.

    Attributes
    ----------
    inputs : list of str
        What it reads.
    dt : float
        Control interval, s.
    limit : float
        Largest rudder of the ship, rad.
    largest : float
        Largest rudder that it orders, rad; may be set lower.
    """

    def __init__(self, agent: Any) -> None:
        self.agent = agent
        self.inputs = needed_inputs(agent)
        self.pilot: Any = agent.autopilot if isinstance(agent, Guided) else agent
        self.parameters = bridge_parameters(agent)
        self.dt = self.parameters.dt
        self.limit = self.parameters.limit
        self.largest = self.limit
        self.state = BridgeState(
            integral=np.zeros(1),
            last_command=np.zeros(1),
            started=np.zeros(1),
            memory=_no_memory(self.pilot),
            guidance=_no_memory(agent) if isinstance(agent, Guided) else Nothing(),
        )
        self._given: Any = None

    @property
    def integral(self) -> float:
        """Integral of the heading error, rad s."""
        return float(self.state.integral[0])

    @property
    def last_command(self) -> float:
        """Rudder ordered last, rad."""
        return float(self.state.last_command[0])

    def step(self, given: Mapping[str, float]) -> float:
        """Ordered rudder, rad, at most `largest`, for the numbers named in `inputs`."""
        numbers = {name: np.array([given[name]]) for name in self.inputs}
        self._given = BridgeInput(**numbers)
        p = self.parameters._replace(limit=self.largest)
        if isinstance(self.agent, Guided):
            step = path_step(self._given, self.state, p, self._guide, self._law)
        else:
            step = heading_step(self._given, self.state, p, self._law)
        order, self.state = step
        return float(order[0])

    def _guide(self, seen: PathSignals, memory: Any, _: Any) -> tuple[Number, Any]:
        """Course of guidance, by its law or by another of its ways."""
        guide: Guided = self.agent
        return guide.course(seen, memory)

    def _law(self, seen: Signals, memory: Any, _: Any) -> tuple[Number, Any]:
        """Rudder of the heading autopilot, by its law or by another of its ways."""
        if isinstance(self.pilot, Controller):
            return self.pilot.steer(seen, memory)
        return self._policy(seen, memory)

    def _policy(self, seen: Signals, memory: Any) -> tuple[Number, Any]:
        """Rudder of a policy, which is shown what its environment would show."""
        own = own_observations(
            seen.heading_error,
            seen.heading_error_integral,
            self._given,
            self.state.last_command,
        )
        known = {**self._given._asdict(), **own._asdict()}
        bounds, observation = observation_bounds(), []
        scales = zip(
            self.pilot.observation_names, self.pilot.observation_scales, strict=True
        )
        for name, scale in scales:
            observation.append(np.clip(known[name] / scale, *bounds[name]))
        starts = self.state.started == 0.0
        shown = np.array(observation, dtype=np.float32).T
        action, memory = self.pilot.predict(shown, memory, starts)
        return action[:, 0].astype(np.float64) * self.limit, memory


def bridge_parameters(agent: Any) -> BridgeParameters:
    """Parameters of any controller or policy; those of a policy's base where it has one."""
    learned = not isinstance(agent, Controller)
    base = getattr(agent, "base", None) if learned else agent
    guide = base if isinstance(base, Guided) else None
    pilot = base if guide is None else guide.autopilot
    scales = dict(zip(agent.observation_names, agent.observation_scales, strict=True))
    if learned:
        given = getattr(agent, "env_options", {}).get("dt")
        dt = float(given or rounded_interval(1.0 / scales["yaw_rate"]))
    else:
        dt = float(agent.design["dt"])
    return BridgeParameters(
        dt=dt,
        reach=float(scales["heading_error_integral"]),
        limit=float(scales["rudder"]),
        task_lookahead=1.0 if guide is None else guide.gains["task_lookahead"],
        path_radius=1.0 if guide is None else guide.path_radius,
        law=pilot.parameters if isinstance(pilot, Controller) else Nothing(),
        guide=Nothing() if guide is None else guide.parameters,
    )


def needed_inputs(agent: Any) -> list[str]:
    """Inputs that an autopilot reads, in the order of `BridgeInput`.

    Raises InputError for one that commands the shaft too, or reads what no ship is known
    to show.
    """
    names = {"set_point", "heading", *_needed(agent)}
    action = getattr(agent, "action", "rudder")
    if action == "rudder-shaft" or not names <= set(BridgeInput._fields):
        raise InputError(
            "autopilot: expected a policy that commands the rudder alone, by"
            f" {', '.join(BridgeInput._fields)}, got one that commands {action} and"
            f" reads {', '.join(sorted(names))[:200]}"
        )
    return [name for name in BridgeInput._fields if name in names]


def _needed(agent: Any) -> set[str]:
    """Names of inputs that an autopilot reads beside set-point and heading."""
    if isinstance(agent, Controller):
        names = set(agent.needed_signals)
        if isinstance(agent, Guided):
            names |= _needed(agent.autopilot)
    else:
        names = set(agent.observation_names)
        base = getattr(agent, "base", None)
        names |= set() if base is None else _needed(base)
    shown = {SHOWN_BY.get(name, name) for name in names}
    return shown - set(OwnObservations._fields)


def _no_memory(agent: Any) -> Any:
    """Memory of an autopilot that is switched on."""
    if not isinstance(agent, Controller):
        return None
    return from_columns(agent.memory_record, iter(np.zeros((agent.memory_size, 1))))
