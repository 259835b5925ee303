"""Folder of a run of training; its files are listed in docs/training.md."""

import platform
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from agents.output import check_writable, present
from agents.suites.environments import read_environment
from agents.training.plan import TrainingPlan, TrainingRequest, check_same
from shipgym.checks import check_fields, check_format, check_table, data_only
from shipgym.errors import InputError
from shipgym.files import make_folder, read_json, write_json

FORMAT = 3
RUN = "run.json"
CHECKPOINT = "checkpoint.pt"
PROGRESS = "progress.json"
AGENT = "agent.json"  # the best policy
LAST = "last.json"
TENSORBOARD = "tensorboard"


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that decide what is learned."""
    packages = ("shipgym", "numpy", "numba", "gymnasium", "torch", "stable-baselines3")
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
        "request": plan.request.to_dict(),
        "configuration": plan.configuration(),
        "command": command,
        "versions": versions(),
    }
    make_folder(folder)
    write_json(content, folder / RUN)


def resumed(folder: Path, given: Mapping[str, Any]) -> TrainingRequest:
    """Return the request of the run in a folder, with what is given again in its place.

    `given`: fields of a `TrainingRequest`; of options and settings, those that are
    given. Raises InputError if there is no run, its file is broken or of another
    algorithm, or it names code that is not given again.
    """
    where = f"{folder / RUN}: request"
    stored = TrainingRequest.from_dict(_content(folder)["request"], where)
    if given.get("algorithm", stored.algorithm) != stored.algorithm:
        check_same({"algorithm": given["algorithm"]}, vars(stored), str(folder))
    own = dict(given)
    options = dict(own.pop("options", {}))
    if "sea" in own:
        options = {"sea": own.pop("sea"), **options}
    if "environment" in own:
        own["environment"], more = read_environment(own["environment"])
        options = {**more, **options}

    names = ("environment", "model", "options")
    code = {name: getattr(stored, name) for name in names}
    data_only(code, where, {**own, "options": options})
    own["settings"] = {**stored.settings, **own.get("settings", {})}
    return replace(stored, **own, options={**stored.options, **options})


def check_resumable(folder: Path, plan: TrainingPlan) -> None:
    """Raise InputError unless the run in a folder is of this plan."""
    check_same(plan.configuration(), _content(folder)["configuration"], str(folder))


def _content(folder: Path) -> Mapping[str, Any]:
    path = folder / RUN
    if not path.is_file():
        raise InputError(
            f"{folder}: no run of training is there; leave --resume out to begin one"
        )
    where = str(path)
    remedy = "start a new run in another folder"
    content = read_json(path, "run file", remedy)
    fields = ("format", "request", "configuration", "command", "versions")
    check_format(content, FORMAT, where)
    check_fields(content, fields, where, remedy)
    check_table(content["configuration"], f"{path}: configuration")
    return content
