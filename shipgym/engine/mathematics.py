"""Sine, cosine, exponential, arc tangent and the like, in forms that vectorise.

Calls into the C library would stop the loop over lanes from being vectorised. Sine and
cosine: Cody-Waite reduction to [-pi/4, pi/4] and the minimax polynomials of fdlibm
(`k_sin.c`, `k_cos.c`, Sun Microsystems 1993); error below 2e-16 for |x| < 1e5.
Exponential: the same reduction to [-ln 2 / 2, ln 2 / 2] and the polynomial of
`e_exp.c`. Arc tangent: reduction to |x| < 0.66 and the rational function of the Cephes
library (`atan.c`, Moshier 1995).
"""

from math import copysign, fabs, pi
from typing import TypeVar

import numpy as np

from shipgym.engine.record_code import polynomial

Choice = TypeVar("Choice")

TWO_OVER_PI = 2.0 / pi
# 1.5 * 2^52: a number added to it loses its fraction
SHIFT = 6755399441055744.0


def pick(condition: bool, yes: Choice, no: Choice) -> Choice:
    """Return one of two numbers, or of two records of one kind."""
    return yes if condition else no


def clip(value: float, low: float, high: float) -> float:
    """Value within [low, high]."""
    return min(max(value, low), high)


def nearest(x: float) -> float:
    """Return the integer nearest to x, |x| < 2^51, as a float.

    A floor would be of integer type, which is computed lane by lane.
    """
    return (x + SHIFT) - SHIFT


sine_series = polynomial(
    "sine_series",
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
cosine_series = polynomial(
    "cosine_series",
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)
exponential_series = polynomial(
    "exponential_series",
    1.66666666666666019037e-01,
    -2.77777777770155933842e-03,
    6.61375632143793436117e-05,
    -1.65339022054652515390e-06,
    4.13813679705723846039e-08,
)
power_series = polynomial(
    "power_series",
    1.0000000000000144,
    0.6931471805599516,
    0.24022650695639336,
    0.05550410866438316,
    0.009618129194101738,
    0.001333355823666942,
    0.00015403433646322688,
    1.5252654813770773e-05,
    1.3259667128066899e-06,
    1.0209003757888788e-07,
)
arc_above = polynomial(
    "arc_above",
    -6.485021904942025371773e01,
    -1.228866684490136173410e02,
    -7.500855792314704667340e01,
    -1.615753718733365076637e01,
    -8.750608600031904122785e-01,
)
arc_below = polynomial(
    "arc_below",
    1.945506571482613964425e02,
    4.853903996359136964868e02,
    4.328810604912902668951e02,
    1.650270098316988542046e02,
    2.485846490142306297962e01,
    1.0,
)


def sine_polynomial(y: float, z: float) -> float:
    """Sine of y within [-pi/4, pi/4]; z is its square."""
    return y + y * z * sine_series(z)


def cosine_polynomial(z: float) -> float:
    """Cosine of an angle within [-pi/4, pi/4]; z is its square."""
    return 1.0 - 0.5 * z + z * z * cosine_series(z)


def sin_cos(x: float) -> tuple[float, float]:
    """Sine and cosine of an angle in rad."""
    quarter = nearest(x * TWO_OVER_PI)
    half_pi_high = 1.57079632673412561417e00
    half_pi_low = 6.07710050650619224932e-11
    y = (x - quarter * half_pi_high) - quarter * half_pi_low
    z = y * y
    s = sine_polynomial(y, z)
    c = cosine_polynomial(z)

    quadrant = quarter - 4.0 * nearest(0.25 * quarter - 0.375)
    odd = quadrant == 1.0 or quadrant == 3.0
    sine = c if odd else s
    cosine = s if odd else c
    sine = -sine if quadrant >= 2.0 else sine
    cosine = -cosine if quadrant == 1.0 or quadrant == 2.0 else cosine
    return sine, cosine


def small_sin_cos(x: float) -> tuple[float, float]:
    """Sine and cosine of an angle within a quarter turn, from those of its half.

    The error is below 4e-16 for |x| < pi/2; beyond it grows, to 3e-9 for |x| = pi.
    """
    y = 0.5 * x
    z = y * y
    s = sine_polynomial(y, z)
    c = cosine_polynomial(z)
    return 2.0 * s * c, 1.0 - 2.0 * s * s


def turn_sin_cos(x: float) -> tuple[float, float]:
    """Sine and cosine of an angle that a ship turns in part of a step.

    The error is below 2e-16 for |x| < 0.6, 2e-14 for |x| < pi/4, 1e-9 for |x| < pi/2.
    """
    z = x * x
    return sine_polynomial(x, z), cosine_polynomial(z)


def small_cosine(x: float) -> float:
    """Cosine of an angle within a quarter turn to either side, as `small_sin_cos`."""
    y = 0.5 * x
    s = sine_polynomial(y, y * y)
    return 1.0 - 2.0 * s * s


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    rest = angle - 2.0 * pi * nearest(angle / (2.0 * pi))
    return rest - 2.0 * pi if rest >= pi else rest


def power_of_bits(biased: float) -> float:
    """2 to the power whose biased exponent is in the lowest bits of a number."""
    return np.int64(np.float64(biased).view(np.int64) << 52).view(np.float64)


def power_of_two(k: float) -> float:
    """2 to the power of an integer in [-1022, 1023]."""
    # added to an integer: its biased exponent in the lowest bits
    exponent = 4503599627370496.0 + 1023.0
    return power_of_bits(k + exponent)


def exponential(x: float) -> float:
    """Exponential of x; 0 and infinity beyond the range of numbers."""
    # exponents beyond which the exponential is 0 or infinite
    lowest = -746.0
    highest = 710.0
    within = min(max(x, lowest), highest)
    per_ln_2 = 1.44269504088896338700e00
    k = nearest(within * per_ln_2)
    ln_2_high = 6.93147180369123816490e-01
    high = within - k * ln_2_high
    ln_2_low = 1.90821492927058770002e-10
    low = k * ln_2_low
    y = high - low
    z = y * y
    c = y - z * exponential_series(z)
    mantissa = 1.0 - ((low - y * c / (2.0 - c)) - high)
    half = nearest(0.5 * k - 0.25)  # in two steps, for the subnormal numbers
    value = mantissa * power_of_two(half) * power_of_two(k - half)
    return value if x == x else x


def two_to(x: float) -> float:
    """2 to the power of x <= 0, at least 2^-1000.

    By a polynomial of degree 9, with an error below 2e-14 of it.
    """
    within = max(x, -1000.0)
    shifted = within + (SHIFT + 1023.0)  # in its lowest bits the biased exponent
    f = within - (shifted - (SHIFT + 1023.0))
    return power_series(f) * power_of_bits(shifted)


def arctan2(y: float, x: float) -> float:
    """Angle in [-pi, pi] of the point with the finite coordinates x and y, rad."""
    a = fabs(y)
    b = fabs(x)
    tan_3_pi_over_8 = 2.41421356237309504880
    steep = a > tan_3_pi_over_8 * b
    middling = a > 0.66 * b
    # by picks, not by branches, which a loop over lanes would have to undo
    above = pick(steep, -b, pick(middling, a - b, a))
    below = pick(steep, a, pick(middling, a + b, b))
    q = above / pick(below > 0.0, below, 1.0)

    z = q * q
    arc = q + q * (z * arc_above(z) / arc_below(z))

    quarters = pick(steep, 0.5, pick(middling, 0.25, 0.0))
    half_pi_rest = 6.12323399573676588613e-17  # pi / 2 less its double
    rest = 2.0 * half_pi_rest
    ahead = quarters * pi + (arc + quarters * rest)
    behind = pi - (ahead - rest)
    angle = pick(copysign(1.0, x) < 0.0, behind, ahead)
    return copysign(angle, y)


def arctan(x: float) -> float:
    """Angle in [-pi/2, pi/2] whose tangent is x, rad."""
    return arctan2(x, 1.0)
