"""Rows of the weather: what a ship's tile tells of it, and where it stands in the tile of her state.

Forces are rows of Fourier series over an angle, already divided by the ship's inertia. Filters are rows
of their discrete form for the step in use: what part of the value is kept, and the deviation of what is
added.
"""

from __future__ import annotations

from .layout import COEFFICIENTS, LANES, STATE_END, TASK, WEATHER, offsets

HARMONICS = 6  # of each series; a cosine series has its mean before them

# in the ship's tile; a direction that is not a number is drawn for each episode
CURRENT_SPEED, CURRENT_TOWARDS = offsets(WEATHER, 2)  # m/s; rad
CURRENT_KEPT, CURRENT_SHOCK, CURRENT_DEVIATION = offsets(WEATHER + 2 * LANES, 3)  # -; m/s; m/s
WIND_SPEED, WIND_FROM = offsets(WEATHER + 5 * LANES, 2)  # m/s; rad
GUST_KEPT, GUST_SHOCK, GUST_DEVIATION = offsets(WEATHER + 7 * LANES, 3)  # -; m/s; m/s
WAVES_FROM, WAVE_FREQUENCY, WAVE_NUMBER = offsets(WEATHER + 10 * LANES, 3)  # rad; rad/s; rad/m
WAVE_DAMPING, WAVE_RINGING = offsets(WEATHER + 13 * LANES, 2)  # lambda; sqrt(1 - lambda^2)
DRIFT_KEPT, DRIFT_SHOCK, DRIFT_DEVIATION = offsets(WEATHER + 15 * LANES, 3)  # parts of the mean drift force
STILL_AIR = WEATHER + 18 * LANES  # 1/m, surge deceleration by speed^2 that the model has of itself

# accelerations by (relative wind)^2, over the angle of the relative wind
WIND_SURGE = WEATHER + 19 * LANES
WIND_SWAY = WIND_SURGE + (HARMONICS + 1) * LANES
WIND_YAW = WIND_SWAY + HARMONICS * LANES
WIND_ROLL = WIND_YAW + HARMONICS * LANES
# accelerations by the mean drift force and variances of the first-order motion, over the angle of the waves
DRIFT_SURGE = WIND_ROLL + HARMONICS * LANES
DRIFT_SWAY = DRIFT_SURGE + (HARMONICS + 1) * LANES
DRIFT_YAW = DRIFT_SWAY + HARMONICS * LANES
DRIFT_ROLL = DRIFT_YAW + HARMONICS * LANES
HEADING_VARIANCE = DRIFT_ROLL + HARMONICS * LANES
ROLL_VARIANCE = HEADING_VARIANCE + (HARMONICS + 1) * LANES
PARAMETERS_END = ROLL_VARIANCE + (HARMONICS + 1) * LANES

# in the tile of the state: what does not change in an episode ...
MEAN_NORTH, MEAN_EAST = offsets(STATE_END, 2)  # m/s, mean current
WIND_NORTH, WIND_EAST, WAVES_NORTH, WAVES_EAST = offsets(STATE_END + 2 * LANES, 4)  # where they come from
# ... the processes ...
CURRENT_NORTH, CURRENT_EAST = offsets(STATE_END + 6 * LANES, 2)  # m/s
GUST, DRIFT = offsets(STATE_END + 8 * LANES, 2)  # m/s, part of the mean drift force
HEADING_1, HEADING_2, ROLL_1, ROLL_2 = offsets(STATE_END + 10 * LANES, 4)  # of unit variance
# ... and what comes of them
PSI_WAVE, R_WAVE, PHI_WAVE, P_WAVE = offsets(STATE_END + 14 * LANES, 4)  # first-order motion, rad, rad/s
PUSH_U, PUSH_V, PUSH_R, PUSH_P = offsets(STATE_END + 18 * LANES, 4)  # accelerations, m/s^2, rad/s^2
SKY_END = STATE_END + 22 * LANES

assert SKY_END == TASK
assert PARAMETERS_END == COEFFICIENTS

# what is recorded of the weather beside the state
CHANNEL_NAMES = (
    "psi_wave", "r_wave", "phi_wave", "p_wave", "current_north", "current_east", "wind_speed", "wind_from",
)  # fmt: skip
