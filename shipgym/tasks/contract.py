"""Contract of tasks, rewards and sensor sets: files of functions on named records.

A task file defines (`shipgym/tasks/course_keeping.py` is one)

* `Settings`, `State`, `Reward` and `Observation`, named tuples of floats, of such
  records, and of arrays of a fixed size of either, which are tuples:
  `tuple[Target, Target]`, or `Annotated[tuple[float, ...], Size(8)]`. `Settings`
  has defaults, which are keywords of its environment; a last field annotated `Numbers`
  is a list. The fields of `Reward` are minus the parts of the cost of a step, such as
  minus the square of an error; `info` has them as `reward_NAME`, and the cost. What a
  learner earns follows from the cost (see below). Each field of `Observation` is
  annotated with an `ObservationSpec`; fields of a record that occurs twice, and entries
  of arrays, are prefixed: `starboard_range`, `targets_0_range`.
* `begin(ship, settings, random, plan) -> (Motion, State)`: the beginning of an episode.
* `step(motion, state, interval, ship, settings) -> (State, Reward, failed, arrived)`:
  after an interval.
* `observe(readings, state, interval, ship, settings) -> Observation`: the
  observations of the autopilot, in SI units.

and may define

* `due(motion, state, interval, ship, settings) -> bool` and `on_event(motion, state,
  interval, ship, settings, random, plan) -> State`: rare events, such as the next
  set-point.
* `worst_cost(settings) -> float`: the largest cost of a step. A lost ship costs
  as much for the rest of the episode, so that ending early never lowers the cost.
* `NAME`, by default that of the file, and `EPISODE_STEPS`, by default 600.
* `REPORTED`: names of fields of `State` that `info` has; those annotated `Flag` as
  booleans.
* `plan_length(settings) -> int`: how many numbers `plan` holds, an array that lasts
  over an episode.
* `check(settings, model)`: raises `InputError` for settings that do not fit, first
  without a ship, `model` None, then with one; `listed(value)`: what a keyword of
  another kind, such as a list of waypoints, means as numbers.
* `Goal`, `achieved`, `desired` and `goal_reward`: goals (`shipgym.tasks.goals`).
* `current(x, y, settings) -> (north, east)`: a current by place, m/s.
* `draw(motion, state, ship, settings)`: shapes for pictures (`shipgym.tasks.shapes`).

Other ships are records in `State` that `step` sails (`shipgym.tasks.traffic`).

`step`, `observe`, `due` and `reward` may take `random`, `plan` or both, by these names,
behind `settings`. There `plan` is only read, and `random` holds the numbers of the
interval, not of the episode: `drawn(random, 0, low, high)` is another in each.
`numpy.random` and `random` are refused.

The engine makes the reward of the cost c of a step, for any task: 1 - c / (c + b),
where the keyword `bounded` is b, 0.1 by default. A lost ship earns nothing from then
on, and one that has arrived 1 for each interval of the keyword `loss_horizon`. Let
c = 1 be the cost of a ship that makes no headway: then lingering does not pay. With
`bounded=False` the reward is minus the cost.

A field `heading_setpoint` of `State`, rad, is `set_point` in `physical_state()` and in
pictures.

A reward file defines `Reward` and `reward(motion, state, interval, ship, settings) ->
Reward`, where `state` is the task's after the interval, and may define `worst_cost`. A
sensor file defines `Settings`, `Memory`, `measure` and `readings`
(`shipgym/instruments/perfect.py` is one); its settings are keywords too.

`step`, `observe`, `reward`, `measure` and `readings` are compiled into a loop over
ships: they call functions of `math` that the compiler vectorises (`sqrt`, `fabs`) and
those of `shipgym.engine.mathematics`, and choose by `pick` or a conditional expression.
The other functions are called ship by ship and may do what Numba can.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shipgym.engine.mathematics import arctan2, clip, pick, sin_cos, wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.random import GOLDEN, NORMAL, episode_word, normal, uniform
from shipgym.engine.records import Size

#: A last field of `Settings` that holds any number of numbers, and its default, none.
Numbers = NDArray[np.float64]
NO_NUMBERS: Numbers = np.zeros(0)
#: A field of `State` that is a boolean, 1 or 0.
Flag = Annotated[float, bool]
#: Physical value of an observation of 1, or how it follows from ship and settings.
Scale = float | Callable[[Ship, Any], float]


class Random(NamedTuple):
    """Key of the random numbers of one episode.

    Each number is a function of the key, the episode and its own number alone.
    """

    key: Any  # uint64
    episode: Any  # uint64


def drawn(random: Random, number: int, low: float, high: float) -> float:
    """Draw the random number of an episode that has a number, in [low, high)."""
    return uniform(random.key, random.episode, np.uint64(number), low, high)


def drawn_normal(random: Random, number: int) -> float:
    """Draw the normally distributed random number that has a number, of variance 1."""
    word = episode_word(random.key, random.episode) ^ NORMAL
    return normal(word, np.uint64(number) * GOLDEN)


class Interval(NamedTuple):
    """Control interval that is over."""

    dt: float  # s
    steps: float  # control intervals so far
    rudder_before: float  # rad, rudder at its beginning
    rudder_command: float  # part of the limit
    shaft_command: float  # part of the shaft speed at service speed
    # distance from the training data (`Envelope.distance`)
    envelope_distance: float
    extrapolating: float  # 1 where the ship was outside that data


class Readings(NamedTuple):
    """The readings of the ship's instruments."""

    x: float  # m, north
    y: float  # m, east
    psi: float  # rad
    u: float  # m/s, through the water
    v: float  # m/s
    r: float  # rad/s
    p: float  # rad/s
    phi: float  # rad
    delta: float  # rad
    n: float  # 1/s
    track_psi: float  # rad, heading to which the velocity over ground is referred
    ahead: float  # m/s, over ground, ahead
    aside: float  # m/s, over ground, to starboard


@dataclass(frozen=True)
class ObservationSpec:
    """Bounds, unit and scale of an observation.

    Attributes
    ----------
    low, high : float
        Bounds of the observation.
    unit : str
        Unit of the quantity.
    scale : float or callable
        Physical value of an observation of 1, or `(ship, settings) -> float`.
    option : str
        `roll`, `shaft` or `shaft speed`, which the observation is made for; by default
        it is always made.
    """

    low: float
    high: float
    unit: str = "-"
    scale: Scale = 1.0
    option: str = ""


@dataclass(frozen=True)
class Setting:
    """Bounds of a setting.

    Attributes
    ----------
    about : str
        Its meaning, a sentence.
    at_least, at_most, above : float or None
        Its bounds.
    whole : bool
        Whether it is an integer.
    """

    about: str
    at_least: float | None = None
    at_most: float | None = None
    above: float | None = None
    whole: bool = False


def under_way(x: float, y: float, psi: float, speed: float, shaft: float) -> Motion:
    """Straight ahead at a speed, m/s, the rudder amidships, with a shaft speed, 1/s.

    The shaft keeps that speed until it is commanded another.
    """
    return Motion(x, y, psi, speed, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, shaft)


def at_service_speed(x: float, y: float, psi: float, ship: Ship) -> Motion:
    """Straight ahead at service speed, the rudder amidships."""
    return under_way(x, y, psi, ship.speed, ship.shaft)


__all__ = [
    "NO_NUMBERS",
    "Flag",
    "Interval",
    "Motion",
    "Numbers",
    "ObservationSpec",
    "Random",
    "Readings",
    "Scale",
    "Setting",
    "Ship",
    "Size",
    "arctan2",
    "at_service_speed",
    "clip",
    "drawn",
    "drawn_normal",
    "pick",
    "sin_cos",
    "under_way",
    "wrap",
]
