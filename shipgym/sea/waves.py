"""Wave spectra, and linear filters for first-order motion and slow drift."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy import cos, exp, log, pi, trapezoid, where
from numpy.fft import irfft, rfft
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.constants import GRAVITY
from shipgym.sea.conditions import Waves
from shipgym.sea.estimates import weather_particulars
from shipgym.sea.filters import GaussMarkov
from shipgym.sea.harmonics import circle
from shipgym.ships.particulars import Particulars


class WaveFilter(NamedTuple):
    """h(s) = gain s / (s^2 + 2 damping w0 s + w0^2), driven by white noise.

    The intensity of the noise is 1. Its output has unit variance: gain^2 = 4 damping
    w0. At sea w0, and so the gain, is that of encounter.
    """

    peak_frequency: float  # w0 for a ship at rest, rad/s
    damping: float  # lambda, relative damping

    def spectrum(self, omega: ArrayLike) -> Floats:
        """One-sided spectral density of the output per rad/s, whose integral is 1."""
        w = np.asarray(omega, dtype=float)
        w0 = self.peak_frequency
        width = (2.0 * w0 * w) ** 2 * self.damping
        response = width / ((w0**2 - w**2) ** 2 + self.damping * width)
        return response / (pi * w0)


def pierson_moskowitz(omega: ArrayLike, Hs: float, Tp: float) -> Floats:
    """Spectrum of a fully developed sea (Pierson & Moskowitz 1964) by Hs, m, and Tp, s.

    One-sided density of the elevation, m2 s/rad, over omega, rad/s; 0 at 0. Its
    integral is Hs^2 / 16.
    """
    peak = 2.0 * pi / Tp
    # the density is 0 below a fiftieth of the peak: exp(-1.25 * 50^4)
    ratio = np.maximum(omega, 0.02 * peak) / peak
    scale = 5.0 / 16.0 * Hs**2 / peak
    tail = ratio**-5
    cut_off = exp(-1.25 * ratio**-4)
    density: Floats = scale * tail * cut_off
    return density


def jonswap(omega: ArrayLike, Hs: float, Tp: float, gamma: float = 3.3) -> Floats:
    """Spectrum of a growing sea (Hasselmann et al. 1973), normalised to Hs.

    Arguments and density are those of :func:`pierson_moskowitz`. The factor 1 - 0.287
    ln(gamma) of the literature (DNV-RP-C205) is replaced by the exact integral; a peak
    enhancement gamma of 1 gives :func:`pierson_moskowitz`.
    """
    ratio = np.asarray(omega, dtype=float) * Tp / (2.0 * pi)
    plain = pierson_moskowitz(omega, Hs, Tp)
    return plain * _enhancement(ratio, gamma) / _enhanced_variance(gamma)


def _enhancement(ratio: Floats, gamma: float) -> Floats:
    """gamma^r over frequency by peak frequency."""
    sigma = where(ratio <= 1.0, 0.07, 0.09)
    r = exp(-0.5 * ((ratio - 1.0) / sigma) ** 2)
    return gamma**r


@lru_cache(maxsize=64)
def _enhanced_variance(gamma: float) -> float:
    """Variance with peak enhancement by that without."""
    log_ratio = np.linspace(log(0.2), log(50.0), 4001)
    ratio = exp(log_ratio)
    plain = ratio * pierson_moskowitz(ratio, 4.0, 2.0 * pi)
    enhanced = plain * _enhancement(ratio, gamma)
    variance = trapezoid(plain, log_ratio)
    enhanced_variance = trapezoid(enhanced, log_ratio)
    return float(enhanced_variance / variance)


def wave_spectrum(waves: Waves, omega: ArrayLike) -> Floats:
    """Spectrum of the elevation of a sea, m2 s/rad."""
    return jonswap(
        omega, waves.significant_height, waves.peak_period, waves.peak_enhancement
    )


def frequencies(waves: Waves) -> Floats:
    """Frequencies for integrals over the spectrum, 0.4 to 12 times the peak, rad/s."""
    return 2.0 * pi / waves.peak_period * np.geomspace(0.4, 12.0, 400)


def wave_number(omega: ArrayLike) -> Floats:
    """Wave number k = omega^2 / g of a frequency (rad/s) in deep water, rad/m."""
    return np.square(omega) / GRAVITY


def over_directions(curve: Floats, waves: Waves) -> Floats:
    """Average a curve over the directions of a sea's waves.

    The curve, over :func:`shipgym.sea.harmonics.circle`, is the effect of waves from
    one direction (a variance or a mean force, which add up); the average is over the
    mean direction.
    """
    if waves.spreading == "long-crested":
        return curve
    n = len(curve)
    toward = cos(circle(n))
    energy = where(toward > 0.0, toward**2, 0.0)
    weight = energy / energy.sum()
    convolution = rfft(curve) * rfft(weight)
    return irfft(convolution, n=n)


def wave_filter(waves: Waves) -> WaveFilter:
    """Second-order filter with the shape of the wave spectrum and unit variance.

    The relative damping is fitted by least squares to the spectrum of unit variance; it
    depends on the peak enhancement alone. Saelid, Jenssen & Balchen 1983 (Design and
    analysis of a dynamic positioning system based on Kalman filtering and optimal
    control, IEEE Trans. Automatic Control 28); Fossen 2011, 8.2.
    """
    peak = 2.0 * pi / waves.peak_period
    damping = _fitted_damping(waves.peak_enhancement)
    return WaveFilter(peak, damping)


@lru_cache(maxsize=64)
def _fitted_damping(gamma: float) -> float:
    from scipy.optimize import minimize_scalar

    w = np.linspace(0.02, 4.0, 2000)
    target = jonswap(w, 4.0, 2.0 * pi, gamma)

    def misfit(damping: float) -> float:
        error = WaveFilter(1.0, damping).spectrum(w) - target
        return float(error @ error)

    fitted = minimize_scalar(misfit, bounds=(0.01, 1.0), method="bounded")
    return float(fitted.x)


def draught_attenuation(omega: ArrayLike, draught: float) -> Floats:
    """Drift force on a hull of this draught (m) by that on an infinitely deep one.

    pi^2 I1^2 / (pi^2 I1^2 + K1^2) of k T, from 0 in long to 1 in short waves (Fujii &
    Takahashi 1975, Experimental study on the resistance increase of a ship in regular
    oblique waves, 14th ITTC); omega in rad/s.
    """
    from scipy.special import i1e, k1e

    kT = wave_number(omega) * draught
    # of the exponentially scaled functions; larger arguments would underflow
    scale = exp(-2.0 * np.minimum(kT, 300.0))
    K1_by_I1 = k1e(kT) * scale / i1e(kT)
    ratio = K1_by_I1 / pi
    return 1.0 / (1.0 + ratio**2)


def slow_drift(waves: Waves, particulars: Particulars) -> GaussMarkov:
    """Process s(t) of the slowly varying drift force, mean force * (1 + s).

    By Newman's approximation (Newman 1974, Second order slowly varying forces on
    vessels in irregular waves) the force is the squared envelope of a narrow-banded
    process with spectrum S(w) c(w), where c is the mean force by squared amplitude. The
    squared envelope of a Gaussian process is exponentially distributed: its standard
    deviation is its mean, so that of s is 1. Its spectrum at zero frequency, 8 integral
    S^2 c^2 dw (Faltinsen 1990, Sea Loads, equation 5.45), gives the integral time scale
    pi integral S^2 c^2 dw / (integral S c dw)^2, s. For c the attenuation with draught
    is taken. The Gaussian s lacks the long tail of the exponential distribution and
    falls below -1 for 16 % of the time.
    """
    omega = frequencies(waves)
    ship = weather_particulars(particulars)
    draught = ship.require("draught")
    # the height does not matter
    shape = jonswap(omega, 1.0, waves.peak_period, waves.peak_enhancement)
    Sc = shape * draught_attenuation(omega, draught)
    mean = trapezoid(Sc, omega)
    squares = trapezoid(Sc**2, omega)
    time_constant = pi * squares / mean**2
    return GaussMarkov(
        time_constant=float(time_constant),
        standard_deviation=1.0,
    )
