"""Battery of checks for a task, reward or sensor set of a user's own."""

from collections.abc import Iterator
from time import monotonic
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.engine import episodes
from shipgym.engine.cache import cached_path
from shipgym.engine.fingerprint import fingerprint
from shipgym.engine.specialise import loaded_names
from shipgym.envs.engine import Engine
from shipgym.envs.environment import DEFAULT_MODEL, read_options
from shipgym.envs.plain_python import plain_loop
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.findings import Findings
from shipgym.models import ShipModel
from shipgym.python_files import asked, place_of
from shipgym.tasks.task import Task

STEPS = 400
PLAIN_STEPS = 40  # in plain Python, at least
PLAIN_SECONDS = 3.0  # more of them for so long
PLAIN_LANES = 3
MANY = 70  # ships, more than a tile
HELD = 20  # control intervals for which a random order is held
OFTEN = 0.05  # share of the steps in which a part of the reward may be positive
SELDOM = 0.05  # share of the steps that a rare event has at most
RARE = 20.0  # times the median of its magnitude that a rare reward is at least
MOSTLY = 0.2  # share of all reward in rare events that learners cope with


class TaskCheck(Findings):
    """Result of checking a task; its name is that of the task, or its file."""


def check_task(task: Any, **options: Any) -> TaskCheck:
    """Check a task for errors.

    Its records and functions; compilation; some steps in plain Python, whose errors
    name the line; some hundred steps of many ships under crude orders: rewards, state
    and observations finite; the same results compiled and in plain Python, for one ship
    and for many. It remarks on positive rewards, and on rewards, under random orders,
    of which most lies in rare events.

    The task is a file or module (`shipgym.tasks.contract`), or the name of one of the
    package's; options are keywords of the environment, `model`, `reward` and `sensors`
    among them.
    """
    ship = options.pop("model", DEFAULT_MODEL)
    try:
        model, given, randomisation = read_options(task, ship, options)
        return _checked(model, given, randomisation)
    except InputError as error:
        return TaskCheck(str(task), (str(error),))


def check_once(model: ShipModel, task: Task, randomisation: Randomisation) -> None:
    """Check a task of a user's own if it is new; InputError tells its problems.

    A file in the cache folder stands for one that was sound.
    """
    program = Engine(model, 1, task, randomisation, allow_unstable=True).program
    if not (program.users_code and task.checked):
        return
    content = fingerprint(episodes.run, program.hooks)
    asked_for = (model.name, task.settings, task.options)
    signature = repr(asked_for)
    known = cached_path(content, signature)
    mark = None
    if known:
        mark = known.with_suffix(".sound")
    if mark and mark.exists():
        return
    found = _checked(model, task, randomisation)
    if found.problems:
        raise InputError(found.problems[0])
    if mark:
        mark.touch()


def _checked(model: ShipModel, given: Task, randomisation: Randomisation) -> TaskCheck:
    """Check a task with a ship; InputError where it fails."""

    def engine(lanes: int, loop: Any = None) -> Engine:
        return Engine(
            model, lanes, given, randomisation, allow_unstable=True, loop=loop
        )

    plain = engine(PLAIN_LANES, plain_loop)
    _sail_in_python(plain)
    plain.shapes(0)
    few, many, one = engine(PLAIN_LANES), engine(MANY), engine(1)
    problems = [
        *_not_finite(many),
        *_differ(few, plain, PLAIN_STEPS, 1e-5, "in plain Python"),
        *_differ(many, one, STEPS // 4, 0.0, "alone"),
    ]
    sailed = _sailed_at_random(many)
    remarks = list(_printed(many))
    positive = list(_positive(many, sailed))
    remarks += positive or _rare(sailed)
    return TaskCheck(given.name, tuple(problems), tuple(remarks))


def _orders(engine: Engine, step: int) -> Floats:
    """Crude orders: to and fro, hard over, none; the same for a lane."""
    lanes = np.arange(engine.num_envs)
    # each lane swings differently
    frequency = 0.11 * (1.0 + 0.3 * (lanes % 7))
    swing = np.sin(frequency * step + lanes)
    rudder = np.choose(lanes % 4, [swing, np.sign(swing), 0.0, 1.0])
    return np.repeat(rudder[:, None], engine.task.n_commands, axis=1)


def _sail_in_python(plain: Engine) -> None:
    """Take some steps in plain Python; InputError names line and step of an error."""
    end = monotonic() + PLAIN_SECONDS
    for step in range(min(STEPS, plain.task.episode_steps)):
        if step >= PLAIN_STEPS and monotonic() > end:
            return
        try:
            asked(plain.step, _orders(plain, step))
        except InputError as error:
            # the step distinguishes an error of the beginning from one of a rare event
            where = f"at step {step + 1} in plain Python"
            raise InputError(f"{error}, {where}") from error


def _not_finite(engine: Engine) -> Iterator[str]:
    """Numbers of reward, state and observations that are not finite, each once."""
    observations = engine.reset(np.arange(engine.num_envs))
    found: set[str] = set()
    for step in range(min(STEPS, engine.task.episode_steps) + 1):
        if step > 0:
            observations, *_ = engine.step(_orders(engine, step - 1))
        for name, values in _numbers(engine, observations).items():
            wrong = ~np.isfinite(values)
            if name in found or not wrong.any():
                continue
            found.add(name)
            lane = int(np.argmax(wrong))
            yield (
                f"{_source_of(name, engine.task)}: {name}: expected a finite number,"
                f" got {values[lane]} in lane {lane} at step {step}"
            )


def _numbers(
    engine: Engine,
    observations: NDArray[np.float32],
) -> dict[str, NDArray[Any]]:
    """Numbers of the task's state, of the reward and of observations by name."""
    numbers: dict[str, NDArray[Any]] = {}
    for path in engine.program.state_rows["task_state"].present:
        numbers[f"State.{path}"] = engine.read(path)
    for name in engine.task.reward_parts:
        numbers[name] = engine.info(name)
    return numbers | dict(zip(_seen_names(engine), observations.T, strict=True))


def _seen_names(engine: Engine) -> list[str]:
    """Names of the columns of the observations."""
    task = engine.task
    return [f"Observation.{one.path}" for one in task.observed(engine.model)]


def _source_of(name: str, task: Task) -> str:
    """File that a number comes from, for messages."""
    definition = task.definition
    if name.startswith("reward_"):
        return definition.reward_source
    if task.sensors is None or not name.startswith("Observation."):
        return definition.source
    return f"{definition.source}, or the sensors of {task.sensors.source}"


def _differ(
    one: Engine, other: Engine, steps: int, agreement: float, other_way: str
) -> Iterator[str]:
    """First difference of an engine's last lanes from those of another."""
    lanes = slice(-other.num_envs, None)
    names = ["reward", *_seen_names(one)]
    seeds = np.arange(one.num_envs)
    rewards, other_rewards = np.zeros(one.num_envs), np.zeros(other.num_envs)
    observations, others = one.reset(seeds), other.reset(seeds[lanes])
    for step in range(min(steps, one.task.episode_steps) + 1):
        results = np.column_stack([rewards, observations])[lanes]
        expected = np.column_stack([other_rewards, others])
        close = np.isclose(results, expected, agreement, agreement, equal_nan=True)
        for lane, column in np.argwhere(~close)[:1]:
            yield (
                f"{names[column]} is {results[lane, column]} compiled and"
                f" {expected[lane, column]} {other_way} in lane {seeds[lanes][lane]} at"
                f" step {step}; look for what differs, such as a global that changes"
            )
            return
        orders = _orders(one, step)
        observations, rewards, *_ = one.step(orders)
        others, other_rewards, *_ = other.step(orders[lanes])


def _printed(engine: Engine) -> Iterator[str]:
    """Remark on users' functions that print."""
    for function in engine.program.users_code:
        if "print" in loaded_names(function.__code__):
            yield (
                f"{place_of(function)}: expected no print, which every ship would do in"
                " every step, got one; take it out, and report what you want to see"
                " with REPORTED"
            )


class _Sailed(NamedTuple):
    """Steps of many ships under random orders."""

    rewards: Floats  # shape (n_steps,)
    parts: Floats  # before they are bounded, shape (n_steps, n_parts)


def _sailed_at_random(engine: Engine) -> _Sailed:
    """Sail ships up to their ends under random orders, each held for a while."""
    random = np.random.default_rng(0)
    engine.reset(np.arange(MANY))
    sailing = np.ones(MANY, dtype=np.bool_)
    earned, parts = [], []
    for step in range(engine.task.episode_steps):
        if step % HELD == 0:
            orders = random.uniform(-1.0, 1.0, (MANY, engine.task.n_commands))
        _, rewards, terminated, truncated = engine.step(orders)
        earned.append(rewards[sailing])
        parts.append(engine.reward_parts[sailing])
        sailing &= ~(terminated | truncated)
        if not sailing.any():
            break
    return _Sailed(np.concatenate(earned), np.concatenate(parts))


def _positive(engine: Engine, sailed: _Sailed) -> Iterator[str]:
    """Ask about parts of the reward that are positive."""
    source = engine.task.definition.reward_source
    for name, parts in zip(engine.task.reward_parts, sailed.parts.T, strict=True):
        share = float(np.mean(parts > 0.0))
        if share > OFTEN:
            yield (
                f"{source}: {name}: expected costs, written with a minus, got positive"
                f" numbers in {100.0 * share:.0f} % of the steps, up to"
                f" {parts.max():.3g}: are these costs? write them with a minus; a bonus"
                " for each step is not needed, since the engine pays for steps of"
                " little cost"
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
