"""The turning circle and its indices (IMO MSC/Circ.1053, ITTC 7.5-04-02-01)."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.manoeuvres.execution import (
    execute_time,
    first_held,
    number_of_steps,
    reached,
    rudder,
    ship_length,
)
from shipgym.manoeuvres.registry import SIDES, Manoeuvre, standard_time
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import Seed, orders, simulate
from shipgym.sea.conditions import Weather
from shipgym.trials.navigation import rotate_to_body
from shipgym.trials.trial import Trial


@dataclass(frozen=True)
class TurningIndices:
    """Indices of a turning circle; None if the ship did not turn that far.

    Lengths are measured from the position and along the heading at which the rudder was
    ordered.
    """

    # distance ahead and to the side when the heading has changed by 90 degrees, ship
    # lengths
    advance_lengths: float | None
    transfer_lengths: float | None
    # distance to the side when the heading has changed by 180 degrees, ship lengths
    tactical_diameter_lengths: float | None
    # diameter of the steady turn, 2 U / r over the last quarter turn before the end,
    # ship lengths
    steady_diameter_lengths: float | None
    steady_speed_ratio: float | None  # speed in the steady turn over that at the order
    # drift angle at midship in the steady turn, degrees, positive when the bow points
    # into the turn
    steady_drift_deg: float | None


@takes_name
def turning_circle(
    model: ShipModel,
    rudder_deg: float = 35.0,
    duration: float = 900.0,
    dt: float = 0.1,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Trial:
    """Simulate a turning circle from straight ahead at service speed, with no approach.

    The rudder is ordered at the start, degrees, negative to port; `duration` and `dt`,
    the time between samples, are in s; the rest as in `zigzag`. Raises InputError for a
    rudder of 0 or beyond 90 degrees, or a duration or step that is not above 0,
    UnstableModelError if the ship runs away.
    """
    check_number(rudder_deg, "rudder_deg", at_least=-90.0, at_most=90.0)
    if rudder_deg == 0.0:
        raise InputError("rudder_deg: expected an angle that turns the ship, got 0")
    ordered = np.full(number_of_steps(duration, dt), np.radians(rudder_deg))
    return simulate(
        model,
        orders(model, ordered),
        dt,
        water_depth=water_depth,
        kind="turning-circle",
        weather=weather,
        seed=seed,
    )


def turning_indices(trial: Trial, length: float | None = None) -> TurningIndices:
    """Advance, transfer, diameters and the steady turn of a turning circle.

    The trial has x, y, psi, u, v, r and delta (or delta_command), and ends for them
    when the rudder is released; `length` is that between perpendiculars, m, by default
    the trial's own. Raises InputError if a
    channel or the length is missing.
    """
    lpp = ship_length(trial, length)
    start = execute_time(trial)
    after = trial.t >= start

    def since(channel: str) -> Floats:
        values = trial[channel]
        return np.asarray(values - np.interp(start, trial.t, values))

    turned = since("psi")
    heading = float(trial["psi"][0] - turned[0])
    ahead, aside = rotate_to_body(since("x"), since("y"), heading)
    side = 1.0 if turned[-1] >= 0.0 else -1.0
    delta = rudder(trial)
    first = delta[first_held(trial)]
    held = np.flatnonzero(delta * first >= 0.75 * first**2)
    after[held[-1] + 1 :] = False
    ahead = ahead[after] / lpp
    aside = side * aside[after] / lpp
    turned = side * turned[after]

    half_turn = np.pi
    quarter_turn = np.pi / 2
    diameter = speed_ratio = drift_deg = None
    if turned[-1] > half_turn + quarter_turn:
        diameter, speed_ratio, drift_deg = _steady_turn(
            trial,
            after,
            turned,
            side,
            lpp,
        )
    return TurningIndices(
        advance_lengths=reached(turned, quarter_turn, ahead),
        transfer_lengths=reached(turned, quarter_turn, aside),
        tactical_diameter_lengths=reached(turned, half_turn, aside),
        steady_diameter_lengths=diameter,
        steady_speed_ratio=speed_ratio,
        steady_drift_deg=drift_deg,
    )


def _steady_turn(
    trial: Trial, after: Flags, turned: Floats, side: float, length: float
) -> tuple[float, float, float]:
    """Diameter, lengths, ratio of speeds and drift, deg, in the last quarter turn.

    `turned` to its `side`, from the order on.
    """
    u = trial["u"][after]
    v = trial["v"][after]
    r = trial["r"][after]
    speed = np.hypot(u, v)
    drift = np.arctan2(-v, u)

    steady = turned >= turned[-1] - np.pi / 2
    mean_speed = speed[steady].mean()
    mean_rate = side * r[steady].mean()
    mean_drift = side * drift[steady].mean()
    diameter = 2.0 * mean_speed / mean_rate
    return (
        float(diameter / length),
        float(mean_speed / speed[0]),
        float(np.degrees(mean_drift)),
    )


def full_rudder_deg(model: ShipModel) -> float:
    """Rudder of the standard circle, degrees: 35, or the rudder's limit if less."""
    return min(35.0, model.steering.rudder_limit_deg)


def standard_circles(model: ShipModel) -> dict[str, Manoeuvre]:
    """Turning circles with full rudder to both sides."""
    duration, dt = standard_time(model)
    full = full_rudder_deg(model)
    circles = {}
    for side, sign in SIDES:
        sail = partial(
            turning_circle,
            rudder_deg=sign * full,
            duration=duration,
            dt=dt,
        )
        name = f"turning circle {full:.0f} deg to {side}"
        circles[name] = Manoeuvre(sail, turning_indices, TurningIndices)
    return circles
