"""Environments as users name them: by short name, by id, or by a task's file."""

from importlib import import_module
from os.path import isfile
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from shipgym import InputError
from shipgym.checks import did_you_mean, quoted
from shipgym.envs.environment import PACE
from shipgym.envs.registration import registered
from shipgym.python_files import working_folder

#: Tasks of the shipped environments by their short names.
SHORT_NAMES = {
    "course-keeping": "CourseKeeping",
    "path-following": "PathFollowing",
    "encounter": "Encounter",
}


class Environment(NamedTuple):
    """Environment that a user has named.

    Attributes
    ----------
    name : str
        A short name, or the absolute path of a task's file.
    options : dict
        Keywords that its id sets, `model` perhaps among them, without the pace of an
        agent.
    """

    name: str
    options: dict[str, Any]


def read_environment(
    text: str, folder: Path = Path(), where: str = "env"
) -> Environment:
    """Return the environment of a short name, an id, or the file of a task.

    Raises InputError for an unknown one, naming the nearest, and for an id that was
    registered without the path of its task's file.

    Parameters
    ----------
    text : str
        A short name; the path of a Python file; or an id that is registered with
        Gymnasium. Of ``module:id`` the module is imported first.
    folder : Path
        Where relative paths begin.
    where : str
        Option or field, for messages.
    """
    if text in SHORT_NAMES:
        return Environment(text, {})
    if text.endswith(".py"):
        path = (folder / text).resolve()
        if not isfile(path):
            raise InputError(
                f"{where}: expected the file of a task, got no file {path}"
            )
        return Environment(str(path), {})

    module, colon, name = text.rpartition(":")
    if colon:
        import_named(module, text, where)
    found = registered()
    if name not in found:
        known = [*SHORT_NAMES, *found]
        raise InputError(
            f"{where}: expected one of {quoted(known)}, the file of a task, or"
            f" module:id, got '{name}'.{did_you_mean(name, known)}"
        )
    options = dict(found[name])
    for keyword in PACE:
        options.pop(keyword, None)
    task = options.pop("task")
    for short_name, shipped_task in SHORT_NAMES.items():
        if task == shipped_task:
            return Environment(short_name, options)
    if isinstance(task, str) and task.endswith(".py"):
        return Environment(task, options)
    raise InputError(
        f"{where}: expected an id registered with the path of its task, got '{name}'"
        f" with a {type(task).__name__}"
    )


def import_named(module: str, text: str, where: str) -> ModuleType:
    """Import a module of a text ``module:name``, from the working folder too.

    Raises InputError, which begins with `where`, if it cannot be imported.
    """
    try:
        with working_folder():
            return import_module(module)
    except Exception as error:  # whatever the module does
        raise InputError(
            f"{where}: expected module:name, got '{text}', which cannot be imported"
            f" ({type(error).__name__}: {error})"
        ) from None
