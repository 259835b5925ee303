"""Training of agents on many ships at once, evaluated on episodes held out.

A run can be killed at any moment. It goes on at the last boundary between a rollout and
the next that was kept, and ends with the same policy, bit for bit, as if nothing had
happened (same machine, same versions).
"""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from agents.output import in_use
from agents.training import run_folder
from agents.training.plan import N_EVALUATIONS, TrainingPlan
from agents.training.result import TrainingProgress, TrainingResult
from agents.training.training_run import TrainingRun
from shipgym.errors import InputError


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
