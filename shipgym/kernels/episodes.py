"""Episodes of 64 ships at once: begin them, take a control interval.

The task is `task.py`, replaced by that of an environment when the kernels are compiled. What every step
needs is vectorised over lanes; what comes seldom (a new set-point, the next leg, the end of an episode) is
done lane by lane afterwards.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .accelerations import ROLL, SHAFT
from .compiling import inlined, kernel, rare
from .instruments import add_noise, filter_waves, read_waves
from .layout import DELTA, LANES, LENGTH, PHI, PSI, RUDDER_LIMIT, SCALE_SPEED, SERVICE_SHAFT, N, P, R, U, V
from .motion import clip
from .random import uniform
from .task import N_INFO, is_due, judge, look, misread, set_out, turn
from .trigonometry import sin_cos, wrap
from .voyage import launch, meet_weather, order, voyage
from .voyage_rows import (
    COURSE,
    DT,
    END,
    HEADING_ERROR,
    INTEGRAL,
    INTEGRAL_LENGTHS,
    INTEGRAL_ZONE,
    MISREAD_COURSE,
    MISREAD_PSI,
    MISREAD_R,
    MISREAD_U,
    MISREAD_V,
    N_SHOWN,
    NOISE,
    OBSERVED,
    OUTCOME,
    ROLL_RATE_SEEN,
    ROLL_SEEN,
    RUDDER_COMMAND,
    SHAFT_COMMAND,
    SHAFT_COMMAND_SEEN,
    SHAFT_SEEN,
    SHOWN,
    SUBSTEPS,
    TASK_INFO,
    WAVE_FILTERED,
)
from .weather import WEATHER
from .weather_rows import P_WAVE, PHI_WAVE

N_OUTCOME = (TASK_INFO - OUTCOME) // LANES + N_INFO
N_STEP = 3  # of the outcome, what `step` answers: reward, terminated, truncated
POOL_DRAW = np.uint64(1 << 40)  # number of the draw of an episode's ship, apart from those of its task
LARGEST_ROLL, LARGEST_ROLL_RATE = 0.5235987755982988, 0.1  # rad, rad/s: scales of what is seen


@rare
def observe(state: Any, settings: Any, ship: Any, lanes: int) -> None:
    """Work out what the autopilots see, within the bounds of the observation space."""
    sine, cosine, yaw_rate, sway, surge, rudder, command, integral = (
        OBSERVED, OBSERVED + LANES, OBSERVED + 2 * LANES, OBSERVED + 3 * LANES,
        OBSERVED + 4 * LANES, OBSERVED + 5 * LANES, OBSERVED + 6 * LANES, OBSERVED + 7 * LANES,
    )  # fmt: skip
    per_lengths = 1.0 / (settings[INTEGRAL_ZONE] * settings[INTEGRAL_LENGTHS])
    for lane in range(lanes):
        length, speed = ship[LENGTH + lane], ship[SCALE_SPEED + lane]
        per_speed = 1.0 / speed
        heading, rate = (
            state[PSI + lane] + state[MISREAD_PSI + lane],
            state[R + lane] + state[MISREAD_R + lane],
        )
        sin, cos = sin_cos(state[COURSE + lane] + state[MISREAD_COURSE + lane] - heading)
        state[sine + lane] = clip(sin, -1.0, 1.0)
        state[cosine + lane] = clip(cos, -1.0, 1.0)
        state[yaw_rate + lane] = clip(rate * length * per_speed, -5.0, 5.0)
        state[sway + lane] = clip((state[V + lane] + state[MISREAD_V + lane]) * per_speed, -2.0, 2.0)
        state[surge + lane] = clip((state[U + lane] + state[MISREAD_U + lane]) * per_speed, -2.0, 3.0)
        state[rudder + lane] = clip(state[DELTA + lane] / ship[RUDDER_LIMIT + lane], -1.0, 1.0)
        state[command + lane] = state[RUDDER_COMMAND + lane]
        state[integral + lane] = clip(state[INTEGRAL + lane] * speed * per_lengths / length, -1.0, 1.0)
    look(state, settings, ship, lanes)
    for lane in range(lanes):
        observe_extras(state, ship, lane)


@inlined
def observe_extras(state: Any, ship: Any, lane: int) -> None:
    """Work out what an autopilot may see of roll and shaft."""
    if ROLL:
        heel, rate = state[PHI + lane], state[P + lane]
        if WEATHER:
            heel, rate = heel + state[PHI_WAVE + lane], rate + state[P_WAVE + lane]
        state[ROLL_SEEN + lane] = clip(heel / LARGEST_ROLL, -3.0, 3.0)
        state[ROLL_RATE_SEEN + lane] = clip(rate / LARGEST_ROLL_RATE, -5.0, 5.0)
    if SHAFT:
        state[SHAFT_SEEN + lane] = clip(state[N + lane] / ship[SERVICE_SHAFT + lane], -2.0, 2.0)
    state[SHAFT_COMMAND_SEEN + lane] = state[SHAFT_COMMAND + lane]


@rare
def show(state: Any, settings: Any, observations: Any, first: int, lanes: int) -> None:
    """Hand the observations over, one row a ship."""
    for k in range(int(settings[N_SHOWN])):
        row = int(settings[SHOWN + k])
        for lane in range(lanes):
            observations[first + lane, k] = state[row + lane]


@rare
def hand_over(state: Any, outcomes: Any, first_row: int, first: int, lanes: int) -> None:
    """Hand the outcome over, one column a ship."""
    for k in range(first_row, N_OUTCOME):
        for lane in range(lanes):
            outcomes[k, first + lane] = state[OUTCOME + k * LANES + lane]


@inlined
def measure(state: Any, keys: Any, tile: int, settings: Any, ship: Any, lane: int) -> None:
    """Read the instruments of one ship."""
    read_waves(state, lane)
    if settings[NOISE] != 0.0:
        add_noise(state, keys, tile, settings, lane)
    if WEATHER and settings[WAVE_FILTERED] != 0.0:
        filter_waves(state, settings, ship, lane)
    if settings[NOISE] != 0.0:
        misread(state, settings, ship, lane)


@rare
def measure_all(state: Any, keys: Any, tile: int, settings: Any, ship: Any, lanes: int) -> None:
    """Read the instruments, if they show anything but the ships' slow motion."""
    if WEATHER or settings[NOISE] != 0.0:
        for lane in range(lanes):
            read_waves(state, lane)
    if settings[NOISE] != 0.0:
        for lane in range(lanes):
            add_noise(state, keys, tile, settings, lane)
    if WEATHER and settings[WAVE_FILTERED] != 0.0:
        for lane in range(lanes):
            filter_waves(state, settings, ship, lane)
    if settings[NOISE] != 0.0:
        for lane in range(lanes):
            misread(state, settings, ship, lane)


@rare
def begin(state: Any, lane: int, keys: Any, tile: int, settings: Any, pool: Any, ship: Any) -> None:
    """Begin an episode in a lane, with a ship of the pool, if there is one."""
    if pool.shape[0] > 0:
        number = int(uniform(keys[tile, 0, lane], keys[tile, 1, lane], POOL_DRAW, 0.0, float(pool.shape[0])))
        for row in range(pool.shape[1]):
            ship[row * LANES + lane] = pool[number, row]
    for row in range(0, END, LANES):
        state[row + lane] = 0.0
    launch(state, lane, ship)
    set_out(state, lane, keys, tile, settings, ship)
    meet_weather(state, lane, keys, tile, ship)
    state[HEADING_ERROR + lane] = wrap(state[COURSE + lane] - state[PSI + lane])
    if WEATHER or settings[NOISE] != 0.0:
        measure(state, keys, tile, settings, ship, lane)


@rare
def turn_due(state: Any, keys: Any, tile: int, settings: Any, ship: Any, lanes: int) -> None:
    """Let the ships turn for which it is time."""
    for lane in range(lanes):
        if is_due(state, settings, ship, lane):
            turn(state, lane, keys, tile, settings, ship)


@kernel(
    "void(float64[:, ::1], uint64[:, :, ::1], float64[::1], float64[:, ::1], float64[:, ::1], boolean[::1],"
    " float32[:, ::1], float64[:, ::1], boolean)"
)
def reset(
    states: Any, keys: Any, settings: Any, pool: Any, ships: Any, which: Any, observations: Any,
    outcomes: Any, all_anew: bool,
) -> None:  # fmt: skip
    """Begin an episode in the lanes of `which`.

    Parameters
    ----------
    states : float64 array of shape (n_tiles, n_rows * 64)
        Of the ships, tile by tile.
    keys : uint64 array of shape (n_tiles, 3, 64)
        Seed and number of each episode, and the state of its weather's random numbers.
    settings : float64 array
        Of the task (`voyage_rows`).
    pool : float64 array of shape (n_pool, n_ship_rows)
        Ships of which each episode draws one; none for those of `ships`.
    ships : float64 array of shape (n_tiles or 1, n_ship_rows * 64)
        A tile for all or for each tile.
    which : bool array of shape (n,)
        Lanes to begin anew.
    observations : float32 array of shape (n, n_observations)
        Taken by what autopilots see.
    outcomes : float64 array of shape (N_OUTCOME, n)
        Taken by reward, flags and info.
    all_anew : bool
        Whether everything is shown, or what the last step showed stays: its rewards and flags everywhere,
        and all of it in tiles where no episode begins.
    """
    n = which.shape[0]
    for tile in range(states.shape[0]):
        state, ship, first = states[tile], ships[tile % ships.shape[0]], tile * LANES
        lanes = min(n - first, LANES)
        begun = 0
        for lane in range(lanes):
            if which[first + lane]:
                begin(state, lane, keys, tile, settings, pool, ship)
                begun += 1
        if all_anew or begun > 0:
            observe(state, settings, ship, lanes)
            show(state, settings, observations, first, lanes)
            hand_over(state, outcomes, 0 if all_anew else N_STEP, first, lanes)


@kernel(
    "void(float64[:, ::1], uint64[:, :, ::1], float64[::1], float64[:, ::1], float32[:, ::1],"
    " float32[:, ::1], float64[:, ::1], int64, int64)"
)
def step(
    states: Any, keys: Any, settings: Any, ships: Any, actions: Any, observations: Any, outcomes: Any,
    first_tile: int, end_tile: int,
) -> None:  # fmt: skip
    """One control interval of the tiles from `first_tile` up to `end_tile`.

    A lane whose episode is over stays as it is and earns nothing. `actions` holds rows of commands, of the
    rudder and, if there is a second, of the shaft; for the others see `reset`.
    """
    n = observations.shape[0]
    for tile in range(first_tile, end_tile):
        state, ship, first = states[tile], ships[tile % ships.shape[0]], tile * LANES
        lanes = min(n - first, LANES)
        order(state, actions, first, lanes)
        voyage(state, keys[tile, 2], settings[DT], int(settings[SUBSTEPS]), ship, lanes)
        judge(state, settings, ship, lanes)
        due = 0
        for lane in range(lanes):
            due += 1 if is_due(state, settings, ship, lane) else 0
        if due > 0:
            turn_due(state, keys, tile, settings, ship, lanes)
        measure_all(state, keys, tile, settings, ship, lanes)
        observe(state, settings, ship, lanes)
        show(state, settings, observations, first, lanes)
        hand_over(state, outcomes, 0, first, lanes)
