"""First-order heading and roll in waves: closed-form transfer functions, integrated over the spectrum."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.sea.conditions import Waves
from shipgym.sea.estimates import GRAVITY, weather_particulars
from shipgym.sea.harmonics import circle, cosine_series, mirrored
from shipgym.sea.waves import (
    encounter_frequency,
    frequencies,
    over_directions,
    wave_spectrum,
)
from shipgym.ships.particulars import Particulars

#: Relative damping of roll of a ship under way, with bilge keels (0.05 to 0.15 in the
#: literature).
ROLL_DAMPING = 0.1


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

    L, T = particulars.length, particulars.require("draught")
    k = np.asarray(omega, dtype=float) ** 2 / GRAVITY
    q = np.abs(0.5 * k * L * np.cos(chi))
    return (
        np.abs(np.sin(chi))
        * np.exp(-0.5 * k * T)
        * 6.0
        / L
        * np.abs(spherical_jn(1, q))
    )


def roll_response(
    omega: ArrayLike, chi: ArrayLike, particulars: Particulars, speed: float
) -> Floats:
    """Amplitude of roll by wave amplitude, rad/m; arguments as in :func:`heading_response`, speed in m/s.

    A linear oscillator driven by the effective wave slope: k |sin chi| exp(-k T / 2),
    averaged over length and beam, times the amplification 1 / sqrt((1 - a^2)^2 + (2 z
    a)^2), a = encounter by natural frequency (Conolly 1969, Rolling and its
    stabilisation by active fins, Transactions of RINA 111; Lloyd 1989, Seakeeping). In
    long waves it is the wave slope across the ship.
    """
    L, B, T = (
        particulars.length,
        particulars.require("beam"),
        particulars.require("draught"),
    )
    k = np.asarray(omega, dtype=float) ** 2 / GRAVITY
    along, across = 0.5 * k * L * np.cos(chi) / np.pi, 0.5 * k * B * np.sin(chi) / np.pi
    slope = (
        k
        * np.abs(np.sin(chi) * np.sinc(along) * np.sinc(across))
        * np.exp(-0.5 * k * T)
    )
    natural = 2.0 * np.pi / particulars.require("roll_period")
    a = encounter_frequency(omega, speed, chi) / natural
    return slope / np.hypot(1.0 - a * a, 2.0 * ROLL_DAMPING * a)


@dataclass(frozen=True)
class WaveMotion:
    """Variance of wave-induced heading and roll over the direction of the waves."""

    # shape (points,), 0 to below 2 pi; where waves come from, seen from the bow, pi / 2
    # from starboard; rad
    chi: Floats
    # shape (points,); rad2
    heading_variance: Floats
    roll_variance: Floats
    estimated: tuple[
        str, ...
    ] = ()  # names of the particulars that were estimated for it

    def heading_variance_harmonics(self, n: int = 8) -> Floats:
        """Cosine series of the heading's variance, mean first, shape (n + 1,).

        A sum may be slightly negative where the variance is 0 (waves from ahead and
        astern): clip it there.
        """
        return cosine_series(self.heading_variance, n)

    def roll_variance_harmonics(self, n: int = 8) -> Floats:
        """Cosine series of the roll's variance, mean first, shape (n + 1,); to be clipped at 0 as well."""
        return cosine_series(self.roll_variance, n)


def wave_motion(
    waves: Waves, particulars: Particulars, speed: float | None = None
) -> WaveMotion:
    """Variance of wave-induced heading and roll for waves from all directions; see `wave_drift`.

    Roll meets the waves at `speed`, m/s, by default that of service, or 0 where that is
    not known.
    """
    ship = weather_particulars(particulars)
    chi = circle()
    quarter = chi[: len(chi) // 2 + 1]  # symmetric: port as starboard
    omega = frequencies(waves)
    spectrum = wave_spectrum(waves, omega)
    U = (ship.speed or 0.0) if speed is None else speed
    heading = heading_response(omega, quarter[:, None], ship)
    roll = roll_response(omega, quarter[:, None], ship, U)
    heading_variance, roll_variance = (
        over_directions(
            mirrored(np.trapezoid(response**2 * spectrum, omega, axis=-1)), waves
        )
        for response in (heading, roll)
    )
    used = {"metacentric_height", "roll_period", "block_coefficient"}
    return WaveMotion(
        chi, heading_variance, roll_variance, tuple(sorted(ship.estimated & used))
    )
