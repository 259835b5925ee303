"""The ship as a linear sampled loop: what the classical designs are computed on.

The state is (sway, yaw rate, heading error, rudder, integral of the heading error) as
deviations from straight running, SI units; the input is the commanded rudder, held over
each control interval. Sampling it so is exact for small motions: the zero-order hold,
the gear's lag and the environment's sum for the integral are in it. The rudder's limit
and rate are not.
"""

from typing import NamedTuple

import numpy as np

from agents.controllers.law import Gains
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.models.linear import (
    Nomoto,
    StraightRunning,
    nomoto,
    small_motions,
)
from shipgym.tasks.scales import RATE_WEIGHT, control_interval

SIGNALS = Gains._fields
SWAY, YAW_RATE, ERROR, RUDDER, INTEGRAL = range(len(SIGNALS))
ORDER = RUDDER + 1  # of the rudder, in a flow that holds it over an interval


class SampledShip(NamedTuple):
    """Small motions about straight running: x[k + 1] = A x[k] + B order[k].

    Attributes
    ----------
    A : array of shape (5, 5)
    B : array of shape (5, 1)
        x in the order of `SIGNALS`.
    dt : float
        Control interval, s.
    about : StraightRunning
        The state about which motions are small.
    """

    A: Floats
    B: Floats
    dt: float
    about: StraightRunning


def checked_interval(model: ShipModel, dt: float | None) -> float:
    """Control interval of a design, s, by default that of the environments.

    Raises InputError if it is not positive.
    """
    if dt is None:
        return control_interval(model)
    return check_number(dt, "dt", above=0.0)


def rate_weight(model: ShipModel) -> float:
    """Weight of the squared rudder rate for linear designs, s^2.

    That of the squared heading error is 1. It is the environment's own, and as much
    again as makes the rudder's full rate cost like a heading error of
    7 degrees. A linear design knows no largest rate; with a slow gear it would
    ask for far more and swing. The figure is measured: with it both designs cost at
    most 1.06 times the best gains of a direct search on stable and unstable ships whose
    gears need 0.3 to 6 ship lengths for 35 degrees.
    """
    of_environment = RATE_WEIGHT * model.travel_time**2
    # heading error that costs as much as the rudder moving at full rate
    full_rate_error = np.radians(7.0)
    of_gear = (full_rate_error / model.steering.rate) ** 2
    return float(of_environment + of_gear)


def sample_ship(model: ShipModel, dt: float, first_order: bool = False) -> SampledShip:
    """Linearise a ship and her steering gear about straight running, and sample her.

    The order is held over each interval. A gear without lag is taken to reach its order
    within the interval. In a table with a memory of yaw, the memory stands in the place
    of sway. Raises InputError if the model has no straight course.

    Parameters
    ----------
    model : ShipModel
    dt : float
        Control interval, s.
    first_order : bool
        Whether yaw is reduced to K / (1 + T s), without sway or memory.
    """
    about, steering, rudder = small_motions(model)
    linear = np.column_stack([steering, rudder])
    if first_order:
        linear = _first_order(nomoto(model), model.travel_time)

    lag = model.steering.time_constant
    A, B = sampled(linear, lag, dt)
    return SampledShip(
        A=A,
        B=B[:, None],
        dt=dt,
        about=about,
    )


def _first_order(form: Nomoto, travel_time: float) -> Floats:
    """Nomoto's form as `sampled` takes it; sway decays in one ship length."""
    sway_decay = 1.0 / travel_time
    yaw_decay = 1.0 / form.T
    return np.array(
        [
            [-sway_decay, 0.0, 0.0],
            [0.0, -yaw_decay, form.rudder_effect],
        ]
    )


def sampled(linear: Floats, lag: float, dt: float) -> tuple[Floats, Floats]:
    """Sample a ship with her steering gear by a zero-order hold of the rudder order.

    Parameters
    ----------
    linear : array of shape (2, 3)
        d/dt (v, r) per sway, yaw rate and rudder, SI units.
    lag : float
        Of the steering gear, s; 0 for one that follows within the interval.
    dt : float
        Control interval, s.

    Returns
    -------
    A : array of shape (5, 5)
    B : array of shape (5,)
    """
    from scipy.linalg import expm

    flow = _held_flow(linear, lag)
    held = expm(dt * flow)
    n = len(SIGNALS)
    A = np.zeros((n, n))
    B = np.zeros(n)
    states = slice(ORDER)  # sway, yaw rate, heading error and rudder
    A[states, states] = held[states, states]
    B[states] = held[states, ORDER]
    if lag == 0.0:
        A[RUDDER] = 0.0
        B[RUDDER] = 1.0

    # the environment adds each new error to the integral
    A[INTEGRAL] = dt * A[ERROR]
    A[INTEGRAL, INTEGRAL] = 1.0
    B[INTEGRAL] = dt * B[ERROR]
    return A, B


def _held_flow(linear: Floats, lag: float) -> Floats:
    """Rates of motions, heading error and rudder, while the order is held.

    It comes last, in the place `ORDER`. For `linear` and `lag` see `sampled`.
    """
    motions = slice(ERROR)
    by_rudder = linear[:, ERROR]
    flow = np.zeros((ORDER + 1, ORDER + 1))
    flow[motions, motions] = linear[:, motions]
    flow[ERROR, YAW_RATE] = -1.0
    if lag > 0.0:
        flow[motions, RUDDER] = by_rudder
        flow[RUDDER, RUDDER] = -1.0 / lag
        flow[RUDDER, ORDER] = 1.0 / lag
    else:
        flow[motions, ORDER] = by_rudder
    return flow
