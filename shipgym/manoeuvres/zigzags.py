"""Zigzags (Kempf 1932) and their indices (IMO MSC/Circ.1053, ITTC 7.5-04-02-01)."""

from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Literal

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number
from shipgym.errors import ManoeuvreError
from shipgym.manoeuvres.execution import (
    distance_sailed,
    is_ordered,
    number_of_steps,
    reached,
    reversals,
    ship_length,
    usual_rudder,
)
from shipgym.manoeuvres.registry import SIDES, Manoeuvre, standard_time
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import Passage, Seed, as_trial, orders
from shipgym.sea.conditions import Weather
from shipgym.trials.trial import Trial

STANDARD_DEG = (10.0, 20.0)


@dataclass(frozen=True)
class ZigzagIndices:
    """Indices of a zigzag; None if the manoeuvre ended earlier."""

    # heading beyond that at which the rudder was reversed for the first and the second
    # time, degrees
    overshoot_1_deg: float | None
    overshoot_2_deg: float | None
    # distance sailed from the first order to the first reversal, ship lengths
    initial_turning_lengths: float | None
    period_s: float | None  # time from the first to the third reversal, s


@takes_name
def zigzag(
    model: ShipModel,
    rudder_deg: float = 20.0,
    heading_deg: float = 20.0,
    port_first: bool = False,
    duration: float = 600.0,
    dt: float = 0.1,
    switch: Literal["inside", "step"] = "inside",
    water_depth: float = np.inf,
    must_reverse: bool = True,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Trial:
    """Simulate a zigzag from straight ahead at service speed, without an approach run.

    The trial has the rudder ordered from each sample on in `delta_command`.

    Raises InputError for an angle, a duration or a step that is not above 0. Raises
    ManoeuvreError if the heading of the first reversal is never reached; with the trial
    so far. Raises UnstableModelError if the ship runs away.

    Parameters
    ----------
    model : ShipModel
    rudder_deg, heading_deg : float
        Rudder angle ordered and heading change at which it is reversed, degrees.
    port_first : bool
        Whether the first order is to port.
    duration, dt : float
        s. The samples are dt apart.
    switch : {"inside", "step"}
        Reverse the rudder at the instant at which the heading is reached, inside a
        step, or at the first sample at which it has been reached.
    water_depth : float
        m, for ships whose equations cover shallow water.
    must_reverse : bool
        Whether a ship that never reaches the heading of the first reversal is an error.
    weather : Weather or str, optional
        A weather or the name of a sea state. The rudder is reversed by the heading
        without first-order motion in waves, as a helmsman does who sees through it.
    seed : int or Generator
        Of the weather.
    """
    check_number(rudder_deg, "rudder_deg", above=0.0, at_most=90.0)
    check_number(heading_deg, "heading_deg", above=0.0, at_most=180.0)
    n_steps = number_of_steps(duration, dt)
    check_choice(switch, ("inside", "step"), "switch")
    angle = np.radians(rudder_deg)

    passage = Passage(model, dt, water_depth, weather, seed)
    states = passage.states(model.service_state, n_steps)
    rudder = np.empty(n_steps + 1)
    _, n_reversals = passage.run(
        "zigzag",
        states,
        rudder,
        -angle if port_first else angle,
        np.radians(heading_deg),
        model.service_shaft_speed,
        dt,
        switch == "inside",
    )
    trial = as_trial(model, dt, states, orders(model, rudder), kind="zigzag")
    if must_reverse and n_reversals == 0:
        raise ManoeuvreError(
            f"zigzag {rudder_deg:g}/{heading_deg:g} of {model.name!r}: expected the"
            f" heading to change by {heading_deg:g} deg, where the rudder is reversed,"
            f" got less in {trial.duration:g} s; sail longer, or order more rudder or"
            " less heading",
            trial,
        )
    return trial


def zigzag_indices(
    trial: Trial, length: float | None = None, heading_deg: float | None = None
) -> ZigzagIndices:
    """Overshoots, initial turning and period of a measured or simulated zigzag.

    The trial has psi and delta (or delta_command), and u and v for the distance;
    `length`, between perpendiculars, m, is by default the trial's own; `heading_deg` is
    the heading change at which the rudder had to be reversed, degrees, by default
    `switch_heading_deg`. InputError for a missing channel or length.
    """
    start, turns = reversals(trial)
    switch = heading_deg or switch_heading_deg(trial)
    if not turns or switch is None:
        return ZigzagIndices(None, None, None, None)

    overshoots = [
        _overshoot_deg(trial, start, turn, end, switch)
        for turn, end in pairwise([*turns, float(trial.t[-1])])
    ]
    lpp = ship_length(trial, length)
    return ZigzagIndices(
        overshoot_1_deg=overshoots[0],
        overshoot_2_deg=overshoots[1] if len(turns) > 1 else None,
        initial_turning_lengths=_initial_turning(trial, start, switch, lpp),
        period_s=turns[2] - turns[0] if len(turns) > 2 else None,
    )


def _initial_turning(
    trial: Trial,
    start: float,
    threshold_deg: float,
    length: float,
) -> float | None:
    """Lengths sailed from the first order to the heading threshold, if reached."""
    after = trial.t >= start
    change_deg = np.abs(_heading_change_deg(trial, start))
    when = reached(change_deg[after], threshold_deg, trial.t[after])
    if when is None:
        return None
    sailed = distance_sailed(trial)
    before, then = np.interp([start, when], trial.t, sailed)
    return float(then - before) / length


def switch_heading_deg(trial: Trial) -> float | None:
    """Heading change at which the rudder was to be reversed, degrees; None if never.

    Orders are given in whole degrees, in trials nearly always 1 or a multiple of 5, and
    carried out after a delay in which the heading moves on, by up to 3 degrees or 0.6 s
    of turning. So it is such an angle that had been reached, to 5 per cent, at the
    first reversal: the angle of the rudder, as in a 20/20 zigzag, else the largest;
    without one the heading of the reversal itself. Where orders are recorded, it was
    reached in the sampling step of the first reversal.
    """
    start, turns = reversals(trial)
    if not turns:
        return None
    turn = turns[0]
    change_deg = np.abs(_heading_change_deg(trial, start))
    before = float(change_deg[np.searchsorted(trial.t, turn) - 1])
    second_before, at = np.interp(
        [turn - 1.0, turn],
        trial.t,
        change_deg,
    ).tolist()

    rudder_deg = np.degrees(usual_rudder(trial))
    angles = [*range(90, 0, -5), 1]
    angles.sort(key=lambda angle: abs(angle - rudder_deg) > 1.0)
    if is_ordered(trial):
        slack = 1e-6 + min(3.0 * course_error_deg(trial), 2.0)
        lowest, highest = min(before, at) - slack, max(before, at) + slack
        angles.append(int(max(before, at) + 1e-6))
        otherwise = 0.5 * (before + at)
    else:
        yaw_rate = abs(at - second_before)  # deg/s
        lowest, highest = at - max(3.0, 0.6 * yaw_rate), at / 0.95
        otherwise = at
    fitting = [angle for angle in angles if lowest <= angle <= highest]
    return float(fitting[0]) if fitting else float(otherwise)


def course_error_deg(trial: Trial) -> float:
    """Standard deviation of the heading up to the first order, degrees.

    So well is the course known from which the helmsman counted.
    """
    start, _ = reversals(trial)
    approach = trial["psi"][trial.t <= start]
    return float(np.degrees(np.std(approach)))


def _heading_change_deg(trial: Trial, start: float) -> Floats:
    """Heading less its mean up to the start, degrees."""
    psi = trial["psi"]
    approach = psi[trial.t <= start].mean()
    return np.asarray(np.degrees(psi - approach))


def _overshoot_deg(
    trial: Trial,
    start: float,
    turn: float,
    end: float,
    switch: float,
) -> float | None:
    """Heading beyond that of the reversal at time `turn`; None if growing at `end`."""
    is_after = (trial.t >= turn) & (trial.t <= end)
    change_deg = _heading_change_deg(trial, start)[is_after]
    if len(change_deg) < 3:
        return None
    change_deg *= np.sign(change_deg[0])
    largest = int(np.argmax(change_deg))
    if largest == len(change_deg) - 1:
        return None
    return float(change_deg[largest]) - switch


def standard_zigzags(model: ShipModel) -> dict[str, Manoeuvre]:
    """Zigzags 10/10 and 20/20 to both sides; one that never reverses has no indices."""
    duration, dt = standard_time(model)
    zigzags = {}
    for angle in STANDARD_DEG:
        for side, sign in SIDES:
            sail = partial(
                zigzag,
                rudder_deg=angle,
                heading_deg=angle,
                port_first=sign < 0.0,
                duration=duration,
                dt=dt,
                must_reverse=False,
            )
            name = f"zigzag {angle:.0f}/{angle:.0f}, {side} first"
            zigzags[name] = Manoeuvre(sail, zigzag_indices, ZigzagIndices)
    return zigzags
