"""Golden section `voyages`: short episodes, with every setting of every task away from
its default.

What `environments` shows over thousands of steps, quick enough for each run of the
tests.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import shipgym
from tests.golden.environments import CHANGING_SEA, GUSTS, Case, recorded_case
from tests.golden.store import Floats

STEPS, EVERY = 240, 16

#: Settings of all tasks.
COSTS: Mapping[str, Any] = {
    "heading_scale_deg": 23.0,
    "rudder_weight": 0.3,
    "rudder_rate_weight": 0.07,
    "roll_weight": 0.6,
    "roll_scale_deg": 7.0,
    "envelope_weight": 0.4,
    "integral_zone_deg": 17.0,
    "integral_lengths": 3.0,
}
#: Swings past the course, so that control is lost now and then.
COURSES: Mapping[str, Any] = {
    "course_changes_deg": [25.0, -43.0, 8.0],
    "change_interval_steps": 35,
    "max_heading_error_deg": 38.0,
    "episode_steps": 130,
}
LEGS: Mapping[str, Any] = {
    "n_legs": 2,
    "leg_lengths": (2.5, 3.5),
    "max_turn_deg": 50.0,
    "lookahead": 1.7,
    "corridor": 0.6,
    "ground": 0.8,
    "episode_steps": 150,
}
RUDDER: Mapping[str, Any] = {
    "turn_radius": 1.4,
    "rudder_travel_weight": 0.3,
    "reversal_weight": 0.2,
    "reversal_deg": 2.5,
}
SHIPS: Mapping[str, Any] = {"speed_range": (0.7, 1.05), "loading_range": (0.9, 1.2)}
NOISE: Mapping[str, Any] = {"noise": 0.7, "measurement": "filtered"}
SMOOTH = shipgym.Weather(
    current=shipgym.Current(0.7, towards_deg=30.0),
    wind=shipgym.Wind(11.0, gust=False),
    waves=shipgym.Waves(2.0, 7.0, peak_enhancement=1.0, spreading="long-crested"),
)


def cases() -> dict[str, Case]:
    """All cases by name."""
    course, path = "CourseKeeping", "PathFollowing"
    return {
        "course": Case(
            course,
            {**COSTS, **COURSES, **NOISE, **SHIPS, "sea": CHANGING_SEA},
            swing=0.6,
        ),
        "course random": Case(
            course,
            {
                "course_change_deg": 50.0,
                "change_interval_steps": 20,
                "model_uncertainty": "covariance",
            },
        ),
        "course single": Case(course, {**COSTS, **COURSES, "dt": 5.5}, single=True),
        "course roll": Case(
            "CourseKeeping",
            {**COSTS, **COURSES, "model": "container", "roll": True, "sea": "rough"},
        ),
        "path": Case(
            path,
            {**COSTS, **LEGS, **RUDDER, "noise": 0.7, "sea": [GUSTS, SMOOTH]},
            swing=0.1,
        ),
        "path single": Case(path, {**COSTS, **LEGS, **RUDDER}, single=True, swing=0.7),
        "path discrete": Case(
            "PathFollowingDiscrete", {**COSTS, **LEGS, **RUDDER}, swing=0.7
        ),
    }


def record(name: str, steps: int | None = None) -> dict[str, Floats]:
    """The values of a case over some steps; by default over as many as can
    be compared."""
    return recorded_case(cases()[name], STEPS, EVERY, steps)
