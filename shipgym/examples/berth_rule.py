"""A rule of ten numbers for the berth approach of `berth.py`: line of sight along the
quay, a speed that falls with the distance, and astern where she is faster than that.

    shipgym benchmark --suite my-suite.toml --allow-code berth.py \
        --controllers berth_rule:factory --out results/
"""

import numpy as np

#: Found by CMA-ES (`scripts/example_rules.py`), lengths and service speeds as units.
NUMBERS = {
    "lookahead": 2.56,  # lengths ahead on the line to the berth that she steers for
    "lookahead_per_length": 0.0384,  # and more of it where the berth is far away
    "largest_angle": 2.82,  # rad, to the line
    "heading": 18.0,  # rudder for a heading error of 1 rad
    "yaw_rate": 11.3,  # against a yaw rate of 1 speed per length
    "sway": 0.02,  # against a drift of 1 speed
    "creep": 0.0196,  # speed at the berth
    "slope": 0.154,  # speed more at the square root of a length
    "shaft": 64.8,  # shaft for a speed error of 1
    "shaft_ahead": 0.692,  # shaft for a wanted speed of 1
}


class BerthRule:
    """The rule with its numbers, each of them a float or an entry for each ship."""

    def __init__(self, names, numbers=NUMBERS, distance=7.0):
        self.names = list(names)
        self.numbers = numbers
        self.distance = distance  # lengths, by which `to_berth` is divided

    def predict(self, seen, state=None, episode_start=None, deterministic=True):
        """Rudder and shaft for each ship, parts of the largest."""
        known = dict(zip(self.names, np.atleast_2d(seen).T, strict=True))
        to_go = np.maximum(-self.distance * known["to_berth"], 0.0)
        rudder = self.rudder(known, to_go)
        shaft = self.shaft(known, to_go)
        action = np.stack([rudder, shaft], axis=1)
        return np.clip(action, -1.0, 1.0).reshape(*np.shape(seen)[:-1], 2), state

    def rudder(self, known, to_go):
        """By line of sight to a point of the line ahead."""
        k = self.numbers
        ahead = k["lookahead"] + k["lookahead_per_length"] * to_go
        wanted = -np.arctan2(known["off_line"], ahead)
        limit = k["largest_angle"]
        heading = np.arctan2(known["heading_sin"], known["heading_cos"])
        error = np.clip(wanted, -limit, limit) - heading
        damping = k["yaw_rate"] * known["yaw_rate"] + k["sway"] * known["sway"]
        return k["heading"] * error - damping

    def shaft(self, known, to_go):
        """By the speed from which she can still stop."""
        k = self.numbers
        wanted = k["creep"] + k["slope"] * np.sqrt(to_go)
        return k["shaft_ahead"] * wanted + k["shaft"] * (wanted - known["surge"])


def factory(task, numbers=NUMBERS):
    """The rule for a task of a suite."""
    return BerthRule([seen.name for seen in task.task.observed(task.ship)], numbers)
