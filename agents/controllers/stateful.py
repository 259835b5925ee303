"""Controllers with a memory: the state that `predict` takes and returns, one row for each ship."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from agents.controllers.controller import Action, Controller
from agents.controllers.memory import Flags, Floats, begun, checked_observation


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
        self, observation: ArrayLike, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Action, Any]:
        """See `Policy.predict`; the state is an array of shape (memory_size,) or (n, memory_size)."""
        n = len(self.observation_names)
        given = checked_observation(observation, self.observation_names)
        shape, size = given.shape[:-1], self.memory_size
        rows = np.atleast_2d(given)[:, :n] * self.observation_scales
        seen = dict(zip(self.observation_names, rows.T, strict=True))
        memory, begins = begun(state, episode_start, shape, size)
        order, kept = self.steer(seen, memory.reshape(len(rows), size), begins.reshape(-1))
        limit = self.observation_scales[self.observation_names.index("rudder")]
        action = np.clip(order / limit, -1.0, 1.0)[:, None].astype(np.float32)
        return action.reshape(*shape, 1), kept.reshape(*shape, size)
