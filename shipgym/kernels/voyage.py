"""A voyage under an autopilot, whatever her task: commands, sailing, instruments, costs of all tasks.

Loops over lanes that every step needs are vectorised: they touch few arrays, hold no loop of their own
and call only inlined functions. Rows of the arrays: `voyage_rows`.
"""

from __future__ import annotations

from math import fabs
from typing import Any

import numpy as np

from . import accelerations as equations
from .accelerations import ROLL, SHAFT
from .compiling import exact, inlined, pick, rare
from .envelope import envelope_distance, outside_range
from .layout import (
    DELTA,
    LENGTH,
    PHI,
    PSI,
    RUDDER_LIMIT,
    SCALE_SPEED,
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
from .motion import CALM, Push, capsizes, clip, runge_kutta, runs_away
from .random import stream, uniform
from .trigonometry import wrap
from .voyage_rows import (
    COURSE,
    DISTANCE,
    DRAWS,
    DT,
    END_REWARD,
    ENDED,
    ENVELOPE_REWARD,
    ENVELOPE_WEIGHT,
    EXTRAPOLATING,
    HEADING_ERROR,
    HEADING_SCALE,
    INTEGRAL,
    INTEGRAL_LENGTHS,
    INTEGRAL_ZONE,
    LARGEST_DISTANCE,
    LAST_RUDDER,
    RATE_REWARD,
    RATE_WEIGHT,
    REWARD,
    ROLL_REWARD,
    ROLL_SCALE,
    ROLL_WEIGHT,
    RUDDER_COMMAND,
    RUDDER_REWARD,
    RUDDER_WEIGHT,
    SHAFT_COMMAND,
    STEPS,
    TERMINATED,
    TIME_LIMIT,
    TRUNCATED,
)
from .weather import WEATHER, begin_weather, evolve, feel
from .weather_rows import CURRENT_EAST, CURRENT_NORTH, PUSH_P, PUSH_R, PUSH_U, PUSH_V

#: See `prices`.
Prices = tuple[float, float, float, float, float, float, float, float, float]
KEEPS_P = ROLL or getattr(equations, "MEMORY", False)  # the row holds a roll rate or a memory of yaw


@inlined
def draw(state: Any, lane: int, keys: Any, tile: int, low: float, high: float) -> float:
    """Next random number of a lane's episode, in [low, high)."""
    count = state[DRAWS + lane]
    state[DRAWS + lane] = count + 1.0
    return uniform(keys[tile, 0, lane], keys[tile, 1, lane], np.uint64(count), low, high)


@rare
def launch(state: Any, lane: int, ship: Any) -> None:
    """Put a ship straight ahead at service speed."""
    state[U + lane] = ship[SERVICE_SPEED + lane]
    state[N + lane] = ship[SERVICE_SHAFT + lane] if SHAFT else 0.0
    state[SHAFT_COMMAND + lane] = 1.0


@rare
def meet_weather(state: Any, lane: int, keys: Any, tile: int, ship: Any) -> None:
    """Begin the weather of an episode."""
    if WEATHER:
        words = keys[tile, 2]
        words[lane] = stream(keys[tile, 0, lane], keys[tile, 1, lane])
        begin_weather(state[PSI + lane], state[U + lane], state[V + lane], state, words, ship, lane)


@inlined
def order(state: Any, actions: Any, least_shaft: float, first: int, lanes: int) -> None:
    """Take the commands of ships whose episode is not over."""
    for lane in range(lanes):
        ended = state[ENDED + lane] != 0.0
        command = clip(float(actions[0, np.uintp(first + lane)]), -1.0, 1.0)
        state[RUDDER_COMMAND + lane] = pick(ended, state[RUDDER_COMMAND + lane], command)
        state[LAST_RUDDER + lane] = state[DELTA + lane]
        state[STEPS + lane] += 1.0 - state[ENDED + lane]
        state[TERMINATED + lane] = 0.0
    if actions.shape[0] > 1:
        for lane in range(lanes):
            ended = state[ENDED + lane] != 0.0
            command = clip(float(actions[1, np.uintp(first + lane)]), least_shaft, 1.0)
            state[SHAFT_COMMAND + lane] = pick(ended, state[SHAFT_COMMAND + lane], command)


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
        rudder = state[RUDDER_COMMAND + lane] * ship[RUDDER_LIMIT + lane]
        shaft = state[SHAFT_COMMAND + lane] * ship[SERVICE_SHAFT + lane]
        new = runge_kutta(old, rudder, shaft, h, pushed(state, lane), ship, lane)
        away = runs_away(new[3], new[4], new[5], ship, lane)
        if ROLL:
            away = away | capsizes(new[7])
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
def voyage(state: Any, words: Any, interval: float, substeps: int, ship: Any, lanes: int) -> None:
    """One control interval: the weather is felt, the ships sail, the weather goes on."""
    h = interval / substeps
    for _ in range(substeps):
        if WEATHER:
            for lane in range(lanes):
                feel(state[PSI + lane], state[U + lane], state[V + lane], state, ship, lane)
        sail(state, h, ship, lanes)
        if WEATHER:
            for lane in range(lanes):
                over = state[ENDED + lane] != 0.0
                evolve(state[PSI + lane], state[U + lane], state[V + lane], h, over, state, words, ship, lane)


@exact
def prices(settings: Any) -> Prices:
    """What `gather`, `strain` and `settle` read of the settings, read once and not in every lane."""
    per_scale, per_heel = 1.0 / settings[HEADING_SCALE], 1.0 / settings[ROLL_SCALE]
    return (
        settings[DT],
        settings[INTEGRAL_ZONE],
        settings[INTEGRAL_ZONE] * settings[INTEGRAL_LENGTHS],
        settings[RUDDER_WEIGHT] * per_scale * per_scale,
        settings[RATE_WEIGHT] * (per_scale / settings[DT]) ** 2,
        settings[ROLL_WEIGHT] * per_heel * per_heel,
        settings[ENVELOPE_WEIGHT],
        settings[LARGEST_DISTANCE],
        settings[TIME_LIMIT],
    )


@exact
def gather(state: Any, price: Prices, ship: Any, lane: int) -> float:
    """Heading error, rad; its integral grows only while it is small and the episode is not over."""
    dt, zone, lengths = price[0], price[1], price[2]
    reach = lengths * ship[LENGTH + lane] / ship[SCALE_SPEED + lane]
    error = wrap(state[COURSE + lane] - state[PSI + lane])
    gathered = pick(fabs(error) > zone, 0.0, (1.0 - state[ENDED + lane]) * error * dt)
    state[INTEGRAL + lane] = clip(state[INTEGRAL + lane] + gathered, -reach, reach)
    state[HEADING_ERROR + lane] = error
    return error


@exact
def strain(state: Any, price: Prices, ship: Any, lane: int) -> float:
    """Cost of rudder, rudder rate and heel, and of being where the model extrapolates."""
    u, v, r, delta = state[U + lane], state[V + lane], state[R + lane], state[DELTA + lane]
    going = 1.0 - state[ENDED + lane]
    rate = (delta - state[LAST_RUDDER + lane]) * ship[LENGTH + lane] / ship[SCALE_SPEED + lane]
    rudder_cost = going * price[3] * delta * delta
    rate_cost = going * price[4] * rate * rate
    heel_cost = going * price[5] * state[PHI + lane] * state[PHI + lane] if ROLL else 0.0

    distance = envelope_distance(u, v, r, delta, ship, lane)
    beyond = outside_range(u, v, r, delta, ship, lane) | (distance > 1.0)
    extrapolating = pick(beyond, 1.0, 0.0)
    envelope_cost = going * price[6] * extrapolating

    state[DISTANCE + lane] = distance
    state[EXTRAPOLATING + lane] = extrapolating
    state[RUDDER_REWARD + lane] = -rudder_cost
    state[RATE_REWARD + lane] = -rate_cost
    state[ROLL_REWARD + lane] = -heel_cost
    state[ENVELOPE_REWARD + lane] = -envelope_cost
    return rudder_cost + rate_cost + heel_cost + envelope_cost


@exact
def settle(
    state: Any, price: Prices, lost: bool, arrived: bool, cost: float, worst: float, lane: int
) -> None:
    """Close the account of an interval.

    Losing control costs the rest of the episode at the `worst` cost of a step: ending early never pays.
    """
    largest_distance, time_limit = price[7], price[8]
    going = 1.0 - state[ENDED + lane]
    far = state[DISTANCE + lane] > largest_distance
    failed = going * pick(lost | far, 1.0, state[TERMINATED + lane])
    terminated = max(failed, going * pick(arrived, 1.0, 0.0))
    late = pick(state[STEPS + lane] >= time_limit, going, 0.0)
    end_cost = failed * worst * (time_limit - state[STEPS + lane])
    state[END_REWARD + lane] = -end_cost
    state[REWARD + lane] = -(cost + end_cost)
    state[TERMINATED + lane] = terminated
    state[TRUNCATED + lane] = late * (1.0 - terminated)
    state[ENDED + lane] = max(state[ENDED + lane], max(terminated, late))
