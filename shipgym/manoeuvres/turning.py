"""The turning circle and its indices (IMO MSC/Circ.1053, ITTC 7.5-04-02-01)."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from shipgym.arrays import Floats
from shipgym.manoeuvres.execution import (
    execute_time,
    number_of_steps,
    reached,
    require,
    ship_length,
    turning_rudder,
)
from shipgym.manoeuvres.registry import SIDES, Manoeuvre, standard_time
from shipgym.sea.conditions import Weather
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.simulate import Seed, orders, simulate
from shipgym.trials.navigation import rotate_to_body
from shipgym.trials.trial import Trial

TURN_DEG = 35.0  # of the standard circle, or the rudder's limit where that is less
CAPTION = (
    "Path from above, from the position and along the heading at which the rudder was"
    " ordered."
)


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


def turning_circle(
    model: ShipModel,
    rudder_deg: float = 35.0,
    duration: float = 900.0,
    dt: float = 0.1,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Trial:
    """Simulate a turning circle from straight ahead at service speed, without an approach run.

    The rudder is ordered at the start, degrees, negative to port; `duration` and `dt`,
    the time between samples, are in s; the rest as in `zigzag`. Raises InputError for a
    rudder of 0 or beyond 90 degrees, or a duration or step that is not above 0,
    UnstableModelError if the ship runs away.
    """
    rudder = np.full(number_of_steps(duration, dt), turning_rudder(rudder_deg, 90.0))
    return simulate(
        model,
        orders(model, rudder),
        dt,
        None,
        water_depth,
        "turning-circle",
        weather,
        seed,
    )


def turning_indices(trial: Trial, length: float | None = None) -> TurningIndices:
    """Advance, transfer, diameters and the steady turn of a measured or simulated turning circle.

    The trial has x, y, psi, u, v, r and delta (or delta_command); `length` is that
    between perpendiculars, m, by default the trial's own. Raises InputError if a
    channel or the length is missing.
    """
    require(trial, ("x", "y", "psi"), "a turning circle")
    lpp = ship_length(trial, length)
    after = trial.t >= execute_time(trial)
    ahead, aside, turned = (values[after] for values in track_from_order(trial, lpp))
    side = 1.0 if turned[-1] >= 0.0 else -1.0
    turned, aside = side * turned, side * aside
    advance, transfer = (reached(turned, np.pi / 2, way) for way in (ahead, aside))
    ways = advance, transfer, reached(turned, np.pi, aside)
    if turned[-1] <= 1.5 * np.pi:  # no steady turn yet
        return TurningIndices(*ways, None, None, None)
    u, v, r = (trial[name][after] for name in ("u", "v", "r"))
    speed, steady = np.hypot(u, v), turned >= turned[-1] - np.pi / 2
    diameter = 2.0 * speed[steady].mean() / (side * r[steady].mean()) / lpp
    drift = side * np.degrees(np.arctan2(-v[steady], u[steady]).mean())
    return TurningIndices(
        *ways, float(diameter), float(speed[steady].mean() / speed[0]), float(drift)
    )


def track_from_order(trial: Trial, length: float) -> tuple[Floats, Floats, Floats]:
    """Way ahead and to starboard in ship lengths, and turn in rad, from where the rudder was ordered."""
    start = execute_time(trial)
    x0, y0, psi0 = (
        float(np.interp(start, trial.t, trial[name])) for name in ("x", "y", "psi")
    )
    ahead, aside = rotate_to_body(trial["x"] - x0, trial["y"] - y0, psi0)
    return ahead / length, aside / length, trial["psi"] - psi0


def full_rudder_deg(model: ShipModel) -> float:
    """Rudder of the standard circle, degrees: 35, or the rudder's limit where that is less."""
    return min(TURN_DEG, model.steering.rudder_limit_deg)


def standard_circles(
    model: ShipModel, water_depth: float = np.inf
) -> dict[str, Manoeuvre]:
    """Turning circles with full rudder to both sides."""
    duration, dt = standard_time(model)
    full = full_rudder_deg(model)
    turn = partial(turning_circle, duration=duration, dt=dt, water_depth=water_depth)
    return {
        f"turning circle {full:.0f} deg to {side}": Manoeuvre(
            partial(turn, rudder_deg=sign * full),
            turning_indices,
            TurningIndices,
            CAPTION,
        )
        for side, sign in SIDES
    }
