"""A task with its options: what is asked of an autopilot, in which sea, by which commands and sensors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from shipgym.checks import check_choice, check_keys, check_number, check_whole
from shipgym.engine.motion import Ship
from shipgym.errors import InputError
from shipgym.instruments.sensor_set import SensorSet, read_sensors, shipped_sensors
from shipgym.python_files import asked
from shipgym.sea.conditions import Weather, as_weather
from shipgym.ships import ShipModel
from shipgym.ships.manoeuvring_model import ship_of
from shipgym.tasks.definition import TaskDefinition, read_definition
from shipgym.tasks.scales import control_interval

Sea = str | Weather

LONGEST_INTERVAL = 5.0  # ship lengths at service speed
#: Keywords of environments of one ship, and of many.
ENV_OPTIONS = ("model", "task", "reward", "render_mode", "allow_unstable")
VECTOR_OPTIONS = (
    "num_envs",
    *ENV_OPTIONS,
    "autoreset_mode",
    "threads",
    "max_episode_steps",
)

ACTIONS = ("rudder", "rudder-discrete", "rudder-shaft")
#: Rudder orders of a discrete action, parts of the rudder limit.
RUDDER_ORDERS = (-1.0, -0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5, 1.0)
MEASUREMENTS = ("raw", "filtered")


class Observed(NamedTuple):
    """One quantity that is observed."""

    name: str
    low: float  # bounds of the observation
    high: float
    scale: float  # physical value of 1, SI units
    path: str  # where it stands in the task's `Observation`


@dataclass(frozen=True)
class Task:
    """What an autopilot has to do.

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
        length, rounded to 1, 2 or 5 times a power of ten.
    episode_steps : int
        Control intervals after which an episode is truncated.
    max_envelope_distance : float
        How many times further out than the training data the model may be taken before
        the episode ends (see `Envelope.distance`).
    action : {"rudder", "rudder-discrete", "rudder-shaft"}
        What is commanded: the rudder, one of the orders in `RUDDER_ORDERS`, or rudder
        and shaft speed. A shaft whose propeller is known ahead only is stopped by an
        order astern.
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
    dt: float | None = None
    episode_steps: int = 600
    max_envelope_distance: float = 5.0
    action: str = "rudder"
    roll: bool = False
    noise: float = 0.0
    measurement: str = "raw"
    water_depth: float = float("inf")
    sensors: SensorSet | None = None
    sensor_settings: Any = None
    options: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        if not self.seas:
            raise InputError("sea: none found, expected at least one")
        if self.dt is not None:
            check_number(self.dt, "dt", above=0.0)
        check_whole(self.episode_steps, "episode_steps", at_least=1)
        check_number(self.max_envelope_distance, "max_envelope_distance", at_least=1.0)
        check_choice(self.action, ACTIONS, "action")
        check_choice(self.measurement, MEASUREMENTS, "measurement")
        check_number(self.noise, "noise", at_least=0.0)
        if self.sensors is not None and (self.noise > 0.0 or self.measurement != "raw"):
            raise InputError(
                f"sensors: {self.sensors.source} and noise or measurement found,"
                " expected one of the two: noise and filters of a sensor set of your"
                " own are its own settings"
            )

    @classmethod
    def of(cls, definition: Any, **options: Any) -> Self:
        """A task by keywords: those of all tasks, and the settings of its own.

        Raises InputError for a keyword that it does not have, or a value out of range.
        """
        task = read_definition(definition, options.pop("reward", None))
        sensors = (
            None if options.get("sensors") is None else read_sensors(options["sensors"])
        )
        check_keys(options, cls.option_names(task, sensors), f"{task.name} options")
        own = {name: value for name, value in options.items() if name in task.settings}
        common = {
            name: value for name, value in options.items() if name in cls.common_names()
        }
        common |= {
            "episode_steps": options.get("episode_steps", task.episode_steps),
            "sensors": sensors,
        }
        if sensors is not None:
            of_sensors = {
                name: value
                for name, value in options.items()
                if name in sensors.settings
            }
            common["sensor_settings"] = sensors.make_settings(of_sensors)
        return cls(task, task.make_settings(own), **common, options=options)

    @classmethod
    def common_names(cls) -> tuple[str, ...]:
        """Keywords of all tasks."""
        return tuple(
            item.name
            for item in fields(cls)[2:]
            if item.name not in ("sensor_settings", "options")
        )

    @classmethod
    def option_names(
        cls, definition: TaskDefinition, sensors: SensorSet | None = None
    ) -> tuple[str, ...]:
        """Keywords of a task with a sensor set; InputError if two of them have one name."""
        names = (*definition.settings, *cls.common_names())
        if sensors is not None:
            names = (*names, *sensors.settings)
        for name in names:
            if names.count(name) > 1 or name in VECTOR_OPTIONS:
                where = (
                    sensors.source
                    if sensors and name in sensors.settings
                    else definition.source
                )
                raise InputError(
                    f"{where}: Settings.{name} found, which is a keyword already;"
                    " rename it"
                )
        return names

    def changed(self, **options: Any) -> Self:
        """The same task with other options."""
        return self.of(self.definition, **{**self.options, **options})

    @property
    def follows_path(self) -> bool:
        """Whether there is a path to follow, of waypoints."""
        return "waypoints" in self.definition.settings

    @property
    def name(self) -> str:
        """Of the task."""
        return self.definition.name

    @cached_property
    def seas(self) -> tuple[Weather, ...]:
        """The weathers of which each episode has one."""
        several: Sequence[Any] = (
            self.sea if isinstance(self.sea, list | tuple) else [self.sea]
        )
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
        """Refuse a ship that lacks what the task needs; InputError names the argument."""
        model.check_depth(self.water_depth)
        if self.dt is not None:
            longest = (
                LONGEST_INTERVAL
                * model.particulars["length"]
                / model.particulars["speed"]
            )
            check_number(
                self.dt,
                "dt",
                at_most=longest,
                hint=f"s: {LONGEST_INTERVAL:g} ship lengths",
            )
        if not getattr(model.dynamics, "has_rudder", True):
            raise InputError(
                f"model: {model.name!r} has no rudder, expected a ship that is steered"
                " by one"
            )
        if self.roll and "phi" not in model.state_names:
            raise InputError(
                f"roll: {model.name!r} does not roll; leave it out, or take a ship with"
                " 4 degrees of freedom"
            )
        if self.action == "rudder-shaft" and not model.service_shaft_speed > 0.0:
            raise InputError(
                f"action: 'rudder-shaft' found, but {model.name!r} has no shaft speed"
            )
        asked(self.definition.check, self.settings, model)
        for quantity in self.observed(model):
            where = (
                f"{self.definition.source}: Observation.{quantity.path}: scale for"
                f" {model.name!r}"
            )
            check_number(quantity.scale, where, above=0.0)
        where = f"{self.definition.source}: plan_length"
        check_whole(
            asked(self.definition.plan_length, self.settings), where, at_least=0
        )

    def observed(self, model: ShipModel) -> tuple[Observed, ...]:
        """What is observed of a ship, in order."""
        ship = ship_of(model, self.water_depth)
        shaft = self.action == "rudder-shaft"
        speed = shaft and "n" in model.state_names
        shown = (
            "",
            *["roll"] * self.roll,
            *["shaft"] * shaft,
            *["shaft speed"] * speed,
        )
        return tuple(
            Observed(
                path.rpartition(".")[2],
                seen.low,
                seen.high,
                self.scale(path, ship),
                path,
            )
            for path, seen in self.definition.seen.items()
            if seen.option in shown
        )

    def instruments(self, windy: bool) -> SensorSet:
        """What shows the ship, in weather or in calm water."""
        return self.sensors or shipped_sensors(
            windy, self.noise > 0.0, self.measurement == "filtered"
        )

    def scale(self, path: str, ship: Ship) -> float:
        """Physical value of an observation of 1."""
        scale = self.definition.seen[path].scale
        return asked(scale, ship, self.settings) if callable(scale) else scale

    @property
    def n_commands(self) -> int:
        """Number of commands: rudder, and shaft."""
        return 2 if self.action == "rudder-shaft" else 1

    def least_shaft(self, model: ShipModel) -> float:
        """Least command of the shaft, part of service speed; one that may not turn astern is stopped."""
        return -1.0 if model.turns_astern else 0.0

    @cached_property
    def info_names(self) -> tuple[str, ...]:
        """What `info` has."""
        parts = [f"reward_{name}" for name in (*self.definition.reward_names, "end")]
        return (*self.definition.reported, "envelope_distance", "extrapolating", *parts)

    @cached_property
    def flags(self) -> frozenset[str]:
        """What of it is true or false."""
        return frozenset({"extrapolating", *self.definition.flags})

    @property
    def reward_parts(self) -> tuple[str, ...]:
        """Names of the parts of the reward among those of `info`."""
        return tuple(name for name in self.info_names if name.startswith("reward_"))

    def __getattr__(self, name: str) -> Any:
        """A setting by its name."""
        if name.startswith("_") or name in ("definition", "settings", "seas"):
            raise AttributeError(name)
        for record in (
            self.settings,
            *(value for value in self.settings if hasattr(value, "_fields")),
        ):
            if name in record._fields:
                return getattr(record, name)
        raise AttributeError(f"task {self.definition.name!r} has no setting {name!r}")


def course_keeping_task(**options: Any) -> Task:
    """The task of course keeping by keywords (`Task.of`)."""
    return Task.of("CourseKeeping", **options)


def path_following_task(**options: Any) -> Task:
    """The task of path following by keywords (`Task.of`)."""
    return Task.of("PathFollowing", **options)
