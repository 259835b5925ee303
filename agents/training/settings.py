"""Settings of learning: one frozen dataclass an algorithm, read from TOML.

The files in `hyperparameters/` have the tuned values that differ from the defaults
here, later tables before earlier ones: `defaults`, to learn from scratch; `own`, for
tasks other than course keeping and path following; those with a base in an environment
(`residual`), on every task of a suite (`suites`), on one of them (`tasks`).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields
from math import gcd
from pathlib import Path
from typing import Any

from agents.controllers.registry import controller_kinds
from agents.settings import Settings, setting
from agents.suites.environments import SHORT_NAMES
from shipgym.checks import check_choice, check_keys, check_table, check_text
from shipgym.errors import InputError
from shipgym.files import read_toml, shipped_toml

#: Seeds of training for each `seed` of a plan.
SEEDS_EACH = 1000


@dataclass(frozen=True, kw_only=True)
class LearningSettings(Settings):
    """Settings of all algorithms; `search` has the values that tuning tries.

    A decision lasts `action_repeat` control intervals.
    """

    total_steps: int = setting(
        "decisions to learn from, of all ships together", at_least=1
    )
    evaluate_every: int = setting("decisions between evaluations", at_least=1)
    net_arch: tuple[int, ...] = setting(
        "widths of the hidden layers of the policy, and of PPO's value",
        (64, 64),
        at_least=1,
        search=[(32, 32), (64, 64), (128, 128)],
    )
    activation: str = setting(
        "function between the layers",
        "relu",
        options=("relu", "tanh"),
        search=["relu", "tanh"],
    )
    frame_stack: int = setting(
        "observations that the policy sees, the newest last; 1 with a base, or with"
        " action_repeat",
        1,
        at_least=1,
    )
    action_repeat: int = setting(
        "control intervals of a decision; a base goes on with its feedback in each of"
        " them",
        1,
        at_least=1,
        search=[1, 4, 16],
    )
    base: str = setting(
        "classical controller that the policy adds to: a kind, a controller's file that"
        ' ends in .json, "none", or "tuned", the best of those tuned for the suite\'s'
        " task (except `designs.NO_BASES`)",
        "none",
    )
    authority: float = setting(
        "share of the action's range by which it may differ from the base; 1 without a"
        " base",
        1.0,
        above=0.0,
        at_most=2.0,
    )
    rate_limit: float = setting(
        "largest change of the output in force in a control interval, so that the"
        " rudder does not jump where a decision gives way to the next; 2 does not limit"
        " it",
        2.0,
        above=0.0,
        at_most=2.0,
    )
    randomise: str = setting(
        "covariance: the ships that learn are drawn from the model's covariance."
        " Evaluation is on the task as it is",
        "none",
        options=("none", "covariance"),
    )

    ships: int = setting("ships that sail at once", at_least=1, at_most=SEEDS_EACH)
    batch_size: int = setting(
        "samples of one gradient step", at_least=1, search=[128, 256, 512, 1024, 2048]
    )
    learning_rate: float = setting(
        "learning rate of Adam at the beginning; it falls to 0 at the end",
        1e-3,
        above=0.0,
        at_most=1.0,
        search=(1e-4, 3e-3, "log"),
    )
    gamma: float = setting(
        "discount of a decision",
        0.98,
        at_least=0.0,
        at_most=1.0,
        search=[0.9, 0.95, 0.98, 0.99, 0.995, 0.999],
    )
    reward: str = setting(
        "what ships earn: minus the steering cost, which reward_scale suits, or the"
        " bounded reward that environments give by default; in a task of your own its"
        " scale follows from what a step costs under random actions",
        "cost",
        options=("cost", "bounded"),
    )
    reward_scale: float | str = setting(
        "divisor of rewards before they are limited to [-10, 10]; running is the"
        " standard deviation of their discounted sum so far",
        above=0.0,
        word="running",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        base = check_text(self.base, "base")
        if not base.endswith(".json"):
            check_choice(base, ("none", "tuned", *controller_kinds()), "base")
        if self.base == "none" and self.authority != 1.0:
            raise InputError(
                f"authority: expected 1 without a base, got {self.authority:g}"
            )
        if self.frame_stack > 1 and (self.base != "none" or self.action_repeat > 1):
            raise InputError(
                "frame_stack: expected 1 with a base or with action_repeat, got"
                f" {self.frame_stack}"
            )


@dataclass(frozen=True, kw_only=True)
class PPOSettings(LearningSettings):
    """Proximal policy optimisation (Schulman et al. 2017, arXiv:1707.06347)."""

    n_steps: int = setting(
        "decisions of each ship in a rollout",
        64,
        at_least=1,
        search=[16, 32, 64, 128, 256],
    )
    n_epochs: int = setting(
        "uses of each sample of a rollout", 5, at_least=1, search=(2, 12)
    )
    gae_lambda: float = setting(
        "decay of the generalised advantage estimate",
        0.98,
        at_least=0.0,
        at_most=1.0,
        search=(0.85, 1.0),
    )
    clip_range: float = setting(
        "largest change of the ratio of probabilities",
        0.2,
        above=0.0,
        search=(0.1, 0.4),
    )
    ent_coef: float = setting(
        "weight of the entropy", 0.0, at_least=0.0, search=(1e-6, 1e-2, "log")
    )
    log_std_init: float = setting(
        "logarithm of the action's standard deviation at the beginning",
        -1.0,
        at_least=-10.0,
        at_most=3.0,
        search=(-3.0, 0.5),
    )
    log_std_end: float | str = setting(
        "value to which the logarithm of the standard deviation falls evenly over the"
        " training. A rudder that chatters costs more than steering does, and the"
        " policy that is best while it explores is not the one that is best without",
        -3.0,
        at_least=-10.0,
        at_most=3.0,
        word="learned",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        rollout = self.ships * self.n_steps
        if rollout % self.batch_size or self.batch_size < 2:
            raise InputError(
                "batch_size: expected a divisor above 1 of ships x n_steps ="
                f" {rollout}, got {self.batch_size}"
            )


@dataclass(frozen=True, kw_only=True)
class SACSettings(LearningSettings):
    """Soft actor-critic (Haarnoja et al. 2018, arXiv:1812.05905)."""

    buffer_size: int = setting("decisions that are remembered", 200_000, at_least=1)
    learning_starts: int = setting(
        "decisions of all ships under random actions before learning begins",
        800,
        at_least=0,
    )
    train_freq: int = setting("decisions of each ship between updates", 1, at_least=1)
    gradient_steps: int = setting(
        "gradient steps of an update", 8, at_least=1, search=[2, 4, 8, 16]
    )
    tau: float = setting(
        "share by which the target network approaches the critic in an update",
        0.005,
        above=0.0,
        at_most=1.0,
        search=(1e-3, 5e-2, "log"),
    )
    critic_arch: tuple[int, ...] = setting(
        "widths of the hidden layers of the critics",
        (64, 64),
        at_least=1,
        search=[(64, 64), (128, 128), (256, 256)],
    )

    ent_coef: float | str = setting(
        "weight of the entropy; auto or auto_0.1 adapts it, from that value",
        "auto_0.1",
        at_least=0.0,
        search=["auto", "auto_0.1", "auto_0.01"],
        word="auto_",
    )
    target_entropy: float | str = setting(
        "entropy that the coefficient is adapted to; auto is -1 for each command. One"
        " command has the standard deviation 0.09 with -1, 0.24 with 0",
        "auto",
        at_most=1.0,
        word="auto",
        search=(-3.0, 0.5),
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.buffer_size < self.ships:
            raise InputError(
                f"buffer_size: expected at least {self.ships}, one for each of the"
                f" ships, got {self.buffer_size}"
            )


#: Settings by algorithm.
ALGORITHMS: Mapping[str, type[LearningSettings]] = {
    "ppo": PPOSettings,
    "sac": SACSettings,
}


def load_settings(
    algorithm: str,
    environment: str = "course-keeping",
    task: str = "",
    suite: str = "",
    given: Mapping[str, Any] | None = None,
) -> LearningSettings:
    """Return the tuned settings of an algorithm, with those given by name replaced.

    Returns settings of the algorithm's class in `ALGORITHMS`. Raises InputError for an
    unknown algorithm or setting, with the nearest known one, or a value out of its
    range.

    Parameters
    ----------
    algorithm : {"ppo", "sac"}
    environment : str
        "course-keeping", "path-following", "encounter", or the path of a task's file.
    task : str
        Name of a suite's task; one without settings of its own has those of its
        environment.
    suite : str
        Its suite (`BenchmarkTask.suite`).
    given : mapping of str to Any, optional
        Settings by name that go before the tuned ones. With `base` given as "none" a
        policy learns from scratch.
    """
    kind = settings_of(algorithm)
    if not environment.endswith(".py"):
        check_choice(environment, SHORT_NAMES, "environment")
    given = given or {}
    tables = shipped_toml("agents.training", f"hyperparameters/{algorithm}.toml")
    residual = tables["residual"]
    has_base = (
        given.get("base", "none" if environment not in residual else "") != "none"
    )
    layers = [tables["defaults"]]
    if has_base:
        layers += [residual.get(environment, {}), tables["suites"].get(suite, {})]
        layers += [tables["tasks"].get(task, {})] if suite else []
    elif environment not in residual:
        layers.append(tables["own"])
    values: dict[str, Any] = {}
    for layer in (*layers, given):
        values |= layer
    check_keys(values, [one.name for one in fields(kind)], f"settings of {algorithm}")
    return kind(**values)


def settings_of(algorithm: str) -> type[LearningSettings]:
    """Class of an algorithm's settings; InputError for an unknown algorithm."""
    return ALGORITHMS[check_choice(algorithm, ALGORITHMS, "algorithm")]


def read_settings_file(path: Path, algorithm: str) -> dict[str, Any]:
    """Read a user's TOML file; InputError for a broken one or an unknown setting."""
    table = check_table(read_toml(path, "settings file"), str(path))
    check_keys(table, [one.name for one in fields(settings_of(algorithm))], str(path))
    return dict(table)


def suggested(
    settings: LearningSettings, trial: Any, fixed: Collection[str] = ()
) -> LearningSettings:
    """Return settings with the values that an Optuna trial suggests for the others.

    A batch that does not divide PPO's rollout is made to.
    """
    varied: dict[str, Any] = {}
    for one in fields(settings):
        name, search = one.name, one.metadata["search"]
        if search is None or name in fixed:
            continue
        if isinstance(search, list):
            choices = {str(value): value for value in search}
            varied[name] = choices[trial.suggest_categorical(name, [*choices])]
        elif one.type is int:
            varied[name] = trial.suggest_int(name, *search)
        else:
            low, high, *scale = search
            varied[name] = trial.suggest_float(name, low, high, log=bool(scale))
    if isinstance(settings, PPOSettings) and "batch_size" in varied:
        rollout = settings.ships * varied.get("n_steps", settings.n_steps)
        varied["batch_size"] = gcd(varied["batch_size"], rollout)
    return settings.changed(varied)
