"""Episodes of 64 ships at once: begin them, take a control interval.

The task is `task.py`, replaced by that of an environment when the kernels are compiled. What every step
needs is vectorised over lanes; what comes seldom (a new set-point, the next leg, the end of an episode) is
done lane by lane afterwards. Arrays that are not tiles are indexed by unsigned numbers: an index that could
be negative, and would count from the end, keeps a loop from being vectorised.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .accelerations import ROLL, SHAFT
from .compiling import inlined, kernel, matrix_at, rare
from .instruments import add_noise, filter_waves, keeps_reading, read_waves
from .layout import DELTA, LANES, LENGTH, PHI, PSI, RUDDER_LIMIT, SCALE_SPEED, SERVICE_SHAFT, N, P, R, U, V
from .motion import clip
from .random import uniform
from .task import N_FLAGS, N_INFO, is_due, judge, look, misread, set_out, turn
from .trigonometry import sin_cos, wrap
from .voyage import launch, meet_weather, order, voyage
from .voyage_rows import (
    COURSE,
    DT,
    END,
    EXTRAPOLATING,
    HEADING_ERROR,
    INTEGRAL,
    INTEGRAL_LENGTHS,
    INTEGRAL_ZONE,
    LEAST_SHAFT,
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
    TERMINATED,
    TRUNCATED,
    WAVE_FILTERED,
)
from .weather import WEATHER
from .weather_rows import P_WAVE, PHI_WAVE

N_OUTCOME = (TASK_INFO - OUTCOME) // LANES + N_INFO
N_STEP = 3  # of the outcome, what `step` answers: reward, terminated, truncated
N_STEP_FLAGS = 2  # of the flags, what `step` answers
#: Rows of the outcome that are flags.
FLAGS = (
    TERMINATED, TRUNCATED, EXTRAPOLATING, *(TASK_INFO + k * LANES for k in range(N_INFO - N_FLAGS, N_INFO)),
)  # fmt: skip
# NumPy's numbers, since a function is compiled anew for each literal that it is called with. Only `observe`
# is given a literal 0: made for all lanes it is faster on paths.
FIRST_LANE: Any = np.int64(0)
ALL_ROWS: Any = np.bool_(True)
UNANSWERED_ROWS: Any = np.bool_(False)  # all but what `step` answers
REFUSED = -1  # what `step` answers to commands that are no numbers
POOL_DRAW = np.uint64(1 << 40)  # number of the draw of an episode's ship, apart from those of its task
LARGEST_ROLL, LARGEST_ROLL_RATE = 0.5235987755982988, 0.1  # rad, rad/s: scales of what is seen


@rare
def observe(state: Any, settings: Any, ship: Any, begin: int, end: int) -> None:
    """Work out what the autopilots of some lanes see, within the bounds of the observation space."""
    sine, cosine, yaw_rate, sway, surge, rudder, command, integral = (
        OBSERVED, OBSERVED + LANES, OBSERVED + 2 * LANES, OBSERVED + 3 * LANES,
        OBSERVED + 4 * LANES, OBSERVED + 5 * LANES, OBSERVED + 6 * LANES, OBSERVED + 7 * LANES,
    )  # fmt: skip
    per_lengths = 1.0 / (settings[INTEGRAL_ZONE] * settings[INTEGRAL_LENGTHS])
    for lane in range(begin, end):
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
    look(state, settings, ship, begin, end)
    for lane in range(begin, end):
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
def show(state: Any, settings: Any, observations: Any, first: int, begin: int, end: int) -> None:
    """Hand the observations of some lanes over, one row a ship."""
    for k in range(int(settings[N_SHOWN])):
        row = int(settings[SHOWN + k])
        for lane in range(begin, end):
            observations[np.uintp(first + lane), k] = state[np.uintp(row + lane)]


@rare
def hand_over(
    state: Any, outcomes: Any, flags: Any, all_rows: bool, first: int, begin: int, end: int
) -> None:
    """Hand the outcome of some lanes over, one column a ship: all rows, or all but what `step` answers."""
    for k in range(0 if all_rows else N_STEP, N_OUTCOME):
        row = OUTCOME + k * LANES
        for lane in range(begin, end):
            outcomes[k, np.uintp(first + lane)] = state[np.uintp(row + lane)]
    for k in range(0 if all_rows else N_STEP_FLAGS, len(FLAGS)):
        row = FLAGS[k]
        for lane in range(begin, end):
            flags[k, np.uintp(first + lane)] = state[np.uintp(row + lane)] > 0.0


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
def begin_next(
    state: Any, lane: int, keys: Any, tile: int, settings: Any, pool: Any, ship: Any, observations: Any,
    outcomes: Any, flags: Any,
) -> None:  # fmt: skip
    """Begin the next episode of a lane and show it; reward and flags stay those of the last step."""
    first = tile * LANES
    keys[tile, 1, lane] += np.uint64(1)
    begin(state, lane, keys, tile, settings, pool, ship)
    observe(state, settings, ship, lane, lane + 1)
    show(state, settings, observations, first, lane, lane + 1)
    hand_over(state, outcomes, flags, UNANSWERED_ROWS, first, lane, lane + 1)


@inlined
def are_numbers(actions: Any) -> bool:
    """Whether all commands are finite."""
    wrong = 0
    for row in range(actions.shape[0]):
        for lane in range(actions.shape[1]):
            wrong += 0 if abs(actions[row, lane]) < np.inf else 1
    return wrong == 0


@rare
def turn_due(state: Any, keys: Any, tile: int, settings: Any, ship: Any, lanes: int) -> None:
    """Let the ships turn for which it is time."""
    for lane in range(lanes):
        if is_due(state, settings, ship, lane):
            turn(state, lane, keys, tile, settings, ship)


@kernel(
    "void(float64[:, ::1], uint64[:, :, ::1], float64[::1], float64[:, ::1], float64[:, ::1], boolean[::1],"
    " float32[:, ::1], float64[:, ::1], boolean[:, ::1], boolean)"
)
def reset(
    states: Any, keys: Any, settings: Any, pool: Any, ships: Any, which: Any, observations: Any,
    outcomes: Any, flags: Any, next_one: bool,
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
    flags : bool array of shape (n_flags, n)
        Taken by those rows of the outcome that are flags: terminated, truncated, extrapolating, then the
        task's.
    next_one : bool
        Whether the next episode begins under the key, and is shown in its lane alone, where rewards and
        flags stay those of the last step; or the one of `keys`, and everything is shown.
    """
    n = which.shape[0]
    for tile in range(states.shape[0]):
        state, ship, first = states[tile], ships[tile % ships.shape[0]], tile * LANES
        lanes = min(n - first, LANES)
        for lane in range(lanes):
            if which[first + lane]:
                if next_one:
                    begin_next(state, lane, keys, tile, settings, pool, ship, observations, outcomes, flags)
                else:
                    begin(state, lane, keys, tile, settings, pool, ship)
        if not next_one:
            observe(state, settings, ship, 0, lanes)
            show(state, settings, observations, first, FIRST_LANE, lanes)
            hand_over(state, outcomes, flags, ALL_ROWS, first, FIRST_LANE, lanes)


@inlined
def step(
    states: Any, keys: Any, settings: Any, pool: Any, ships: Any, actions: Any, observations: Any,
    outcomes: Any, flags: Any, first_tile: int, end_tile: int, next_ones: bool,
) -> int:  # fmt: skip
    """One control interval of the tiles from `first_tile` up to `end_tile`.

    `actions` holds rows of commands, of the rudder and, if there is a second, of the shaft; for the others
    see `reset`. A lane whose episode was over stays as it is and earns nothing, or, with `next_ones`, begins
    its next episode. Returns the number of episodes that ended, or `REFUSED`, nothing changed, if one of
    all commands is no number.
    """
    if not are_numbers(actions):
        return REFUSED
    n, ended = observations.shape[0], 0
    for tile in range(first_tile, end_tile):
        state, ship, first = states[tile], ships[tile % ships.shape[0]], tile * LANES
        lanes = min(n - first, LANES)
        order(state, actions, settings[LEAST_SHAFT], first, lanes)
        voyage(state, keys[tile, 2], settings[DT], int(settings[SUBSTEPS]), ship, lanes)
        judge(state, settings, ship, lanes)
        due = 0
        for lane in range(lanes):
            due += 1 if is_due(state, settings, ship, lane) else 0
            ended += 1 if state[TERMINATED + lane] + state[TRUNCATED + lane] > 0.0 else 0
        if due > 0:
            turn_due(state, keys, tile, settings, ship, lanes)
        measure_all(state, keys, tile, settings, ship, lanes)
        observe(state, settings, ship, 0, lanes)
        show(state, settings, observations, first, FIRST_LANE, lanes)
        hand_over(state, outcomes, flags, ALL_ROWS, first, FIRST_LANE, lanes)
        if next_ones:
            for lane in range(lanes):
                if keeps_reading(state, lane):
                    begin_next(state, lane, keys, tile, settings, pool, ship, observations, outcomes, flags)
    return ended


@kernel("int64(int64[::1], boolean)")
def step_at(world: Any, next_ones: bool) -> int:
    """`step` of arrays that are given by their addresses and shapes, by turns, and the two tiles.

    To look at nine arrays takes the interpreter longer than to sail a ship.
    """
    return step(
        matrix_at(world[0], world[1], world[2], np.float64),
        matrix_at(world[3], world[4], 3 * LANES, np.uint64).reshape((world[4], 3, LANES)),
        matrix_at(world[6], 1, world[7], np.float64)[0],
        matrix_at(world[8], world[9], world[10], np.float64),
        matrix_at(world[11], world[12], world[13], np.float64),
        matrix_at(world[14], world[15], world[16], np.float32),
        matrix_at(world[17], world[18], world[19], np.float32),
        matrix_at(world[20], world[21], world[22], np.float64),
        matrix_at(world[23], world[24], world[25], np.bool_),
        world[26], world[27], next_ones,
    )  # fmt: skip
