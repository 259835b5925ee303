"""Mean second-order wave forces on a ship, over the direction of the waves."""

import numpy as np
from numpy import cos, pi, sin, trapezoid
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.constants import GRAVITY
from shipgym.sea.added_resistance import added_resistance
from shipgym.sea.conditions import Waves
from shipgym.sea.estimates import weather_particulars
from shipgym.sea.harmonics import Curves, circle, half_circle, mirrored
from shipgym.sea.waves import (
    draught_attenuation,
    frequencies,
    over_directions,
    wave_spectrum,
)
from shipgym.ships.particulars import Particulars, main_dimensions


def wave_drift(waves: Waves, particulars: Particulars) -> Curves:
    """Mean second-order forces in an irregular sea: 2 integral S(w) F(w) / a^2 dw.

    Surge by :func:`added_resistance`, sway and yaw by :func:`reflection_coefficients`;
    the direction of the waves does not matter here. Particulars are estimated where
    absent (:func:`shipgym.sea.estimates.weather_particulars`), InputError if they are
    too few. The ship has her service speed, or 0 where that is not known.
    """
    ship = weather_particulars(particulars)
    speed = ship.speed or 0.0
    chi = half_circle()
    omega = frequencies(waves)
    spectrum = wave_spectrum(waves, omega)

    resistance = added_resistance(omega, chi[:, None], ship, speed)
    surge = -2.0 * trapezoid(resistance * spectrum, omega, axis=-1)

    share = draught_attenuation(omega, ship.require("draught"))
    taken_up = float(trapezoid(share * spectrum, omega))
    pressure = ship.require("water_density") * GRAVITY * taken_up
    by_length, by_length_squared = reflection_coefficients(chi, ship)
    sway = by_length * ship.length * pressure
    yaw = by_length_squared * ship.length**2 * pressure

    return Curves(
        X=over_directions(mirrored(surge), waves),
        Y=over_directions(mirrored(sway, -1.0), waves),
        N=over_directions(mirrored(yaw, -1.0), waves),
        K=np.zeros(len(circle())),
    )


def waterline(ship: Particulars) -> tuple[Floats, Floats]:
    """Half of a waterline y = (B / 2) (1 - |2 x / L|^p) from bow to stern.

    It is the same fore and aft. Points x forward of midship and y outward, m. The
    waterplane coefficient, waterplane area by length * beam, is p / (p + 1) and
    estimated as (1 + 2 CB) / 3 (Schneekluth & Bertram 1998, section 1.6).
    """
    hull = main_dimensions(ship)
    CWP = (1.0 + 2.0 * hull.CB) / 3.0
    p = CWP / (1.0 - CWP)
    from_bow = np.linspace(0.0, pi, 401)
    xi = cos(from_bow)
    breadth = 1.0 - np.abs(xi) ** p
    x = 0.5 * hull.L * xi
    y = 0.5 * hull.B * breadth
    return x, y


def reflection_coefficients(chi: ArrayLike, ship: Particulars) -> tuple[Floats, Floats]:
    """Sway force and yaw moment by reflected short waves, on a ship at rest.

    Faltinsen 1990, Sea Loads, equation 5.27 (Faltinsen et al. 1980): each part of the
    waterline that the waves can see takes up rho g a^2 / 2 times the square of the sine
    of the angle at which they meet it, along its inward normal. Sides are vertical.
    `chi`, rad, is where they come from, seen from the bow. Returns Y by rho g a^2 L / 2
    and N about midship by rho g a^2 L^2 / 2.
    """
    L = ship.length
    x, half_breadth = waterline(ship)
    Y_starboard, N_starboard = _reflected(
        chi,
        x,
        half_breadth,
        side=1.0,
    )
    Y_port, N_port = _reflected(chi, x, half_breadth, side=-1.0)
    Y = Y_starboard + Y_port
    N = N_starboard + N_port
    return Y / L, N / L**2


def _reflected(
    chi: ArrayLike, x: Floats, half_breadth: Floats, side: float
) -> tuple[Floats, Floats]:
    """Sway force and yaw moment on one side, 1 starboard, -1 port, by rho g a^2 / 2."""
    y = side * half_breadth
    dx = np.diff(x)
    dy = np.diff(y)
    length = np.hypot(dx, dy)
    middle_x = 0.5 * (x[1:] + x[:-1])
    middle_y = 0.5 * (y[1:] + y[:-1])

    # outward normal
    nx = side * dy / length
    ny = -side * dx / length
    along = np.multiply.outer(cos(chi), nx)
    across = np.multiply.outer(sin(chi), ny)
    sine = np.maximum(along + across, 0.0)
    force = sine**2 * length
    lever = middle_x * ny - middle_y * nx
    return -(force @ ny), -(force @ lever)
