"""The folder of a run of training; its files are listed in docs/training.md."""

import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from agents.output import check_writable, present
from agents.training.plan import Given, Plan, check_same, code_given
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
RUN, CHECKPOINT, PROGRESS = "run.json", "checkpoint.safetensors", "progress.json"
AGENT, LAST, TENSORBOARD = "agent.json", "last.json", "tensorboard"
FIELDS = ("format", "configuration", "threads", "command", "versions")
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
PACKAGES = (
    "shipgym",
    "numpy",
    "numba",
    "gymnasium",
    "torch",
    "stable-baselines3",
    "sb3-contrib",
)
REMEDY = "start a new run in another folder"


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that decide what is learned."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def check_new(folder: Path) -> None:
    """Refuse a folder in which there is something already.

    Raises InputError which says how to go on with a run that is there.
    """
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


def begin_folder(folder: Path, plan: Plan, command: str) -> None:
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


def read_plan(folder: Path, given: Given | None = None) -> Plan:
    """The run that a folder is of.

    Raises InputError if there is none, its file is broken or names code that the user
    has not given, or its model has changed since.
    """
    content = _content(folder)
    where, configuration = f"{folder / RUN}", content["configuration"]
    named = {
        name: configuration.get(name) for name in ("environment", "model", "options")
    }
    data_only(named, f"{where}: configuration", given and code_given(given))
    with placed(where):
        check_shape(configuration, CONFIGURATION, "configuration")
        plan = Plan.from_configuration(configuration, content["threads"])
    check_same(plan.configuration(), configuration, str(folder))
    return plan


def check_resumable(folder: Path, plan: Plan) -> None:
    """Refuse to go on with a run of another configuration, naming the first difference.

    Raises InputError as `read_plan`, or for a difference.
    """
    check_same(plan.configuration(), _content(folder)["configuration"], str(folder))


def other_versions(folder: Path) -> list[str]:
    """What was installed in another version when the run began, a line each."""
    found: Mapping[str, str] = check_table(
        _content(folder)["versions"], f"{folder / RUN}: versions"
    )
    return [
        f"{name} {now} in place of {found[name]}"
        for name, now in versions().items()
        if name in found and found[name] != now
    ]


def _content(folder: Path) -> Mapping[str, Any]:
    path = folder / RUN
    if not path.is_file():
        raise InputError(
            f"{folder}: no run of training is there; leave --resume out to begin one"
        )
    content = read_json(path, "run file", REMEDY)
    check_fields(content, FIELDS, str(path), REMEDY)
    check_format(content, FORMAT, str(path))
    check_table(content["configuration"], f"{path}: configuration")
    return content
