"""What the tasks of all environments have in common: the sea, the commands, what is seen, and its price."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from shipgym.checks import check_choice, check_keys, check_number, check_whole
from shipgym.errors import InputError
from shipgym.kernels import layout
from shipgym.kernels import voyage_rows as rows
from shipgym.sea.conditions import Weather
from shipgym.sea.weather_column import as_weather
from shipgym.ships import ShipModel
from shipgym.trials.sensors import SEA_TRIAL

Floats = NDArray[np.float64]
Sea = str | Weather

HEADING_SCALE = np.radians(30.0)  # heading error and rudder angle that cost 1 and RUDDER_WEIGHT a step
RUDDER_WEIGHT = 0.1  # Norrbin 1972
RATE_WEIGHT = 0.01  # on the rudder rate in HEADING_SCALE per ship length sailed
ROLL_SCALE = np.radians(30.0)  # heel that costs `roll_weight` a step, and is seen as 1
ROLL_RATE_SCALE = 0.1  # rad/s, seen as 1
INTEGRAL_ZONE = np.radians(10.0)  # the error is integrated only within this
INTEGRAL_LENGTHS = 10.0  # the integral's scale: INTEGRAL_ZONE for so many ship lengths
LONGEST_INTERVAL = 5.0  # ship lengths at service speed
STEPS_PER_LENGTH = 20.0  # control intervals in the time to travel one ship length, about

ACTIONS = ("rudder", "rudder-discrete", "rudder-shaft")
#: Rudder orders of a discrete action, parts of the rudder limit.
RUDDER_ORDERS = (-1.0, -0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5, 1.0)
MEASUREMENTS = ("raw", "filtered")

COMMON_INFO = (
    "heading_error", "envelope_distance", "extrapolating",
    "reward_rudder", "reward_rudder_rate", "reward_roll", "reward_envelope", "reward_end",
)  # fmt: skip


class Observed(NamedTuple):
    """One quantity that is observed.

    Attributes
    ----------
    name : str
        Of the quantity.
    low, high : float
        Bounds of what is seen.
    scale : float
        Physical value of 1, SI units.
    row : int
        Where the kernels keep it.
    """

    name: str
    low: float
    high: float
    scale: float
    row: int


@dataclass(frozen=True)
class Task(ABC):
    """What is asked of an autopilot.

    Attributes
    ----------
    sea : {"calm", "slight", "moderate", "rough"}, Weather, or a sequence of them
        Sea state, whose wind and waves come from a direction drawn for each episode, or any weather; of
        several one is drawn for each episode.
    dt : float or None
        Control interval, s; by default about a twentieth of the time to travel one ship length,
        rounded to 1, 2 or 5 times a power of ten.
    episode_steps : int
        Control intervals after which an episode is truncated.
    max_envelope_distance : float
        How many times further out than the training data the model may be taken before the episode
        ends (see `Envelope.distance`).
    action : {"rudder", "rudder-discrete", "rudder-shaft"}
        What is commanded: the rudder, one of the orders in `RUDDER_ORDERS`, or rudder and shaft speed. A
        shaft whose propeller is known ahead only is stopped by an order astern.
    roll : bool
        Whether roll angle and rate are observed.
    roll_weight : float
        Cost of a step with 30 degrees of heel.
    envelope_weight : float
        Cost of a step in which the model extrapolates.
    noise : float
        Noise of heading, yaw rate, speeds and position, in multiples of a sea trial's sensors (`SEA_TRIAL`).
    measurement : {"raw", "filtered"}
        Whether heading and yaw rate are shown with the first-order motion in waves or through a notch filter
        at the frequency of encounter.
    water_depth : float
        m; for ships that know shallow water.
    """

    sea: Sea | Sequence[Sea] = "calm"
    dt: float | None = None
    episode_steps: int = 600
    max_envelope_distance: float = 5.0
    action: str = "rudder"
    roll: bool = False
    roll_weight: float = 0.0
    envelope_weight: float = 0.0
    noise: float = 0.0
    measurement: str = "raw"
    water_depth: float = float("inf")

    kernel: ClassVar[str] = ""  # file of its task in `shipgym.kernels`
    info_names: ClassVar[tuple[str, ...]] = COMMON_INFO
    flags: ClassVar[frozenset[str]] = frozenset({"extrapolating"})

    def __post_init__(self) -> None:
        if not self.seas:
            raise InputError("sea: none found, expected at least one")
        if self.dt is not None:
            check_number(self.dt, "dt", above=0.0)
        check_whole(self.episode_steps, "episode_steps", at_least=1)
        check_number(self.max_envelope_distance, "max_envelope_distance", at_least=1.0)
        check_choice(self.action, ACTIONS, "action")
        check_choice(self.measurement, MEASUREMENTS, "measurement")
        for name in ("roll_weight", "envelope_weight", "noise"):
            check_number(getattr(self, name), name, at_least=0.0)

    @classmethod
    def from_options(cls, options: Mapping[str, Any]) -> Self:
        """A task by keywords.

        Raises
        ------
        InputError
            For a keyword that it does not have, or a value out of range.
        """
        check_keys(options, [item.name for item in fields(cls)], f"{cls.__name__} options")
        return cls(**options)

    @cached_property
    def seas(self) -> tuple[Weather, ...]:
        """The weathers of which each episode has one."""
        several: Sequence[Any] = self.sea if isinstance(self.sea, list | tuple) else [self.sea]
        return tuple(as_weather(one, "sea", None) for one in several)

    @property
    def weather(self) -> Weather:
        """What the sea is like, the first of several."""
        return self.seas[0]

    def interval(self, model: ShipModel) -> float:
        """Control interval for a ship, s."""
        return control_interval(model) if self.dt is None else float(self.dt)

    def substeps(self, model: ShipModel) -> int:
        """Steps of the integration in a control interval."""
        return int(np.ceil(self.interval(model) / (1.5 * control_interval(model))))

    def substep(self, model: ShipModel) -> float:
        """Step of the integration, s."""
        return self.interval(model) / self.substeps(model)

    def check_fits(self, model: ShipModel) -> None:
        """Refuse a ship that lacks what the task needs.

        Raises
        ------
        InputError
            Naming the argument.
        """
        model.check_depth(self.water_depth)
        if self.dt is not None:
            longest = LONGEST_INTERVAL * model.particulars["length"] / model.particulars["speed"]
            check_number(self.dt, "dt", at_most=longest, hint=f"s: {LONGEST_INTERVAL:g} ship lengths")
        if not getattr(model.dynamics, "has_rudder", True):
            raise InputError(f"model: {model.name!r} has no rudder, expected a ship that is steered by one")
        if self.roll and "phi" not in model.state_names:
            raise InputError(
                f"roll: {model.name!r} does not roll; leave it out, or take a ship with 4 degrees of freedom"
            )
        if self.action == "rudder-shaft" and not model.service_shaft_speed > 0.0:
            raise InputError(f"action: 'rudder-shaft' found, but {model.name!r} knows no shaft speed")

    def observed(self, model: ShipModel) -> tuple[Observed, ...]:
        """What is observed of a ship, in order."""
        length, speed = model.particulars["length"], model.particulars["speed"]
        limit = model.steering.limit
        integral = INTEGRAL_ZONE * INTEGRAL_LENGTHS * length / speed
        at = layout.offsets(rows.OBSERVED, rows.N_STEERING)
        steering = (
            Observed("heading_error_sin", -1.0, 1.0, 1.0, at[0]),
            Observed("heading_error_cos", -1.0, 1.0, 1.0, at[1]),
            Observed("yaw_rate", -5.0, 5.0, speed / length, at[2]),
            Observed("sway", -2.0, 2.0, speed, at[3]),
            Observed("surge", -2.0, 3.0, speed, at[4]),
            Observed("rudder", -1.0, 1.0, limit, at[5]),
            Observed("last_command", -1.0, 1.0, limit, at[6]),
            Observed("heading_error_integral", -1.0, 1.0, integral, at[7]),
        )
        return steering + self.observed_of_task(model) + self._observed_extras(model)

    @property
    def n_commands(self) -> int:
        """Number of commands: rudder, and shaft."""
        return 2 if self.action == "rudder-shaft" else 1

    def least_shaft(self, model: ShipModel) -> float:
        """Least command of the shaft, part of service speed; one that may not turn astern is stopped."""
        return -1.0 if model.turns_astern else 0.0

    def observed_of_task(self, model: ShipModel) -> tuple[Observed, ...]:
        """What the task itself adds to what is observed."""
        return ()

    def _observed_extras(self, model: ShipModel) -> tuple[Observed, ...]:
        extras: tuple[Observed, ...] = ()
        if self.roll:
            extras += (
                Observed("roll", -3.0, 3.0, ROLL_SCALE, rows.ROLL_SEEN),
                Observed("roll_rate", -5.0, 5.0, ROLL_RATE_SCALE, rows.ROLL_RATE_SEEN),
            )
        if self.action == "rudder-shaft":
            shaft = model.service_shaft_speed
            if "n" in model.state_names:
                extras += (Observed("shaft_speed", -2.0, 2.0, shaft, rows.SHAFT_SEEN),)
            extras += (Observed("last_shaft_command", -1.0, 1.0, shaft, rows.SHAFT_COMMAND_SEEN),)
        return extras

    def settings(self, model: ShipModel) -> Floats:
        """The task as the kernels read it."""
        listed = self.listed(model)
        settings = np.zeros(rows.LIST + len(listed))
        settings[rows.DT] = self.interval(model)
        settings[rows.SUBSTEPS] = self.substeps(model)
        settings[rows.TIME_LIMIT] = self.episode_steps
        settings[rows.LARGEST_DISTANCE] = self.max_envelope_distance
        settings[rows.HEADING_SCALE] = HEADING_SCALE
        settings[rows.RUDDER_WEIGHT] = RUDDER_WEIGHT
        settings[rows.RATE_WEIGHT] = RATE_WEIGHT
        settings[rows.ROLL_WEIGHT], settings[rows.ROLL_SCALE] = self.roll_weight, ROLL_SCALE
        settings[rows.ENVELOPE_WEIGHT] = self.envelope_weight
        settings[rows.INTEGRAL_ZONE] = INTEGRAL_ZONE
        settings[rows.INTEGRAL_LENGTHS] = INTEGRAL_LENGTHS
        settings[rows.NOISE] = self.noise > 0.0
        deviations = [SEA_TRIAL[name].noise for name in ("psi", "r", "u", "x")]
        settings[rows.NOISE_PSI : rows.NOISE_POSITION + 1] = self.noise * np.array(deviations)
        settings[rows.WAVE_FILTERED] = self.measurement == "filtered"
        shown = [quantity.row for quantity in self.observed(model)]
        settings[rows.N_SHOWN] = len(shown)
        settings[rows.SHOWN : rows.SHOWN + len(shown)] = shown
        own = self.own_settings(model)
        settings[rows.TASK_SETTINGS : rows.TASK_SETTINGS + len(own)] = own
        settings[rows.LEAST_SHAFT] = self.least_shaft(model)
        settings[rows.N_LIST], settings[rows.LIST :] = len(listed), listed
        return settings

    @abstractmethod
    def own_settings(self, model: ShipModel) -> Sequence[float]:
        """Settings of the task's own kernel, in its order."""

    def listed(self, model: ShipModel) -> Sequence[float]:
        """Numbers of any count that the task's own kernel reads."""
        return ()

    def episode_rows(self) -> int:
        """Rows of the state that last over an episode."""
        return 0

    @property
    def reward_parts(self) -> tuple[str, ...]:
        """Names of the parts of the reward among those of `info`."""
        return tuple(name for name in self.info_names if name.startswith("reward_"))


NO_OPTIONS: Mapping[str, Any] = MappingProxyType({})


def control_interval(model: ShipModel) -> float:
    """About a twentieth of the time to travel one ship length, as 1, 2 or 5 times a power of ten, s."""
    wanted = model.particulars["length"] / model.particulars["speed"] / STEPS_PER_LENGTH
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(min((1.0, 2.0, 5.0, 10.0), key=lambda step: abs(np.log(step * power / wanted))) * power)
