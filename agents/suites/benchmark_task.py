"""Tasks of a suite: what a controller is made for and what it is evaluated in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from agents.suites.environments import SHORT_NAMES
from shipgym import InputError, ShipModel, SteeringGear, Weather, load_model
from shipgym.arrays import Integers
from shipgym.checks import check_choice
from shipgym.envs.registration import env_id

if TYPE_CHECKING:  # whoever shares work out does without
    from shipgym.envs.engine import Engine
    from shipgym.envs.randomisation import Randomisation
    from shipgym.tasks.task import Observed, Task

#: Seeds of the episodes that are scored; training and tuning use smaller ones.
FIRST_SEED = 1_000_000
N_EPISODES = 100
#: Sets of episodes of a task with a true ship, and what their names end in.
SETS: Mapping[str, str] = {"ship": "", "model": "-on-model", "far": "-far"}
OPTION_FIELDS = ("options", "far")


class Scenario(NamedTuple):
    """Ship, task and domain randomisation of episodes."""

    ship: ShipModel
    task: Task
    randomisation: Randomisation

    def observed(self) -> tuple[Observed, ...]:
        """Return what the task shows of the ship."""
        return self.task.observed(self.ship)


@dataclass(frozen=True)
class BenchmarkTask:
    """One task of a suite.

    Attributes
    ----------
    name : str
        Unique in its suite.
    environment : str
        "course-keeping", "path-following", "encounter", or the path of a task's file.
    model : str
        Shipped model or model file that controllers are made for.
    why : str
        Purpose of the task.
    options : mapping
        Keywords of the environment, `sea` among them.
    true_ship : str
        Model of the ship that is steered, if not `model`; controllers do not know it.
    far : mapping
        Keywords that differ in the episodes far from the design, and `gear`.
    on : str
        Which of `SETS` the episodes are of.
    design_name : str
        Name of the task that controllers are made for, if another.
    suite : str
        `Suite.source` of its suite.
    limits : mapping of str to float
        Largest values of figures (`agents.suites.limits`).
    """

    name: str
    environment: str
    model: str
    why: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    true_ship: str = ""
    far: Mapping[str, Any] = field(default_factory=dict)
    on: str = "ship"
    design_name: str = ""
    suite: str = ""
    limits: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.environment.endswith(".py"):
            where = f"task '{self.name}': environment"
            check_choice(self.environment, SHORT_NAMES, where)

    def check_ship(self) -> None:
        """Refuse a ship whose observations have other scales than those of its model.

        Raises InputError, also for an unknown model, ship or option.
        """
        designed = self.design.observed()
        steered = self.evaluation.observed()
        for on_model, on_ship in zip(designed, steered, strict=True):
            same_name = on_model.name == on_ship.name
            same_scale = on_model.scale == on_ship.scale
            if not (same_name and same_scale):
                raise InputError(
                    f"task '{self.name}': ship: expected the particulars of"
                    f" '{self.model}', got '{self.true_ship}', whose '{on_ship.name}'"
                    f" is shown in units of {on_ship.scale:g} instead of"
                    f" {on_model.scale:g}"
                )

    @property
    def env_id(self) -> str:
        """Id for `gymnasium.make`, with the keywords `model` and `arguments`."""
        from shipgym.envs.environment import DEFAULT_TASK

        return env_id(SHORT_NAMES.get(self.environment, DEFAULT_TASK))

    @property
    def arguments(self) -> dict[str, Any]:
        """Keywords of the environment of `env_id`, except for `model`."""
        if self.environment in SHORT_NAMES:
            return dict(self.options)
        return {"task": self.environment, **self.options}

    @cached_property
    def design(self) -> Scenario:
        """Scenario that controllers are made for."""
        return self._scenario(self.ship, self.options)

    @cached_property
    def evaluation(self) -> Scenario:
        """Scenario that controllers are evaluated in."""
        if not self.true_ship and not self.far:
            return self.design
        options = {**self.options, **self.far}
        changes = options.pop("gear", {})
        scenario = self._scenario(self.true_ship or self.ship, options)

        gear = {**asdict(scenario.ship.steering), **changes}
        steering = SteeringGear.from_mapping(gear, "far.gear")
        ship = replace(scenario.ship, steering=steering)
        return scenario._replace(ship=ship)

    def _scenario(self, model: str | ShipModel, options: Mapping[str, Any]) -> Scenario:
        from shipgym.envs.environment import read_options

        task = SHORT_NAMES.get(self.environment, self.environment)
        return Scenario(*read_options(task, model, options))

    @cached_property
    def design_task(self) -> Self:
        """The task as controllers are given it: without the ship behind the model."""
        return replace(
            self,
            name=self.design_name or self.name,
            true_ship="",
            far={},
            on="ship",
            design_name="",
        )

    @cached_property
    def ship(self) -> ShipModel:
        """Model that controllers are made for."""
        return load_model(self.model)

    @property
    def task(self) -> Task:
        """Task of the autopilot."""
        return self.design.task

    @property
    def seeds(self) -> Integers:
        """Seeds of the episodes that are scored, shape (100,)."""
        return FIRST_SEED + np.arange(N_EPISODES)

    def engine(
        self, num_envs: int, model: ShipModel | None = None, threads: int = 1
    ) -> Engine:
        """Return many ships at once in its episodes, by default its own ship."""
        from shipgym.envs.engine import Engine

        ship, task, randomisation = self.evaluation
        return Engine(
            ship if model is None else model,
            num_envs,
            task,
            randomisation,
            threads=threads,
        )

    @property
    def files(self) -> list[Path]:
        """Files of the user's own that it names: tasks, models, rewards, sensors."""
        options = {**self.options, **self.far}
        named = [self.environment, self.model, self.true_ship, *options.values()]
        suffixes = (".py", ".json")
        files = []
        for name in named:
            if not isinstance(name, str):
                continue
            path = Path(name)
            if path.suffix in suffixes and path.is_file():
                files.append(path)
        return files

    def to_dict(self) -> dict[str, Any]:
        """Return what `from_dict` reads, ready for JSON."""
        content = {}
        for part in fields(self):
            content[part.name] = getattr(self, part.name)
        for name in OPTION_FIELDS:
            options = dict(content[name])
            sea = options.get("sea")
            if isinstance(sea, Weather):
                options["sea"] = sea.to_dict()
            content[name] = options
        return content

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Read what `to_dict` returned."""
        values = dict(content)
        for name in OPTION_FIELDS:
            options = dict(values[name])
            sea = options.get("sea")
            if isinstance(sea, Mapping):
                options["sea"] = Weather.from_dict(sea, "sea")
            values[name] = options
        return cls(**values)


@dataclass(frozen=True)
class ModelTask(BenchmarkTask):
    """A task of a model that is at hand, in no file and no suite.

    Attributes
    ----------
    scenario : Scenario
        Model, task and domain randomisation.
    """

    scenario: Any = None

    @classmethod
    def of(cls, name: str, environment: str, scenario: Scenario) -> Self:
        """Make the task of a scenario."""
        return cls(name, environment, model=scenario.ship.name, scenario=scenario)

    @property
    def design(self) -> Scenario:
        """Scenario that controllers are made for."""
        found: Scenario = self.scenario
        return found

    @property
    def evaluation(self) -> Scenario:
        """Scenario that controllers are evaluated in, the same."""
        return self.design

    @property
    def design_task(self) -> Self:
        """The task itself."""
        return self

    @property
    def ship(self) -> ShipModel:
        """Model of the scenario."""
        return self.design.ship
