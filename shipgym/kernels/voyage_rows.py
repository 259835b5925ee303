"""Rows of a voyage under an autopilot, after those of ship and weather, and settings of its task."""

from __future__ import annotations

from .layout import LANES, TASK, offsets

# how an episode goes
RUDDER_COMMAND, SHAFT_COMMAND = offsets(TASK, 2)  # parts of the rudder limit, of the service shaft speed
LAST_RUDDER = TASK + 2 * LANES  # rudder angle one control interval ago, rad
STEPS, DRAWS, ENDED = offsets(TASK + 3 * LANES, 3)  # taken; random numbers used; 1 once it is over
COURSE, INTEGRAL = offsets(TASK + 6 * LANES, 2)  # heading to steer, rad; of the heading error, rad s

# what instruments show beyond the ship's slow motion, and the wave filter's memory of heading and yaw rate
MISREAD_PSI, MISREAD_R, MISREAD_U, MISREAD_V = offsets(TASK + 8 * LANES, 4)  # rad, rad/s, m/s, m/s
MISREAD_X, MISREAD_Y, MISREAD_COURSE = offsets(TASK + 12 * LANES, 3)  # m, m, and what comes of them, rad
HEADING_FILTER, RATE_FILTER = TASK + 15 * LANES, TASK + 19 * LANES  # 4 rows each

# the outcome of the last step: what `step` answers, then `info`
REWARD, TERMINATED, TRUNCATED = offsets(TASK + 23 * LANES, 3)
OUTCOME = REWARD
HEADING_ERROR, DISTANCE, EXTRAPOLATING = offsets(TASK + 26 * LANES, 3)
RUDDER_REWARD, RATE_REWARD, ROLL_REWARD, ENVELOPE_REWARD, END_REWARD = offsets(TASK + 29 * LANES, 5)
TASK_INFO = TASK + 34 * LANES  # 8 rows of the task's own

# what an autopilot may see; which rows it does is a setting
OBSERVED = TASK + 42 * LANES
N_STEERING = 8  # heading error (sine, cosine), yaw rate, sway, surge, rudder, last command, integral
ROLL_SEEN, ROLL_RATE_SEEN, SHAFT_SEEN, SHAFT_COMMAND_SEEN = offsets(OBSERVED + N_STEERING * LANES, 4)
TASK_SEEN = OBSERVED + 12 * LANES  # 5 rows of the task's own
TASK_STATE = OBSERVED + 17 * LANES  # 12 rows of the task's own
END = TASK_STATE + 12 * LANES  # beyond it what lasts over an episode and is written when it begins

# settings, one array for all lanes
DT, SUBSTEPS, TIME_LIMIT, LARGEST_DISTANCE = range(4)
HEADING_SCALE, RUDDER_WEIGHT, RATE_WEIGHT, ROLL_WEIGHT, ROLL_SCALE, ENVELOPE_WEIGHT = range(4, 10)
INTEGRAL_ZONE, INTEGRAL_LENGTHS = range(10, 12)  # rad; its scale is the zone for so many ship lengths
NOISE, NOISE_PSI, NOISE_R, NOISE_SPEED, NOISE_POSITION = range(12, 17)  # 0 or 1; deviations
WAVE_FILTERED = 17  # 1: heading and yaw rate are shown without the waves' frequencies
N_SHOWN, SHOWN = 18, 19  # number of rows that are observed, and their offsets, at most 17
TASK_SETTINGS = 36  # 8 settings of the task's own
LEAST_SHAFT = 44  # least command of the shaft, part of service speed
N_LIST, LIST = 45, 46  # length of a list of the task's own, and the list
