"""Tasks of a suite: what a controller is made for and what it is evaluated in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from agents.suites.environments import SHORT_NAMES
from shipgym import InputError, ShipModel, SteeringGear, load_model
from shipgym.arrays import Integers
from shipgym.checks import check_choice
from shipgym.envs.registration import env_id
from shipgym.models.catalogue import grey_box

if TYPE_CHECKING:  # whoever shares work out does without
    from shipgym.envs.engine import Engine
    from shipgym.envs.randomisation import Randomisation
    from shipgym.tasks.task import Task

#: Seeds of the episodes that are scored; training and tuning use smaller ones.
FIRST_SEED = 1_000_000
N_EPISODES = 100
#: Sets of episodes: on the ship, ranked; on the ship in other episodes; on the model
#: that controllers are made for. Those of a sweep follow: "sweep-1", ...
SETS = ("ship", "fresh", "model")
#: Share of the episodes of other sets that one of a sweep has.
SWEPT = 1 / 3


class Scenario(NamedTuple):
    """Ship, task and domain randomisation of episodes."""

    ship: ShipModel
    task: Task
    randomisation: Randomisation

    def scales(self) -> list[tuple[str, float]]:
        """Return what the task shows of the ship, and in which units."""
        return [(one.name, one.scale) for one in self.task.observed(self.ship)]


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
    judge : mapping
        What else differs on the ship: keywords of the environment; `gear`, fields of
        the steering gear; `terms`, accelerations that are added, by equation and
        formula (`shipgym.ships.terms.read_terms`).
    sweep : sequence of mapping
        The same by set of episodes, ever further from the design.
    part : str
        Tasks of one part are ranked together.
    rule : str
        Entry whose cost scores are relative to.
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
    judge: Mapping[str, Any] = field(default_factory=dict)
    sweep: Sequence[Mapping[str, Any]] = ()
    part: str = "steering"
    rule: str = "preview-lq"
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
        expected = self.design.scales()
        steered = self.scenario("ship")
        if steered.scales() != expected:
            raise InputError(
                f"task '{self.name}': ship: expected the particulars of '{self.model}',"
                f" got '{self.true_ship}', whose observations are shown in other units"
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

    @property
    def sets(self) -> tuple[str, ...]:
        """Its sets of episodes, of `SETS`."""
        known = SETS if self.true_ship or self.judge else SETS[:2]
        return known + tuple(f"sweep-{k}" for k in range(1, len(self.sweep) + 1))

    def scenario(self, on: str) -> Scenario:
        """Scenario of a set of episodes."""
        if on == "model":
            return self.design
        changes = dict(self.judge)
        if on not in SETS:
            changes |= self.sweep[int(on.removeprefix("sweep-")) - 1]
        gear = changes.pop("gear", {})
        terms = changes.pop("terms", {})
        given = load_model(self.true_ship) if self.true_ship else self.ship
        ship = with_terms(given, terms)
        steering = {**asdict(ship.steering), **gear}
        ship = replace(ship, steering=SteeringGear.from_mapping(steering, "gear"))
        return self._scenario(ship, {**self.options, **changes})

    def _scenario(self, model: ShipModel, options: Mapping[str, Any]) -> Scenario:
        from shipgym.envs.environment import read_options

        task = SHORT_NAMES.get(self.environment, self.environment)
        return Scenario(*read_options(task, model, options))

    @cached_property
    def design_task(self) -> Self:
        """The task as controllers are given it: without the ship behind the model."""
        return replace(self, true_ship="", judge={}, sweep=())

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
        return judging_seeds("ship", N_EPISODES)

    def engine(
        self,
        num_envs: int,
        model: ShipModel | None = None,
        on: str = "model",
    ) -> Engine:
        """Return many ships at once in a set of its episodes, by default the model.

        InputError for a task of a user's own that is not sound (`check_once`).
        """
        from shipgym.envs.engine import Engine
        from shipgym.envs.task_checker import check_once

        ship, task, randomisation = self.scenario(on)
        engine = Engine(model or ship, num_envs, task, randomisation)
        check_once(engine, randomisation)
        return engine

    @property
    def files(self) -> list[Path]:
        """Files of the user's own that it names: tasks, models, rewards, sensors."""
        named = [self.environment, self.model, self.true_ship]
        for options in (self.options, self.judge, *self.sweep):
            named += options.values()
        paths = [Path(name) for name in named if isinstance(name, str)]
        known = [path for path in paths if path.suffix in (".py", ".json")]
        return [path for path in known if path.is_file()]

    def to_dict(self) -> dict[str, Any]:
        """Return its fields, ready for JSON."""
        return asdict(self)


def judging_seeds(on: str, number: int, seed: int = 0) -> Integers:
    """Seeds of a set of episodes that are scored; others for each `seed`.

    `number`: of the episodes of a set, of which one of a sweep has a part.
    """
    first = 2 * FIRST_SEED if on == "fresh" else FIRST_SEED
    sailed = number if on in SETS else ceil(SWEPT * number)
    return first + N_EPISODES * seed + np.arange(sailed)


def with_terms(ship: ShipModel, terms: Mapping[str, Mapping[str, float]]) -> ShipModel:
    """A ship with accelerations added, in units of her length and service speed."""
    if not terms:
        return ship
    box = grey_box(ship, {name: ", ".join(found) for name, found in terms.items()})
    values = [value for found in terms.values() for value in found.values()]
    return replace(
        ship,
        structure=box.name,
        dynamics=box,
        coefficients=dict(zip(box.coefficient_names, values, strict=True)),
        covariance=None,
        envelope=None,
        provenance=None,
    )
