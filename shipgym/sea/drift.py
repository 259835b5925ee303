"""Mean second-order wave forces on a ship, over the direction of the waves."""

from dataclasses import dataclass

import numpy as np
from numpy import cos, pi, sin, trapezoid
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.constants import GRAVITY
from shipgym.sea.added_resistance import added_resistance
from shipgym.sea.current_wind_waves import Waves
from shipgym.sea.estimates import hull_of, weather_particulars
from shipgym.sea.harmonics import (
    Harmonics,
    circle,
    cosine_coefficients,
    half_circle,
    mirrored,
    sine_coefficients,
)
from shipgym.sea.waves import (
    draught_attenuation,
    frequencies,
    over_directions,
    slow_drift,
    wave_spectrum,
)
from shipgym.ships.particulars import Particulars


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
    estimated: tuple[str, ...] = ()  # particulars that were estimated for it

    def harmonics(self, n: int = 8) -> Harmonics:
        """Fourier series up to the n-th harmonic, for kernels; K, which heels, is 0."""
        return Harmonics(
            X=cosine_coefficients(self.X, n),
            Y=sine_coefficients(self.Y, n),
            N=sine_coefficients(self.N, n),
            K=np.zeros(n),
        )


def wave_drift(
    waves: Waves, particulars: Particulars, speed: float | None = None
) -> WaveDrift:
    """Mean second-order forces in an irregular sea: 2 integral S(w) F(w) / a^2 dw.

    Surge by :func:`added_resistance`, sway and yaw by :func:`reflection_coefficients`;
    the direction of the waves does not matter here. Particulars are estimated where
    absent (:func:`shipgym.sea.estimates.weather_particulars`), InputError if they are
    too few; speed in m/s, by default that of service, or 0 where that is not known.
    """
    ship = weather_particulars(particulars)
    U = (ship.speed or 0.0) if speed is None else speed
    L = ship.length
    chi = half_circle()
    omega = frequencies(waves)
    spectrum = wave_spectrum(waves, omega)

    resistance = added_resistance(omega, chi[:, None], ship, U)
    surge = -2.0 * trapezoid(resistance * spectrum, omega, axis=-1)

    share = draught_attenuation(omega, ship.require("draught"))
    taken_up = float(trapezoid(share * spectrum, omega))
    pressure = ship.require("water_density") * GRAVITY * taken_up
    sway, yaw = reflection_coefficients(chi, ship)

    time_constant, deviation = slow_drift(waves, ship)
    used = {"block_coefficient", "water_density"}
    return WaveDrift(
        circle(),
        X=over_directions(mirrored(surge), waves),
        Y=over_directions(mirrored(sway * L * pressure, -1.0), waves),
        N=over_directions(mirrored(yaw * L**2 * pressure, -1.0), waves),
        time_constant=time_constant,
        standard_deviation=deviation,
        estimated=tuple(sorted(ship.estimated & used)),
    )


def waterline(ship: Particulars) -> tuple[Floats, Floats]:
    """Half of a waterline y = (B / 2) (1 - |2 x / L|^p) from bow to stern.

    It is the same fore and aft. Points x forward of midship and y outward, m. The
    waterplane coefficient, waterplane area by length * beam, is p / (p + 1) and
    estimated as (1 + 2 CB) / 3 (Schneekluth & Bertram 1998, section 1.6).
    """
    L, B, _, CB = hull_of(ship)
    CWP = (1.0 + 2.0 * CB) / 3.0
    p = CWP / (1.0 - CWP)
    xi = cos(np.linspace(0.0, pi, 401))
    x = 0.5 * L * xi
    y = 0.5 * B * (1.0 - np.abs(xi) ** p)
    return x, y


def reflection_coefficients(chi: ArrayLike, ship: Particulars) -> tuple[Floats, Floats]:
    """Sway force and yaw moment by reflected short waves, on a ship at rest.

    Faltinsen 1990, Sea Loads, equation 5.27 (Faltinsen et al. 1980): each part of the
    waterline that the waves can see takes up rho g a^2 / 2 times the square of the sine
    of the angle at which they meet it, along its inward normal. Sides are vertical.
    `chi`, rad, is where they come from, seen from the bow. Returns Y by rho g a^2 L / 2
    and N about midship by rho g a^2 L^2 / 2.
    """
    x, y = waterline(ship)
    dx = np.diff(x)
    dy = np.diff(y)
    length = np.hypot(dx, dy)
    middle_x = 0.5 * (x[1:] + x[:-1])
    middle_y = 0.5 * (y[1:] + y[:-1])

    Y = np.zeros(np.shape(chi))
    N = np.zeros(np.shape(chi))
    for side in (1.0, -1.0):
        # outward normal
        nx = dy / length
        ny = -side * dx / length
        sine = np.multiply.outer(cos(chi), nx) + np.multiply.outer(sin(chi), ny)
        force = np.maximum(sine, 0.0) ** 2 * length
        Y = Y - force @ ny
        N = N - force @ (middle_x * ny - side * middle_y * nx)
    return Y / ship.length, N / ship.length**2
