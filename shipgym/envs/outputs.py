"""Output buffers: the arrays that a step writes and users are given."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

STEP_OUTCOME = 3  # reward, terminated, truncated come before what is in `info`
STEP_FLAGS = 2  # terminated, truncated come before the flags in `info`


@dataclass(slots=True, eq=False)
class Outputs:
    """One step's arrays, in one block of memory."""

    observations: NDArray[np.float32]  # (num_envs, n_observed)
    outcomes: NDArray[
        np.float64
    ]  # (n_outcomes, num_envs): reward, terminated, truncated, then `info`
    flags: NDArray[
        np.bool_
    ]  # (n_flags, num_envs): terminated, truncated, then those of `info`
    terminated: NDArray[np.bool_]  # (num_envs,): a view of flags[0]
    truncated: NDArray[np.bool_]  # (num_envs,): a view of flags[1]
    words: NDArray[np.int64]  # (9,): addresses and shapes of the three, by turns

    def take(self, other: Self) -> None:
        """Copy what others hold."""
        for name in ("outcomes", "observations", "flags"):
            getattr(self, name)[:] = getattr(other, name)


class OutputPool:
    """Output buffers of one engine; the memory of those that nobody holds any more is used again.

    To ask the system for memory in each step would take longer than to sail hundreds of
    ships. What a user keeps, an array or a view of one, stays as it is.
    """

    def __init__(
        self, num_envs: int, n_observed: int, n_outcomes: int, n_flags: int
    ) -> None:
        self._seen, self._flags = (
            8 * n_outcomes * num_envs,
            (8 * n_outcomes + 4 * n_observed) * num_envs,
        )
        self._size = self._flags + n_flags * num_envs
        self._shapes = (
            (num_envs, n_observed),
            (n_outcomes, num_envs),
            (n_flags, num_envs),
        )
        self._free: list[tuple[bytearray, NDArray[np.int64]]] = []

    def take(self) -> Outputs:
        """Buffers that nobody else holds."""
        given = self._free.pop() if self._free else self._new()
        block = _Lease(self._size, np.uint8, given[0])
        block.given, block.free = given, self._free
        seen, outcomes, flags = self._shapes
        ends = np.ndarray(flags, np.bool_, block, self._flags)
        return Outputs(
            np.ndarray(seen, np.float32, block, self._seen),
            np.ndarray(outcomes, np.float64, block),
            ends,
            ends[0],
            ends[1],
            given[1],
        )

    def _new(self) -> tuple[bytearray, NDArray[np.int64]]:
        memory = bytearray(self._size)
        start = np.frombuffer(memory, np.uint8).ctypes.data
        seen, outcomes, flags = self._shapes
        words = [
            start + self._seen,
            *seen,
            start,
            *outcomes,
            start + self._flags,
            *flags,
        ]
        return memory, np.array(words, dtype=np.int64)


class _Lease(np.ndarray[Any, Any]):
    """Memory that is lent to arrays, and goes back when the last of them, and of their views, is gone."""

    given: Any
    free: list[Any]

    def __del__(self) -> None:
        self.free.append(self.given)


def named_rows(
    outcomes: Any, flags: Any, names: Sequence[str], flag_names: Sequence[str]
) -> dict[str, Any]:
    """Rows of outcomes and flags by name, without those that `step` answers."""
    rows = [
        *outcomes[STEP_OUTCOME:],
        *flags[STEP_FLAGS:],
    ]  # a flag's own row behind that of its number
    return dict(zip([*names, *flag_names], rows, strict=True))
