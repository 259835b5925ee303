"""Controllers with a memory: the state that `predict` takes and hands back, one row for each ship."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import Action, Controller
from shipgym.errors import InputError

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Stateful(Controller):
    """A controller that remembers. What it remembers is in the state, never in the controller itself."""

    @property
    @abstractmethod
    def memory_size(self) -> int:
        """How many numbers it remembers of each ship."""

    @abstractmethod
    def steer(self, seen: dict[str, Floats], memory: Floats, begins: Flags) -> tuple[Floats, Floats]:
        """Commanded rudder and what is remembered next.

        Parameters
        ----------
        seen : dict of str to array of shape (n,)
            What is observed by name, SI units.
        memory : array of shape (n, memory_size)
            Zeros where an episode begins.
        begins : bool array of shape (n,)
            Whether it does.

        Returns
        -------
        order : array of shape (n,)
            Rad, not yet limited.
        memory : array of shape (n, memory_size)
        """

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Action, Any]:
        """Commanded rudder for one or many observations, with the signature of stable-baselines3.

        Parameters
        ----------
        observation : array-like of shape (n_observations,) or (n, n_observations)
            Of any of the environments, in its order.
        state : array of shape (memory_size,) or (n, memory_size), optional
            What the last call handed back; None where episodes begin.
        episode_start : bool or array-like of bool of shape (n,), optional
            Where an episode begins and the state is that of the one before.
        deterministic
            Not used: there is no chance in it.

        Returns
        -------
        action : float32 array of shape (1,) or (n, 1)
            Part of the rudder limit, in [-1, 1].
        state : array of shape (memory_size,) or (n, memory_size)
            For the next call.

        Raises
        ------
        InputError
            If the observation has fewer entries or another number of dimensions, or the state is not one
            of as many ships.
        """
        given, n = np.asarray(observation, dtype=np.float64), len(self.observation_names)
        if given.ndim not in (1, 2) or given.shape[-1] < n:
            raise InputError(f"observation: shape {given.shape} found, expected ({n},) or (n, {n}), or more")
        rows = np.atleast_2d(given)[:, :n] * self.observation_scales
        seen = dict(zip(self.observation_names, rows.T, strict=True))
        memory, begins = self._remembered(state, episode_start, len(rows), given.ndim)
        order, kept = self.steer(seen, memory, begins)
        limit = self.observation_scales[self.observation_names.index("rudder")]
        action = np.clip(order / limit, -1.0, 1.0)[:, None].astype(np.float32)
        return (action, kept) if given.ndim == 2 else (action[0], kept[0])

    def _remembered(self, state: Any, starts: Any, n: int, ndim: int) -> tuple[Floats, Flags]:
        """Memory of each ship, a copy with zeros where an episode begins."""
        size = self.memory_size
        if state is None:
            return np.zeros((n, size)), np.ones(n, dtype=np.bool_)
        memory = np.array(state, dtype=np.float64)
        expected = (n, size) if ndim == 2 else (size,)
        if memory.shape != expected:
            raise InputError(
                f"state: shape {memory.shape} found, expected {expected}: what the last predict of as many "
                f"ships handed back, or None where episodes begin"
            )
        memory = memory.reshape(n, size)
        begins = np.zeros(n, dtype=np.bool_)
        if starts is not None:
            flags = np.asarray(starts, dtype=np.bool_)
            if flags.size not in (1, n):
                raise InputError(f"episode_start: {flags.size} found, expected one for each of {n} ships")
            begins |= flags.reshape(-1)
        memory[begins] = 0.0
        return memory, begins


def heading_error(seen: dict[str, Floats]) -> Floats:
    """Heading error of each ship, rad, in (-pi, pi]."""
    error: Floats = np.arctan2(seen["heading_error_sin"], seen["heading_error_cos"])
    return error
