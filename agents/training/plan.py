"""Plan of a training: algorithm, task, settings and seed."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Self

from agents.controllers.interface import model_hash
from agents.policies.policy import OUTPUTS
from agents.policies.weights_file import as_json
from agents.suites.suite import BenchmarkTask
from agents.training.settings import (
    SEEDS_EACH,
    GradientSettings,
    LearningSettings,
    make_settings,
    settings_of,
)
from shipgym import ShipModel
from shipgym.checks import check_choice, check_keys, check_whole
from shipgym.errors import InputError
from shipgym.sea.conditions import Weather, as_weather
from shipgym.sea.weather_column import weather_column
from shipgym.tasks.task import Task

#: Seeds below those that are scored: of training a thousand for each `seed`, then those
#: held out.
EVALUATION_SEED = 900_000
N_EVALUATIONS = 100


@dataclass(frozen=True)
class TrainingPlan:
    """Settings of a training that determine its result.

    Raises InputError for settings of another algorithm, commands that are not
    continuous, or a value out of its range.

    Attributes
    ----------
    algorithm : {"ppo", "sac", "td3", "tqc"}
    task : BenchmarkTask
        Environment, model and options; evaluation is on it as it is.
    settings : LearningSettings
        Of the algorithm.
    seed : int
        0 to 799, of networks, exploration and the ships' episodes.
    randomise : bool
        True for ships that differ (`training_options`).
    threads : int
        Of torch and of the loops over ships.
    """

    algorithm: str
    task: BenchmarkTask
    settings: LearningSettings
    seed: int = 0
    randomise: bool = False
    threads: int = 1

    def __post_init__(self) -> None:
        kind = settings_of(self.algorithm)
        if type(self.settings) is not kind:
            raise InputError(
                f"settings: expected {kind.__name__} for {self.algorithm}, got"
                f" {type(self.settings).__name__}"
            )
        check_whole(self.seed, "seed", at_least=0, at_most=799)
        check_whole(self.threads, "threads", at_least=1, at_most=1024)
        check_whole(
            self.settings.action_repeat,
            "action_repeat",
            at_least=1,
            at_most=self.task.task.episode_steps,
            hint="no longer than an episode",
        )
        self.task.task.check_fits(self.task.ship)
        self._check_action()

    def _check_action(self) -> None:
        action = self.task.task.action
        base = self.settings.base
        check_choice(action, OUTPUTS, "action")
        if action == "rudder-discrete" and self.algorithm != "ppo":
            raise InputError(
                f"action: expected one that {self.algorithm} learns, got '{action}';"
                " take ppo"
            )
        if action != "rudder" and base != "none":
            raise InputError(
                f"base: expected 'none' with action '{action}', got '{base}'"
            )

    @property
    def training_seed(self) -> int:
        """Seed of the first ship; the others follow."""
        return SEEDS_EACH * self.seed

    def configuration(self) -> dict[str, Any]:
        """Return all but the threads, ready for JSON."""
        return {
            "algorithm": self.algorithm,
            "task": self.task.name,
            "suite": self.task.suite,
            "environment": self.task.environment,
            "model": self.task.model,
            "model_sha256": model_hash(self.task.ship),
            "options": as_json(self.task.options),
            "randomise": self.randomise,
            "seed": self.seed,
            "settings": self.settings.to_dict(),
        }

    @classmethod
    def from_configuration(cls, content: Mapping[str, Any], threads: int) -> Self:
        """Make the plan that `configuration` describes."""
        options = {}
        for name, value in content["options"].items():
            options[name] = _read_option(value, name)
        task = BenchmarkTask(
            name=content["task"],
            environment=content["environment"],
            model=content["model"],
            options=options,
            suite=content["suite"],
        )
        algorithm = content["algorithm"]
        return cls(
            algorithm=algorithm,
            task=task,
            settings=make_settings(algorithm, content["settings"]),
            seed=content["seed"],
            randomise=content["randomise"],
            threads=threads,
        )


def _read_option(value: Any, name: str) -> Any:
    """Read an option of an environment from JSON."""
    if isinstance(value, Mapping):
        return Weather.from_dict(value, name)
    if isinstance(value, list):
        return [_read_option(entry, name) for entry in value]
    return value


def training_options(plan: TrainingPlan) -> dict[str, Any]:
    """Keywords of the environment that the ships learn in.

    They earn what the setting `reward` says, where the algorithm has it, unless the
    task's options do.
    With `randomise`, or the setting `model_uncertainty`, each episode has a ship drawn
    from the model's covariance, where it has one; with `randomise` also an approach
    speed of 0.8 to 1.1 times the service speed, and any of the sea states that the
    ship's particulars allow, the task's own among them and its current in all of them.
    """
    task = plan.task
    options = task.arguments
    if isinstance(plan.settings, GradientSettings):
        options.setdefault("bounded", plan.settings.reward == "bounded")
    uncertain = plan.settings.model_uncertainty == "covariance"
    has_covariance = task.ship.covariance is not None
    if has_covariance and (plan.randomise or uncertain):
        options.setdefault("model_uncertainty", "covariance")
    if plan.randomise:
        options.setdefault("speed_range", (0.8, 1.1))
        options["sea"] = _seas(task.task, task.ship)
    return options


def _seas(task: Task, ship: ShipModel) -> list[Weather]:
    """Return the seas of a task, and the other sea states that its ship allows."""
    seas = list(task.seas)
    known = {sea.name for sea in seas}
    for name in ("calm", "slight", "moderate", "rough"):
        if name in known:
            continue
        sea = as_weather(name, "sea", None)
        with_current = replace(sea, current=task.weather.current)
        with suppress(InputError):
            weather_column(ship, with_current, task.substep(ship), task.water_depth)
            seas.append(with_current)
    return seas


def first_difference(
    found: Mapping[str, Any], expected: Mapping[str, Any], where: str = ""
) -> str | None:
    """Describe the first entry in which two configurations differ, if there is one."""
    for name in {**expected, **found}:
        value = found.get(name)
        other = expected.get(name)
        place = f"{where}{name}"
        if isinstance(value, Mapping) and isinstance(other, Mapping):
            inner = first_difference(value, other, f"{place}.")
            if inner is not None:
                return inner
        elif value != other:
            return f"{place}: expected {other!r}, got {value!r}"
    return None


def check_same(
    found: Mapping[str, Any], expected: Mapping[str, Any], where: str
) -> None:
    """Raise InputError for another configuration than that of a run."""
    check_keys(found, tuple(expected), where)
    difference = first_difference(found, expected)
    if difference is not None:
        raise InputError(
            f"{where}: a run of another configuration: {difference}; resume it with its"
            " own, or name another folder"
        )
