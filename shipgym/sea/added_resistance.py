"""Added resistance in regular waves of any direction: the SNNM formula of the ITTC."""

import numpy as np
from numpy import cos, exp, log, pi, sin, sqrt, where
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.constants import GRAVITY
from shipgym.ships.particulars import MainDimensions, Particulars, main_dimensions

#: Radius of gyration in pitch by length.
PITCH_GYRADIUS = 0.25


def added_resistance(
    omega: ArrayLike, chi: ArrayLike, ship: Particulars, speed: float
) -> Floats:
    """Mean resistance by squared amplitude, N/m2; negative: a push.

    The sum of what the ship's motions radiate and what its ends reflect: the SNNM
    formula of ITTC Recommended Procedure 7.5-04-01-01.1 (2021), appendix G; Liu &
    Papanikolaou 2020, Regression analysis of experimental data for added resistance in
    waves of arbitrary heading, Ocean Engineering 206. On even keel, with the angle of
    :func:`end_angle`. It stands for ships of 75 to 400 m with L/B 4 to 9, B/T 2 to 9,
    CB 0.5 to 0.9 and Froude numbers up to 0.3; B/T counts as at least 2, the Froude
    number as at most 0.4. `omega`, rad/s, is of the waves; `chi`, 0 to pi, where they
    come from, seen from the bow; `speed`, m/s, the ship's.
    """
    hull = main_dimensions(ship)
    U = min(speed, 0.4 * float(sqrt(GRAVITY * hull.L)))
    omega, chi = np.broadcast_arrays(
        np.asarray(omega, dtype=float),
        np.asarray(chi, dtype=float),
    )
    radiated = _radiated(omega, chi, hull, U)
    reflected = _reflected(omega, chi, hull, end_angle(ship), U)
    weight_density = ship.require("water_density") * GRAVITY
    return weight_density * (radiated + reflected)


def end_angle(ship: Particulars) -> float:
    """Half angle of the waterline at bow and stern, estimated, rad.

    arctan(0.495 B / (L (1 - CP))): the run of Holtrop & Mennen 1982 (An approximate
    power prediction method, International Shipbuilding Progress 29) with the centre of
    buoyancy at midship, and an entrance as long. CP = CB / CM with the midship
    coefficient CM = 1.006 - 0.0056 CB^(-3.56) of Kerlen 1970.
    """
    L, B, _, CB = main_dimensions(ship)
    CM = 1.006 - 0.0056 * CB**-3.56
    CP = min(CB / CM, 0.95)
    return float(np.arctan(0.495 * B / (L * (1.0 - CP))))


def _radiated(omega: Floats, chi: Floats, hull: MainDimensions, U: float) -> Floats:
    """Part of the ship's motions by rho g, equations G-14 to G-22.

    3859.2 B^2 / L CB^1.34 k_yy^2 a1 a2 w^b1 exp(b1 / d1 (1 - w^d1))
    """
    L, B, _, CB = hull
    w = _reduced_frequency(
        omega,
        chi,
        hull,
        U,
    )
    a1, a2 = _amplitudes(omega, chi, hull, U)

    below_peak = w < 1.0
    b1 = where(below_peak, 11.0, -8.5)
    d1_below = 566.0 * (L * CB / B) ** -2.66
    d1_above = -566.0 * (L / B) ** -2.66 * 4.0
    d1 = where(below_peak, d1_below, d1_above)
    with np.errstate(over="ignore", under="ignore"):
        past_peak = 1.0 - w**d1
        exponent = b1 * log(w) + b1 / d1 * past_peak
        shape = exp(exponent)

    k_yy = PITCH_GYRADIUS
    width = 3859.2 * B**2 / L
    scale = width * CB**1.34 * k_yy**2
    radiated: Floats = scale * a1 * a2 * shape
    return radiated


def _slenderness(hull: MainDimensions) -> float:
    """ln(B / T)."""
    return float(log(max(hull.B / hull.T, 2.0)))


def _reduced_frequency(
    omega: Floats, chi: Floats, hull: MainDimensions, U: float
) -> Floats:
    """Frequency of the waves by that of the largest resistance."""
    L, _, _, CB = hull
    Fr = U / sqrt(GRAVITY * L)
    fullness = (CB / 0.65) ** 0.17
    slender = _slenderness(hull) - log(2.75)
    fineness = 1.0 - 0.111 / CB * slender
    head_on = abs(cos(chi))
    by_speed = (-1.377 * Fr**2 + 1.157 * Fr) * head_on
    by_direction = 0.618 * (13.0 + cos(2.0 * chi)) / 14.0

    k_yy = PITCH_GYRADIUS
    period = sqrt(L / (2.0 * pi * GRAVITY))
    unit = k_yy ** (1 / 3) * period
    scale = 2.142 * unit * fullness * fineness
    factor = by_speed + by_direction
    reduced: Floats = scale * factor * omega
    return reduced


def _amplitudes(
    omega: Floats, chi: Floats, hull: MainDimensions, U: float
) -> tuple[Floats, Floats]:
    """Factors a1 and a2.

    Given for waves from ahead to abeam and from astern, linear in the angle between.
    """
    Fr = U / sqrt(GRAVITY * hull.L)
    c = np.maximum(cos(chi), 0.0)
    fuller = (0.87 / hull.CB) ** ((1.0 + Fr) * c)
    a1_ahead = fuller * (1.0 + 2.0 * c) / 3.0
    a2_ahead = speed_factor(Fr)
    a1_astern, a2_astern = _amplitudes_astern(
        omega,
        hull,
        U,
    )

    astern = np.clip(chi / (0.5 * pi) - 1.0, 0.0, 1.0)
    ahead = 1.0 - astern
    a1 = ahead * a1_ahead + astern * a1_astern
    a2 = ahead * a2_ahead + astern * a2_astern
    return a1 / _slenderness(hull), a2


def _amplitudes_astern(
    omega: Floats, hull: MainDimensions, U: float
) -> tuple[Floats, Floats]:
    """Factors a1, still times the slenderness, and a2 in waves from astern."""
    bluntness = 0.87 / hull.CB
    group_velocity = GRAVITY / (2.0 * omega)
    faster = U - group_velocity
    Fr_over = np.maximum(faster / sqrt(GRAVITY * hull.L), 0.0)
    fuller = bluntness ** (1.0 + Fr_over)
    a1 = where(Fr_over >= 0.12, fuller, bluntness)

    overtaking = speed_factor(Fr_over)
    overtaken = 0.0072 * (2.0 * U / group_velocity - 1.0)
    a2 = where(group_velocity < U, overtaking, overtaken)
    return a1, a2


def speed_factor(Fr: ArrayLike) -> Floats:
    """Factor a2 by the Froude number, equation G-18."""
    Fr = np.asarray(Fr, dtype=float)
    slow = 0.0072 + 0.1676 * Fr
    fast = Fr**1.5 * exp(-3.5 * Fr)
    return where(Fr < 0.12, slow, fast)


def _reflected(
    omega: Floats, chi: Floats, hull: MainDimensions, E: float, U: float
) -> Floats:
    """Part of the reflection at bow and stern by rho g, equations G-23 to G-31."""
    L, B, T, CB = hull
    c = cos(chi)

    def side(alpha: Floats) -> Floats:
        angle = E + alpha
        met = c - cos(E) * cos(angle)
        by_speed = 2.0 * omega * U / GRAVITY * met
        reflection: Floats = sin(angle) ** 2 + by_speed
        return reflection

    near = side(chi)
    far = side(-chi)
    near_bow = where(chi <= pi - E, near, 0.0)
    far_bow = where(chi <= E, far, 0.0)
    near_stern = where(chi >= E, far, 0.0)
    far_stern = where(chi >= pi - E, near, 0.0)

    Fr = U / sqrt(GRAVITY * L)
    ahead = where(chi <= E, c, 0.0)
    power = (1.0 + 4.0 * sqrt(Fr)) * ahead
    bluntness = (0.87 / CB) ** power
    bow = _taken_up(omega, T, L) * bluntness * (near_bow + far_bow)

    root = sqrt(abs(c))
    stern_draught = T * (2.0 + root) / 3.0
    if CB <= 0.75:
        stern_draught = T * (4.0 + root) / 5.0
    stern = _taken_up(omega, stern_draught, L) * (near_stern + far_stern)
    reflected: Floats = 2.25 / 4.0 * B * (bow - stern)
    return reflected


def _taken_up(omega: Floats, draught: Floats | float, length: float) -> Floats:
    """Part of the waves that an end of some draught reflects; 0 for long waves."""
    wave_length = 2.0 * pi * GRAVITY / omega**2
    longest = 2.5 * length
    depth = draught / wave_length - draught / longest
    passed = exp(-4.0 * pi * depth)
    return where(wave_length <= longest, 1.0 - passed, 0.0)
