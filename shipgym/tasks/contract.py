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
* `NAME`, by default that of the file; `EPISODE_STEPS`, by default 600; and
  `STEPS_PER_LENGTH`, control intervals in the time to travel a length, by default 20.
* `REPORTED`: names of fields of `State` that `info` has; those annotated `Flag` as
  booleans. A task whose episodes can end well reports `success`.
* `CONSTRAINTS`: names of fields of `State` that are constraints, apart from the cost:
  how far the ship is beyond a limit, in parts of the limit, 0 where she keeps it.
  `info["constraints"]` has them by name, `Engine.info` as `constraint_NAME`. A field
  `heel` is one only with `roll=True`.
* `plan_length(settings) -> int`: how many numbers `plan` holds, an array that lasts
  over an episode.
* `check(settings, model)`: raises `InputError` for settings that do not fit, first
  without a ship, `model` None, then with one; `listed(value)`: what a keyword of
  another kind, such as a list of waypoints, means as numbers.
* `draw(motion, state, ship, settings)`: shapes for pictures (`shipgym.tasks.shapes`).
* `rule(seen, ship, settings)`: the command that the best rule you know gives for an
  `Observation` in SI units: the rudder, or (rudder, shaft), as parts of the largest.
  `shipgym train` compares agents with it. It is plain Python, asked ship by ship.

Other ships are records in `State` that `step` sails (`shipgym.tasks.traffic`).

`numpy.random` and `random` are refused.

The engine makes the reward of the cost c of a step, for any task: p - c / (c + b). At
its end a lost ship is paid the least reward, p - 1, and one that has arrived the
largest, p, for each interval of the horizon, or of the rest of the episode if that is
shorter. b is `HALF_REWARD_COST`, 0.1 by default, or the keyword `bounded`; p is
`PERFECT_STEP`, from 0 to 1, by default 1; the horizon is `LOSS_HORIZON`, 100 by
default, `math.inf` for all the rest, or the keyword `loss_horizon`. Let c = 1 be the
cost of a ship that makes no headway: then lingering does not pay. With `bounded=False`
the reward is minus the cost.

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

from typing import Annotated

import numpy as np

from shipgym.engine.annotations import (
    NO_NUMBERS,
    Flag,
    Numbers,
    ObservationSpec,
    Scale,
    Setting,
)
from shipgym.engine.lane_records import Interval, Random, Readings
from shipgym.engine.mathematics import arctan2, clip, pick, sin_cos, wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.random import GOLDEN, NORMAL, episode_word, normal, uniform
from shipgym.engine.records import Size

#: Observation between -1 and 1, of the same physical value.
Unit = Annotated[float, ObservationSpec(-1.0, 1.0)]


def drawn(random: Random, number: int, low: float, high: float) -> float:
    """Draw the random number of an episode that has a number, in [low, high)."""
    return uniform(random.key, random.episode, np.uint64(number), low, high)


def drawn_normal(random: Random, number: int) -> float:
    """Draw the normally distributed random number that has a number, of variance 1."""
    word = episode_word(random.key, random.episode) ^ NORMAL
    return normal(word, np.uint64(number) * GOLDEN)


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
    "Unit",
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
