"""Settings of learning: one frozen dataclass an algorithm, read from TOML as docs/training.md says.

The files in `hyperparameters/` have the tuned ones, later tables before earlier ones:
`defaults`, every setting of the algorithm to learn from scratch; those that differ
beside a base in an environment (`residual`), on every task of a suite (`suites`), on
one of them (`tasks`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, ClassVar

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

RUNNING, LEARNED = "running", "learned"  # words in the place of numbers
NUMBER_OR_WORD, WIDTHS = float | str, tuple[int, ...]  # types of settings


def hyperparameters(name: str) -> dict[str, Any]:
    """The content of a file of `hyperparameters/`."""
    return shipped_toml("agents.training", f"hyperparameters/{name}.toml")


#: What is known of each setting, by `Settings.section` and name.
KNOWN = hyperparameters("settings")


@dataclass(frozen=True)
class Settings:
    """What all algorithms have; a decision lasts `action_repeat` control intervals."""

    section: ClassVar[str] = (
        "all"  # of `hyperparameters/settings.toml`, which says what each setting is
    )

    total_steps: int
    evaluate_every: int
    ships: int
    batch_size: int
    learning_rate: float
    schedule: str
    gamma: float
    net_arch: tuple[int, ...]
    activation: str
    frame_stack: int
    action_repeat: int
    base: str
    authority: float
    rate_limit: float = field(default=2.0, kw_only=True)
    model_uncertainty: str = field(default="none", kw_only=True)
    reward_scale: float | str

    def __post_init__(self) -> None:
        for one in fields(self):
            object.__setattr__(
                self,
                one.name,
                _checked(getattr(self, one.name), one, self.allowed(one.name)),
            )
        if not check_text(self.base, "base").endswith(".json"):
            check_choice(self.base, ("none", "tuned", *controller_kinds()), "base")
        if self.base == "none" and self.authority != 1.0:
            raise InputError(
                f"authority: {self.authority:g} found without a base, expected 1, or a"
                " base"
            )
        self._check_together()

    def _check_together(self) -> None:
        """Refuse settings that do not fit each other."""

    @classmethod
    def allowed(cls, name: str) -> dict[str, Any]:
        """What is allowed for a setting beside its type, as in `hyperparameters/settings.toml`."""
        tables = (
            KNOWN[kind.section] for kind in cls.__mro__ if issubclass(kind, Settings)
        )
        known = next(table[name] for table in tables if name in table)
        return {key: value for key, value in known.items() if key != "meaning"}

    @property
    def rollout(self) -> int:
        """Decisions of all ships between two updates; a training has whole ones."""
        return self.ships * int(vars(self).get("n_steps") or vars(self)["train_freq"])

    def to_dict(self) -> dict[str, Any]:
        """The settings by name, ready for JSON."""
        return dict(as_json(self))


@dataclass(frozen=True)
class PPOSettings(Settings):
    """Proximal policy optimisation (Schulman et al. 2017, arXiv:1707.06347)."""

    section: ClassVar[str] = "ppo"

    n_steps: int
    n_epochs: int
    gae_lambda: float
    clip_range: float
    ent_coef: float
    vf_coef: float
    max_grad_norm: float
    log_std_init: float
    log_std_end: float | str

    def _check_together(self) -> None:
        samples = self.ships * self.n_steps
        if samples % self.batch_size or self.batch_size < 2:
            raise InputError(
                f"batch_size: {self.batch_size} found, expected a divisor above 1 of"
                f" ships x n_steps, {samples}"
            )


@dataclass(frozen=True)
class OffPolicySettings(Settings):
    """What the algorithms have that learn from a replay buffer."""

    section: ClassVar[str] = "off-policy"

    buffer_size: int
    learning_starts: int
    train_freq: int
    gradient_steps: int
    tau: float
    critic_arch: tuple[int, ...]

    def _check_together(self) -> None:
        if self.buffer_size < self.ships:
            raise InputError(
                f"buffer_size: {self.buffer_size} found, expected one for each of"
                f" {self.ships} ships at least"
            )


@dataclass(frozen=True)
class SACSettings(OffPolicySettings):
    """Soft actor-critic (Haarnoja et al. 2018, arXiv:1812.05905)."""

    section: ClassVar[str] = "sac"

    ent_coef: float | str
    target_entropy: float | str


@dataclass(frozen=True)
class TD3Settings(OffPolicySettings):
    """Twin delayed deep deterministic policy gradient (Fujimoto et al. 2018, arXiv:1802.09477)."""

    section: ClassVar[str] = "td3"

    action_noise: float
    policy_delay: int
    target_policy_noise: float
    target_noise_clip: float


@dataclass(frozen=True)
class TQCSettings(SACSettings):
    """Truncated quantile critics (Kuznetsov et al. 2020, arXiv:2005.04269)."""

    section: ClassVar[str] = "tqc"

    n_critics: int
    n_quantiles: int
    top_quantiles_to_drop: int

    def _check_together(self) -> None:
        super()._check_together()
        if self.top_quantiles_to_drop >= self.n_quantiles:
            raise InputError(
                f"top_quantiles_to_drop: {self.top_quantiles_to_drop} found, expected"
                f" fewer than n_quantiles = {self.n_quantiles}"
            )


#: Settings by algorithm.
ALGORITHMS: Mapping[str, type[Settings]] = {
    "ppo": PPOSettings,
    "sac": SACSettings,
    "td3": TD3Settings,
    "tqc": TQCSettings,
}


def _checked(value: Any, one: Field[Any], allowed: dict[str, Any]) -> Any:
    """The value of a setting, if its type and bounds allow it."""
    name = one.name
    if one.type is int:
        return check_whole(value, name, **allowed)
    if one.type is float:
        return check_number(value, name, **allowed)
    if one.type == WIDTHS:
        if isinstance(value, str) or not isinstance(value, Sequence):
            raise InputError(
                f"{name}: {value!r} found, expected widths of layers, such as [64, 64]"
            )
        return tuple(check_whole(width, name, **allowed) for width in value)
    if one.type == NUMBER_OR_WORD:
        return _number_or_word(value, name, allowed)
    return check_choice(value, allowed["options"], name) if allowed else value


def _number_or_word(value: Any, name: str, allowed: dict[str, Any]) -> Any:
    """A number, or a word; one that ends in an underscore has a positive number after it, or neither."""
    word = allowed.pop("word")
    alone = word.rstrip("_")
    if value == alone:
        return value
    if word != alone and isinstance(value, str) and value.startswith(word):
        try:
            check_number(float(value.removeprefix(word)), name, above=0.0)
        except (ValueError, InputError):
            said = (
                f"{name}: {value!r} found, expected a number, '{alone}' or such as"
                f" '{word}0.1'"
            )
            raise InputError(said) from None
        return value
    return check_number(value, name, **allowed, hint=f"or '{alone}'")


def load_settings(
    algorithm: str,
    environment: str = "course-keeping",
    task: str = "",
    given: Mapping[str, Any] | None = None,
    action: str = "rudder",
    suite: str = "",
) -> Settings:
    """The tuned settings of an algorithm, with those given by name replaced.

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
        Settings by name that go before the tuned ones.
    action : {"rudder", "rudder-discrete", "rudder-shaft"}
        What is commanded. With others than the rudder, or `base` given as "none", a
        policy learns from scratch.
    """
    check_choice(algorithm, ALGORITHMS, "algorithm")
    if not environment.endswith(".py"):
        check_choice(environment, SHORT_NAMES, "environment")
    check_choice(action, ACTIONS, "action")
    content = hyperparameters(algorithm)
    chosen = dict(content["defaults"])
    if action == "rudder" and (given or {}).get("base") != "none":
        chosen |= content["residual"].get(environment, {})
        if suite in content["suites"]:
            chosen |= content["suites"][suite]
            chosen |= content.get("tasks", {}).get(task, {})
    return make_settings(algorithm, chosen | dict(given or {}))


def settings_of(algorithm: str) -> type[Settings]:
    """The class of an algorithm's settings; InputError for an unknown one, with the nearest known one."""
    return ALGORITHMS[check_choice(algorithm, ALGORITHMS, "algorithm")]


def make_settings(algorithm: str, values: Mapping[str, Any]) -> Settings:
    """Settings by name, all of them; InputError for one unknown or missing, or a value out of its range."""
    kind, where = settings_of(algorithm), f"settings of {algorithm}"
    table = _settings(values, kind, where)
    check_keys(
        table,
        table,
        where,
        [one.name for one in fields(kind) if one.default is MISSING],
    )
    return kind(**table)


def changed(settings: Settings, given: Mapping[str, Any]) -> Settings:
    """The settings with some replaced; InputError for an unknown one, or a value out of its range."""
    return replace(settings, **_settings(given, type(settings), "settings"))


def read_settings_file(path: Path, algorithm: str) -> dict[str, Any]:
    """Settings in a user's own TOML file; InputError if it cannot be read, or names an unknown setting."""
    return _settings(
        read_toml(path, "settings file"), settings_of(algorithm), str(path)
    )


def _settings(value: Any, kind: type[Settings], where: str) -> dict[str, Any]:
    """A table that names settings only; whole numbers stand for decimal ones."""
    table = check_table(value, where)
    types = {one.name: one.type for one in fields(kind)}
    check_keys(table, tuple(types), where)
    return {
        name: (
            float(given)
            if types[name] in (float, NUMBER_OR_WORD) and type(given) is int
            else given
        )
        for name, given in table.items()
    }
