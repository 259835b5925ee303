"""Training of agents on many ships at once, evaluated on episodes held out.

stable-baselines3 learns. A run can be killed at any moment and goes on from the last
save: networks, optimisers, scale of the rewards and replay buffer; its ships begin new
episodes. What is saved is tensors and numbers, which torch reads without running code.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from agents.agent_file import load_agent
from agents.output import check_results, in_use, versions
from agents.policies.policy import LearnedPolicy
from agents.training import run_folder
from agents.training.evaluation import HeldOut, TrainingProgress, TrainingResult
from agents.training.plan import EVALUATION_SEED, N_EVALUATIONS, TrainingPlan
from shipgym.errors import InputError
from shipgym.files import write_bytes, write_json

try:
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
    from stable_baselines3.common.save_util import recursive_getattr
    from stable_baselines3.common.utils import set_random_seed

    from agents.training.algorithms import design_base, make_agent, set_deviation
except ModuleNotFoundError as error:
    raise InputError(
        f"{error.name} is not installed, training needs it: pip install 'shipgym[rl]'"
    ) from None

#: Arrays of a replay buffer.
REPLAY = (
    "observations",
    "next_observations",
    "actions",
    "rewards",
    "dones",
    "timeouts",
)


def train(
    plan: TrainingPlan,
    out: str | Path | None = None,
    *,
    resume: bool = False,
    on_progress: Callable[[TrainingProgress], None] | None = None,
    evaluation_episodes: int = N_EVALUATIONS,
    save_seconds: float = 45.0,
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
    on_progress : callable, optional
        Called with the progress before each rollout. An exception of it ends the
        training.
    evaluation_episodes : int
        Episodes held out, on which the policy is chosen.
    save_seconds : float
        Least time between saves.
    """
    with ExitStack() as stack:
        folder = None
        if out is not None:
            folder = Path(out)
            stack.enter_context(in_use(folder))
            if resume:
                run_folder.check_resumable(folder, plan)
            else:
                check_results(folder, [run_folder.RUN], resume=False)
        stack.enter_context(_one_thread())
        run = _Run(plan, folder, evaluation_episodes, save_seconds)
        run.on_progress = on_progress
        if folder is not None and resume:
            run.restore(folder / run_folder.CHECKPOINT)
        elif folder is not None:
            run_folder.begin_folder(folder, plan)
        return run.learn()


class _Run(BaseCallback):  # type: ignore[misc]  # stable-baselines3 is not type-checked here
    """A training under way: it evaluates and saves its agent before rollouts."""

    on_progress: Callable[[TrainingProgress], None] | None = None

    def __init__(
        self,
        plan: TrainingPlan,
        folder: Path | None,
        episodes: int,
        save_seconds: float,
    ) -> None:
        super().__init__()
        self.started = time.monotonic()
        self.plan = plan
        self.folder = folder
        self.save_seconds = save_seconds
        self.held_out = HeldOut(plan.task, EVALUATION_SEED, episodes)
        self.agent = make_agent(plan, design_base(plan.settings.base, plan.task))
        self.policy: Any = None
        self.curve: list[dict[str, Any]] = []
        self.saved_at = -np.inf
        self.resumed_from: int | None = None

    @property
    def steps(self) -> int:
        """Decisions learned from so far."""
        return int(self.agent.num_timesteps)

    @property
    def seconds(self) -> float:
        """Time spent so far, also before the run was resumed."""
        return time.monotonic() - self.started

    @property
    def best_cost(self) -> float:
        """Lowest cost of an evaluation."""
        return min(float(one["cost"]) for one in self.curve)

    def learn(self) -> TrainingResult:
        """Learn to the end."""
        log = []
        if self.folder is not None and find_spec("tensorboard"):
            path = str(self.folder / run_folder.TENSORBOARD)
            log.append(TensorBoardOutputFormat(path))
        self.agent.set_logger(Logger(None, log))
        left = self.plan.settings.total_steps - self.steps
        try:
            if left > 0:
                self.agent.learn(left, self, reset_num_timesteps=False)
            if not self.curve or self.curve[-1]["steps"] != self.steps:
                self.evaluate()
            self.save()
        except KeyboardInterrupt:
            self.save()
            raise
        except ValueError as error:
            # torch refuses to draw from a distribution that is not one
            if "invalid values" not in str(error):
                raise
            raise self._diverged() from error
        finally:
            self.agent.logger.close()
        if self.policy is None and self.folder is not None:
            # found before the run was resumed
            self.policy = load_agent(self.folder / run_folder.AGENT)
        return TrainingResult(
            self.plan,
            self.policy,
            tuple(self.curve),
            self.held_out.costs,
            self.resumed_from,
        )

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        """Evaluate and save when it is time to."""
        every = self.plan.settings.evaluate_every
        last = self.curve[-1]["steps"] if self.curve else None
        is_due = last is None or self.steps // every > last // every
        if is_due:
            self.evaluate()
        if self.on_progress is not None:
            progress = TrainingProgress(
                steps=self.steps,
                total=self.plan.settings.total_steps,
                seconds=self.seconds,
                cost=self.curve[-1]["cost"],
                best_cost=self.best_cost,
                yardsticks=self.held_out.costs,
                evaluated=is_due,
            )
            self.on_progress(progress)
        if time.monotonic() - self.saved_at >= self.save_seconds:
            self.save()
        set_deviation(self.agent, self.plan.settings)

    def evaluate(self) -> None:
        """Run the held-out episodes; keep the policy if it is the best."""
        for weight in self.agent.policy.parameters():
            if not bool(weight.isfinite().all()):
                raise self._diverged()
        policy = LearnedPolicy.from_sb3(self.agent)
        cost = self.held_out.cost(policy)
        returns = [float(one["r"]) for one in self.agent.ep_info_buffer or ()]
        is_best = not self.curve or cost < self.best_cost
        self.curve.append(
            {
                "steps": self.steps,
                "seconds": round(self.seconds, 3),
                "cost": cost,
                "mean_return": sum(returns) / len(returns) if returns else None,
            }
        )
        self.agent.logger.record("evaluation/cost", cost)
        policy = replace(policy, training=self._record())
        if is_best:
            self.policy = policy
        if self.folder is not None:
            try:
                self._write(self.folder, policy, is_best)
            except KeyboardInterrupt:  # as if it had not been evaluated
                self.curve.pop()
                raise

    def _write(self, folder: Path, policy: LearnedPolicy, is_best: bool) -> None:
        """Write a policy, the best one too, and the learning curve."""
        policy.save(folder / run_folder.LAST)
        if is_best:
            policy.save(folder / run_folder.AGENT)
        progress = {"yardsticks": self.held_out.costs, "curve": self.curve}
        write_json(progress, folder / run_folder.PROGRESS)

    def _diverged(self) -> InputError:
        return InputError(
            f"training diverged after {self.steps} steps: the network's weights are not"
            " finite; lower learning_rate, or raise reward_scale"
        )

    def _record(self) -> dict[str, Any]:
        """Return how a policy was made, without times."""
        seeds = self.held_out.seeds.tolist()
        return {
            **self.plan.configuration(),
            "evaluation_seeds": [seeds[0], seeds[-1]],
            "steps": self.steps,
            "cost": self.curve[-1]["cost"],
            "curve": [[row["steps"], row["cost"]] for row in self.curve],
            "versions": versions(*run_folder.PACKAGES),
        }

    def save(self) -> None:
        """Write the run as it is, whole or not at all."""
        self.saved_at = time.monotonic()
        if self.folder is None:
            return
        agent = self.agent
        _, names = agent._get_torch_save_params()
        rewards = vars(agent.get_env().ret_rms)
        content = {
            "curve": self.curve,
            "seconds": self.seconds,
            "counters": [self.steps, agent._n_updates],
            "parameters": agent.get_parameters(),
            "variables": {name: recursive_getattr(agent, name) for name in names},
            "rewards": {name: float(value) for name, value in rewards.items()},
            "replay": _replay(agent),
        }
        file = BytesIO()
        torch.save(content, file)
        write_bytes(file.getvalue(), self.folder / run_folder.CHECKPOINT)

    def restore(self, checkpoint: Path) -> None:
        """Resume from the last save; a run killed before its first one starts again."""
        if checkpoint.exists():
            try:
                content = torch.load(checkpoint, map_location="cpu", weights_only=True)
                _restore(self.agent, content)
                self.curve = content["curve"]
                self.started -= content["seconds"]
            except Exception as error:  # of torch and its unpickler, of any kind
                first_line, _, _ = str(error).partition("\n")
                raise InputError(
                    f"{checkpoint}: cut short, or it does not fit this run"
                    f" ({first_line.rstrip(' :')}); start a new run"
                ) from None
            set_random_seed(self.plan.training_seed + self.steps)
        self.resumed_from = self.steps


def _replay(agent: Any) -> dict[str, Any] | None:
    """What a replay buffer holds so far, as tensors."""
    buffer = getattr(agent, "replay_buffer", None)
    if buffer is None:
        return None
    filled = buffer.buffer_size if buffer.full else buffer.pos
    return {name: torch.from_numpy(getattr(buffer, name)[:filled]) for name in REPLAY}


def _restore(agent: Any, content: dict[str, Any]) -> None:
    """Put what was saved into an agent of the same plan."""
    agent.set_parameters(content["parameters"], exact_match=True, device="cpu")
    for name, value in content["variables"].items():
        recursive_getattr(agent, name).data.copy_(value)
    agent.num_timesteps, agent._n_updates = content["counters"]
    for name, value in content["rewards"].items():
        setattr(agent.get_env().ret_rms, name, np.float64(value))
    replay = content["replay"]
    if replay is not None:
        buffer = agent.replay_buffer
        filled = len(replay["rewards"])
        for name in REPLAY:
            getattr(buffer, name)[:filled] = replay[name].numpy()
        buffer.full = filled == buffer.buffer_size
        buffer.pos = filled % buffer.buffer_size


@contextmanager
def _one_thread() -> Iterator[None]:
    """Keep torch to one thread: small networks are no faster with more."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
