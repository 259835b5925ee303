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
    rows = _rows(engine, asked)
    for lane in np.flatnonzero(chosen).tolist():
        one = Start(**{name: float(values[lane]) for name, values in rows.items()})
        with np.errstate(all="ignore"):
            fits = start(engine._memory, engine.outputs.memory, lane, one)
        if not fits:
            asked_here = {name: float(values[lane]) for name, values in rows.items()}
            raise InputError(
                "options: start: expected a ship that is under control and on her way,"
                f" got one beyond the physical range, lost or arrived in lane {lane}:"
                f" {asked_here}"
            )


def _rows(engine: Engine, asked: Any) -> Mapping[str, Any]:
    """Numbers of each lane by name; InputError for those that do not fit."""
    where = "options: start"
    known = list(Start._fields)
    state = field_types(engine.task.definition.State)
    if "heading_setpoint" not in state:
        known.remove("heading_error")
    if not {"leg", "cross_track"} <= set(state):
        known.remove("cross_track")
    check_keys(check_table(asked, where), known, where)
    rows = {}
    for name, values in asked.items():
        numbers = check_finite(values, f"{where}: {name}")
        if numbers.shape not in ((), (engine.num_envs,)):
            raise InputError(
                f"{where}: {name}: expected a number or {engine.num_envs}, got shape"
                f" {numbers.shape}"
            )
        largest = {"heading_error": np.pi, "rudder": engine.model.steering.limit}
        if name in largest and (np.abs(numbers) > largest[name]).any():
            raise InputError(
                f"{where}: {name}: expected at most {largest[name]:g} rad to each side,"
                f" got {np.abs(numbers).max():g}"
            )
        rows[name] = np.broadcast_to(numbers, (engine.num_envs,))
    return rows


def start_lane(memory: Any, output_memory: Any, number: int, start: Start) -> bool:
    """Begin a lane with another start; return whether the ship can begin there."""
    at = load_arguments(np.frombuffer(memory, dtype=np.int64))
    tile = tile_of(memory, at, 0, number // LANES)
    lane = number % LANES
    ship = load_ship(tile.ships, lane)
    motion = load_motion(tile.state, lane)
    state = load_task_state(tile.state, lane)
    settings = settings_of(tile)
    clear_lane(tile.result, lane)

    asked = {"u": start.speed, "r": start.yaw_rate, "delta": start.rudder}
    for name, value in asked.items():
        if value == value:  # not NaN
            motion = motion._replace(**{name: value})
    if start.cross_track == start.cross_track:
        aside = start.cross_track - state.cross_track
        motion = motion._replace(
            x=motion.x - aside * state.leg.sine,
            y=motion.y + aside * state.leg.cosine,
        )
    commands = load_commands(tile.state, lane)
    order = motion.delta / ship.rudder_limit
    store_commands(tile.state, lane, commands._replace(rudder_command=order))
    interval = last_interval(tile, lane)
    interval = interval._replace(dt=NO_TIME, rudder_before=motion.delta)
    given = (interval, ship, settings.task, tile, lane)
    after, _, failed, arrived = task_step(motion, state, *given)
    if start.heading_error == start.heading_error:
        motion = motion._replace(psi=after.heading_setpoint - start.heading_error)
        after, _, failed, arrived = task_step(motion, state, *given)

    store_motion(tile.state, lane, motion)
    store_task(tile, lane, after)
    store_memory(
        tile.state,
        lane,
        sample(tile, lane, motion, last_interval(tile, lane), settings),
    )
    observe_lane(tile, lane)
    write_outputs(tile, outputs_in(memory, output_memory, at), lane, lane + 1)
    return not (failed or arrived or lost(motion, ship))
