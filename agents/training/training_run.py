"""A training under way: what is evaluated, kept and resumed, whatever learns."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.agent_file import load_agent
from agents.controllers.controller import Controller
from agents.controllers.designs import design_base
from agents.policies.policy import LearnedPolicy
from agents.training import run_folder
from agents.training.evaluation import Evaluations, HeldOut, check_evaluations
from agents.training.learner import Learner
from agents.training.nested_values import read_values, write_values
from agents.training.plan import EVALUATION_SEED, TrainingPlan
from agents.training.result import TrainingProgress, TrainingResult
from shipgym.errors import InputError
from shipgym.files import write_json


class _TimeIsUpError(Exception):
    """Ends the training at a boundary."""


class TrainingRun:
    """A training under way, with its learner and its folder."""

    def __init__(
        self,
        plan: TrainingPlan,
        folder: Path | None,
        evaluation_episodes: int,
        checkpoint_seconds: float,
    ) -> None:
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
        self.learner = make_learner(plan, base, folder)
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
        try:
            self.learner.learn(self.plan.settings.total_steps, self._at_boundary)
        except _TimeIsUpError:
            # kept, and no evaluation that a run without an end would not have
            return self._result(finished=False)

        if self.evaluations.last_steps != self.learner.steps:
            self.evaluate()
        self.keep()
        return self._result(finished=True)

    def _result(self, finished: bool) -> TrainingResult:
        self.learner.close()
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
            steps=self.learner.steps,
            lq_cost=self.held_out.lq_cost,
            seconds=self.seconds,
            finished=finished,
            resumed_from=self.resumed_from,
        )

    @property
    def seconds(self) -> float:
        """Time spent so far, also before the run was resumed."""
        return self.seconds_before + time.monotonic() - self.started

    def _at_boundary(self) -> None:
        """Evaluate and keep the run when it is time to; stop when the time is up."""
        every = self.plan.settings.evaluate_every
        due = self.evaluations.due(self.learner.steps, every)
        if due:
            self.evaluate()
        if self.on_progress is not None:
            self.on_progress(self.progress(due))
        if time.monotonic() - self.kept_at >= self.checkpoint_seconds:
            self.keep()

        learning = time.monotonic() - self.learning_since - self.evaluating
        if self.max_seconds is not None and learning >= self.max_seconds:
            self.keep()
            raise _TimeIsUpError

    def progress(self, evaluated: bool) -> TrainingProgress:
        """Return how far the training is, with a new evaluation or without."""
        return TrainingProgress(
            steps=self.learner.steps,
            total=self.plan.settings.total_steps,
            seconds=self.seconds,
            cost=self.evaluations.last_cost,
            best_cost=self.evaluations.best_cost,
            lq_cost=self.held_out.lq_cost,
            evaluated=evaluated,
        )

    def evaluate(self) -> None:
        """Run the held-out episodes; keep the policy if it is the best."""
        policy = self.learner.policy()
        began = time.monotonic()
        cost = self.held_out.cost(policy)
        self.evaluating += time.monotonic() - began
        is_best = self.evaluations.add(
            steps=self.learner.steps,
            seconds=round(self.seconds, 3),
            cost=cost,
            mean_return=self.learner.mean_return(),
        )
        self.learner.note_cost(cost)

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
        last_evaluated = EVALUATION_SEED + self.evaluation_episodes - 1
        return {
            **self.plan.configuration(),
            "training_seeds": list(self.learner.training_seeds),
            "evaluation_seeds": [EVALUATION_SEED, last_evaluated],
            "steps": self.learner.steps,
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
            "agent": self.learner.state(),
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
            check_evaluations(run)
            self.learner.restore(content["agent"])
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            # torch lists every network's layer after it
            first_line, _, _ = str(error).partition("\n")
            why = first_line.rstrip(" :")
            raise InputError(
                f"{checkpoint}: does not fit this run ({why}); start a new run"
            ) from None
        self.seconds_before = run.pop("seconds")
        self.evaluations = Evaluations(**run)
        self.resumed_from = self.learner.steps


def make_learner(
    plan: TrainingPlan, base: Controller | None, folder: Path | None
) -> Learner:
    """Make what learns, which has learned nothing yet.

    Raises InputError if a package that it needs is not installed.
    """
    from agents.training.gradient_learner import GradientLearner

    return GradientLearner(plan, base, folder)
