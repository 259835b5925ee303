"""Noise of the sensors of a sea trial."""

import math

_DEGREE = math.pi / 180.0

#: Standard deviations of compass, rate gyro, Doppler log, satellite position and its
#: velocity; SI units.
SEA_TRIAL = {
    "heading": 0.1 * _DEGREE,
    "yaw_rate": 0.02 * _DEGREE,
    "speed": 0.03,
    "position": 0.3,
    "ground": 0.05,
}
