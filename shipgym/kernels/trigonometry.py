"""Sine and cosine that a vectorised loop can hold.

Cody-Waite reduction to [-pi/4, pi/4] and the minimax polynomials of fdlibm (`k_sin.c`, `k_cos.c`,
Sun Microsystems 1993); error below 2e-16 for |x| < 1e5. Calls into the C library would stop the loop
over lanes from being vectorised.
"""

from __future__ import annotations

from math import floor, pi

from .compiling import inlined

TWO_OVER_PI = 2.0 / pi
HALF_PI_HIGH = 1.57079632673412561417e00
HALF_PI_LOW = 6.07710050650619224932e-11


@inlined
def sin_cos(x: float) -> tuple[float, float]:
    """Sine and cosine of an angle in rad."""
    quarter = floor(x * TWO_OVER_PI + 0.5)
    y = (x - quarter * HALF_PI_HIGH) - quarter * HALF_PI_LOW
    z = y * y
    s = y + y * z * (
        -1.66666666666666324348e-01
        + z
        * (
            8.33333333332248946124e-03
            + z
            * (
                -1.98412698298579493134e-04
                + z
                * (
                    2.75573137070700676789e-06
                    + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
                )
            )
        )
    )
    c = (
        1.0
        - 0.5 * z
        + z
        * z
        * (
            4.16666666666666019037e-02
            + z
            * (
                -1.38888888888741095749e-03
                + z
                * (
                    2.48015872894767294178e-05
                    + z
                    * (
                        -2.75573143513906633035e-07
                        + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11)
                    )
                )
            )
        )
    )
    quadrant = quarter - 4.0 * floor(0.25 * quarter)
    odd = quadrant == 1.0 or quadrant == 3.0
    sine = c if odd else s
    cosine = s if odd else c
    sine = -sine if quadrant >= 2.0 else sine
    cosine = -cosine if quadrant == 1.0 or quadrant == 2.0 else cosine
    return sine, cosine


@inlined
def wrap(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)
