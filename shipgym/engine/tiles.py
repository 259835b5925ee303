"""Ships tile by tile: the arrays of 64 of them, and the outputs of all."""

from typing import Any, NamedTuple

import numpy as np

from shipgym.engine.memory import (
    Arguments,
    bool_in,
    float32_in,
    int64_row_in,
    row_in,
    uint64_row_in,
)
from shipgym.engine.records import LANES
from shipgym.engine.specialise import called

# Lanes are computed in whole vectors, so that results do not depend on the number of
# ships: the arithmetic of a single lane may be contracted differently.
GROUP = 16
# typed, since Numba compiles a function once more for a literal that it is called with
FIRST_LANE: Any = np.int64(0)

# Set when a loop is compiled, like hooks.
PLAN_ROW = 0  # first row of the plans of episodes
# whether all lanes have the same ship, which is then read before a loop and not in it
SHARED_SHIP = True


class Tile(NamedTuple):
    """Arrays of 64 ships."""

    state: Any  # float64 (n_rows * 64,), at its end the plans of episodes
    result: Any  # float64 (n_result_rows * 64,): of the interval, shared by tiles
    random: Any  # uint64 (3 * 64,): `Random` and `SeaRandom`
    # float64 (n_ship_rows * 64,), or (n_ship_rows,) where all lanes share a ship
    ships: Any
    pool: Any  # float64 (n_pool * n_ship_rows,), of which each episode draws a ship
    settings: Any  # float64: of the engine and the sensor set
    task_settings: Any  # float64 (n_settings,)
    first: int  # number of its first ship
    lanes: int  # how many ships there are


class OutputTables(NamedTuple):
    """Tables returned to users, row after row, and the sources of their rows."""

    observations: Any  # float32 (n_ships * n_observations,)
    outcomes: Any  # float64 (n_outcomes * n_ships,)
    flags: Any  # bool (n_flags * n_ships,)
    observed: Any  # int64 (n_observations,): entries of results where rows begin
    informed: Any  # int64 (n,), the same of the first outcomes
    reported: Any  # int64 (n,): entries of states, of the other outcomes
    flagged: Any  # int64 (n_flags,): rows of outcomes
    n_ships: int


def tile_of(memory: Any, at: Arguments, number: int) -> Tile:
    """Return one tile, with the room for its results."""
    first = number * LANES
    return Tile(
        state=row_in(memory, at.states, number),
        result=row_in(memory, at.results, 0),
        random=uint64_row_in(memory, at.random, number),
        ships=row_in(memory, at.ships, number % at.ships.rows),
        pool=row_in(memory, at.pool, 0),
        settings=row_in(memory, at.settings, 0),
        task_settings=row_in(memory, at.task_settings, 0),
        first=first,
        lanes=min(at.actions.columns - first, LANES),
    )


def outputs_in(memory: Any, output_memory: Any, at: Arguments) -> OutputTables:
    """Return the tables of outputs."""
    return OutputTables(
        observations=float32_in(output_memory, at.observations),
        outcomes=output_memory[at.outcomes.first :],
        flags=bool_in(output_memory, at.flags),
        observed=int64_row_in(memory, at.observed, 0),
        informed=int64_row_in(memory, at.informed, 0),
        reported=int64_row_in(memory, at.reported, 0),
        flagged=int64_row_in(memory, at.flagged, 0),
        n_ships=at.observations.rows,
    )


def plan_of(state: Any, lane: int) -> Any:
    """Return the plan of a lane's episode, an array that writes into the tile."""
    return state[PLAN_ROW * LANES + lane :: LANES]


def copy_lanes(
    target: Any, first: int, step: int, source: Any, row: int, begin: int, end: int
) -> None:
    """Copy a row of some lanes into an array, `step` entries apart from `first` on."""
    for lane in range(begin, end):
        entry = np.uintp(first + lane * step)
        target[entry] = source[np.uintp(row + lane)]


@called
def write_outputs(tile: Tile, outputs: OutputTables, begin: int, end: int) -> None:
    """Copy results of some lanes into the users' arrays."""
    first = tile.first
    n_ships = outputs.n_ships
    outcomes = outputs.outcomes
    width = len(outputs.observed)
    for column in range(width):
        at = first * width + column
        row = outputs.observed[column]
        copy_lanes(outputs.observations, at, width, tile.result, row, begin, end)

    for number in range(len(outputs.informed)):
        at = first + number * n_ships
        row = outputs.informed[number]
        copy_lanes(outcomes, at, 1, tile.result, row, begin, end)

    behind = first + len(outputs.informed) * n_ships
    for number in range(len(outputs.reported)):
        at = behind + number * n_ships
        row = outputs.reported[number]
        copy_lanes(outcomes, at, 1, tile.state, row, begin, end)

    flags = outputs.flags
    for row in range(len(outputs.flagged)):
        source = first + outputs.flagged[row] * n_ships
        target = first + row * n_ships
        for lane in range(begin, end):
            entry = np.uintp(target + lane)
            flags[entry] = outcomes[np.uintp(source + lane)] > 0.0
