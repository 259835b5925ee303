"""Path following: sail a ship along waypoints with its rudder."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from shipgym.envs.engine import Engine
from shipgym.envs.path_following_task import PathFollowingTask
from shipgym.envs.ship_env import ShipEnv
from shipgym.envs.ship_vector_env import ShipVectorEnv
from shipgym.envs.task import Task
from shipgym.ships import ShipModel


class PathFollowingEngine(Engine):
    """The path-following task for many ships at once, without Gymnasium's clothes (see `Engine`)."""

    def __init__(
        self,
        models: ShipModel | Sequence[ShipModel],
        num_envs: int,
        task: PathFollowingTask | None = None,
        **options: Any,
    ) -> None:
        super().__init__(models, num_envs, task or PathFollowingTask(), **options)


class PathFollowingEnv(ShipEnv):
    """Sail along straight legs from waypoint to waypoint with the rudder.

    The action is the commanded rudder, -1 to 1 of its limit, positive to starboard. The observation
    begins with the eight quantities of course keeping, where the heading error is against the
    line-of-sight course, so that any course autopilot follows the path as it is; then come cross-track
    error (positive to starboard of the path), sine and cosine of the error of the course over ground,
    distance to the end of the leg and the turn there.

    The reward is minus a cost whose parts are in `info`: the square of the cross-track error over the
    half-width of the corridor, the way along the path that is missing against service speed, and rudder
    and rudder rate as in course keeping. Reaching the end within the corridor ends the episode, and with
    it the cost; running aground costs as much as the rest of the episode at the worst.

    Arguments: those of `ShipEnv`; `options` are the fields of `PathFollowingTask` and of `Variety`.
    """

    task_type: ClassVar[type[Task]] = PathFollowingTask


class PathFollowingVectorEnv(ShipVectorEnv):
    """Many ships following their paths (see `PathFollowingEnv` and `ShipVectorEnv`)."""

    task_type: ClassVar[type[Task]] = PathFollowingTask
