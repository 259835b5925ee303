"""Output buffers: the arrays that a step writes and users are given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

STEP_OUTCOME = 3  # reward, terminated, truncated come before what is in `info`
STEP_FLAGS = 2  # terminated, truncated come before the flags in `info`


class Outputs:
    """One step's arrays, in one block of memory.

    Parameters
    ----------
    num_envs, n_observed, n_outcomes, n_flags : int
        Number of lanes, of quantities that are observed, of outcomes and of flags.

    Attributes
    ----------
    observations : float32 array of shape (num_envs, n_observed)
    outcomes : float64 array of shape (n_outcomes, num_envs)
        Reward, terminated, truncated, then what is in `info`.
    flags : bool array of shape (n_flags, num_envs)
        Terminated, truncated, then the flags in `info`.
    words : tuple of int
        Addresses and shapes of the three, by turns.
    """

    __slots__ = ("flags", "observations", "outcomes", "words")

    def __init__(self, num_envs: int, n_observed: int, n_outcomes: int, n_flags: int) -> None:
        seen, shown = 8 * n_outcomes * num_envs, 4 * n_observed * num_envs
        block = np.empty(seen + shown + n_flags * num_envs, dtype=np.uint8)
        self.outcomes: NDArray[np.float64] = np.ndarray((n_outcomes, num_envs), np.float64, block)
        self.observations: NDArray[np.float32] = np.ndarray((num_envs, n_observed), np.float32, block, seen)
        self.flags: NDArray[np.bool_] = np.ndarray((n_flags, num_envs), np.bool_, block, seen + shown)
        start = block.__array_interface__["data"][0]
        self.words = (
            start + seen, num_envs, n_observed, start, n_outcomes, num_envs, start + seen + shown,
            n_flags, num_envs,
        )  # fmt: skip

    def take(self, other: Outputs) -> None:
        """Copy what others hold."""
        self.outcomes[:], self.observations[:], self.flags[:] = (
            other.outcomes,
            other.observations,
            other.flags,
        )

    @property
    def terminated(self) -> NDArray[np.bool_]:
        """Whether episodes have come to an end."""
        row: NDArray[np.bool_] = self.flags[0]
        return row

    @property
    def truncated(self) -> NDArray[np.bool_]:
        """Whether episodes have run out of time."""
        row: NDArray[np.bool_] = self.flags[1]
        return row


def named_rows(outcomes: Any, flags: Any, names: Sequence[str], flag_names: Sequence[str]) -> dict[str, Any]:
    """Rows of outcomes and flags by name, without those that `step` answers."""
    infos = dict(zip(names, outcomes[STEP_OUTCOME:], strict=True))
    infos.update(zip(flag_names, flags[STEP_FLAGS:], strict=True))
    return infos
