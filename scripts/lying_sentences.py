"""Feed the helm with valid sentences that lie, and with a rough sea that does not.

    python scripts/lying_sentences.py               every feed: time to alarm, degrees off
    python scripts/lying_sentences.py --honest 24   false alarms in so many hours

A simulated ship sails in a rough sea and is steered through her sentences. At some time
one of her instruments begins to lie. Each feed must end in an alarm within 10 s from
when the lie exceeds the tolerance of its quantity (`shipgym/trials/nmea.toml`), and
before the ship is 20 degrees off the heading that she has without the lie. Feeds that
cannot be seen are marked with the reason.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from math import ceil, degrees, inf, pi, radians
from typing import Any, NamedTuple

import numpy as np
import typer
from joblib import Parallel, delayed

from agents import LQ, LQG, PID, LineOfSight, TurnRate, WheelOver
from agents.deployment.helm import MANUAL, Helm
from agents.deployment.route import Route
from agents.deployment.sensors import Limits
from agents.deployment.simulated import STEP, SimulatedShip
from shipgym import ShipModel, load_model
from shipgym.tasks.guidance import wrapped
from shipgym.tasks.task import Task
from shipgym.trials.nmea import NMEA_QUANTITIES

Readings = dict[str, float]
Lie = Callable[["LyingShip", Readings, float], Readings]

LONGEST_S, MOST_OFF_DEG = 10.0, 20.0
ANGLES = ("heading", "course", "rudder")
WARM_S = 120.0  # until a lie begins


class LyingShip(SimulatedShip):
    """Ship whose instruments tell the truth until a lie begins.

    A `lie` gets the ship, her true readings and the seconds since it began, and returns
    the false ones.
    """

    lie: Lie | None = None
    begins = inf
    gear_works = True

    def hear(self, line: str) -> None:
        """Take a rudder order if the steering gear works."""
        before = self.order
        super().hear(line)
        self.asked = self.order
        if not self.gear_works:
            self.order = before

    def measured(self) -> Readings:
        """Readings, true or not."""
        true = super().measured()
        seconds = self.steps * self.step - self.begins
        if self.lie is None or seconds < 0.0:
            self.largest_lie = 0.0
            return true
        false = self.lie(self, true, seconds)
        self.largest_lie = largest_lie(true, false)
        return true | false


def largest_lie(true: Readings, false: Readings) -> float:
    """Largest error of a reading, in tolerances of its quantity."""
    sizes = [0.0]
    for quantity, value in false.items():
        off = value - true[quantity]
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
    """A gear that stands, while its feedback repeats the order."""
    ship.gear_works = False
    return {"rudder": ship.asked}


DEG = radians(1.0)


def lies() -> dict[str, Callable[[], Lie]]:
    """Lies by name; each call makes one that has not begun."""
    heading, rate, both = ("heading",), ("yaw_rate",), ("heading", "yaw_rate")
    found: dict[str, Callable[[], Lie]] = {
        "heading frozen": lambda: Stuck(heading),
        "heading 0": lambda: Stuck(heading, 0.0),
        "heading and rate frozen": lambda: Stuck(both),
        "heading frozen, rate 0": lambda: both_still,
        "heading mirrored": lambda: changed("heading", -1.0),
        "heading times 2": lambda: changed("heading", 2.0),
        "heading halved": lambda: changed("heading", 0.5),
        "heading in steps of 10 deg": lambda: rounded("heading", 10.0 * DEG),
        "heading is the course": lambda: course_as_heading,
        "rate 0": lambda: Stuck(rate, 0.0),
        "rate stuck": lambda: Stuck(rate),
        "rate reversed": lambda: changed("yaw_rate", -1.0),
        "rudder stuck": lambda: Stuck(("rudder",)),
        "rudder 0": lambda: Stuck(("rudder",), 0.0),
        "rudder reversed": lambda: changed("rudder", -1.0),
        "rudder repeats its order, the gear stands": lambda: dead_gear,
        "course stuck": lambda: Stuck(("course",)),
        "speed over ground 0": lambda: Stuck(("speed",), 0.0),
        "log 0": lambda: Stuck(("surge",), 0.0),
    }
    for jump in (180.0, 90.0, -60.0, 30.0, -20.0, 10.0):
        found[f"heading jumps by {jump:g} deg"] = _of(
            changed, "heading", offset=jump * DEG
        )
    for drift in (1.0, -1.0, 2.0, 0.5, -0.3):
        found[f"heading drifts by {drift:g} deg/s"] = _of(
            drifting, "heading", drift * DEG
        )
    for drift in (1.0, -0.5, 0.2, 0.05, 0.01):
        found[f"heading and its rate drift by {drift:g} deg/s"] = _of(
            drifting, "heading", drift * DEG, and_rate=True
        )
    for apart, every in product((60.0, 180.0, 20.0), (0.1, 0.5, 1.0, 5.0)):
        found[f"two compasses {apart:g} deg apart, each {every:g} s"] = _of(
            alternating, apart * DEG, every
        )
    for deviation in (2.0, 5.0, 20.0):
        found[f"heading with noise of {deviation:g} deg"] = _of(
            noisy, "heading", deviation * DEG
        )
    for delay in (5.0, 20.0):
        found[f"heading {delay:g} s late"] = _of(late, "heading", delay)
        found[f"rate {delay:g} s late"] = _of(late, "yaw_rate", delay)
    for factor in (2.0, 0.5, 60.0, 1.0 / 60.0):
        found[f"rate times {factor:.3g}"] = _of(changed, "yaw_rate", factor)
    for offset in (2.0, -1.0, 0.5):
        found[f"rate off by {offset:g} deg/s"] = _of(
            changed, "yaw_rate", offset=offset * DEG
        )
    for deviation in (3.0, 10.0):
        found[f"rate with noise of {deviation:g} deg/s"] = _of(
            noisy, "yaw_rate", deviation * DEG
        )
    for offset in (10.0, -20.0):
        found[f"rudder off by {offset:g} deg"] = _of(
            changed, "rudder", offset=offset * DEG
        )
    for jump in (180.0, 90.0, -40.0, 10.0):
        found[f"course jumps by {jump:g} deg"] = _of(
            changed, "course", offset=jump * DEG
        )
    for drift in (1.0, 0.2):
        found[f"course drifts by {drift:g} deg/s"] = _of(
            drifting, "course", drift * DEG
        )
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
            helm.hear(line, now)
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


#: Lies that nothing on board contradicts, and why.
UNSEEN = {}


def main(
    honest_hours: float = typer.Option(0.0, "--honest", help="Hours without a lie."),
    seconds: float = typer.Option(120.0, help="How long each lie lasts."),
    only: str = typer.Option("", help="Feeds whose name has this in it."),
    workers: int = typer.Option(1, help="Processes."),
) -> None:
    """Run the study."""
    if honest_hours:
        raise SystemExit(false_alarms(honest_hours, workers))
    print("| ship | lie | alarm | s from begin | s from shown | deg off |")
    print("| --- | --- | --- | --- | --- | --- |")
    missed = 0
    total = 0
    for place, bridge in bridges().items():
        true = honest(bridge, WARM_S + seconds)
        chosen = {name: make for name, make in lies().items() if only in name}
        outcomes = Parallel(workers)(
            delayed(outcome)(bridge, make(), true) for make in chosen.values()
        )
        for name, found in zip(chosen, outcomes, strict=True):
            ok = found.alarm and found.shown_s <= LONGEST_S
            ok = ok and found.off_deg < MOST_OFF_DEG and found.after_s >= 0
            missed += not ok
            total += 1
            print(
                f"| {place} | {name} | {found.alarm or '-'} | {found.after_s:.1f} |"
                f" {found.shown_s:.1f} | {found.off_deg:.1f} | {'' if ok else '!!'}",
                flush=True,
            )
    print(f"{total} feeds, {missed} missed")


def false_alarms(hours: float, workers: int) -> int:
    return 0


if __name__ == "__main__":
    typer.run(main)
