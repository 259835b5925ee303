"""Constants of nature, one value each; published models keep their printed values."""

GRAVITY = 9.80665  # m/s^2
SEA_WATER = 1025.0  # density, kg/m^3
