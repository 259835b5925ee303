"""Guidance along a path over any heading autopilot.

The path-following environment shows the heading error against its own line-of-sight
course. Guidance works out another course and hands the heading error against that to
the autopilot. A guidance law is a law (`agents.controllers.law`) that reads
`PathSignals` and returns the course to steer against the direction of the path beside
the ship, rad.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.controller import (
    ANY_NUMBER,
    Action,
    Bounds,
    Controller,
    Policy,
)
from agents.controllers.law import Number, PathSignals, Turns, gathered, wrapped
from agents.controllers.lq import LQ
from agents.controllers.margins import Compensator, Margins
from agents.controllers.memory import (
    checked_observation,
    from_columns,
    on_course,
    recalled,
    to_rows,
)
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.tasks.scales import OBSERVATION_NAMES
from shipgym.tasks.task import Task

N_HEADING = len(OBSERVATION_NAMES)  # observations of a heading autopilot
UNLIMITED = Margins(np.inf, np.inf, np.inf, np.inf)
COURSE_ERROR = ("course_error_sin", "course_error_cos")
#: Observations of the turns ahead, in the order of `Turns`.
TURNS = (
    "next_turn_distance",
    "next_turn_angle",
    "second_turn_distance",
    "second_turn_angle",
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Guided(Controller):
    """A heading autopilot that is led along a path.

    The state that `predict` takes and returns is a pair: what the guidance remembers of
    each ship, and the autopilot's own state.
    """

    observes: ClassVar[tuple[str, ...]] = (*OBSERVATION_NAMES, "cross_track")
    gain_names: ClassVar[tuple[str, ...]] = ("lookahead", "task_lookahead")
    #: What its law reads of `PathSignals` beside the heading error.
    reads: ClassVar[tuple[str, ...]] = ("cross_track",)
    has_autopilot: ClassVar[bool] = True
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **Controller.bounds,
        "lookahead": Bounds(1e-6, ANY_NUMBER.largest),
        "task_lookahead": Bounds(1e-6, ANY_NUMBER.largest),
    }

    autopilot: Policy  # steers by the first eight observations, those of course keeping

    @classmethod
    def leading(
        cls,
        model: ShipModel,
        autopilot: Policy | None,
        task: Task,
        gains: Mapping[str, float],
        design: Mapping[str, float],
    ) -> Self:
        """Make guidance with these gains, SI units, of an autopilot, by default LQ, along a task's paths.

        `design` is how the gains were found. Raises InputError if the autopilot was
        designed for another ship, or the task does not show what guidance observes.
        """
        dt = task.interval(model)
        like: Controller
        if autopilot is None:
            autopilot = LQ.from_model(model, dt=dt)
        if isinstance(autopilot, Controller):
            like, margins = autopilot, autopilot.margins
        else:
            like, margins = LQ.from_model(model, dt=dt), UNLIMITED
        like.check_fits_model(model)

        scales = {quantity.name: quantity.scale for quantity in task.observed(model)}
        for name in cls.observes:
            if name not in scales:
                raise InputError(
                    f"task: expected one that shows '{name}', got '{task.name}'"
                )
        task_lookahead = task.lookahead * model.particulars["length"]
        return cls(
            gains={**gains, "task_lookahead": task_lookahead},
            neutral_rudder=like.neutral_rudder,
            neutral_sway=like.neutral_sway,
            margins=margins,
            observation_scales=tuple(scales[name] for name in cls.observes),
            observation_names=cls.observes,
            model_name=like.model_name,
            model_sha256=like.model_sha256,
            design={"dt": dt, **design},
            autopilot=autopilot,
            **({"ship": model} if cls.has_ship else {}),
        )

    @property
    def path_radius(self) -> float:
        """Radius of the path's arcs, m; of no effect where guidance observes no turns."""
        return self.gains.get("path_radius", 1.0)

    @classmethod
    def is_closed_form(cls) -> bool:
        """Whether it guides by its `law` alone."""
        return cls.course is Guided.course

    def course(self, seen: PathSignals, memory: Any) -> tuple[Number, Any]:
        """Evaluate the guidance law once.

        Parameters
        ----------
        seen : PathSignals
            SI units, each number an array of shape (n_ships,).
        memory : NamedTuple
            A `memory_record` of such arrays; zeros where an episode begins.

        Returns
        -------
        course : array of shape (n_ships,)
            To steer, against the direction of the path beside the ship, rad.
        memory : NamedTuple
            For the next interval.
        """
        return type(self).law(seen, memory, self.parameters)

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Action, Any]:
        """See `Policy.predict`; it observes the path-following environment, and the state is a pair."""
        given = checked_observation(observation, self.observation_names)
        shape, size = given.shape[:-1], self.memory_size
        own, inner = (None, None) if state is None else state
        kept = recalled(own, episode_start, shape, size + 2)

        seen = self.path_signals(np.atleast_2d(given))
        n_ships = len(seen.cross_track)
        columns = kept.reshape(n_ships, size + 2).T
        memory = from_columns(self.memory_record, iter(columns[:size]))
        integral, started = columns[size], columns[size + 1]

        course, memory = self.course(seen, memory)
        error = wrapped(seen.heading_error + course)
        reach = self.observation_scales[N_HEADING - 1]
        integral = gathered(integral, error, started, self.design["dt"], reach)

        heading = np.atleast_2d(given)[:, :N_HEADING]
        shown = on_course(heading, error, integral, reach).reshape(*shape, N_HEADING)
        starts = None if inner is None else started == 0.0
        action, inner = self.autopilot.predict(shown, inner, starts, deterministic)

        after = [to_rows(memory, n_ships), integral[:, None], np.ones((n_ships, 1))]
        return action, (np.hstack(after).reshape(*shape, size + 2), inner)

    def path_signals(self, observations: Floats) -> PathSignals:
        """What observations, shape (n_ships, n_observations), say of ships and paths, SI units."""
        known = self.observed(observations)
        zero = np.zeros(len(observations))
        error = np.arctan2(known["heading_error_sin"], known["heading_error_cos"])
        course_error = zero
        if COURSE_ERROR[0] in known:
            course_error = np.arctan2(*(known[name] for name in COURSE_ERROR))

        seen = PathSignals(
            heading_error=error,
            cross_track=known["cross_track"],
            drift=error - course_error,
            sway=known["sway"],
            surge=known["surge"],
            yaw_rate=known["yaw_rate"],
            rudder=known["rudder"],
            turns=Turns(*(known.get(name, zero) for name in TURNS)),
        )
        shown = shown_course(seen, self.gains["task_lookahead"], self.path_radius)
        return seen._replace(heading_error=wrapped(error - shown))

    def loop(self) -> Compensator:
        """Loop of the heading autopilot: guidance is slower by far."""
        return self.heading_autopilot("its margins").loop()

    def check_fits_model(self, model: ShipModel) -> None:
        """Refuse a ship that the autopilot was not designed for."""
        if isinstance(self.autopilot, Controller):
            self.autopilot.check_fits_model(model)

    def to_dict(self) -> dict[str, Any]:
        """Content of the file, of guidance and autopilot."""
        autopilot = self.heading_autopilot("a file").to_dict()
        return {**super().to_dict(), "autopilot": autopilot}

    def heading_autopilot(self, purpose: str) -> Controller:
        """Autopilot, if it is one of this package; else InputError says that the purpose needs one."""
        if isinstance(self.autopilot, Controller):
            return self.autopilot
        raise InputError(
            f"autopilot: expected a controller of shipgym for {purpose}, got"
            f" {type(self.autopilot).__name__}"
        )


def shown_course(seen: PathSignals, lookahead: float, path_radius: float) -> Number:
    """Course that the environment's heading error refers to, against the path beside the ship, rad.

    Line of sight with a lookahead, m, to the course of the path half of that ahead.
    """
    ahead = bend(0.5 * lookahead, seen.turns, path_radius)
    return ahead - np.arctan2(seen.cross_track, lookahead)


def bend(distance: float, turns: Turns, radius: float) -> Number:
    """Change of the path's course over a distance ahead, rad; its turns are arcs of one radius, m."""
    first = arc_turned(distance - turns.next_distance, turns.next_angle, radius)
    second = arc_turned(distance - turns.second_distance, turns.second_angle, radius)
    return first + second


def arc_turned(way: Number, angle: Number, radius: float) -> Number:
    """Change of course after a way, m, on an arc of an angle, rad; nothing before and no more after it."""
    return np.sign(angle) * np.clip(way / radius, 0.0, np.abs(angle))
