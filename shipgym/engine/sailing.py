"""Many ships through an interval: their commands, and the steps of the integration.

Ships lie in tiles of 64 lanes. A loop over lanes is vectorised: entries of arrays are
named by unsigned numbers in it, because one that could be negative, and would count
from the end, keeps a loop from being vectorised.
"""

from typing import Any

import numpy as np

from shipgym.engine.hooks import (
    evolve,
    load_coefficients,
    load_commands,
    load_counters,
    load_motion,
    load_rules,
    load_sea,
    load_sea_parameters,
    load_sea_random,
    load_ship,
    push,
    store_commands,
    store_counters,
    store_motion,
    store_sea,
    store_sea_random,
)
from shipgym.engine.lane_records import Commands, EpisodeCounters, SeaRandom
from shipgym.engine.mathematics import clip, pick
from shipgym.engine.motion import (
    HAS_SEA,
    Motion,
    Push,
    Ship,
    lost,
    sail,
)
from shipgym.engine.random import EVOLVE_WORDS
from shipgym.engine.record_code import changer
from shipgym.engine.specialise import called
from shipgym.engine.tiles import FIRST_LANE, GROUP, SHARED_SHIP, Tile

counted = changer(EpisodeCounters, "steps", "ran_away")


def are_finite(actions: Any) -> bool:
    """Return whether all commands are finite."""
    wrong = 0
    for action in actions:
        wrong += 0 if abs(action) < np.inf else 1
    return wrong == 0


@called
def take_commands(tile: Tile, actions: Any, n_ships: int) -> None:
    """Take the commands of ships whose episode is not over.

    `actions` holds rows of commands, one after another: of the rudder and, if there is
    a second, of the shaft.
    """
    state = tile.state
    least_shaft = load_rules(tile.settings).least_shaft
    shafts = len(actions) - n_ships  # where commands of shafts begin, if there are any
    for lane in range(tile.lanes):
        ship = tile.first + lane
        rudder = float(actions[np.uintp(ship)])
        shaft = float(actions[np.uintp(shafts + ship)])
        rudder = clip(rudder, -1.0, 1.0)
        shaft = clip(shaft, least_shaft, 1.0)

        held = load_commands(state, lane)
        motion = load_motion(state, lane)
        before = load_counters(state, lane)
        over = before.ended != 0.0
        keeps_shaft = over | (shafts == 0)
        commands = Commands(
            rudder_command=pick(over, held.rudder_command, rudder),
            shaft_command=pick(keeps_shaft, held.shaft_command, shaft),
            rudder_before=motion.delta,
        )
        counters = counted(before, before.steps + (1.0 - before.ended), 0.0)
        store_commands(state, lane, commands)
        store_counters(state, lane, counters)


@called
def sail_in_one_loop(tile: Tile, h: float, groups: int) -> None:
    """Move groups of ships by h seconds: the hook `sail_lanes` of most ships."""
    state = tile.state
    shared = ship_of(tile, FIRST_LANE)
    for lane in range(groups * GROUP):
        ship, coefficients = shared if SHARED_SHIP else ship_of(tile, lane)
        before = load_motion(state, lane)
        commands = load_commands(state, lane)
        rudder = commands.rudder_command * ship.rudder_limit
        shaft = commands.shaft_command * ship.shaft
        pushed = push_of(tile, lane)
        after = sail(before, rudder, shaft, h, pushed, coefficients, ship)
        end_substep(tile, lane, after, h, ship)


def ship_of(tile: Tile, lane: int) -> tuple[Ship, Any]:
    """Return the ship of a lane, and her coefficients."""
    return load_ship(tile.ships, lane), load_coefficients(tile.ships, lane)


def push_of(tile: Tile, lane: int) -> Push:
    """Return the accelerations and current of the sea on the ship of a lane now."""
    motion = load_motion(tile.state, lane)
    sea = load_sea(tile.state, lane)
    pushed: Push = push(motion, sea, load_sea_parameters(tile.ships, lane))
    return pushed


def end_substep(tile: Tile, lane: int, after: Motion, h: float, ship: Ship) -> None:
    """Store the state of a ship after h seconds, and advance the sea.

    A ship that would run away, or whose episode is over, keeps her state.
    """
    state = tile.state
    before = load_motion(state, lane)
    counters = load_counters(state, lane)
    over = counters.ended != 0.0
    away = lost(after, ship)
    motion = pick(away | over, before, after)
    ran_away = pick(away, 1.0, counters.ran_away)
    counters = counted(counters, counters.steps, ran_away)
    if HAS_SEA:
        evolve_sea(tile, lane, motion, h, over)
    store_motion(state, lane, motion)
    store_counters(state, lane, counters)


def evolve_sea(tile: Tile, lane: int, motion: Motion, h: float, over: bool) -> None:
    """Advance the sea around a ship by h seconds, unless her episode is over."""
    sea = load_sea(tile.state, lane)
    parameters = load_sea_parameters(tile.ships, lane)
    word = load_sea_random(tile.random, lane).rng_state
    evolved = evolve(
        motion,
        h,
        sea,
        word,
        parameters,
    )
    store_sea(tile.state, lane, pick(over, sea, evolved))
    store_sea_random(tile.random, lane, SeaRandom(word + EVOLVE_WORDS))
