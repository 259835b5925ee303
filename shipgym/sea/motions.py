"""First-order heading and roll in waves: closed-form responses over the spectrum."""

from dataclasses import dataclass

import numpy as np
from numpy import cos, exp, pi, sin, sinc, trapezoid
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.sea.conditions import Waves
from shipgym.sea.estimates import Hull, hull_of, weather_particulars
from shipgym.sea.harmonics import circle, half_circle, mirrored
from shipgym.sea.waves import (
    encounter_frequency,
    frequencies,
    over_directions,
    wave_number,
    wave_spectrum,
)
from shipgym.ships.particulars import Particulars


def heading_response(
    omega: ArrayLike, chi: ArrayLike, particulars: Particulars
) -> Floats:
    """Amplitude of wave-induced heading by wave amplitude, rad/m.

    The hull follows the sideways motion of the water at half its draught, averaged over
    its length with the lever as weight: |sin chi| exp(-k T / 2) (6 / L) |j1(q)| with q
    = k L cos(chi) / 2 and the spherical Bessel function j1. In long waves this is k
    |sin chi cos chi|. It is the motion at wave frequency (`omega`, rad/s), for which
    the ship's speed does not matter; the slow yaw of a ship that runs before the sea is
    not in it. `chi` is where the waves come from, seen from the bow, rad.
    """
    from scipy.special import spherical_jn

    hull = hull_of(particulars)
    k = wave_number(omega)
    q = abs(0.5 * k * hull.L * cos(chi))
    attenuation = exp(-0.5 * k * hull.T)
    sideways = abs(sin(chi)) * attenuation
    over_length = abs(spherical_jn(1, q))
    return sideways * 6.0 / hull.L * over_length


def roll_response(
    omega: ArrayLike, chi: ArrayLike, particulars: Particulars, speed: float
) -> Floats:
    """Amplitude of roll by wave amplitude, rad/m.

    A linear oscillator driven by the effective wave slope: k |sin chi| exp(-k T / 2),
    averaged over length and beam, times the amplification 1 / sqrt((1 - a^2)^2 + (2 z
    a)^2), a = encounter by natural frequency (Conolly 1969, Rolling and its
    stabilisation by active fins, Transactions of RINA 111; Lloyd 1989, Seakeeping). In
    long waves it is the wave slope across the ship. The relative damping z is 0.1, of
    a ship under way, with bilge keels (0.05 to 0.15 in the literature). Arguments are
    those of :func:`heading_response`, and the speed, m/s.
    """
    slope = _effective_wave_slope(omega, chi, hull_of(particulars))
    natural = 2.0 * pi / particulars.require("roll_period")
    a = encounter_frequency(omega, speed, chi) / natural
    z = 0.1
    return slope / np.hypot(1.0 - a * a, 2.0 * z * a)


def _effective_wave_slope(omega: ArrayLike, chi: ArrayLike, hull: Hull) -> Floats:
    """Slope of the waves across a hull, averaged over it, by their amplitude, rad/m."""
    k = wave_number(omega)
    sine = sin(chi)
    cosine = cos(chi)
    half_k = 0.5 * k
    over_length = sinc(half_k * hull.L * cosine / pi)
    over_beam = sinc(half_k * hull.B * sine / pi)
    across = abs(sine * over_length * over_beam)
    attenuation = exp(-half_k * hull.T)
    return k * across * attenuation


@dataclass(frozen=True)
class WaveMotion:
    """Variance of wave-induced heading and roll over the direction of the waves."""

    # shape (points,), 0 to below 2 pi; where waves come from, seen from the bow, pi / 2
    # from starboard; rad
    chi: Floats
    # shape (points,); rad2
    heading_variance: Floats
    roll_variance: Floats


def wave_motion(waves: Waves, particulars: Particulars) -> WaveMotion:
    """Variance of wave-induced heading and roll for waves from all directions.

    Particulars are estimated where absent, as in :func:`shipgym.sea.wave_drift`. Roll
    meets the waves at service speed, or 0 where that is not known.
    """
    ship = weather_particulars(particulars)
    U = ship.speed or 0.0
    chi = half_circle()[:, None]
    omega = frequencies(waves)
    spectrum = wave_spectrum(waves, omega)

    def variance(response: Floats) -> Floats:
        in_long_crests = trapezoid(response**2 * spectrum, omega, axis=-1)
        return over_directions(mirrored(in_long_crests), waves)

    return WaveMotion(
        circle(),
        heading_variance=variance(heading_response(omega, chi, ship)),
        roll_variance=variance(roll_response(omega, chi, ship, U)),
    )
