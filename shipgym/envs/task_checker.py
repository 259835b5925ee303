"""Battery of checks for a task, reward or sensor set of a user's own."""

from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.engine import episodes
from shipgym.engine.cache import cached_path
from shipgym.engine.episode_program import EpisodeProgram
from shipgym.engine.fingerprint import fingerprint
from shipgym.engine.records import flat, leaves
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
PLAIN_STEPS = 40  # in plain Python
PLAIN_LANES = 3
SELDOM = 0.05  # share of the steps that a rare event has at most
RARE = 20.0  # times the median of its magnitude that a rare reward is at least


class TaskCheck(Findings):
    """Result of checking a task; its name is that of the task, or its file."""


def check_task(task: Any, **options: Any) -> TaskCheck:
    """Check a task for errors.

    Its records and functions; compilation; some steps in plain Python, whose errors
    name the line; some hundred steps of many ships under crude orders: rewards, state
    and observations finite and within their bounds; the same results compiled and in
    plain Python, for one ship and for many. It remarks on observations that are often
    clipped, and on rewards, under random orders, that a learner cannot learn from.

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
    known = cached_path(content, repr(asked_for))
    mark = known.with_suffix(".sound") if known else None
    if mark and mark.exists():
        return
    found = _checked(model, task, randomisation)
    if found.problems:
        raise InputError(found.problems[0])
    if mark:
        mark.touch()


def _checked(model: ShipModel, given: Task, randomisation: Randomisation) -> TaskCheck:
    """Check a task with a ship; InputError where it fails."""
    more_than_a_tile = 70
    plain, seen = _plain_engine(model, given, randomisation)
    _sail_in_python(plain)
    plain.shapes(0)
    few, many, one = (
        Engine(model, n, given, randomisation, allow_unstable=True)
        for n in (PLAIN_LANES, more_than_a_tile, 1)
    )

    compiled_and_plain = _differ(
        few,
        plain,
        lanes=slice(None),
        steps=PLAIN_STEPS,
        agreement=1e-5,  # their last digits differ
        ways=("compiled", "in plain Python"),
    )
    many_and_one = _differ(
        many,
        one,
        lanes=slice(-1, None),
        steps=STEPS // 4,
        agreement=0.0,
        ways=("among many ships", "alone"),
    )
    problems = [*_not_finite(many), *compiled_and_plain, *many_and_one]
    remarks = [*_often_clipped(given, seen), *_printed(many)]
    remarks += list(_positive(many)) or _hard_to_learn(many)
    return TaskCheck(given.name, tuple(problems), tuple(remarks))


def _plain_engine(
    model: ShipModel,
    task: Task,
    randomisation: Randomisation,
) -> tuple[Engine, dict[str, list[float]]]:
    """Engine in plain Python, and its observations before they are clipped, by path."""
    seen: dict[str, list[float]] = {}
    for quantity in task.observed(model):
        seen[quantity.path] = []
    paths = leaves(task.definition.Observation)

    def noted(store: Any, tile: Any, lane: int, record: Any, scale: Any) -> None:
        if lane < PLAIN_LANES:
            values = flat(record)
            factors = flat(scale)
            for path, value, factor in zip(paths, values, factors, strict=True):
                if path in seen:
                    seen[path].append(value * factor)
        store(tile, lane, record, scale)

    def loop(program: EpisodeProgram) -> Any:
        store = program.hooks["store_observation"]
        return plain_loop(program, {"store_observation": partial(noted, store)})

    engine = Engine(
        model, PLAIN_LANES, task, randomisation, allow_unstable=True, loop=loop
    )
    return engine, seen


def _orders(engine: Engine, step: int) -> Floats:
    """Crude orders: to and fro, hard over, none; the same for a lane."""
    n_lanes = engine.num_envs
    lanes = np.arange(n_lanes)
    # each lane swings differently
    frequency = 0.11 * (1.0 + 0.3 * (lanes % 7))
    swing = np.sin(frequency * step + lanes)
    kinds = np.stack(
        [
            swing,
            np.sign(swing),
            np.zeros(n_lanes),
            np.ones(n_lanes),
        ]
    )
    kind = lanes % len(kinds)
    rudder = kinds[kind, lanes]
    return np.repeat(rudder[:, None], engine.task.n_commands, axis=1)


def _sail_in_python(plain: Engine) -> None:
    """Take some steps in plain Python; InputError names line and step of an error."""
    for step in range(PLAIN_STEPS):
        orders = _orders(plain, step)
        try:
            asked(plain.step, orders)
        except InputError as error:
            # the step distinguishes an error of the beginning from one of a rare event
            where = f"at step {step + 1} in plain Python"
            raise InputError(f"{error}, {where}") from error


def _not_finite(engine: Engine) -> Iterator[str]:
    """Numbers of reward, state and observations that are not finite, each once."""
    observations = engine.reset(np.arange(engine.num_envs))
    found: set[str] = set()
    steps = min(STEPS, engine.task.episode_steps)
    for step in range(steps + 1):
        if step > 0:
            observations, *_ = engine.step(_orders(engine, step - 1))
        for name, values in _numbers(engine, observations).items():
            wrong = ~np.isfinite(values)
            if name in found or not wrong.any():
                continue
            found.add(name)
            source = _source_of(name, engine.task)
            lane = int(np.argmax(wrong))
            yield (
                f"{source}: {name}: expected a finite number, got {values[lane]} in"
                f" lane {lane} at step {step}"
            )


def _numbers(
    engine: Engine,
    observations: NDArray[np.float32],
) -> dict[str, NDArray[Any]]:
    """Numbers of the task's state, of the reward and of observations by name."""
    numbers: dict[str, NDArray[Any]] = {}
    for path in engine.program.state_rows["task_state"].present:
        numbers[f"State.{path}"] = engine.read(path)
    if engine.task.definition.current is not None:
        numbers["current: north"] = engine.read("current_north")
        numbers["current: east"] = engine.read("current_east")
    for name in engine.task.reward_parts:
        numbers[name] = engine.info(name)
    for name, values in zip(_seen_names(engine), observations.T, strict=True):
        numbers[name] = values
    return numbers


def _seen_names(engine: Engine) -> list[str]:
    """Names of the columns of the observations."""
    task = engine.task
    return [f"Observation.{one.path}" for one in task.observed(engine.model)]


def _source_of(name: str, task: Task) -> str:
    """File that a number comes from, for messages."""
    definition = task.definition
    if name.startswith("current"):
        return place_of(definition.current)
    if name.startswith("reward_"):
        return definition.reward_source
    if task.sensors is None or not name.startswith("Observation."):
        return definition.source
    return f"{definition.source}, or the sensors of {task.sensors.source}"


def _differ(
    one: Engine,
    other: Engine,
    lanes: slice,
    steps: int,
    agreement: float,
    ways: tuple[str, str],
) -> Iterator[str]:
    """First difference of an engine's lanes from another's under the same orders."""
    names = ["reward", *_seen_names(one)]
    seeds = np.arange(one.num_envs)
    rewards: Floats = np.zeros(one.num_envs)
    other_rewards: Floats = np.zeros(other.num_envs)
    observations = one.reset(seeds)
    other_observations = other.reset(seeds[lanes])
    for step in range(min(steps, one.task.episode_steps) + 1):
        results = np.column_stack([rewards, observations])[lanes]
        expected = np.column_stack([other_rewards, other_observations])
        close = np.isclose(
            results,
            expected,
            rtol=agreement,
            atol=agreement,
            equal_nan=True,
        )
        wrong = np.argwhere(~close)
        if len(wrong):
            lane, column = wrong[0]
            yield (
                f"{names[column]} is {results[lane, column]} {ways[0]} and"
                f" {expected[lane, column]} {ways[1]} in lane {seeds[lanes][lane]} at"
                f" step {step}; look for what differs, such as a global that changes"
            )
            return

        orders = _orders(one, step)
        observations, rewards, *_ = one.step(orders)
        other_observations, other_rewards, *_ = other.step(orders[lanes])


def _often_clipped(task: Task, seen: dict[str, list[float]]) -> Iterator[str]:
    """Observations that are often beyond their bounds."""
    often = 0.05  # share of the observations beyond their bounds that is worth a remark
    rounding = 1e-6
    for path, observed in seen.items():
        spec = task.definition.observations[path]
        values = np.array(observed)
        too_low = values < spec.low - rounding
        is_beyond = too_low | (values > spec.high + rounding)
        part = np.mean(is_beyond)
        if part > often:
            beyond = values[is_beyond]
            furthest = beyond[np.abs(beyond).argmax()]
            yield (
                f"Observation.{path}: expected {spec.low:g} to {spec.high:g} in units"
                f" of its scale, got up to {furthest:.3g}: it is clipped in"
                f" {100.0 * part:.0f} % of the steps; give it wider bounds or a larger"
                " scale if the agent is to see more"
            )


def _printed(engine: Engine) -> Iterator[str]:
    """Remark on users' functions that print."""
    for function in engine.program.users_code:
        if "print" in loaded_names(function.__code__):
            yield (
                f"{place_of(function)}: expected no print, which every ship would do in"
                " every step, got one; take it out, and report what you want to see"
                " with REPORTED"
            )


def _positive(engine: Engine) -> Iterator[str]:
    """Ask about parts of the reward that are positive, under random orders."""
    often = 0.05  # share of steps
    sailed = _sailed_at_random(engine)
    source = engine.task.definition.reward_source
    for name, parts in zip(engine.task.reward_parts, sailed.parts.T, strict=True):
        share = float(np.mean(parts > 0.0))
        if share > often:
            yield (
                f"{source}: {name}: expected costs, written with a minus, got positive"
                f" numbers in {100.0 * share:.0f} % of the steps, up to"
                f" {parts.max():.3g}: are these costs? write them with a minus; a bonus"
                " for each step is not needed, since the engine pays for steps of"
                " little cost"
            )


class _Sailed(NamedTuple):
    """Steps of many ships under random orders."""

    rewards: Floats  # shape (n_steps,)
    parts: Floats  # before they are bounded, shape (n_steps, n_parts)
    lost: bool  # whether any ship was lost


def _sailed_at_random(engine: Engine) -> _Sailed:
    """Sail ships up to their ends under random orders.

    Each order is held for twenty control intervals.
    """
    held = 20
    task = engine.task
    random = np.random.default_rng(0)
    n_ships = engine.num_envs
    sailing = np.ones(n_ships, dtype=np.bool_)
    engine.reset(np.arange(n_ships))

    earned = []
    parts = []
    for step in range(task.episode_steps):
        if step % held == 0:
            orders = random.uniform(-1.0, 1.0, (n_ships, task.n_commands))
        _, rewards, terminated, truncated = engine.step(orders)
        earned.append(rewards[sailing])
        parts.append(engine.reward_parts[sailing])
        sailing &= ~(terminated | truncated)
        if not sailing.any():
            break
    all_earned = np.concatenate(earned)
    all_parts = np.concatenate(parts)
    losses = all_parts[:, -1]
    return _Sailed(all_earned, all_parts, lost=bool((losses < 0.0).any()))


def _hard_to_learn(engine: Engine) -> list[str]:
    """Remark on rewards of which most lies in rare events, or that hardly differ."""
    sailed = _sailed_at_random(engine)
    scale = engine.task.half_reward_cost
    remarks = _mostly_rare(sailed, is_bounded=scale > 0.0)
    if scale > 0.0:
        least_reward = engine.task.definition.perfect_step - 1.0
        remarks += _faint(sailed.rewards, least_reward, scale)
    return remarks


def _mostly_rare(sailed: _Sailed, *, is_bounded: bool) -> list[str]:
    most = 0.2  # share of all reward in rare events that learners cope with
    size = np.abs(sailed.rewards)
    median = float(np.median(size))
    is_large = size > RARE * median
    all_reward = max(size.sum(), 1e-300)
    rare_share = float(size[is_large].sum() / all_reward)
    largest = float(sailed.rewards[size.argmax()])
    if rare_share <= most or is_large.mean() >= SELDOM:
        return []
    remedy = "give a larger scale as bounded" if is_bounded else "leave bounded=True"
    if sailed.lost:
        remedy += ", or lower loss_horizon"
    return [
        f"reward: expected at most {100.0 * most:.0f} % of all reward in steps of"
        f" more than {RARE:g} times the median, {median:.3g}, got"
        f" {100.0 * rare_share:.0f} % under random orders, in one step"
        f" {largest:.4g}: one event drowns the rest; {remedy}"
    ]


def _faint(rewards: Floats, least_reward: float, scale: float) -> list[str]:
    faint = 0.02  # bounded reward that most steps should earn
    above_least = float(np.median(rewards)) - least_reward
    if above_least >= faint:
        return []
    cost = scale / max(above_least, 1e-9) - scale
    return [
        f"reward: expected a median of {faint:g} above the least reward under"
        f" random orders, got {above_least:.2g}: a step costs {cost:.3g}, which"
        f" earns next to nothing with bounded={scale:g}; give a tenth of that cost"
        " as bounded"
    ]
