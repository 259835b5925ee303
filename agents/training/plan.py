"""What a run of training is: algorithm, task, settings and seed; how it is read from what a user gives."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from agents.controllers.controller import model_hash
from agents.policies.weights_file import as_json
from agents.suites.environments import read_environment
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, find_task
from agents.training.settings import (
    Settings,
    changed,
    load_settings,
    make_settings,
    read_settings_file,
    settings_of,
)
from shipgym.checks import check_keys, check_whole
from shipgym.errors import InputError
from shipgym.sea.conditions import Weather, as_weather
from shipgym.sea.weather_column import weather_column

#: Seeds below those that are scored: of training a thousand for each `seed`, then those
#: held out.
SEEDS_EACH = 1000
LARGEST_SEED = 799
MOST_THREADS = 1024
EVALUATION_SEED = 900_000
N_EVALUATIONS = 100
SPEED_RANGE = (0.8, 1.1)
SEAS = ("calm", "slight", "moderate", "rough")
NO_TASK = ""
RUN = ("seed", "randomise", "threads")  # of a plan, whatever is learned


@dataclass(frozen=True)
class Plan:
    """A run of training.

    Raises InputError for settings of another algorithm, commands that are not
    continuous, or a value out of its range.
    """

    algorithm: str  # "ppo", "sac", "td3", "tqc"
    task: BenchmarkTask  # environment, model and options; evaluation is on it as it is
    settings: Settings  # of the algorithm
    seed: int = 0  # 0 to 799: of networks, exploration and the ships' episodes
    randomise: bool = False  # whether the ships that learn differ (`training_options`)
    threads: int = 1  # of torch and of the kernels

    def __post_init__(self) -> None:
        kind = settings_of(self.algorithm)
        if type(self.settings) is not kind:
            raise InputError(
                f"settings: {type(self.settings).__name__} found, expected"
                f" {kind.__name__} for {self.algorithm}"
            )
        check_whole(self.seed, "seed", at_least=0, at_most=LARGEST_SEED)
        check_whole(self.settings.ships, "ships", at_least=1, at_most=SEEDS_EACH)
        check_whole(self.threads, "threads", at_least=1, at_most=MOST_THREADS)
        longest, hint = self.task.task.episode_steps, "no longer than an episode"
        check_whole(
            self.settings.action_repeat,
            "action_repeat",
            at_least=1,
            at_most=longest,
            hint=hint,
        )
        self.task.task.check_fits(self.task.ship)
        action, base = self.task.task.action, self.settings.base
        if action == "rudder-discrete" and self.algorithm != "ppo":
            raise InputError(
                f"action: '{action}' found, which {self.algorithm} does not learn;"
                " take ppo"
            )
        if action != "rudder" and base != "none":
            raise InputError(
                f"base: '{base}' found with action '{action}', expected 'none', or"
                " action 'rudder'"
            )

    @property
    def training_seed(self) -> int:
        """Of the first ship; the others follow."""
        return SEEDS_EACH * self.seed

    def configuration(self) -> dict[str, Any]:
        """All that decides what is learned, ready for JSON; threads are stored beside it."""
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
        """The run that `configuration` describes."""
        options = {
            name: _read(value, name) for name, value in content["options"].items()
        }
        task = BenchmarkTask(
            content["task"],
            content["environment"],
            content["model"],
            options=options,
            suite=content["suite"],
        )
        settings = make_settings(content["algorithm"], content["settings"])
        return cls(
            content["algorithm"],
            task,
            settings,
            content["seed"],
            content["randomise"],
            threads,
        )


@dataclass(frozen=True)
class Given:
    """What a user gives; None or empty for what is left to the defaults, or to the run that is resumed."""

    algorithm: str
    #: as `read_environment` takes it
    environment: str | None = None
    #: name or file of a model, and a sea state
    model: str | None = None
    sea: str | None = None
    #: task of a suite, which says environment, model, sea and options
    task: str | None = None
    options: Mapping[str, Any] = field(
        default_factory=dict
    )  # further keywords of the environment
    settings_file: Path | None = None  # TOML
    settings: Mapping[str, Any] = field(
        default_factory=dict
    )  # by name; they go before the file
    #: as in `Plan`
    seed: int | None = None
    randomise: bool | None = None
    threads: int | None = None
    #: name of a shipped suite, or the path of one of the user's own; and code that it
    #: may name
    suite: str = DEFAULT_SUITE
    allow_code: Sequence[str] = ()


def make_plan(given: Given, stored: Plan | None = None) -> Plan:
    """The run that a user asks for.

    Raises InputError for an unknown algorithm, environment, task, model, option or
    setting, with the nearest known one, or a value out of its range.

    Parameters
    ----------
    given : Given
    stored : Plan, optional
        The run that is resumed: what is not given is as it was.
    """
    settings_of(given.algorithm)  # its error goes before those of the task
    task = _task(given, stored)
    own = (
        read_settings_file(given.settings_file, given.algorithm)
        if given.settings_file
        else {}
    )
    own |= given.settings
    if stored is None or stored.algorithm != given.algorithm:
        settings = load_settings(
            given.algorithm,
            task.environment,
            task.name,
            own,
            task.task.action,
            task.suite,
        )
    else:
        settings = changed(stored.settings, own)
    kept = {} if stored is None else {name: getattr(stored, name) for name in RUN}
    asked = {
        name: getattr(given, name) for name in RUN if getattr(given, name) is not None
    }
    return Plan(given.algorithm, task, settings, **kept | asked)


def _task(given: Given, stored: Plan | None) -> BenchmarkTask:
    """Environment, model and options."""
    named = {"--env": given.environment, "--model": given.model, "--sea": given.sea}
    beside = [name for name, value in named.items() if value is not None] + [
        "--option"
    ] * bool(given.options)
    if given.task is not None:
        if beside:
            raise InputError(
                f"--task: found together with {beside[0]}, which the task sets; leave"
                " one of them out"
            )
        return find_task(given.task, given.suite, given.allow_code)
    if stored is not None and not beside:
        return stored.task
    before = (
        BenchmarkTask(NO_TASK, "course-keeping", "mariner")
        if stored is None
        else stored.task
    )
    environment = read_environment(given.environment or before.environment)
    sea = {} if given.sea is None else {"sea": given.sea}
    options = {**before.options, **environment.options, **sea, **given.options}
    model = options.pop("model", before.model)
    return BenchmarkTask(
        before.name,
        environment.name,
        given.model or model,
        options=options,
        suite=before.suite,
    )


def code_given(given: Given) -> dict[str, Any]:
    """What a user names of a run that may be code: environment, model and options."""
    if given.task is not None:
        task = find_task(given.task, given.suite, given.allow_code)
        options = as_json(task.options)
        return {
            "environment": task.environment,
            "model": task.model,
            "options": options,
        }
    name, options = None, {}
    if given.environment is not None:
        name, options = read_environment(given.environment)
    options = {**options, **given.options}
    return {"environment": name, "model": given.model, "options": options}


def training_options(plan: Plan) -> dict[str, Any]:
    """Keywords of the environment that the ships learn in.

    With `randomise`, or the setting `model_uncertainty`, each episode has a ship drawn
    from the model's covariance, where it has one; with `randomise` also an approach
    speed of 0.8 to 1.1 times the service speed, and any of the sea states in which the
    ship's particulars allow weather to be worked out, the task's own among them and its
    current in all of them.
    """
    options = plan.task.arguments
    ship, task = plan.task.ship, plan.task.task
    drawn = plan.randomise or plan.settings.model_uncertainty == "covariance"
    if drawn and ship.covariance is not None:
        options.setdefault("model_uncertainty", "covariance")
    if not plan.randomise:
        return options
    options.setdefault("speed_range", SPEED_RANGE)
    own = {sea.name for sea in task.seas}
    others = [as_weather(name, "sea", None) for name in SEAS if name not in own]
    options["sea"] = [*task.seas]
    for sea in (replace(other, current=task.weather.current) for other in others):
        with suppress(InputError):
            weather_column(ship, sea, task.substep(ship), task.water_depth)
            options["sea"].append(sea)
    return options


def _read(value: Any, name: str) -> Any:
    """An option from JSON."""
    if isinstance(value, Mapping):
        return Weather.from_dict(value, name)
    return [_read(one, name) for one in value] if isinstance(value, list) else value


def first_difference(
    found: Mapping[str, Any], expected: Mapping[str, Any], where: str = ""
) -> str | None:
    """The first entry in which two configurations differ, with both values; None if they are the same."""
    for name in {**expected, **found}:
        one, other = found.get(name), expected.get(name)
        if isinstance(one, Mapping) and isinstance(other, Mapping):
            if (inner := first_difference(one, other, f"{where}{name}.")) is not None:
                return inner
        elif one != other:
            return f"{where}{name} is {other!r} there, {one!r} here"
    return None


def check_same(
    found: Mapping[str, Any], expected: Mapping[str, Any], where: str
) -> None:
    """Refuse to go on with another configuration than that of a run, naming the first difference."""
    check_keys(found, tuple(expected), where)
    if (difference := first_difference(found, expected)) is not None:
        raise InputError(
            f"{where}: a run of another configuration: {difference}; resume it with its"
            " own, or name another folder"
        )
