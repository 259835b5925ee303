"""Whether a trial can be that of a ship of this size and speed."""

import math

import numpy as np

from shipgym.errors import InputError
from shipgym.ships.particulars import Particulars
from shipgym.trials.trial import Trial
from shipgym.trials.units import KNOT

_MOST = 0.95  # share of the samples that count: the others may be outliers
_FASTEST_TURN_PRIME = 3.0  # |r| L / U; a ship in its tightest turn stays below about 1
_FASTEST_TIP = 100.0  # m/s at the propeller's tip
_SPEEDS = (0.2, 2.0)  # of a trial, by the service speed
_LEAST_SLENDERNESS, _FASTEST_FROUDE = 1.5, 0.3  # of ships that displace water


def check_scale(trial: Trial, ship: Particulars, where: str) -> None:
    """Refuse what no ship of this size and speed does: the trial is another ship's, or in another unit.

    These are yaw rates and speeds of another scale, and a propeller's tip beyond 100
    m/s. Service speed and propeller diameter count where they are given; `where` begins
    the messages.
    """
    if ship.beam is not None and ship.length < _LEAST_SLENDERNESS * ship.beam:
        raise InputError(
            f"{where}: a ship of {ship.length:g} m by {ship.beam:g} m found, expected"
            f" at least {_LEAST_SLENDERNESS:g} times as long as broad; likely [ship]"
            " length is something else, such as an antenna's height: write the length"
            " between perpendiculars"
        )
    speeds = (
        np.hypot(trial["u"], trial.channels.get("v", np.zeros(1)))
        if "u" in trial
        else None
    )
    if speeds is not None and "r" in trial:
        speed, fastest = (
            float(speeds.max()),
            float(np.quantile(np.abs(trial["r"]), _MOST)),
        )
        limit = _FASTEST_TURN_PRIME * speed / ship.length
        if fastest > limit:
            raise InputError(
                f"{where}: yaw rate up to {math.degrees(fastest):.4g} deg/s at up to"
                f" {speed:.4g} m/s found, expected at most {math.degrees(limit):.4g}"
                f" deg/s for a length of {ship.length:g} m; likely the trial of another"
                " ship or scale, or a wrong unit of r, psi, u or v in [columns], or of"
                " [ship] length"
            )
    if speeds is not None and ship.speed is not None and "speed" not in ship.estimated:
        fastest = float(np.quantile(speeds, _MOST))
        low, high = (share * ship.speed for share in _SPEEDS)
        knots = ship.speed * KNOT
        if (
            ship.speed > _FASTEST_FROUDE * math.sqrt(9.81 * ship.length)
            and abs(fastest / knots - 1.0) < 0.1
        ):
            raise InputError(
                f"{where}: {ship.speed:g} is {knots:.4g} m/s in knots, as fast as she"
                f" sails here, expected [ship] speed in m/s; write speed = {knots:.4g}"
            )
        if not low <= fastest <= high:
            raise InputError(
                f"{where}: up to {fastest:.4g} m/s found, expected {low:.4g} to"
                f" {high:.4g} m/s of a ship with a service speed of {ship.speed:g} m/s;"
                " likely the trial of another ship or scale, or a wrong unit of u; if"
                " it is this ship's, give its speed as sailed"
            )
    if "n" in trial and ship.propeller_diameter is not None:
        fastest = float(np.quantile(np.abs(trial["n"]), _MOST))
        limit = _FASTEST_TIP / (math.pi * ship.propeller_diameter)
        if fastest > limit:
            raise InputError(
                f"{where}: shaft speed up to {fastest:.4g} rps found, expected at most"
                f" {limit:.4g} rps for a propeller of {ship.propeller_diameter:g} m;"
                ' likely a wrong unit: declare n = { column = "...", unit = "rpm" }'
                " in [columns]"
            )
