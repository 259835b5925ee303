"""Hooks: functions that loops call, and that are replaced when a loop is compiled.

A loop over ships is written against these functions. When it is compiled for a ship, a
sea, a sensor set and a task, each is replaced by the function of that name that one of
them provides (`shipgym.engine.specialise`); the functions here only document the
interface. `CompiledShip.hooks`, `sea_hooks` and `EpisodeProgram.hooks` give them.

Functions that load and store records are written from the rows of each record
(`shipgym.engine.record_code`). They take an array and a lane; where it is a vector and
not a tile, the lane does not matter and is left out by who reads it. Two more hooks,
`accelerations` and `shaft_acceleration`, have a body of their own and stand in
`shipgym.engine.motion`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from shipgym.engine.specialise import called

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from shipgym.arrays import Floats
    from shipgym.engine.envelope import Envelope
    from shipgym.engine.lane_records import (
        Commands,
        EpisodeCounters,
        Inputs,
        Outcome,
        Point,
        Rules,
        SeaChannels,
        SeaRandom,
        Sums,
        WindAccelerations,
    )
    from shipgym.engine.memory import Arguments
    from shipgym.engine.motion import Motion, Push, Rates, Ship
    from shipgym.engine.tiles import Tile
    from shipgym.sea.open_sea import Sea, SeaParameters
    from shipgym.tasks.contract import Interval, Random, Readings

    Words = NDArray[Any]

RECORDS = "written from the rows of a record when a loop is compiled"
SHIP = "given by the ship when a loop is compiled"
SEA = "given by the sea when a loop is compiled"
SENSORS = "given by the sensor set when a loop is compiled"
TASK = "given by the task when a loop is compiled"

# Records of a lane, in its tile of states


def load_motion(state: Floats, lane: int = 0) -> Motion:
    """Read the motion of the ship."""
    raise NotImplementedError(RECORDS)


def store_motion(state: Floats, lane: int, motion: Motion) -> None:
    """Write the motion of the ship."""
    raise NotImplementedError(RECORDS)


def load_sea(state: Floats, lane: int = 0) -> Sea:
    """Read the state of the sea around the ship; zeros in calm water."""
    raise NotImplementedError(RECORDS)


def store_sea(state: Floats, lane: int, sea: Sea) -> None:
    """Write the state of the sea around the ship; nothing in calm water."""
    raise NotImplementedError(RECORDS)


def load_commands(state: Floats, lane: int) -> Commands:
    """Read the commands of the ship."""
    raise NotImplementedError(RECORDS)


def store_commands(state: Floats, lane: int, commands: Commands) -> None:
    """Write the commands of the ship."""
    raise NotImplementedError(RECORDS)


def load_counters(state: Floats, lane: int) -> EpisodeCounters:
    """Read the counters of the episode."""
    raise NotImplementedError(RECORDS)


def store_counters(state: Floats, lane: int, counters: EpisodeCounters) -> None:
    """Write the counters of the episode."""
    raise NotImplementedError(RECORDS)


def load_memory(state: Floats, lane: int) -> Any:
    """Read the memory of the instruments, `Memory` of the sensor set."""
    raise NotImplementedError(RECORDS)


def store_memory(state: Floats, lane: int, memory: Any) -> None:
    """Write the memory of the instruments."""
    raise NotImplementedError(RECORDS)


def load_task_state(state: Floats, lane: int) -> Any:
    """Read the `State` of the task."""
    raise NotImplementedError(RECORDS)


def store_task_state(state: Floats, lane: int, task_state: Any) -> None:
    """Write the `State` of the task."""
    raise NotImplementedError(RECORDS)


# Records of a control interval, in the room for results


def load_outcome(result: Floats, lane: int) -> Outcome:
    """Read the outcome of the interval."""
    raise NotImplementedError(RECORDS)


def store_outcome(result: Floats, lane: int, outcome: Outcome) -> None:
    """Write the outcome of the interval."""
    raise NotImplementedError(RECORDS)


def store_reward(result: Floats, lane: int, reward: Any) -> None:
    """Write the parts of the reward, `Reward` of the task."""
    raise NotImplementedError(RECORDS)


def store_reported(result: Floats, lane: int, task_state: Any) -> None:
    """Write the fields of the task's state that `info` has."""
    raise NotImplementedError(RECORDS)


def store_observation(result: Floats, lane: int, observation: Any, scale: Any) -> None:
    """Write the task's `Observation` times `scale`, clipped to its bounds."""
    raise NotImplementedError(RECORDS)


def store_goals(result: Floats, lane: int, goals: Any, scale: Any) -> None:
    """Write the task's goals times `scale`, clipped to their bounds, if it has any."""
    raise NotImplementedError(RECORDS)


def load_goal(tile: Floats, lane: int) -> Any:
    """Read a `Goal` of the task."""
    raise NotImplementedError(RECORDS)


def no_reward() -> Any:
    """Make a `Reward` of zeros."""
    raise NotImplementedError(RECORDS)


def total_reward(reward: Any) -> float:
    """Sum the parts of a `Reward`."""
    raise NotImplementedError(RECORDS)


# Records of ships, of random numbers, of settings, and of arguments


def load_ship(ships: Floats, lane: int = 0) -> Ship:
    """Read the particulars that every ship has in addition to her coefficients."""
    raise NotImplementedError(RECORDS)


def load_coefficients(ships: Floats, lane: int = 0) -> Any:
    """Read the coefficients of the ship, a record of hers."""
    raise NotImplementedError(RECORDS)


def load_sea_parameters(ships: Floats, lane: int = 0) -> SeaParameters:
    """Read the parameters of the sea around the ship; zeros in calm water."""
    raise NotImplementedError(RECORDS)


def load_envelope(ships: Floats, lane: int) -> Envelope:
    """Read the envelope of the data that the model was identified from."""
    raise NotImplementedError(RECORDS)


def load_scale(ships: Floats, lane: int) -> Any:
    """Read the factors by which observations are multiplied, an `Observation`."""
    raise NotImplementedError(RECORDS)


def load_goal_scale(ships: Floats, lane: int) -> Any:
    """Read the factors by which goals are multiplied, a pair of goals."""
    raise NotImplementedError(RECORDS)


def load_random(random: Words, lane: int) -> Random:
    """Read what the random numbers of the episode follow from."""
    raise NotImplementedError(RECORDS)


def store_random(random: Words, lane: int, keys: Random) -> None:
    """Write what the random numbers of the episode follow from."""
    raise NotImplementedError(RECORDS)


def load_sea_random(random: Words, lane: int) -> SeaRandom:
    """Read the state of the generator of the sea's random numbers."""
    raise NotImplementedError(RECORDS)


def store_sea_random(random: Words, lane: int, sea_random: SeaRandom) -> None:
    """Write the state of the generator of the sea's random numbers."""
    raise NotImplementedError(RECORDS)


def load_rules(settings: Floats) -> Rules:
    """Read the settings of the engine."""
    raise NotImplementedError(RECORDS)


def load_sensor_settings(settings: Floats) -> Any:
    """Read the `Settings` of the sensor set."""
    raise NotImplementedError(RECORDS)


def load_task_settings(task_settings: Floats, lane: int) -> Any:
    """Read the `Settings` of the task in a lane."""
    raise NotImplementedError(RECORDS)


def load_arguments(memory: Words) -> Arguments:
    """Read the locations of the arrays of an engine."""
    raise NotImplementedError(RECORDS)


def store_sea_channels(row: Floats, lane: int, channels: SeaChannels) -> None:
    """Write the recorded channels of the sea behind the state of a row."""
    raise NotImplementedError(RECORDS)


def load_wind(row: Floats) -> WindAccelerations:
    """Read the accelerations by measured wind."""
    raise NotImplementedError(RECORDS)


def load_inputs(row: Floats) -> Inputs:
    """Read a point of a measured trial."""
    raise NotImplementedError(RECORDS)


# Records between the stages of a step (`shipgym.engine.stages`), with the results


def load_point(result: Floats, lane: int) -> Point:
    """Read the position of the ship in the coordinates of her table."""
    raise NotImplementedError(RECORDS)


def store_point(result: Floats, lane: int, point: Point) -> None:
    """Write the position of the ship in the coordinates of her table."""
    raise NotImplementedError(RECORDS)


def load_sums(result: Floats, lane: int) -> Sums:
    """Read the sums over the rows of the table so far."""
    raise NotImplementedError(RECORDS)


def store_sums(result: Floats, lane: int, sums: Sums) -> None:
    """Write the sums over the rows of the table so far."""
    raise NotImplementedError(RECORDS)


def load_slope(result: Floats, lane: int) -> Rates:
    """Read the rates at the stage before."""
    raise NotImplementedError(RECORDS)


def store_slope(result: Floats, lane: int, slope: Rates) -> None:
    """Write the rates at a stage."""
    raise NotImplementedError(RECORDS)


def load_slopes(result: Floats, lane: int) -> Rates:
    """Read the weighted sum of the rates at the stages so far."""
    raise NotImplementedError(RECORDS)


def store_slopes(result: Floats, lane: int, slopes: Rates) -> None:
    """Write the weighted sum of the rates at the stages so far."""
    raise NotImplementedError(RECORDS)


# The ship


@called
def sail_lanes(tile: Tile, h: float, groups: int) -> None:
    """Move groups of ships by h seconds, in one loop or stage by stage."""
    raise NotImplementedError(SHIP)


def point_of(motion: Motion, terms: Any, ship: Ship) -> Point:
    """Return the position of a ship in the coordinates of her table."""
    raise NotImplementedError(SHIP)


def add_row(point: Point, sums: Sums, terms: Any, row: int) -> Sums:
    """Add what one row of the table contributes to the sums."""
    raise NotImplementedError(SHIP)


def sum_accelerations(
    motion: Motion,
    sums: Sums,
    ship: Ship,
) -> tuple[float, float, float]:
    """Accelerations in surge, sway and yaw by the sums over the whole table."""
    raise NotImplementedError(SHIP)


# The sea


def push(motion: Motion, sea: Sea, p: SeaParameters) -> Push:
    """Accelerations by wind and waves now, and the current."""
    raise NotImplementedError(SEA)


def evolve(motion: Motion, h: float, sea: Sea, word: Any, p: SeaParameters) -> Sea:
    """Return the sea h seconds later, around a ship with her motion at that time."""
    raise NotImplementedError(SEA)


def current_at(x: float, y: float, settings: Any) -> tuple[float, float]:
    """Current that differs from place to place, north and east, m/s.

    Given by the task, whose settings it takes, or by a file of the sea.
    """
    raise NotImplementedError("given by a task that has it")


@called
def begin_sea(motion: Motion, word: Any, p: SeaParameters) -> Sea:
    """Return the sea at the beginning of an episode."""
    raise NotImplementedError(SEA)


def encounter_frequency(motion: Motion, sea: Sea, p: SeaParameters) -> float:
    """Frequency of encounter with the waves, rad/s; 0 in calm water."""
    raise NotImplementedError(SEA)


# The sensor set (interface: `shipgym.instruments.perfect`)


def measure(
    motion: Motion,
    sea: Sea,
    memory: Any,
    frequency: float,
    interval: Interval,
    settings: Any,
    random: Random,
) -> Any:
    """Return the memory of the instruments after a sample."""
    raise NotImplementedError(SENSORS)


def readings(motion: Motion, sea: Sea, memory: Any) -> Readings:
    """Return the readings of the instruments."""
    raise NotImplementedError(SENSORS)


# The task (interface: `shipgym.tasks.contract`). Functions that are given tile and lane
# take from them what else they name (`shipgym.engine.extra_arguments`).


@called
def task_begin(
    ship: Ship,
    settings: Any,
    random: Random,
    plan: Floats,
) -> tuple[Motion, Any]:
    """Return the initial motion of the ship and state of the task in an episode."""
    raise NotImplementedError(TASK)


def task_step(
    motion: Motion,
    task_state: Any,
    interval: Interval,
    ship: Ship,
    settings: Any,
    tile: Tile,
    lane: int,
) -> tuple[Any, Any, bool, bool]:
    """Return state and reward of an interval, whether it failed, and has arrived."""
    raise NotImplementedError(TASK)


def observe(
    readings: Readings,
    task_state: Any,
    interval: Interval,
    ship: Ship,
    settings: Any,
    tile: Tile,
    lane: int,
) -> Any:
    """Return the observations of the autopilot, an `Observation` in SI units."""
    raise NotImplementedError(TASK)


def goals_of(
    motion: Motion,
    task_state: Any,
    interval: Interval,
    ship: Ship,
    settings: Any,
    tile: Tile,
    lane: int,
) -> Any:
    """Return the goals achieved and desired (`shipgym.tasks.goals`)."""
    raise NotImplementedError("given by a task that has it")


def goal_reward(achieved: Any, desired: Any, settings: Any) -> float:
    """Return the reward of a goal achieved for one desired."""
    raise NotImplementedError("given by a task that has it")


def due(
    motion: Motion,
    task_state: Any,
    interval: Interval,
    ship: Ship,
    settings: Any,
    tile: Tile,
    lane: int,
) -> bool:
    """Return whether an event is due, such as a new set-point."""
    raise NotImplementedError(TASK)


@called
def on_event(
    motion: Motion,
    task_state: Any,
    interval: Interval,
    ship: Ship,
    settings: Any,
    random: Random,
    plan: Floats,
) -> Any:
    """Return the state of the task after an event."""
    raise NotImplementedError(TASK)


def worst_cost(settings: Any) -> float:
    """Return the largest cost of an interval."""
    raise NotImplementedError(TASK)


# A task and the reward of another file (`shipgym.tasks.definition.rewarded_step`)


def step_of_task(
    motion: Motion,
    task_state: Any,
    interval: Interval,
    ship: Ship,
    settings: Any,
    tile: Tile,
    lane: int,
) -> tuple[Any, Any, bool, bool]:
    """Return the same as `task_step`, with a reward that is not used."""
    raise NotImplementedError(TASK)


def reward_of_another(
    motion: Motion,
    task_state: Any,
    interval: Interval,
    ship: Ship,
    settings: Any,
    tile: Tile,
    lane: int,
) -> Any:
    """Return the `Reward` of the other file."""
    raise NotImplementedError(TASK)
