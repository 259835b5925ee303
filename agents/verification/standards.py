"""Simulations of what standards of heading and track control ask for.

The standards are ISO 11674 (heading control) and IEC 62065 (track control). Topics, and
the limits that are used, stand in `standards.toml`. No type approval follows from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians
from pathlib import Path

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.lqg import LQG
from agents.controllers.turn_rate import TurnRate
from agents.export.sensors import Limits
from agents.verification.steered import (
    LOST_S,
    SteeredRun,
    settled,
    steer_along,
    steer_to_heading,
)
from agents.verification.tracks import Track
from identification.arrays import root_mean_square
from shipgym.arrays import Integers
from shipgym.errors import InputError
from shipgym.files import read_toml
from shipgym.manoeuvres.quantiles import upper_95
from shipgym.sea.sea_states import sea_states
from shipgym.sea.waves import encounter_frequency
from shipgym.ships import ShipModel

REQUIREMENTS = read_toml(
    Path(__file__).with_name("standards.toml"), "table of standards"
)
OFF_TRACK_M = 50.0  # the limit of the warning


@dataclass(frozen=True)
class Requirement:
    """One requirement and what the simulation shows of it."""

    name: str
    standard: str
    topic: str
    limit: float
    unit: str
    least: bool  # whether the limit is the least that passes, not the largest
    value: float | None  # None where it could not be simulated

    @property
    def passed(self) -> bool | None:
        """True if it is met; None where that is not known."""
        if self.value is None:
            return None
        return self.value >= self.limit if self.least else self.value <= self.limit


def standards(
    model: ShipModel, pilot: Controller, tracks: Sequence[Track]
) -> list[Requirement]:
    """Each requirement for a heading autopilot and for the first path autopilot.

    What the ship's particulars do not allow, such as waves, has no value.
    """
    values = heading_control(model, pilot)
    values |= heading_control_in_waves(model, pilot)
    values |= rate_of_turn(model)
    if tracks:
        values |= track_control(model, tracks[0])

    requirements = []
    for name, about in REQUIREMENTS.items():
        fields = {"least": False, **about}
        value = values.get(name)
        requirements.append(Requirement(name=name, **fields, value=value))
    return requirements


def heading_control(model: ShipModel, pilot: Controller) -> dict[str, float]:
    """Values of heading control in calm water."""
    rudder_deg = 10.0  # the limit set to the rudder
    narrow = Limits(order_deg=rudder_deg)
    turn_deg = 30.0  # change of heading
    turn = steer_to_heading(model, pilot, heading=turn_deg)
    small = steer_to_heading(model, pilot, heading=turn_deg, limits=narrow)
    straight = steer_to_heading(model, pilot)
    silent = steer_to_heading(model, pilot, lost=["heading"])
    return heading_values(
        turn=turn,
        small=small,
        straight=straight,
        silent=silent,
    )


def heading_values(
    turn: SteeredRun, small: SteeredRun, straight: SteeredRun, silent: SteeredRun
) -> dict[str, float]:
    """Values of heading control in calm water from runs.

    A turn, the same with a limit to the rudder, a straight course, and one on which the
    heading falls silent.
    """
    unwarned = turn.unwarned(np.abs(turn.error), "off heading")
    off_course = np.abs(settled(straight.error))
    overshoot = -float(turn.error.min())
    largest_order = np.inf
    if abs(small.error[-1]) < 1.0:  # she has come to the new heading
        largest_order = np.abs(small.order).max()
    return {
        "heading_calm": float(off_course.max()),
        "overshoot": max(0.0, overshoot),
        "rudder_limit": float(largest_order),
        "off_heading": unwarned - Limits().off_heading_deg,
        "heading_lost": silent.alarm_at - LOST_S,
    }


def heading_control_in_waves(model: ShipModel, pilot: Controller) -> dict[str, float]:
    """Values of heading control in a seaway; none if the particulars do not suffice."""
    period = _encounter_period(model)
    try:
        values = {}
        for sea in ("moderate", "rough"):
            run = steer_to_heading(model, pilot, sea)
            error = settled(run.error)
            values[f"heading_{sea}"] = root_mean_square(error)
        with_filter = LQG.from_model(model, wave_period=period)
        without = LQG.from_model(model, wave_period=None)
    except InputError:
        return {}
    filtered = _rudder_travel(model, with_filter)
    unfiltered = _rudder_travel(model, without)
    values["sea_state"] = filtered / unfiltered
    return values


def _encounter_period(model: ShipModel) -> float:
    """Period of the waves of a moderate sea as the ship meets them, s."""
    sea = sea_states()["moderate"]
    wave = 2.0 * np.pi / sea.peak_period
    north_east = radians(45.0)
    met = encounter_frequency(wave, model.particulars["speed"], north_east)
    return 2.0 * np.pi / float(met)


def _rudder_travel(model: ShipModel, pilot: Controller) -> float:
    """Rudder travel on a straight course in a moderate sea, deg."""
    run = steer_to_heading(model, pilot, "moderate")
    return float(np.abs(np.diff(settled(run.rudder))).sum())


def rate_of_turn(model: ShipModel) -> dict[str, float]:
    """Value of a turn at a set rate; none where there is no steady turn."""
    try:
        pilot = TurnRate.from_model(model)
    except InputError:
        return {}
    rate = 0.8 * pilot.gains["rate"]
    run = steer_to_heading(model, pilot, rate=rate)
    share = settled(run.yaw_rate) / rate
    off = np.abs(share - 1.0)
    largest = float(off.max())
    return {"rate_of_turn": 100.0 * largest}


def track_control(model: ShipModel, track: Track) -> dict[str, float]:
    """Values of track control in the current of the track."""
    limits = Limits(off_track_m=OFF_TRACK_M)
    far_aside = 3.0 * OFF_TRACK_M
    position = ("latitude", "longitude")
    along = steer_along(model, track, limits)
    aside = steer_along(model, track, limits, aside=far_aside)
    silent = steer_along(model, track, limits, lost=position)
    length = model.particulars["length"]
    own_error = float(track.largest[0])
    drawn_error = upper_95(track.largest[1:])
    return {
        "cross_track": own_error / length,
        "cross_track_drawn": drawn_error / length,
        **track_values(track.controller, along, aside, silent),
    }


def track_values(
    guide: Controller, along: SteeredRun, aside: SteeredRun, silent: SteeredRun
) -> dict[str, float]:
    """Values of track control from runs.

    Along the track, from a start far aside of it, and one on which the position falls
    silent.
    """
    off = np.array([abs(given["cross_track"]) for given in aside.given])
    route_ended = np.inf
    if "end of the route" in along.alarm:
        route_ended = along.alarm_at - _end_of_track(guide, along)
    return {
        "early_indication": _shortest_lead(guide, along),
        "off_track": aside.unwarned(off, "off track") - OFF_TRACK_M,
        "position_lost": silent.alarm_at - LOST_S,
        "route_ended": float(route_ended),
    }


def _end_of_track(guide: Controller, along: SteeredRun) -> float:
    """When the last waypoint is reached, s, at the speed of the last interval."""
    before, last = (given["next_turn_distance"] for given in along.given[-2:])
    intervals = last / (before - last)
    return float(along.t[-1] + intervals * guide.design["dt"])


def _shortest_lead(guide: Controller, along: SteeredRun) -> float:
    """Shortest time from the announcement of a turn to wheel-over, s; 0 without any."""
    quiet = ["course change ahead" not in given for given in along.warnings]
    leads = []
    for turn in _wheel_overs(guide, along):
        quiet_before = np.flatnonzero(quiet[:turn])
        if len(quiet_before):
            last = quiet_before[-1]
            leads.append(along.t[turn] - along.t[last])
    return min(leads, default=0.0)


def _wheel_overs(guide: Controller, along: SteeredRun) -> Integers:
    """Intervals in which the next turn comes within reach.

    The end of the route is no turn.
    """
    to_go = []
    for given in along.given:
        angle = given["next_turn_angle"]
        distance = given["next_turn_distance"] - guide.turn_reach(angle)
        to_go.append(np.nan if angle == 0.0 else distance)

    before = np.array(to_go[:-1])
    after = np.array(to_go[1:])
    enters = (before > 0.0) & (after <= 0.0)
    return 1 + np.flatnonzero(enters)
