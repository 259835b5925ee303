"""`shipgym warm`: compile beforehand, so that no run waits for it."""

import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from agents.cli.command import WRONG_INPUT, fail


def warm_command(
    wanted: Annotated[
        list[str] | None,
        Argument(
            metavar="[ID|MODEL|FILE]...",
            help="Ids of environments, models, files of models, ships and tasks.",
        ),
    ] = None,
    everything: Annotated[
        bool,
        Option(
            "--all", help="All environments, calm and in a sea, and all shipped models."
        ),
    ] = False,
    model: Annotated[
        str | None,
        Option(
            "--model", help="Ship of the environments and tasks, by default their own."
        ),
    ] = None,
) -> None:
    """Compile ships in advance. Without arguments, both tasks with the Mariner.

    An environment, or the file of a task, stands for its ship in calm water and in a
    sea, a model for its manoeuvres and simulations in calm water. Writes only to the
    cache (SHIPGYM_CACHE or the user's cache folder).
    """
    from agents.cli.terminal import answer, say
    from shipgym.engine.cache_folder import usable_folder
    from shipgym.errors import InputError
    from shipgym.models import load_model

    folder = usable_folder()
    if folder is None:
        raise InputError("there is no cache to fill, for the reason above")
    if model is not None:
        load_model(model)
    jobs: dict[str, Callable[[], Any]] = {}
    for name in warm_names(wanted, everything):
        jobs |= warm_jobs(name, model)

    ready: list[dict[str, Any]] = []
    for number, (what, compile_it) in enumerate(jobs.items(), start=1):
        begin = time.perf_counter()
        refused = ""
        try:
            _compile(what, compile_it)
        except InputError as error:
            if not everything:
                raise
            refused = str(error)  # not every ship has what a sea asks for
        seconds = time.perf_counter() - begin
        ready.append({"what": what, "seconds": round(seconds, 2), "refused": refused})
        say(f"{number}/{len(jobs)}  {what}: {refused or f'{seconds:.1f} s'}")
    answer({"cache": str(folder), "ready": ready})
    say(f"kept in {folder}")


def _compile(what: str, compile_it: Callable[[], Any]) -> None:
    """Compile a ship; a cache that does not take it is an error that ends the work."""
    from shipgym.engine.cache_folder import CacheWarning

    with warnings.catch_warnings(action="error", category=CacheWarning):
        try:
            compile_it()
        except CacheWarning as error:
            fail(f"{what}: {error}", WRONG_INPUT)


def warm_names(wanted: list[str] | None, everything: bool) -> list[str]:
    """Environments and models to compile; by default both tasks and the Mariner."""
    from shipgym.envs.registration import ENVIRONMENTS, env_id
    from shipgym.models import list_models
    from shipgym.tasks.definition import TASKS

    if everything:
        return [*ENVIRONMENTS, *list_models()]
    return wanted or [*map(env_id, TASKS), "mariner"]


def warm_jobs(name: str, ship: str | None = None) -> dict[str, Callable[[], Any]]:
    """Functions that compile what an id, a model or a file needs, by a description.

    Raises InputError for what is none of these.
    """
    import shipgym
    from shipgym.engine.loops import LOOPS, ship_loop
    from shipgym.envs.environment import DEFAULT_TASK
    from shipgym.envs.registration import ENVIRONMENTS, env_id
    from shipgym.errors import InputError
    from shipgym.python_files import load_file

    is_task = False
    if Path(name).suffix == ".py":
        content = load_file(Path(name), "the Python file of a task or a ship")
        is_task = not hasattr(content, "SHIP")
    if is_task or name in ENVIRONMENTS:
        options: dict[str, Any] = {"model": ship} if ship else {}
        environment = name
        if is_task:
            environment = env_id(DEFAULT_TASK)
            options["task"] = name
        rough = {**options, "sea": "rough"}  # every sea but the calm one is compiled so
        return {
            f"{name} in calm water": partial(_make, environment, options),
            f"{name} in a sea": partial(_make, environment, rough),
        }

    try:
        model = shipgym.load_model(name)
    except InputError as error:
        raise InputError(
            f"argument: expected an environment's id or a model, got {name!r}: {error}"
        ) from None
    return {
        f"{model.name}: {loop}": partial(ship_loop, model.compiled, loop)
        for loop in LOOPS
    }


def _make(environment: str, options: dict[str, Any]) -> None:
    import gymnasium

    gymnasium.make(environment, **options).close()
