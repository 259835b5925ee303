"""The course-keeping environment: one control interval of 64 ships at once.

Loops over lanes that every step needs are vectorised: they touch few arrays, hold no loop of their own
and call only inlined functions. Set-point changes and the end of an episode come seldom and are done
lane by lane afterwards. Rows of the arrays: `course_keeping_rows`.
"""

from __future__ import annotations

from math import fabs, floor, pi
from typing import Any

import numpy as np

from . import accelerations as equations
from .accelerations import ROLL, SHAFT
from .compiling import inlined, kernel, pick, rare
from .course_keeping_rows import (
    CHANGE_INTERVAL,
    DISTANCE,
    DRAWS,
    DT,
    END,
    END_REWARD,
    ENDED,
    EXTRAPOLATING,
    HEADING_ERROR,
    HEADING_REWARD,
    HEADING_SCALE,
    INTEGRAL,
    INTEGRAL_SCALE,
    INTEGRAL_ZONE,
    LARGEST_CHANGE,
    LARGEST_DISTANCE,
    LARGEST_ERROR,
    LAST_COMMAND,
    LAST_RUDDER,
    N_OBSERVATIONS,
    NEXT_CHANGE,
    OBSERVED,
    RATE_REWARD,
    RATE_WEIGHT,
    REWARD,
    RUDDER_REWARD,
    RUDDER_WEIGHT,
    SET_POINT,
    STEPS,
    SUBSTEPS,
    TERMINATED,
    TIME_LIMIT,
    TRUNCATED,
)
from .envelope import envelope_distance, outside_range
from .layout import (
    DELTA,
    LANES,
    LENGTH,
    PHI,
    PSI,
    RUDDER_LIMIT,
    SERVICE_SHAFT,
    SERVICE_SPEED,
    N,
    P,
    R,
    U,
    V,
    X,
    Y,
)
from .motion import CALM, Push, clip, runge_kutta, runs_away
from .random import stream, uniform
from .trigonometry import sin_cos, wrap
from .weather import WEATHER, begin_weather, evolve, feel
from .weather_rows import (
    CURRENT_EAST,
    CURRENT_NORTH,
    PSI_WAVE,
    PUSH_P,
    PUSH_R,
    PUSH_U,
    PUSH_V,
    R_WAVE,
)


@inlined
def measured(state: Any, lane: int) -> tuple[float, float]:
    """Heading and yaw rate as compass and rate gyro show them: with the first-order motion in waves."""
    if WEATHER:
        return state[PSI + lane] + state[PSI_WAVE + lane], state[R + lane] + state[R_WAVE + lane]
    return state[PSI + lane], state[R + lane]


KEEPS_P = ROLL or getattr(equations, "MEMORY", False)  # the row holds a roll rate or a memory of yaw


@inlined
def observe(state: Any, settings: Any, ship: Any, lanes: int) -> None:
    """Work out what the autopilots see, within the bounds of the observation space."""
    sine, cosine, yaw_rate, sway, surge, rudder, command, integral = (
        OBSERVED, OBSERVED + LANES, OBSERVED + 2 * LANES, OBSERVED + 3 * LANES,
        OBSERVED + 4 * LANES, OBSERVED + 5 * LANES, OBSERVED + 6 * LANES, OBSERVED + 7 * LANES,
    )  # fmt: skip
    per_reach = 1.0 / settings[INTEGRAL_SCALE]
    for lane in range(lanes):
        per_speed = 1.0 / ship[SERVICE_SPEED + lane]
        heading, rate = measured(state, lane)
        sin, cos = sin_cos(state[SET_POINT + lane] - heading)
        state[sine + lane] = clip(sin, -1.0, 1.0)
        state[cosine + lane] = clip(cos, -1.0, 1.0)
        state[yaw_rate + lane] = clip(rate * ship[LENGTH + lane] * per_speed, -5.0, 5.0)
        state[sway + lane] = clip(state[V + lane] * per_speed, -2.0, 2.0)
        state[surge + lane] = clip(state[U + lane] * per_speed, -2.0, 3.0)
        state[rudder + lane] = clip(state[DELTA + lane] / ship[RUDDER_LIMIT + lane], -1.0, 1.0)
        state[command + lane] = state[LAST_COMMAND + lane]
        state[integral + lane] = clip(state[INTEGRAL + lane] * per_reach, -1.0, 1.0)


@inlined
def show(state: Any, observations: Any, lanes: int) -> None:
    """Hand the observations over, one row a ship."""
    for lane in range(lanes):
        for k in range(N_OBSERVATIONS):
            observations[lane, k] = state[OBSERVED + k * LANES + lane]


@inlined
def draw(state: Any, lane: int, keys: Any, tile: int, low: float, high: float) -> float:
    """Next random number of a lane's episode, in [low, high)."""
    count = state[DRAWS + lane]
    state[DRAWS + lane] = count + 1.0
    return uniform(keys[tile, 0, lane], keys[tile, 1, lane], np.uint64(count), low, high)


@rare
def change_set_point(state: Any, lane: int, keys: Any, tile: int, settings: Any) -> None:
    """Draw the next heading to keep and the step at which it changes again."""
    largest = settings[LARGEST_CHANGE]
    state[SET_POINT + lane] += draw(state, lane, keys, tile, -largest, largest)
    wait = settings[CHANGE_INTERVAL] * draw(state, lane, keys, tile, 0.5, 1.5)
    state[NEXT_CHANGE + lane] = state[STEPS + lane] + max(floor(wait), 1.0)


@rare
def begin(state: Any, lane: int, keys: Any, tile: int, settings: Any, ship: Any) -> None:
    """Put a ship straight ahead at service speed on a random heading, with a first set-point."""
    for row in range(0, END, LANES):
        state[row + lane] = 0.0
    state[U + lane] = ship[SERVICE_SPEED + lane]
    state[N + lane] = ship[SERVICE_SHAFT + lane] if SHAFT else 0.0
    state[PSI + lane] = draw(state, lane, keys, tile, -pi, pi)
    state[SET_POINT + lane] = state[PSI + lane]
    change_set_point(state, lane, keys, tile, settings)
    if WEATHER:
        words = keys[tile, 2]
        words[lane] = stream(keys[tile, 0, lane], keys[tile, 1, lane])
        begin_weather(state[PSI + lane], state[U + lane], state[V + lane], state, words, ship, lane)


@kernel(
    "void(float64[:, ::1], uint64[:, :, ::1], float64[::1], float64[:, ::1], float32[:, :, ::1],"
    " boolean[:, ::1])"
)
def reset(states: Any, keys: Any, settings: Any, ships: Any, observations: Any, which: Any) -> None:
    """Begin an episode in the lanes of `which`.

    `keys` holds each lane's seed, its episode number and the state of the random numbers of its weather.
    """
    for tile in range(states.shape[0]):
        ship = ships[tile % ships.shape[0]]
        for lane in range(LANES):
            if which[tile, lane]:
                begin(states[tile], lane, keys, tile, settings, ship)
        observe(states[tile], settings, ship, LANES)
        show(states[tile], observations[tile], LANES)


@inlined
def pushed(state: Any, lane: int) -> Push:
    """What the weather does to a ship."""
    if WEATHER:
        return (
            state[PUSH_U + lane],
            state[PUSH_V + lane],
            state[PUSH_R + lane],
            state[PUSH_P + lane] if ROLL else 0.0,
            state[CURRENT_NORTH + lane],
            state[CURRENT_EAST + lane],
        )
    return CALM


@inlined
def sail(state: Any, h: float, ship: Any, lanes: int) -> None:
    """Move ships by h seconds; one whose episode is over, or that would run away, stays where it is."""
    for lane in range(lanes):
        old = (
            state[X + lane],
            state[Y + lane],
            state[PSI + lane],
            state[U + lane],
            state[V + lane],
            state[R + lane],
            state[P + lane] if KEEPS_P else 0.0,
            state[PHI + lane] if ROLL else 0.0,
            state[DELTA + lane],
            state[N + lane] if SHAFT else 0.0,
        )
        order = state[LAST_COMMAND + lane] * ship[RUDDER_LIMIT + lane]
        new = runge_kutta(old, order, ship[SERVICE_SHAFT + lane], h, pushed(state, lane), ship, lane)
        away = runs_away(new[3], new[4], new[5], ship, lane)
        stays = away | (state[ENDED + lane] != 0.0)
        state[X + lane] = pick(stays, old[0], new[0])
        state[Y + lane] = pick(stays, old[1], new[1])
        state[PSI + lane] = pick(stays, old[2], new[2])
        state[U + lane] = pick(stays, old[3], new[3])
        state[V + lane] = pick(stays, old[4], new[4])
        state[R + lane] = pick(stays, old[5], new[5])
        if KEEPS_P:
            state[P + lane] = pick(stays, old[6], new[6])
        if ROLL:
            state[PHI + lane] = pick(stays, old[7], new[7])
        state[DELTA + lane] = pick(stays, old[8], new[8])
        if SHAFT:
            state[N + lane] = pick(stays, old[9], new[9])
        state[TERMINATED + lane] = pick(away, 1.0, state[TERMINATED + lane])


@inlined
def weather_goes_on(state: Any, words: Any, h: float, ship: Any, lanes: int) -> None:
    """Let the weather of each lane go on for h seconds; where an episode is over, it stays as it is."""
    for lane in range(lanes):
        over = state[ENDED + lane] != 0.0
        evolve(state[PSI + lane], state[U + lane], state[V + lane], h, over, state, words, ship, lane)


@inlined
def order_rudder(state: Any, action: Any, lanes: int) -> None:
    """Take the commands of ships whose episode is not over."""
    for lane in range(lanes):
        ended = state[ENDED + lane] != 0.0
        command = clip(float(action[lane]), -1.0, 1.0)
        state[LAST_COMMAND + lane] = pick(ended, state[LAST_COMMAND + lane], command)
        state[LAST_RUDDER + lane] = state[DELTA + lane]
        state[STEPS + lane] += 1.0 - state[ENDED + lane]
        state[TERMINATED + lane] = 0.0


@inlined
def judge(state: Any, settings: Any, ship: Any, lanes: int) -> None:
    """Steering cost of the interval, integral of the error, and whether the episode is over."""
    dt, zone, reach = settings[DT], settings[INTEGRAL_ZONE], settings[INTEGRAL_SCALE]
    per_scale = 1.0 / settings[HEADING_SCALE]
    rudder_weight, rate_weight = settings[RUDDER_WEIGHT], settings[RATE_WEIGHT]
    largest_error, largest_distance = settings[LARGEST_ERROR], settings[LARGEST_DISTANCE]
    time_limit = settings[TIME_LIMIT]
    worst = (largest_error * per_scale) ** 2
    for lane in range(lanes):
        u, v, r, delta = state[U + lane], state[V + lane], state[R + lane], state[DELTA + lane]
        going = 1.0 - state[ENDED + lane]
        error = wrap(state[SET_POINT + lane] - state[PSI + lane])
        gathered = pick(fabs(error) > zone, 0.0, going * error * dt)
        state[INTEGRAL + lane] = clip(state[INTEGRAL + lane] + gathered, -reach, reach)

        rate = (delta - state[LAST_RUDDER + lane]) / dt * ship[LENGTH + lane] / ship[SERVICE_SPEED + lane]
        heading_cost = going * (error * per_scale) ** 2
        rudder_cost = going * rudder_weight * (delta * per_scale) ** 2
        rate_cost = going * rate_weight * (rate * per_scale) ** 2

        distance = envelope_distance(u, v, r, delta, ship, lane)
        beyond = outside_range(u, v, r, delta, ship, lane) | (distance > 1.0)
        lost = (fabs(error) > largest_error) | (distance > largest_distance)
        terminated = going * pick(lost, 1.0, state[TERMINATED + lane])
        late = pick(state[STEPS + lane] >= time_limit, going, 0.0)
        # losing control costs the rest of the episode at the largest error: ending early never pays
        end_cost = terminated * worst * (time_limit - state[STEPS + lane])

        state[HEADING_REWARD + lane] = -heading_cost
        state[RUDDER_REWARD + lane] = -rudder_cost
        state[RATE_REWARD + lane] = -rate_cost
        state[END_REWARD + lane] = -end_cost
        state[REWARD + lane] = -(heading_cost + rudder_cost + rate_cost + end_cost)
        state[HEADING_ERROR + lane] = error
        state[DISTANCE + lane] = distance
        state[EXTRAPOLATING + lane] = pick(beyond, 1.0, 0.0)
        state[TERMINATED + lane] = terminated
        state[TRUNCATED + lane] = late * (1.0 - terminated)
        state[ENDED + lane] = max(state[ENDED + lane], max(terminated, late))


@kernel(
    "void(float64[:, ::1], uint64[:, :, ::1], float64[::1], float64[:, ::1], float32[:, ::1],"
    " float32[:, :, ::1], int64)"
)
def step(
    states: Any, keys: Any, settings: Any, ships: Any, actions: Any, observations: Any, n_lanes: int
) -> None:
    """One control interval of the first `n_lanes` ships: sail, judge, change course, observe.

    A lane whose episode is over stays as it is and earns nothing.
    """
    substeps = int(settings[SUBSTEPS])
    for tile in range(states.shape[0]):
        lanes = min(n_lanes - tile * LANES, LANES)
        state, ship = states[tile], ships[tile % ships.shape[0]]
        order_rudder(state, actions[tile], lanes)
        for _ in range(substeps):
            if WEATHER:
                for lane in range(lanes):
                    feel(state[PSI + lane], state[U + lane], state[V + lane], state, ship, lane)
            sail(state, settings[DT] / substeps, ship, lanes)
            if WEATHER:
                weather_goes_on(state, keys[tile, 2], settings[DT] / substeps, ship, lanes)
        judge(state, settings, ship, lanes)
        for lane in range(lanes):
            if state[STEPS + lane] >= state[NEXT_CHANGE + lane] and state[ENDED + lane] == 0.0:
                change_set_point(state, lane, keys, tile, settings)
        observe(state, settings, ship, lanes)
        show(state, observations[tile], lanes)
