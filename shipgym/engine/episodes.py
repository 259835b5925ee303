"""Episodes of many ships at once: take a control interval, and begin them.

Ships lie in tiles of 64 lanes. What every step needs is a loop over lanes, which is
vectorised (`shipgym.engine.sailing`, `shipgym.engine.judging`); rare work is done
afterwards, lane by lane. The ship, the sea, the sensor set and the task are hooks
(`shipgym.engine.hooks`): these files know none of them.
"""

from typing import Any

import numpy as np

from shipgym.engine.hooks import (
    begin_sea,
    load_arguments,
    load_counters,
    load_outcome,
    load_random,
    load_rules,
    load_sea_parameters,
    load_ship,
    sail_lanes,
    store_commands,
    store_memory,
    store_motion,
    store_random,
    store_sea,
    store_sea_random,
    store_task_state,
    task_begin,
)
from shipgym.engine.judging import (
    conclude_lanes,
    last_interval,
    observe_lane,
    sample,
    settings_of,
    take_events,
)
from shipgym.engine.lane_records import Commands, Random, SeaRandom
from shipgym.engine.mathematics import pick
from shipgym.engine.memory import bool_in, float32_in
from shipgym.engine.motion import HAS_SEA, Motion
from shipgym.engine.random import BEGIN_WORDS, rng_state, uniform
from shipgym.engine.records import LANES
from shipgym.engine.sailing import are_finite, take_commands
from shipgym.engine.specialise import called
from shipgym.engine.tiles import (
    FIRST_LANE,
    GROUP,
    OutputTables,
    Tile,
    outputs_in,
    plan_of,
    tile_of,
    write_outputs,
)

SIGNATURE = "int64(float64[::1], float64[::1], int64)"
STEP, STEP_AND_BEGIN, BEGIN, BEGIN_NEXT = range(4)  # what `run` may be asked for
REFUSED = -1  # answer of a step to commands that are not finite
# number of the draw of an episode's ship, apart from those of its task
SHIP_DRAW = np.uint64(1 << 40)


def run(memory: Any, output_memory: Any, asked: int) -> int:
    """Take a step of all ships, or begin episodes.

    Parameters
    ----------
    memory, output_memory : float64 array
        In which the engine's arrays lie, and those that users are given
        (`shipgym.engine.memory`).
    asked : int
        `STEP`; `STEP_AND_BEGIN`, in which lanes whose episode was over do not stay as
        they are, but begin the next one; `BEGIN` or `BEGIN_NEXT` in the chosen lanes.

    Returns
    -------
    int
        Number of episodes that ended, or `REFUSED`, nothing changed, if a command is
        not finite.
    """
    at = load_arguments(np.frombuffer(memory, dtype=np.int64))
    outputs = outputs_in(memory, output_memory, at)
    chosen = bool_in(memory, at.chosen)
    if asked >= BEGIN:
        for number in range(at.states.rows):
            tile = tile_of(memory, at, number)
            begin_lanes(tile, outputs, chosen, asked == BEGIN_NEXT)
        return 0

    actions = float32_in(memory, at.actions)
    if not are_finite(actions):
        return REFUSED
    n_ended = 0
    for number in range(at.states.rows):
        tile = tile_of(memory, at, number)
        rules = load_rules(tile.settings)
        groups = (tile.lanes + GROUP - 1) // GROUP

        take_commands(tile, actions, at.actions.columns)
        for _ in range(int(rules.substeps)):
            sail_lanes(tile, rules.dt / rules.substeps, groups)
        n_due, ended_here = conclude_lanes(tile, groups)
        n_ended += ended_here
        if n_due > 0:
            take_events(tile)
        write_outputs(tile, outputs, FIRST_LANE, tile.lanes)
        if asked == STEP_AND_BEGIN:
            choose_ended(tile, chosen)
            begin_lanes(tile, outputs, chosen, asked == STEP_AND_BEGIN)
    return n_ended


def judge_again(memory: Any, number: int) -> None:
    """Judge the last interval of one tile, and take its events, to see what fails."""
    at = load_arguments(np.frombuffer(memory, dtype=np.int64))
    tile = tile_of(memory, at, number)
    conclude_lanes(tile, tile.lanes)
    take_events(tile)


def choose_ended(tile: Tile, chosen: Any) -> None:
    """Choose the lanes of a tile whose episode was over before this interval."""
    for lane in range(tile.lanes):
        ship = np.uintp(tile.first + lane)
        counters = load_counters(tile.state, lane)
        outcome = load_outcome(tile.result, lane)
        just_ended = outcome.terminated + outcome.truncated
        chosen[ship] = counters.ended > just_ended


@called
def begin_lanes(tile: Tile, outputs: OutputTables, chosen: Any, next_one: bool) -> None:
    """Begin an episode in the chosen lanes of a tile, and write its outputs.

    It is the one of the lane's key and number, or, with `next_one`, the next one under
    the key.
    """
    for lane in range(tile.lanes):
        ship = np.uintp(tile.first + lane)
        if chosen[ship]:
            if next_one:
                key, episode = load_random(tile.random, lane)
                following = Random(key, episode + np.uint64(1))
                store_random(tile.random, lane, following)
            begin_lane(tile, lane)
            write_outputs(tile, outputs, lane, lane + 1)


def begin_lane(tile: Tile, lane: int) -> None:
    """Begin an episode in a lane, with a ship of the pool if there is one."""
    state = tile.state
    random = load_random(tile.random, lane)
    draw_ship(tile, lane, random)
    clear_lane(state, lane)
    clear_lane(tile.result, lane)

    settings = settings_of(tile)
    ship = load_ship(tile.ships, lane)
    plan = plan_of(state, lane)
    motion, task_state = task_begin(ship, settings.task, random, plan)
    has_shaft = ship.shaft > 0.0
    part_of_service = motion.n / pick(has_shaft, ship.shaft, 1.0)
    commands = Commands(
        rudder_command=0.0,
        shaft_command=pick(has_shaft, part_of_service, 1.0),
        rudder_before=0.0,
    )
    store_motion(state, lane, motion)
    store_commands(state, lane, commands)
    store_task_state(state, lane, task_state)
    if HAS_SEA:
        begin_sea_of(tile, lane, motion, random)

    interval = last_interval(tile, lane)
    memory = sample(tile, lane, motion, interval, settings)
    store_memory(state, lane, memory)
    observe_lane(tile, lane)


def begin_sea_of(tile: Tile, lane: int, motion: Motion, random: Random) -> None:
    """Draw the sea around the ship of a lane."""
    word = rng_state(random.key, random.episode)
    parameters = load_sea_parameters(tile.ships, lane)
    sea = begin_sea(motion, word, parameters)
    store_sea(tile.state, lane, sea)
    store_sea_random(tile.random, lane, SeaRandom(word + BEGIN_WORDS))


def clear_lane(tile: Any, lane: int) -> None:
    """Set all numbers of a lane to zero."""
    for row in range(len(tile) // LANES):
        tile[row * LANES + lane] = 0.0


def draw_ship(tile: Tile, lane: int, random: Random) -> None:
    """Put a ship of the pool in a lane, if there is a pool."""
    ships = tile.ships
    pool = tile.pool
    if len(pool) == 0:
        return
    n_rows = len(ships) // LANES
    n_pool = len(pool) // n_rows
    drawn = uniform(random.key, random.episode, SHIP_DRAW, 0.0, float(n_pool))
    first = int(drawn) * n_rows
    for row in range(n_rows):
        ships[row * LANES + lane] = pool[first + row]
