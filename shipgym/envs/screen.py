"""Where a step of many ships is shown, and shown again when nobody looks any more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from sys import getrefcount
from typing import Any

import numpy as np
from numpy.typing import NDArray

STEP_OUTCOME = 3  # reward, terminated, truncated come before what is in `info`
STEP_FLAGS = 2  # terminated, truncated come before the flags in `info`


class Screen:
    """Arrays that the kernels write and users are given.

    Making arrays and the dictionary of their rows takes as long as sailing 64 ships, so a screen is used
    again: but only once no reference to any of its arrays is left outside it, so that what was given away
    never changes.

    Parameters
    ----------
    everyone : bool array of shape (num_envs,)
        The mask of infos that are of all rows.
    n_observed : int
        Number of quantities that are observed.
    names : sequence of str
        What is in `info`.
    flags : collection of str
        Those of them that are flags.

    Attributes
    ----------
    observations : float32 array of shape (num_envs, n_observed)
    outcomes : float64 array of shape (n_outcomes, num_envs)
        Reward, terminated, truncated, then what is in `info`.
    flags : bool array of shape (n_flags, num_envs)
        Terminated, truncated, then the flags in `info`.
    terminated, truncated : bool arrays of shape (num_envs,)
        Rows of `flags`.
    infos : dict
        Rows of the others by name, with their masks, as Gymnasium has it; to be copied.
    advance : callable
        One control interval, shown here (see `shown_by`).
    """

    advance: Callable[[bool], int]

    def __init__(
        self, everyone: NDArray[np.bool_], n_observed: int, names: Sequence[str], flags: Sequence[str]
    ) -> None:
        n = len(everyone)
        self.observations = np.empty((n, n_observed), dtype=np.float32)
        self.outcomes = np.empty((STEP_OUTCOME + len(names), n))
        self.flags = np.empty((STEP_FLAGS + len(flags), n), dtype=np.bool_)
        self.terminated, self.truncated = self.flags[:STEP_FLAGS]
        self.infos: dict[str, Any] = named_rows(self.outcomes, self.flags, names, flags)
        self._given = [
            self.observations, self.outcomes, self.flags, self.terminated, self.truncated,
            *self.infos.values(),
        ]  # fmt: skip
        self.infos.update(dict.fromkeys([f"_{name}" for name in names], everyone))

    def shown_by(self, advance: Callable[[bool], int]) -> None:
        """Take what shows a step here; references from now on are those of users."""
        self.advance = advance
        self._own = self._references()

    def _references(self) -> int:
        return sum(map(getrefcount, self._given))

    @property
    def is_free(self) -> bool:
        """Whether nobody holds an array of it, or a view of one."""
        return self._references() == self._own


def named_rows(outcomes: Any, flags: Any, names: Sequence[str], flag_names: Sequence[str]) -> dict[str, Any]:
    """Rows of outcomes and flags by name, without those that `step` answers."""
    infos = dict(zip(names, outcomes[STEP_OUTCOME:], strict=True))
    infos.update(zip(flag_names, flags[STEP_FLAGS:], strict=True))
    return infos
