"""Training of agents on many ships at once, evaluated on episodes held out.

A run can be killed at any moment. It goes on at the last boundary between a rollout and
the next that was kept, and ends with the same policy, bit for bit, as if nothing had
happened (same machine, same versions).
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.agent_file import load_agent
from agents.controllers.designs import design_base
from agents.output import in_use
from agents.policies.policy import LearnedPolicy
from agents.training import run_folder
from agents.training.evaluation import Evaluations, HeldOut
from agents.training.nested_values import read_values, write_values
from agents.training.plan import EVALUATION_SEED, N_EVALUATIONS, TrainingPlan
from shipgym.errors import InputError
from shipgym.files import write_json

try:
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat

    from agents.training import checkpoints
    from agents.training.algorithms import make_agent, set_deviation
except ModuleNotFoundError as error:
    raise InputError(
        f"{error.name} is not installed, training needs it: pip install 'shipgym[rl]'"
    ) from None


class TrainingProgress(NamedTuple):
    """Progress of a training."""

    #: decisions learned from, and to learn from
    steps: int
    total: int
    seconds: float  # spent so far, also before it was resumed
    #: mean cost of the episodes held out, at the last evaluation, at the best one, and
    #: of LQ
    cost: float | None
    best_cost: float | None
    lq_cost: float | None
    evaluated: bool = False  # there is a new evaluation


@dataclass(frozen=True)
class TrainingResult:
    """The result of a training."""

    plan: TrainingPlan
    policy: LearnedPolicy  # the best one
    #: evaluations: steps, seconds, cost on the episodes held out, mean return of those
    #: learned from
    curve: tuple[Mapping[str, Any], ...]
    # mean cost of the policy on the episodes held out, which it was chosen by
    best_cost: float
    #: when the policy was found, and when the training ended
    best_steps: int
    steps: int
    lq_cost: float | None  # of LQ on the same episodes
    seconds: float  # of training and evaluation, also before it was resumed
    finished: bool  # false where the time was up before
    resumed_from: int | None  # steps of the checkpoint that it went on from

    @property
    def lq_reached(self) -> Mapping[str, Any] | None:
        """First evaluation that cost no more than LQ, to a thousandth, if any.

        A network that has learned nothing yet adds nearly nothing to its base.
        """
        if self.lq_cost is None:
            return None
        for evaluation in self.curve:
            if evaluation["cost"] <= 1.001 * self.lq_cost:
                return evaluation
        return None

    def to_dict(self) -> dict[str, Any]:
        """Return the result for programs."""
        return {
            "configuration": self.plan.configuration(),
            "steps": self.steps,
            "finished": self.finished,
            "resumed_from": self.resumed_from,
            "seconds": self.seconds,
            "best_cost": self.best_cost,
            "best_steps": self.best_steps,
            "lq_cost": self.lq_cost,
            "lq_reached": self.lq_reached,
            "curve": list(self.curve),
        }


def train(
    plan: TrainingPlan,
    out: str | Path | None = None,
    *,
    resume: bool = False,
    max_seconds: float | None = None,
    on_progress: Callable[[TrainingProgress], None] | None = None,
    command: str | None = None,
    evaluation_episodes: int = N_EVALUATIONS,
    checkpoint_seconds: float = 45.0,
) -> TrainingResult:
    """Train an agent.

    Raises InputError if another process uses the folder; if it holds something already,
    or, to resume, nothing or a run of another configuration; if the ship and the
    settings do not go together; or if the networks diverge.

    Parameters
    ----------
    plan : TrainingPlan
        What is learned; `make_plan` makes it.
    out : str or Path, optional
        Folder of the run (`run_folder`); by default nothing is written.
    resume : bool
        Continue the run in the folder.
    max_seconds : float, optional
        Time of learning, without that of setting up and of evaluations, after which
        the training stops at the next boundary; it can be resumed.
    on_progress : callable, optional
        Called with the progress at each boundary. An exception of it ends the training.
    command : str, optional
        Command line that is written into the run's folder.
    evaluation_episodes : int
        Episodes held out, on which the policy is chosen.
    checkpoint_seconds : float
        Least time between checkpoints. With a rollout on top, one is at most a minute
        old by default.
    """
    if resume and out is None:
        raise InputError("resume: expected the folder of the run, got none")
    folder = None if out is None else Path(out)
    with ExitStack() as stack:
        stack.enter_context(_torch_threads(plan.threads))
        if folder is not None:
            stack.enter_context(in_use(folder))
            if resume:
                run_folder.check_resumable(folder, plan)
            else:
                run_folder.check_new(folder)

        run = TrainingRun(plan, folder, evaluation_episodes, checkpoint_seconds)
        if folder is not None:
            if resume:
                run.restore(folder / run_folder.CHECKPOINT)
            else:
                words = command or f"train({plan.algorithm!r})"
                run_folder.begin_folder(folder, plan, words)
        return run.learn(max_seconds, on_progress)


class _TimeIsUpError(Exception):
    """Ends the training at a boundary."""


class TrainingRun(BaseCallback):  # type: ignore[misc]  # stable-baselines3 is not type-checked here
    """A training under way; called at each boundary between update and rollout."""

    def __init__(
        self,
        plan: TrainingPlan,
        folder: Path | None,
        evaluation_episodes: int,
        checkpoint_seconds: float,
    ) -> None:
        super().__init__()
        self.started = time.monotonic()
        self.plan = plan
        self.folder = folder
        self.evaluation_episodes = evaluation_episodes
        self.checkpoint_seconds = checkpoint_seconds
        self.max_seconds: float | None = None
        self.learning_since = self.started
        #: Time spent on evaluations since then, s.
        self.evaluating = 0.0
        self.on_progress: Callable[[TrainingProgress], None] | None = None

        base = design_base(plan.settings.base, plan.task)
        self.held_out = HeldOut(
            plan.task, EVALUATION_SEED, evaluation_episodes, plan.threads
        )
        self.agent = make_agent(plan, base)
        self.policy: LearnedPolicy | None = None
        self.evaluations = Evaluations()
        self.seconds_before = 0.0
        self.kept_at = -np.inf
        self.resumed_from: int | None = None

    def learn(
        self,
        max_seconds: float | None,
        on_progress: Callable[[TrainingProgress], None] | None,
    ) -> TrainingResult:
        """Learn to the end, or until the time is up."""
        self.max_seconds = max_seconds
        self.on_progress = on_progress
        self.learning_since = time.monotonic()
        self.evaluating = 0.0
        self.agent.set_logger(_logger(self.folder))
        left = self.plan.settings.total_steps - self.agent.num_timesteps
        try:
            if left > 0:
                self.agent.learn(left, self, reset_num_timesteps=False)
        except _TimeIsUpError:
            # kept, and no evaluation that a run without an end would not have
            return self._result(finished=False)
        except ValueError as error:
            # torch refuses to draw from a distribution that is not one
            if "invalid values" not in str(error):
                raise
            raise self._diverged() from error

        if self.evaluations.last_steps != self.agent.num_timesteps:
            self.evaluate()
        self.keep()
        return self._result(finished=True)

    def _diverged(self) -> InputError:
        steps = self.agent.num_timesteps
        return InputError(
            f"training diverged after {steps} steps: the network's weights are not"
            " finite; lower learning_rate, or raise reward_scale"
        )

    def _result(self, finished: bool) -> TrainingResult:
        self.agent.logger.close()
        policy: Any = self.policy
        if policy is None and self.folder is not None:
            # found before the run was resumed
            policy = load_agent(self.folder / run_folder.AGENT)
        best_cost: Any = self.evaluations.best_cost
        return TrainingResult(
            self.plan,
            policy,
            curve=tuple(self.evaluations.curve),
            best_cost=best_cost,
            best_steps=self.evaluations.best_steps,
            steps=self.agent.num_timesteps,
            lq_cost=self.held_out.lq_cost,
            seconds=self.seconds,
            finished=finished,
            resumed_from=self.resumed_from,
        )

    @property
    def seconds(self) -> float:
        """Time spent so far, also before the run was resumed."""
        return self.seconds_before + time.monotonic() - self.started

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        """Evaluate and keep the run when it is time to; stop when the time is up."""
        settings = self.plan.settings
        due = self.evaluations.due(self.agent.num_timesteps, settings.evaluate_every)
        if due:
            self.evaluate()
        if self.on_progress is not None:
            self.on_progress(self.progress(due))
        if time.monotonic() - self.kept_at >= self.checkpoint_seconds:
            self.keep()
        set_deviation(self.agent, settings)

        learning = time.monotonic() - self.learning_since - self.evaluating
        if self.max_seconds is not None and learning >= self.max_seconds:
            self.keep()
            raise _TimeIsUpError

    def progress(self, evaluated: bool) -> TrainingProgress:
        """Return how far the training is, with a new evaluation or without."""
        return TrainingProgress(
            steps=self.agent.num_timesteps,
            total=self.plan.settings.total_steps,
            seconds=self.seconds,
            cost=self.evaluations.last_cost,
            best_cost=self.evaluations.best_cost,
            lq_cost=self.held_out.lq_cost,
            evaluated=evaluated,
        )

    def evaluate(self) -> None:
        """Run the held-out episodes; keep the policy if it is the best."""
        for weight in self.agent.policy.parameters():
            if not bool(weight.isfinite().all()):
                raise self._diverged()
        policy = LearnedPolicy.from_sb3(self.agent)
        began = time.monotonic()
        cost = self.held_out.cost(policy)
        self.evaluating += time.monotonic() - began
        returns = [episode["r"] for episode in self.agent.ep_info_buffer]
        mean_return = sum(returns) / len(returns) if returns else None
        is_best = self.evaluations.add(
            steps=self.agent.num_timesteps,
            seconds=round(self.seconds, 3),
            cost=cost,
            mean_return=mean_return,
        )
        self.agent.logger.record("evaluation/cost", cost)

        policy = replace(policy, training=self._record())
        if is_best:
            self.policy = policy
        if self.folder is not None:
            self._write(policy, is_best, self.folder)

    def _write(self, policy: LearnedPolicy, is_best: bool, folder: Path) -> None:
        """Write an evaluated policy, and the evaluations so far."""
        policy.save(folder / run_folder.LAST)
        if is_best:
            policy.save(folder / run_folder.AGENT)
        evaluations = self.evaluations.to_dict()
        progress = {"lq_cost": self.held_out.lq_cost, **evaluations}
        write_json(progress, folder / run_folder.PROGRESS)

    def _record(self) -> dict[str, Any]:
        """Return how a policy was made, without times: the same run writes the same."""
        first = self.plan.training_seed
        last = first + self.plan.settings.ships - 1
        last_evaluated = EVALUATION_SEED + self.evaluation_episodes - 1
        return {
            **self.plan.configuration(),
            "training_seeds": [first, last],
            "evaluation_seeds": [EVALUATION_SEED, last_evaluated],
            "steps": self.agent.num_timesteps,
            "cost": self.evaluations.last_cost,
            "lq_cost": self.held_out.lq_cost,
            "curve": [[row["steps"], row["cost"]] for row in self.evaluations.curve],
            "versions": run_folder.versions(),
        }

    def keep(self) -> None:
        """Write the run as it is, whole or not at all."""
        self.kept_at = time.monotonic()
        if self.folder is None:
            return
        content = {
            "run": {**self.evaluations.to_dict(), "seconds": self.seconds},
            "agent": checkpoints.agent_state(self.agent),
        }
        write_values(content, self.folder / run_folder.CHECKPOINT)

    def restore(self, checkpoint: Path) -> None:
        """Resume from a checkpoint; a run killed before its first one starts again."""
        self.resumed_from = 0
        if not checkpoint.exists():
            return
        content = read_values(checkpoint, "checkpoint of a training")
        try:
            run = dict(content["run"])
            checkpoints.check_run(run)
            checkpoints.restore_agent(self.agent, content["agent"])
        except (KeyError, TypeError, ValueError, RuntimeError, AttributeError) as error:
            # torch lists every network's layer after it
            first_line, _, _ = str(error).partition("\n")
            why = first_line.rstrip(" :")
            raise InputError(
                f"{checkpoint}: does not fit this run ({why}); start a new run"
            ) from None
        self.seconds_before = run.pop("seconds")
        self.evaluations = Evaluations(**run)
        self.resumed_from = self.agent.num_timesteps


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
