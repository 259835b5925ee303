"""Folder of a run of training; its files are listed in docs/training.md."""

import platform
from importlib.metadata import version
from pathlib import Path

from agents.output import check_writable, present
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


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that decide what is learned."""
    packages = ("shipgym", "numpy", "numba", "gymnasium", "torch", "stable-baselines3")
    found = {name: version(name) for name in packages}
    return {"python": platform.python_version(), **found}


def check_new(folder: Path) -> None:
    """Raise InputError for a folder that is not empty, and say how to resume a run."""
    if (folder / RUN).is_file():
        raise InputError(
            f"{folder}: contains a run already; resume it with --resume, or name"
            " another folder"
        )
    check_empty(folder, "training run")
    check_writable(folder)


def check_empty(folder: Path, what: str) -> None:
    """Refuse a folder that holds something else than `what`."""
    if folder.exists() and (not folder.is_dir() or present(folder)):
        raise InputError(f"{folder}: exists and is not a {what}; name another folder")


def begin_folder(folder: Path, plan: TrainingPlan, command: str) -> None:
    """Make the folder of a new run; raises InputError if it cannot be written."""
    content = {
        "configuration": plan.configuration(),
        "command": command,
        "versions": versions(),
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
    stored = check_table(content.get("configuration"), f"{path}: configuration")
    check_same(plan.configuration(), stored, str(folder))
