"""Episodes of many ships at once: begin them, take a control interval.

Ships lie in tiles of 64 lanes. What every step needs is a loop over lanes, which is
vectorised; what is rare (a new set-point, the end of an episode) is done afterwards,
lane by lane. The ship, the sea, the sensor set and the task are hooks
(`shipgym.engine.hooks`): this file knows none of them.

Entries of arrays are named by unsigned numbers in loops over lanes: one that could be
negative, and would count from the end, keeps a loop from being vectorised.
"""

from typing import Any

import numpy as np

from shipgym.engine.envelope import Envelope, envelope_distance, outside_range
from shipgym.engine.hooks import (
    begin_sea,
    due,
    encounter_frequency,
    evolve,
    load_arguments,
    load_coefficients,
    load_commands,
    load_counters,
    load_envelope,
    load_memory,
    load_motion,
    load_outcome,
    load_random,
    load_rules,
    load_scale,
    load_sea,
    load_sea_parameters,
    load_sea_random,
    load_sensor_settings,
    load_ship,
    load_task_settings,
    load_task_state,
    measure,
    no_reward,
    observe,
    on_event,
    push,
    readings,
    sail_lanes,
    store_commands,
    store_counters,
    store_memory,
    store_motion,
    store_observation,
    store_outcome,
    store_random,
    store_reported,
    store_reward,
    store_sea,
    store_sea_random,
    store_task_state,
    task_begin,
    task_step,
    total_reward,
    worst_cost,
)
from shipgym.engine.lane_records import (
    Commands,
    EpisodeCounters,
    Outcome,
    Rules,
    SeaRandom,
)
from shipgym.engine.mathematics import clip, pick
from shipgym.engine.memory import bool_in, float32_in, int64_row_in
from shipgym.engine.motion import HAS_SEA, Motion, Ship, lost, sail
from shipgym.engine.random import BEGIN_WORDS, EVOLVE_WORDS, rng_state, uniform
from shipgym.engine.records import LANES
from shipgym.engine.specialise import called
from shipgym.engine.tiles import (
    OutputTables,
    Tile,
    outputs_in,
    plan_of,
    tile_of,
    write_outputs,
)
from shipgym.tasks.contract import Interval, Random

SIGNATURE = "int64(float64[::1], float64[::1], int64, int64)"
STEP, STEP_AND_BEGIN, BEGIN, BEGIN_NEXT = range(4)  # what `run` may be asked for
REFUSED = -1  # answer of a step to commands that are not finite
# number of the draw of an episode's ship, apart from those of its task
SHIP_DRAW = np.uint64(1 << 40)
# typed, since Numba compiles a function once more for a literal that it is called with
FIRST_LANE: Any = np.int64(0)
# Lanes are sailed in whole vectors, whose arithmetic may be contracted otherwise than
# that of a single lane, so that results do not depend on the number of ships.
GROUP = 16
# Whether all lanes have the same ship, which is then read before a loop and not in it;
# set when a loop is compiled.
SHARED_SHIP = True


def run(memory: Any, output_memory: Any, share: int, asked: int) -> int:
    """Take a step of one share of the ships, or begin episodes.

    The engine's arrays lie in its `memory`, and those that users are given in
    `output_memory` (`shipgym.engine.memory`). Asked is `STEP`, `STEP_AND_BEGIN`
    (lanes whose episode was over do not stay as they are, but begin the next one), or
    `BEGIN` or `BEGIN_NEXT` in the chosen lanes. Returns the number of episodes that ended, or `REFUSED`, nothing changed, if
    a command is not finite.
    """
    at = load_arguments(np.frombuffer(memory, dtype=np.int64), 0)
    outputs = outputs_in(memory, output_memory, at)
    chosen = bool_in(memory, at.chosen)
    if asked >= BEGIN:
        for number in range(at.states.rows):
            tile = tile_of(memory, at, share, number)
            begin_lanes(tile, outputs, chosen, asked == BEGIN_NEXT)
        return 0

    actions = float32_in(memory, at.actions)
    if not are_finite(actions):
        return REFUSED
    n_ended = 0
    tiles = int64_row_in(memory, at.shares, share)
    for number in range(tiles[0], tiles[1]):
        tile = tile_of(memory, at, share, number)
        rules = load_rules(tile.settings, 0)
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


def are_finite(actions: Any) -> bool:
    """Return whether all commands are finite."""
    wrong = 0
    for k in range(len(actions)):
        wrong += 0 if abs(actions[k]) < np.inf else 1
    return wrong == 0


@called
def take_commands(tile: Tile, actions: Any, n_ships: int) -> None:
    """Take the commands of ships whose episode is not over.

    `actions` holds rows of commands, one after another: of the rudder and, if there is
    a second, of the shaft.
    """
    least_shaft = load_rules(tile.settings, 0).least_shaft
    shafts = len(actions) - n_ships  # where commands of shafts begin, if there are any
    for lane in range(tile.lanes):
        ship = tile.first + lane
        held = load_commands(tile.state, lane)
        counters = load_counters(tile.state, lane)
        over = counters.ended != 0.0

        rudder = clip(float(actions[np.uintp(ship)]), -1.0, 1.0)
        shaft = clip(float(actions[np.uintp(shafts + ship)]), least_shaft, 1.0)
        keeps_shaft = over | (shafts == 0)
        commands = Commands(
            rudder_command=pick(over, held.rudder_command, rudder),
            shaft_command=pick(keeps_shaft, held.shaft_command, shaft),
            rudder_before=load_motion(tile.state, lane).delta,
        )
        steps = counters.steps + (1.0 - counters.ended)
        store_commands(tile.state, lane, commands)
        store_counters(tile.state, lane, EpisodeCounters(steps, counters.ended, 0.0))


@called
def sail_in_one_loop(tile: Tile, h: float, groups: int) -> None:
    """Move groups of ships by h seconds: the hook `sail_lanes` of most ships."""
    shared = ship_of(tile, FIRST_LANE)
    for lane in range(groups * GROUP):
        ship, coefficients = shared if SHARED_SHIP else ship_of(tile, lane)
        pushed = sea_push(tile, lane)
        before = load_motion(tile.state, lane)
        commands = load_commands(tile.state, lane)
        rudder = commands.rudder_command * ship.rudder_limit
        shaft = commands.shaft_command * ship.shaft
        after = sail(before, rudder, shaft, h, pushed, coefficients, ship)
        end_substep(tile, lane, after, h, ship)


def ship_of(tile: Tile, lane: int) -> tuple[Ship, Any]:
    """Return the ship of a lane, and her coefficients."""
    return load_ship(tile.ships, lane), load_coefficients(tile.ships, lane)


def sea_push(tile: Tile, lane: int) -> Any:
    """Return what the sea does to a ship now."""
    sea = load_sea(tile.state, lane)
    parameters = load_sea_parameters(tile.ships, lane)
    return push(load_motion(tile.state, lane), sea, parameters)


def end_substep(tile: Tile, lane: int, after: Motion, h: float, ship: Ship) -> None:
    """Store where a ship is after h seconds, and let the sea go on.

    A ship that would run away, or whose episode is over, stays where she was.
    """
    before = load_motion(tile.state, lane)
    counters = load_counters(tile.state, lane)
    sea = load_sea(tile.state, lane)
    away = lost(after, ship)
    over = counters.ended != 0.0

    motion = pick(away | over, before, after)
    ran_away = max(counters.ran_away, pick(away, 1.0, 0.0))
    store_motion(tile.state, lane, motion)
    store_counters(
        tile.state, lane, EpisodeCounters(counters.steps, counters.ended, ran_away)
    )
    if HAS_SEA:
        parameters = load_sea_parameters(tile.ships, lane)
        word = load_sea_random(tile.random, lane).rng_state
        store_sea_random(tile.random, lane, SeaRandom(word + EVOLVE_WORDS))
        evolved = evolve(motion, h, sea, word, parameters)
        store_sea(tile.state, lane, pick(over, sea, evolved))


@called
def conclude_lanes(tile: Tile, groups: int) -> tuple[int, int]:
    """Reward, measure and observe an interval that is over.

    Returns in how many lanes of the tile an event is due, and how many episodes have
    just ended; lanes beyond them, up to so many groups, fill vectors.
    """
    rules = load_rules(tile.settings, 0)
    sensor_settings = load_sensor_settings(tile.settings, 0)
    settings = load_task_settings(tile.settings, 0)
    largest_cost = worst_cost(settings)
    n_due = 0
    n_ended = 0
    shared = view_of(tile, FIRST_LANE)
    for lane in range(groups * GROUP):
        ship, data, scale = shared if SHARED_SHIP else view_of(tile, lane)
        motion = load_motion(tile.state, lane)
        commands = load_commands(tile.state, lane)
        counters = load_counters(tile.state, lane)
        before = load_task_state(tile.state, lane)
        interval = past_interval(motion, commands, counters, data, rules)
        over = counters.ended != 0.0

        after, parts, failed, arrived = task_step(
            motion, before, interval, ship, settings
        )
        reward = pick(over, no_reward(), parts)
        earned = total_reward(reward)
        outcome = judged(
            interval, counters, failed, arrived, earned, rules, largest_cost
        )
        just_ended = outcome.terminated + outcome.truncated > 0.0
        ended = max(counters.ended, pick(just_ended, 1.0, 0.0))
        task_state = pick(over, before, after)
        store_counters(
            tile.state,
            lane,
            EpisodeCounters(counters.steps, ended, counters.ran_away),
        )
        store_outcome(tile.result, lane, outcome)
        store_reward(tile.result, lane, reward)
        store_task(tile, lane, task_state)

        memory = measured(tile, lane, motion, interval, sensor_settings)
        memory = pick(over, load_memory(tile.state, lane), memory)
        store_memory(tile.state, lane, memory)
        seen = readings(motion, load_sea(tile.state, lane), memory)
        observation = observe(seen, task_state, interval, ship, settings)
        store_observation(tile.result, lane, observation, scale)

        real = lane < tile.lanes
        is_due = due(motion, task_state, interval, ship, settings) & (ended == 0.0)
        n_due += 1 if is_due & real else 0
        n_ended += 1 if just_ended & real else 0
    return n_due, n_ended


def view_of(tile: Tile, lane: int) -> tuple[Ship, Envelope, Any]:
    """Return the ship of a lane, the data of her model, and scales of observations."""
    return (
        load_ship(tile.ships, lane),
        load_envelope(tile.ships, lane),
        load_scale(tile.ships, lane),
    )


def past_interval(
    motion: Motion,
    commands: Commands,
    counters: EpisodeCounters,
    data: Envelope,
    rules: Rules,
) -> Interval:
    """Return the interval that is over, with how far the ship is from known data."""
    distance = envelope_distance(motion, data)
    extrapolating = outside_range(motion, data) | (distance > 1.0)
    return Interval(
        dt=rules.dt,
        steps=counters.steps,
        rudder_before=commands.rudder_before,
        rudder_command=commands.rudder_command,
        shaft_command=commands.shaft_command,
        envelope_distance=distance,
        extrapolating=pick(extrapolating, 1.0, 0.0),
    )


def judged(
    interval: Interval,
    counters: EpisodeCounters,
    failed: bool,
    arrived: bool,
    earned: float,
    rules: Rules,
    largest_cost: float,
) -> Outcome:
    """Return what comes of an interval, from what the task says of it.

    An episode that fails pays the largest cost for each of the intervals that are left.
    """
    going = 1.0 - counters.ended
    failed = failed | (interval.envelope_distance > rules.largest_distance)
    wrecked = going * pick(failed, 1.0, counters.ran_away)
    terminated = max(wrecked, going * pick(arrived, 1.0, 0.0))
    late = pick(counters.steps >= rules.time_limit, going, 0.0)
    end = -(wrecked * largest_cost * (rules.time_limit - counters.steps))
    return Outcome(
        reward=earned + end,
        terminated=terminated,
        truncated=late * (1.0 - terminated),
        envelope_distance=interval.envelope_distance,
        extrapolating=interval.extrapolating,
        end=end,
    )


def measured(
    tile: Tile, lane: int, motion: Motion, interval: Interval, settings: Any
) -> Any:
    """Return the memory of the instruments after a sample."""
    sea = load_sea(tile.state, lane)
    memory = load_memory(tile.state, lane)
    parameters = load_sea_parameters(tile.ships, lane)
    random = load_random(tile.random, lane)
    frequency = encounter_frequency(motion, sea, parameters)
    return measure(motion, sea, memory, frequency, interval, settings, random)


def store_task(tile: Tile, lane: int, task_state: Any) -> None:
    """Store the state of the task, and report the fields that users see."""
    store_task_state(tile.state, lane, task_state)
    store_reported(tile.result, lane, task_state)


@called
def take_events(tile: Tile) -> None:
    """Take events, such as a new set-point, in the lanes in which one is due."""
    settings = load_task_settings(tile.settings, 0)
    for lane in range(tile.lanes):
        ship = load_ship(tile.ships, lane)
        motion = load_motion(tile.state, lane)
        before = load_task_state(tile.state, lane)
        interval = last_interval(tile, lane)
        going = load_counters(tile.state, lane).ended == 0.0
        if going and due(motion, before, interval, ship, settings):
            random = load_random(tile.random, lane)
            plan = plan_of(tile.state, lane)
            after = on_event(motion, before, interval, ship, settings, random, plan)
            store_task(tile, lane, after)
            observe_lane(tile, lane)


def last_interval(tile: Tile, lane: int) -> Interval:
    """Return the interval of a lane as it was concluded; of a new episode zeros."""
    commands = load_commands(tile.state, lane)
    outcome = load_outcome(tile.result, lane)
    return Interval(
        dt=load_rules(tile.settings, 0).dt,
        steps=load_counters(tile.state, lane).steps,
        rudder_before=commands.rudder_before,
        rudder_command=commands.rudder_command,
        shaft_command=commands.shaft_command,
        envelope_distance=outcome.envelope_distance,
        extrapolating=outcome.extrapolating,
    )


@called
def observe_lane(tile: Tile, lane: int) -> None:
    """Observe a lane again, whose task has changed."""
    ship = load_ship(tile.ships, lane)
    settings = load_task_settings(tile.settings, 0)
    motion = load_motion(tile.state, lane)
    sea = load_sea(tile.state, lane)
    seen = readings(motion, sea, load_memory(tile.state, lane))
    task_state = load_task_state(tile.state, lane)
    interval = last_interval(tile, lane)
    observation = observe(seen, task_state, interval, ship, settings)
    store_observation(tile.result, lane, observation, load_scale(tile.ships, lane))


def choose_ended(tile: Tile, chosen: Any) -> None:
    """Choose the lanes of a tile whose episode was over before this interval."""
    for lane in range(tile.lanes):
        outcome = load_outcome(tile.result, lane)
        just_ended = outcome.terminated + outcome.truncated > 0.0
        over = load_counters(tile.state, lane).ended != 0.0
        chosen[np.uintp(tile.first + lane)] = over and not just_ended


@called
def begin_lanes(tile: Tile, outputs: OutputTables, chosen: Any, next_one: bool) -> None:
    """Begin an episode in the chosen lanes of a tile, and show it.

    It is the one of the lane's key and number, or, with `next_one`, the next one under
    the key.
    """
    for lane in range(tile.lanes):
        if chosen[np.uintp(tile.first + lane)]:
            if next_one:
                random = load_random(tile.random, lane)
                following = Random(random.key, random.episode + np.uint64(1))
                store_random(tile.random, lane, following)
            begin_lane(tile, lane)
            write_outputs(tile, outputs, lane, lane + 1)


def begin_lane(tile: Tile, lane: int) -> None:
    """Begin an episode in a lane, with a ship of the pool if there is one."""
    random = load_random(tile.random, lane)
    draw_ship(tile, lane, random)
    for row in range(len(tile.state) // LANES):
        tile.state[row * LANES + lane] = 0.0
    for row in range(len(tile.result) // LANES):
        tile.result[row * LANES + lane] = 0.0

    ship = load_ship(tile.ships, lane)
    settings = load_task_settings(tile.settings, 0)
    plan = plan_of(tile.state, lane)
    motion, task_state = task_begin(ship, settings, random, plan)
    store_motion(tile.state, lane, motion)
    store_commands(tile.state, lane, Commands(0.0, 1.0, 0.0))
    store_task(tile, lane, task_state)
    if HAS_SEA:
        word = rng_state(random.key, random.episode)
        store_sea_random(tile.random, lane, SeaRandom(word + BEGIN_WORDS))
        parameters = load_sea_parameters(tile.ships, lane)
        store_sea(tile.state, lane, begin_sea(motion, word, parameters))

    sensor_settings = load_sensor_settings(tile.settings, 0)
    interval = last_interval(tile, lane)
    memory = measured(tile, lane, motion, interval, sensor_settings)
    store_memory(tile.state, lane, memory)
    observe_lane(tile, lane)


def draw_ship(tile: Tile, lane: int, random: Random) -> None:
    """Put a ship of the pool in a lane, if there is a pool."""
    if len(tile.pool) > 0:
        n_rows = len(tile.ships) // LANES
        n_pool = float(len(tile.pool) // n_rows)
        drawn = int(uniform(random.key, random.episode, SHIP_DRAW, 0.0, n_pool))
        for row in range(n_rows):
            tile.ships[row * LANES + lane] = tile.pool[drawn * n_rows + row]
