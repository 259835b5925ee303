"""Paths over any heading autopilot: line of sight, and its integral and adaptive forms against drift.

The path-following environment shows the heading error against its own line-of-sight
course. These controllers work out another course from the cross-track error and hand
the heading error against that to the autopilot.

Sources: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.3
(line of sight); Borhaug, Pavlov & Pettersen 2008 (integral line of sight, see
`shipgym.tasks.guidance`); Fossen 2023, An adaptive line-of-sight (ALOS) guidance law
for path following of aircraft and marine craft, IEEE Transactions on Control Systems
Technology 31 (adaptive).
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.controller import NUMBERS, Action, Controller, Policy, Range
from agents.controllers.linear_loop import Compensator, Margins
from agents.controllers.lq import LQ
from agents.controllers.memory import (
    Floats,
    begun,
    checked_observation,
    gathered,
    heading_error,
    on_course,
)
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.tasks.guidance import PathPosition, integral_line_of_sight, wrapped
from shipgym.tasks.task import OBSERVATION_NAMES, Task, path_following_task

N_HEADING = len(OBSERVATION_NAMES)
# integral time over lookahead time with which s^2 + s / T + 1 / (T Ti) has a double
# root
CRITICAL = 4.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Guided(Controller):
    """A heading autopilot that is led along a path.

    The state that `predict` takes and returns is a pair: what the guidance remembers of
    each ship, and the autopilot's own state.
    """

    observes: ClassVar[tuple[str, ...]] = (*OBSERVATION_NAMES, "cross_track")
    gain_names: ClassVar[tuple[str, ...]] = ("lookahead", "task_lookahead")
    reads: ClassVar[tuple[str, ...]] = ("cross_track",)
    has_autopilot: ClassVar[bool] = True
    remembers: ClassVar[int] = (
        1  # numbers of each ship, beside the integral of the heading error
    )
    ranges: ClassVar[Mapping[str, Range]] = {
        **Controller.ranges,
        **dict.fromkeys(gain_names, Range(1e-6, NUMBERS.largest)),
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
        """The guidance with these gains, SI units, of an autopilot, by default LQ, along a task's paths.

        `design`: how they were found. Raises InputError if the autopilot was designed
        for another ship.
        """
        dt = task.interval(model)
        like = (
            autopilot
            if isinstance(autopilot, Controller)
            else LQ.from_model(model, dt=dt)
        )
        own = autopilot is None or autopilot is like
        like.check_fits_model(model)
        scales = {quantity.name: quantity.scale for quantity in task.observed(model)}
        return cls(
            gains={
                **gains,
                "task_lookahead": task.lookahead * model.particulars["length"],
            },
            neutral_rudder=like.neutral_rudder,
            neutral_sway=like.neutral_sway,
            margins=like.margins if own else Margins(np.inf, np.inf, np.inf, np.inf),
            observation_scales=tuple(scales[name] for name in cls.observes),
            observation_names=cls.observes,
            model_name=like.model_name,
            model_sha256=like.model_sha256,
            design={"dt": dt, **design},
            autopilot=like if autopilot is None else autopilot,
            **({"ship": model} if cls.has_ship else {}),
        )

    @property
    def turns_ahead(self) -> tuple[str, ...]:
        """Names of distance and angle of each turn to come that it observes."""
        return ()

    def shift(self, turns: Sequence[Floats]) -> Floats | float:
        """Course that the environment's heading error refers to, against that of the path here, rad."""
        return 0.0

    @abstractmethod
    def course(
        self, seen: Mapping[str, Floats], memory: Floats
    ) -> tuple[Floats, Floats]:
        """Course to steer against that of the leg, and what is remembered of it next.

        `seen`: what is observed, and the `heading_error`, SI units, each of shape (n,);
        `memory`: zeros where an episode begins, shape (n, remembers). Returns `course`:
        rad, shape (n,); `memory`.
        """

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Action, Any]:
        """See `Policy.predict`; it observes the path-following environment, and the state is a pair."""
        given = checked_observation(observation, self.observation_names)
        own, inner = (None, None) if state is None else state
        memory, begins = begun(own, episode_start, given.shape[:-1], self.remembers + 1)
        first = (given[..., : len(self.observation_names)] * self.observation_scales).T
        seen = dict(zip(self.observation_names, first, strict=True))
        seen["heading_error"] = heading_error(seen)
        wanted, kept = self.course(seen, memory[..., :-1])
        shown = -np.arctan2(seen["cross_track"], self.gains["task_lookahead"])
        error = wrapped(seen["heading_error"] + wanted - shown)
        reach = self.observation_scales[N_HEADING - 1]
        integral = gathered(memory[..., -1], error, begins, self.design["dt"], reach)
        helm = on_course(given[..., :N_HEADING], error, integral, reach)
        starts = None if inner is None else np.atleast_1d(begins)
        action, inner = self.autopilot.predict(helm, inner, starts, deterministic)
        return action, (np.concatenate([kept, integral[..., None]], axis=-1), inner)

    def loop(self) -> Compensator:
        """Of the heading autopilot: guidance is slower by far."""
        return self._heading_autopilot("its margins").loop()

    def check_fits_model(self, model: ShipModel) -> None:
        """Refuse a ship that the autopilot was not designed for."""
        if isinstance(self.autopilot, Controller):
            self.autopilot.check_fits_model(model)

    def to_dict(self) -> dict[str, Any]:
        """What the file holds, of guidance and autopilot."""
        return {
            **super().to_dict(),
            "autopilot": self._heading_autopilot("a file").to_dict(),
        }

    def _heading_autopilot(self, what: str) -> Controller:
        if isinstance(self.autopilot, Controller):
            return self.autopilot
        found = type(self.autopilot).__name__
        raise InputError(
            f"autopilot: {found} found, expected a controller of shipgym for {what}"
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class LineOfSight(Guided):
    """Steer for the point on the leg one lookahead ahead (Fossen 2011, 10.3.2).

    A steady current sets the ship off the path.
    """

    kind: ClassVar[str] = "los"
    gain_names: ClassVar[tuple[str, ...]] = (*Guided.gain_names, "integral")
    ranges: ClassVar[Mapping[str, Range]] = {
        **Guided.ranges,
        "integral": Range(0.0, NUMBERS.largest),
    }

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        autopilot: Policy | None = None,
        task: Task | None = None,
        lookahead_lengths: float | None = None,
        integral_lengths: float | None = None,
    ) -> Self:
        """Lead an autopilot along the paths of a task.

        Raises InputError if an argument is out of its range or the autopilot was
        designed for another ship.

        Parameters
        ----------
        model : ShipModel
            The ship.
        autopilot : Policy, optional
            Any heading autopilot, also one that was learned; by default
            `LQ.from_model(model)`.
        task : Task, optional
            Its lookahead, corridor and control interval are used; by default the
            environment's own.
        lookahead_lengths : float, optional
            Ship lengths; by default that of the task. Longer turns gentler, shorter
            comes back sooner.
        integral_lengths : float, optional
            Time over which a steady cross-track error is integrated to as much again,
            in times to travel one ship length. By default 4 times `lookahead_lengths`,
            with which the way back to the path is critically damped; less swings, more
            is slower.
        """
        asked = task or path_following_task()
        length = model.particulars["length"]
        ahead = asked.lookahead if lookahead_lengths is None else lookahead_lengths
        check_number(ahead, "lookahead_lengths", above=0.0)
        integral = CRITICAL * ahead if integral_lengths is None else integral_lengths
        check_number(integral, "integral_lengths", above=0.0)
        gains = {
            "lookahead": ahead * length,
            "integral": 1.0 / (integral * model.travel_time),
        }
        return cls.leading(
            model, autopilot, asked, gains, {"integral_lengths": float(integral)}
        )

    def course(
        self, seen: Mapping[str, Floats], memory: Floats
    ) -> tuple[Floats, Floats]:
        """See `Guided.course`; nothing is remembered."""
        course: Floats = -np.arctan2(seen["cross_track"], self.gains["lookahead"])
        return course, memory


@dataclass(frozen=True, eq=False, kw_only=True)
class IntegralLineOfSight(LineOfSight):
    """Line of sight with an integral of the cross-track error, which goes to 0 in a steady current."""

    kind: ClassVar[str] = "ilos"

    def course(
        self, seen: Mapping[str, Floats], memory: Floats
    ) -> tuple[Floats, Floats]:
        """See `Guided.course`; the integral is remembered, m."""
        zero = np.zeros_like(seen["cross_track"])
        where = PathPosition(
            along=zero, cross_track=seen["cross_track"], course=zero, to_go=zero
        )
        gains, dt = self.gains, self.design["dt"]
        drift = memory[..., 0]
        course, drift = integral_line_of_sight(
            where, gains["lookahead"], drift, gains["integral"], dt
        )
        return course, drift[..., None]


@dataclass(frozen=True, eq=False, kw_only=True)
class AdaptiveLineOfSight(LineOfSight):
    """Line of sight minus an estimate of the crab angle (Fossen 2023); a steady current leaves no error."""

    kind: ClassVar[str] = "alos"

    def course(
        self, seen: Mapping[str, Floats], memory: Floats
    ) -> tuple[Floats, Floats]:
        """See `Guided.course`; the estimated crab angle is remembered, rad."""
        lookahead, cross_track = self.gains["lookahead"], seen["cross_track"]
        rate = self.gains["integral"] * cross_track / np.hypot(lookahead, cross_track)
        drift = memory[..., 0]
        course: Floats = -drift - np.arctan2(cross_track, lookahead)
        return course, (drift + self.design["dt"] * rate)[..., None]
