"""`shipgym warm`: compile beforehand what environments and models need, so that no run waits for it."""

import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from agents.cli.command import answered

Wanted = Annotated[
    list[str] | None,
    Argument(
        metavar="[ID|MODEL|FILE]...",
        help="Ids of environments, models, files of models, ships and tasks.",
    ),
]
Ship = Annotated[
    str | None,
    Option("--model", help="Ship of the environments and tasks, by default their own."),
]
All = Annotated[
    bool,
    Option(
        "--all", help="All environments, calm and in a sea, and all shipped models."
    ),
]
SEAS: dict[str, Any] = {
    "calm water": {},
    "a sea": {"sea": "rough"},
}  # every sea but the calm one shares what is compiled


@answered
def warm_command(
    wanted: Wanted = None, everything: All = False, model: Ship = None
) -> None:
    """Compile ships in advance. Without arguments, both tasks with the Mariner.

    An environment, or the file of a task, stands for its ship in calm water and in a
    sea, a model for its manoeuvres and simulations in calm water. Writes only to the
    cache (SHIPGYM_CACHE or the user's cache folder).
    """
    from agents.cli.terminal import answer, say
    from shipgym.engine.cache_folder import CacheWarning, usable_folder
    from shipgym.errors import InputError

    if (folder := usable_folder()) is None:
        raise InputError("there is no cache to fill, for the reason above")
    jobs = dict(
        job for name in _names(wanted, everything) for job in _jobs(name, model)
    )
    done: list[dict[str, Any]] = []
    for number, (what, job) in enumerate(jobs.items(), start=1):
        begin, refused = time.perf_counter(), ""
        try:
            with warnings.catch_warnings(action="error", category=CacheWarning):
                job()
        except CacheWarning as error:
            raise InputError(f"{what}: {error}") from None
        except InputError as error:
            if not everything:
                raise
            refused = str(
                error
            )  # not every ship has the particulars that a sea asks for
        seconds = (
            time.perf_counter() - begin
        )  # that compiling took; few if it was in the cache
        done.append({"what": what, "seconds": round(seconds, 2), "refused": refused})
        say(f"{number}/{len(jobs)}  {what}: {refused or f'{seconds:.1f} s'}")
    answer({"cache": str(folder), "ready": done})
    say(f"kept in {folder}")


def _names(wanted: list[str] | None, everything: bool) -> list[str]:
    """Environments and models that are asked for."""
    from shipgym.envs.registration import TASKS, env_id, environments
    from shipgym.ships import list_models

    if everything:
        return [*environments(), *list_models()]
    return wanted or [*map(env_id, TASKS), "mariner"]


def _jobs(
    name: str, ship: str | None = None
) -> Iterator[tuple[str, Callable[[], Any]]]:
    """What is to be compiled for an id or a model, each with words for it."""
    import shipgym
    from shipgym.engine.loops import LOOPS, ship_loop
    from shipgym.envs.environment import DEFAULT_TASK
    from shipgym.envs.registration import env_id, environments
    from shipgym.errors import InputError
    from shipgym.python_files import load_file

    path, expected = Path(name), "the Python file of a task or a ship"
    task = path.suffix == ".py" and not hasattr(load_file(path, expected), "SHIP")
    if task or name in environments():
        given: dict[str, Any] = {"model": ship} if ship else {}
        given |= {"task": name} if task else {}
        for water, sea in SEAS.items():
            yield (
                f"{name} in {water}",
                partial(_make, env_id(DEFAULT_TASK) if task else name, given | sea),
            )
        return
    try:
        model = shipgym.load_model(name)
    except InputError as error:
        raise InputError(
            f"{name!r} found, expected an environment's id or a model: {error}"
        ) from None
    for loop in LOOPS:
        yield f"{model.name}: {loop}", partial(ship_loop, model.compiled, loop)


def _make(env_id: str, options: dict[str, Any]) -> None:
    import gymnasium

    with warnings.catch_warnings(
        action="ignore", category=DeprecationWarning
    ):  # of older ids
        gymnasium.make(env_id, **options).close()
