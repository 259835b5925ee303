"""Task with its options: settings, sea, commands and sensors."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from math import inf
from typing import Any, NamedTuple, Self

import numpy as np

from shipgym.checks import bounded as bounded_number
from shipgym.checks import (
    check_choice,
    check_flag,
    check_keys,
    check_number,
    check_whole,
    keep_numbers,
)
from shipgym.engine.lane_records import CONSTRAINT
from shipgym.engine.motion import Ship
from shipgym.errors import InputError
from shipgym.instruments.sensor_set import SensorSet, read_sensors, shipped_sensors
from shipgym.models import ShipModel
from shipgym.python_files import asked
from shipgym.sea.conditions import Weather, as_weather
from shipgym.ships.manoeuvring_model import ship_of
from shipgym.tasks.contract import ObservationSpec
from shipgym.tasks.definition import TaskDefinition, read_definition
from shipgym.tasks.scales import control_interval, rounded_interval

Sea = str | Weather

#: Keywords of environments of one ship, and of many.
ENV_OPTIONS = (
    "model",
    "task",
    "reward",
    "render_mode",
    "allow_unstable",
    "action_repeat",
    "rate_limit",
    "frame_stack",
    "constraint_cost",
)
VECTOR_OPTIONS = (
    "num_envs",
    *ENV_OPTIONS,
    "autoreset_mode",
    "max_episode_steps",
)

ACTIONS = ("rudder", "rudder-discrete", "rudder-shaft")
#: Rudder orders of a discrete action, parts of the rudder limit.
RUDDER_ORDERS = (-1.0, -0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5, 1.0)
_RESET_OPTIONS = ("reset_mask", "start")  # that are no settings of the task


class Observed(NamedTuple):
    """Quantity that is observed of a ship."""

    name: str
    low: float  # bounds of the observation
    high: float
    scale: float  # physical value of 1, SI units
    path: str  # of its field in the task's `Observation`


@dataclass(frozen=True)
class Task:
    """Task of an autopilot, with its settings, sea, commands and sensors.

    Attributes
    ----------
    definition : TaskDefinition
        Records and functions of the task.
    settings : NamedTuple
        Its settings.
    sea : {"calm", "slight", "moderate", "rough"}, Weather, or a sequence of them
        Sea state, whose wind and waves come from a direction drawn for each episode, or
        any weather; of several one is drawn for each episode.
    dt : float or None
        Control interval, s; by default about a twentieth of the time to travel one ship
        length, or as the task's file says, rounded to 1, 2 or 5 times a power of ten.
    episode_steps : int
        Control intervals after which an episode is truncated.
    max_envelope_distance : float
        Distance from the training data at which an episode ends, in multiples of their
        extent (see `Envelope.distance`).
    action : {"rudder", "rudder-discrete", "rudder-shaft"}
        Commands: the rudder, one of the orders in `RUDDER_ORDERS`, or rudder and shaft
        speed. A shaft whose propeller is known ahead only is stopped by an order
        astern.
    roll : bool
        Whether roll angle and rate are observed.
    noise : float
        Noise of heading, yaw rate, speeds and position, in multiples of a sea trial's
        sensors (`SEA_TRIAL`).
    measurement : {"raw", "filtered"}
        Whether heading and yaw rate are shown with the first-order motion in waves or
        through a notch filter at the frequency of encounter.
    water_depth : float
        m; for ships that know shallow water.
    bounded : bool or float
        Whether the reward of a step is bounded, `PERFECT_STEP` - cost / (cost + scale);
        a number is the scale, the task's `HALF_REWARD_COST` by default. False for minus
        the cost.
    loss_horizon : float or None
        Control intervals that the end of an episode stands for, at most its rest: a
        bounded reward pays a ship that has arrived the largest reward for each, and one
        that is lost the least; minus the cost charges a lost one the worst. By default
        the task's `LOSS_HORIZON`, or, of minus the cost, the rest of the episode.
    checked : bool
        Whether functions of your own are compiled with checks of indices and, where an
        episode begins or an event is due, of divisors.
    sensors : SensorSet, optional
        Instruments of a user's own in place of `noise` and `measurement`; as a keyword,
        their file.
    sensor_settings : NamedTuple, optional
        Their settings.
    options : mapping
        Keywords that it was made by.
    """

    definition: TaskDefinition
    settings: Any
    sea: Sea | Sequence[Sea] = "calm"
    dt: float | None = bounded_number(None, above=0.0)
    episode_steps: int = 600
    max_envelope_distance: float = bounded_number(5.0, at_least=1.0)
    action: str = "rudder"
    roll: bool = False
    noise: float = bounded_number(0.0, at_least=0.0)
    measurement: str = "raw"
    water_depth: float = float("inf")
    bounded: bool | float = True
    loss_horizon: float | None = bounded_number(None, at_least=0.0)
    checked: bool = True
    sensors: SensorSet | None = None
    sensor_settings: Any = None
    options: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        if not self.seas:
            raise InputError("sea: expected at least one, got none")
        keep_numbers(self)
        check_whole(self.episode_steps, "episode_steps", at_least=1)
        for name in ("roll", "checked"):
            check_flag(getattr(self, name), name)
        check_choice(self.action, ACTIONS, "action")
        measurements = ("raw", "filtered")
        check_choice(self.measurement, measurements, "measurement")
        if not isinstance(self.bounded, bool):
            check_number(
                self.bounded,
                "bounded",
                above=0.0,
                hint="or True or False",
            )
        if self.sensors is not None and (self.noise > 0.0 or self.measurement != "raw"):
            raise InputError(
                "sensors: expected either these or noise and measurement, got"
                f" {self.sensors.source} and noise or measurement: noise and filters of"
                " a sensor set of your own are its own settings"
            )

    @classmethod
    def of(cls, definition: Any, others: Sequence[str] = (), /, **options: Any) -> Self:
        """Make a task by keywords: those of all tasks, and the settings of its own.

        `others` are keywords of its caller, for messages. Raises InputError for a
        keyword that it does not have, or a value out of range.
        """
        reward = options.pop("reward", None)
        task = read_definition(definition, reward)
        sensors = options.get("sensors")
        if sensors is not None:
            sensors = read_sensors(sensors)
        known = (*others, "reward", *cls.option_names(task, sensors))
        where = f"{task.name} options"
        check_keys(options, dict.fromkeys(known), where)

        # an option belongs to the task, to all tasks or to the sensor set
        own = _chosen(options, task.settings)
        common = _chosen(options, cls.common_names())
        common.setdefault("episode_steps", task.episode_steps)
        common["sensors"] = sensors
        if sensors is not None:
            of_sensors = _chosen(options, sensors.settings)
            common["sensor_settings"] = sensors.make_settings(of_sensors)
        return cls(
            definition=task,
            settings=task.make_settings(own),
            options=options,
            **common,
        )

    @classmethod
    def common_names(cls) -> tuple[str, ...]:
        """Keywords of all tasks."""
        own = ("definition", "settings", "sensor_settings", "options")
        return tuple(item.name for item in fields(cls) if item.name not in own)

    @classmethod
    def option_names(
        cls,
        definition: TaskDefinition,
        sensors: SensorSet | None = None,
    ) -> tuple[str, ...]:
        """Keywords of a task with a sensor set; InputError if two have one name."""
        names = [*definition.settings, *cls.common_names()]
        if sensors is not None:
            names += sensors.settings
        for name in names:
            taken = name in VECTOR_OPTIONS or name in _RESET_OPTIONS
            if names.count(name) > 1 or taken:
                source = definition.source
                if sensors is not None and name in sensors.settings:
                    source = sensors.source
                raise InputError(
                    f"{source}: Settings.{name}: expected a name of its own, got that"
                    " of another keyword; rename it"
                )
        return tuple(names)

    def changed(self, **options: Any) -> Self:
        """Make the same task with other options."""
        return self.of(self.definition, **{**self.options, **options})

    @property
    def follows_path(self) -> bool:
        """True where there is a path to follow, of waypoints."""
        return "waypoints" in self.definition.settings

    @property
    def name(self) -> str:
        """Name of the task."""
        return self.definition.name

    @cached_property
    def seas(self) -> tuple[Weather, ...]:
        """Weathers of which each episode has one."""
        seas: Sequence[Any] = [self.sea]
        if isinstance(self.sea, list | tuple):
            seas = self.sea
        return tuple(as_weather(sea, "sea", None) for sea in seas)

    @property
    def weather(self) -> Weather:
        """Weather of the task, the first of several."""
        return self.seas[0]

    def interval(self, model: ShipModel) -> float:
        """Control interval for a ship, s."""
        if self.dt is not None:
            return float(self.dt)
        return rounded_interval(model.travel_time, self.definition.steps_per_length)

    def substeps(self, model: ShipModel) -> int:
        """Steps of the integration in a control interval."""
        longest = 1.5 * control_interval(model)
        return int(np.ceil(self.interval(model) / longest))

    def substep(self, model: ShipModel) -> float:
        """Step of the integration, s."""
        return self.interval(model) / self.substeps(model)

    def check_fits(self, model: ShipModel) -> None:
        """Refuse a ship that lacks what the task needs, naming the argument."""
        model.check_depth(self.water_depth)
        if self.dt is not None:
            lengths = 5.0
            longest = lengths * model.travel_time
            hint = f"s: {lengths:g} ship lengths"
            check_number(self.dt, "dt", at_most=longest, hint=hint)
        if not getattr(model.dynamics, "has_rudder", True):
            raise InputError(
                "model: expected a ship that is steered by a rudder, got"
                f" {model.name!r}, which has none"
            )
        if self.roll and "phi" not in model.state_names:
            raise InputError(
                "roll: expected a ship with 4 degrees of freedom, got"
                f" {model.name!r}, which does not roll; leave it out"
            )
        if self.n_commands > 1 and not model.service_shaft_speed > 0.0:
            raise InputError(
                "action: expected one without a shaft for a ship without shaft speed,"
                f" {model.name!r}, got {self.action!r}"
            )

        self._check_definition(model)

    def _check_definition(self, model: ShipModel) -> None:
        """Ask the task itself, and for scales and a plan that fit the ship."""
        source = self.definition.source
        asked(self.definition.check, self.settings, model)
        for quantity in self.observed(model):
            where = f"{source}: Observation.{quantity.path}: scale for {model.name!r}"
            check_number(quantity.scale, where, above=0.0)
        length = asked(self.definition.plan_length, self.settings)
        check_whole(length, f"{source}: plan_length", at_least=0)

    def observed(self, model: ShipModel) -> tuple[Observed, ...]:
        """Quantities that are observed of a ship, in order."""
        options = [""]
        if self.roll:
            options.append("roll")
        if self.n_commands > 1:
            options.append("shaft")
            if "n" in model.state_names:
                options.append("shaft speed")

        ship = ship_of(model, self.water_depth)
        observed = []
        for path, spec in self.definition.observations.items():
            if spec.option not in options:
                continue
            quantity = Observed(
                name=self.definition.observation_names[path],
                low=spec.low,
                high=spec.high,
                scale=self.scale_of(spec, ship),
                path=path,
            )
            observed.append(quantity)
        return tuple(observed)

    def instruments(self, windy: bool) -> SensorSet:
        """Sensor set of the ship, in weather or in calm water."""
        if self.sensors is not None:
            return self.sensors
        return shipped_sensors(windy, self.noise > 0.0, self.measurement == "filtered")

    def scale_of(self, spec: ObservationSpec, ship: Ship) -> float:
        """Physical value of an observation of 1, by its specification."""
        scale = spec.scale
        return asked(scale, ship, self.settings) if callable(scale) else scale

    @property
    def n_commands(self) -> int:
        """Number of commands: rudder, and shaft."""
        return 2 if "shaft" in self.action else 1

    @property
    def orders(self) -> tuple[float, ...]:
        """Rudder orders of a discrete action; empty if it is continuous."""
        return RUDDER_ORDERS if self.action == "rudder-discrete" else ()

    @property
    def half_reward_cost(self) -> float:
        """Cost of a step that earns half of a bounded reward; 0 for minus the cost."""
        if isinstance(self.bounded, bool):
            return self.definition.half_reward_cost if self.bounded else 0.0
        return float(self.bounded)

    @property
    def end_intervals(self) -> float:
        """Control intervals that the end of an episode stands for."""
        if self.loss_horizon is not None:
            return float(self.loss_horizon)
        horizon = self.definition.loss_horizon if self.bounded else inf
        return min(horizon, float(self.episode_steps))

    def least_shaft(self, model: ShipModel) -> float:
        """Least command of the shaft, part of service speed; 0 if it stays ahead."""
        return -1.0 if model.dynamics.astern else 0.0

    @cached_property
    def info_names(self) -> tuple[str, ...]:
        """Names of the numbers in `info`."""
        engine = ("envelope_distance", "extrapolating", "cost")
        return (*engine, *self.reward_parts, *self.reported)

    @property
    def reported(self) -> tuple[str, ...]:
        """Names of those that are fields of the state, constraints last."""
        constraints = [f"{CONSTRAINT}{name}" for name in self.constraints]
        return (*self.definition.reported, *constraints)

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of its constraints; `heel` is one where roll is observed."""
        names = self.definition.constraints
        return tuple(name for name in names if self.roll or name != "heel")

    @cached_property
    def flags(self) -> frozenset[str]:
        """Names of those that are booleans."""
        return frozenset({"extrapolating", *self.definition.flags})

    @property
    def reward_parts(self) -> tuple[str, ...]:
        """Names of the parts of the reward among them."""
        definition = self.definition
        parts = (*definition.reward_names, "end")
        return tuple(f"reward_{name}" for name in parts)

    def __getattr__(self, name: str) -> Any:
        """Setting of the task by its name."""
        if name.startswith("_") or name in ("definition", "settings", "seas"):
            raise AttributeError(name)
        if name in self.settings._fields:
            return getattr(self.settings, name)
        for record in self.settings:
            if name in getattr(record, "_fields", ()):
                return getattr(record, name)
        raise AttributeError(f"task {self.definition.name!r} has no setting {name!r}")


def _chosen(options: Mapping[str, Any], names: Collection[str]) -> dict[str, Any]:
    """Those of some names among options."""
    return {name: value for name, value in options.items() if name in names}


def course_keeping_task(**options: Any) -> Task:
    """Make the task of course keeping by keywords (`Task.of`)."""
    return Task.of("CourseKeeping", **options)


def path_following_task(**options: Any) -> Task:
    """Make the task of path following by keywords (`Task.of`)."""
    return Task.of("PathFollowing", **options)
