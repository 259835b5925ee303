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

    These are yaw rates and speeds of another scale, and a propeller's tip beyond 100
    m/s. Service speed and propeller diameter count where they are given; `where` begins
    the messages.
    """
    slimmest = 1.5  # length by beam of ships that displace water
    if ship.beam is not None and ship.length < slimmest * ship.beam:
        raise InputError(
            f"{where}: expected a ship at least {slimmest:g} times as long as broad,"
            f" got {ship.length:g} m by {ship.beam:g} m; likely [ship] length is"
            " something else, such as an antenna's height: write the length between"
            " perpendiculars"
        )

    if "u" in trial:
        sway = trial.channels.get("v", 0.0)
        speed = np.hypot(trial["u"], sway)
        if "r" in trial:
            fastest = _largest(trial["r"])
            _check_turning(fastest, float(speed.max()), ship, where)
        _check_speed(_largest(speed), ship, where)
    if "n" in trial and ship.propeller_diameter is not None:
        fastest = _largest(trial["n"])
        _check_shaft(fastest, ship.propeller_diameter, where)


def _largest(values: Floats) -> float:
    """Size that 95 per cent of the values do not exceed; the others may be outliers."""
    return float(np.quantile(np.abs(values), 0.95))


def _check_turning(
    fastest: float,
    speed: float,
    ship: Particulars,
    where: str,
) -> None:
    most_per_length = 3.0  # |r| L / U; a ship in its tightest turn is below about 1
    limit_deg = math.degrees(most_per_length * speed / ship.length)
    fastest_deg = math.degrees(fastest)
    if fastest_deg > limit_deg:
        raise InputError(
            f"{where}: expected a yaw rate of at most {limit_deg:.4g} deg/s at up to"
            f" {speed:.4g} m/s for a length of {ship.length:g} m, got up to"
            f" {fastest_deg:.4g} deg/s; likely the trial of another ship or scale, or a"
            " wrong unit of r, psi, u or v in [columns], or of [ship] length"
        )


def _check_speed(fastest: float, ship: Particulars, where: str) -> None:
    service_speed = ship.speed
    if service_speed is None or "speed" in ship.estimated:
        return
    wave_speed = math.sqrt(9.81 * ship.length)
    froude = service_speed / wave_speed
    is_fast = froude > 0.3  # for a ship that displaces water
    in_knots = service_speed * KNOT
    excess = fastest / in_knots - 1.0
    if is_fast and abs(excess) < 0.1:
        raise InputError(
            f"{where}: expected [ship] speed in m/s, got {service_speed:g}, which in"
            f" knots is {in_knots:.4g} m/s, as fast as she sails here; write speed ="
            f" {in_knots:.4g}"
        )
    low = 0.2 * service_speed
    high = 2.0 * service_speed
    if not low <= fastest <= high:
        raise InputError(
            f"{where}: expected a speed of {low:.4g} to {high:.4g} m/s for a service"
            f" speed of {service_speed:g} m/s, got up to {fastest:.4g} m/s; likely the"
            " trial of another ship or scale, or a wrong unit of u; if it is this"
            " ship's, give its speed as sailed"
        )


def _check_shaft(fastest: float, diameter: float, where: str) -> None:
    fastest_tip = 100.0  # m/s
    limit = fastest_tip / (math.pi * diameter)
    if fastest > limit:
        raise InputError(
            f"{where}: expected a shaft speed of at most {limit:.4g} rps for a"
            f" propeller of {diameter:g} m, got up to {fastest:.4g} rps; likely a wrong"
            ' unit: declare n = { column = "...", unit = "rpm" } in [columns]'
        )
