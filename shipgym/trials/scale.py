"""Whether a trial can be that of a ship of this size and speed."""

import math
from collections.abc import Iterator

import numpy as np

from shipgym.arrays import Floats
from shipgym.ships.particulars import Particulars
from shipgym.trials.plausibility.finding import LogFinding, settle
from shipgym.trials.trial import Trial
from shipgym.trials.units import KNOT

#: Share of the samples that count: the others may be outliers.
_MOST = 0.95


def check_scale(trial: Trial, ship: Particulars, where: str) -> None:
    """Refuse what no ship of this size and speed does: the trial is another ship's, or in another unit.

    These are yaw rates and speeds of another scale, and a propeller's tip beyond 100
    m/s. Service speed and propeller diameter count where they are given; `where` begins
    the messages.
    """
    settle(_check_slenderness(ship, where))
    if "u" in trial:
        speed = np.hypot(trial["u"], trial.channels.get("v", 0.0))
        if "r" in trial:
            settle(_check_turning(trial["r"], speed, ship, where))
        settle(_check_speed(speed, ship, where))
    if "n" in trial and ship.propeller_diameter is not None:
        settle(_check_shaft(trial["n"], ship.propeller_diameter, where))


def _check_slenderness(ship: Particulars, where: str) -> Iterator[LogFinding]:
    least = 1.5  # of ships that displace water
    if ship.beam is not None and ship.length < least * ship.beam:
        yield LogFinding(
            where=where,
            evidence=(
                f"expected a ship at least {least:g} times as long as broad, got"
                f" {ship.length:g} m by {ship.beam:g} m"
            ),
            remedy=(
                "likely [ship] length is something else, such as an antenna's height:"
                " write the length between perpendiculars"
            ),
        )


def _check_turning(
    r: Floats, speed: Floats, ship: Particulars, where: str
) -> Iterator[LogFinding]:
    fastest = float(np.quantile(np.abs(r), _MOST))
    largest_speed = float(speed.max())
    # |r| L / U; a ship in its tightest turn stays below about 1
    limit = 3.0 * largest_speed / ship.length
    if fastest > limit:
        limit_deg, fastest_deg = math.degrees(limit), math.degrees(fastest)
        yield LogFinding(
            where=where,
            evidence=(
                f"expected a yaw rate of at most {limit_deg:.4g} deg/s at up to"
                f" {largest_speed:.4g} m/s for a length of {ship.length:g} m, got up to"
                f" {fastest_deg:.4g} deg/s"
            ),
            remedy=(
                "likely the trial of another ship or scale, or a wrong unit of r, psi,"
                " u or v in [columns], or of [ship] length"
            ),
        )


def _check_speed(speed: Floats, ship: Particulars, where: str) -> Iterator[LogFinding]:
    service_speed = ship.speed
    if service_speed is None or "speed" in ship.estimated:
        return
    fastest = float(np.quantile(speed, _MOST))
    ratio = fastest / service_speed
    froude = service_speed / math.sqrt(9.81 * ship.length)
    is_fast = froude > 0.3  # for a ship that displaces water
    if is_fast and abs(ratio / KNOT - 1.0) < 0.1:
        yield _speed_in_knots(service_speed, where)
    elif not 0.2 <= ratio <= 2.0:
        yield _other_speed(fastest, service_speed, where)


def _speed_in_knots(service_speed: float, where: str) -> LogFinding:
    in_knots = service_speed * KNOT
    return LogFinding(
        where=where,
        evidence=(
            f"expected [ship] speed in m/s, got {service_speed:g}, which in knots is"
            f" {in_knots:.4g} m/s, as fast as she sails here"
        ),
        remedy=f"write speed = {in_knots:.4g}",
    )


def _other_speed(fastest: float, service_speed: float, where: str) -> LogFinding:
    low, high = 0.2 * service_speed, 2.0 * service_speed
    return LogFinding(
        where=where,
        evidence=(
            f"expected a speed of {low:.4g} to {high:.4g} m/s for a service speed of"
            f" {service_speed:g} m/s, got up to {fastest:.4g} m/s"
        ),
        remedy=(
            "likely the trial of another ship or scale, or a wrong unit of u; if it is"
            " this ship's, give its speed as sailed"
        ),
    )


def _check_shaft(n: Floats, diameter: float, where: str) -> Iterator[LogFinding]:
    fastest = float(np.quantile(np.abs(n), _MOST))
    fastest_tip = 100.0  # m/s
    limit = fastest_tip / (math.pi * diameter)
    if fastest > limit:
        yield LogFinding(
            where=where,
            evidence=(
                f"expected a shaft speed of at most {limit:.4g} rps for a propeller of"
                f" {diameter:g} m, got up to {fastest:.4g} rps"
            ),
            remedy=(
                'likely a wrong unit: declare n = { column = "...", unit = "rpm" } in'
                " [columns]"
            ),
        )
