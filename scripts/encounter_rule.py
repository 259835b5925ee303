"""A rule for the encounters of `shipgym/Encounter-v0`: the best of some scenarios.

Each of 13 courses is sailed for some time and then left for the track, on a simple
model, the others at their course and speed; the course of the least cost is steered
(Johansen, Perez & Cristofaro 2016, IEEE Trans. Intell. Transp. Syst. 17). Lengths, and
the time in which own ship sails one, are the units.

`python scripts/learning_tasks.py encounter` compares it with agents.
"""

import numpy as np

#: Set by hand.
NUMBERS = {
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
STEP, STEPS = 0.75, 36  # of a scenario
#: Courses, rad, and the times for which they are held; first the track.
COURSES = np.append(0.0, np.repeat(np.linspace(-1.5, 1.5, 13), 3))
HELD = np.append(0.0, np.tile([3.0, 7.0, 14.0], 13))
N_OTHERS = 4


class EncounterRule:
    """The rule with its numbers."""

    def __init__(self, names, numbers=NUMBERS):
        self.places = {name: place for place, name in enumerate(names)}
        self.numbers = numbers

    def predict(self, seen, state=None, episode_start=None, deterministic=True):
        """Rudder for each ship; the state is the course of the step before."""
        k = self.numbers
        rows = np.atleast_2d(seen).astype(float)
        off = 10.0 * rows[:, self.places["cross_track"]]
        # the task's heading error is that from the course to the track
        heading = -np.arctan(off / 8.0) - np.arctan2(rows[:, 0], rows[:, 1])
        track = -np.arctan(off / k["lookahead"])
        plans = np.tile(COURSES, (len(rows), 1))
        plans[:, 0] = track
        costs = self.costs(off, heading, plans, self.others(rows, heading))
        costs += k["to_port"] * (wrapped(plans - track[:, None]) < -0.05)
        if state is not None:
            changed = k["change"] * np.abs(wrapped(plans - state[:, None]))
            costs += np.where(np.reshape(episode_start, (-1, 1)), 0.0, changed)
        course = plans[np.arange(len(rows)), costs.argmin(axis=1)]
        yaw_rate = rows[:, self.places["yaw_rate"]]
        rudder = k["heading"] * wrapped(course - heading) - k["yaw_rate"] * yaw_rate
        action = np.clip(rudder, -1.0, 1.0).reshape(*np.shape(seen)[:-1], 1)
        return action.astype(np.float32), course

    def others(self, rows, heading):
        """Place and velocity of the others, north and east from here, and weights.

        Shapes (n, 1, 4). Ships who have to give way weigh less.
        """
        first = self.places["others_0_bearing_sin"]
        seen = rows[:, first : first + 8 * N_OTHERS].reshape(len(rows), 1, N_OTHERS, 8)
        on_bow = np.arctan2(seen[..., 0], seen[..., 1])
        bearing = heading[:, None, None] + on_bow
        course = heading[:, None, None] + np.arctan2(seen[..., 3], seen[..., 4])
        aspect = wrapped(bearing + np.pi - course)
        overtaking = np.abs(aspect) > 1.963
        head_on = (np.abs(on_bow) < 0.2) & (np.abs(aspect) < 0.2)
        to_port = (on_bow <= 0.0) | (on_bow > 1.963)
        weight = np.where(to_port & ~overtaking & ~head_on, self.numbers["trust"], 1.0)
        place = 10.0 * seen[..., 2] * np.exp(1j * bearing)
        return place, seen[..., 5] * np.exp(1j * course), weight

    def costs(self, off, heading, courses, others):
        """Costs of courses that are held and then left for the track, shape (n, 40)."""
        k = self.numbers
        place, velocity, weight = others
        y, psi = np.zeros_like(courses), np.repeat(heading[:, None], len(HELD), axis=1)
        x = np.zeros_like(courses)
        costs = np.zeros_like(courses)
        for time in STEP * np.arange(1, STEPS + 1):
            back = -np.arctan((off[:, None] + y) / k["lookahead"])
            turn = wrapped(np.where(time > HELD, back, courses) - psi)
            psi += np.clip(turn * min(STEP / k["lag"], 1.0), -0.4 * STEP, 0.4 * STEP)
            x += STEP * np.cos(psi)
            y += STEP * np.sin(psi)
            now = 1.0 - np.cos(psi) + ((off[:, None] + y) / 12.0) ** 2
            away = (x + 1j * y)[..., None] - place - time * velocity
            risk = weight * self.risk(away, velocity, 1.0 + k["growth"] * time)
            costs += STEP * (now + risk.sum(axis=-1)) * np.exp(-time / k["horizon"])
        return costs

    def risk(self, away, velocity, wider):
        """Weight of being so far from another, in an ellipse that has grown."""
        k = self.numbers
        speed = np.abs(velocity) + 1e-9
        turned = away * velocity.conj() / speed  # ahead of her, and to starboard
        ahead = np.where(turned.real > 0.0, k["ahead"], k["abeam"])
        square = (turned.real / ahead) ** 2 + (turned.imag / k["abeam"]) ** 2
        inside = np.maximum(1.0 - square / wider**2, 0.0)
        close = np.maximum(1.0 - np.abs(away) / (wider * k["near"]), 0.0)
        return k["ellipse"] * inside**2 + k["danger"] * close


def wrapped(angle):
    """The angle in [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def factory(task):
    """The rule for a task of a suite."""
    return EncounterRule([seen.name for seen in task.task.observed(task.ship)])
