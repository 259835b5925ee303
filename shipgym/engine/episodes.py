"""Episodes of many ships at once: begin them, take a control interval.

Ships lie in tiles of 64 lanes. What every step needs is one loop over lanes, which is
vectorised; what comes seldom (a new set-point, the next leg, the end of an episode) is
done lane by lane afterwards. The task, the sensor set, the sea and the ship are parts
(`shipgym.engine.voyages`): this file knows none of them.

Arrays that are not tiles are indexed by unsigned numbers: an index that could be
negative, and would count from the end, keeps a loop from being vectorised.
"""

from typing import Any, NamedTuple

import numpy as np

from shipgym.engine.addresses import (
    flag_table_at,
    flags_at,
    numbers_at,
    rows_at,
    single_table_at,
    table_at,
    words_at,
)
from shipgym.engine.envelope import envelope_distance, outside_range
from shipgym.engine.mathematics import clip, pick
from shipgym.engine.motion import HAS_SEA, lost, sail
from shipgym.engine.places import (
    begin_sea,
    choose_memory,
    choose_motion,
    choose_reward,
    choose_sea,
    choose_state,
    common_sea,
    common_ship,
    common_view,
    due,
    encounter_frequency,
    evolve,
    load_course,
    load_memory,
    load_motion,
    load_outcome,
    load_sea,
    load_state,
    measure,
    no_reward,
    observe,
    on_event,
    plan_of,
    push,
    read_rules,
    read_sensor,
    read_settings,
    readings,
    sea_at,
    ship_at,
    store_course,
    store_ended,
    store_memory,
    store_motion,
    store_observation,
    store_outcome,
    store_ran_away,
    store_reward,
    store_sea,
    store_state,
    task_begin,
    task_step,
    total_reward,
    view_at,
    worst_cost,
)
from shipgym.engine.random import BEGIN_WORDS, EVOLVE_WORDS, stream, uniform
from shipgym.engine.records import LANES
from shipgym.tasks.contract import Interval, Random

REFUSED = -1  # what `step` answers to commands that are not finite
OF_STATE = (
    1 << 40
)  # added to the offset of a row that stands in the state, not in the result
N_STEP, N_STEP_FLAGS = (
    3,
    2,
)  # of outcomes and flags, what `step` answers: reward, terminated, truncated
SHIP_DRAW = np.uint64(
    1 << 40
)  # number of the draw of an episode's ship, apart from those of its task
# NumPy's numbers, since a function is compiled anew for each literal that it is called
# with
FIRST_LANE: Any = np.int64(0)
WHOLE: Any = np.bool_(True)
ANSWERED: Any = np.bool_(False)  # all rows but what `step` answers
# Lanes are sailed in whole vectors, whose arithmetic may be contracted otherwise than
# that of a single lane, so that results do not depend on the number of ships.
GROUP = 16


class Course(NamedTuple):
    """What the engine keeps of a lane's episode."""

    rudder_command: float  # part of the limit
    shaft_command: float  # part of the shaft speed at service speed
    rudder_before: float  # rad, rudder at the beginning of the interval
    steps: float  # control intervals so far
    ended: float  # 1 once the episode is over
    ran_away: float  # 1 if the ship left every physical range in the interval


class Outcome(NamedTuple):
    """What comes of an interval beside the task's own."""

    reward: float
    terminated: float  # 1 or 0
    truncated: float
    envelope_distance: float
    extrapolating: float  # 1 or 0
    end: float  # part of the reward: the rest of an episode that failed


class Tile(NamedTuple):
    """64 ships and what they need, as arrays."""

    state: Any  # float64 (n_rows * 64,)
    # float64 (n_result_rows * 64,), what comes of the interval; room that all tiles
    # share
    result: Any
    # uint64 (3, 64): seed and number of each episode, and the state of its sea's random
    # numbers
    keys: Any
    ships: (
        Any  # float64 (n_ship_rows * 64,), or (n_ship_rows,) where all lanes share one
    )
    # float64 (n_pool, n_ship_rows): of which each episode draws one, or none for those
    # of `ships`
    pool: Any
    settings: Any  # float64: `Rules`, settings of the sensor set, settings of the task
    first: int  # number of its first lane
    lanes: int  # how many there are


class Shown(NamedTuple):
    """What users are given of all ships."""

    # int64: how many observations, outcomes and flags there are, then the offsets of
    # their rows
    rows: Any
    observations: Any  # float32 (n, n_observations)
    outcomes: Any  # float64 (n_outcomes, n): reward, terminated, truncated, then info
    flags: Any  # bool (n_flags, n): terminated, truncated, then those of info


class Fleet(NamedTuple):
    """All ships, tile by tile."""

    states: Any  # float64 (n_tiles, n_rows * 64)
    result: Any
    keys: Any  # uint64 (n_tiles, 3, 64)
    ships: Any  # float64 (n_tiles or 1, ...)
    pool: Any
    settings: Any
    n_ships: int


class Rules(NamedTuple):
    """Settings of the engine."""

    dt: float  # s, control interval
    substeps: float  # of the integration in it
    time_limit: float  # control intervals
    largest_distance: float  # from the data of the model at which an episode ends
    least_shaft: float  # least command of the shaft, part of service speed


def tile_of(fleet: Fleet, number: int) -> Tile:
    """One tile of a fleet."""
    first = number * LANES
    return Tile(
        fleet.states[number],
        fleet.result,
        fleet.keys[number],
        fleet.ships[number % fleet.ships.shape[0]],
        fleet.pool,
        fleet.settings,
        first,
        min(fleet.n_ships - first, LANES),
    )


def take_commands(tile: Tile, actions: Any) -> None:
    """Take the commands of ships whose episode is not over."""
    state, first, rules = tile.state, tile.first, read_rules(tile.settings, 0)
    for lane in range(tile.lanes):
        motion, course = load_motion(state, lane), load_course(state, lane)
        over = course.ended != 0.0
        rudder = clip(float(actions[0, np.uintp(first + lane)]), -1.0, 1.0)
        course = Course(
            pick(over, course.rudder_command, rudder),
            course.shaft_command,
            motion.delta,
            course.steps + (1.0 - course.ended),
            course.ended,
            0.0,
        )
        store_course(state, lane, course)
    if actions.shape[0] > 1:
        for lane in range(tile.lanes):
            course = load_course(state, lane)
            shaft = clip(
                float(actions[1, np.uintp(first + lane)]), rules.least_shaft, 1.0
            )
            course = Course(
                course.rudder_command,
                pick(course.ended != 0.0, course.shaft_command, shaft),
                course.rudder_before,
                course.steps,
                course.ended,
                course.ran_away,
            )
            store_course(state, lane, course)


def sail_lanes(tile: Tile, h: float, groups: int) -> None:
    """Move groups of ships by h seconds; one that would run away, or whose episode is over, stays."""
    state = tile.state
    common, sea_common = common_ship(tile.ships), common_sea(tile.ships)
    for lane in range(groups * GROUP):
        ship, coefficients = ship_at(common, tile.ships, lane)
        p = sea_at(sea_common, tile.ships, lane)
        before, course, sea = (
            load_motion(state, lane),
            load_course(state, lane),
            load_sea(state, lane),
        )
        rudder, shaft = (
            course.rudder_command * ship.rudder_limit,
            course.shaft_command * ship.shaft,
        )
        after = sail(before, rudder, shaft, h, push(before, sea, p), coefficients, ship)
        store_motion(state, lane, end_of_step(tile, lane, after, h, ship, p))


def end_of_step(tile: Tile, lane: int, after: Any, h: float, ship: Any, p: Any) -> Any:
    """Where a ship is after her step of h seconds; the sea of parameters p goes on."""
    state, words = tile.state, tile.keys[2]
    before, course, sea = (
        load_motion(state, lane),
        load_course(state, lane),
        load_sea(state, lane),
    )
    away = lost(after, ship)
    over = course.ended != 0.0
    motion = choose_motion(away | over, before, after)
    store_ran_away(state, lane, max(course.ran_away, pick(away, 1.0, 0.0)))
    if HAS_SEA:
        word = words[lane]
        words[lane] = word + EVOLVE_WORDS
        store_sea(state, lane, choose_sea(over, sea, evolve(motion, h, sea, word, p)))
    return motion


def conclude_lanes(tile: Tile, groups: int) -> tuple[int, int]:
    """Reward, readings and observations of an interval that is over.

    Returns in how many lanes of the tile something is due, and how many episodes have
    just ended; lanes beyond them, up to so many groups, fill vectors.
    """
    state, result, keys, settings = tile.state, tile.result, tile.keys, tile.settings
    rules, sensor, asked = (
        read_rules(settings, 0),
        read_sensor(settings, 0),
        read_settings(settings, 0),
    )
    common, view, sea_common = (
        common_ship(tile.ships),
        common_view(tile.ships),
        common_sea(tile.ships),
    )
    worst = worst_cost(asked)
    n_due, n_ended = 0, 0
    for lane in range(groups * GROUP):
        ship, _ = ship_at(common, tile.ships, lane)
        data, scale = view_at(view, tile.ships, lane)
        motion, course, sea = (
            load_motion(state, lane),
            load_course(state, lane),
            load_sea(state, lane),
        )
        before, memory = load_state(state, lane), load_memory(state, lane)
        distance = envelope_distance(motion, data)
        beyond = pick(outside_range(motion, data) | (distance > 1.0), 1.0, 0.0)
        interval = Interval(
            rules.dt,
            course.steps,
            course.rudder_before,
            course.rudder_command,
            course.shaft_command,
            distance,
            beyond,
        )
        after, parts, failed, arrived = task_step(motion, before, interval, ship, asked)

        going, over = 1.0 - course.ended, course.ended != 0.0
        wrecked = going * pick(
            failed | (distance > rules.largest_distance), 1.0, course.ran_away
        )
        terminated = max(wrecked, going * pick(arrived, 1.0, 0.0))
        late = pick(course.steps >= rules.time_limit, going, 0.0)
        end = -(wrecked * worst * (rules.time_limit - course.steps))
        ended = max(course.ended, max(terminated, late))
        earned = choose_reward(over, no_reward(), parts)
        reward = total_reward(earned) + end
        after = choose_state(over, before, after)
        random = Random(keys[0, lane], keys[1, lane])
        frequency = encounter_frequency(
            motion, sea, sea_at(sea_common, tile.ships, lane)
        )
        measured = measure(motion, sea, memory, frequency, interval, sensor, random)
        memory = choose_memory(over, memory, measured)

        store_ended(state, lane, ended)
        truncated = late * (1.0 - terminated)
        store_outcome(
            result, lane, Outcome(reward, terminated, truncated, distance, beyond, end)
        )
        store_reward(result, lane, earned)
        store_state(state, lane, after)
        store_memory(state, lane, memory)
        seen = readings(motion, sea, memory)
        store_observation(
            result, lane, observe(seen, after, interval, ship, asked), scale
        )
        real = lane < tile.lanes
        n_due += (
            1
            if due(motion, after, interval, ship, asked) & (ended == 0.0) & real
            else 0
        )
        n_ended += 1 if (max(terminated, late) > 0.0) & real else 0
    return n_due, n_ended


def interval_of(tile: Tile, lane: int) -> Interval:
    """The interval of a lane, as it was concluded."""
    course, outcome = load_course(tile.state, lane), load_outcome(tile.result, lane)
    return Interval(
        read_rules(tile.settings, 0).dt,
        course.steps,
        course.rudder_before,
        course.rudder_command,
        course.shaft_command,
        outcome.envelope_distance,
        outcome.extrapolating,
    )


def observe_lane(tile: Tile, lane: int) -> None:
    """What an autopilot sees now."""
    state, asked = tile.state, read_settings(tile.settings, 0)
    ship, _ = ship_at(common_ship(tile.ships), tile.ships, lane)
    _, scale = view_at(common_view(tile.ships), tile.ships, lane)
    seen = readings(
        load_motion(state, lane), load_sea(state, lane), load_memory(state, lane)
    )
    observation = observe(
        seen, load_state(state, lane), interval_of(tile, lane), ship, asked
    )
    store_observation(tile.result, lane, observation, scale)


def let_events_come(tile: Tile) -> None:
    """Rare events, such as a new set-point, in the lanes in which one is due."""
    state, asked = tile.state, read_settings(tile.settings, 0)
    for lane in range(tile.lanes):
        course, motion, before = (
            load_course(state, lane),
            load_motion(state, lane),
            load_state(state, lane),
        )
        ship, _ = ship_at(common_ship(tile.ships), tile.ships, lane)
        interval = interval_of(tile, lane)
        if course.ended == 0.0 and due(motion, before, interval, ship, asked):
            random, plan = (
                Random(tile.keys[0, lane], tile.keys[1, lane]),
                plan_of(state, lane),
            )
            store_state(
                state,
                lane,
                on_event(motion, before, interval, ship, asked, random, plan),
            )
            observe_lane(tile, lane)


def show(tile: Tile, shown: Shown, whole: bool, begin: int, end: int) -> None:
    """Copy what is seen of some lanes into the users' arrays; reward and ends only if `whole`."""
    state, result, rows, first = tile.state, tile.result, shown.rows, tile.first
    at = 3
    for k in range(rows[0]):
        row = rows[at + k]
        for lane in range(begin, end):
            shown.observations[np.uintp(first + lane), k] = result[np.uintp(row + lane)]
    at += rows[0]
    for k in range(0 if whole else N_STEP, rows[1]):
        source, row = (
            (state, rows[at + k] - OF_STATE)
            if rows[at + k] >= OF_STATE
            else (result, rows[at + k])
        )
        for lane in range(begin, end):
            shown.outcomes[k, np.uintp(first + lane)] = source[np.uintp(row + lane)]
    at += rows[1]
    for k in range(0 if whole else N_STEP_FLAGS, rows[2]):
        source, row = (
            (state, rows[at + k] - OF_STATE)
            if rows[at + k] >= OF_STATE
            else (result, rows[at + k])
        )
        for lane in range(begin, end):
            shown.flags[k, np.uintp(first + lane)] = source[np.uintp(row + lane)] > 0.0


def begin_lane(tile: Tile, lane: int) -> None:
    """Begin an episode in a lane, with a ship of the pool, if there is one."""
    state, result, keys, pool = tile.state, tile.result, tile.keys, tile.pool
    random = Random(keys[0, lane], keys[1, lane])
    if pool.shape[0] > 0:
        number = int(
            uniform(random.key, random.episode, SHIP_DRAW, 0.0, float(pool.shape[0]))
        )
        for row in range(pool.shape[1]):
            tile.ships[row * LANES + lane] = pool[number, row]
    for row in range(0, len(state) // LANES):
        state[row * LANES + lane] = 0.0
    for row in range(0, len(result) // LANES):
        result[row * LANES + lane] = 0.0
    asked = read_settings(tile.settings, 0)
    ship, _ = ship_at(common_ship(tile.ships), tile.ships, lane)
    p = sea_at(common_sea(tile.ships), tile.ships, lane)
    motion, begun = task_begin(ship, asked, random, plan_of(state, lane))
    store_motion(state, lane, motion)
    store_state(state, lane, begun)
    store_course(state, lane, Course(0.0, 1.0, 0.0, 0.0, 0.0, 0.0))
    if HAS_SEA:
        word = stream(random.key, random.episode)
        keys[2, lane] = word + BEGIN_WORDS
        store_sea(state, lane, begin_sea(motion, word, p))
    sea, sensor = load_sea(state, lane), read_sensor(tile.settings, 0)
    frequency = encounter_frequency(motion, sea, p)
    memory = load_memory(state, lane)
    memory = measure(
        motion, sea, memory, frequency, interval_of(tile, lane), sensor, random
    )
    store_memory(state, lane, memory)
    observe_lane(tile, lane)


def begin_next(tile: Tile, shown: Shown, lane: int) -> None:
    """Begin the next episode of a lane and show it; reward and flags stay those of the last step."""
    tile.keys[1, lane] += np.uint64(1)
    begin_lane(tile, lane)
    show(tile, shown, ANSWERED, lane, lane + 1)


def are_finite(actions: Any) -> bool:
    """Whether all commands are finite."""
    wrong = 0
    for row in range(actions.shape[0]):
        for lane in range(actions.shape[1]):
            wrong += 0 if abs(actions[row, lane]) < np.inf else 1
    return wrong == 0


def reset(fleet: Fleet, shown: Shown, which: Any, next_one: bool) -> None:
    """Begin an episode in the lanes of `which`, bool of shape (n,), and show it.

    It is the one of the keys, or, with `next_one`, the next one under the key, whose
    lane keeps reward and flags of the last step.
    """
    for number in range(fleet.states.shape[0]):
        tile = tile_of(fleet, number)
        for lane in range(tile.lanes):
            if which[tile.first + lane]:
                if next_one:
                    begin_next(tile, shown, lane)
                else:
                    begin_lane(tile, lane)
                    show(tile, shown, WHOLE, lane, lane + 1)


def step(
    fleet: Fleet,
    shown: Shown,
    actions: Any,
    first_tile: int,
    end_tile: int,
    next_ones: bool,
) -> int:
    """One control interval of the tiles from `first_tile` up to `end_tile`.

    `actions` holds rows of commands, float32 of shape (n_commands, n): of the rudder
    and, if there is a second, of the shaft. A lane whose episode was over stays as it
    is and earns nothing, or, with `next_ones`, begins its next episode. Returns the
    number of episodes that ended, or `REFUSED`, nothing changed, if a command is not
    finite.
    """
    if not are_finite(actions):
        return REFUSED
    ended, rules = 0, read_rules(fleet.settings, 0)
    h = rules.dt / rules.substeps
    for number in range(first_tile, end_tile):
        tile = tile_of(fleet, number)
        groups = (tile.lanes + GROUP - 1) // GROUP
        take_commands(tile, actions)
        for _ in range(int(rules.substeps)):
            sail_lanes(tile, h, groups)
        n_due, n_ended = conclude_lanes(tile, groups)
        ended += n_ended
        if n_due > 0:
            let_events_come(tile)
        show(tile, shown, WHOLE, FIRST_LANE, tile.lanes)
        if next_ones:
            for lane in range(tile.lanes):
                outcome = load_outcome(tile.result, lane)
                just_now = outcome.terminated + outcome.truncated > 0.0
                if load_course(tile.state, lane).ended != 0.0 and not just_now:
                    begin_next(tile, shown, lane)
    return ended


SIGNATURE = "int64(int64[::1], int64)"
STEP, STEP_AND_BEGIN, BEGIN, BEGIN_NEXT = range(4)  # what `run` may be asked for


def run(world: Any, asked: int) -> int:
    """`step` or `reset` of arrays that are given by their addresses and shapes, by turns.

    To look at a dozen arrays takes the interpreter longer than to sail a ship. In
    `world`, int64, stand states, keys, settings, pool, ships, rows, lanes to begin,
    actions, observations, outcomes and flags, then the first tile of a step, the one
    behind its last, and room for the result of a tile. Asked is `STEP`,
    `STEP_AND_BEGIN` (episodes that were over begin anew), or `BEGIN` or `BEGIN_NEXT` in
    some lanes.
    """
    actions, observations = single_table_at(world, 19), single_table_at(world, 22)
    shown = Shown(
        rows_at(world, 15), observations, table_at(world, 25), flag_table_at(world, 28)
    )
    fleet = Fleet(
        table_at(world, 0),
        numbers_at(world, 33),
        words_at(world, 3),
        table_at(world, 12),
        table_at(world, 9),
        numbers_at(world, 7),
        observations.shape[0],
    )
    if asked >= BEGIN:
        reset(fleet, shown, flags_at(world, 17), asked == BEGIN_NEXT)
        return 0
    return step(fleet, shown, actions, world[31], world[32], asked == STEP_AND_BEGIN)
