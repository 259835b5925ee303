"""What is wrong with a task: a battery for any task, reward or sensor set of a user's own."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.engine.episode_program import EpisodeProgram
from shipgym.engine.records import flat, leaves
from shipgym.envs.engine import Engine
from shipgym.envs.environment import DEFAULT_MODEL, read_options
from shipgym.envs.plain_python import plain_loop
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.findings import Findings
from shipgym.python_files import asked
from shipgym.ships import ShipModel
from shipgym.tasks.task import Task

STEPS, PLAIN_STEPS = 400, 40
LANES, PLAIN_LANES = 70, 3  # more than a tile
AGREEMENT = 1e-5  # of compiled and plain results, whose last digits differ
BEYOND = 1e-6  # of a bound, what rounding makes
OFTEN = 0.05  # part of the observations beyond their bounds that is worth a remark


class TaskCheck(Findings):
    """What a check of a task found; its name is that of the task, or its file."""


def check_task(task: Any, **options: Any) -> TaskCheck:
    """Check a task for errors.

    Its records and functions; compilation; some steps in plain Python, whose errors
    name the line; some hundred steps of many ships by orders of a beginner: rewards,
    state and observations finite and within their bounds; the same results compiled and
    in plain Python, for one ship and for many.

    The task is a file or module (`shipgym.tasks.contract`), or the name of one of the
    package's; options are keywords of the environment, `model`, `reward` and `sensors`
    among them.
    """
    try:
        model, given, randomisation = read_options(
            task, options.pop("model", DEFAULT_MODEL), options
        )
        plain, seen = _plain_engine(model, given, randomisation)
        _sail_in_python(plain)
        few = Engine(model, PLAIN_LANES, given, randomisation)
        many = Engine(model, LANES, given, randomisation)
        one = Engine(model, 1, given, randomisation)
    except InputError as error:
        return TaskCheck(str(task), (str(error),))
    problems = [
        *_not_finite(many),
        *_differ(
            few,
            plain,
            slice(None),
            PLAIN_STEPS,
            AGREEMENT,
            ("compiled", "in plain Python"),
        ),
        *_differ(
            many, one, slice(-1, None), STEPS // 4, 0.0, ("among many ships", "alone")
        ),
    ]
    return TaskCheck(given.name, tuple(problems), tuple(_often_clipped(given, seen)))


def _plain_engine(
    model: ShipModel, task: Task, randomisation: Randomisation
) -> tuple[Engine, dict[str, list[float]]]:
    """An engine in plain Python, and all that it observes, before it is clipped, by path."""
    seen: dict[str, list[float]] = {
        quantity.path: [] for quantity in task.observed(model)
    }
    paths = leaves(task.definition.Observation)

    def noted(store: Any, tile: Any, lane: int, record: Any, scale: Any) -> None:
        if lane < PLAIN_LANES:
            for path, value, factor in zip(
                paths, flat(record), flat(scale), strict=True
            ):
                if path in seen:
                    seen[path].append(value * factor)
        store(tile, lane, record, scale)

    def loop(program: EpisodeProgram) -> Any:
        store = program.hooks["store_observation"]
        return plain_loop(program, {"store_observation": partial(noted, store)})

    return Engine(model, PLAIN_LANES, task, randomisation, loop=loop), seen


def _orders(engine: Engine, step: int) -> Floats:
    """What a beginner orders: nothing, hard over, to and fro; the same for the same lane."""
    lanes = np.arange(engine.num_envs)
    swing = np.sin(0.11 * step * (1.0 + 0.3 * (lanes % 7)) + lanes)
    kinds = np.stack([swing, np.sign(swing), np.zeros(len(lanes)), np.ones(len(lanes))])
    rudder = kinds[lanes % 4, np.arange(len(lanes))]
    return np.repeat(rudder[:, None], engine.task.n_commands, axis=1)


def _sail_in_python(plain: Engine) -> None:
    """Some steps in plain Python; the first error is an InputError that names its line and the step."""
    for step in range(PLAIN_STEPS):
        try:
            asked(plain.step, _orders(plain, step))
        except InputError as error:
            raise InputError(f"{error}, at step {step + 1} in plain Python") from error


def _not_finite(engine: Engine) -> Iterator[str]:
    """Parts of the reward, of the state and observations that are no finite numbers, each once."""
    seen = engine.reset(np.arange(engine.num_envs))
    definition = engine.task.definition
    names = [
        path
        for path in leaves(definition.State)
        if path in engine.program.state_rows["task_state"].present
    ]
    found: set[str] = set()
    for step in range(min(STEPS, engine.task.episode_steps) + 1):
        if step > 0:
            seen, *_ = engine.step(_orders(engine, step - 1))
        numbers: dict[str, NDArray[Any]] = {
            f"State.{name}": engine.read(name) for name in names
        }
        numbers |= {name: engine.info(name) for name in engine.task.reward_parts}
        observed = engine.task.observed(engine.model)
        numbers |= {
            f"Observation.{quantity.path}": seen[:, k]
            for k, quantity in enumerate(observed)
        }
        for name, values in numbers.items():
            if name not in found and not np.isfinite(values).all():
                found.add(name)
                lane = int(np.argmax(~np.isfinite(values)))
                source = (
                    definition.reward_source
                    if name.startswith("reward_")
                    else definition.source
                )
                if name.startswith("Observation.") and engine.task.sensors is not None:
                    source = f"{source}, or the sensors of {engine.task.sensors.source}"
                where = f"in lane {lane} at step {step}"
                yield (
                    f"{source}: {name} is {values[lane]} {where}, expected finite"
                    " numbers"
                )


def _differ(
    one: Engine,
    other: Engine,
    lanes: slice,
    steps: int,
    agreement: float,
    ways: tuple[str, str],
) -> Iterator[str]:
    """Observations and rewards of an engine's lanes that are not those of another, steered alike."""
    seeds = np.arange(one.num_envs)
    seen, expected = one.reset(seeds)[lanes], other.reset(seeds[lanes])
    earned: Floats = np.zeros(other.num_envs)
    due = earned
    paths = [
        f"Observation.{quantity.path}" for quantity in one.task.observed(one.model)
    ]
    for step in range(min(steps, one.task.episode_steps) + 1):
        first, second = (
            np.column_stack([earned, seen]),
            np.column_stack([due, expected]),
        )
        wrong = np.argwhere(
            ~np.isclose(first, second, rtol=agreement, atol=agreement, equal_nan=True)
        )
        for lane, k in wrong[:1]:
            name, found, expects = (
                ["reward", *paths][k],
                first[lane, k],
                second[lane, k],
            )
            yield (
                f"{name} is {found} {ways[0]} and {expects} {ways[1]} in lane"
                f" {seeds[lanes][lane]} at step {step}; look for what differs, such as"
                " a global that changes"
            )
            return
        orders = _orders(one, step)
        seen, earned, *_ = one.step(orders)
        seen, earned = seen[lanes], earned[lanes]
        expected, due, *_ = other.step(orders[lanes])


def _often_clipped(task: Task, seen: dict[str, list[float]]) -> Iterator[str]:
    """Observations that are often beyond their bounds."""
    for path, values in seen.items():
        spec = task.definition.observations[path]
        low, high = spec.low, spec.high
        beyond = [
            value for value in values if value < low - BEYOND or value > high + BEYOND
        ]
        part = len(beyond) / len(values)
        if part > OFTEN:
            furthest = max(beyond, key=abs)
            yield (
                f"Observation.{path}: {furthest:.3g} found in units of its scale,"
                f" beyond its bounds {low:g} to {high:g} in {100.0 * part:.0f} % of the"
                " steps, and clipped; give it wider bounds or a larger scale if more"
                " is to be seen"
            )
