"""Course keeping: hold and change the heading of a ship with its rudder."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from shipgym.envs.course_keeping_task import CourseKeepingTask
from shipgym.envs.engine import Engine
from shipgym.envs.ship_env import ShipEnv
from shipgym.envs.ship_vector_env import ShipVectorEnv
from shipgym.envs.task import Task
from shipgym.ships import ShipModel


class CourseKeepingEngine(Engine):
    """The course-keeping task for many ships at once, without Gymnasium's clothes (see `Engine`)."""

    def __init__(
        self,
        models: ShipModel | Sequence[ShipModel],
        num_envs: int,
        task: CourseKeepingTask | None = None,
        **options: Any,
    ) -> None:
        super().__init__(models, num_envs, task or CourseKeepingTask(), **options)


class CourseKeepingEnv(ShipEnv):
    """Keep and change the heading of a ship with its rudder.

    The action is the commanded rudder, -1 to 1 of its limit, positive to starboard. The observation
    holds the quantities of `observation_names`, each divided by its entry of `observation_scales`:
    sine and cosine of the heading error (set-point less heading, positive when the ship has to turn to
    starboard), yaw rate, sway and surge speed, rudder, last command, and the integral of the heading
    error, gathered only while the error is within 10 degrees.

    The reward is the classical steering cost with the sign turned (Norrbin 1972; van Amerongen 1982):
    minus the squares of heading error, rudder angle (weight 0.1) and rudder rate (weight 0.01), all in
    units of 30 degrees, the rate per ship length sailed. `info` has its parts. Losing control costs as
    much as the rest of the episode at the largest heading error, so that it never pays to end early.

    Arguments: those of `ShipEnv`; `options` are the fields of `CourseKeepingTask` and of `Variety`.
    """

    task_type: ClassVar[type[Task]] = CourseKeepingTask


class CourseKeepingVectorEnv(ShipVectorEnv):
    """Many ships keeping their courses (see `CourseKeepingEnv` and `ShipVectorEnv`)."""

    task_type: ClassVar[type[Task]] = CourseKeepingTask
