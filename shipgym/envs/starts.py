"""Starts of episodes as they are asked for, `reset(options={"start": {...}})`."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Flags
from shipgym.checks import check_finite, check_keys, check_table
from shipgym.engine.compiling import plain
from shipgym.engine.episodes import clear_lane
from shipgym.engine.hooks import (
    load_arguments,
    load_commands,
    load_motion,
    load_ship,
    load_task_state,
    store_commands,
    store_memory,
    store_motion,
    task_step,
)
from shipgym.engine.judging import (
    last_interval,
    observe_lane,
    sample,
    settings_of,
    store_task,
)
from shipgym.engine.motion import lost
from shipgym.engine.records import LANES, field_types
from shipgym.engine.tiles import outputs_in, tile_of, write_outputs
from shipgym.envs.engine import Engine
from shipgym.errors import InputError

NO_TIME = 1e-9  # s: a task judges its start as an interval of no length


class Start(NamedTuple):
    """What may be asked of a start, SI units; NaN where it is the task's."""

    heading_error: float = np.nan  # rad, set-point less heading
    cross_track: float = np.nan  # m, to starboard of the path
    speed: float = np.nan  # m/s, ahead, through the water
    yaw_rate: float = np.nan  # rad/s
    rudder: float = np.nan  # rad, commanded as well


def start_lanes(engine: Engine, asked: Any, chosen: Flags) -> None:
    """Begin the chosen lanes, whose episodes have begun, with another start.

    Raises InputError for a name or number that does not fit, or a ship that would be
    lost or have arrived at the start.

    Parameters
    ----------
    engine : Engine
    asked : mapping of str to float or array-like of shape (num_envs,)
        Fields of `Start`.
    chosen : bool array of shape (num_envs,)
    """
    start = plain(start_lane, engine.program.hooks)
    columns = _columns(engine, asked)
    lanes = np.flatnonzero(chosen)
    for lane in lanes.tolist():
        asked_here = {}
        for name, values in columns.items():
            asked_here[name] = float(values[lane])
        one = Start(**asked_here)
        with np.errstate(all="ignore"):
            fits = start(engine._memory, engine.outputs.memory, lane, one)
        if not fits:
            raise InputError(
                "options: start: expected a ship that is under control and on her way,"
                f" got one beyond the physical range, lost or arrived in lane {lane}:"
                f" {asked_here}"
            )


def _columns(engine: Engine, asked: Any) -> Mapping[str, Any]:
    """Numbers of each lane by name; InputError for those that do not fit."""
    known = list(Start._fields)
    state = field_types(engine.task.definition.State)
    if "heading_setpoint" not in state:
        known.remove("heading_error")
    if not {"leg", "cross_track"} <= set(state):
        known.remove("cross_track")
    where = "options: start"
    check_keys(check_table(asked, where), known, where)
    columns = {}
    for name, values in asked.items():
        columns[name] = _column(engine, name, values)
    return columns


def _column(engine: Engine, name: str, values: Any) -> Any:
    """Numbers of a name, one for each lane."""
    where = f"options: start: {name}"
    numbers = check_finite(values, where)
    shape = (engine.num_envs,)
    if numbers.shape not in ((), shape):
        count = engine.num_envs
        found = numbers.shape
        raise InputError(f"{where}: expected a number or {count}, got shape {found}")
    limit = np.inf
    if name == "heading_error":
        limit = np.pi
    elif name == "rudder":
        limit = engine.model.steering.limit
    sizes = np.abs(numbers)
    largest = sizes.max()
    if largest > limit:
        raise InputError(
            f"{where}: expected at most {limit:g} rad to each side, got {largest:g}"
        )
    return np.broadcast_to(numbers, shape)


def start_lane(memory: Any, output_memory: Any, number: int, start: Start) -> bool:
    """Begin a lane with another start; return whether the ship can begin there."""
    at = load_arguments(np.frombuffer(memory, dtype=np.int64))
    tile = tile_of(memory, at, 0, number // LANES)
    lane = number % LANES
    clear_lane(tile.result, lane)
    state = load_task_state(tile.state, lane)
    motion = started(load_motion(tile.state, lane), state, start)
    begins = begin_at(tile, lane, motion, state, start.heading_error)
    observe_lane(tile, lane)
    outputs = outputs_in(memory, output_memory, at)
    write_outputs(tile, outputs, lane, lane + 1)
    return begins


def started(motion: Any, state: Any, start: Start) -> Any:
    """Motion with the numbers of a start that are given, but for the heading."""
    asked = {"u": start.speed, "r": start.yaw_rate, "delta": start.rudder}
    for name, value in asked.items():
        if not np.isnan(value):
            motion = motion._replace(**{name: value})
    if np.isnan(start.cross_track):
        return motion
    aside = start.cross_track - state.cross_track
    return motion._replace(
        x=motion.x - aside * state.leg.sine,
        y=motion.y + aside * state.leg.cosine,
    )


def begin_at(
    tile: Any, lane: int, motion: Any, state: Any, heading_error: float
) -> bool:
    """Store a motion with what task and memory make of it; whether it is a start."""
    ship = load_ship(tile.ships, lane)
    settings = settings_of(tile)
    hold_rudder(tile, lane, motion.delta / ship.rudder_limit)
    interval = last_interval(tile, lane)
    interval = interval._replace(dt=NO_TIME, rudder_before=motion.delta)
    given = (interval, ship, settings.task, tile, lane)
    after, _, failed, arrived = task_step(motion, state, *given)
    if not np.isnan(heading_error):
        motion = motion._replace(psi=after.heading_setpoint - heading_error)
        after, _, failed, arrived = task_step(motion, state, *given)

    store_motion(tile.state, lane, motion)
    store_task(tile, lane, after)
    interval = last_interval(tile, lane)
    seen = sample(tile, lane, motion, interval, settings)
    store_memory(tile.state, lane, seen)
    return not (failed or arrived or lost(motion, ship))


def hold_rudder(tile: Any, lane: int, order: float) -> None:
    """Order the rudder where it stands, by its limit."""
    commands = load_commands(tile.state, lane)
    commands = commands._replace(rudder_command=order)
    store_commands(tile.state, lane, commands)
