"""Several ships in the same water: a parallel environment of PettingZoo."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.checks import check_keys, check_whole, did_you_mean, unexpected
from shipgym.envs.artist import Artist
from shipgym.envs.engine import Engine, episode_key
from shipgym.envs.environment import DEFAULT_MODEL, given_orders, read_options, spaces
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.tasks import shared_water
from shipgym.tasks.encounters import IMAZU
from shipgym.tasks.task import Task

ParallelEnv: Any = library(
    "pettingzoo", "marl", "several ships in one environment need it"
).ParallelEnv


class ShipsParallelEnv(ParallelEnv):  # type: ignore[misc]  # not type-checked here
    """Ships whose tracks cross, each steered by an agent who sees the others.

    They begin straight ahead at service speed, at about the same distance from the
    crossing. An agent's episode ends when she has passed it by that distance, when she
    comes closer to another than a ship length, or with the time; she is then out of the
    others' way. Observations, rewards and settings are those of
    `shipgym.tasks.shared_water`.

    Raises InputError for a number of ships, a model or an option that does not fit.

    Parameters
    ----------
    n_ships : int
        Number of ships, 2 to 4.
    model : str, Path or ShipModel
        The ship of all agents, as environments take it.
    render_mode : {None, "rgb_array"}
        Whether `render` gives a picture around the first ship.
    **options
        Keywords of environments and settings of the task; the sea is calm, and
        `episode_steps` 150 by default.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "name": "shipgym_ships_v0",
        "render_modes": ["rgb_array"],
        "render_fps": 30,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        n_ships: int = 3,
        model: Any = DEFAULT_MODEL,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        check_whole(n_ships, "n_ships", at_least=2, at_most=4)
        if render_mode not in (None, "rgb_array"):
            raise unexpected("render_mode", "'rgb_array' or None", render_mode)
        options.setdefault("episode_steps", 150)
        self.model, self.task, randomisation = read_options(
            task=shared_water,
            model=model,
            options=options,
        )
        _refuse_weather(self.task)
        self.render_mode = render_mode
        self.possible_agents = [f"ship_{number}" for number in range(n_ships)]
        self.agents: list[str] = []
        self._engine = Engine(self.model, n_ships, self.task, randomisation)
        self._artist = Artist(render_mode) if render_mode else None
        self._random: np.random.Generator | None = None
        self._orders = []
        for orders in self.task.orders(self.model):
            self._orders.append(np.array(orders, dtype=np.float32))
        self._make_spaces()

    def _make_spaces(self) -> None:
        """Make the spaces of each agent, which stay the same objects."""
        observations, actions = spaces(self.task, self.model, None)
        agents = self.possible_agents
        self.observation_spaces: dict[str, Any] = dict.fromkeys(agents, observations)
        self.action_spaces: dict[str, Any] = dict.fromkeys(agents, actions)

    def observation_space(self, agent: str) -> gymnasium.spaces.Space[Any]:
        """Observation space of an agent."""
        space: gymnasium.spaces.Space[Any] = self.observation_spaces[agent]
        return space

    def action_space(self, agent: str) -> gymnasium.spaces.Space[Any]:
        """Action space of an agent."""
        space: gymnasium.spaces.Space[Any] = self.action_spaces[agent]
        return space

    def reset(
        self,
        seed: int | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[dict[str, NDArray[np.float32]], dict[str, dict[str, Any]]]:
        """Begin an encounter.

        Raises InputError for a case of another number of ships.

        Parameters
        ----------
        seed : int, optional
            Fixes this encounter and all that follow it.
        options : dict, optional
            `case`, 1 to 22: that of Imazu (`shipgym.tasks.encounters.IMAZU`). Without
            it courses and distances are drawn. Others are ignored, as PettingZoo's
            test of the interface demands, unless they look like it.
        """
        if seed is not None or self._random is None:
            self._random, _ = gymnasium.utils.seeding.np_random(seed)
        courses, parts = self._drawn(self._random)
        given = dict(options or {})
        _refuse_misspelt(given)
        if "case" in given:
            courses, parts = imazu_courses(given["case"], len(courses))

        engine = self._engine
        keys = [episode_key(self._random) for _ in courses]
        engine.renew_outputs()
        engine.begin(np.array(keys, dtype=np.uint64))
        self.agents = list(self.possible_agents)
        self._place(courses, parts)
        self._show_others()
        if self._artist:
            self._artist.begin(engine)
        return self._observations(self.agents), self._infos(self.agents)

    def _drawn(self, random: np.random.Generator) -> tuple[Floats, Floats]:
        """Courses of ships, and their distances by that of the settings."""
        n_ships = len(self.possible_agents)
        between = 2.0 * np.pi / n_ships
        spread = 0.4 * between
        first = random.uniform(-np.pi, np.pi)
        courses = first + between * np.arange(n_ships)
        courses = courses + random.uniform(-spread, spread, n_ships)
        parts = random.uniform(0.9, 1.1, n_ships)
        return courses, parts

    def _place(self, courses: Floats, parts: Floats) -> None:
        """Write where ships begin, each on her track."""
        engine = self._engine
        length = self.model.particulars["length"]
        run = parts * self.task.settings.distance * length
        engine.write("x", -run * np.cos(courses))
        engine.write("y", -run * np.sin(courses))
        engine.write("psi", courses)
        engine.write("course", courses)

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[
        dict[str, NDArray[np.float32]],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Take one control interval with the actions of all agents that are left.

        Returns observations, rewards, terminations, truncations and infos by agent.
        Raises InputError for an agent without an action, or a wrong one.
        """
        agents = self.agents
        engine = self._engine
        engine.order(self._commands(actions))
        engine.advance(anew=True)
        outputs = engine.outputs
        terminated = self._by_agent(agents, outputs.terminated)
        truncated = self._by_agent(agents, outputs.truncated)
        self.agents = []
        for agent in agents:
            if not (terminated[agent] or truncated[agent]):
                self.agents.append(agent)

        self._show_others()
        if self._artist:
            self._artist.note(engine)
        return (
            self._observations(agents),
            self._by_agent(agents, outputs.outcomes[0]),
            terminated,
            truncated,
            self._infos(agents),
        )

    def _by_agent(self, agents: list[str], values: Any) -> dict[str, Any]:
        """Values of some agents, of an array with an entry for each ship."""
        of_all = dict(zip(self.possible_agents, values.tolist(), strict=True))
        return {agent: of_all[agent] for agent in agents}

    def _commands(self, actions: Mapping[str, Any]) -> Floats:
        """Commands of all ships, 0 of those whose episode is over."""
        commands = np.zeros((len(self.possible_agents), self.task.n_commands))
        for agent in self.agents:
            if agent not in actions:
                raise InputError(f"actions: expected one of {agent!r}, got none")
            action = actions[agent]
            if self._orders:
                where = f"actions: {agent}"
                action = given_orders(self._orders, action, (), where)[0]
            shape = commands[0].shape
            if np.shape(action) != shape:
                expected = f"shape {shape}"
                raise unexpected(f"actions: {agent}", expected, np.shape(action))
            commands[self.possible_agents.index(agent)] = action
        return commands

    def _show_others(self) -> None:
        """Let each ship see where the others are now; those that are over are not."""
        seen = self._targets()
        engine = self._engine
        n_others = len(self.possible_agents) - 1
        for place in range(n_others):
            for name, values in seen.items():
                # ship i sees i + 1, i + 2, ...
                of_others = np.roll(values, -1 - place)
                engine.write(f"others.{place}.{name}", of_others)
        engine.observe_again()

    def _targets(self) -> dict[str, Floats]:
        """Numbers of `Target` of all ships; those that are over are far away."""
        x, y, psi, u, v, _ = self.state().T
        here = np.isin(self.possible_agents, self.agents)
        drift = np.arctan2(v, u)
        speed = np.hypot(u, v)
        return {
            "x": np.where(here, x, shared_water.absent().x),
            "y": np.where(here, y, 0.0),
            "course": psi + drift,
            "speed": np.where(here, speed, 0.0),
        }

    def state(self) -> Floats:
        """North, east, heading, surge, sway and yaw rate of each ship, SI units."""
        names = ("x", "y", "psi", "u", "v", "r")
        return np.stack([self._engine.read(name) for name in names], axis=1)

    def _observations(self, agents: list[str]) -> dict[str, NDArray[np.float32]]:
        rows = self._engine.observations
        of_all = dict(zip(self.possible_agents, rows, strict=True))
        return {agent: of_all[agent] for agent in agents}

    def _infos(self, agents: list[str]) -> dict[str, dict[str, Any]]:
        infos: dict[str, dict[str, Any]] = {agent: {} for agent in agents}
        for name in self.task.info_names:
            values: Any = self._engine.info(name)
            if name in self.task.flags:
                values = values > 0.0
            for agent, value in self._by_agent(agents, values).items():
                infos[agent][name] = value
        return infos

    def render(self) -> NDArray[np.uint8] | None:
        """Picture around the first ship, uint8 array of shape (600, 600, 3)."""
        if self._artist is None:
            return None
        return self._artist.picture(self._engine)

    def close(self) -> None:
        """End the encounter."""
        self.agents = []


def _refuse_weather(task: Task) -> None:
    """Refuse any sea but a calm one, the only one that ships share."""
    if not task.weather.calm or len(task.seas) > 1:
        raise unexpected("sea", "'calm', the only one that ships share", task.sea)


def _refuse_misspelt(options: Mapping[str, Any]) -> None:
    """Refuse options of a reset that look like a known one; others are ignored."""
    for name in options:
        if name != "case" and did_you_mean(name, ["case"]):
            check_keys(options, ["case"], "options")


def imazu_courses(case: Any, n_ships: int) -> tuple[Floats, Floats]:
    """Courses of the ships in a case, rad, and the parts of the distance of each."""
    check_whole(case, "options: case", at_least=1, at_most=len(IMAZU))
    degrees = IMAZU[case - 1]
    others = degrees[np.isfinite(degrees)]
    if len(others) != n_ships - 1:
        raise InputError(
            f"options: case: expected one of {n_ships} ships, got {case}, of"
            f" {len(others) + 1}"
        )
    courses = np.radians([0.0, *others])
    slower = 0.7  # ships on the course of the own ship are overtaken
    parts = np.where(degrees[: len(others)] == 0.0, slower, 1.0)
    return courses, np.array([1.0, *parts])


def parallel_env(**options: Any) -> ShipsParallelEnv:
    """Make the environment, as PettingZoo's modules name it (`ShipsParallelEnv`)."""
    return ShipsParallelEnv(**options)
