"""Settings of learning: one frozen dataclass an algorithm, read from TOML as docs/training.md says.

The files in `hyperparameters/` have the tuned ones, later tables before earlier ones: `defaults`, every
setting of the algorithm to learn from scratch; those that differ beside a base in an environment
(`residual`), on every task of a suite (`suites`), on one of them (`tasks`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, asdict, dataclass, field, fields, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from agents.controllers.registry import controller_kinds
from agents.suites.suite import ENVIRONMENTS, suite_of
from shipgym.checks import check_choice, check_keys, check_number, check_table, check_text, check_whole
from shipgym.errors import InputError
from shipgym.files import named_values, parse_toml, read_toml
from shipgym.tasks.task import ACTIONS

RENAMED = {"history": "frame_stack", "hold": "action_repeat"}  # older names that are still taken
RUNNING, LEARNED, AUTO = "running", "learned", "auto"
NUMBER_OR_WORD, WIDTHS = "float | str", "tuple[int, ...]"  # types of settings


def setting(default: Any = MISSING, **allowed: Any) -> Any:
    """A setting and what is allowed: bounds of `check_number`, a `word` for a number, or `options`.

    `default`: of one that older runs and files of settings do not have.
    """
    return field(metadata=allowed, default=default, kw_only=default is not MISSING)


@dataclass(frozen=True)
class Settings:
    """What all algorithms have; a decision lasts `action_repeat` control intervals."""

    #: Decisions to learn from, of all ships together.
    total_steps: int = setting(at_least=1)
    #: Decisions between evaluations.
    evaluate_every: int = setting(at_least=1)
    #: Ships that sail at once.
    ships: int = setting(at_least=1)
    #: Samples of one gradient step.
    batch_size: int = setting(at_least=1)
    #: Learning rate of Adam at the beginning.
    learning_rate: float = setting(above=0.0, at_most=1.0)
    #: How the learning rate goes on; linear falls to 0 at the end of the training.
    schedule: str = setting(options=("constant", "linear"))
    #: Discount of a decision.
    gamma: float = setting(at_least=0.0, at_most=1.0)
    #: Widths of the hidden layers of the policy, and of PPO's value.
    net_arch: tuple[int, ...] = setting(at_least=1)
    #: Function between the layers.
    activation: str = setting(options=("relu", "tanh"))
    #: Observations that the policy sees, the newest last.
    frame_stack: int = setting(at_least=1)
    #: Control intervals of a decision; a base goes on with its feedback in each of them.
    action_repeat: int = setting(at_least=1)
    #: Classical controller that the policy adds to: a kind, a controller's file that ends in .json, "none",
    #: or "tuned", the best of those tuned for the suite's task (but `designs.NO_BASES`).
    base: str = setting()
    #: Share of the action's range by which it may differ from the base; 1 without a base.
    authority: float = setting(above=0.0, at_most=2.0)
    #: Largest change of the output in force in a control interval, so that the rudder does not jump where a
    #: decision gives way to the next; 2 does not limit it.
    rate_limit: float = setting(above=0.0, at_most=2.0, default=2.0)
    #: Whether the ships that learn are drawn from the model's covariance; evaluation is on the model itself.
    #: Unlike `--randomise` it leaves seas and speeds as the task has them.
    model_uncertainty: str = setting(options=("none", "covariance"), default="none")
    #: What rewards are divided by before they are limited to [-10, 10]; "running" is the standard deviation
    #: of their discounted sum so far.
    reward_scale: float | str = setting(above=0.0, word=RUNNING)

    def __post_init__(self) -> None:
        for one in fields(self):
            object.__setattr__(self, one.name, _checked(getattr(self, one.name), one))
        if not check_text(self.base, "base").endswith(".json"):
            check_choice(self.base, ("none", "tuned", *controller_kinds()), "base")
        if self.base == "none" and self.authority != 1.0:
            raise InputError(f"authority: {self.authority:g} found without a base, expected 1, or a base")
        self._check_together()

    def _check_together(self) -> None:
        """Refuse settings that do not fit each other."""

    def to_dict(self) -> dict[str, Any]:
        """The settings by name, ready for JSON."""
        pairs = asdict(self).items()
        return {name: list(value) if isinstance(value, tuple) else value for name, value in pairs}


@dataclass(frozen=True)
class PPOSettings(Settings):
    """Proximal policy optimisation (Schulman et al. 2017, arXiv:1707.06347)."""

    #: Decisions of each ship in a rollout.
    n_steps: int = setting(at_least=1)
    #: How often each sample of a rollout is used.
    n_epochs: int = setting(at_least=1)
    #: Decay of the generalised advantage estimate.
    gae_lambda: float = setting(at_least=0.0, at_most=1.0)
    #: Largest change of the ratio of probabilities.
    clip_range: float = setting(above=0.0)
    #: Weight of the entropy.
    ent_coef: float = setting(at_least=0.0)
    #: Weight of the value's error.
    vf_coef: float = setting(above=0.0)
    #: Longest gradient.
    max_grad_norm: float = setting(above=0.0)
    #: Logarithm of the action's standard deviation at the beginning.
    log_std_init: float = setting(at_least=-10.0, at_most=3.0)
    #: To what it falls evenly over the training. A rudder that chatters costs more than steering does, and
    #: the policy that is best while it explores is not the one that is best without.
    log_std_end: float | str = setting(at_least=-10.0, at_most=3.0, word=LEARNED)

    def _check_together(self) -> None:
        samples = self.ships * self.n_steps
        if samples % self.batch_size or self.batch_size < 2:
            raise InputError(
                f"batch_size: {self.batch_size} found, expected a divisor above 1 of ships x n_steps, "
                f"{samples}"
            )


@dataclass(frozen=True)
class OffPolicySettings(Settings):
    """What the algorithms have that learn from a replay buffer."""

    #: Decisions that are remembered.
    buffer_size: int = setting(at_least=1)
    #: Decisions of all ships under random actions before learning begins.
    learning_starts: int = setting(at_least=0)
    #: Decisions of all ships between updates.
    train_freq: int = setting(at_least=1)
    #: Gradient steps of an update.
    gradient_steps: int = setting(at_least=1)
    #: Share by which the target network approaches the critic in an update.
    tau: float = setting(above=0.0, at_most=1.0)
    #: Widths of the hidden layers of the critics.
    critic_arch: tuple[int, ...] = setting(at_least=1)

    def _check_together(self) -> None:
        if self.buffer_size < self.ships:
            raise InputError(
                f"buffer_size: {self.buffer_size} found, expected one for each of {self.ships} ships at least"
            )


@dataclass(frozen=True)
class SACSettings(OffPolicySettings):
    """Soft actor-critic (Haarnoja et al. 2018, arXiv:1812.05905)."""

    #: Weight of the entropy; "auto" or "auto_0.1" adapts it, from that value.
    ent_coef: float | str = setting(at_least=0.0, word="auto_")
    #: Entropy that it is adapted to; "auto" is -1 for each command. One command has the standard deviation
    #: 0.09 with -1, 0.24 with 0.
    target_entropy: float | str = setting(at_most=1.0, word=AUTO)


@dataclass(frozen=True)
class TD3Settings(OffPolicySettings):
    """Twin delayed deep deterministic policy gradient (Fujimoto et al. 2018, arXiv:1802.09477)."""

    #: Standard deviation of what is added to actions to explore.
    action_noise: float = setting(above=0.0)
    #: Updates of the critics for one of the policy.
    policy_delay: int = setting(at_least=1)
    #: Standard deviation of what is added to the target's actions.
    target_policy_noise: float = setting(at_least=0.0)
    #: Largest value of it.
    target_noise_clip: float = setting(at_least=0.0)


@dataclass(frozen=True)
class TQCSettings(SACSettings):
    """Truncated quantile critics (Kuznetsov et al. 2020, arXiv:2005.04269)."""

    #: Critics.
    n_critics: int = setting(at_least=1)
    #: Quantiles of each.
    n_quantiles: int = setting(at_least=1)
    #: Quantiles of each critic that are dropped, the largest.
    top_quantiles_to_drop: int = setting(at_least=0)

    def _check_together(self) -> None:
        super()._check_together()
        if self.top_quantiles_to_drop >= self.n_quantiles:
            raise InputError(
                f"top_quantiles_to_drop: {self.top_quantiles_to_drop} found, expected fewer than "
                f"n_quantiles = {self.n_quantiles}"
            )


#: Settings by algorithm.
ALGORITHMS: Mapping[str, type[Settings]] = {
    "ppo": PPOSettings, "sac": SACSettings, "td3": TD3Settings, "tqc": TQCSettings,
}  # fmt: skip


def _checked(value: Any, one: Field[Any]) -> Any:
    """The value of a setting, if its type and bounds allow it."""
    allowed, name = dict(one.metadata), one.name
    if one.type == "int":
        return check_whole(value, name, **allowed)
    if one.type == "float":
        return check_number(value, name, **allowed)
    if one.type == WIDTHS:
        if isinstance(value, str) or not isinstance(value, Sequence):
            raise InputError(f"{name}: {value!r} found, expected widths of layers, such as [64, 64]")
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
            said = f"{name}: {value!r} found, expected a number, '{alone}' or such as '{word}0.1'"
            raise InputError(said) from None
        return value
    return check_number(value, name, **allowed, hint=f"or '{alone}'")


def load_settings(
    algorithm: str,
    environment: str = "course-keeping",
    task: str = "",
    given: Mapping[str, Any] | None = None,
    action: str = "rudder",
) -> Settings:
    """The tuned settings of an algorithm, with those given by name replaced.

    `environment`: "course-keeping" or "path-following"; `task`: name of a suite's task; one without settings
    of its own has those of its environment; `action`: what is commanded. With other actions than the rudder,
    or `base` given as "none", a policy learns from scratch. Raises InputError for an unknown algorithm or
    setting, with the nearest known one, or a value out of its range.
    """
    settings_of(algorithm)
    check_choice(environment, ENVIRONMENTS, "environment")
    check_choice(action, ACTIONS, "action")
    content = hyperparameters(algorithm)
    chosen = dict(content["defaults"])
    if action == "rudder" and (given or {}).get("base") != "none":
        followed = environment.removesuffix("-v1")
        for table, name in (("residual", followed), ("suites", suite_of(task)), ("tasks", task)):
            chosen |= content.get(table, {}).get(name, {})
    return make_settings(algorithm, chosen | dict(given or {}))


def hyperparameters(name: str) -> dict[str, Any]:
    """The content of a file of `hyperparameters/`."""
    file = files("agents.training").joinpath("hyperparameters", f"{name}.toml")
    return parse_toml(file.read_text("utf-8"), f"{file}:")


def settings_of(algorithm: str) -> type[Settings]:
    """The class of an algorithm's settings; InputError for an unknown one, with the nearest known one."""
    return ALGORITHMS[check_choice(algorithm, ALGORITHMS, "algorithm")]


def make_settings(algorithm: str, values: Mapping[str, Any]) -> Settings:
    """Settings by name, all of them.

    Raises InputError for an unknown one, one that is missing, or a value out of its range.
    """
    kind, where = settings_of(algorithm), f"settings of {algorithm}"
    table = _settings(values, kind, where)
    check_keys(table, table, where, [one.name for one in fields(kind) if one.default is MISSING])
    return kind(**table)


def changed(settings: Settings, given: Mapping[str, Any]) -> Settings:
    """The settings with others in the place of some.

    Raises InputError for an unknown one, or a value out of its range.
    """
    return replace(settings, **_settings(given, type(settings), "settings"))


def read_settings_file(path: Path, algorithm: str) -> dict[str, Any]:
    """Settings in a TOML file of a user's own.

    Raises InputError if it cannot be read, or names an unknown setting.
    """
    return _settings(read_toml(path, "settings file"), settings_of(algorithm), str(path))


def parsed_settings(texts: Sequence[str], where: str = "--set") -> dict[str, Any]:
    """Settings of the command line, `name=value` with a value as in TOML; anything else is text.

    Raises InputError for one that is written otherwise.
    """
    return named_values(texts, where, "gamma=0.98")


#: What settings mean that older runs do not have.
LATER = {one.name: one.default for one in fields(Settings) if one.default is not MISSING}


def present_names(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by their present names, where some have older ones."""
    return {RENAMED.get(name, name): value for name, value in settings.items()}


def _settings(value: Any, kind: type[Settings], where: str) -> dict[str, Any]:
    """A table that names settings only; whole numbers stand for decimal ones."""
    table = present_names(check_table(value, where))
    types = {one.name: one.type for one in fields(kind)}
    check_keys(table, tuple(types), where)
    return {
        name: float(given) if types[name] in ("float", NUMBER_OR_WORD) and type(given) is int else given
        for name, given in table.items()
    }
