"""Settings of learning: one frozen dataclass an algorithm, read from TOML.

The files in `hyperparameters/` hold the tuned ones, later tables before earlier ones:

    [defaults]                          # every setting of the algorithm, to learn from nothing
    [residual.path-following]           # those that differ there beside a base, by default for the rudder
    [suite]                             # those that differ on every task of the suite
    [tasks.mariner-rough]               # those that differ on one of them

A file of a user's own, and `--set`, name settings without tables.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar, get_type_hints

from agents.suites.suite import ENVIRONMENTS, load_suite
from shipgym.checks import check_choice, check_keys, check_number, check_table, check_text, check_whole
from shipgym.envs.task import ACTIONS
from shipgym.errors import InputError

SCHEDULES = ("constant", "linear")
RUNNING, LEARNED, AUTO = "running", "learned", "auto"
ACTIVATIONS = ("relu", "tanh")
#: Classical controllers that a policy may add to, by name; "tuned" is the best of those tuned for the suite's
#: task (but `designs.NO_BASES`), and a path that ends in .json is a controller's file.
BASES = (
    "none", "tuned", "pid", "pid-filtered", "lq", "lqg", "lq-scheduled", "lq-adaptive", "mpc", "los", "ilos",
    "alos",
)  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """What all algorithms have.

    Attributes
    ----------
    total_steps : int
        Decisions to learn from, of all ships together; each lasts `hold` control intervals.
    evaluate_every : int
        Decisions between evaluations.
    ships : int
        That sail at once.
    batch_size : int
        Samples of one gradient step.
    learning_rate : float
        Of Adam, at the beginning.
    schedule : {"constant", "linear"}
        How the learning rate goes on; linear falls to 0 at the end of the training.
    gamma : float
        Discount of a decision.
    net_arch : tuple of int
        Widths of the hidden layers of the policy, and of PPO's value.
    activation : {"relu", "tanh"}
        Between the layers.
    history : int
        Observations that the policy is shown, the newest last.
    hold : int
        Control intervals of a decision; a base goes on with its feedback in each of them.
    base : str
        Controller that the policy adds to, one of `BASES` or a controller's file.
    authority : float
        Share of the action's range by which it may differ from the base; 1 without a base.
    reward_scale : float or "running"
        What rewards are divided by before they are limited to [-10, 10]; "running" is the deviation of their
        discounted sum so far.
    """

    total_steps: int
    evaluate_every: int
    ships: int
    batch_size: int
    learning_rate: float
    schedule: str
    gamma: float
    net_arch: tuple[int, ...]
    activation: str
    history: int
    hold: int
    base: str
    authority: float
    reward_scale: float | str

    #: Least value of whole numbers, and bounds of others.
    WHOLE: ClassVar[dict[str, int]] = {
        "total_steps": 1, "evaluate_every": 1, "ships": 1, "batch_size": 1, "history": 1,
        "hold": 1,
    }  # fmt: skip
    NUMBERS: ClassVar[dict[str, dict[str, Any]]] = {
        "learning_rate": {"above": 0.0, "at_most": 1.0},
        "gamma": {"at_least": 0.0, "at_most": 1.0},
        "authority": {"above": 0.0, "at_most": 2.0},
    }
    CHOICES: ClassVar[Mapping[str, Sequence[str]]] = {"schedule": SCHEDULES, "activation": ACTIVATIONS}
    WIDTHS: ClassVar[tuple[str, ...]] = ("net_arch",)

    def __post_init__(self) -> None:
        for name, least in self.WHOLE.items():
            check_whole(getattr(self, name), name, at_least=least)
        for name, bounds in self.NUMBERS.items():
            object.__setattr__(self, name, check_number(getattr(self, name), name, **bounds))
        for name, words in self.CHOICES.items():
            check_choice(getattr(self, name), words, name)
        for name in self.WIDTHS:
            object.__setattr__(self, name, check_widths(getattr(self, name), name))
        if self.reward_scale != RUNNING:
            check_number(self.reward_scale, "reward_scale", above=0.0, hint=f"or '{RUNNING}'")
        if not check_text(self.base, "base").endswith(".json"):
            check_choice(self.base, BASES, "base")
        if self.base == "none" and self.authority != 1.0:
            raise InputError(f"authority: {self.authority:g} found without a base, expected 1, or a base")
        self._check_rollout()

    def _check_rollout(self) -> None:
        """Refuse settings that do not go together."""

    def to_dict(self) -> dict[str, Any]:
        """The settings by name, ready for JSON."""
        return {name: list(value) if name in self.WIDTHS else value for name, value in asdict(self).items()}


@dataclass(frozen=True)
class PPOSettings(Settings):
    """Proximal policy optimisation (Schulman et al. 2017, arXiv:1707.06347).

    Attributes
    ----------
    n_steps : int
        Decisions of each ship in a rollout.
    n_epochs : int
        How often each sample of a rollout is used.
    gae_lambda : float
        Of the generalised advantage estimate.
    clip_range : float
        Of the ratio of probabilities.
    ent_coef : float
        Weight of the entropy.
    vf_coef : float
        Weight of the value's error.
    max_grad_norm : float
        Longest gradient.
    log_std_init : float
        Logarithm of the action's deviation at the beginning.
    log_std_end : float or "learned"
        To which it falls evenly over the training. A rudder that trembles costs more than steering does, and
        what steers best while it trembles is not what steers best without.
    """

    n_steps: int
    n_epochs: int
    gae_lambda: float
    clip_range: float
    ent_coef: float
    vf_coef: float
    max_grad_norm: float
    log_std_init: float
    log_std_end: float | str

    WHOLE: ClassVar[dict[str, int]] = Settings.WHOLE | {"n_steps": 1, "n_epochs": 1}
    NUMBERS: ClassVar[dict[str, dict[str, Any]]] = Settings.NUMBERS | {
        "gae_lambda": {"at_least": 0.0, "at_most": 1.0},
        "clip_range": {"above": 0.0},
        "ent_coef": {"at_least": 0.0},
        "vf_coef": {"at_least": 0.0},
        "max_grad_norm": {"above": 0.0},
        "log_std_init": {"at_least": -10.0, "at_most": 3.0},
    }

    def _check_rollout(self) -> None:
        if self.log_std_end != LEARNED:
            check_number(self.log_std_end, "log_std_end", at_least=-10.0, at_most=3.0, hint=f"or '{LEARNED}'")
        samples = self.ships * self.n_steps
        if samples % self.batch_size or self.batch_size < 2:
            raise InputError(
                f"batch_size: {self.batch_size} found, expected a divisor above 1 of ships x n_steps, "
                f"{samples}"
            )


@dataclass(frozen=True)
class OffPolicySettings(Settings):
    """What the algorithms have that learn from a store of past steps.

    Attributes
    ----------
    buffer_size : int
        Decisions that are remembered.
    learning_starts : int
        Decisions of all ships under random actions before learning begins.
    train_freq : int
        Decisions of all ships between updates.
    gradient_steps : int
        Of an update.
    tau : float
        Share by which the target network follows.
    critic_arch : tuple of int
        Widths of the hidden layers of the critics.
    """

    buffer_size: int
    learning_starts: int
    train_freq: int
    gradient_steps: int
    tau: float
    critic_arch: tuple[int, ...]

    WHOLE: ClassVar[dict[str, int]] = Settings.WHOLE | {
        "buffer_size": 1, "learning_starts": 0, "train_freq": 1, "gradient_steps": 1,
    }  # fmt: skip
    NUMBERS: ClassVar[dict[str, dict[str, Any]]] = Settings.NUMBERS | {"tau": {"above": 0.0, "at_most": 1.0}}
    WIDTHS: ClassVar[tuple[str, ...]] = (*Settings.WIDTHS, "critic_arch")

    def _check_rollout(self) -> None:
        if self.buffer_size < self.ships:
            raise InputError(
                f"buffer_size: {self.buffer_size} found, expected one for each of {self.ships} ships at least"
            )


@dataclass(frozen=True)
class SACSettings(OffPolicySettings):
    """Soft actor-critic (Haarnoja et al. 2018, arXiv:1812.05905).

    Attributes
    ----------
    ent_coef : float or str
        Weight of the entropy; "auto" or "auto_0.1" adapts it, from that value.
    target_entropy : float or "auto"
        To what; "auto" is -1 for each command. One command deviates by 0.09 with -1, by 0.24 with 0.
    """

    ent_coef: float | str
    target_entropy: float | str

    def __post_init__(self) -> None:
        super().__post_init__()
        check_entropy(self.ent_coef)
        if self.target_entropy != AUTO:
            check_number(self.target_entropy, "target_entropy", at_most=1.0, hint=f"or '{AUTO}'")


@dataclass(frozen=True)
class TD3Settings(OffPolicySettings):
    """Twin delayed deep deterministic policy gradient (Fujimoto et al. 2018, arXiv:1802.09477).

    Attributes
    ----------
    action_noise : float
        Deviation of what is added to actions to explore.
    policy_delay : int
        Updates of the critics for one of the policy.
    target_policy_noise, target_noise_clip : float
        Deviation and largest value of what is added to the target's actions.
    """

    action_noise: float
    policy_delay: int
    target_policy_noise: float
    target_noise_clip: float

    WHOLE: ClassVar[dict[str, int]] = OffPolicySettings.WHOLE | {"policy_delay": 1}
    NUMBERS: ClassVar[dict[str, dict[str, Any]]] = OffPolicySettings.NUMBERS | {
        "action_noise": {"above": 0.0},
        "target_policy_noise": {"at_least": 0.0},
        "target_noise_clip": {"at_least": 0.0},
    }


@dataclass(frozen=True)
class TQCSettings(SACSettings):
    """Truncated quantile critics (Kuznetsov et al. 2020, arXiv:2005.04269).

    Attributes
    ----------
    n_critics, n_quantiles : int
        Critics, and quantiles of each.
    top_quantiles_to_drop : int
        Of each critic.
    """

    n_critics: int
    n_quantiles: int
    top_quantiles_to_drop: int

    WHOLE: ClassVar[dict[str, int]] = SACSettings.WHOLE | {
        "n_critics": 1, "n_quantiles": 1, "top_quantiles_to_drop": 0,
    }  # fmt: skip

    def _check_rollout(self) -> None:
        super()._check_rollout()
        if self.top_quantiles_to_drop >= self.n_quantiles:
            raise InputError(
                f"top_quantiles_to_drop: {self.top_quantiles_to_drop} found, expected fewer than "
                f"n_quantiles = {self.n_quantiles}"
            )


#: Settings by algorithm.
ALGORITHMS: Mapping[str, type[Settings]] = {
    "ppo": PPOSettings, "sac": SACSettings, "td3": TD3Settings, "tqc": TQCSettings,
}  # fmt: skip


def check_widths(value: Any, name: str) -> tuple[int, ...]:
    """Widths of a network's hidden layers, if they are some."""
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InputError(f"{name}: {value!r} found, expected widths of layers, such as [64, 64]")
    for width in value:
        check_whole(width, name, at_least=1)
    return tuple(value)


def check_entropy(value: Any) -> None:
    """Refuse a weight of the entropy that is neither a number nor "auto"."""
    if isinstance(value, str):
        word, _, start = value.partition("_")
        try:
            fine = word == "auto" and (not start or float(start) > 0.0)
        except ValueError:
            fine = False
        if not fine:
            raise InputError(f"ent_coef: {value!r} found, expected a number, 'auto' or such as 'auto_0.1'")
        return
    check_number(value, "ent_coef", at_least=0.0)


def load_settings(
    algorithm: str,
    environment: str = "course-keeping",
    task: str = "",
    given: Mapping[str, Any] | None = None,
    action: str = "rudder",
) -> Settings:
    """The tuned settings of an algorithm, with those that are given in their place.

    Parameters
    ----------
    algorithm : {"ppo", "sac", "td3", "tqc"}
    environment : {"course-keeping", "path-following"}
    task : str
        Name of a suite's task; one without settings of its own has those of its environment.
    given : mapping of str to Any, optional
        Settings by name that go before the tuned ones.
    action : {"rudder", "rudder-discrete", "rudder-shaft"}
        What is commanded. With others than the rudder, or `base` given as "none", a policy learns from
        nothing.

    Raises
    ------
    InputError
        For an unknown algorithm or setting, with the nearest known one, or a value out of its range.
    """
    kind = ALGORITHMS[check_choice(algorithm, ALGORITHMS, "algorithm")]
    check_choice(environment, ENVIRONMENTS, "environment")
    check_choice(action, ACTIONS, "action")
    where = f"hyperparameters/{algorithm}.toml"
    text = files("agents.training").joinpath("hyperparameters", f"{algorithm}.toml").read_text("utf-8")
    content = _parsed(text, where)
    check_keys(content, ("defaults", "residual", "suite", "tasks"), where)
    chosen = _settings(content.get("defaults", {}), kind, f"{where}: defaults")
    if action == "rudder" and (given or {}).get("base") != "none":
        known = any(task == one.name for one in load_suite().tasks)
        for own, table in (
            (_of(content, "residual", environment, where), f"residual.{environment}"),
            (content.get("suite", {}) if known else {}, "suite"),
            (_of(content, "tasks", task, where), f"tasks.{task}"),
        ):
            chosen |= _settings(own, kind, f"{where}: {table}")
    return make_settings(algorithm, chosen | dict(given or {}))


def _of(content: Mapping[str, Any], table: str, name: str, where: str) -> Any:
    """A table's table of that name."""
    return check_table(content.get(table, {}), f"{where}: {table}").get(name, {})


def make_settings(algorithm: str, values: Mapping[str, Any]) -> Settings:
    """Settings by name, all of them.

    Raises
    ------
    InputError
        For an unknown one, one that is missing, or a value out of its range.
    """
    kind = ALGORITHMS[check_choice(algorithm, ALGORITHMS, "algorithm")]
    table = _settings(values, kind, f"settings of {algorithm}")
    for name in _names(kind):
        if name not in table:
            raise InputError(f"settings of {algorithm}: '{name}' is missing")
    return kind(**table)


def changed(settings: Settings, given: Mapping[str, Any]) -> Settings:
    """The settings with others in the place of some.

    Raises
    ------
    InputError
        For an unknown one, or a value out of its range.
    """
    return replace(settings, **_settings(given, type(settings), "settings"))


def read_settings_file(path: Path, algorithm: str) -> dict[str, Any]:
    """Settings in a TOML file of a user's own.

    Raises
    ------
    InputError
        If it cannot be read, or names an unknown setting.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such settings file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text ({error})") from None
    kind = ALGORITHMS[check_choice(algorithm, ALGORITHMS, "algorithm")]
    return _settings(_parsed(text, str(path)), kind, str(path))


def parsed_settings(texts: Sequence[str], where: str = "--set") -> dict[str, Any]:
    """Settings of the command line, `name=value` with a value as in TOML; what is none is a text.

    Raises
    ------
    InputError
        For one that is not written so.
    """
    found: dict[str, Any] = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not name:
            raise InputError(f"{where}: {text!r} found, expected name=value, such as {where} gamma=0.98")
        try:
            found[name] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            found[name] = value
    return found


def _parsed(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{where}: not TOML: {error}") from None


def _names(kind: type[Settings]) -> tuple[str, ...]:
    return tuple(item.name for item in fields(kind))


def _settings(value: Any, kind: type[Settings], where: str) -> dict[str, Any]:
    """A table that names settings only; whole numbers stand for decimal ones."""
    table = check_table(value, where)
    check_keys(table, _names(kind), where)
    hints = get_type_hints(kind)
    decimal = {name for name in table if hints[name] in (float, float | str)}
    return {
        name: float(given) if name in decimal and type(given) is int else given
        for name, given in table.items()
    }  # fmt: skip
