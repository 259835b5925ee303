"""Starts of episodes as they are asked for, `reset(options={"start": {...}})`."""

from typing import Any

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_finite, check_keys, check_table, unexpected
from shipgym.engine.compiling import plain
from shipgym.engine.episodes import clear_lane
from shipgym.engine.hooks import (
    load_arguments,
    load_motion,
    load_ship,
    load_task_state,
    store_memory,
    store_motion,
    store_task_state,
    task_step,
)
from shipgym.engine.judging import last_interval, observe_lane, sample, settings_of
from shipgym.engine.motion import lost
from shipgym.engine.records import LANES
from shipgym.engine.tiles import outputs_in, tile_of, write_outputs
from shipgym.envs.engine import Engine
from shipgym.errors import InputError

NO_TIME = 1e-9  # s: a task judges its start as an interval of no length


#: What may be asked of a start, SI units, and the number of the state that it is.
NUMBERS = {
    "speed": "u",  # m/s, ahead, through the water
    "yaw_rate": "r",  # rad/s
    "rudder": "delta",  # rad, commanded as well
    "cross_track": "cross_track",  # m, to starboard of the path
    "heading_error": "heading_setpoint",  # rad, set-point less heading
}


def start_lanes(engine: Engine, asked: Any, chosen: Flags) -> None:
    """Begin the chosen lanes, whose episodes have begun, with another start.

    Raises InputError for a name or number that does not fit, or a ship that would be
    lost or have arrived at the start.

    Parameters
    ----------
    engine : Engine
    asked : mapping of str to float or array-like of shape (num_envs,)
        By the names of `NUMBERS`.
    chosen : bool array of shape (num_envs,)
    """
    where = "options: start"
    rows = engine.program.state_rows
    present = {*rows["motion"].present, *rows["task_state"].present}
    known = [name for name, row in NUMBERS.items() if row in present]
    if "leg.sine" not in present and "cross_track" in known:
        known.remove("cross_track")
    check_keys(check_table(asked, where), known, where)
    columns = {
        name: check_numbers(engine, name, values) for name, values in asked.items()
    }

    errors = columns.pop("heading_error", np.full(engine.num_envs, np.nan))
    place_ships(engine, columns, chosen)
    judge = plain(judge_start, engine.program.hooks)
    for lane in np.flatnonzero(chosen).tolist():
        with np.errstate(all="ignore"):
            fits = judge(engine._memory, engine.outputs.memory, lane, errors[lane])
        if not fits:
            raise InputError(
                "options: start: expected a ship that is under control and on her way,"
                f" got one beyond the physical range, lost or arrived in lane {lane}"
            )


def check_numbers(engine: Engine, name: str, values: Any) -> Floats:
    """Return a number of a start for each lane, shape (num_envs,)."""
    where = f"options: start: {name}"
    numbers = check_finite(values, where)
    if numbers.shape not in ((), (engine.num_envs,)):
        expected = f"a number, or one for each of {engine.num_envs} rows"
        raise unexpected(where, expected, values)
    limit = engine.model.steering.limit
    ranges = {
        "speed": (0.0, np.inf),
        "heading_error": (-np.pi, np.pi),
        "rudder": (-limit, limit),
    }
    least, most = ranges.get(name, (-np.inf, np.inf))
    if numbers.min() < least or numbers.max() > most:
        expected = f"{least:g} to {most:g} in SI units"
        raise unexpected(where, expected, values)
    return np.broadcast_to(numbers, (engine.num_envs,))


def place_ships(engine: Engine, columns: dict[str, Floats], chosen: Flags) -> None:
    """Write numbers of a start into the state of the chosen lanes."""
    numbers = {NUMBERS[name]: values for name, values in columns.items()}
    if "delta" in numbers:
        limit = engine._ship_number("rudder_limit")
        numbers["rudder_command"] = numbers["delta"] / limit
    if "cross_track" in numbers:
        aside = numbers.pop("cross_track") - engine.read("cross_track")
        numbers["x"] = engine.read("x") - aside * engine.read("leg.sine")
        numbers["y"] = engine.read("y") + aside * engine.read("leg.cosine")
    for name, values in numbers.items():
        engine.write(name, np.where(chosen, values, engine.read(name)))


def judge_start(
    memory: Any, output_memory: Any, number: int, heading_error: float
) -> bool:
    """Store what task and instruments make of a start; whether it is one."""
    at = load_arguments(np.frombuffer(memory, dtype=np.int64))
    tile = tile_of(memory, at, number // LANES)
    lane = number % LANES
    clear_lane(tile.result, lane)
    ship = load_ship(tile.ships, lane)
    settings = settings_of(tile)
    motion = load_motion(tile.state, lane)
    state = load_task_state(tile.state, lane)
    interval = last_interval(tile, lane)
    judged = interval._replace(dt=NO_TIME, rudder_before=motion.delta)
    more = (judged, ship, settings.task)
    after, _, failed, arrived = task_step(motion, state, *more)
    if not np.isnan(heading_error):
        motion = motion._replace(psi=after.heading_setpoint - heading_error)
        after, _, failed, arrived = task_step(motion, state, *more)
    store_motion(tile.state, lane, motion)
    store_task_state(tile.state, lane, after)
    seen = sample(tile, lane, motion, interval, settings)
    store_memory(tile.state, lane, seen)
    observe_lane(tile, lane)
    write_outputs(tile, outputs_in(memory, output_memory, at), lane, lane + 1)
    return not (failed or arrived or lost(motion, ship))
