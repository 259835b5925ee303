"""What a user asks to be trained, and the plan that is made of it."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from agents.controllers.interface import model_hash
from agents.policies.policy import OUTPUTS
from agents.policies.weights_file import as_json
from agents.suites.environments import SHORT_NAMES, read_environment
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, find_task
from agents.training.settings import (
    SEEDS_EACH,
    LearningSettings,
    load_settings,
    read_settings_file,
    settings_of,
)
from agents.training.yardsticks import half_reward_cost
from shipgym.checks import (
    check_choice,
    check_keys,
    check_table,
    check_text,
    check_whole,
)
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.sea.conditions import Weather, as_weather
from shipgym.sea.weather_column import weather_column
from shipgym.tasks.task import Task

#: Seeds below those that are scored: of training a thousand for each `seed`, then those
#: held out.
EVALUATION_SEED = 900_000
N_EVALUATIONS = 100


@dataclass(frozen=True)
class TrainingRequest:
    """Training that a user asks for.

    Attributes
    ----------
    algorithm : {"ppo", "sac", "td3", "tqc"}
    environment : str
        As `read_environment` takes it; by default course keeping.
    model : str
        Name or file of a model; by default the Mariner.
    sea : str
        Sea state.
    task : str
        Task of a suite, in place of environment, model, sea and options.
    suite : str
        Shipped suite, or the path of one of the user's own.
    options : mapping
        Further keywords of the environment.
    settings_file : Path
        TOML.
    settings : mapping
        Settings by name; they go before the file.
    seed : int
        0 to 799, of networks, exploration and the ships' episodes.
    randomise : bool
        True for ships that differ (`training_options`).
    threads : int
        Of torch and of the loops over ships.
    allow_code : sequence of str
        Code that the suite may name.
    """

    algorithm: str
    environment: str | None = None
    model: str | None = None
    sea: str | None = None
    task: str | None = None
    suite: str = DEFAULT_SUITE
    options: Mapping[str, Any] = field(default_factory=dict)
    settings_file: Path | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    randomise: bool = False
    threads: int = 1
    allow_code: Sequence[str] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return what `from_dict` reads, ready for JSON."""
        return {name: as_json(getattr(self, name)) for name in KEPT}

    @classmethod
    def from_dict(cls, content: Any, where: str) -> Self:
        """Read what `to_dict` returned; InputError names what is wrong.

        No name in it imports anything: the environment is a shipped one or a file.
        """
        table = dict(check_table(content, where, KEPT, KEPT))
        for name in ("environment", "model", "task"):
            if table[name] is not None:
                check_text(table[name], f"{where}.{name}")
        environment = table["environment"]
        if environment is not None and not environment.endswith(".py"):
            check_choice(environment, SHORT_NAMES, f"{where}.environment")
        check_text(table["suite"], f"{where}.suite")
        check_table(table["settings"], f"{where}.settings")
        options = check_table(table["options"], f"{where}.options")
        table["options"] = {name: _option(one, name) for name, one in options.items()}
        return cls(**table)


#: Fields of a request that its file keeps: no code that a suite may name.
KEPT = (
    "algorithm",
    "environment",
    "model",
    "task",
    "suite",
    "options",
    "settings",
    "seed",
    "randomise",
    "threads",
)


def _option(value: Any, name: str) -> Any:
    """Read an option of an environment from JSON."""
    if isinstance(value, Mapping):
        return Weather.from_dict(value, name)
    if isinstance(value, list):
        return [_option(entry, name) for entry in value]
    return value


@dataclass(frozen=True)
class TrainingPlan:
    """Training with all its settings, which determine the result.

    Raises InputError for settings of another algorithm, commands that are not
    continuous, or a value out of its range.

    Attributes
    ----------
    request : TrainingRequest
        What it was made of.
    task : BenchmarkTask
        Environment, model and options; evaluation is on it as it is.
    settings : LearningSettings
        Of the algorithm.
    """

    request: TrainingRequest
    task: BenchmarkTask
    settings: LearningSettings

    def __post_init__(self) -> None:
        check_whole(self.request.seed, "seed", at_least=0, at_most=799)
        check_whole(self.request.threads, "threads", at_least=1, at_most=1024)
        check_whole(
            self.settings.action_repeat,
            "action_repeat",
            at_least=1,
            at_most=self.task.task.episode_steps,
            hint="no longer than an episode",
        )
        self.task.task.check_fits(self.task.ship)
        action = check_choice(self.task.task.action, OUTPUTS, "action")
        if action == "rudder-discrete" and self.algorithm != "ppo":
            raise InputError(
                f"action: expected one that {self.algorithm} learns, got '{action}';"
                " take ppo"
            )
        base = self.settings.base
        if action != "rudder" and base != "none":
            raise InputError(
                f"base: expected 'none' with action '{action}', got '{base}'"
            )

    @property
    def algorithm(self) -> str:
        """Name of the algorithm."""
        return self.request.algorithm

    @property
    def threads(self) -> int:
        """Threads of torch and of the loops over ships."""
        return self.request.threads

    @property
    def training_seed(self) -> int:
        """Seed of the first ship; the others follow."""
        return SEEDS_EACH * self.request.seed

    def configuration(self) -> dict[str, Any]:
        """Return all that decides the result, ready for JSON."""
        return {
            "algorithm": self.algorithm,
            "task": self.task.name,
            "suite": self.task.suite,
            "environment": self.task.environment,
            "model": self.task.model,
            "model_sha256": model_hash(self.task.ship),
            "options": as_json(self.task.options),
            "randomise": self.request.randomise,
            "seed": self.request.seed,
            "settings": self.settings.to_dict(),
        }


def make_plan(request: TrainingRequest) -> TrainingPlan:
    """Make the plan that a user asks for.

    Raises InputError for an unknown algorithm, environment, task, model, option or
    setting, with the nearest known one, or a value out of its range.
    """
    settings_of(request.algorithm)  # its error goes before those of the task
    task = _task(request)
    given: dict[str, Any] = {}
    if request.settings_file:
        given = read_settings_file(Path(request.settings_file), request.algorithm)
    given |= request.settings
    settings = load_settings(
        request.algorithm,
        environment=task.environment,
        task=task.name,
        given=given,
        action=task.task.action,
        suite=task.suite,
    )
    whole = replace(request, settings=given, settings_file=None)
    if request.task is None:
        whole = replace(
            whole,
            environment=task.environment,
            model=task.model,
            sea=None,
            options=task.options,
        )
    return TrainingPlan(whole, task, settings)


def _task(request: TrainingRequest) -> BenchmarkTask:
    """Return environment, model and options."""
    given = {
        "--env": request.environment,
        "--model": request.model,
        "--sea": request.sea,
        "--option": request.options or None,
    }
    options = [name for name, value in given.items() if value is not None]
    if request.task is not None:
        if options:
            raise InputError(
                f"--task: expected alone, got {options[0]} too, which the task sets;"
                " leave one of them out"
            )
        return find_task(request.task, request.suite, request.allow_code)
    if request.suite != DEFAULT_SUITE:
        raise InputError(
            f"--suite: expected together with --task, got {request.suite!r} alone; name"
            " one of its tasks"
        )
    environment = read_environment(request.environment or "course-keeping")
    keywords = {**environment.options, **request.options}
    if request.sea is not None:
        keywords = {**environment.options, "sea": request.sea, **request.options}
    model = keywords.pop("model", "mariner")
    return BenchmarkTask("", environment.name, request.model or model, options=keywords)


def training_options(plan: TrainingPlan) -> dict[str, Any]:
    """Keywords of the environment that the ships learn in.

    They earn what the setting `reward` says, unless the task's options do; in a task of
    a user's file the bounded reward has the scale of its costs (`half_reward_cost`).
    With `randomise`, or the setting `model_uncertainty`, each episode has a ship drawn
    from the model's covariance, where it has one; with `randomise` also an approach
    speed of 0.8 to 1.1 times the service speed, and any of the sea states that the
    ship's particulars allow, the task's own among them and its current in all of them.
    """
    task = plan.task
    options = task.arguments
    if "bounded" not in options:
        options["bounded"] = _bounded(plan)
    uncertain = plan.settings.model_uncertainty == "covariance"
    has_covariance = task.ship.covariance is not None
    if has_covariance and (plan.request.randomise or uncertain):
        options.setdefault("model_uncertainty", "covariance")
    if plan.request.randomise:
        options.setdefault("speed_range", (0.8, 1.1))
        options["sea"] = _seas(task.task, task.ship)
    return options


def _bounded(plan: TrainingPlan) -> bool | float:
    """Return what the keyword `bounded` is for the ships that learn."""
    if plan.settings.reward != "bounded" or plan.task.environment in SHORT_NAMES:
        return plan.settings.reward == "bounded"
    seeds = range(plan.training_seed, plan.training_seed + 50)
    return half_reward_cost(plan.task, seeds)


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
