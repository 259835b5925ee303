"""Folder of a run of training; its files are listed in docs/training.md."""

from pathlib import Path

from agents.output import versions
from agents.training.plan import TrainingPlan, check_same
from shipgym.checks import check_table
from shipgym.errors import InputError
from shipgym.files import make_folder, read_json, write_json

RUN = "run.json"
CHECKPOINT = "checkpoint.pt"
PROGRESS = "progress.json"
AGENT = "agent.json"  # the best policy
LAST = "last.json"
TENSORBOARD = "tensorboard"


#: Packages that decide what is learned.
PACKAGES = ("numpy", "numba", "gymnasium", "torch", "stable-baselines3")


def begin_folder(folder: Path, plan: TrainingPlan) -> None:
    """Make the folder of a new run; raises InputError if it cannot be written."""
    content = {
        "configuration": plan.configuration(),
        "versions": versions(*PACKAGES),
    }
    make_folder(folder)
    write_json(content, folder / RUN)


def check_resumable(folder: Path, plan: TrainingPlan) -> None:
    """Raise InputError unless the run in a folder is of this plan."""
    path = folder / RUN
    if not path.is_file():
        raise InputError(
            f"{folder}: no run of training is there; leave --resume out to begin one"
        )
    content = read_json(path, "run file", "start a new run in another folder")
    stored = check_table(
        content.get("configuration"),
        f"{path}: configuration",
    )
    check_same(plan.configuration(), stored, str(folder))
