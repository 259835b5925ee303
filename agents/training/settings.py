"""Settings of learning: one frozen dataclass an algorithm, read from TOML.

The files in `hyperparameters/` have the tuned ones, later tables before earlier ones:
`defaults`, every setting of the algorithm to learn from scratch; those that differ
with a base in an environment (`residual`), on every task of a suite (`suites`), on one
of them (`tasks`).
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from agents.controllers.registry import controller_kinds
from agents.policies.weights_file import as_json
from agents.suites.environments import SHORT_NAMES
from shipgym.checks import (
    check_choice,
    check_keys,
    check_number,
    check_table,
    check_text,
    check_whole,
)
from shipgym.errors import InputError
from shipgym.files import read_toml, shipped_toml
from shipgym.tasks.task import ACTIONS

#: Seeds of training for each `seed` of a plan.
SEEDS_EACH = 1000


def setting(
    meaning: str,
    *,
    options: Sequence[str] = (),
    word: str = "",
    **bounds: float,
) -> Any:
    """Field of a setting: what it means, and which values it may have.

    A number has bounds, keywords of `check_number` or `check_whole`; a `word` may stand
    for it, and one that ends in an underscore may have a positive number after it. A
    word is one of the `options`, where there are any.
    """
    about = {"meaning": meaning, "options": options, "word": word, "bounds": bounds}
    return field(metadata=about)


@dataclass(frozen=True)
class LearningSettings(ABC):
    """Settings of all algorithms.

    A decision lasts `action_repeat` control intervals.
    """

    total_steps: int = setting(
        "decisions to learn from, of all ships together", at_least=1
    )
    evaluate_every: int = setting("decisions between evaluations", at_least=1)
    net_arch: tuple[int, ...] = setting(
        "widths of the hidden layers of the policy, and of PPO's value", at_least=1
    )
    activation: str = setting("function between the layers", options=("relu", "tanh"))
    frame_stack: int = setting(
        "observations that the policy sees, the newest last", at_least=1
    )
    action_repeat: int = setting(
        "control intervals of a decision; a base goes on with its feedback in each of"
        " them",
        at_least=1,
    )
    base: str = setting(
        "classical controller that the policy adds to: a kind, a controller's file that"
        ' ends in .json, "none", or "tuned", the best of those tuned for the suite\'s'
        " task (except `designs.NO_BASES`)"
    )
    authority: float = setting(
        "share of the action's range by which it may differ from the base; 1 without a"
        " base",
        above=0.0,
        at_most=2.0,
    )
    rate_limit: float = setting(
        "largest change of the output in force in a control interval, so that the"
        " rudder does not jump where a decision gives way to the next; 2 does not limit"
        " it",
        above=0.0,
        at_most=2.0,
    )
    model_uncertainty: str = setting(
        "covariance: the ships that learn are drawn from the model's covariance;"
        " evaluation is on the model itself. Unlike `--randomise` it leaves seas and"
        " speeds as the task has them",
        options=("none", "covariance"),
    )

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            object.__setattr__(self, one.name, _checked(value, one))

        base = check_text(self.base, "base")
        if not base.endswith(".json"):
            check_choice(base, ("none", "tuned", *controller_kinds()), "base")
        if self.base == "none" and self.authority != 1.0:
            raise InputError(
                f"authority: expected 1 without a base, got {self.authority:g}"
            )
        self._check_together()

    @abstractmethod
    def _check_together(self) -> None:
        """Refuse settings that do not fit each other."""

    def to_dict(self) -> dict[str, Any]:
        """Return the settings by name, ready for JSON."""
        return dict(as_json(self))


@dataclass(frozen=True)
class GradientSettings(LearningSettings):
    """Settings of the algorithms that learn by gradients."""

    ships: int = setting("ships that sail at once", at_least=1, at_most=SEEDS_EACH)
    batch_size: int = setting("samples of one gradient step", at_least=1)
    learning_rate: float = setting(
        "learning rate of Adam at the beginning", above=0.0, at_most=1.0
    )
    schedule: str = setting(
        "course of the learning rate; linear falls to 0 at the end of the training",
        options=("constant", "linear"),
    )
    gamma: float = setting("discount of a decision", at_least=0.0, at_most=1.0)
    reward: str = setting(
        "what ships earn: minus the steering cost, which reward_scale suits, or the"
        " bounded reward that environments give by default",
        options=("cost", "bounded"),
    )
    reward_scale: float | str = setting(
        "divisor of rewards before they are limited to [-10, 10]; running is the"
        " standard deviation of their discounted sum so far",
        above=0.0,
        word="running",
    )

    @property
    @abstractmethod
    def rollout(self) -> int:
        """Decisions of all ships between two updates; a training has whole rollouts."""


@dataclass(frozen=True)
class PPOSettings(GradientSettings):
    """Proximal policy optimisation (Schulman et al. 2017, arXiv:1707.06347)."""

    n_steps: int = setting("decisions of each ship in a rollout", at_least=1)
    n_epochs: int = setting("uses of each sample of a rollout", at_least=1)
    gae_lambda: float = setting(
        "decay of the generalised advantage estimate", at_least=0.0, at_most=1.0
    )
    clip_range: float = setting(
        "largest change of the ratio of probabilities", above=0.0
    )
    ent_coef: float = setting("weight of the entropy", at_least=0.0)
    vf_coef: float = setting("weight of the value's error", above=0.0)
    max_grad_norm: float = setting("longest gradient", above=0.0)
    log_std_init: float = setting(
        "logarithm of the action's standard deviation at the beginning",
        at_least=-10.0,
        at_most=3.0,
    )
    log_std_end: float | str = setting(
        "value to which the logarithm of the standard deviation falls evenly over the"
        " training. A rudder that chatters costs more than steering does, and the"
        " policy that is best while it explores is not the one that is best without",
        at_least=-10.0,
        at_most=3.0,
        word="learned",
    )

    @property
    def rollout(self) -> int:
        """Decisions of all ships between two updates."""
        return self.ships * self.n_steps

    def _check_together(self) -> None:
        if self.rollout % self.batch_size or self.batch_size < 2:
            raise InputError(
                "batch_size: expected a divisor above 1 of ships x n_steps ="
                f" {self.rollout}, got {self.batch_size}"
            )


@dataclass(frozen=True)
class OffPolicySettings(GradientSettings):
    """Settings of the algorithms that learn from a replay buffer."""

    buffer_size: int = setting("decisions that are remembered", at_least=1)
    learning_starts: int = setting(
        "decisions of all ships under random actions before learning begins", at_least=0
    )
    train_freq: int = setting("decisions of each ship between updates", at_least=1)
    gradient_steps: int = setting("gradient steps of an update", at_least=1)
    tau: float = setting(
        "share by which the target network approaches the critic in an update",
        above=0.0,
        at_most=1.0,
    )
    critic_arch: tuple[int, ...] = setting(
        "widths of the hidden layers of the critics", at_least=1
    )

    @property
    def rollout(self) -> int:
        """Decisions of all ships between two updates."""
        return self.ships * self.train_freq

    def _check_together(self) -> None:
        if self.buffer_size < self.ships:
            raise InputError(
                f"buffer_size: expected at least {self.ships}, one for each of the"
                f" ships, got {self.buffer_size}"
            )


@dataclass(frozen=True)
class SACSettings(OffPolicySettings):
    """Soft actor-critic (Haarnoja et al. 2018, arXiv:1812.05905)."""

    ent_coef: float | str = setting(
        "weight of the entropy; auto or auto_0.1 adapts it, from that value",
        at_least=0.0,
        word="auto_",
    )
    target_entropy: float | str = setting(
        "entropy that the coefficient is adapted to; auto is -1 for each command. One"
        " command has the standard deviation 0.09 with -1, 0.24 with 0",
        at_most=1.0,
        word="auto",
    )


@dataclass(frozen=True)
class TD3Settings(OffPolicySettings):
    """Twin delayed DDPG (Fujimoto et al. 2018, arXiv:1802.09477)."""

    action_noise: float = setting(
        "standard deviation of what is added to actions to explore", above=0.0
    )
    policy_delay: int = setting(
        "updates of the critics for one of the policy", at_least=1
    )
    target_policy_noise: float = setting(
        "standard deviation of what is added to the target's actions", at_least=0.0
    )
    target_noise_clip: float = setting(
        "largest noise added to the target's actions", at_least=0.0
    )


@dataclass(frozen=True)
class TQCSettings(SACSettings):
    """Truncated quantile critics (Kuznetsov et al. 2020, arXiv:2005.04269)."""

    n_critics: int = setting("number of critics", at_least=1)
    n_quantiles: int = setting("quantiles of each critic", at_least=1)
    top_quantiles_to_drop: int = setting(
        "quantiles of each critic that are dropped, the largest", at_least=0
    )

    def _check_together(self) -> None:
        super()._check_together()
        if self.top_quantiles_to_drop >= self.n_quantiles:
            raise InputError(
                f"top_quantiles_to_drop: expected fewer than n_quantiles ="
                f" {self.n_quantiles}, got {self.top_quantiles_to_drop}"
            )


#: Settings by algorithm.
ALGORITHMS: Mapping[str, type[LearningSettings]] = {
    "ppo": PPOSettings,
    "sac": SACSettings,
    "td3": TD3Settings,
    "tqc": TQCSettings,
}


def _checked(value: Any, one: Field[Any]) -> Any:
    """Return the value of a setting, if its type and bounds allow it."""
    name = one.name
    about = one.metadata
    bounds = about["bounds"]
    if one.type is int:
        return check_whole(value, name, **bounds)
    if one.type is float:
        return check_number(value, name, **bounds)
    if about["options"]:
        return check_choice(value, about["options"], name)
    if one.type is str:
        return value
    if about["word"]:
        return _number_or_word(value, name, about["word"], bounds)

    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InputError(
            f"{name}: expected widths of layers, such as [64, 64], got {value!r}"
        )
    return tuple(check_whole(width, name, **bounds) for width in value)


def _number_or_word(
    value: Any, name: str, word: str, bounds: Mapping[str, float]
) -> Any:
    """Return a number or a word; after an underscore the word has a positive number."""
    alone = word.rstrip("_")
    if value == alone:
        return value
    if word.endswith("_") and isinstance(value, str) and value.startswith(word):
        try:
            check_number(float(value.removeprefix(word)), name, above=0.0)
        except (ValueError, InputError):
            raise InputError(
                f"{name}: expected a number, '{alone}' or such as '{word}0.1', got"
                f" {value!r}"
            ) from None
        return value
    return check_number(value, name, **bounds, hint=f"or '{alone}'")


def load_settings(
    algorithm: str,
    environment: str = "course-keeping",
    task: str = "",
    given: Mapping[str, Any] | None = None,
    action: str = "rudder",
    suite: str = "",
) -> LearningSettings:
    """Return the tuned settings of an algorithm, with those given by name replaced.

    Returns settings of the algorithm's class in `ALGORITHMS`. Raises InputError for an
    unknown algorithm or setting, with the nearest known one, or a value out of its
    range.

    Parameters
    ----------
    algorithm : {"ppo", "sac", "td3", "tqc"}
    environment : str
        "course-keeping", "path-following", or the path of a task's file.
    task : str
        Name of a suite's task; one without settings of its own has those of its
        environment.
    suite : str
        Its suite (`BenchmarkTask.suite`).
    given : mapping of str to Any, optional
        LearningSettings by name that go before the tuned ones.
    action : {"rudder", "rudder-discrete", "rudder-shaft"}
        What is commanded. With others than the rudder, or `base` given as "none", a
        policy learns from scratch.
    """
    check_choice(algorithm, ALGORITHMS, "algorithm")
    if not environment.endswith(".py"):
        check_choice(environment, SHORT_NAMES, "environment")
    check_choice(action, ACTIONS, "action")
    given = given or {}
    tables = shipped_toml("agents.training", f"hyperparameters/{algorithm}.toml")
    values = dict(tables["defaults"])
    has_base = action == "rudder" and given.get("base") != "none"
    if has_base:
        values |= tables["residual"].get(environment, {})
    if has_base and suite in tables["suites"]:
        values |= tables["suites"][suite]
        tasks = tables.get("tasks", {})
        values |= tasks.get(task, {})
    return make_settings(algorithm, {**values, **given})


def settings_of(algorithm: str) -> type[LearningSettings]:
    """Class of an algorithm's settings; InputError for an unknown algorithm."""
    return ALGORITHMS[check_choice(algorithm, ALGORITHMS, "algorithm")]


def make_settings(algorithm: str, values: Mapping[str, Any]) -> LearningSettings:
    """Make settings of values by name, all of them.

    Raises InputError for one unknown or missing, or a value out of its range.
    """
    kind = settings_of(algorithm)
    where = f"settings of {algorithm}"
    table = _known_settings(values, kind, where)
    needed = [one.name for one in fields(kind)]
    check_keys(table, table, where, needed)
    return kind(**table)


def changed(settings: LearningSettings, given: Mapping[str, Any]) -> LearningSettings:
    """Replace some settings; InputError for an unknown one or a value out of range."""
    changes = _known_settings(given, type(settings), "settings")
    return replace(settings, **changes)


def read_settings_file(path: Path, algorithm: str) -> dict[str, Any]:
    """Read a user's TOML file; InputError for a broken one or an unknown setting."""
    content = read_toml(path, "settings file")
    return _known_settings(content, settings_of(algorithm), str(path))


def _known_settings(
    value: Any, kind: type[LearningSettings], where: str
) -> dict[str, Any]:
    """Return a table that names settings only, with integers as decimal numbers."""
    table = check_table(value, where)
    types = {one.name: one.type for one in fields(kind)}
    check_keys(table, tuple(types), where)
    settings = dict(table)
    for name, given in table.items():
        if type(given) is int and types[name] in (float, float | str):
            settings[name] = float(given)
    return settings
