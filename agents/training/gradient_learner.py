"""Learning by gradients: an agent of stable-baselines3 and its ships."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from agents.controllers.controller import Controller
from agents.policies.policy import LearnedPolicy
from agents.training import run_folder
from agents.training.plan import TrainingPlan
from shipgym.errors import InputError

try:
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat

    from agents.training import checkpoints
    from agents.training.algorithms import (
        gradient_settings,
        make_agent,
        set_deviation,
    )
except ModuleNotFoundError as error:
    raise InputError(
        f"{error.name} is not installed, training needs it: pip install 'shipgym[rl]'"
    ) from None


class GradientLearner:
    """An agent that learns by gradients, as `Learner` has it."""

    def __init__(
        self, plan: TrainingPlan, base: Controller | None, folder: Path | None
    ) -> None:
        self.plan = plan
        self.settings = gradient_settings(plan)
        self.folder = folder
        with _torch_threads(plan.threads):
            self.agent = make_agent(plan, base)

    @property
    def steps(self) -> int:
        """Decisions learned from so far."""
        return int(self.agent.num_timesteps)

    @property
    def training_seeds(self) -> tuple[int, int]:
        """First and last seed of the ships that it learns from."""
        first = self.plan.training_seed
        return first, first + self.settings.ships - 1

    def learn(self, total_steps: int, at_boundary: Callable[[], None]) -> None:
        """Learn up to the total; `at_boundary` is called before each rollout."""

        def before_rollout() -> None:
            at_boundary()
            set_deviation(self.agent, self.settings)

        self.agent.set_logger(_logger(self.folder))
        left = total_steps - self.steps
        if left <= 0:
            return
        boundary = _Boundary(before_rollout)
        try:
            with _torch_threads(self.plan.threads):
                self.agent.learn(left, boundary, reset_num_timesteps=False)
        except ValueError as error:
            # torch refuses to draw from a distribution that is not one
            if "invalid values" not in str(error):
                raise
            raise self._diverged() from error

    def policy(self) -> LearnedPolicy:
        """Return the policy so far; raises InputError if it is not finite."""
        for weight in self.agent.policy.parameters():
            if not bool(weight.isfinite().all()):
                raise self._diverged()
        return LearnedPolicy.from_sb3(self.agent)

    def _diverged(self) -> InputError:
        return InputError(
            f"training diverged after {self.steps} steps: the network's weights are not"
            " finite; lower learning_rate, or raise reward_scale"
        )

    def mean_return(self) -> float | None:
        """Mean return of the last episodes learned from; None before the first."""
        returns = [episode["r"] for episode in self.agent.ep_info_buffer]
        return sum(returns) / len(returns) if returns else None

    def note_cost(self, cost: float) -> None:
        """Write the cost of an evaluation into TensorBoard's log."""
        self.agent.logger.record("evaluation/cost", cost)

    def state(self) -> dict[str, Any]:
        """Return all that later steps depend on."""
        return checkpoints.agent_state(self.agent)

    def restore(self, state: Any) -> None:
        """Go on from a state; raises ValueError for one that does not fit."""
        try:
            checkpoints.restore_agent(self.agent, state)
        except RuntimeError as error:  # of torch
            raise ValueError(str(error)) from None

    def close(self) -> None:
        """Close the log."""
        self.agent.logger.close()


class _Boundary(BaseCallback):  # type: ignore[misc]  # stable-baselines3 is not type-checked here
    """Calls a function before each rollout."""

    def __init__(self, before_rollout: Callable[[], None]) -> None:
        super().__init__()
        self.before_rollout = before_rollout

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self.before_rollout()


@contextmanager
def _torch_threads(number: int) -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(number)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _logger(folder: Path | None) -> Logger:
    """Log for TensorBoard, where there is a folder and TensorBoard is installed."""
    formats: list[Any] = []
    if folder is not None:
        with suppress(ImportError, AssertionError):
            log = TensorBoardOutputFormat(str(folder / run_folder.TENSORBOARD))
            formats.append(log)
    return Logger(None, formats)
