"""Paths over any heading autopilot: line of sight, and its integral and adaptive forms against drift.

The path-following environment shows the heading error against its own line-of-sight course. These controllers
work out another course from the cross-track error and hand the heading error against that to the autopilot.

Sources: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.3 (line of sight);
Borhaug, Pavlov & Pettersen 2008 (integral line of sight, see `shipgym.tasks.guidance`); Fossen 2023, An
adaptive line-of-sight (ALOS) guidance law for path following of aircraft and marine craft, IEEE Transactions
on Control Systems Technology 31 (adaptive).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.controller import NUMBERS, Action, Controller, Policy, Range
from agents.controllers.linear_loop import Compensator, Margins, length_time
from agents.controllers.lq import LQ
from agents.controllers.memory import Floats, begun, checked_observation
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.tasks.guidance import PathPosition, integral_line_of_sight, wrapped
from shipgym.tasks.steering import INTEGRAL_ZONE
from shipgym.tasks.task import OBSERVATION_NAMES, Task, path_following_task

N_HEADING = len(OBSERVATION_NAMES)
CRITICAL = 4.0  # integral time over lookahead time with which s^2 + s / T + 1 / (T Ti) has a double root


@dataclass(frozen=True, eq=False, kw_only=True)
class Guided(Controller):
    """A heading autopilot that is led along a path.

    The state that `predict` takes and returns is a pair: what the guidance remembers of each ship, and the
    autopilot's own state.
    """

    observes: ClassVar[tuple[str, ...]] = (*OBSERVATION_NAMES, "cross_track")
    gain_names: ClassVar[tuple[str, ...]] = ("lookahead", "task_lookahead", "integral")
    has_autopilot: ClassVar[bool] = True
    ranges: ClassVar[Mapping[str, Range]] = {
        **Controller.ranges, "lookahead": Range(1e-6, NUMBERS.largest),
        "task_lookahead": Range(1e-6, NUMBERS.largest), "integral": Range(0.0, NUMBERS.largest),
    }  # fmt: skip

    autopilot: Policy  # steers by the first eight observations, those of course keeping

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

        Parameters
        ----------
        model : ShipModel
            The ship.
        autopilot : Policy, optional
            Any heading autopilot, also one that was learned; by default `LQ.from_model(model)`.
        task : Task, optional
            Its lookahead, corridor and control interval are used; by default the environment's own.
        lookahead_lengths : float, optional
            Ship lengths; by default that of the task. Longer turns gentler, shorter comes back sooner.
        integral_lengths : float, optional
            Time over which a steady cross-track error is integrated to as much again, in times to travel
            one ship length. By default 4 times `lookahead_lengths`, with which the way back to the path is
            critically damped; less swings, more is slower.

        Raises
        ------
        InputError
            If an argument is out of its range or the autopilot was designed for another ship.
        """
        asked = task or path_following_task()
        length = model.particulars["length"]
        if lookahead_lengths is None:
            lookahead_lengths = asked.lookahead
        check_number(lookahead_lengths, "lookahead_lengths", above=0.0)
        if integral_lengths is None:
            integral_lengths = CRITICAL * lookahead_lengths
        check_number(integral_lengths, "integral_lengths", above=0.0)
        pilot = LQ.from_model(model, dt=asked.interval(model)) if autopilot is None else autopilot
        known = isinstance(pilot, Controller)
        like = pilot if isinstance(pilot, Controller) else LQ.from_model(model, dt=asked.interval(model))
        like.check_fits_model(model)
        scales = {quantity.name: quantity.scale for quantity in asked.observed(model)}
        return cls(
            gains={
                "lookahead": lookahead_lengths * length,
                "task_lookahead": asked.lookahead * length,
                "integral": 1.0 / (integral_lengths * length_time(model)),
            },
            neutral_rudder=like.neutral_rudder,
            neutral_sway=like.neutral_sway,
            margins=like.margins if known else Margins(np.inf, np.inf, np.inf, np.inf),
            observation_scales=tuple(scales[name] for name in cls.observes),
            model_name=like.model_name,
            model_sha256=like.model_sha256,
            design={"dt": asked.interval(model), "integral_lengths": float(integral_lengths)},
            observation_names=cls.observes,
            autopilot=pilot,
        )

    @abstractmethod
    def course(self, cross_track: Floats, drift: Floats) -> tuple[Floats, Floats]:
        """Course to steer against that of the leg, and what is remembered of the drift next.

        `cross_track`: m, positive to starboard of the leg, shape (n,); `drift`: what was remembered, shape
        (n,). Returns `course`: rad, shape (n,); `drift`: shape (n,).
        """

    def predict(
        self, observation: ArrayLike, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Action, Any]:
        """See `Policy.predict`; it observes the path-following environment, and the state is a pair."""
        given = checked_observation(observation, self.observes).copy()
        own, inner = (None, None) if state is None else state
        memory, begins = begun(own, episode_start, given.shape[:-1], 2)
        cross = given[..., N_HEADING] * self.observation_scales[N_HEADING]
        wanted, drift = self.course(cross, memory[..., 0])
        shown = -np.arctan2(cross, self.gains["task_lookahead"])
        error = wrapped(np.arctan2(given[..., 0], given[..., 1]) + wanted - shown)
        reach = self.observation_scales[N_HEADING - 1]
        gathered = np.where((np.abs(error) > INTEGRAL_ZONE) | begins, 0.0, error * self.design["dt"])
        integral = np.clip(memory[..., 1] + gathered, -reach, reach)
        seen = given[..., :N_HEADING]
        seen[..., 0], seen[..., 1], seen[..., N_HEADING - 1] = np.sin(error), np.cos(error), integral / reach
        starts = None if inner is None else np.atleast_1d(begins)
        action, inner = self.autopilot.predict(seen.astype(np.float32), inner, starts, deterministic)
        return action, (np.stack([drift, integral], axis=-1), inner)

    def loop(self) -> Compensator:
        """Of the heading autopilot: guidance is slower by far."""
        return self._heading_autopilot("its margins").loop()

    def check_fits_model(self, model: ShipModel) -> None:
        """Refuse a ship that the autopilot was not designed for."""
        if isinstance(self.autopilot, Controller):
            self.autopilot.check_fits_model(model)

    def to_dict(self) -> dict[str, Any]:
        """What the file holds, of guidance and autopilot."""
        return {**super().to_dict(), "autopilot": self._heading_autopilot("a file").to_dict()}

    def _heading_autopilot(self, what: str) -> Controller:
        if not isinstance(self.autopilot, Controller):
            raise InputError(
                f"autopilot: {type(self.autopilot).__name__} found, expected a controller of shipgym "
                f"for {what}"
            )
        return self.autopilot


@dataclass(frozen=True, eq=False, kw_only=True)
class LineOfSight(Guided):
    """Steer for the point of the leg that lies the lookahead ahead (Fossen 2011, 10.3.2).

    A steady current sets the ship off the path.
    """

    kind: ClassVar[str] = "los"

    def course(self, cross_track: Floats, drift: Floats) -> tuple[Floats, Floats]:
        """See `Guided.course`; nothing is remembered."""
        course: Floats = -np.arctan2(cross_track, self.gains["lookahead"])
        return course, drift


@dataclass(frozen=True, eq=False, kw_only=True)
class IntegralLineOfSight(Guided):
    """Line of sight with an integral of the cross-track error, which ends at 0 in a steady current."""

    kind: ClassVar[str] = "ilos"

    def course(self, cross_track: Floats, drift: Floats) -> tuple[Floats, Floats]:
        """See `Guided.course`; the integral is remembered, m."""
        zero = np.zeros_like(cross_track)
        where = PathPosition(along=zero, cross_track=cross_track, course=zero, to_go=zero)
        gain, dt = self.gains["integral"], self.design["dt"]
        return integral_line_of_sight(where, self.gains["lookahead"], drift, gain, dt)


@dataclass(frozen=True, eq=False, kw_only=True)
class AdaptiveLineOfSight(Guided):
    """Line of sight less an estimate of the crab angle (Fossen 2023), which a steady current brings to 0."""

    kind: ClassVar[str] = "alos"

    def course(self, cross_track: Floats, drift: Floats) -> tuple[Floats, Floats]:
        """See `Guided.course`; the estimated crab angle is remembered, rad."""
        lookahead = self.gains["lookahead"]
        rate = self.gains["integral"] * cross_track / np.hypot(lookahead, cross_track)
        return -drift - np.arctan2(cross_track, lookahead), drift + self.design["dt"] * rate
