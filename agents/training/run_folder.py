"""Folder of a run of training; its files are listed in docs/training.md."""

import platform
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from agents.output import check_writable, present
from agents.training.plan import TrainingPlan, check_same
from agents.training.request import TrainingRequest, code_in
from shipgym.checks import (
    Shape,
    check_fields,
    check_format,
    check_shape,
    check_table,
    data_only,
    placed,
)
from shipgym.errors import InputError
from shipgym.files import make_folder, read_json, write_json

FORMAT = 1
RUN = "run.json"
CHECKPOINT = "checkpoint.safetensors"
PROGRESS = "progress.json"
AGENT = "agent.json"  # the best policy
LAST = "last.json"
TENSORBOARD = "tensorboard"
#: Packages that decide what is learned.
PACKAGES = (
    "shipgym",
    "numpy",
    "numba",
    "gymnasium",
    "torch",
    "stable-baselines3",
    "sb3-contrib",
)
CONFIGURATION: Shape = {
    "algorithm": (str,),
    "task": (str,),
    "suite": (str,),
    "environment": (str,),
    "model": (str,),
    "options": {},
    "settings": {},
    "seed": (int,),
    "randomise": (bool,),
}


def versions(packages: Iterable[str] = PACKAGES) -> dict[str, str]:
    """Return the installed versions of Python and of packages."""
    found = {"python": platform.python_version()}
    for name in packages:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def check_new(folder: Path) -> None:
    """Raise InputError for a folder that is not empty, and say how to resume a run."""
    if (folder / RUN).is_file():
        raise InputError(
            f"{folder}: contains a run already; resume it with --resume, or name"
            " another folder"
        )
    if folder.exists() and (not folder.is_dir() or present(folder)):
        raise InputError(
            f"{folder}: exists and is not a training run; name another folder"
        )
    check_writable(folder)


def begin_folder(folder: Path, plan: TrainingPlan, command: str) -> None:
    """Make the folder of a new run; raises InputError if it cannot be written."""
    content = {
        "format": FORMAT,
        "configuration": plan.configuration(),
        "threads": plan.threads,
        "command": command,
        "versions": versions(),
    }
    make_folder(folder)
    write_json(content, folder / RUN)


def read_plan(folder: Path, request: TrainingRequest | None = None) -> TrainingPlan:
    """Read the plan of the run in a folder.

    Raises InputError if there is none, its file is broken or names code that the user
    has not asked for, or its model has changed since.
    """
    content = _content(folder)
    configuration = content["configuration"]
    where = str(folder / RUN)

    may_be_code = ("environment", "model", "options")
    code = {name: configuration.get(name) for name in may_be_code}
    own_code = None if request is None else code_in(request)
    data_only(code, f"{where}: configuration", own_code)

    with placed(where):
        check_shape(configuration, CONFIGURATION, "configuration")
        plan = TrainingPlan.from_configuration(configuration, content["threads"])
    check_same(plan.configuration(), configuration, str(folder))
    return plan


def check_resumable(folder: Path, plan: TrainingPlan) -> None:
    """Raise InputError unless the run in a folder is of this plan."""
    check_same(plan.configuration(), _content(folder)["configuration"], str(folder))


def other_versions(folder: Path) -> list[str]:
    """Return a line for each package whose version differs from that of the run."""
    content = _content(folder)
    before = check_table(content["versions"], f"{folder / RUN}: versions")
    others = []
    for name, now in versions().items():
        if name in before and before[name] != now:
            others.append(f"{name} {now} in place of {before[name]}")
    return others


def _content(folder: Path) -> Mapping[str, Any]:
    path = folder / RUN
    if not path.is_file():
        raise InputError(
            f"{folder}: no run of training is there; leave --resume out to begin one"
        )

    where = str(path)
    remedy = "start a new run in another folder"
    content = read_json(path, "run file", remedy)
    fields = ("format", "configuration", "threads", "command", "versions")
    check_fields(content, fields, where, remedy)
    check_format(content, FORMAT, where)
    check_table(content["configuration"], f"{path}: configuration")
    return content
