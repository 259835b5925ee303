"""How often the side to which a positive rudder steers is named, and named wrongly.

Simulated logs of six Norrbin ships (a boat to a tanker; one unstable on course):
zigzags, turns and course keeping by autopilots, in calm water and in waves and gusts,
with noise of heading and rudder, at several rates.
``python scripts/rudder_sign.py --logs 20``
"""

import argparse
import math
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.rudder_sign import rudder_sign
from shipgym.trials.units import DEGREE


class Ship(NamedTuple):
    """A Norrbin ship: T r' + n1 r + n3 r^3 = K (delta + bias)."""

    name: str
    K: float  # 1/s
    T: float  # s
    rudder_rate: float  # rad/s
    duration: float  # of a log, s
    n1: float = 1.0


_SHIPS = (
    Ship("boat, 7 m", K=0.4, T=2.0, rudder_rate=15.0 * DEGREE, duration=120.0),
    Ship("tug, 30 m", K=0.2, T=6.0, rudder_rate=5.0 * DEGREE, duration=400.0),
    Ship("coaster, 80 m", K=0.1, T=12.0, rudder_rate=3.0 * DEGREE, duration=600.0),
    Ship("cargo ship, 150 m", K=0.08, T=25.0, rudder_rate=2.5 * DEGREE, duration=600.0),
    Ship("tanker, 300 m", K=0.03, T=120.0, rudder_rate=2.3 * DEGREE, duration=1500.0),
    Ship("unstable", K=0.05, T=40.0, rudder_rate=2.5 * DEGREE, duration=900.0, n1=-0.5),
)
_MANOEUVRES = {
    "zigzag 20/20": 20.0,
    "zigzag 10/10": 10.0,
    "zigzag 5/5": 5.0,
    "turn": 35.0,
    "turn ": -10.0,
    "autopilot, PD": 0.0,
    "autopilot, P": 0.0,
    "straight": 0.0,
}
_NOISES_DEG = (0.1, 0.5, 2.0)  # of the heading


class Log(NamedTuple):
    """A simulated log, rad."""

    t: Floats
    psi: Floats
    delta: Floats


class Motion:
    """Motion of a ship with gusts and waves, in small steps."""

    def __init__(self, ship: Ship, waves: float, rng: np.random.Generator) -> None:
        self.ship = ship
        self.rng = rng
        self.waves = waves
        self.frequency = 2.0 * math.pi / rng.uniform(6.0, 12.0)
        self.bias = rng.uniform(-1.0, 1.0) * DEGREE
        self.n3 = rng.uniform(0.5 if ship.n1 < 0.0 else 0.0, 0.8)
        self.psi = self.r = self.delta = self.gust = 0.0
        self.wave = np.zeros(2)

    def advance(self, order: float, step: float) -> None:
        """Move on by some s with an order of the rudder."""
        ship = self.ship
        most = ship.rudder_rate * step
        self.delta += float(np.clip(order - self.delta, -most, most))
        shocks = math.sqrt(step) * self.rng.normal(size=2)
        strength = 2.0 * DEGREE * ship.K * (self.waves > 0.0)
        self.gust += -step * self.gust / 20.0 + 0.3 * strength * shocks[0]

        angle, rate = self.wave
        w = self.frequency
        rate += step * (-w * w * angle - 0.2 * w * rate) + 0.6 * w**1.5 * shocks[1]
        self.wave[:] = angle + step * rate, rate

        usual = ship.K * 20.0 * DEGREE
        damping = ship.n1 + self.n3 * (self.r / usual) ** 2
        turning = ship.K * (self.delta + self.bias) + self.gust
        self.r += step * (turning - damping * self.r) / ship.T
        self.psi += step * self.r


def simulate(
    ship: Ship, manoeuvre: str, noise: float, waves: float, rng: np.random.Generator
) -> Log:
    """Log of a ship, her heading with noise and waves, rad."""
    steps = (0.2, 0.5) if ship.T < 5.0 else (0.5, 1.0, 2.0)
    step = float(rng.choice(steps))
    within = math.ceil(step / 0.25)
    motion = Motion(ship, waves, rng)
    angle = _MANOEUVRES[manoeuvre] * DEGREE
    n = int(ship.duration / step)
    psi = np.empty(n)
    delta = np.empty(n)
    side = 1.0
    rate = 0.0
    for k in range(n):
        psi[k] = motion.psi + waves * motion.wave[0] + noise * rng.normal()
        delta[k] = motion.delta + 0.1 * DEGREE * rng.normal()
        measured = (psi[k] - psi[k - 1]) / step if k else 0.0
        rate += 0.2 * (measured - rate)
        order = 0.0
        if manoeuvre.startswith("zigzag") and k * step > 20.0:
            if side * psi[k] > angle:
                side = -side
            order = side * angle
        elif manoeuvre.startswith("turn") and k * step > 20.0:
            order = angle
        elif manoeuvre.startswith("autopilot"):
            gain = 0.8 * ship.T if manoeuvre.endswith("PD") else 0.0
            order = -psi[k] - gain * rate
        for _ in range(within):
            motion.advance(float(np.clip(order, -0.6, 0.6)), step / within)
    return Log(step * np.arange(n), psi, delta)


def main() -> None:
    """Print how many logs of each kind are named rightly, wrongly and not at all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=4, help="of each ship and kind")
    parser.add_argument("--first", type=int, default=0, help="seed")
    options = parser.parse_args()
    rng = np.random.default_rng(options.first)
    print("| manoeuvre | noise, deg | logs | right | not told | wrong |")
    print("| --- | --- | --- | --- | --- | --- |")
    wrong = total = 0
    for manoeuvre in _MANOEUVRES:
        for noise in _NOISES_DEG:
            sides = []
            for ship in _SHIPS:
                for _ in range(options.logs):
                    waves = float(rng.choice([0.0, 0.3, 1.0])) * DEGREE
                    log = simulate(ship, manoeuvre, noise * DEGREE, waves, rng)
                    sides.append(rudder_sign(*log).side)
            counts = [sides.count(side) for side in ("starboard", None, "port")]
            right, untold, here = counts
            print(
                f"| {manoeuvre.strip()} | {noise} | {len(sides)} | {right} | {untold} |"
                f" {here} |",
                flush=True,
            )
            wrong += here
            total += len(sides)
    print(f"\n{wrong} of {total} logs are named wrongly")


if __name__ == "__main__":
    main()
