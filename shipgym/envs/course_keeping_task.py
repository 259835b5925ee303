"""The course-keeping task: what is observed, what it costs, and when an episode ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shipgym.checks import check_number
from shipgym.kernels import course_keeping_rows as rows
from shipgym.models import ShipModel
from shipgym.simulation.weather_column import as_weather
from shipgym.weather.conditions import Weather

Floats = NDArray[np.float64]

OBSERVATION_NAMES = (
    "heading_error_sin",
    "heading_error_cos",
    "yaw_rate",
    "sway",
    "surge",
    "rudder",
    "last_command",
    "heading_error_integral",
)
OBSERVATION_LOW = np.array([-1, -1, -5, -2, -2, -1, -1, -1], dtype=np.float32)
OBSERVATION_HIGH = np.array([1, 1, 5, 2, 3, 1, 1, 1], dtype=np.float32)
REWARD_PARTS = ("reward_heading", "reward_rudder", "reward_rudder_rate", "reward_end")

HEADING_SCALE = np.radians(30.0)  # heading error and rudder angle that cost 1 and RUDDER_WEIGHT a step
RUDDER_WEIGHT = 0.1  # Norrbin 1972
RATE_WEIGHT = 0.01  # on the rudder rate in HEADING_SCALE per ship length sailed
INTEGRAL_ZONE = np.radians(10.0)  # the error is integrated only within this
INTEGRAL_LENGTHS = 10.0  # the integral's scale: INTEGRAL_ZONE for so many ship lengths
STEPS_PER_LENGTH = 20.0  # control intervals in the time to travel one ship length, about


@dataclass(frozen=True)
class CourseKeepingTask:
    """What is asked of the autopilot.

    Attributes
    ----------
    sea : {"calm", "slight", "moderate", "rough"} or Weather
        Sea state, whose wind and waves come from a direction drawn for each episode, or any weather.
    dt : float or None
        Control interval, s; by default about a twentieth of the time to travel one ship length,
        rounded to 1, 2 or 5 times a power of ten.
    episode_steps : int
        Control intervals after which an episode is truncated.
    course_change_deg : float
        Largest change of the set-point, degrees; 0 keeps the first course.
    change_interval_steps : int
        Mean number of control intervals between changes of the set-point.
    max_heading_error_deg : float
        Heading error beyond which control is lost, degrees, at most 180.
    max_envelope_distance : float
        How many times further out than the training data the model may be taken before the episode
        ends (see `Envelope.distance`).
    """

    sea: str | Weather = "calm"
    dt: float | None = None
    episode_steps: int = 600
    course_change_deg: float = 30.0
    change_interval_steps: int = 200
    max_heading_error_deg: float = 90.0
    max_envelope_distance: float = 5.0

    def __post_init__(self) -> None:
        as_weather(self.sea, "sea", None)
        if self.dt is not None:
            check_number(self.dt, "dt", above=0.0)
        check_number(self.episode_steps, "episode_steps", at_least=1)
        check_number(self.course_change_deg, "course_change_deg", at_least=0.0, at_most=90.0)
        check_number(self.change_interval_steps, "change_interval_steps", at_least=1)
        check_number(self.max_heading_error_deg, "max_heading_error_deg", above=0.0, at_most=180.0)
        check_number(self.max_envelope_distance, "max_envelope_distance", at_least=1.0)

    def interval(self, model: ShipModel) -> float:
        """Control interval for a ship, s."""
        return control_interval(model) if self.dt is None else float(self.dt)

    @property
    def weather(self) -> Weather:
        """What the sea is like."""
        return as_weather(self.sea, "sea", None)

    def substep(self, model: ShipModel) -> float:
        """Step of the integration, s."""
        settings = self.settings(model)
        return float(settings[rows.DT] / settings[rows.SUBSTEPS])

    def settings(self, model: ShipModel) -> Floats:
        """The task as the kernel reads it."""
        settings = np.zeros(rows.N_SETTINGS)
        settings[rows.DT] = self.interval(model)
        settings[rows.SUBSTEPS] = np.ceil(settings[rows.DT] / (1.5 * control_interval(model)))
        settings[rows.TIME_LIMIT] = self.episode_steps
        settings[rows.LARGEST_CHANGE] = np.radians(self.course_change_deg)
        settings[rows.CHANGE_INTERVAL] = self.change_interval_steps
        settings[rows.LARGEST_ERROR] = np.radians(self.max_heading_error_deg)
        settings[rows.LARGEST_DISTANCE] = self.max_envelope_distance
        settings[rows.HEADING_SCALE] = HEADING_SCALE
        settings[rows.RUDDER_WEIGHT] = RUDDER_WEIGHT
        settings[rows.RATE_WEIGHT] = RATE_WEIGHT
        settings[rows.INTEGRAL_ZONE] = INTEGRAL_ZONE
        settings[rows.INTEGRAL_SCALE] = observation_scales(model)[-1]
        return settings


def control_interval(model: ShipModel) -> float:
    """About a twentieth of the time to travel one ship length, as 1, 2 or 5 times a power of ten, s."""
    wanted = model.particulars["length"] / model.particulars["speed"] / STEPS_PER_LENGTH
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(min((1.0, 2.0, 5.0, 10.0), key=lambda step: abs(np.log(step * power / wanted))) * power)


def observation_scales(model: ShipModel) -> Floats:
    """Physical value of an observation of 1, in the order of `OBSERVATION_NAMES`, SI units."""
    length, speed, limit = model.particulars["length"], model.particulars["speed"], model.steering.limit
    integral = INTEGRAL_ZONE * INTEGRAL_LENGTHS * length / speed
    return np.array([1.0, 1.0, speed / length, speed, speed, limit, limit, integral])
