"""A rule of twelve numbers for the encounters of `encounter.py`: of some courses it
takes the one that passes clear of everyone with the least alteration, rather to
starboard (velocity obstacles; COLREG rules 8, 14 and 15).

    shipgym benchmark --suite my-suite.toml --allow-code encounter.py \
        --controllers encounter_rule:factory --out results/
"""

import numpy as np

#: Found by CMA-ES (`scripts/example_rules.py`), lengths and the time of one as units.
NUMBERS = {
    "safe": 1.6,  # distance to pass at
    "risk": 12.8,  # weight of a ship that she would hit now
    "horizon": 50,  # time after which a closest approach weighs exp(-1) of that
    "delay": 0.684,  # time until an alteration shows
    "alteration": 0.371,  # weight of an alteration of 1 rad, squared
    "to_port": 0.206,  # weight of going to port
    "change": 0.0545,  # weight of another course than a step ago, rad squared
    "furthest": 2.5,  # rad, largest alteration
    "lookahead": 10.8,  # ahead on the track that she steers for
    "largest_angle": 0.352,  # rad, to the track
    "heading": 3.27,  # rudder for a heading error of 1 rad
    "yaw_rate": 5.53,  # against a yaw rate of 1 rad in that time
}
COURSES = np.linspace(-1.0, 1.0, 31)  # parts of the largest alteration


class EncounterRule:
    """The rule with its numbers, each of them a float or an entry for each ship."""

    def __init__(self, names, step, numbers=NUMBERS):
        self.names = list(names)
        self.step = step  # lengths that she sails in a control interval
        self.numbers = {name: np.atleast_1d(k) for name, k in numbers.items()}

    def predict(self, seen, state=None, episode_start=None, deterministic=True):
        """Rudder for each ship; the state is where the others were, and the course."""
        known = dict(zip(self.names, np.atleast_2d(seen).T, strict=True))
        k = self.numbers
        heading = np.arctan2(known["heading_sin"], known["heading_cos"])
        others = positions(known, heading)
        limit = k["largest_angle"]
        track = -np.arctan2(10.0 * known["cross_track"], k["lookahead"])
        track = np.clip(track, -limit, limit)
        if state is None:
            state = others, track
        course = self.course(others, others - state[0], heading, track, state[1])
        rudder = k["heading"] * (course - heading) - k["yaw_rate"] * known["yaw_rate"]
        action = np.clip(rudder, -1.0, 1.0).reshape(*np.shape(seen)[:-1], 1)
        return action, (others, course)

    def course(self, others, moved, heading, track, before):
        """The course of least cost; ships, courses and others are the axes."""
        k = {name: value[:, None] for name, value in self.numbers.items()}
        alterations = k["furthest"] * COURSES
        courses = track[:, None] + alterations
        own = np.exp(1j * heading)[:, None, None]
        velocity = moved[:, None, :] / self.step + own  # of the others
        relative = velocity - np.exp(1j * courses)[:, :, None]
        away = others[:, None, :] + k["delay"][:, :, None] * (velocity - own)
        speed = np.maximum(np.abs(relative) ** 2, 1e-6)
        tcpa = np.maximum(-(away * relative.conj()).real / speed, 0.0)
        dcpa = np.abs(away + tcpa * relative)
        near = (dcpa / k["safe"][:, :, None]) ** 2 + tcpa / k["horizon"][:, :, None]
        cost = k["risk"] * np.exp(-near).sum(axis=2)
        cost += k["alteration"] * alterations**2 + k["to_port"] * (alterations < 0.0)
        cost += k["change"] * (courses - before[:, None]) ** 2
        least = np.argmin(cost, axis=1)
        return np.take_along_axis(courses, least[:, None], axis=1)[:, 0]


def positions(known, heading):
    """Where the others are from here, lengths: north + i east."""
    places = []
    for number in range(3):
        sine = known[f"others_{number}_bearing_sin"]
        bearing = np.arctan2(sine, known[f"others_{number}_bearing_cos"])
        distance = 10.0 * known[f"others_{number}_distance"]
        places.append(distance * np.exp(1j * (heading + bearing)))
    return np.stack(places, axis=1)


def factory(task, numbers=NUMBERS):
    """The rule for a task of a suite."""
    ship, particulars = task.ship, task.ship.particulars
    step = task.task.interval(ship) * particulars.speed / particulars.length
    names = [seen.name for seen in task.task.observed(ship)]
    return EncounterRule(names, step, numbers)
