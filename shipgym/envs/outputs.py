"""Output buffers: the arrays that a step writes and returns to users."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Flags, Floats
from shipgym.engine.lane_records import CONSTRAINT
from shipgym.engine.memory import WORD, allocated

ANSWER_OUTCOMES = 3  # reward, terminated, truncated: rows before those of `info`
ANSWER_FLAGS = 2  # terminated, truncated


@dataclass(slots=True, eq=False)
class Outputs:
    """Arrays of one step, in one block of memory."""

    memory: Floats  # all of them, as loops take them
    observations: NDArray[np.float32]  # (num_envs, n_observed)
    # (n_outcomes, num_envs): reward, terminated, truncated, then `info`
    outcomes: Floats
    flags: Flags  # (n_flags, num_envs): terminated, truncated, then those of `info`
    terminated: Flags  # (num_envs,): a view of flags[0]
    truncated: Flags  # (num_envs,): a view of flags[1]

    def take(self, other: Self) -> None:
        """Copy the content of others."""
        self.memory[:] = other.memory


class EpisodeInfo(dict[str, Any]):
    """Info with the `episode_cost` so far, which is `info["episode"]["cost"]` too.

    The entry is not stored: Gymnasium's RecordEpisodeStatistics refuses an info that
    holds one. What that, or stable-baselines3's monitors, store there gets the cost.
    """

    def __missing__(self, key: str) -> Any:
        if key != "episode":
            raise KeyError(key)
        return {"cost": self.get("final_info", self)["episode_cost"]}

    def __setitem__(self, key: str, value: Any) -> None:
        if key == "episode":
            value = {**self.__missing__(key), **value}
        super().__setitem__(key, value)

    def copy(self) -> Self:
        """Copy it, as VecMonitor of stable-baselines3 does."""
        return type(self)(self)


def gather_constraints(
    info: dict[str, Any],
    names: Sequence[str],
    as_cost: bool,
) -> None:
    """Move constraints into `info["constraints"]`; with `as_cost` they are the cost.

    What was the cost is then the `objective`.
    """
    info["constraints"] = {name: info.pop(f"{CONSTRAINT}{name}") for name in names}
    if as_cost:
        info["objective"] = info["cost"]
        info["cost"] = sum(info["constraints"].values())


class OutputPool:
    """Output buffers of one engine; memory that is no longer referenced is reused.

    Allocating memory in each step would take longer than the step of hundreds of ships.
    Arrays and views that a user keeps do not change.

    Attributes
    ----------
    blocks : dict
        Location of each table in the memory, by name.
    """

    def __init__(
        self,
        num_envs: int,
        n_observed: int,
        n_outcomes: int,
        n_flags: int,
    ) -> None:
        tables: dict[str, NDArray[Any]] = {
            "observations": np.zeros((num_envs, n_observed), dtype=np.float32),
            "outcomes": np.zeros((n_outcomes, num_envs)),
            "flags": np.zeros((n_flags, num_envs), dtype=np.bool_),
        }
        self.blocks, self._size = allocated(tables)
        places = self.blocks.values()
        self._shapes = [(at.rows, at.columns) for at in places]
        self._firsts = [WORD * at.first for at in places]
        self._free: list[bytearray] = []

    def take(self) -> Outputs:
        """Return buffers that are not in use."""
        memory = self._free.pop() if self._free else bytearray(WORD * self._size)
        lease = _Lease(self._size, np.float64, memory)
        lease.memory = memory
        lease.free = self._free

        observations, outcomes, flags = self._shapes
        first_observation, first_outcome, first_flag = self._firsts
        ends = np.ndarray(flags, np.bool_, lease, first_flag)
        return Outputs(
            memory=np.ndarray(self._size, np.float64, lease),
            observations=np.ndarray(
                observations,
                np.float32,
                lease,
                first_observation,
            ),
            outcomes=np.ndarray(outcomes, np.float64, lease, first_outcome),
            flags=ends,
            terminated=ends[0],
            truncated=ends[1],
        )


class _Lease(np.ndarray[Any, Any]):
    """Buffer returned to the pool when its last array or view is garbage-collected."""

    memory: bytearray
    free: list[bytearray]

    def __del__(self) -> None:
        self.free.append(self.memory)


def named_rows(
    outcomes: Any,
    flags: Any,
    names: Sequence[str],
    flag_names: Sequence[str],
) -> dict[str, Any]:
    """Rows of outcomes and flags by name, but for the answer of a step.

    The row of a flag replaces that of its number.
    """
    numbers = outcomes[ANSWER_OUTCOMES:]
    rows = dict(zip(names, numbers, strict=True))
    truths = flags[ANSWER_FLAGS:]
    rows.update(zip(flag_names, truths, strict=True))
    return rows
