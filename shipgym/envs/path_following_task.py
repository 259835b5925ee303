"""The path-following task: the path, what is observed of it, what it costs, and when an episode ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from shipgym.checks import check_number, check_whole
from shipgym.envs.task import COMMON_INFO, Observed, Task
from shipgym.errors import InputError
from shipgym.kernels import layout
from shipgym.kernels import voyage_rows as rows
from shipgym.ships import ShipModel
from shipgym.tasks.guidance import Path

TURN_HORIZON = 10.0  # ship lengths ahead at which a turn comes into sight


@dataclass(frozen=True)
class PathFollowingTask(Task):
    """What is asked of the autopilot.

    Attributes
    ----------
    waypoints : array-like of shape (n, 2) or None
        North and east, m, of a path that is always the same; by default one is drawn for each episode.
    n_legs : int
        Of a path that is drawn.
    leg_lengths : tuple of float
        Least and largest length of its legs, ship lengths.
    max_turn_deg : float
        Largest change of course at its waypoints, degrees.
    lookahead : float
        Of the line-of-sight course, ship lengths.
    acceptance : float
        Distance from the end of a leg at which the next one begins, ship lengths.
    corridor : float
        Half the width of the corridor along the path, ship lengths.
    ground : float
        Distance from the path at which the ship runs aground, ship lengths.
    sea, dt, episode_steps, max_envelope_distance, action, roll, roll_weight
        See `Task`, as for all others.
    """

    episode_steps: int = 1500
    waypoints: Any = None
    n_legs: int = 4
    leg_lengths: tuple[float, float] = (8.0, 16.0)
    max_turn_deg: float = 60.0
    lookahead: float = 2.5
    acceptance: float = 1.5
    corridor: float = 1.0
    ground: float = 4.0

    kernel: ClassVar[str] = "path_following"
    info_names: ClassVar[tuple[str, ...]] = (
        *COMMON_INFO, "reward_cross_track", "reward_progress", "cross_track", "distance_made_good",
        "success", "in_corridor", "grounded",
    )  # fmt: skip
    flags: ClassVar[frozenset[str]] = frozenset({"extrapolating", "success", "in_corridor", "grounded"})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(check_whole(self.n_legs, "n_legs", at_least=1), "n_legs", at_most=100)
        if np.shape(self.leg_lengths) != (2,):
            raise InputError(f"leg_lengths: {self.leg_lengths!r} found, expected the least and the largest")
        check_number(self.leg_lengths[0], "leg_lengths: the least", above=0.0)
        check_number(self.leg_lengths[1], "leg_lengths: the largest", at_least=self.leg_lengths[0])
        check_number(self.max_turn_deg, "max_turn_deg", at_least=0.0, at_most=150.0)
        for name in ("lookahead", "corridor"):
            check_number(getattr(self, name), name, above=0.0, hint="in ship lengths")
        check_number(self.acceptance, "acceptance", at_least=0.0, hint="in ship lengths")
        check_number(self.ground, "ground", above=self.corridor, hint="in ship lengths, beyond the corridor")
        _ = self.path

    @cached_property
    def path(self) -> Path | None:
        """The given path."""
        return None if self.waypoints is None else Path(self.waypoints)

    def check_fits(self, model: ShipModel) -> None:
        """Refuse a ship that lacks what the task needs, or a corridor that she fills.

        Raises
        ------
        InputError
            Naming the argument.
        """
        super().check_fits(model)
        beam = model.particulars.get("beam")
        width = 2.0 * self.corridor * model.particulars["length"]
        if beam is not None and width <= beam:
            raise InputError(
                f"corridor: {self.corridor:g} ship lengths to each side is {width:.1f} m wide, expected "
                f"more than the beam of {model.name!r}, {beam:.1f} m"
            )

    @property
    def legs(self) -> int:
        """Number of legs of every path."""
        return self.n_legs if self.path is None else self.path.n_legs

    def observed_of_task(self, model: ShipModel) -> tuple[Observed, ...]:
        """Cross-track error, course over ground against that to steer, and the turn ahead."""
        length = model.particulars["length"]
        at = layout.offsets(rows.TASK_SEEN, 5)
        return (
            Observed("cross_track", -5.0, 5.0, self.corridor * length, at[0]),
            Observed("course_error_sin", -1.0, 1.0, 1.0, at[1]),
            Observed("course_error_cos", -1.0, 1.0, 1.0, at[2]),
            Observed("turn_distance", 0.0, 1.0, TURN_HORIZON * length, at[3]),
            Observed("turn_angle", -1.0, 1.0, float(np.pi), at[4]),
        )

    def own_settings(self, model: ShipModel) -> Sequence[float]:
        """Settings of the task's own kernel, in its order."""
        return [
            float(self.legs), *map(float, self.leg_lengths), float(np.radians(self.max_turn_deg)),
            self.lookahead, self.acceptance, self.corridor, self.ground,
        ]  # fmt: skip

    def listed(self, model: ShipModel) -> Sequence[float]:
        """The given waypoints, north and east by turns, m."""
        return [] if self.path is None else self.path.waypoints.ravel().tolist()

    def episode_rows(self) -> int:
        """Rows of the state that hold the waypoints."""
        return 2 * (self.legs + 1)
