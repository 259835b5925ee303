"""The plan of a training: what is learned, and with which settings."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.controllers.interface import model_hash
from agents.policies.policy import OUTPUTS
from agents.suites.benchmark_task import BenchmarkTask
from agents.suites.environments import SHORT_NAMES, read_environment
from agents.suites.suite import find_task
from agents.training.settings import (
    SEEDS_EACH,
    LearningSettings,
    load_settings,
    read_settings_file,
    settings_of,
)
from agents.training.yardsticks import half_reward_cost
from shipgym.checks import check_choice, check_whole
from shipgym.envs.environment import DEFAULT_MODEL, DEFAULT_TASK, PACE
from shipgym.envs.episode import as_json
from shipgym.envs.registration import env_id, registered
from shipgym.errors import InputError
from shipgym.python_files import file_options

#: Seeds below those that are scored: of training a thousand for each `seed`, then those
#: held out.
EVALUATION_SEED = 900_000
N_EVALUATIONS = 100


@dataclass(frozen=True)
class TrainingPlan:
    """Training with all its settings, which determine the result.

    Raises InputError for commands that the algorithm does not learn, or a value out of
    its range.

    Attributes
    ----------
    algorithm : {"ppo", "sac"}
    task : BenchmarkTask
        Environment, model and options; evaluation is on it as it is.
    settings : LearningSettings
        Of the algorithm.
    seed : int
        0 to 799, of networks, exploration and the ships' episodes.
    """

    algorithm: str
    task: BenchmarkTask
    settings: LearningSettings
    seed: int = 0

    def __post_init__(self) -> None:
        check_whole(self.seed, "seed", at_least=0, at_most=799)
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
    def training_seed(self) -> int:
        """Seed of the first ship; the others follow."""
        return SEEDS_EACH * self.seed

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
            "seed": self.seed,
            "settings": self.settings.to_dict(),
        }


def make_plan(
    algorithm: str,
    environment: str | None = None,
    *,
    model: str | None = None,
    sea: str | None = None,
    task: str | None = None,
    options: Mapping[str, Any] | None = None,
    settings_file: Path | None = None,
    settings: Mapping[str, Any] | None = None,
    seed: int = 0,
) -> TrainingPlan:
    """Make the plan of a training.

    Raises InputError for an unknown algorithm, environment, task, model, option or
    setting, with the nearest known one, or a value out of its range.

    Parameters
    ----------
    algorithm : {"ppo", "sac"}
    environment : str, optional
        As `read_environment` takes it; by default course keeping.
    model : str, optional
        Name or file of a model; by default that of the environment.
    sea : str, optional
        Sea state.
    task : str, optional
        Task of the suite, in place of environment, model, sea and options.
    options : mapping, optional
        Further keywords of the environment.
    settings_file : Path, optional
        TOML.
    settings : mapping, optional
        Settings by name; they go before the file.
    seed : int
        As in `TrainingPlan`.
    """
    settings_of(algorithm)  # its error goes before those of the task
    asked = {
        "--env": environment,
        "--model": model,
        "--sea": sea,
        "--option": options or None,
    }
    given = [name for name, value in asked.items() if value is not None]
    if task is None:
        learned = _task(environment, model, sea, options or {})
    elif given:
        raise InputError(
            f"--task: expected alone, got {given[0]} too, which the task sets; leave"
            " one of them out"
        )
    else:
        learned = find_task(task)
    own = {} if learned.task.action == "rudder" else {"base": "none"}
    if settings_file is not None:
        own |= read_settings_file(settings_file, algorithm)
    chosen = load_settings(
        algorithm,
        learned.environment,
        learned.name,
        learned.suite,
        given={**own, **(settings or {})},
    )
    return TrainingPlan(algorithm, learned, chosen, seed)


def _task(
    environment: str | None,
    model: str | None,
    sea: str | None,
    options: Mapping[str, Any],
) -> BenchmarkTask:
    """Return environment, model and options."""
    for name in options.keys() & set(PACE):
        raise InputError(
            f"--option {name}: expected a setting of learning: --set {name}"
        )
    known = read_environment(environment or "course-keeping")
    of_sea = {} if sea is None else {"sea": sea}
    of_file = file_options(known.name)
    for name in PACE:  # settings of learning
        of_file.pop(name, None)
    task = env_id(SHORT_NAMES.get(known.name, DEFAULT_TASK))
    usual = registered()[task].get("model", DEFAULT_MODEL)
    keywords = {**of_file, **known.options, **of_sea, **options}
    ship = keywords.pop("model", usual)
    return BenchmarkTask("", known.name, model or ship, options=keywords)


def training_options(plan: TrainingPlan) -> dict[str, Any]:
    """Keywords of the environment that the ships learn in.

    They earn what the setting `reward` says, unless the task's options do; in a task of
    a user's file the bounded reward has the scale of its costs (`half_reward_cost`).
    The setting `randomise` draws ships from the model's covariance, where it has one.
    """
    task = plan.task
    options = task.arguments
    if "bounded" not in options:
        is_bounded = plan.settings.reward == "bounded"
        options["bounded"] = is_bounded
        if is_bounded and task.environment not in SHORT_NAMES:
            seeds = range(plan.training_seed, plan.training_seed + 50)
            options["bounded"] = half_reward_cost(task, seeds)
    drawn = plan.settings.randomise == "covariance"
    if drawn and task.ship.covariance is not None:
        options.setdefault("model_uncertainty", "covariance")
    return options


def check_same(
    found: Mapping[str, Any], expected: Mapping[str, Any], where: str
) -> None:
    """Raise InputError for another configuration than that of a run."""
    now, before = dict(_entries(found)), dict(_entries(expected))
    for name in before | now:
        if now.get(name) != before.get(name):
            raise InputError(
                f"{where}: a run of another configuration: {name}: expected"
                f" {before.get(name)!r}, got {now.get(name)!r}; continue it with its"
                " own, or name another folder"
            )


def _entries(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Entries of nested tables by their dotted names."""
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _entries(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
