"""Controllers with a memory: the state that `predict` takes and returns, one row for each ship."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from agents.controllers.controller import Controller
from agents.controllers.memory import Flags, Floats


@dataclass(frozen=True, eq=False)
class Stateful(Controller):
    """A controller that remembers. What it remembers is in the state, never in the controller itself."""

    @property
    @abstractmethod
    def memory_size(self) -> int:
        """How many numbers it remembers of each ship."""

    @abstractmethod
    def steer(self, seen: dict[str, Floats], memory: Floats, begins: Flags) -> tuple[Floats, Floats]:
        """See `Controller.steer`."""
