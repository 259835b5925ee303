"""Gust spectra of the wind over the sea, and their first-order filter."""

from math import gamma, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.sea.current_wind_waves import Wind

#: Surface drag coefficient of Harris's and Davenport's spectra for a rough sea.
SURFACE_DRAG = 0.003
LENGTH_SCALES = {"harris": 1800.0, "davenport": 1200.0}  # m
#: 2^(2/3) B(1/2, 1/3), with Euler's beta function.
HARRIS_VARIANCE = 2.0 ** (2.0 / 3.0) * (
    gamma(1.0 / 2.0) * gamma(1.0 / 3.0) / gamma(5.0 / 6.0)
)


class GaussMarkov(NamedTuple):
    """A first-order Gauss-Markov process of mean zero.

    Its autocorrelation is standard_deviation^2 exp(-|lag| / time_constant), its
    one-sided spectrum 4 s^2 T / (1 + (2 pi f T)^2) per Hz.
    """

    time_constant: float  # s
    standard_deviation: float  # in the units of the process

    def spectrum(self, frequency: ArrayLike) -> Floats:
        """One-sided spectral density at frequencies in Hz."""
        T = self.time_constant
        variance = self.standard_deviation**2
        f = np.asarray(frequency, dtype=float)
        omega = 2.0 * pi * f
        return 4.0 * variance * T / (1.0 + (omega * T) ** 2)


def gust_spectrum(
    frequency: ArrayLike, speed: float, spectrum: str = "harris"
) -> Floats:
    """One-sided spectral density of the wind speed about its mean, (m/s)^2 / Hz.

    It is that 10 m above the sea, for frequencies in Hz, above 0, and a mean speed V
    in m/s. With x = f L / V and the surface drag coefficient k:

    * Harris 1971: f S / (k V^2) = 4 x / (2 + x^2)^(5/6), L = 1800 m;
    * Davenport 1961: f S / (k V^2) = 4 x^2 / (1 + x^2)^(4/3), L = 1200 m;
    * NORSOK N-003 (2007), Froya spectrum: S = 320 (V/10)^2 / (1 + y^n)^(5/(3n)) with
      y = 172 f (V/10)^(-3/4), n = 0.468.
    """
    f = np.asarray(frequency, dtype=float)
    if spectrum == "norsok":
        return froya_spectrum(f, speed)

    L = LENGTH_SCALES[spectrum]
    x = f * L / speed
    if spectrum == "davenport":
        shape = x / (1.0 + x * x) ** (4.0 / 3.0)
    else:
        shape = (2.0 + x * x) ** (-5.0 / 6.0)
    return 4.0 * SURFACE_DRAG * speed * L * shape


def froya_spectrum(f: Floats, speed: float) -> Floats:
    """NORSOK's density at frequencies in Hz (`gust_spectrum`)."""
    n = 0.468
    power = 5.0 / (3.0 * n)
    relative = speed / 10.0
    y = 172.0 * f * relative**-0.75
    density: Floats = 320.0 * relative**2 / (1.0 + y**n) ** power
    return density


def froya_frequencies(number: int) -> Floats:
    """Frequencies over the band for which NORSOK N-003 gives its spectrum, Hz."""
    return np.geomspace(1.0 / 2400.0, 0.5, number)


def gust_variance(speed: float, spectrum: str = "harris") -> float:
    """Variance of the wind speed, the integral of :func:`gust_spectrum`, (m/s)^2.

    Harris: 2^(2/3) B(1/2, 1/3) k V^2 = 6.677 k V^2 (B is Euler's beta function);
    Davenport: 6 k V^2; NORSOK: over the band for which it is given.
    """
    if spectrum == "norsok":
        f = froya_frequencies(400)
        energy = f * froya_spectrum(f, speed)
        return float(np.trapezoid(energy, np.log(f)))
    factor = HARRIS_VARIANCE if spectrum == "harris" else 6.0
    return factor * SURFACE_DRAG * speed**2


def gust_filter(wind: Wind) -> GaussMarkov:
    """First-order process with the gusts' variance and most energetic frequency.

    f S(f) of a Gauss-Markov process is largest at f = 1 / (2 pi T); Harris's at sqrt(3)
    V / 1800 m, Davenport's at sqrt(3) V / 1200 m, so T = 165.4 m / V and 110.3 m / V;
    NORSOK's is found by search. `docs/weather.md` says how far the filter is from the
    full spectra. Without gusts the deviation, m/s, is 0.
    """
    if not wind.gust or wind.calm:
        return GaussMarkov(1.0, 0.0)
    V = wind.speed
    spectrum = wind.spectrum
    if spectrum == "norsok":
        f = froya_frequencies(2000)
        energy = f * froya_spectrum(f, V)
        largest = np.argmax(energy)
        peak = float(f[largest])
    else:
        L = LENGTH_SCALES[spectrum]
        peak = sqrt(3.0) * V / L
    variance = gust_variance(V, spectrum)
    return GaussMarkov(
        time_constant=1.0 / (2.0 * pi * peak),
        standard_deviation=sqrt(variance),
    )
