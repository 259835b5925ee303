"""Feed the helm with valid sentences that lie, and with a rough sea that does not.

    python scripts/lying_sentences.py               every feed: seconds, degrees off
    python scripts/lying_sentences.py --honest 24   false alarms in so many hours

A simulated ship sails in a rough sea and is steered through her sentences. At some time
one of her instruments begins to lie. Each feed must end in an alarm within 10 s from
when the lie exceeds the tolerance of its quantity (`shipgym/trials/nmea.toml`), and
before the ship is 20 degrees off the heading that she has without the lie. Feeds that
cannot be seen are marked with the reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from math import ceil, degrees, inf, pi, radians
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import typer
from joblib import Parallel, delayed

import agents
from agents import LQ, PID, LineOfSight, TurnRate, WheelOver
from agents.export.helm import MANUAL, STEERING, Helm
from agents.export.route import Route
from agents.export.sensors import Limits
from agents.export.simulated import START, STEP, SimulatedShip
from shipgym import ShipModel, load_model
from shipgym.tasks.guidance import wrapped
from shipgym.tasks.task import Task
from shipgym.trials.nmea import NMEA_QUANTITIES

Readings = dict[str, float]
Lie = Callable[["LyingShip", Readings, float], Readings]

LONGEST_S, MOST_OFF_DEG = 10.0, 20.0
ANGLES = ("heading", "course", "rudder")
WARM_S = 60.0  # until a lie begins


class LyingShip(SimulatedShip):
    """Ship whose instruments tell the truth until a lie begins.

    A `lie` gets the ship, her true readings and the seconds since it began, and returns
    the false ones.
    """

    lie: Lie | None = None
    begins = inf
    gear_works = True
    asked = 0.0  # rudder, rad
    largest_lie = 0.0  # in tolerances of its quantity
    shown = 0.0  # rudder, rad
    stood_at = 0.0  # heading, rad
    angle_of_lie = 0.0  # integral of the error of the rate of turn, rad

    def hear(self, line: str, source: str = "") -> None:
        """Take a rudder order if the steering gear works."""
        before = self.order
        super().hear(line, source)
        self.asked = self.order
        if not self.gear_works:
            self.order = before

    def measured(self) -> Readings:
        """Readings, true or not."""
        true = super().measured()
        seconds = self.steps * self.step - self.begins
        if self.lie is None or seconds < 0.0:
            return true
        false = self.lie(self, true, seconds)
        self.largest_lie = self._size(true, false)
        return true | false

    def _size(self, true: Readings, false: Readings) -> float:
        """Largest error, in tolerances; that of a rate by the angle that it makes."""
        sizes = [0.0]
        for quantity, value in false.items():
            off = value - true[quantity]
            if quantity == "yaw_rate":
                self.angle_of_lie += off * self.step
                off = self.angle_of_lie
                quantity = "heading"
            if quantity in ANGLES:
                off = float(wrapped(off))
            tolerance = NMEA_QUANTITIES[quantity].tolerance or inf
            sizes.append(abs(off) / tolerance)
        return max(sizes)


# Lies of one quantity


@dataclass
class Stuck:
    """Readings that stay as they were when the lie began, or at a value."""

    quantities: tuple[str, ...]
    value: float | None = None
    kept: Readings = field(default_factory=dict)

    def __call__(self, ship: LyingShip, true: Readings, seconds: float) -> Readings:
        """Readings as they were."""
        for quantity in self.quantities:
            value = true[quantity] if self.value is None else self.value
            self.kept.setdefault(quantity, value)
        return self.kept


def changed(quantity: str, factor: float = 1.0, offset: float = 0.0) -> Lie:
    """A reading times a factor plus an offset."""

    def lie(ship: LyingShip, true: Readings, seconds: float) -> Readings:
        return {quantity: factor * true[quantity] + offset}

    return lie


def drifting(quantity: str, per_second: float, and_rate: bool = False) -> Lie:
    """A reading that drifts away, and a rate of turn that is derived from it."""

    def lie(ship: LyingShip, true: Readings, seconds: float) -> Readings:
        false = {quantity: true[quantity] + per_second * seconds}
        if and_rate:
            false["yaw_rate"] = true["yaw_rate"] + per_second
        return false

    return lie


def alternating(apart: float, every: float, quantity: str = "heading") -> Lie:
    """Two instruments of one talker that differ and speak in turn."""

    def lie(ship: LyingShip, true: Readings, seconds: float) -> Readings:
        is_second = int(seconds / every + 1e-6) % 2 == 0
        return {quantity: true[quantity] + (apart if is_second else 0.0)}

    return lie


def noisy(quantity: str, deviation: float) -> Lie:
    """White noise on a reading."""
    random = np.random.default_rng(0)

    def lie(ship: LyingShip, true: Readings, seconds: float) -> Readings:
        return {quantity: true[quantity] + deviation * random.standard_normal()}

    return lie


def rounded(quantity: str, to: float) -> Lie:
    """A reading with a coarse resolution."""

    def lie(ship: LyingShip, true: Readings, seconds: float) -> Readings:
        return {quantity: to * round(true[quantity] / to)}

    return lie


def late(quantity: str, delay: float) -> Lie:
    """A reading that is old."""
    kept: list[float] = []

    def lie(ship: LyingShip, true: Readings, seconds: float) -> Readings:
        kept.append(true[quantity])
        age = min(len(kept), round(delay / STEP))
        return {quantity: kept[-age]}

    return lie


def course_as_heading(ship: LyingShip, true: Readings, seconds: float) -> Readings:
    """A heading that is made of the course over ground."""
    return {"heading": true["course"]}


def dead_gear(ship: LyingShip, true: Readings, seconds: float) -> Readings:
    """A gear that stands, while its feedback follows the order."""
    ship.gear_works = False
    if seconds < STEP:
        ship.shown = true["rudder"]
    reach = radians(3.0) * STEP
    ship.shown += min(max(ship.asked - ship.shown, -reach), reach)
    return {"rudder": ship.shown}


DEG = radians(1.0)


def lies() -> dict[str, Callable[[], Lie]]:
    """Lies by name; each call makes one that has not begun."""
    return {**of_heading(), **of_rate(), **of_both(), **of_rudder(), **of_course()}


def of_heading() -> dict[str, Callable[[], Lie]]:
    """Lies of the compass."""
    found: dict[str, Callable[[], Lie]] = {
        "heading frozen": _of(Stuck, ("heading",)),
        "heading 0": _of(Stuck, ("heading",), 0.0),
        "heading mirrored": _of(changed, "heading", -1.0),
        "heading times 2": _of(changed, "heading", 2.0),
        "heading halved": _of(changed, "heading", 0.5),
        "heading in steps of 10 deg": _of(rounded, "heading", 10.0 * DEG),
        "heading is the course": lambda: course_as_heading,
    }
    for jump in (180.0, 90.0, -60.0, 30.0, -20.0, 10.0):
        name = f"heading jumps by {jump:g} deg"
        found[name] = _of(changed, "heading", offset=jump * DEG)
    for drift in (2.0, 1.0, -1.0, 0.5, -0.3):
        name = f"heading drifts by {drift:g} deg/s"
        found[name] = _of(drifting, "heading", drift * DEG)
    for apart, every in product((180.0, 60.0, 20.0), (0.1, 0.5, 1.0, 5.0)):
        name = f"two compasses {apart:g} deg apart, each {every:g} s"
        found[name] = _of(alternating, apart * DEG, every)
    for deviation in (20.0, 5.0, 2.0):
        name = f"heading with noise of {deviation:g} deg"
        found[name] = _of(noisy, "heading", deviation * DEG)
    for delay in (5.0, 20.0):
        found[f"heading {delay:g} s late"] = _of(late, "heading", delay)
    return found


def of_rate() -> dict[str, Callable[[], Lie]]:
    """Lies of the rate gyro."""
    found: dict[str, Callable[[], Lie]] = {
        "rate 0": _of(Stuck, ("yaw_rate",), 0.0),
        "rate stuck": _of(Stuck, ("yaw_rate",)),
        "rate reversed": _of(changed, "yaw_rate", -1.0),
    }
    for factor in (60.0, 2.0, 0.5, 1.0 / 60.0):
        found[f"rate times {factor:.3g}"] = _of(changed, "yaw_rate", factor)
    for offset in (2.0, -1.0, 0.5):
        name = f"rate off by {offset:g} deg/s"
        found[name] = _of(changed, "yaw_rate", offset=offset * DEG)
    for deviation in (10.0, 3.0):
        name = f"rate with noise of {deviation:g} deg/s"
        found[name] = _of(noisy, "yaw_rate", deviation * DEG)
    for delay in (5.0, 20.0):
        found[f"rate {delay:g} s late"] = _of(late, "yaw_rate", delay)
    return found


def of_both() -> dict[str, Callable[[], Lie]]:
    """Lies of one device for heading and rate."""
    found: dict[str, Callable[[], Lie]] = {
        "heading and rate frozen": _of(Stuck, ("heading", "yaw_rate")),
        "heading frozen, rate 0": lambda: both_still,
    }
    for drift in (1.0, -0.5, 0.2, 0.05, 0.01):
        name = f"heading and its rate drift by {drift:g} deg/s"
        found[name] = _of(drifting, "heading", drift * DEG, and_rate=True)
    return found


def of_rudder() -> dict[str, Callable[[], Lie]]:
    """Lies of the rudder's feedback."""
    found: dict[str, Callable[[], Lie]] = {
        "rudder stuck": _of(Stuck, ("rudder",)),
        "rudder 0": _of(Stuck, ("rudder",), 0.0),
        "rudder reversed": _of(changed, "rudder", -1.0),
        "rudder follows its order, the gear stands": lambda: dead_gear,
    }
    for offset in (-20.0, 10.0):
        name = f"rudder off by {offset:g} deg"
        found[name] = _of(changed, "rudder", offset=offset * DEG)
    return found


def of_course() -> dict[str, Callable[[], Lie]]:
    """Lies of the GNSS receiver and the log."""
    found: dict[str, Callable[[], Lie]] = {
        "course stuck": _of(Stuck, ("course",)),
        "speed over ground 0": _of(Stuck, ("speed",), 0.0),
        "log 0": _of(Stuck, ("surge",), 0.0),
    }
    for jump in (180.0, 90.0, -40.0, 10.0):
        name = f"course jumps by {jump:g} deg"
        found[name] = _of(changed, "course", offset=jump * DEG)
    for drift in (1.0, 0.2):
        name = f"course drifts by {drift:g} deg/s"
        found[name] = _of(drifting, "course", drift * DEG)
    return found


def _of(kind: Callable[..., Lie], *values: Any, **named: Any) -> Callable[[], Lie]:
    return lambda: kind(*values, **named)


def both_still(ship: LyingShip, true: Readings, seconds: float) -> Readings:
    """A compass that stands and derives its rate of turn from that."""
    if seconds < STEP:
        ship.stood_at = true["heading"]
    return {"heading": ship.stood_at, "yaw_rate": 0.0}


class Bridge(NamedTuple):
    """A ship and her autopilot."""

    model: ShipModel
    agent: Any
    turns: bool  # by 90 degrees, just before the lie
    weather: str | None = "rough"
    seed: int = 1


class Outcome(NamedTuple):
    """What came of a feed."""

    alarm: str
    after_s: float  # since the lie began
    shown_s: float  # since it exceeded the tolerance of its quantity
    off_deg: float  # off the heading that the ship has without the lie

    @property
    def is_in_time(self) -> bool:
        """True for an alarm that is neither late nor early."""
        is_soon = self.after_s >= 0.0 and self.shown_s <= LONGEST_S
        return bool(self.alarm) and is_soon and self.off_deg < MOST_OFF_DEG


def voyage(
    bridge: Bridge, lie: Lie | None, seconds: float, limits: Limits | None = None
) -> Iterator[tuple[Helm, LyingShip]]:
    """Sail, steered by sentences; the helm and the ship after each step."""
    ship = LyingShip(bridge.model, weather=bridge.weather, seed=bridge.seed)
    ship.lie = lie
    ship.begins = WARM_S
    helm = Helm(bridge.agent, 0.0, limits or Limits())
    tick = helm.pilot.dt / ceil(helm.pilot.dt - 1e-9)
    for number in range(round(seconds / STEP)):
        now = number * STEP
        if bridge.turns and now >= WARM_S - 10.0:
            helm.heading = 0.5 * pi
        for line in ship.sentences().splitlines():
            helm.hear(line, "", now)
        steer(helm, ship, now, tick)
        ship.advance()
        yield helm, ship


def steer(helm: Helm, ship: SimulatedShip, now: float, tick: float) -> None:
    """Let the helm act if a control tick or interval is due."""
    number = round(now / STEP)
    if number % round(tick / STEP):
        return
    helm.watch(tick, now)
    if number % round(helm.pilot.dt / STEP) == 0:
        helm.steer(now)
    for line in helm.sentences().splitlines():
        ship.hear(line)


def honest(bridge: Bridge, seconds: float) -> list[float]:
    """True headings without a lie, rad, step by step."""
    return [ship.now["psi"] for _, ship in voyage(bridge, None, seconds)]


def outcome(bridge: Bridge, lie: Lie, true: list[float]) -> Outcome:
    """Sail with a lie until the alarm, or as long as the honest ship did."""
    shown_at = inf
    largest = 0.0
    alarm = ""
    now = 0.0
    seconds = len(true) * STEP
    for number, (helm, ship) in enumerate(voyage(bridge, lie, seconds)):
        now = number * STEP
        if ship.largest_lie > 1.0:
            shown_at = min(shown_at, now)
        off = abs(float(wrapped(ship.now["psi"] - true[number])))
        largest = max(largest, off)
        if helm.state == MANUAL:
            alarm = helm.alarm
            break
    return Outcome(alarm, now - WARM_S, now - shown_at, degrees(largest))


def bridges() -> dict[str, Bridge]:
    """Ships and autopilots of the study."""
    found = {}
    for name, kind in (("mariner", PID), ("container", LQ), ("kvlcc2-mmg", TurnRate)):
        model = load_model(name)
        agent = kind.from_model(model)
        for turns in (False, True):
            manner = "turning" if turns else "straight"
            found[f"{name}, {agent.kind}, {manner}"] = Bridge(model, agent, turns)
    return found


class Worst(NamedTuple):
    """The worst that a lie did, over ships and manners."""

    feeds: int
    alarms: int
    in_time: int
    shown_s: float  # longest time to an alarm
    off_deg: float
    alarm: str  # of the last feed that has one


def worst_of(outcomes: list[Outcome]) -> Worst:
    """The worst of one lie."""
    alarmed = [found for found in outcomes if found.alarm]
    in_time = [found for found in alarmed if found.is_in_time]
    return Worst(
        feeds=len(outcomes),
        alarms=len(alarmed),
        in_time=len(in_time),
        shown_s=max([found.shown_s for found in alarmed], default=inf),
        off_deg=max(found.off_deg for found in outcomes),
        alarm=alarmed[-1].alarm if alarmed else "-",
    )


def main(
    hours: float = typer.Option(0.0, "--honest", help="Hours without a lie."),
    seconds: float = typer.Option(120.0, help="How long each lie lasts."),
    only: str = typer.Option("", help="Feeds whose name has this in it."),
    workers: int = typer.Option(1, help="Processes."),
) -> None:
    """Run the study."""
    if hours:
        print_honest(hours, workers)
        return
    chosen = {name: make for name, make in lies().items() if only in name}
    by_lie: dict[str, list[Outcome]] = {name: [] for name in chosen}
    for bridge in bridges().values():
        true = honest(bridge, WARM_S + seconds)
        outcomes = Parallel(workers)(
            delayed(outcome)(bridge, make(), true) for make in chosen.values()
        )
        for name, found in zip(chosen, outcomes, strict=True):
            by_lie[name].append(found)
    print_table(by_lie)


def print_table(by_lie: dict[str, list[Outcome]]) -> None:
    """Print the table of the page."""
    print("| lie | alarms | within 10 s | longest, s | off, deg | alarm |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, outcomes in by_lie.items():
        worst = worst_of(outcomes)
        longest = f"{worst.shown_s:.0f}"
        if worst.shown_s == inf:
            longest = "-"
        elif worst.shown_s < 0.0:
            longest = "before it shows"
        print(
            f"| {name} | {worst.alarms} of {worst.feeds} | {worst.in_time} |"
            f" {longest} | {worst.off_deg:.1f} | {worst.alarm} |"
        )
    everything = [found for outcomes in by_lie.values() for found in outcomes]
    worst = worst_of(everything)
    print(
        f"\n{worst.feeds} feeds, {worst.alarms} alarms, {worst.in_time} of them within"
        f" {LONGEST_S:g} s; at most {worst.off_deg:.1f} deg off"
    )


class HonestVoyage(NamedTuple):
    """A voyage in a rough sea with course changes of 60 to 180 degrees."""

    model: str
    kind: str
    seed: int


def honest_voyages() -> list[HonestVoyage]:
    """Ships and autopilots of the study of false alarms."""
    kinds = ("PID", "LQ", "LQG", "TurnRate", "LineOfSight", "WheelOver")
    ships = ("mariner", "container", "kvlcc2-mmg", "tanker-tls-svm")
    pairs = product(kinds, ships)
    return [HonestVoyage(model, kind, seed) for seed, (kind, model) in enumerate(pairs)]


def print_honest(hours: float, workers: int) -> None:
    """Share the hours out to ships and autopilots, and print their alarms."""
    voyages = honest_voyages()
    seconds = 3600.0 * hours / len(voyages)
    begin = perf_counter()
    alarms = Parallel(workers)(delayed(sail_honestly)(one, seconds) for one in voyages)
    lasted_s = perf_counter() - begin
    for one, alarm in zip(voyages, alarms, strict=True):
        print(f"{one.model}, {one.kind}: {alarm or 'no alarm'}")
    false = sum(bool(alarm) for alarm in alarms)
    print(
        f"{hours:g} hours, {false} false alarms,"
        f" {3600.0 * hours / lasted_s:.0f} times real time"
    )


def sail_honestly(one: HonestVoyage, seconds: float) -> str:
    """Alarm of a voyage without a lie; empty without one."""
    model = load_model(one.model)
    agent = honest_agent(one.kind, model)
    ship = SimulatedShip(model, weather="rough", seed=one.seed)
    is_routed = one.kind == "WheelOver"
    route = zigzag_route(agent) if is_routed else None
    is_free = one.kind not in ("WheelOver", "LineOfSight")
    helm = Helm(agent, 0.0 if is_free else None, Limits(), route)
    tick = helm.pilot.dt / ceil(helm.pilot.dt - 1e-9)
    random = np.random.default_rng(one.seed)

    between_turns = round(600.0 / STEP)
    for number in range(round(seconds / STEP)):
        if number % between_turns == between_turns - 1:
            turn = random.choice([-1.0, 1.0]) * radians(random.uniform(60.0, 180.0))
            if is_free:
                helm.heading = ((helm.heading or 0.0) + turn) % (2.0 * pi)
        now = number * STEP
        for line in ship.sentences().splitlines():
            helm.hear(line, "", now)
        steer(helm, ship, now, tick)
        ship.advance()
        if helm.state == MANUAL:
            return f"{now:.0f} s: {helm.alarm}"
    return "" if helm.state == STEERING else helm.status


def honest_agent(kind: str, model: ShipModel) -> Any:
    """Autopilot of a kind; guidance leads an LQ."""
    if kind == "WheelOver":
        return WheelOver.from_model(model, task=Task.of("PathFollowing"))
    if kind == "LineOfSight":
        return LineOfSight.from_model(model, autopilot=LQ.from_model(model))
    return getattr(agents, kind).from_model(model)


def zigzag_route(agent: Any) -> Route:
    """Route to the north with corners of 90 degrees every two miles."""
    corners = []
    for number in range(24):
        north = 2.0 * (number // 2 + number % 2)
        east = 2.0 * (number // 2)
        latitude = START[0] + north / 60.0
        longitude = START[1] + east / 60.0 / np.cos(radians(START[0]))
        corners.append([latitude, longitude])
    return Route(np.array(corners), agent.gains["path_radius"])


if __name__ == "__main__":
    typer.run(main)
