"""Two rules for the encounters of `shipgym/Encounter-v0`, each of a dozen numbers.

"obstacles" takes the course that passes clear of everyone with the least
alteration, the others at their course and speed, rather on the side that COLREG wants
(Kuwata et al. 2014, IEEE J. Oceanic Eng. 39). "scenarios" sails each of 13 courses
for some time and then back to the track, on a simple model, and takes the one of the
least cost (Johansen, Perez & Cristofaro 2016, IEEE Trans. Intell. Transp. Syst. 17).

`python scripts/encounters.py` compares them with agents.
"""

from math import atan, atan2, cos, exp, hypot, pi, sin

import numpy as np
from numba import njit

#: Set by hand, in lengths and the time of one; `scripts/encounters.py` can search.
OBSTACLES = {
    "safe": 3.0,  # distance to pass at
    "risk": 3.0,  # weight of a ship that she would hit now
    "horizon": 10.0,  # time after which a closest approach weighs exp(-1) of that
    "delay": 1.0,  # time until an alteration shows
    "alteration": 0.5,  # weight of an alteration of 1 rad, squared
    "wrong_side": 0.5,  # weight of passing on the other side than COLREG wants
    "trust": 0.7,  # weight of ships who have to give way
    "to_port": 0.2,  # weight of going to port
    "change": 0.1,  # weight of another course than a step ago, rad squared
    "lookahead": 8.0,  # ahead on the track that she steers for
    "heading": 2.0,  # rudder for a heading error of 1 rad
    "yaw_rate": 2.0,  # against a yaw rate of 1 rad in that time
}
SCENARIOS = {
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
    "lookahead": 8.0,
    "heading": 2.0,
    "yaw_rate": 2.0,
}
COURSES = np.linspace(-1.5, 1.5, 13)  # rad
HELD = np.array([3.0, 7.0, 14.0])  # times for which a course is held
N_OTHERS = 4


class EncounterRule:
    """A rule with its numbers, each of them a float or an entry for each ship."""

    def __init__(self, names, choose, numbers):
        self.places = {name: place for place, name in enumerate(names)}
        self.choose = choose
        self.numbers = {name: np.atleast_1d(k) for name, k in numbers.items()}

    def predict(self, seen, state=None, episode_start=None, deterministic=True):
        """Rudder for each ship; the state is the course of the step before."""
        rows = np.atleast_2d(seen).astype(float)
        n = len(rows)
        numbers = np.empty((n, len(self.numbers)))
        for column, k in enumerate(self.numbers.values()):
            numbers[:, column] = k
        off = 10.0 * rows[:, self.places["cross_track"]]
        to_track = -np.arctan(off / 8.0)  # the course of the task's heading error
        error = np.arctan2(rows[:, 0], rows[:, 1])
        heading = to_track - error
        before = np.full(n, np.nan) if state is None else np.array(state)
        if episode_start is not None:
            before[np.broadcast_to(episode_start, n)] = np.nan
        own = np.stack([off, heading, rows[:, self.places["yaw_rate"]]], axis=1)
        course = np.empty(n)
        self.choose(own, self.others(rows, heading), before, numbers, course)
        k = self.numbers
        error = np.arctan2(np.sin(course - heading), np.cos(course - heading))
        rudder = k["heading"] * error - k["yaw_rate"] * own[:, 2]
        action = np.clip(rudder, -1.0, 1.0).reshape(*np.shape(seen)[:-1], 1)
        return action.astype(np.float32), course

    def others(self, rows, heading):
        """Place and velocity of the others from here, shape (n, 4, 4); north, east."""
        first = self.places["others_0_bearing_sin"]
        seen = rows[:, first : first + 8 * N_OTHERS].reshape(len(rows), N_OTHERS, 8)
        bearing = heading[:, None] + np.arctan2(seen[..., 0], seen[..., 1])
        course = heading[:, None] + np.arctan2(seen[..., 3], seen[..., 4])
        distance, speed = 10.0 * seen[..., 2], seen[..., 5]
        return np.stack(
            [
                distance * np.cos(bearing),
                distance * np.sin(bearing),
                speed * np.cos(course),
                speed * np.sin(course),
            ],
            axis=-1,
        )


@njit
def wrapped(angle):
    """The angle in [-pi, pi)."""
    return (angle + pi) % (2.0 * pi) - pi


@njit
def duty(other, heading):
    """What COLREG asks for: 1 to give way, 2 head-on, 3 to stand on, 0 neither."""
    x, y, north, east = other
    bearing = wrapped(atan2(y, x) - heading)
    aspect = wrapped(atan2(-y, -x) - atan2(east, north))
    if abs(aspect) > 1.963:  # own ship overtakes
        return 0
    if abs(bearing) > 1.963:
        return 3
    if abs(bearing) < 0.2 and abs(aspect) < 0.2:
        return 2
    return 1 if bearing > 0.0 else 3


@njit
def obstacles(own, others, before, numbers, chosen):
    """Course of the least risk and alteration for each ship."""
    for ship in range(len(own)):
        safe, risk, horizon, delay, alteration = numbers[ship, :5]
        wrong_side, trust, to_port, change, lookahead = numbers[ship, 5:10]
        off, heading, _ = own[ship]
        track = -atan(off / lookahead)
        least = np.inf
        for k in range(-20, 21):
            course = track + 0.075 * k
            turn = 0.075 * k
            cost = alteration * turn * turn
            if turn < 0.0:
                cost += to_port
            if not np.isnan(before[ship]):
                cost += change * wrapped(course - before[ship]) ** 2
            for number in range(N_OTHERS):
                x, y, north, east = others[ship, number]
                asked = duty(others[ship, number], heading)
                weight = risk * (trust if asked == 3 else 1.0)
                x += delay * (north - cos(heading))
                y += delay * (east - sin(heading))
                dx, dy = north - cos(course), east - sin(course)
                square = max(dx * dx + dy * dy, 1e-6)
                tcpa = max(-(x * dx + y * dy) / square, 0.0)
                dcpa = hypot(x + tcpa * dx, y + tcpa * dy)
                near = exp(-((dcpa / safe) ** 2) - tcpa / horizon)
                cost += weight * near
                # passing ahead of a ship to give way to, or starboard to starboard
                if 0 < asked < 3 and x * dy - y * dx > 0.0:
                    cost += wrong_side * exp(-((dcpa / safe / 2) ** 2) - tcpa / horizon)
            if cost < least:
                least = cost
                chosen[ship] = course


@njit
def scenarios(own, others, before, numbers, chosen):
    """Course of the scenario of the least cost for each ship."""
    weights = np.empty(N_OTHERS)
    for ship in range(len(own)):
        trust, to_port, change = numbers[ship, 7:10]
        track = -atan(own[ship, 0] / numbers[ship, 11])
        for number in range(N_OTHERS):
            asked = duty(others[ship, number], own[ship, 1])
            weights[number] = trust if asked == 3 else 1.0
        least = np.inf
        for k in range(-1, len(COURSES)):
            course = track if k < 0 else COURSES[k]
            turn = wrapped(course - track)
            fixed = to_port if turn < -0.05 else 0.0
            if not np.isnan(before[ship]):
                fixed += change * abs(wrapped(course - before[ship]))
            for held in HELD if k >= 0 else HELD[:1]:
                time = 0.0 if k < 0 else held
                plan = course, time, least - fixed
                cost = sailed(own[ship], others[ship], weights, plan, numbers[ship])
                if fixed + cost < least:
                    least = fixed + cost
                    chosen[ship] = course


@njit
def sailed(own, others, weights, plan, numbers):
    """Cost of a course held for a time, then back to the track, if below a limit."""
    course, held, limit = plan
    ahead, abeam, ellipse, near, danger, growth, horizon = numbers[:7]
    lag, lookahead = numbers[10], numbers[11]
    step = 0.75
    x = 0.0
    y, psi, _ = own
    cost = 0.0
    time = 0.0
    for _ in range(36):
        time += step
        wanted = course
        if time > held:
            wanted = -atan(y / lookahead)
        turn = wrapped(wanted - psi) * min(step / lag, 1.0)
        psi += min(max(turn, -0.4 * step), 0.4 * step)
        x += step * cos(psi)
        y += step * sin(psi)
        now = 1.0 - cos(psi) + (y / 12.0) ** 2
        wider = 1.0 + growth * time
        for number in range(N_OTHERS):
            there_x, there_y, north, east = others[number]
            away_x = x - there_x - time * north
            away_y = y - own[0] - there_y - time * east
            square = away_x * away_x + away_y * away_y
            if square > (wider * max(ahead, abeam, near)) ** 2:
                continue
            speed = hypot(north, east) + 1e-9
            along = (away_x * north + away_y * east) / speed
            across = (away_y * north - away_x * east) / speed
            along /= wider * (ahead if along > 0.0 else abeam)
            across /= wider * abeam
            inside = max(1.0 - along * along - across * across, 0.0)
            close = max(1.0 - square**0.5 / (wider * near), 0.0)
            now += weights[number] * (ellipse * inside * inside + danger * close)
        cost += step * now * exp(-time / horizon)
        if cost > limit:
            break
    return cost


def rule_of(kind, task, numbers=None):
    """A rule, "obstacles" or "scenarios", for a task of a suite."""
    names = [seen.name for seen in task.task.observed(task.ship)]
    choose, usual = KINDS[kind]
    return EncounterRule(names, choose, numbers or usual)


KINDS = {"obstacles": (obstacles, OBSTACLES), "scenarios": (scenarios, SCENARIOS)}


def factory(task):
    """The better rule for a task of a suite."""
    return rule_of("scenarios", task)
