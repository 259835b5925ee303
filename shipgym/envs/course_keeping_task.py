"""The course-keeping task: what is observed, what it costs, and when an episode ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from shipgym.checks import check_number, check_whole
from shipgym.envs.task import COMMON_INFO, Task
from shipgym.errors import InputError
from shipgym.ships import ShipModel

Floats = NDArray[np.float64]

OBSERVATION_NAMES = (
    "heading_error_sin",
    "heading_error_cos",
    "yaw_rate",
    "sway",
    "surge",
    "rudder",
    "last_command",
    "heading_error_integral",
)


@dataclass(frozen=True)
class CourseKeepingTask(Task):
    """What is asked of the autopilot.

    Attributes
    ----------
    course_change_deg : float
        Largest change of the set-point, degrees; 0 keeps the first course.
    change_interval_steps : int
        Mean number of control intervals between changes of the set-point.
    max_heading_error_deg : float
        Heading error beyond which control is lost, degrees, at most 180.
    course_changes_deg : sequence of float or None
        Changes of the set-point one after another, degrees, positive to starboard, in place of drawn ones:
        the first at the start, the others every `change_interval_steps`.
    sea, dt, episode_steps, max_envelope_distance, action, roll, roll_weight
        See `Task`, as for all others.
    """

    course_change_deg: float = 30.0
    change_interval_steps: int = 200
    max_heading_error_deg: float = 90.0
    course_changes_deg: Sequence[float] | None = None

    kernel: ClassVar[str] = "course_keeping"
    info_names: ClassVar[tuple[str, ...]] = (*COMMON_INFO, "reward_heading")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self.course_change_deg, "course_change_deg", at_least=0.0, at_most=90.0)
        check_whole(self.change_interval_steps, "change_interval_steps", at_least=1)
        check_number(self.max_heading_error_deg, "max_heading_error_deg", above=0.0, at_most=180.0)
        if self.course_changes_deg is not None and np.ndim(self.course_changes_deg) != 1:
            raise InputError(f"course_changes_deg: {self.course_changes_deg!r} found, expected a list")
        if self.course_changes_deg is not None and len(self.course_changes_deg) == 0:
            raise InputError(
                "course_changes_deg: none found, expected one at least; for a course that stays give [0.0]"
            )
        for i, change in enumerate(self._changes):
            check_number(change, f"course_changes_deg: number {i}", at_least=-180.0, at_most=180.0)

    @property
    def _changes(self) -> Sequence[float]:
        return () if self.course_changes_deg is None else self.course_changes_deg

    def own_settings(self, model: ShipModel) -> Sequence[float]:
        """Settings of the task's own kernel, in its order."""
        largest, limit = np.radians(self.course_change_deg), np.radians(self.max_heading_error_deg)
        return [float(largest), float(self.change_interval_steps), float(limit)]

    def listed(self, model: ShipModel) -> Sequence[float]:
        """The listed course changes, rad."""
        return [float(np.radians(change)) for change in self._changes]


def observation_scales(model: ShipModel) -> Floats:
    """Physical value of an observation of 1, in the order of `OBSERVATION_NAMES`, SI units."""
    return np.array([quantity.scale for quantity in CourseKeepingTask().observed(model)])
