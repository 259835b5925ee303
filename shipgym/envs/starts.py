"""Starts of episodes as they are asked for, `reset(options={"start": {...}})`."""

from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Flags
from shipgym.checks import check_finite, check_keys, check_table, unexpected
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
    store_task_state,
    task_step,
)
from shipgym.engine.judging import last_interval, observe_lane, sample, settings_of
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
    where = "options: start"
    state = field_types(engine.task.definition.State)
    needed = {"heading_error": {"heading_setpoint"}, "cross_track": {"leg"}}
    known = [name for name in Start._fields if needed.get(name, set()) <= set(state)]
    check_keys(check_table(asked, where), known, where)
    limits = {"heading_error": np.pi, "rudder": engine.model.steering.limit}
    columns = {}
    for name, values in asked.items():
        numbers = check_finite(values, f"{where}: {name}")
        limit = limits.get(name, np.inf)
        fits = numbers.shape in ((), (engine.num_envs,))
        if not fits or np.abs(numbers).max() > limit:
            expected = f"a number or {engine.num_envs}, up to {limit:g} to each side"
            raise unexpected(f"{where}: {name}", expected, values)
        columns[name] = np.broadcast_to(numbers, (engine.num_envs,))

    start = plain(start_lane, engine.program.hooks)
    for lane in np.flatnonzero(chosen).tolist():
        here = {name: float(values[lane]) for name, values in columns.items()}
        with np.errstate(all="ignore"):
            fits = start(engine._memory, engine.outputs.memory, lane, Start(**here))
        if not fits:
            raise InputError(
                "options: start: expected a ship that is under control and on her way,"
                f" got one beyond the physical range, lost or arrived in lane {lane}:"
                f" {here}"
            )


def start_lane(memory: Any, output_memory: Any, number: int, start: Start) -> bool:
    """Begin a lane with another start; return whether the ship can begin there."""
    at = load_arguments(np.frombuffer(memory, dtype=np.int64))
    tile = tile_of(memory, at, 0, number // LANES)
    lane = number % LANES
    clear_lane(tile.result, lane)
    motion = started(tile, lane, start)
    hold_rudder(tile, lane, motion)
    begins = judge_start(tile, lane, motion, start.heading_error)
    observe_lane(tile, lane)
    write_outputs(tile, outputs_in(memory, output_memory, at), lane, lane + 1)
    return begins


def started(tile: Any, lane: int, start: Start) -> Any:
    """Motion with the numbers of a start that are given, but for the heading."""
    motion = load_motion(tile.state, lane)
    numbers = {"u": start.speed, "r": start.yaw_rate, "delta": start.rudder}
    for name, value in numbers.items():
        if not np.isnan(value):
            motion = motion._replace(**{name: value})
    if np.isnan(start.cross_track):
        return motion
    state = load_task_state(tile.state, lane)
    aside = start.cross_track - state.cross_track
    return motion._replace(
        x=motion.x - aside * state.leg.sine,
        y=motion.y + aside * state.leg.cosine,
    )


def hold_rudder(tile: Any, lane: int, motion: Any) -> None:
    """Order the rudder where it stands."""
    limit = load_ship(tile.ships, lane).rudder_limit
    commands = load_commands(tile.state, lane)
    held = commands._replace(rudder_command=motion.delta / limit)
    store_commands(tile.state, lane, held)


def judge_start(tile: Any, lane: int, motion: Any, heading_error: float) -> bool:
    """Store a motion with what task and memory make of it; whether it is a start."""
    ship = load_ship(tile.ships, lane)
    settings = settings_of(tile)
    state = load_task_state(tile.state, lane)
    interval = last_interval(tile, lane)
    judged = interval._replace(dt=NO_TIME, rudder_before=motion.delta)
    more = (judged, ship, settings.task, tile, lane)
    after, _, failed, arrived = task_step(motion, state, *more)
    if not np.isnan(heading_error):
        motion = motion._replace(psi=after.heading_setpoint - heading_error)
        after, _, failed, arrived = task_step(motion, state, *more)
    store_motion(tile.state, lane, motion)
    store_task_state(tile.state, lane, after)
    seen = sample(tile, lane, motion, interval, settings)
    store_memory(tile.state, lane, seen)
    return not (failed or arrived or lost(motion, ship))
