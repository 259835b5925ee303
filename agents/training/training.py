"""Training: agents learn on many ships at once, are evaluated on episodes held out, and can be resumed.

A run can be killed at any moment. It goes on at the last boundary between a rollout and
the next that was kept, and ends with the same policy, bit for bit, as if nothing had
happened (same machine, same versions).
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.agent_file import load_agent
from agents.controllers.controller import Policy
from agents.controllers.designs import design, design_base
from agents.output import in_use
from agents.policies.policy import LearnedPolicy
from agents.rollouts.rollout import check_fits, episode_costs
from agents.suites.suite import BenchmarkTask
from agents.training import run_folder
from agents.training.plan import EVALUATION_SEED, N_EVALUATIONS, Plan
from agents.training.safe_file import read_values, write_values
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

REACHED = (
    1.001  # of LQ's cost: a network that has learned nothing yet adds nearly nothing
)
CHECKPOINT_SECONDS = 45.0  # with a rollout on top a checkpoint is at most a minute old


class HeldOut:
    """Episodes of a task that are not learned from, with seeds from `first` on, and what LQ costs on them.

    LQ follows paths by the course that the task shows.
    """

    def __init__(
        self, task: BenchmarkTask, first: int, number: int, threads: int = 1
    ) -> None:
        self.engine, self.seeds = (
            task.engine(number, threads=threads),
            first + np.arange(number),
        )
        lq = None
        if task.task.action == "rudder":
            with suppress(InputError):
                designed = design("lq", task)
                check_fits(designed, task.task, task.ship, "lq")
                lq = designed
        #: Mean cost of LQ designed on the task's ship; None where there is none for
        #: her.
        self.lq_cost = None if lq is None else self.cost(lq)

    def cost(self, policy: Policy) -> float:
        """Mean cost of a policy."""
        return float(episode_costs(policy, self.engine, self.seeds).mean())


class Progress(NamedTuple):
    """How far a training is."""

    #: decisions learned from, and to learn from
    steps: int
    total: int
    seconds: float  # spent so far, those before it was resumed among them
    #: mean cost of the episodes held out, at the last evaluation, at the best one, and
    #: of LQ
    cost: float | None
    best_cost: float | None
    lq_cost: float | None
    evaluated: bool = False  # whether there is a new evaluation


@dataclass(frozen=True)
class TrainingResult:
    """The result of a training."""

    plan: Plan  # the run
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
    seconds: float  # of training and evaluation, those before it was resumed among them
    finished: bool  # false where the time was up before
    resumed_from: int | None  # steps of the checkpoint that it went on from

    @property
    def lq_reached(self) -> Mapping[str, Any] | None:
        """The first evaluation that cost no more than LQ, to a thousandth; None if there was none."""
        limit = -np.inf if self.lq_cost is None else REACHED * self.lq_cost
        return next((row for row in self.curve if row["cost"] <= limit), None)

    def to_dict(self) -> dict[str, Any]:
        """For programs."""
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
    plan: Plan,
    out: str | Path | None = None,
    *,
    resume: bool = False,
    max_seconds: float | None = None,
    tell: Callable[[Progress], None] | None = None,
    command: str | None = None,
) -> TrainingResult:
    """Train an agent.

    Raises InputError if another process uses the folder; if it holds something already,
    or, to resume, nothing or a run of another configuration; if the ship and the
    settings do not go together; or if the networks diverge.

    Parameters
    ----------
    plan : Plan
        What is learned; `make_plan` reads it.
    out : str or Path, optional
        Folder of the run (`run_folder`); by default nothing is written.
    resume : bool
        Continue the run in the folder.
    max_seconds : float, optional
        Time after which the training stops at the next boundary; it can be resumed.
    tell : callable, optional
        Called with the progress at each boundary. What it raises ends the training.
    command : str, optional
        Command line that is written into the run's folder.
    """
    folder = None if out is None else Path(out)
    if resume and folder is None:
        raise InputError("resume: found without a folder, expected the one of the run")
    with (
        _torch_threads(plan.threads),
        nullcontext() if folder is None else in_use(folder),
    ):
        if folder is None:
            return _Training(plan, None, tell, max_seconds).run()
        (
            run_folder.check_resumable(folder, plan)
            if resume
            else run_folder.check_new(folder)
        )
        training = _Training(plan, folder, tell, max_seconds)
        if resume:
            training.restore(folder / run_folder.CHECKPOINT)
        else:
            run_folder.begin_folder(
                folder, plan, command or f"train({plan.algorithm!r})"
            )
        return training.run()


class _TimeIsUpError(Exception):
    """Ends the training at a boundary."""


class _Training(BaseCallback):  # type: ignore[misc]  # stable-baselines3 is not type-checked here
    """A training under way, which is called at each boundary between an update and the next rollout."""

    def __init__(
        self,
        plan: Plan,
        folder: Path | None,
        tell: Callable[[Progress], None] | None,
        max_seconds: float | None,
    ) -> None:
        super().__init__()
        self.plan, self.folder, self.tell, self.max_seconds = (
            plan,
            folder,
            tell,
            max_seconds,
        )
        self.started = time.monotonic()
        base = design_base(plan.settings.base, plan.task)
        self.held_out = HeldOut(plan.task, EVALUATION_SEED, N_EVALUATIONS, plan.threads)
        self.agent = make_agent(plan, base)
        self.policy: LearnedPolicy | None = None
        #: What evaluations found so far.
        self.found: dict[str, Any] = {"best_cost": None, "best_steps": 0, "curve": []}
        self.seconds_before = 0.0
        self.kept_at = -np.inf
        self.resumed_from: int | None = None

    def run(self) -> TrainingResult:
        """Learn to the end, or until the time is up."""
        self.agent.set_logger(_logger(self.folder))
        left = self.plan.settings.total_steps - self.agent.num_timesteps
        try:
            if left > 0:
                self.agent.learn(left, self, reset_num_timesteps=False)
        except (
            _TimeIsUpError
        ):  # kept, and no evaluation that a run without an end would not have
            return self._result(finished=False)
        except (
            ValueError
        ) as error:  # torch refuses to draw from a distribution that is not one
            if "invalid values" not in str(error):
                raise
            raise self._diverged() from error
        if self._evaluated("steps", -1) < self.agent.num_timesteps:
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
        if (
            policy is None and self.folder is not None
        ):  # found before the run was resumed
            policy = load_agent(self.folder / run_folder.AGENT)
        found = self.found | {"curve": tuple(self.found["curve"])}
        return TrainingResult(
            self.plan,
            policy,
            steps=self.agent.num_timesteps,
            lq_cost=self.held_out.lq_cost,
            seconds=self.seconds,
            finished=finished,
            resumed_from=self.resumed_from,
            **found,
        )

    def _evaluated(self, name: str, otherwise: Any) -> Any:
        """A figure of the last evaluation."""
        return self.found["curve"][-1][name] if self.found["curve"] else otherwise

    @property
    def seconds(self) -> float:
        """Spent so far, those before it was resumed among them."""
        return self.seconds_before + time.monotonic() - self.started

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        """Evaluate and keep the run when it is time to; stop when the time is up."""
        steps, every = self.agent.num_timesteps, self.plan.settings.evaluate_every
        due = steps // every > self._evaluated("steps", -every) // every
        if due:
            self.evaluate()
        if self.tell is not None:
            cost, best = self._evaluated("cost", None), self.found["best_cost"]
            total, lq = self.plan.settings.total_steps, self.held_out.lq_cost
            self.tell(Progress(steps, total, self.seconds, cost, best, lq, due))
        if time.monotonic() - self.kept_at >= CHECKPOINT_SECONDS:
            self.keep()
        set_deviation(self.agent, self.plan.settings)
        if (
            self.max_seconds is not None
            and time.monotonic() - self.started >= self.max_seconds
        ):
            self.keep()
            raise _TimeIsUpError

    def evaluate(self) -> None:
        """Run the held-out episodes; keep the policy if it is the best."""
        steps = self.agent.num_timesteps
        if not all(
            bool(weight.isfinite().all()) for weight in self.agent.policy.parameters()
        ):
            raise self._diverged()
        policy = LearnedPolicy.from_sb3(self.agent)
        cost = self.held_out.cost(policy)
        returns = [episode["r"] for episode in self.agent.ep_info_buffer]
        mean = sum(returns) / len(returns) if returns else None
        row = {
            "steps": steps,
            "seconds": round(self.seconds, 3),
            "cost": cost,
            "mean_return": mean,
        }
        self.found["curve"].append(row)
        self.agent.logger.record("evaluation/cost", cost)
        policy = replace(policy, training=self._record())
        best = self.found["best_cost"] is None or cost < self.found["best_cost"]
        if best:
            self.policy = policy
            self.found |= {"best_cost": cost, "best_steps": steps}
        if self.folder is not None:
            for name in [run_folder.LAST] + [run_folder.AGENT] * best:
                policy.save(self.folder / name)
            write_json(
                {"lq_cost": self.held_out.lq_cost, **self.found},
                self.folder / run_folder.PROGRESS,
            )

    def _record(self) -> dict[str, Any]:
        """How a policy was made; without times, so that the same run writes the same file."""
        plan = self.plan
        return {
            **plan.configuration(),
            "training_seeds": [
                plan.training_seed,
                plan.training_seed + plan.settings.ships - 1,
            ],
            "evaluation_seeds": [EVALUATION_SEED, EVALUATION_SEED + N_EVALUATIONS - 1],
            "steps": self.agent.num_timesteps,
            "cost": self._evaluated("cost", None),
            "lq_cost": self.held_out.lq_cost,
            "curve": [[row["steps"], row["cost"]] for row in self.found["curve"]],
            "versions": run_folder.versions(),
        }

    def keep(self) -> None:
        """Write the run as it is, whole or not at all."""
        self.kept_at = time.monotonic()
        if self.folder is None:
            return
        own = {**self.found, "seconds": self.seconds}
        write_values(
            {"run": own, "agent": checkpoints.take(self.agent)},
            self.folder / run_folder.CHECKPOINT,
        )

    def restore(self, checkpoint: Path) -> None:
        """Resume from a checkpoint; a run that was killed before its first one starts again."""
        self.resumed_from = 0
        if not checkpoint.exists():
            return
        content = read_values(checkpoint, "checkpoint of a training")
        try:
            own = content["run"]
            checkpoints.check_record(own)
            checkpoints.put_back(self.agent, content["agent"])
            self.found = {name: own[name] for name in self.found}
            self.seconds_before = own["seconds"]
        except (KeyError, TypeError, ValueError, RuntimeError, AttributeError) as error:
            why = (
                str(error).partition("\n")[0].rstrip(" :")
            )  # torch lists every network's layer after it
            raise InputError(
                f"{checkpoint}: does not fit this run ({why}); start a new run"
            ) from None
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
    """TensorBoard's log, where there is a folder and TensorBoard is installed."""
    formats: list[Any] = []
    if folder is not None:
        with suppress(ImportError, AssertionError):
            formats.append(
                TensorBoardOutputFormat(str(folder / run_folder.TENSORBOARD))
            )
    return Logger(None, formats)
