"""A fairway due north with a speed limit on part of it. Run it to check the task and to
train an agent."""

from math import fabs
from typing import Annotated, NamedTuple

from shipgym.tasks.contract import (
    Flag,
    ObservationSpec,
    Setting,
    at_service_speed,
    clip,
    drawn,
    pick,
    sin_cos,
)

REPORTED = ("speeding", "cross_track", "success")


class Settings(NamedTuple):
    half_width: Annotated[
        float, Setting("Of the fairway, ship lengths.", above=0.0)
    ] = 2.0
    zone_begins: Annotated[
        float, Setting("Of the limit, ship lengths north.", at_least=0.0)
    ] = 8.0
    zone_ends: Annotated[
        float, Setting("Of the limit, ship lengths north.", above=0.0)
    ] = 16.0
    speed_limit: Annotated[
        float, Setting("Part of service speed.", above=0.0, at_most=1.0)
    ] = 0.7
    over_speed_weight: Annotated[
        float, Setting("Cost of service speed over the limit.", at_least=0.0)
    ] = 50.0


class State(NamedTuple):
    heading_setpoint: float  # rad, to steer; shown in pictures
    cross_track: float  # m, positive to starboard
    limit: float  # m/s, in force
    speeding: Flag
    success: Flag


class Reward(NamedTuple):
    cross_track: float
    delay: float
    over_speed: float


class Observation(NamedTuple):
    heading_sin: Annotated[float, ObservationSpec(-1.0, 1.0)]
    heading_cos: Annotated[float, ObservationSpec(-1.0, 1.0)]
    yaw_rate: Annotated[
        float,
        ObservationSpec(-5.0, 5.0, "rad/s", lambda ship, _: ship.speed / ship.length),
    ]
    surge: Annotated[
        float, ObservationSpec(-2.0, 3.0, "m/s", lambda ship, _: ship.speed)
    ]
    cross_track: Annotated[
        float,
        ObservationSpec(-2.0, 2.0, "m", lambda ship, s: s.half_width * ship.length),
    ]
    limit: Annotated[
        float, ObservationSpec(0.0, 1.0, "m/s", lambda ship, _: ship.speed)
    ]
    to_zone: Annotated[
        float, ObservationSpec(0.0, 1.0, "m", lambda ship, _: 8.0 * ship.length)
    ]


def begin(ship, settings, random, plan):
    aside = 0.5 * settings.half_width * ship.length * drawn(random, 0, -1.0, 1.0)
    motion = at_service_speed(0.0, aside, drawn(random, 1, -0.1, 0.1), ship)
    return motion, State(0.0, aside, ship.speed, 0.0, 0.0)


def step(motion, state, interval, ship, settings):
    x, off = motion.x / ship.length, motion.y / (settings.half_width * ship.length)
    inside = (x >= settings.zone_begins) & (x < settings.zone_ends)
    limit = ship.speed * pick(inside, settings.speed_limit, 1.0)
    over = max(motion.u - limit, 0.0) / ship.speed
    delay = 1.0 - clip(motion.u / limit, 0.0, 1.0)
    # minus the parts of the cost, from which the engine makes the bounded reward
    reward = Reward(-off * off, -delay, -settings.over_speed_weight * over * over)
    arrived = x > settings.zone_ends + 8.0
    flags = pick(over > 0.01, 1.0, 0.0), pick(arrived, 1.0, 0.0)
    return State(0.0, motion.y, limit, *flags), reward, fabs(off) > 1.0, arrived


def worst_cost(settings):
    return 2.0 + settings.over_speed_weight


def observe(readings, state, interval, ship, settings):
    sine, cosine = sin_cos(readings.psi)
    to_zone = max(settings.zone_begins * ship.length - readings.x, 0.0)
    return Observation(
        sine, cosine, readings.r, readings.u, readings.y, state.limit, to_zone
    )


OPTIONS = {"model": "kvlcc2", "action": "rudder-shaft"}

if __name__ == "__main__":
    from stable_baselines3 import PPO

    import shipgym

    shipgym.register_task("harbour/Fairway-v0", __file__, **OPTIONS)
    print(shipgym.check_task(__file__, **OPTIONS))
    ships = shipgym.ShipVecEnv("harbour/Fairway-v0", num_envs=64)
    PPO("MlpPolicy", ships, n_steps=256, verbose=1).learn(500_000)
