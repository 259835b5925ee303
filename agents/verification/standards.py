"""What a simulation shows of the standards of heading control (ISO 11674) and track control (IEC 62065).

The identified ship is steered as `shipgym steer` would, by readings of her instruments
instead of sentences. Topics, and the limits that are used, stand in `standards.toml`.
No type approval follows from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.lqg import LQG
from agents.controllers.turn_rate import TurnRate
from agents.deployment.helm import Helm
from agents.deployment.nmea import NmeaReading
from agents.deployment.route import Route
from agents.deployment.sensors import Limits
from agents.deployment.simulated import MINUTE, START, SimulatedShip
from agents.verification.tracks import Track, track_task
from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.files import read_toml
from shipgym.sea.conditions import sea_states
from shipgym.sea.waves import encounter_frequency
from shipgym.ships import ShipModel

REQUIREMENTS = read_toml(
    Path(__file__).with_name("standards.toml"), "table of standards"
)
# of a run, times to travel a ship length; the first quarter does not count for keeping
LENGTHS = 40.0
PER_INTERVAL = 2  # steps of the simulation in a control interval
TURN_DEG, RUDDER_DEG, OFF_TRACK_M, LOST_S = (
    30.0,
    10.0,
    50.0,
    60.0,
)  # settings; when a sensor falls silent


@dataclass(frozen=True)
class Row:
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
        """Whether it is met; None where that is not known."""
        if self.value is None:
            return None
        return self.value >= self.limit if self.least else self.value <= self.limit


class Run(NamedTuple):
    """What was recorded once in each control interval."""

    t: Floats  # s
    error: Floats  # of the heading, deg
    yaw_rate: Floats  # rad/s
    rudder: Floats  # deg
    order: Floats  # deg
    given: list[dict[str, Any]]  # to the autopilot
    warnings: list[list[str]]
    alarm: str
    alarm_at: float  # s, one interval after the last that was steered


def run(
    helm: Helm, ship: SimulatedShip, seconds: float, lost: Sequence[str] = ()
) -> Run:
    """Steer a ship until the autopilot hands over; the quantities in `lost` fall silent after `LOST_S`."""
    dt, given, warnings = helm.pilot.dt, list[dict[str, Any]](), list[list[str]]()
    rows: list[tuple[float, ...]] = []
    while (now := len(rows) * dt) < seconds:
        known = ship.measured()
        for name, value in known.items():
            if name not in lost or now < LOST_S:
                helm.sensors.take(NmeaReading(name, value, "II"), now)
        helm.watch(dt, now)
        helm.steer(now)
        if helm.alarm:
            break
        off = np.degrees((helm.heading or 0.0) - known["heading"])
        rows.append(
            (now, off, known["yaw_rate"], *np.degrees([known["rudder"], helm.order]))
        )
        given.append(helm.inputs(now))
        warnings.append(helm.warnings)
        ship.order = helm.order
        for _ in range(PER_INTERVAL):
            ship.advance()
    t, error, rate, rudder, order = np.array(rows).T
    alarm_at = len(rows) * dt if helm.alarm else np.inf
    return Run(t, error, rate, rudder, order, given, warnings, helm.alarm, alarm_at)


def standards(
    model: ShipModel, pilot: Controller, tracks: Sequence[Track]
) -> list[Row]:
    """Each requirement for a heading autopilot, and for the first of the path autopilots on a ship.

    What the ship's particulars do not allow, such as waves, has no value.
    """
    found = heading_control(model, pilot) | _sea(model, pilot) | _rate_of_turn(model)
    found |= track_control(model, tracks[0]) if tracks else {}
    rows = {name: {"least": False, **about} for name, about in REQUIREMENTS.items()}
    return [
        Row(name=name, **about, value=found.get(name)) for name, about in rows.items()
    ]


def kept(
    model: ShipModel,
    pilot: Controller,
    sea: str = "calm",
    heading: float = 0.0,
    **more: Any,
) -> Run:
    """Steer a ship to a heading, deg, from straight running; `more`: limits, rate, what falls silent."""
    lost, step = more.pop("lost", ()), pilot.design["dt"] / PER_INTERVAL
    ship, limits = (
        SimulatedShip(model, weather=sea, seed=1, step=step),
        more.pop("limits", Limits()),
    )
    helm = Helm(pilot, None if "rate" in more else radians(heading), limits, **more)
    return run(helm, ship, LENGTHS * model.travel_time, lost)


def heading_control(model: ShipModel, pilot: Controller) -> dict[str, float]:
    """Values of heading control in calm water."""
    narrow, turn = Limits(order_deg=RUDDER_DEG), kept(model, pilot, heading=TURN_DEG)
    small = kept(model, pilot, heading=TURN_DEG, limits=narrow)
    return {
        "heading_calm": float(np.abs(_settled(kept(model, pilot).error)).max()),
        "overshoot": max(0.0, float(-turn.error.min())),
        "rudder_limit": (
            float(np.abs(small.order).max()) if abs(small.error[-1]) < 1.0 else np.inf
        ),
        "off_heading": (
            _unwarned(turn, np.abs(turn.error), "off heading") - narrow.off_heading_deg
        ),
        "heading_lost": kept(model, pilot, lost=["heading"]).alarm_at - LOST_S,
    }


def _sea(model: ShipModel, pilot: Controller) -> dict[str, float]:
    """Values of heading control in a seaway; none where the particulars do not tell what waves do."""
    seas, wave = (
        ("moderate", "rough"),
        2.0 * np.pi / sea_states()["moderate"].peak_period,
    )
    met = encounter_frequency(
        wave, model.particulars["speed"], radians(45.0)
    )  # from north-east
    period = 2.0 * np.pi / float(met)
    try:
        errors = {sea: _settled(kept(model, pilot, sea).error) for sea in seas}
        found = {
            f"heading_{sea}": float(np.sqrt(np.mean(e**2))) for sea, e in errors.items()
        }
        pilots = [LQG.from_model(model, wave_period=one) for one in (period, None)]
    except InputError:
        return {}
    travel = [
        np.abs(np.diff(_settled(kept(model, one, "moderate").rudder))).sum()
        for one in pilots
    ]
    return {**found, "sea_state": float(travel[0] / travel[1])}


def _rate_of_turn(model: ShipModel) -> dict[str, float]:
    """Value of a turn at a set rate; none where there is no steady turn."""
    try:
        pilot = TurnRate.from_model(model)
    except InputError:
        return {}
    rate = 0.8 * pilot.gains["rate"]
    off = np.abs(_settled(kept(model, pilot, rate=rate).yaw_rate) / rate - 1.0)
    return {"rate_of_turn": 100.0 * float(off.max())}


def track_control(model: ShipModel, track: Track) -> dict[str, float]:
    """Values of track control in the current of the track."""
    guide, length = track.controller, model.particulars["length"]
    limits, reach = Limits(off_track_m=OFF_TRACK_M), guide.gains["turn_reach"]
    along = _on_track(model, track, limits)
    before, last = (one["next_turn_distance"] for one in along.given[-2:])
    ended = along.t[-1] + last / (before - last) * guide.design["dt"]
    to_go = np.array(
        [
            one["next_turn_distance"] if one["next_turn_angle"] else np.nan
            for one in along.given
        ]
    )
    begun = np.flatnonzero((to_go[:-1] > reach) & (to_go[1:] <= reach)) + 1
    told = np.array(["course change ahead" in one for one in along.warnings])
    quiet = [np.flatnonzero(~told[:k]) for k in begun]
    leads = [
        along.t[k] - along.t[q[-1]] for k, q in zip(begun, quiet, strict=True) if len(q)
    ]
    aside = _on_track(model, track, limits, aside=3.0 * OFF_TRACK_M)
    off = np.array([abs(one["cross_track"]) for one in aside.given])
    lost = _on_track(model, track, limits, lost=("latitude", "longitude"))
    return {
        "cross_track": float(track.largest[0]) / length,
        "cross_track_drawn": float(np.quantile(track.largest[1:], 0.95)) / length,
        "early_indication": min(leads, default=0.0),
        "off_track": _unwarned(aside, off, "off track") - OFF_TRACK_M,
        "position_lost": lost.alarm_at - LOST_S,
        "route_ended": (
            float(along.alarm_at - ended)
            if "end of the route" in along.alarm
            else np.inf
        ),
    }


def _on_track(
    model: ShipModel, track: Track, limits: Limits, aside: float = 0.0, **more: Any
) -> Run:
    """Keep a ship to a track, from a distance to starboard of where it begins, m."""
    north, east = track.waypoints.T / MINUTE / 60.0
    latitude = START[0] + north
    places = np.column_stack([latitude, START[1] + east / np.cos(np.radians(latitude))])
    route = Route(places, track.controller.gains["path_radius"])
    step = track.controller.design["dt"] / PER_INTERVAL
    ship = SimulatedShip(model, weather=track_task(model).weather, step=step)
    ship.states[0, model.state_names.index("y")] = aside
    return run(
        Helm(track.controller, None, limits, route),
        ship,
        3.0 * LENGTHS * model.travel_time,
        **more,
    )


def _unwarned(found: Run, size: Floats, text: str) -> float:
    """Largest of something in intervals in which a warning was not given."""
    quiet = [text not in one for one in found.warnings]
    return float(np.max(size, where=np.array(quiet), initial=0.0))


def _settled(values: Floats) -> Floats:
    return values[len(values) // 4 :]
