"""Ships drawn around identified models, paths drawn for them, and all of it as one environment to learn in.

A lane has a model, which is what is known of its ship, and the ship: the model with
other coefficients. The agent is told the model's context and adds to the wheel-over
autopilot designed on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from agents.controllers.controller import Controller
from agents.controllers.controller_file import read_controller
from agents.policies.one_for_all import CONTEXT, OneForAll, base_for, context
from agents.policies.weights_file import as_json
from agents.rollouts.rollout import episode_costs, rollout
from agents.training.residual import ResidualVecEnv
from shipgym.envs.engine import Engine, episode_keys
from shipgym.envs.environment import spaces as spaces_of
from shipgym.errors import InputError, UnstableModelError
from shipgym.sea.conditions import Current, Weather
from shipgym.ships import ShipModel, load_model
from shipgym.ships.term_table import Structure
from shipgym.tasks.task import Task

Floats = NDArray[np.float64]

#: Standard deviations of logarithms: of all coefficients of an equation together, of
#: each by itself, and of each of the ship against her model.
EQUATION, COEFFICIENT, ERROR = 0.2, 0.1, 0.05
GEAR = np.log([0.25, 1.8])  # logarithms of what the rudder rate is multiplied by
LEAST_STABILITY = (
    -1.0
)  # prime determinant; the tanker, unstable on her course, has -0.1 to -0.2
TRIES = 20
MEAN_COST = (
    100.0  # of an episode under wheel-over, whatever the path: rewards are scaled to it
)
FIRST_SEED = 900_000
NOTHING: dict[str, Any] = {}  # info of a row whose episode goes on


@dataclass(frozen=True)
class Lane:
    """What is known of a ship, and she herself."""

    model: ShipModel
    ship: ShipModel
    pilot: Controller  # designed on the model
    told: Floats  # the model's context, shape (12,)

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        gear = [
            self.model.steering.rudder_limit_deg,
            self.model.steering.rudder_rate_deg_s,
        ]
        return {
            "model": self.model.coefficients,
            "ship": self.ship.coefficients,
            "gear": gear,
            "pilot": self.pilot.to_dict(),
            "told": self.told.tolist(),
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any], base: ShipModel) -> Lane:
        """What `to_dict` gave, of a ship around a model."""
        limit, rate = content["gear"]
        base = replace(
            base,
            steering=replace(
                base.steering, rudder_limit_deg=limit, rudder_rate_deg_s=rate
            ),
        )
        model, ship = (
            replace(base, coefficients=content[name]) for name in ("model", "ship")
        )
        return cls(
            model,
            ship,
            read_controller(content["pilot"], base.name),
            np.array(content["told"]),
        )


@dataclass(frozen=True)
class Fleet:
    """Ships of one structure on paths of one kind."""

    base: str  # the model that they were drawn around
    options: Mapping[str, Any]  # of the path
    lanes: tuple[Lane, ...]

    @property
    def task(self) -> Task:
        """The path."""
        return Task.of("PathFollowing-v1", **self.options)

    @property
    def told(self) -> Floats:
        """Contexts, shape (n, 12)."""
        return np.array([lane.told for lane in self.lanes])

    @property
    def pilots(self) -> list[Controller]:
        """Each designed on its lane's model."""
        return [lane.pilot for lane in self.lanes]

    def ruled(self, rule: Mapping[str, float]) -> Fleet:
        """The same with pilots whose settings are by a rule."""
        task = self.task
        lanes = (
            replace(lane, pilot=base_for(lane.model, task, rule)) for lane in self.lanes
        )
        return replace(self, lanes=tuple(lanes))

    def times(self, number: int) -> Fleet:
        """Each ship so many times."""
        return replace(self, lanes=self.lanes * number)

    def engine(self) -> Engine:
        """A lane for each ship."""
        return Engine(
            [lane.ship for lane in self.lanes],
            len(self.lanes),
            self.task,
            allow_unstable=True,
        )

    def cost_of(self, policy: Any, seed: int = FIRST_SEED) -> Floats:
        """What an episode of each ship costs, by default of those that nobody learns from."""
        return episode_costs(policy, self.engine(), seed + np.arange(len(self.lanes)))

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        lanes = [lane.to_dict() for lane in self.lanes]
        return {"base": self.base, "options": as_json(self.options), "lanes": lanes}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Fleet:
        """What `to_dict` gave."""
        base, options = load_model(content["base"]), dict(content["options"])
        options["sea"] = Weather.from_dict(options["sea"], "sea")
        return cls(
            content["base"],
            options,
            tuple(Lane.from_dict(lane, base) for lane in content["lanes"]),
        )


def path_like(
    random: np.random.Generator, speed: float, length: float
) -> dict[str, Any]:
    """Options of a path and of its current at random; all weathers have one, be it next to none."""
    radius, turn = (
        float(random.uniform(2.5, 5.0)),
        float(random.choice([45.0, 60.0, 90.0, 120.0])),
    )
    least = max(8.0, 2.0 * radius * np.tan(np.radians(0.5 * turn)) + 1.0)
    corridor = float(np.exp(random.uniform(np.log(0.2), np.log(1.2))))
    share = float(random.choice([0.01, random.uniform(0.05, 0.3)]))
    current = Current(
        share * speed,
        variation=0.25 * share * speed,
        time_constant=float(random.uniform(5, 40)) * length / speed,
    )
    return {
        "turn_radius": radius,
        "max_turn_deg": turn,
        "leg_lengths": [least, least + 6.0],
        "corridor": corridor,
        "ground": max(4.0 * corridor, 1.0),
        "sea": Weather(current=current),
    }


def around(model: ShipModel, random: np.random.Generator) -> ShipModel:
    """A model with other coefficients, another steering gear and another rudder limit."""
    drawn = model.sample(1, random)[0] if model.covariance is not None else model
    drawn, table = replace(model, coefficients=drawn.coefficients), model.dynamics
    factors = {
        name: float(np.exp(COEFFICIENT * random.standard_normal()))
        for name in varied(model)
    }
    for equation in table.equations if isinstance(table, Structure) else ():
        common = float(np.exp(EQUATION * random.standard_normal()))
        factors |= {
            name: common * factors[name]
            for name in table.names(equation)
            if name in factors
        }
    gear = replace(
        model.steering,
        rudder_rate_deg_s=model.steering.rudder_rate_deg_s
        * float(np.exp(random.uniform(*GEAR))),
        rudder_limit_deg=float(random.uniform(30.0, 40.0)),
    )
    return replace(scaled(drawn, factors), steering=gear)


def varied(model: ShipModel) -> list[str]:
    """Coefficients that were identified: those with a variance."""
    if model.covariance is None:
        return list(model.coefficients)
    return [
        name
        for name, one in zip(model.coefficients, np.diag(model.covariance), strict=True)
        if one > 0.0
    ]


def scaled(model: ShipModel, factors: Mapping[str, float]) -> ShipModel:
    """A model with some coefficients multiplied."""
    changed = {
        name: value * factors.get(name, 1.0)
        for name, value in model.coefficients.items()
    }
    return replace(model, coefficients=changed)


def draw_fleet(name: str, number: int, random: np.random.Generator) -> Fleet:
    """Ships around a shipped model on one path; those that wheel-over loses are drawn anew."""
    base = load_model(name)
    options = path_like(random, base.particulars["speed"], base.particulars["length"])
    task, kept = Task.of("PathFollowing-v1", **options), list[Lane]()
    for _ in range(TRIES):
        drawn = [draw_lane(base, task, random) for _ in range(number - len(kept))]
        fleet = Fleet(
            name, options, (*kept, *(lane for lane in drawn if lane is not None))
        )
        seeds = np.arange(len(fleet.lanes))
        found = rollout(
            Pilots(fleet.pilots), fleet.engine(), seeds, record={"reward_end"}
        )
        lost = (found.infos["reward_end"][1:] * found.sailing).sum(axis=0) < 0.0
        if len(seeds) == number and not lost.any():
            return fleet
        kept = [lane for lane, gone in zip(fleet.lanes, lost, strict=True) if not gone]
    raise SystemExit(f"{name}: {len(kept)} of {number} ships after {TRIES} draws")


def draw_lane(base: ShipModel, task: Task, random: np.random.Generator) -> Lane | None:
    """A ship and what is known of her; None where no autopilot can be designed, or she would hardly steer."""
    model = around(base, random)
    wrong = {
        name: float(np.exp(ERROR * random.standard_normal())) for name in varied(base)
    }
    try:
        told = context(model, task)
        if told[CONTEXT.index("stability")] < LEAST_STABILITY:
            return None
        pilot = base_for(model, task, {})
    except (InputError, UnstableModelError):
        return None
    return Lane(model, scaled(model, wrong), pilot, told)


class PerShip(np.ndarray):
    """Numbers of many ships where a controller has that of one, or a row of them: a column by its number."""

    @classmethod
    def of(cls, numbers: Any) -> PerShip:
        """As an array, ships first."""
        return np.asarray(numbers, dtype=np.float64).view(cls)

    def __getitem__(self, key: Any) -> Any:
        return super().__getitem__(
            (slice(None), key) if isinstance(key, int) and self.ndim == 2 else key
        )

    def __gt__(self, other: Any) -> Any:
        return bool((np.asarray(self) > other).all())

    def __array_wrap__(self, array: Any, *_: Any) -> Any:
        return np.asarray(array)  # what comes of them is numbers like others


def stacked(pilots: Sequence[Controller]) -> Any:
    """One controller of a kind that steers ship i as the i-th of these does."""
    first, like = pilots[0], {}
    for name in ("gains", "design"):
        columns = {
            key: PerShip.of([getattr(one, name)[key] for one in pilots])
            for key in getattr(first, name)
        }
        like[name] = columns
    for name in ("neutral_rudder", "neutral_sway", "observation_scales"):
        like[name] = PerShip.of([getattr(one, name) for one in pilots])
    if first.has_autopilot:
        like["autopilot"] = stacked([one.autopilot for one in pilots])
    return replace(first, **like)


class Pilots:
    """Each ship's own pilot, all of one kind, asked at once."""

    def __init__(self, pilots: Sequence[Controller]) -> None:
        self.stacked = stacked(pilots)

    def predict(
        self, observation: Any, state: Any = None, starts: Any = None, _: bool = True
    ) -> Any:
        """See `Policy.predict`."""
        action, state = self.stacked.predict(observation, state, starts)
        return np.asarray(action), state


class Fleets(VecEnv):
    """Several fleets as one vector environment of stable-baselines3; without infos but what ends episodes."""

    def __init__(self, fleets: Sequence[Fleet]) -> None:
        self.engines = [fleet.engine() for fleet in fleets]
        self.bounds = np.cumsum([0, *(engine.num_envs for engine in self.engines)])
        super().__init__(
            int(self.bounds[-1]), *spaces_of(fleets[0].task, fleets[0].lanes[0].model)
        )

    def reset(self) -> Any:
        """Begin an episode in each row, each of another age: a rollout is to show all parts of episodes."""
        for engine, first in zip(self.engines, self.bounds, strict=False):
            n, longest = engine.num_envs, engine.task.episode_steps
            engine.begin(episode_keys((self._seeds[0] or 0) + first + np.arange(n)))
            engine.write("steps", np.arange(n) * longest // n)
        return np.concatenate([engine.observations for engine in self.engines])

    def step_async(self, actions: Any) -> None:
        """Keep the actions for `step_wait`."""
        self.actions = actions

    def step_wait(self) -> Any:
        """Observations, rewards, whether episodes ended, and infos of those."""
        columns, infos = [], [NOTHING] * self.num_envs
        for engine, first, last in zip(
            self.engines, self.bounds, self.bounds[1:], strict=False
        ):
            engine.order(self.actions[first:last])
            ended, shown = engine.advance(anew=True), engine.outputs
            dones = shown.terminated | shown.truncated
            for row in np.flatnonzero(dones) if ended else ():
                late = bool(shown.truncated[row] and not shown.terminated[row])
                final = shown.observations[row].copy()
                infos[first + row] = {
                    "terminal_observation": final,
                    "TimeLimit.truncated": late,
                }
            if ended:
                engine.begin_next(dones)
            columns.append(
                (shown.observations, shown.outcomes[0].astype(np.float32), dones)
            )
        return (*(np.concatenate(one) for one in zip(*columns, strict=True)), infos)

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Nothing is known of the rows."""
        return [None] * self.num_envs

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """By nothing."""
        return [False] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused: the engines of a fleet have no attributes that a learner could change."""
        raise TypeError(
            f"{attr_name!r}: a fleet of engines has neither attributes to set nor"
            " methods to call"
        )

    env_method = set_attr

    def close(self) -> None:
        """Nothing stays open."""


class Told(VecEnvWrapper):
    """Ships whose agent also sees numbers that stay the same; rewards are divided by each one's scale."""

    def __init__(self, venv: VecEnv, told: Any, scale: Any) -> None:
        self.told, self.scale = (
            np.asarray(told, dtype=np.float32),
            np.asarray(scale, dtype=np.float32),
        )
        space, largest = (
            venv.observation_space,
            np.full(self.told.shape[1], 10.0, np.float32),
        )
        low, high = np.append(space.low, -largest), np.append(space.high, largest)
        super().__init__(venv, observation_space=spaces.Box(low, high))

    def reset(self) -> Any:
        """Begin an episode in each row."""
        return np.concatenate([self.venv.reset(), self.told], axis=1)

    def step_wait(self) -> Any:
        """What the ships inside return, with the numbers."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for row in np.flatnonzero(dones):
            last = infos[row]["terminal_observation"]
            infos[row]["terminal_observation"] = np.append(last, self.told[row])
        return (
            np.concatenate([observations, self.told], axis=1),
            rewards / self.scale,
            dones,
            infos,
        )


class Learner:
    """The policy of all ships as it is while it learns."""

    def __init__(self, agent: OneForAll, fleet: Fleet, action_repeat: int) -> None:
        self.agent, self.repeat, self.pilots = (
            agent,
            action_repeat,
            Pilots(fleet.pilots),
        )
        self.told = agent.inputs(fleet.told)

    def predict(
        self, observation: Any, state: Any = None, starts: Any = None, _: bool = True
    ) -> Any:
        """See `Policy.predict`; all episodes begin at once."""
        inner, added, number = state or (None, None, 0)
        proposed, inner = self.pilots.predict(observation, inner, starts)
        if number % self.repeat == 0:
            inputs = np.concatenate([observation, proposed, self.told], axis=1).astype(
                np.float32
            )
            added = self.agent.authority * np.clip(
                self.agent.network(inputs), -1.0, 1.0
            )
        return np.clip(proposed + added, -1.0, 1.0), (inner, added, number + 1)


def learning_ships(
    fleets: Sequence[Fleet], like: OneForAll, action_repeat: int
) -> VecEnv:
    """All fleets, each ship with her own pilot and told her own context."""
    pilots = Pilots([pilot for fleet in fleets for pilot in fleet.pilots])
    ships = ResidualVecEnv(
        Fleets(fleets), pilots, authority=like.authority, action_repeat=action_repeat
    )
    costs = [
        np.full(len(fleet.lanes), fleet.cost_of(Pilots(fleet.pilots)).mean())
        for fleet in fleets
    ]
    told = np.concatenate([fleet.told for fleet in fleets])
    return Told(ships, like.inputs(told), np.concatenate(costs) / MEAN_COST)
