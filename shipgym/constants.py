"""Constants of nature, one value each; a published model keeps the value that it was printed with."""

GRAVITY = 9.80665  # m/s^2
SEA_WATER = 1025.0  # density, kg/m^3
