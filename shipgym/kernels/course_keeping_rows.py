"""Rows of the arrays of the course-keeping environment, after those of ship and weather (`layout`)."""

from __future__ import annotations

from .layout import LANES, TASK, offsets

# the task of a lane
SET_POINT = TASK  # heading to keep, rad
INTEGRAL = TASK + LANES  # of the heading error, rad s
LAST_COMMAND = TASK + 2 * LANES  # part of the rudder limit
LAST_RUDDER = TASK + 3 * LANES  # rudder angle one control interval ago, rad
STEPS = TASK + 4 * LANES  # taken in this episode
NEXT_CHANGE = TASK + 5 * LANES  # step at which the set-point changes
DRAWS = TASK + 6 * LANES  # random numbers used in this episode
ENDED = TASK + 7 * LANES  # 1 once the episode is over

# the outcome of the last step
OUTCOME = TASK + 8 * LANES
REWARD, HEADING_REWARD, RUDDER_REWARD, RATE_REWARD, END_REWARD = offsets(OUTCOME, 5)
TERMINATED, TRUNCATED, EXTRAPOLATING, DISTANCE, HEADING_ERROR = offsets(OUTCOME + 5 * LANES, 5)

# what the autopilot sees, in the order of the observation
OBSERVED = OUTCOME + 10 * LANES
N_OBSERVATIONS = 8
END = OBSERVED + N_OBSERVATIONS * LANES

# settings, one array for all lanes
DT, SUBSTEPS, TIME_LIMIT, LARGEST_CHANGE, CHANGE_INTERVAL, LARGEST_ERROR, LARGEST_DISTANCE = range(7)
HEADING_SCALE, RUDDER_WEIGHT, RATE_WEIGHT, INTEGRAL_ZONE, INTEGRAL_SCALE = range(7, 12)
N_SETTINGS = 12
