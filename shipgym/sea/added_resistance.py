"""Added resistance in regular waves of any direction: the SNNM formula of the ITTC."""

import numpy as np
from numpy import cos, exp, log, pi, sin, sqrt, where
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.constants import GRAVITY
from shipgym.sea.estimates import Hull, hull_of
from shipgym.ships.particulars import Particulars

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
    hull = hull_of(ship)
    U = min(speed, 0.4 * float(sqrt(GRAVITY * hull.L)))
    omega = np.asarray(omega, dtype=float)
    chi = np.asarray(chi, dtype=float)
    omega, chi = np.broadcast_arrays(omega, chi)
    radiated = _radiated(omega, chi, hull, U)
    reflected = _reflected(omega, chi, hull, end_angle(ship), U)
    return ship.require("water_density") * GRAVITY * (radiated + reflected)


def end_angle(ship: Particulars) -> float:
    """Half angle of the waterline at bow and stern, estimated, rad.

    arctan(0.495 B / (L (1 - CP))): the run of Holtrop & Mennen 1982 (An approximate
    power prediction method, International Shipbuilding Progress 29) with the centre of
    buoyancy at midship, and an entrance as long. CP = CB / CM with the midship
    coefficient CM = 1.006 - 0.0056 CB^(-3.56) of Kerlen 1970.
    """
    L, B, _, CB = hull_of(ship)
    CM = 1.006 - 0.0056 * CB**-3.56
    CP = min(CB / CM, 0.95)
    return float(np.arctan(0.495 * B / (L * (1.0 - CP))))


def _radiated(omega: Floats, chi: Floats, hull: Hull, U: float) -> Floats:
    """Part of the ship's motions by rho g, equations G-14 to G-22.

    3859.2 B^2 / L CB^1.34 k_yy^2 a1 a2 w^b1 exp(b1 / d1 (1 - w^d1))
    """
    L, B, _, CB = hull
    w = _reduced_frequency(omega, chi, hull, U)
    a1, a2 = _amplitudes(omega, chi, hull, U)

    below_peak = w < 1.0
    b1 = where(below_peak, 11.0, -8.5)
    d1_below = 566.0 * (L * CB / B) ** -2.66
    d1_above = -566.0 * (L / B) ** -2.66 * 4.0
    d1 = where(below_peak, d1_below, d1_above)
    with np.errstate(over="ignore", under="ignore"):
        shape = exp(b1 * log(w) + b1 / d1 * (1.0 - w**d1))

    scale = 3859.2 * B**2 / L * CB**1.34 * PITCH_GYRADIUS**2
    radiated: Floats = scale * a1 * a2 * shape
    return radiated


def _slenderness(hull: Hull) -> float:
    """ln(B / T)."""
    return float(log(max(hull.B / hull.T, 2.0)))


def _reduced_frequency(omega: Floats, chi: Floats, hull: Hull, U: float) -> Floats:
    """Frequency of the waves by that of the largest resistance."""
    L, _, _, CB = hull
    Fr = U / sqrt(GRAVITY * L)
    fullness = (CB / 0.65) ** 0.17
    fineness = 1.0 - 0.111 / CB * (_slenderness(hull) - log(2.75))
    by_speed = (-1.377 * Fr**2 + 1.157 * Fr) * abs(cos(chi))
    by_direction = 0.618 * (13.0 + cos(2.0 * chi)) / 14.0

    unit = PITCH_GYRADIUS ** (1 / 3) * sqrt(L / (2.0 * pi * GRAVITY))
    per_omega = 2.142 * unit * fullness * fineness * (by_speed + by_direction)
    reduced: Floats = per_omega * omega
    return reduced


def _amplitudes(
    omega: Floats, chi: Floats, hull: Hull, U: float
) -> tuple[Floats, Floats]:
    """Factors a1 and a2.

    Given for waves from ahead to abeam and from astern, linear in the angle between.
    """
    unit = sqrt(GRAVITY * hull.L)
    Fr = U / unit
    bluntness = 0.87 / hull.CB
    c = np.maximum(cos(chi), 0.0)
    a1_ahead = bluntness ** ((1.0 + Fr) * c) * (1.0 + 2.0 * c) / 3.0
    a2_ahead = speed_factor(Fr)

    group_velocity = GRAVITY / (2.0 * omega)
    Fr_over = np.maximum((U - group_velocity) / unit, 0.0)
    a1_astern = where(Fr_over >= 0.12, bluntness ** (1.0 + Fr_over), bluntness)
    a2_overtaken = 0.0072 * (2.0 * U / group_velocity - 1.0)
    a2_astern = where(group_velocity < U, speed_factor(Fr_over), a2_overtaken)

    astern = np.clip(chi / (0.5 * pi) - 1.0, 0.0, 1.0)
    a1 = (1.0 - astern) * a1_ahead + astern * a1_astern
    a2 = (1.0 - astern) * a2_ahead + astern * a2_astern
    return a1 / _slenderness(hull), a2


def speed_factor(Fr: ArrayLike) -> Floats:
    """Factor a2 by the Froude number, equation G-18."""
    Fr = np.asarray(Fr, dtype=float)
    slow = 0.0072 + 0.1676 * Fr
    fast = Fr**1.5 * exp(-3.5 * Fr)
    return where(Fr < 0.12, slow, fast)


def _reflected(omega: Floats, chi: Floats, hull: Hull, E: float, U: float) -> Floats:
    """Part of the reflection at bow and stern by rho g, equations G-23 to G-31."""
    L, B, T, CB = hull
    c = cos(chi)
    wave_length = 2.0 * pi * GRAVITY / omega**2
    longest = 2.5 * L

    def by_draught(draught: Floats | float) -> Floats:
        depth = draught / wave_length - draught / longest
        taken_up = 1.0 - exp(-4.0 * pi * depth)
        return where(wave_length <= longest, taken_up, 0.0)

    def side(alpha: Floats) -> Floats:
        met = c - cos(E) * cos(E + alpha)
        reflection: Floats = sin(E + alpha) ** 2 + 2.0 * omega * U / GRAVITY * met
        return reflection

    near_bow = where(chi <= pi - E, side(chi), 0.0)
    far_bow = where(chi <= E, side(-chi), 0.0)
    near_stern = where(chi >= E, side(-chi), 0.0)
    far_stern = where(chi >= pi - E, side(chi), 0.0)

    Fr = U / sqrt(GRAVITY * L)
    ahead = where(chi <= E, c, 0.0)
    bluntness = (0.87 / CB) ** ((1.0 + 4.0 * sqrt(Fr)) * ahead)
    bow = by_draught(T) * bluntness * (near_bow + far_bow)

    root = sqrt(abs(c))
    stern_draught = T * (4.0 + root) / 5.0 if CB <= 0.75 else T * (2.0 + root) / 3.0
    stern = by_draught(stern_draught) * (near_stern + far_stern)
    reflected: Floats = 2.25 / 4.0 * B * (bow - stern)
    return reflected
