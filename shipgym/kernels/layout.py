"""Where things stand in the arrays that the kernels share.

State and ship come in tiles of 64 lanes, one lane a ship, row after row: a tile is a contiguous
one-dimensional array and the constants below are the offsets of its rows, so that `state[PSI + lane]`
is a lane's heading. Offsets known at compile time are what lets the compiler vectorise a loop over
lanes.
"""

from __future__ import annotations

LANES = 64


def offsets(first: int, count: int) -> range:
    """Offsets of `count` rows from the row at offset `first` on."""
    return range(first, first + count * LANES, LANES)


def row(offset: int) -> int:
    """Number of the row at an offset."""
    return offset // LANES


# state of a ship; roll (P, PHI) and shaft (N) stay 0 in ships that have none; a table with a memory of yaw
# keeps it in P
STATE_NAMES = ("x", "y", "psi", "u", "v", "r", "p", "phi", "delta", "n")
N_STATE = 10
X, Y, PSI, U, V, R, P, PHI, DELTA, N = offsets(0, N_STATE)
STATE_END = N_STATE * LANES
# after it 22 rows of weather (`weather_rows`), then those of an environment's task
TASK = STATE_END + 22 * LANES

# a ship: its constants, its operating envelope, the weather, then the coefficients of its accelerations
LENGTH, SERVICE_SPEED = offsets(0, 2)  # m; m/s
RUDDER_LIMIT, RUDDER_RATE = offsets(2 * LANES, 2)  # rad; rad/s
GEAR_FREQUENCY = 4 * LANES  # 1/s, inverse of the steering gear's time constant; 0: ramp at constant rate
SERVICE_SHAFT, WATER_DEPTH = offsets(5 * LANES, 2)  # 1/s, shaft speed at service speed; m
SCALE_SPEED = 7 * LANES  # m/s, by which observations and costs are scaled: as a rule the service speed
ENVELOPE_LOW = 8 * LANES  # 4 rows: least u, v, r, delta of the training data
ENVELOPE_HIGH = 12 * LANES  # 4 rows: largest
ENVELOPE_CENTRE = 16 * LANES  # 4 rows: centre of the ellipsoid around the training data
ENVELOPE_SHAPE = 20 * LANES  # 10 rows: upper triangle W, row by row; inside is |W (z - centre)| <= 1
WEATHER = 30 * LANES  # 83 rows, not used in calm water (`weather_rows`)
COEFFICIENTS = 113 * LANES

# a state beyond these multiples of service speed and of yaw rate U0 / L belongs to no ship
RUNAWAY_SPEED = 3.0
RUNAWAY_YAW_RATE = 6.0
CAPSIZED = 1.5707963267948966  # rad; nor does it heel beyond a right angle
