"""Encounters with up to three ships, one of which gives way: Imazu's problem. Run it to
check the task and to train an agent."""

from math import exp, fabs
from typing import Annotated, NamedTuple

from shipgym.engine.mathematics import clip, sin_cos
from shipgym.engine.motion import Motion
from shipgym.tasks.contract import ObservationSpec, Setting, at_service_speed, drawn
from shipgym.tasks.encounters import Seen, imazu_case, imazu_targets, seen_three
from shipgym.tasks.shapes import ChartWidth, Circle, Line, ShipOutline
from shipgym.tasks.traffic import (
    Target,
    advance,
    distance_to,
    rudder_by_rules,
    target_of,
    vessel,
)

EPISODE_STEPS = 200
mariner = vessel("mariner")  # equations of the second, who gives way
MARINER, AT_SPEED = mariner.ship, mariner.start


class Settings(NamedTuple):
    case: Annotated[float, Setting("0: drawn.", at_least=0, at_most=22, whole=True)] = 0
    distance: Annotated[float, Setting("To the meeting, ship lengths.", above=0)] = 15.0
    scatter: Annotated[float, Setting("About it, ship lengths.", at_least=0)] = 1.0
    safe: Annotated[float, Setting("Distance to keep, ship lengths.", above=0)] = 3.0


class State(NamedTuple):
    others: tuple[Target, Target, Target]  # the first and third keep on
    second: Motion  # of the one who gives way
    course: float  # rad, hers


class Reward(NamedTuple):
    progress: float
    off_track: float
    closeness: float


class Observation(NamedTuple):
    heading_sin: Annotated[float, ObservationSpec(-1, 1)]
    heading_cos: Annotated[float, ObservationSpec(-1, 1)]
    yaw_rate: Annotated[
        float, ObservationSpec(-5, 5, "rad/s", lambda ship, _: ship.speed / ship.length)
    ]
    cross_track: Annotated[
        float, ObservationSpec(-2, 2, "m", lambda ship, _: 10.0 * ship.length)
    ]
    others: tuple[Seen, Seen, Seen]


def begin(ship, settings, random, plan):
    run, scatter = settings.distance * ship.length, settings.scatter * ship.length
    case = imazu_case(settings.case, random)
    first, second, third = imazu_targets(case, run, scatter, random, ship)
    sailing = Motion(second.x, second.y, second.course, *AT_SPEED[3:])
    state = State((first, second, third), sailing, second.course)
    aside = drawn(random, 4, -scatter, scatter)
    return at_service_speed(-run, aside, 0.0, ship), state


def step(motion, state, interval, ship, settings):
    first, _, third = state.others
    safe = settings.safe * ship.length
    own = target_of(motion)
    rudder = rudder_by_rules(state.second, own, state.course, safe, MARINER)
    second = mariner(state.second, rudder, AT_SPEED.n, interval.dt)
    first, third = advance(first, interval.dt), advance(third, interval.dt)

    nearest = min(distance_to(motion, first), distance_to(motion, third))
    nearest = min(distance_to(motion, second), nearest)
    near = nearest / safe
    _, north = sin_cos(own.course)
    made_good = own.speed * north / ship.speed
    reward = Reward(
        progress=-clip(1.0 - made_good, 0.0, 1.0),
        off_track=-0.2 * clip(fabs(motion.y) / (5.0 * ship.length), 0.0, 1.0),
        closeness=-exp(-near * near),
    )
    arrived = motion.x > settings.distance * ship.length
    others = first, target_of(second), third
    after = State(others, second, state.course)
    return after, reward, nearest < ship.length, arrived


def worst_cost(settings):
    return 2.2


def observe(readings, state, interval, ship, settings):
    sine, cosine = sin_cos(readings.psi)
    others = seen_three(readings, state.others, ship)
    return Observation(sine, cosine, readings.r, readings.y, others)


def draw(motion, state, ship, settings):
    run = settings.distance * ship.length
    shapes = [ChartWidth(2.5 * run), Line([(-run, 0.0), (run, 0.0)], "faint")]
    for other in state.others:
        at = other.x, other.y
        shapes.append(ShipOutline(*at, other.course, ship.length, None, "danger"))
        shapes.append(Circle(*at, settings.safe * ship.length, "warning"))
    return shapes


OPTIONS = {"dt": 5.0}

if __name__ == "__main__":
    from stable_baselines3 import PPO

    import shipgym

    print(shipgym.check_task(__file__, **OPTIONS))
    shipgym.register_task("harbour/Encounter-v0", __file__, **OPTIONS)
    ships = shipgym.ShipVecEnv("harbour/Encounter-v0", num_envs=32)
    PPO("MlpPolicy", ships, n_steps=256, verbose=1).learn(500_000)
