"""Checks that a trial can be that of a ship of this size and speed."""

import math

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.ships.particulars import Particulars
from shipgym.trials.trial import Trial
from shipgym.trials.units import KNOT


def check_scale(trial: Trial, ship: Particulars, where: str) -> None:
    """Refuse a trial that cannot be of a ship of this size and speed.

    These are yaw rates and speeds of another scale. The service speed counts where it
    is given; `where` begins the messages.
    """
    if "u" not in trial:
        return
    speed = np.hypot(trial["u"], trial.channels.get("v", 0.0))
    _check_speed(_largest(speed), ship, where)
    if "r" not in trial:
        return
    most_per_length = 3.0  # |r| L / U; a ship in its tightest turn is below about 1
    fastest = float(speed.max())
    limit_deg = math.degrees(most_per_length * fastest / ship.length)
    turning_deg = math.degrees(_largest(trial["r"]))
    if turning_deg > limit_deg:
        raise InputError(
            f"{where}: expected a yaw rate of at most {limit_deg:.4g} deg/s at up to"
            f" {fastest:.4g} m/s for a length of {ship.length:g} m, got up to"
            f" {turning_deg:.4g} deg/s; likely the trial of another ship or scale, or a"
            " wrong unit of r, psi, u or v in [columns], or of [ship] length"
        )


def _largest(values: Floats) -> float:
    """Size that 95 per cent of the values do not exceed; the others may be outliers."""
    return float(np.quantile(np.abs(values), 0.95))


def _check_speed(
    fastest: float,
    ship: Particulars,
    where: str,
) -> None:
    service_speed = ship.speed
    if service_speed is None or "speed" in ship.estimated:
        return
    froude = service_speed / math.sqrt(9.81 * ship.length)
    in_knots = service_speed * KNOT
    if froude > 0.3 and abs(fastest / in_knots - 1.0) < 0.1:  # for such a ship fast
        raise InputError(
            f"{where}: expected [ship] speed in m/s, got {service_speed:g}, which in"
            f" knots is {in_knots:.4g} m/s, as fast as she sails here; write speed ="
            f" {in_knots:.4g}"
        )
    low, high = 0.2 * service_speed, 2.0 * service_speed
    if not low <= fastest <= high:
        raise InputError(
            f"{where}: expected a speed of {low:.4g} to {high:.4g} m/s for a service"
            f" speed of {service_speed:g} m/s, got up to {fastest:.4g} m/s; likely the"
            " trial of another ship or scale, or a wrong unit of u; if it is this"
            " ship's, give its speed as sailed"
        )
