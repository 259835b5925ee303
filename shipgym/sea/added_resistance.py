"""Added resistance in regular waves of any direction: the SNNM formula of the ITTC."""

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.sea.estimates import GRAVITY
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
    fastest = 0.4 * float(np.sqrt(GRAVITY * ship.length))
    U = min(speed, fastest)
    omega = np.asarray(omega, dtype=float)
    chi = np.asarray(chi, dtype=float)
    omega, chi = np.broadcast_arrays(omega, chi)
    return _radiated(omega, chi, ship, U) + _reflected(omega, chi, ship, U)


def end_angle(ship: Particulars) -> float:
    """Half angle of the waterline at bow and stern, estimated, rad.

    arctan(0.495 B / (L (1 - CP))): the run of Holtrop & Mennen 1982 (An approximate
    power prediction method, International Shipbuilding Progress 29) with the centre of
    buoyancy at midship, and an entrance as long. CP = CB / CM with the midship
    coefficient CM = 1.006 - 0.0056 CB^(-3.56) of Kerlen 1970.
    """
    CB = ship.require("block_coefficient")
    CM = 1.006 - 0.0056 * CB**-3.56
    CP = min(CB / CM, 0.95)
    return float(np.arctan(0.495 * ship.require("beam") / (ship.length * (1.0 - CP))))


def _radiated(omega: Floats, chi: Floats, ship: Particulars, U: float) -> Floats:
    """Part of the ship's motions, equations G-14 to G-22.

    3859.2 rho g B^2 / L CB^1.34 k_yy^2 a1 a2 w^b1 exp(b1 / d1 (1 - w^d1))
    """
    L = ship.length
    B = ship.require("beam")
    CB = ship.require("block_coefficient")
    w = _reduced_frequency(omega, chi, ship, U)
    a1, a2 = _amplitudes(omega, chi, ship, U)

    below_peak = w < 1.0
    b1 = np.where(below_peak, 11.0, -8.5)
    d1_below = 566.0 * (L * CB / B) ** -2.66
    d1_above = -566.0 * (L / B) ** -2.66 * 4.0
    d1 = np.where(below_peak, d1_below, d1_above)
    with np.errstate(over="ignore", under="ignore"):
        shape = np.exp(b1 * np.log(w) + b1 / d1 * (1.0 - w**d1))

    pressure = ship.require("water_density") * GRAVITY
    scale = 3859.2 * pressure * B**2 / L * CB**1.34 * PITCH_GYRADIUS**2
    return np.asarray(scale * a1 * a2 * shape)


def _slenderness(ship: Particulars) -> float:
    """ln(B / T)."""
    return float(np.log(max(ship.require("beam") / ship.require("draught"), 2.0)))


def _reduced_frequency(
    omega: Floats, chi: Floats, ship: Particulars, U: float
) -> Floats:
    """Frequency of the waves by that of the largest resistance."""
    L = ship.length
    CB = ship.require("block_coefficient")
    Fr = U / np.sqrt(GRAVITY * L)
    by_form = (CB / 0.65) ** 0.17
    by_form *= 1.0 - 0.111 / CB * (_slenderness(ship) - np.log(2.75))
    by_speed = (-1.377 * Fr**2 + 1.157 * Fr) * np.abs(np.cos(chi))
    by_direction = 0.618 * (13.0 + np.cos(2.0 * chi)) / 14.0

    unit = PITCH_GYRADIUS ** (1 / 3) * np.sqrt(L / (2.0 * np.pi * GRAVITY))
    return np.asarray(2.142 * unit * by_form * (by_speed + by_direction) * omega)


def _amplitudes(
    omega: Floats, chi: Floats, ship: Particulars, U: float
) -> tuple[Floats, Floats]:
    """Factors a1 and a2.

    Given for waves from ahead to abeam and from astern, linear in the angle between.
    """
    fullness = 0.87 / ship.require("block_coefficient")
    unit = np.sqrt(GRAVITY * ship.length)
    Fr = U / unit
    c = np.maximum(np.cos(chi), 0.0)
    a1_ahead = fullness ** ((1.0 + Fr) * c) * (1.0 + 2.0 * c) / 3.0
    a2_ahead = speed_factor(np.array(Fr))

    group_velocity = GRAVITY / (2.0 * omega)
    overtakes = group_velocity < U
    Fr_over = np.maximum((U - group_velocity) / unit, 0.0)
    a1_astern = np.where(Fr_over >= 0.12, fullness ** (1.0 + Fr_over), fullness)
    a2_behind = 0.0072 * (2.0 * U / group_velocity - 1.0)
    a2_astern = np.where(overtakes, speed_factor(Fr_over), a2_behind)

    astern = np.clip(chi / (0.5 * np.pi) - 1.0, 0.0, 1.0)
    a1 = (1.0 - astern) * a1_ahead + astern * a1_astern
    a2 = (1.0 - astern) * a2_ahead + astern * a2_astern
    return a1 / _slenderness(ship), a2


def speed_factor(Fr: Floats) -> Floats:
    """Factor a2 by the Froude number, equation G-18."""
    slow = 0.0072 + 0.1676 * Fr
    fast = Fr**1.5 * np.exp(-3.5 * Fr)
    return np.where(Fr < 0.12, slow, fast)


def _reflected(omega: Floats, chi: Floats, ship: Particulars, U: float) -> Floats:
    """Part of the reflection at bow and stern, equations G-23 to G-31."""
    L = ship.length
    T = ship.require("draught")
    CB = ship.require("block_coefficient")
    E = end_angle(ship)
    c = np.cos(chi)
    wave_length = 2.0 * np.pi * GRAVITY / omega**2
    longest = 2.5 * L

    def by_draught(draught: Floats | float) -> Floats:
        depth = draught / wave_length - draught / longest
        taken_up = 1.0 - np.exp(-4.0 * np.pi * depth)
        return np.where(wave_length <= longest, taken_up, 0.0)

    def side(alpha: Floats) -> Floats:
        met = c - np.cos(E) * np.cos(E + alpha)
        return np.asarray(np.sin(E + alpha) ** 2 + 2.0 * omega * U / GRAVITY * met)

    near_bow = np.where(chi <= np.pi - E, side(chi), 0.0)
    far_bow = np.where(chi <= E, side(-chi), 0.0)
    near_stern = np.where(chi >= E, side(-chi), 0.0)
    far_stern = np.where(chi >= np.pi - E, side(chi), 0.0)

    Fr = U / np.sqrt(GRAVITY * L)
    ahead = np.where(chi <= E, c, 0.0)
    bluntness = (0.87 / CB) ** ((1.0 + 4.0 * np.sqrt(Fr)) * ahead)
    bow = by_draught(T) * bluntness * (near_bow + far_bow)

    root = np.sqrt(np.abs(c))
    stern_draught = T * (4.0 + root) / 5.0 if CB <= 0.75 else T * (2.0 + root) / 3.0
    stern = by_draught(stern_draught) * (near_stern + far_stern)

    pressure = ship.require("water_density") * GRAVITY
    scale = 2.25 / 4.0 * pressure * ship.require("beam")
    return np.asarray(scale * (bow - stern))
