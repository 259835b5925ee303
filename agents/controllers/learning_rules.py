"""Rules for the suite's tasks in which learning may pay: the best that are known.

Lengths of own ship, and the time in which she sails one, are the units of encounters.
`python scripts/learning_tasks.py` searches the numbers and compares the rules with
agents.
"""

from collections.abc import Mapping, Sequence
from math import exp
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.law import wrapped


class LearningRule:
    """A rule with its numbers, for observations of some names."""

    numbers: Mapping[str, float] = {}

    def __init__(
        self, names: Sequence[str], numbers: Mapping[str, float] | None = None
    ) -> None:
        self.places = {name: place for place, name in enumerate(names)}
        self.known = SimpleNamespace(**(numbers or self.numbers))

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Any, Any]:
        """Return the orders of each ship, as `Policy.predict` does, and the memory."""
        rows = np.atleast_2d(observation).astype(np.float32)  # twice as fast
        if state is None:
            starts = np.ones(len(rows), dtype=np.bool_)
        else:
            starts = np.reshape(episode_start, -1)
        orders, state = self.steer(rows, state, starts)
        action = np.clip(orders, -1.0, 1.0).reshape(*np.shape(observation)[:-1], -1)
        return action.astype(np.float32), state

    def steer(self, rows: Any, state: Any, starts: Any) -> tuple[Any, Any]:
        """Return orders and memory of each ship; `starts`: where an episode begins.

        Orders have the shape (n,), or (n, 2) with a shaft.
        """
        raise NotImplementedError


class RollDamping(LearningRule):
    """PD on a smooth heading, and feedback of roll without its mean.

    Roll is damped as far as it has grown: below three degrees it costs nothing
    (automatic gain control: van Amerongen, van der Klugt & van Nauta Lemke 1990, Rudder
    roll stabilization for ships, Automatica 26).
    """

    numbers: Mapping[str, float] = {
        "error": 5.1,  # rudder by its limit for an error of 1 rad
        "rate": 0.08,  # against a yaw rate of 1, in her length and speed
        "roll": 0.56,
        "roll_rate": 0.32,
        "smooth": 1.1,  # s, of the heading
        "slow": 89.0,  # s, of the mean of roll
        "free": 0.48,  # deg, roll that is not damped
        "width": 1.9,  # deg, until it is damped in full
    }

    def steer(self, rows: Any, state: Any, starts: Any) -> tuple[Any, Any]:
        """The memory is heading error, yaw rate, roll and its square, smoothed."""
        k = self.known
        error = np.arctan2(rows[:, 0], rows[:, 1])
        roll = rows[:, self.places["roll"]]
        now = np.stack([error, rows[:, 2], roll, roll**2])
        kept = self.smoothed(now, state, starts)
        error, yaw_rate, mean_roll, square = kept
        level = 30.0 * np.sqrt(square)  # deg
        part = np.clip((level - k.free) / k.width, 0.0, 1.0)
        roll_rate = rows[:, self.places["roll_rate"]]
        damping = k.roll * (roll - mean_roll)
        damping -= k.roll_rate * roll_rate
        course = k.error * error
        course -= k.rate * yaw_rate
        return course + part * damping, kept

    def smoothed(self, now: Any, state: Any, starts: Any) -> Any:
        """Low-pass filters, which begin at what is seen, that of the square at 0."""
        k = self.known
        dt = 1.0  # s, control interval
        first = now.copy()
        first[3] = 0.0
        kept = first if state is None else np.where(starts, first, state)
        of_square = 20.0
        times = [k.smooth, k.smooth, k.slow, of_square]
        shares = dt / (dt + np.array(times))
        return kept + shares[:, None] * (now - kept)


class Scenarios(LearningRule):
    """The best of some scenarios, for the encounters of `shipgym/Encounter-v0`.

    Each of 13 courses is sailed for some time and then left for the track, on a simple
    model, the others at their course and speed; the course of the least cost is steered
    (Johansen, Perez & Cristofaro 2016, IEEE Trans. Intell. Transp. Syst. 17).
    """

    numbers: Mapping[str, float] = {
        "ahead": 6.4,  # half axes of the ellipse around others
        "abeam": 3.2,
        "ellipse": 2.0,  # weight of its middle
        "near": 2.5,  # distance within which the others are dangerous
        "danger": 20.0,  # weight of that
        "growth": 0.02,  # of ellipse and distance in a unit of time
        "horizon": 20.0,  # time after which a cost weighs exp(-1)
        "trust": 0.7,  # weight of ships who have to give way
        "to_port": 0.3,  # weight of going to port
        "change": 0.3,  # weight of another course than a step ago
        "lag": 1.0,  # time in which she turns to a course
        "lookahead": 8.0,  # ahead on the track that she steers for
        "heading": 2.0,  # rudder for a heading error of 1 rad
        "yaw_rate": 2.0,  # against a yaw rate of 1 rad in that time
    }
    step, n_steps = 0.75, 36  # of a scenario
    #: Courses, rad, and the times for which they are held; first the track.
    courses = np.append(0.0, np.repeat(np.linspace(-1.5, 1.5, 13), 3)).astype("f4")
    held = np.append(0.0, np.tile([3.0, 7.0, 14.0], 13))

    def steer(self, rows: Any, state: Any, starts: Any) -> tuple[Any, Any]:
        """The memory is the course of the step before, shape (n,)."""
        k = self.known
        off = 10.0 * rows[:, self.places["cross_track"]]
        # the task's heading error is that from the course to the track
        error = np.arctan2(rows[:, 0], rows[:, 1])
        heading = -np.arctan(off / 8.0) - error
        track = -np.arctan(off / k.lookahead)
        plans = np.tile(self.courses, (len(rows), 1))
        plans[:, 0] = track
        others = self.others(rows, heading)
        costs = self.costs(off, heading, plans, others)
        before = track if state is None else np.where(starts, track, state)
        course = self.cheapest(plans, costs, track, before)
        yaw_rate = rows[:, self.places["yaw_rate"]]
        rudder = k.heading * wrapped(course - heading)
        return rudder - k.yaw_rate * yaw_rate, course

    def cheapest(self, plans: Any, costs: Any, track: Any, before: Any) -> Any:
        """Course of the least cost of each ship, shape (n,).

        Courses to port of that to the track, and others than the one before, cost more.
        """
        k = self.known
        to_port = wrapped(plans - track[:, None]) < -0.05
        change = wrapped(plans - before[:, None])
        costs += k.to_port * to_port
        costs += k.change * np.abs(change)
        best = costs.argmin(axis=1)
        ships = np.arange(len(plans))
        return plans[ships, best]

    def others(self, rows: Any, heading: Any) -> "Others":
        """Other ships; those who have to give way weigh less."""
        first = self.places["others_0_bearing_sin"]
        seen = rows[:, first : first + 8 * 4]
        seen = seen.reshape(len(rows), 4, 8).transpose(2, 1, 0)[..., None]
        on_bow = np.arctan2(seen[0], seen[1])
        own = heading[:, None]
        bearing = own + on_bow
        course = own + np.arctan2(seen[3], seen[4])
        distance = 10.0 * seen[2]
        return Others(
            north=distance * np.cos(bearing),
            east=distance * np.sin(bearing),
            cosine=np.cos(course),
            sine=np.sin(course),
            speed=seen[5],
            weight=self.weight(on_bow, bearing - course),
        )

    def weight(self, on_bow: Any, bearing: Any) -> Any:
        """Weight of others by their bearings from own ship's bow and from theirs."""
        aspect = np.abs(wrapped(bearing + np.pi))
        abaft = 1.963  # rad, 22.5 deg abaft the beam
        ahead = np.abs(on_bow) < 0.2
        is_head_on = ahead & (aspect < 0.2)
        is_to_port = (on_bow <= 0.0) | (on_bow > abaft)
        gives_way = is_to_port & (aspect <= abaft) & ~is_head_on
        trust = np.float32(self.known.trust)
        return np.where(gives_way, trust, np.float32(1.0))

    def costs(self, off: Any, heading: Any, courses: Any, others: "Others") -> Any:
        """Costs of courses that are held and then left for the track, shape (n, 40)."""
        k = self.known
        psi = np.repeat(heading[:, None], len(self.held), axis=1)
        north = np.zeros_like(courses)
        costs = np.zeros_like(courses)
        off = north + off[:, None]
        start = off.copy()
        most = 0.4 * self.step
        part = min(self.step / k.lag, 1.0)
        for number in range(1, self.n_steps + 1):
            time = self.step * number
            back = -np.arctan(off / k.lookahead)
            course = np.where(time > self.held, back, courses)
            turn = part * wrapped(course - psi)
            psi += np.clip(turn, -most, most)
            north += self.step * np.cos(psi)
            off += self.step * np.sin(psi)
            cost = 1.0 - np.cos(psi)
            cost += (off / 12.0) ** 2
            cost += self.risk(north, off - start, time, others)
            costs += self.step * exp(-time / k.horizon) * cost
        return costs

    def risk(self, north: Any, east: Any, time: float, others: "Others") -> Any:
        """Weight of being so near to the others after a time, shape (n, 40)."""
        k = self.known
        wider = 1.0 + k.growth * time
        sailed = time * others.speed
        north = north - others.north
        north -= sailed * others.cosine
        east = east - others.east
        east -= sailed * others.sine
        ahead = north * others.cosine + east * others.sine
        abeam = east * others.cosine - north * others.sine
        length = np.where(ahead > 0.0, k.ahead, k.abeam)
        inside = 1.0 - (ahead / (wider * length)) ** 2
        inside -= (abeam / (wider * k.abeam)) ** 2
        distance = np.sqrt(north**2 + east**2)
        close = 1.0 - distance / (wider * k.near)
        risk = k.ellipse * np.maximum(inside, 0.0) ** 2
        risk += k.danger * np.maximum(close, 0.0)
        return (others.weight * risk).sum(axis=0)


class Others(NamedTuple):
    """Other ships, their places from here, shape (4, n, 1)."""

    north: Any
    east: Any
    cosine: Any  # of the course
    sine: Any
    speed: Any
    weight: Any


#: Rules by the names that a suite gives them.
LEARNING_RULES: Mapping[str, type[LearningRule]] = {
    "roll-damping": RollDamping,
    "scenarios": Scenarios,
}
