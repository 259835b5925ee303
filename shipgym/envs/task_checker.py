"""Battery of checks for a task, reward or sensor set of a user's own."""

import warnings
from collections.abc import Iterator
from functools import partial
from multiprocessing.pool import ThreadPool
from time import monotonic
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Flags, Floats
from shipgym.engine import episodes
from shipgym.engine.cache import cached_path
from shipgym.engine.fingerprint import fingerprint
from shipgym.engine.specialise import loaded_names
from shipgym.envs.engine import Engine
from shipgym.envs.environment import DEFAULT_MODEL, PACE, read_options
from shipgym.envs.plain_python import plain_loop
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.findings import Findings
from shipgym.models import ShipModel
from shipgym.python_files import LONGEST_CALL, NO_END, file_options, place_of, told
from shipgym.tasks.definition import no_worst_cost
from shipgym.tasks.task import Task

PLAIN_STEPS = 40  # in plain Python, at least
PLAIN_SECONDS = 3.0  # more of them for so long
PLAIN_LANES = 3
MANY = 70  # ships, more than a tile
HELD = 20  # control intervals for which a random order is held
OFTEN = 0.05  # share of the steps in which a part of the reward may be positive
SELDOM = 0.05  # share of the steps that a rare event has at most
RARE = 20.0  # times the median of its magnitude that a rare reward is at least
SIGNS = "are these costs? write them with a minus"  # a remark that is a warning too
MOSTLY = 0.2  # share of all reward in rare events that learners cope with


class TaskCheck(Findings):
    """Result of checking a task; its name is that of the task, or its file."""


def check_task(task: Any, **options: Any) -> TaskCheck:
    """Check a task for errors.

    Its records and functions; compilation; some steps in plain Python, whose errors
    name the line; episodes of many ships under random orders: rewards, state and
    observations finite. It remarks on positive rewards, and on rewards of which most
    lies in rare events.

    The task is a file or module (`shipgym.tasks.contract`), or the name of one of the
    package's; options are keywords of the environment, `model`, `reward` and `sensors`
    among them.
    """
    try:
        options = file_options(task) | options
        for name in PACE:
            options.pop(name, None)
        ship = options.pop("model", DEFAULT_MODEL)
        model, given, randomisation = read_options(task, ship, options)
        return _checked(model, given, randomisation)
    except InputError as error:
        return TaskCheck(str(task), (str(error),))


def check_once(engine: Engine, randomisation: Randomisation) -> None:
    """Check a new task of a user's own: InputError, or a warning of wrong signs.

    A file in the cache folder stands for one that was sound.
    """
    program, model, task = engine.program, engine.model, engine.task
    if not (program.users_code and task.checked):
        return
    content = fingerprint(episodes.run, program.hooks)
    signature = repr((model.name, task.settings, task.options))
    known = cached_path(content, signature)
    mark = known and known.with_suffix(".sound")
    if mark and mark.exists():
        return
    found = _checked(model, task, randomisation)
    if found.problems:
        raise InputError(found.problems[0])
    for remark in found.remarks:
        if SIGNS in remark:
            warnings.warn(remark, stacklevel=4)
    if mark:
        mark.touch()


def _checked(model: ShipModel, given: Task, randomisation: Randomisation) -> TaskCheck:
    """Check a task with a ship; InputError where it fails."""
    made = partial(
        Engine, model, task=given, randomisation=randomisation, allow_unstable=True
    )
    plain = made(PLAIN_LANES, loop=plain_loop)
    plain.shapes(0)
    _refuse_prints(plain)
    _sail_in_python(plain)
    many = made(MANY)
    sailed = _sailed(many)
    _sail_late(made(MANY))
    remarks = list(_positive(many, sailed)) or list(_rare(sailed))
    remarks += _free_losses(given, sailed)
    return TaskCheck(given.name, tuple(sailed.faults.values()), tuple(remarks))


def _sail_in_python(engine: Engine) -> None:
    """Sail ships in plain Python; InputError names line and step of an error there."""
    end = monotonic() + PLAIN_SECONDS
    step = 0
    try:
        for step, *_ in _steps(engine):
            if step > PLAIN_STEPS and monotonic() > end:
                return
    except Exception as error:
        fault = error if isinstance(error, InputError) else told(error)
        # the step distinguishes an error of the beginning from one of a rare event
        where = f"at step {step + 1} in plain Python"
        raise InputError(f"{fault}, {where}") from error


def _note_faults(faults: dict[str, str], engine: Engine, step: int) -> None:
    """Note numbers of reward, state and observations that are not finite, each once."""
    for name, values in _numbers(engine).items():
        wrong = ~np.isfinite(values)
        if name in faults or not wrong.any():
            continue
        lane = int(np.argmax(wrong))
        definition = engine.task.definition
        of_reward = name.startswith("reward_")
        source = definition.reward_source if of_reward else definition.source
        faults[name] = (
            f"{source}: {name}: expected a finite number,"
            f" got {values[lane]} in lane {lane} at step {step}"
        )


def _numbers(engine: Engine) -> dict[str, NDArray[Any]]:
    """Numbers of the task's state, of the reward and of observations by name."""
    numbers: dict[str, NDArray[Any]] = {}
    for path in engine.program.state_rows["task_state"].present:
        numbers[f"State.{path}"] = engine.read(path)
    for name in engine.task.reward_parts:
        numbers[name] = engine.info(name)
    observed = engine.task.observed(engine.model)
    columns = engine.observations.T
    for one, values in zip(observed, columns, strict=True):
        numbers[f"Observation.{one.path}"] = values
    return numbers


def _refuse_prints(engine: Engine) -> None:
    """Refuse users' functions that print."""
    for function in engine.program.users_code:
        if "print" in loaded_names(function.__code__):
            raise InputError(
                f"{place_of(function)}: expected no print, which every ship would do in"
                " every step, got one; take it out, and report what you want to see"
                " with REPORTED"
            )


class _Sailed(NamedTuple):
    """Steps of many ships under random orders."""

    rewards: Floats  # shape (n_steps,)
    parts: Floats  # before they are bounded, shape (n_steps, n_parts)
    faults: dict[str, str]  # of numbers that are not finite


def _sailed(engine: Engine) -> _Sailed:
    """Sail ships up to their ends under random orders."""
    sailing = np.ones(MANY, dtype=np.bool_)
    earned, parts = [], []
    faults: dict[str, str] = {}
    _note_faults(faults, engine, 0)
    for step, rewards, ended in _steps(engine):
        _note_faults(faults, engine, step)
        earned.append(rewards[sailing])
        parts.append(engine.reward_parts[sailing])
        sailing &= ~ended
        if not sailing.any():
            break
    return _Sailed(np.concatenate(earned), np.concatenate(parts), faults)


def _sail_late(engine: Engine) -> None:
    """Sail at all times of an episode, at which lost ships do not arrive.

    InputError for a function that does not return.
    """
    try:
        for step, _, ended in _steps(engine):
            engine.begin_next(ended)
            engine.write("steps", step)
    except InputError as error:
        # other errors may come from a new episode at a late time
        if NO_END in str(error):
            raise


def _steps(engine: Engine) -> Iterator[tuple[int, Floats, Flags]]:
    """Take the steps of an episode; yield step, rewards, and which episodes ended.

    Orders are random, each held for a while; the first ship steers straight ahead.
    Another thread takes the steps, because compiled code cannot be stopped: InputError
    names a function that does not return.
    """
    random = np.random.default_rng(0)
    with ThreadPool(1) as pool:
        for step in range(engine.task.episode_steps):
            if step % HELD == 0:
                size = (engine.num_envs, engine.task.n_commands)
                orders = random.uniform(-1.0, 1.0, size)
                orders[0] = 0.0
            taken = pool.apply_async(engine.step, (orders,))
            while not taken.ready():
                taken.wait(2.0 * LONGEST_CALL)  # in plain Python it ends itself
                if not taken.ready() and (fault := engine.fault()):
                    raise InputError(fault)
            _, rewards, terminated, truncated = taken.get()
            yield step + 1, rewards, terminated | truncated


def _free_losses(task: Task, sailed: _Sailed) -> Iterator[str]:
    """Remark on lost ships that cost nothing more."""
    is_early = sailed.rewards.size < MANY * task.episode_steps
    if is_early and task.definition.worst_cost is no_worst_cost:
        yield (
            f"{task.definition.source}: an episode ended before its time, and a lost"
            " ship costs nothing more: the sooner lost, the cheaper; write"
            " worst_cost(settings), the largest cost of a step"
        )


def _positive(engine: Engine, sailed: _Sailed) -> Iterator[str]:
    """Ask about parts of the reward that are positive."""
    source = engine.task.definition.reward_source
    for name, parts in zip(engine.task.reward_parts, sailed.parts.T, strict=True):
        share = float(np.mean(parts > 0.0))
        if share > OFTEN:
            yield (
                f"{source}: {name}: expected costs, written with a minus, got positive"
                f" numbers in {100.0 * share:.0f} % of the steps, up to"
                f" {parts.max():.3g}: {SIGNS}; a bonus for each step is not needed,"
                " since the engine pays for steps of little cost"
            )


def _rare(sailed: _Sailed) -> Iterator[str]:
    """Remark on rewards of which most lies in rare events."""
    size = np.abs(sailed.rewards)
    median = float(np.median(size))
    is_large = size > RARE * median
    share = size[is_large].sum() / max(size.sum(), 1e-300)
    if share > MOSTLY and is_large.mean() < SELDOM:
        yield (
            f"reward: expected at most {100.0 * MOSTLY:.0f} % of all reward in steps of"
            f" more than {RARE:g} times the median, {median:.3g}, got"
            f" {100.0 * share:.0f} % under random orders, in one step"
            f" {sailed.rewards[size.argmax()]:.4g}: one event drowns the rest; give"
            " another scale as bounded, or, where ships are lost, lower loss_horizon"
        )
