"""Mean second-order wave forces on a ship, over the direction of the waves."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.sea.conditions import Waves
from shipgym.sea.estimates import GRAVITY, weather_particulars
from shipgym.sea.harmonics import (
    Harmonics,
    circle,
    cosine_series,
    mirrored,
    sine_series,
)
from shipgym.sea.waves import (
    draught_attenuation,
    frequencies,
    over_directions,
    slow_drift,
    wave_spectrum,
)
from shipgym.ships.particulars import Particulars

_PITCH_GYRADIUS = 0.25  # by length
_WATERLINE_POINTS = 401
_FASTEST = (
    0.4  # Froude number up to which the added resistance is taken to depend on speed
)
_NARROWEST = 2.0  # beam by draught, likewise


@dataclass(frozen=True)
class WaveDrift:
    """Mean wave drift over the direction of the waves, and its slow variation.

    The force at any time is the mean one times (1 + s), s the Gauss-Markov process that
    is given here.
    """

    # shape (points,), 0 to below 2 pi; where waves come from, seen from the bow, pi / 2
    # from starboard; rad
    chi: Floats
    # shape (points,); mean surge and sway force, N. Waves from starboard push to port:
    # Y < 0
    X: Floats
    Y: Floats
    # shape (points,); mean yaw moment about midship, positive to starboard, N m
    N: Floats
    # of the slow variation, s and without unit
    time_constant: float
    standard_deviation: float
    estimated: tuple[
        str, ...
    ] = ()  # names of the particulars that were estimated for it

    def harmonics(self, n: int = 8) -> Harmonics:
        """Fourier series up to the n-th harmonic, for kernels; there is no heeling moment (K is 0)."""
        Y, N = (sine_series(curve, n) for curve in (self.Y, self.N))
        return Harmonics(cosine_series(self.X, n), Y, N, np.zeros(n))


def wave_drift(
    waves: Waves, particulars: Particulars, speed: float | None = None
) -> WaveDrift:
    """Mean second-order forces in an irregular sea from all directions: 2 integral S(w) F(w) / a^2 dw.

    Surge by :func:`added_resistance`, sway and yaw by :func:`reflection_coefficients`;
    the direction of the waves does not matter here. Particulars are estimated where
    absent (:func:`shipgym.sea.estimates.weather_particulars`), InputError if they are
    too few; speed in m/s, by default that of service, or 0 where that is not known.
    """
    ship = weather_particulars(particulars)
    U = (ship.speed or 0.0) if speed is None else speed
    chi = circle()
    half = chi[: len(chi) // 2 + 1]
    omega = frequencies(waves)
    spectrum = wave_spectrum(waves, omega)
    resistance = added_resistance(omega, half[:, None], ship, U)
    X = -2.0 * np.trapezoid(resistance * spectrum, omega, axis=-1)
    sway, yaw = reflection_coefficients(half, ship)
    share = draught_attenuation(omega, ship.require("draught"))
    density = ship.require("water_density")
    mean = (
        density * GRAVITY * float(np.trapezoid(share * spectrum, omega))
    )  # 2 * rho g / 2 * ...
    Y, N = sway * ship.length * mean, yaw * ship.length**2 * mean
    curves = (mirrored(X), mirrored(Y, -1.0), mirrored(N, -1.0))
    X, Y, N = (over_directions(curve, waves) for curve in curves)
    used = {"block_coefficient", "water_density"}
    return WaveDrift(
        chi, X, Y, N, *slow_drift(waves, ship), tuple(sorted(ship.estimated & used))
    )


def waterline(ship: Particulars) -> tuple[Floats, Floats]:
    """Half of a waterline y = (B / 2) (1 - |2 x / L|^p) from bow to stern, the same fore and aft.

    Points x forward of midship and y outward, m. The waterplane coefficient, waterplane
    area by length * beam, is p / (p + 1) and estimated as (1 + 2 CB) / 3 (Schneekluth &
    Bertram 1998, section 1.6).
    """
    cwp = (1.0 + 2.0 * ship.require("block_coefficient")) / 3.0
    power = cwp / (1.0 - cwp)
    xi = np.cos(np.linspace(0.0, np.pi, _WATERLINE_POINTS))
    return 0.5 * ship.length * xi, 0.5 * ship.require("beam") * (
        1.0 - np.abs(xi) ** power
    )


def end_angle(ship: Particulars) -> float:
    """Half angle of the waterline at bow and stern, estimated, rad.

    arctan(0.495 B / (L (1 - CP))): the run of Holtrop & Mennen 1982 (An approximate
    power prediction method, International Shipbuilding Progress 29) with the centre of
    buoyancy at midship, and an entrance as long. CP = CB / CM with the midship
    coefficient CM = 1.006 - 0.0056 CB^(-3.56) of Kerlen 1970.
    """
    CB = ship.require("block_coefficient")
    CP = min(CB / (1.006 - 0.0056 * CB**-3.56), 0.95)
    return float(np.arctan(0.495 * ship.require("beam") / (ship.length * (1.0 - CP))))


def reflection_coefficients(chi: ArrayLike, ship: Particulars) -> tuple[Floats, Floats]:
    """Sway force and yaw moment of short waves that a vertical-sided ship at rest reflects.

    Faltinsen 1990, Sea Loads, equation 5.27 (Faltinsen et al. 1980): each part of the
    waterline that the waves can see takes up rho g a^2 / 2 times the square of the sine
    of the angle at which they meet it, along its inward normal. `chi`, rad, is where
    they come from, seen from the bow. Returns Y by rho g a^2 L / 2 and N about midship
    by rho g a^2 L^2 / 2.
    """
    line = np.array(waterline(ship))
    x, half = 0.5 * (line[:, 1:] + line[:, :-1])  # middle of each part
    dx, dy = np.diff(line)
    length = np.hypot(dx, dy)
    Y, N = np.zeros(np.shape(chi)), np.zeros(np.shape(chi))
    for side in (1.0, -1.0):
        out_x, out_y, y = (
            dy / length,
            -side * dx / length,
            side * half,
        )  # outward normal of the side
        toward = np.multiply.outer(np.cos(chi), out_x) + np.multiply.outer(
            np.sin(chi), out_y
        )
        pressure = np.maximum(toward, 0.0) ** 2 * length
        Y = Y - pressure @ out_y
        N = N - pressure @ (x * out_y - y * out_x)
    return Y / ship.length, N / ship.length**2


def added_resistance(
    omega: ArrayLike, chi: ArrayLike, ship: Particulars, speed: float
) -> Floats:
    """Mean resistance in regular waves by squared amplitude, from all directions, N/m2; negative: a push.

    The sum of what the ship's motions radiate and what its ends reflect: the SNNM
    formula of ITTC Recommended Procedure 7.5-04-01-01.1 (2021), appendix G; Liu &
    Papanikolaou 2020, Regression analysis of experimental data for added resistance in
    waves of arbitrary heading, Ocean Engineering 206. On even keel, with the angle of
    :func:`end_angle`. It stands for ships of 75 to 400 m with L/B 4 to 9, B/T 2 to 9,
    CB 0.5 to 0.9 and Froude numbers up to 0.3; B/T counts as at least 2, the Froude
    number as at most 0.4. `omega`, rad/s, is of the waves; `chi`, 0 to pi, where they
    come from, seen from the bow; `speed`, m/s, the ship's.
    """
    speed = min(speed, _FASTEST * float(np.sqrt(GRAVITY * ship.length)))
    omega, chi = np.broadcast_arrays(
        np.asarray(omega, dtype=float), np.asarray(chi, dtype=float)
    )
    return _radiated(omega, chi, ship, speed) + _reflected(omega, chi, ship, speed)


def _radiated(omega: Floats, chi: Floats, ship: Particulars, speed: float) -> Floats:
    """Part of the ship's motions, equations G-14 to G-22."""
    L, B, CB = ship.length, ship.require("beam"), ship.require("block_coefficient")
    slender = np.log(max(B / ship.require("draught"), _NARROWEST))
    Fr, c = speed / np.sqrt(GRAVITY * L), np.cos(chi)
    w = (
        2.142
        * _PITCH_GYRADIUS ** (1 / 3)
        * np.sqrt(L / (2.0 * np.pi * GRAVITY))
        * (CB / 0.65) ** 0.17
        * (1.0 - 0.111 / CB * (slender - np.log(2.75)))
        * (
            (-1.377 * Fr**2 + 1.157 * Fr) * np.abs(c)
            + 0.618 * (13.0 + np.cos(2.0 * chi)) / 14.0
        )
        * omega
    )
    a1, a2 = _amplitudes(omega, chi, CB, slender, speed, Fr)
    b1 = np.where(w < 1.0, 11.0, -8.5)
    d1 = np.where(
        w < 1.0, 566.0 * (L * CB / B) ** -2.66, -566.0 * (L / B) ** -2.66 * 4.0
    )
    scale = (
        3859.2
        * ship.require("water_density")
        * GRAVITY
        * B**2
        / L
        * CB**1.34
        * _PITCH_GYRADIUS**2
    )
    with np.errstate(over="ignore", under="ignore"):
        shape = np.exp(b1 * np.log(w) + b1 / d1 * (1.0 - w**d1))
    return np.asarray(scale * a1 * a2 * shape)


def _amplitudes(
    omega: Floats, chi: Floats, CB: float, slender: float, speed: float, Fr: float
) -> tuple[Floats, Floats]:
    """Factors a1 and a2: given for waves from ahead to abeam and from astern, linear in the angle between."""
    c = np.maximum(np.cos(chi), 0.0)
    waves = GRAVITY / (2.0 * omega)  # group velocity, m/s
    overtaking = np.where(
        waves > 0, (speed - waves) / (speed / Fr if Fr > 0.0 else 1.0), 0.0
    )
    ahead1, ahead2 = (
        (0.87 / CB) ** ((1.0 + Fr) * c) * (1.0 + 2.0 * c) / 3.0,
        _speed_factor(np.array(Fr)),
    )
    faster, over = speed > waves, np.maximum(overtaking, 0.0)
    astern1 = np.where(
        faster & (overtaking >= 0.12), (0.87 / CB) ** (1.0 + over), 0.87 / CB
    )
    astern2 = np.where(
        faster, _speed_factor(over), 0.0072 * (2.0 * speed / waves - 1.0)
    )
    part = np.clip(chi / (0.5 * np.pi) - 1.0, 0.0, 1.0)
    a1 = ((1.0 - part) * ahead1 + part * astern1) / slender
    a2 = (1.0 - part) * ahead2 + part * astern2
    return a1, a2


def _speed_factor(Fr: Floats) -> Floats:
    return np.where(Fr < 0.12, 0.0072 + 0.1676 * Fr, Fr**1.5 * np.exp(-3.5 * Fr))


def _reflected(omega: Floats, chi: Floats, ship: Particulars, speed: float) -> Floats:
    """Part of the reflection at bow and stern, equations G-23 to G-31."""
    L, T, CB = ship.length, ship.require("draught"), ship.require("block_coefficient")
    E, Fr, c = end_angle(ship), speed / np.sqrt(GRAVITY * L), np.cos(chi)
    length = 2.0 * np.pi * GRAVITY / omega**2

    def depth(T_: Floats) -> Floats:
        return np.where(
            length <= 2.5 * L,
            1.0 - np.exp(-4.0 * np.pi * (T_ / length - T_ / (2.5 * L))),
            0.0,
        )

    def flat(angle: Floats) -> Floats:
        met = c - np.cos(E) * np.cos(E + angle)
        return np.asarray(np.sin(E + angle) ** 2 + 2.0 * omega * speed / GRAVITY * met)

    blunt = (0.87 / CB) ** ((1.0 + 4.0 * np.sqrt(Fr)) * np.where(chi <= E, c, 0.0))
    root = np.sqrt(np.abs(c))
    stern = T * (4.0 + root) / 5.0 if CB <= 0.75 else T * (2.0 + root) / 3.0
    bow = (
        depth(np.asarray(T))
        * blunt
        * (
            np.where(chi <= np.pi - E, flat(chi), 0.0)
            + np.where(chi <= E, flat(-chi), 0.0)
        )
    )
    aft = depth(stern) * (
        np.where(chi >= E, flat(-chi), 0.0) + np.where(chi >= np.pi - E, flat(chi), 0.0)
    )
    scale = 2.25 / 4.0 * ship.require("water_density") * GRAVITY * ship.require("beam")
    return np.asarray(scale * (bow - aft))
