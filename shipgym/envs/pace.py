"""Pace of an agent: intervals of a step, rate of its commands, observations it sees."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Flags
from shipgym.checks import check_number, check_whole
from shipgym.engine.lane_records import CONSTRAINT
from shipgym.envs.engine import Engine
from shipgym.envs.outputs import ANSWER_FLAGS, ANSWER_OUTCOMES
from shipgym.errors import InputError

Float32 = NDArray[np.float32]

NO_LIMIT = 2.0  # of the rate: commands are in [-1, 1]


@dataclass(frozen=True)
class Pace:
    """What one step of an agent is.

    Raises InputError naming the keyword whose value does not fit.

    Attributes
    ----------
    action_repeat : int
        Control intervals for which an action is held.
    rate_limit : float or None
        Largest change of a command in a control interval, parts of its limit.
    frame_stack : int
        Number of observations that are shown together.
    """

    action_repeat: int = 1
    rate_limit: float | None = None
    frame_stack: int = 1

    def __post_init__(self) -> None:
        check_whole(self.action_repeat, "action_repeat", at_least=1)
        check_whole(self.frame_stack, "frame_stack", at_least=1)
        if self.rate_limit is not None:
            check_number(
                self.rate_limit,
                "rate_limit",
                above=0.0,
                hint="parts of the limit in a control interval, or None",
            )

    def check_reaches(self, orders: Float32) -> None:
        """Refuse a rate at which a step does not reach the next discrete order."""
        if self.rate_limit is None or len(orders) == 0:
            return
        reach = self.action_repeat * self.rate_limit
        gap = float(np.diff(orders).max())
        if reach < gap - 1e-6:
            least = gap / self.action_repeat
            raise InputError(
                f"rate_limit: expected at least {least:g} with"
                f" discrete orders that are up to {gap:g} apart, got"
                f" {self.rate_limit:g}, which reaches {reach:g} in a step; raise it"
                " or action_repeat, or choose a continuous action"
            )


class PacedSteps:
    """Steps of an engine at a pace: rewards, costs and constraints are sums.

    Where an episode ends inside a step, its ship stays as she is for the rest of it.
    """

    def __init__(self, engine: Engine, pace: Pace) -> None:
        self.engine = engine
        self.repeat = pace.action_repeat
        self.rate = NO_LIMIT if pace.rate_limit is None else pace.rate_limit
        names = engine.task.info_names
        self._summed = [0]
        for row, name in enumerate(names, start=ANSWER_OUTCOMES):
            if name == "cost" or name.startswith(("reward_", CONSTRAINT)):
                self._summed.append(row)

    def advance(self, begin_ended: bool = False, anew: bool = False) -> int:
        """Take a step, arguments and errors as in `Engine.advance`."""
        engine = self.engine
        asked = engine.command.copy()
        if not np.isfinite(asked).all():
            return engine.advance()  # refuses them
        over = engine.read("ended") > 0.0
        n_ended = 0
        n_lanes = engine.num_envs
        sums = np.zeros((len(self._summed), n_lanes))
        ends = np.zeros((ANSWER_FLAGS, n_lanes), dtype=np.bool_)
        for _ in range(self.repeat):
            engine.command[...] = toward(asked, self._in_force(), self.rate)
            n_ended += engine.advance(anew=anew)
            anew = False
            outputs = engine.outputs
            sums += outputs.outcomes[self._summed]
            ends |= outputs.flags[:ANSWER_FLAGS]

        outputs.outcomes[self._summed] = sums
        outputs.outcomes[1:ANSWER_OUTCOMES] = ends
        outputs.flags[:ANSWER_FLAGS] = ends
        if begin_ended and over.any():
            engine.begin_next(over)
        return n_ended

    def _in_force(self) -> Float32:
        """Commands of the interval before, shape (n_commands, num_envs)."""
        names = ("rudder_command", "shaft_command")[: len(self.engine.command)]
        return np.array([self.engine.read(name) for name in names], dtype=np.float32)


class Frames:
    """The last observations of each row, float32, shape (num_envs, depth, n_observed).

    `shown` is a new array after each change.
    """

    def __init__(self, num_envs: int, depth: int, n_observed: int) -> None:
        self.shown: Float32 = np.zeros((num_envs, depth, n_observed), dtype=np.float32)

    def add(self, observations: Float32) -> None:
        """Add the next observations, shape (num_envs, n_observed)."""
        self.shown = np.roll(self.shown, -1, axis=1)
        self.shown[:, -1] = observations

    def begin(self, observations: Float32, rows: Flags) -> None:
        """Fill rows whose episode begins with its first observation."""
        self.shown = self.shown.copy()
        self.shown[rows] = observations[rows, None]


def toward(outputs: Any, before: Any, rate_limit: float) -> Any:
    """Outputs limited to [-1, 1], and to a change of `rate_limit` from those before."""
    within = np.clip(outputs, -1.0, 1.0)
    return np.clip(within, before - rate_limit, before + rate_limit)
