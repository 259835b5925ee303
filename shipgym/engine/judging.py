"""Many ships after an interval: its reward, its end, and the observations.

What every interval needs is one loop over lanes, which is vectorised (see
`shipgym.engine.sailing`). Rare work, such as a new set-point, is done afterwards,
lane by lane.
"""

from math import fabs
from typing import Any, NamedTuple

from shipgym.engine.envelope import Envelope, envelope_distance, outside_range
from shipgym.engine.hooks import (
    due,
    encounter_frequency,
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
    load_sensor_settings,
    load_ship,
    load_task_settings,
    load_task_state,
    measure,
    no_reward,
    observe,
    on_event,
    readings,
    store_counters,
    store_memory,
    store_observation,
    store_outcome,
    store_reward,
    store_task_state,
    task_step,
    total_reward,
    worst_cost,
)
from shipgym.engine.lane_records import EpisodeCounters, Interval, Outcome, Rules
from shipgym.engine.mathematics import pick
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.record_code import changer
from shipgym.engine.specialise import called
from shipgym.engine.tiles import (
    FIRST_LANE,
    GROUP,
    SHARED_SHIP,
    Tile,
    plan_of,
)

# Set when a loop is compiled, like hooks: whether users' functions may fail. They are
# then not asked about ships that are over, which may be beyond what they expect.
MAY_FAIL = False


judged = changer(EpisodeCounters, "ended", "episode_cost")


class AllSettings(NamedTuple):
    """Settings of the engine, the sensor set and the task."""

    rules: Rules
    sensors: Any
    task: Any


def view_of(tile: Tile, lane: int) -> tuple[Ship, Envelope, Any]:
    """A ship, the data of her model, and the factors of her observations."""
    return (
        load_ship(tile.ships, lane),
        load_envelope(tile.ships, lane),
        load_scale(tile.ships, lane),
    )


def settings_of(tile: Tile) -> AllSettings:
    """Return the settings, which all lanes share."""
    return AllSettings(
        rules=load_rules(tile.settings),
        sensors=load_sensor_settings(tile.settings),
        task=load_task_settings(tile.task_settings, 0),
    )


@called
def conclude_lanes(tile: Tile, groups: int) -> tuple[int, int]:
    """Reward, measure and observe an interval that is over.

    Returns in how many lanes of the tile an event is due, and how many episodes have
    just ended; lanes beyond them, up to so many groups, fill vectors.
    """
    state = tile.state
    settings = settings_of(tile)
    shared = view_of(tile, FIRST_LANE)
    n_due = 0
    n_ended = 0
    for lane in range(groups * GROUP):
        if MAY_FAIL and lane >= tile.lanes:
            break
        ship, data, scale = shared if SHARED_SHIP else view_of(tile, lane)
        motion = load_motion(state, lane)
        over = load_counters(state, lane).ended != 0.0
        interval = past_interval(tile, lane, motion, data, settings.rules)

        task_state, just_ended = judge(tile, lane, motion, interval, ship, settings)
        memory = load_memory(state, lane)
        if not (MAY_FAIL and over):
            memory = pick(over, memory, sample(tile, lane, motion, interval, settings))
        store_memory(state, lane, memory)
        seen = readings(motion, load_sea(state, lane), memory)
        observation = observe(seen, task_state, interval, ship, settings.task)
        store_observation(tile.result, lane, observation, scale)

        is_due = due(motion, task_state, interval, ship, settings.task)
        goes_on = not (over | just_ended)
        real = lane < tile.lanes
        n_due += 1 if is_due & goes_on & real else 0
        n_ended += 1 if just_ended & real else 0
    return n_due, n_ended


def past_interval(
    tile: Tile,
    lane: int,
    motion: Motion,
    data: Envelope,
    rules: Rules,
) -> Interval:
    """Return the interval that is over, with how far the ship is from known data."""
    distance = envelope_distance(motion, data)
    extrapolating = outside_range(motion, data) | (distance > 1.0)
    return interval_of(tile, lane, rules.dt, distance, pick(extrapolating, 1.0, 0.0))


def interval_of(
    tile: Tile, lane: int, dt: float, distance: float, extrapolating: float
) -> Interval:
    """Return the interval of a lane, with how far the ship is from known data."""
    commands = load_commands(tile.state, lane)
    return Interval(
        dt=dt,
        steps=load_counters(tile.state, lane).steps,
        rudder_before=commands.rudder_before,
        rudder_command=commands.rudder_command,
        shaft_command=commands.shaft_command,
        envelope_distance=distance,
        extrapolating=extrapolating,
    )


def judge(
    tile: Tile,
    lane: int,
    motion: Motion,
    interval: Interval,
    ship: Ship,
    settings: AllSettings,
) -> tuple[Any, bool]:
    """Let the task reward an interval, and end the episode if it is over.

    Returns the state of the task, and whether the episode has just ended. A lane whose
    episode was over before stays as it is and earns nothing.
    """
    counters = load_counters(tile.state, lane)
    over = counters.ended != 0.0
    before = load_task_state(tile.state, lane)
    task_state, reward, failed, arrived = before, no_reward(), False, False
    if not (MAY_FAIL and over):
        after, earned, failed, arrived = task_step(
            motion, before, interval, ship, settings.task
        )
        task_state = pick(over, before, after)
        reward = pick(over, reward, earned)
    earned = total_reward(reward)
    outcome = outcome_of(interval, counters, failed, arrived, earned, settings)

    just_ended = outcome.terminated + outcome.truncated > 0.0
    counters = judged(
        counters,
        pick(just_ended, 1.0, counters.ended),
        counters.episode_cost + outcome.cost,
    )
    store_counters(tile.state, lane, counters)
    store_outcome(tile.result, lane, outcome)
    store_reward(tile.result, lane, reward)
    store_task_state(tile.state, lane, task_state)
    return task_state, just_ended


def outcome_of(
    interval: Interval,
    counters: EpisodeCounters,
    failed: bool,
    arrived: bool,
    earned: float,
    settings: AllSettings,
) -> Outcome:
    """Return the outcome of an interval, from the verdict of the task.

    A failed episode costs the largest cost for each of the remaining intervals. In a
    bounded reward it is paid the least reward for those that the end stands for, and
    one that has arrived the largest.
    """
    rules = settings.rules
    going = 1.0 - counters.ended
    lost = failed | (interval.envelope_distance > rules.largest_distance)
    wrecked = going * pick(lost, 1.0, counters.ran_away)
    terminated = max(wrecked, going * pick(arrived, 1.0, 0.0))
    late = pick(counters.steps >= rules.cut_off, going, 0.0)
    steps_left = rules.time_limit - counters.steps
    seen_steps = min(steps_left, rules.loss_horizon)
    worst = worst_cost(settings.task)
    end = -(wrecked * worst * steps_left)
    seen_end = -(wrecked * worst * seen_steps)
    arrived_now = terminated - wrecked
    bounded = (going - wrecked) * bounded_reward(-earned, rules)
    bounded += arrived_now * seen_steps * rules.perfect_step
    bounded += wrecked * (seen_steps + 1.0) * (rules.perfect_step - 1.0)
    return Outcome(
        reward=pick(rules.half_reward_cost > 0.0, bounded, earned + seen_end),
        terminated=terminated,
        truncated=late * (1.0 - terminated),
        envelope_distance=interval.envelope_distance,
        extrapolating=interval.extrapolating,
        end=end,
        cost=-(earned + end),
    )


def bounded_reward(cost: float, rules: Rules) -> float:
    """Reward of an interval with a cost: from that of no cost to one less."""
    scale = max(rules.half_reward_cost, 1e-300)  # 0 where this is not used
    return rules.perfect_step - cost / (scale + fabs(cost))


def sample(
    tile: Tile,
    lane: int,
    motion: Motion,
    interval: Interval,
    settings: AllSettings,
) -> Any:
    """Return the memory of the instruments after a sample."""
    memory = load_memory(tile.state, lane)
    sea = load_sea(tile.state, lane)
    parameters = load_sea_parameters(tile.ships, lane)
    frequency = encounter_frequency(motion, sea, parameters)
    random = load_random(tile.random, lane)
    return measure(motion, sea, memory, frequency, interval, settings.sensors, random)


@called
def take_events(tile: Tile) -> None:
    """Take events, such as a new set-point, in the lanes in which one is due."""
    state = tile.state
    for lane in range(tile.lanes):
        settings = load_task_settings(tile.task_settings, 0)
        ship = load_ship(tile.ships, lane)
        motion = load_motion(state, lane)
        before = load_task_state(state, lane)
        interval = last_interval(tile, lane)
        going = load_counters(state, lane).ended == 0.0
        if going and due(motion, before, interval, ship, settings):
            random = load_random(tile.random, lane)
            plan = plan_of(state, lane)
            after = on_event(motion, before, interval, ship, settings, random, plan)
            store_task_state(tile.state, lane, after)
            observe_lane(tile, lane)


def last_interval(tile: Tile, lane: int) -> Interval:
    """Return the interval of a lane as it was concluded; of a new episode zeros."""
    outcome = load_outcome(tile.result, lane)
    distance = outcome.envelope_distance
    dt = load_rules(tile.settings).dt
    return interval_of(tile, lane, dt, distance, outcome.extrapolating)


@called
def observe_lane(tile: Tile, lane: int) -> None:
    """Observe a lane whose task has changed."""
    state = tile.state
    motion = load_motion(state, lane)
    sea = load_sea(state, lane)
    memory = load_memory(state, lane)
    task_state = load_task_state(state, lane)

    ship, _, scale = view_of(tile, lane)
    settings = load_task_settings(tile.task_settings, 0)
    interval = last_interval(tile, lane)
    seen = readings(motion, sea, memory)
    observation = observe(seen, task_state, interval, ship, settings)
    store_observation(tile.result, lane, observation, scale)
