"""First-order heading in waves, and the slope of the waves that rolls a ship."""

from numpy import cos, exp, pi, sin, sinc, trapezoid
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.sea.conditions import Waves
from shipgym.sea.estimates import weather_particulars
from shipgym.sea.harmonics import half_circle, mirrored
from shipgym.sea.waves import (
    frequencies,
    over_directions,
    wave_number,
    wave_spectrum,
)
from shipgym.ships.particulars import Particulars, main_dimensions


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

    hull = main_dimensions(particulars)
    k = wave_number(omega)
    q = abs(0.5 * k * hull.L * cos(chi))
    attenuation = exp(-0.5 * k * hull.T)
    sideways = abs(sin(chi)) * attenuation
    over_length = abs(spherical_jn(1, q))
    return sideways * 6.0 / hull.L * over_length


def effective_wave_slope(
    omega: ArrayLike, chi: ArrayLike, particulars: Particulars
) -> Floats:
    """Slope of the waves across a hull, averaged over it, by their amplitude, rad/m.

    k |sin chi| exp(-k T / 2), averaged over length and beam; its moment is that of a
    heel so large (Conolly 1969, Rolling and its stabilisation by active fins,
    Transactions of RINA 111; Lloyd 1989, Seakeeping). In long waves it is the wave
    slope across the ship. Arguments are those of :func:`heading_response`.
    """
    hull = main_dimensions(particulars)
    k = wave_number(omega)
    sine = sin(chi)
    cosine = cos(chi)
    half_k = 0.5 * k
    over_length = sinc(half_k * hull.L * cosine / pi)
    over_beam = sinc(half_k * hull.B * sine / pi)
    across = abs(sine * over_length * over_beam)
    attenuation = exp(-half_k * hull.T)
    return k * across * attenuation


def wave_motion(waves: Waves, particulars: Particulars) -> tuple[Floats, Floats]:
    """Variance of wave-induced heading and of the slope that rolls the ship, rad2.

    Over the direction of the waves, :func:`shipgym.sea.harmonics.circle`.

    Particulars are estimated where absent, as in :func:`shipgym.sea.wave_drift`.
    """
    ship = weather_particulars(particulars)
    chi = half_circle()[:, None]
    omega = frequencies(waves)
    spectrum = wave_spectrum(waves, omega)

    def variance(response: Floats) -> Floats:
        in_long_crests = trapezoid(response**2 * spectrum, omega, axis=-1)
        return over_directions(mirrored(in_long_crests), waves)

    heading = variance(heading_response(omega, chi, ship))
    return heading, variance(effective_wave_slope(omega, chi, ship))
