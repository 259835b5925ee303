"""Rows of the arrays of the course-keeping environment, after those of the ship (`layout`)."""

from __future__ import annotations

from .layout import LANES, STATE_END, offsets

# the task of a lane
SET_POINT = STATE_END  # heading to keep, rad
INTEGRAL = STATE_END + LANES  # of the heading error, rad s
LAST_COMMAND = STATE_END + 2 * LANES  # part of the rudder limit
LAST_RUDDER = STATE_END + 3 * LANES  # rudder angle one control interval ago, rad
STEPS = STATE_END + 4 * LANES  # taken in this episode
NEXT_CHANGE = STATE_END + 5 * LANES  # step at which the set-point changes
DRAWS = STATE_END + 6 * LANES  # random numbers used in this episode
ENDED = STATE_END + 7 * LANES  # 1 once the episode is over

# the outcome of the last step
OUTCOME = STATE_END + 8 * LANES
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
