"""Interface of what learns: an algorithm, its ships, and the policy so far."""

from collections.abc import Callable
from typing import Any, Protocol

from agents.policies.policy import LearnedPolicy


class Learner(Protocol):
    """An algorithm with its ships, under way.

    At a boundary, between an update and the next rollout, its state can be kept.
    """

    @property
    def steps(self) -> int:
        """Decisions learned from so far."""

    @property
    def training_seeds(self) -> tuple[int, int]:
        """First and last seed of the ships that it learns from."""

    def learn(self, total_steps: int, at_boundary: Callable[[], None]) -> None:
        """Learn up to the total; `at_boundary` is called before each rollout.

        Raises InputError if the training diverges.
        """

    def policy(self) -> LearnedPolicy:
        """Return the policy so far; raises InputError if it is not finite."""

    def mean_return(self) -> float | None:
        """Mean return of the last episodes learned from; None before the first."""

    def note_cost(self, cost: float) -> None:
        """Write the cost of an evaluation into the log, where there is one."""

    def state(self) -> dict[str, Any]:
        """Return all that later steps depend on (`nested_values`)."""

    def restore(self, state: Any) -> None:
        """Go on from a state; raises ValueError for one that does not fit."""

    def close(self) -> None:
        """Close the log."""
