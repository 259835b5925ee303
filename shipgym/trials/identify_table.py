"""The options of an identification, each said once: its name, type, default, and what else is known of it.

They are the keywords of `identification.identify`, the keys of the table [identify] of
a ship file, the options of `shipgym identify` and the tables of
`docs/identification.md`: all are made from `Options` and from `identify_table.toml`,
which says of each field what it sets and which values it may have.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, Self

from shipgym.checks import (
    check_choice,
    check_number,
    check_table,
    check_text,
    did_you_mean,
    quoted,
)
from shipgym.errors import InputError
from shipgym.files import shipped_toml

AUTO = "auto"  # the structure where a ship file names none: ranked by trials held out
TEXT, FLAG, NUMBER, WHOLE = "a text", "true or false", "a number", "a whole number"
TEXTS, TWO_NUMBERS = "a list of texts", "a list of two numbers"
WHOLE_OR_TEXT, TEXT_OR_TABLE = "a whole number or a text", "a text or a table"


@dataclass(frozen=True)
class Option:
    """What `identify_table.toml`, which explains these fields, says of an option."""

    section: str
    kind: str
    meaning: str
    choices: Mapping[str, str] = field(default_factory=dict)
    bounds: Mapping[str, Any] = field(default_factory=dict)
    setting: bool = False
    common: bool = False


#: Every option by name.
OPTIONS: dict[str, Option] = {
    name: Option(**entry)
    for name, entry in shipped_toml("shipgym.trials", "identify_table.toml").items()
}


@dataclass(frozen=True, eq=False, kw_only=True)
class Options:
    """The options of `identify`; `OPTIONS` says what each of them is.

    Settings of the method are None where they were not given: the method has defaults
    of its own. Raises InputError for an unknown uncertainty, and for settings of a
    prior without one.
    """

    structure: Any = "abkowitz"
    name: str | None = None
    service_shaft_speed: float | None = None
    reference_model: Any = None

    hold_out: Sequence[str] = ()
    extra_trials: Sequence[Any] | None = None
    extra_weight: float | None = None
    current: Any = "auto"
    wind: Any = "auto"

    samples: str = "spline"
    window: int | None = None
    smooth: bool = True
    preprocessing: str | None = None
    repair: bool = False

    method: Any = "tls-svm"
    guarded: bool = True
    C: float | None = None
    alpha: float | None = None
    epsilon: float | None = None
    scale: Any = None
    robust: bool | None = None
    rank: int | None = None
    selection: str | None = None
    explained_variance: float | None = None

    forgetting: float | None = None
    innovations: int | None = None
    omega: float | None = None
    inverse_free: bool | None = None
    start_samples: int | None = None
    start_interval: int | None = None
    start_C: float | None = None

    regression: str | None = None
    kernel: str | None = None
    centres: int | None = None
    kernel_length: float | None = None
    free_constant: bool | None = None
    constant: int | None = None

    objective: str | None = None
    folds: int | str | None = None
    bounds: tuple[float, float] | None = None
    optimiser: Any = None
    seed: int | None = None

    segment_lengths: float | None = None
    staggered: bool | None = None
    segment_start: str | None = None
    pull: float | None = None
    rudder_offsets: bool | None = None
    anchor: Any = None
    anchor_weight: float | None = None

    uncertainty: str = "analytic"
    model_error: bool = True
    prior: Any = None
    prior_strength: float | None = None
    prior_folds: str = "trials"

    def __post_init__(self) -> None:
        check_choice(self.uncertainty, OPTIONS["uncertainty"].choices, "uncertainty")
        for name, unset in (("prior_strength", None), ("prior_folds", "trials")):
            found = getattr(self, name)
            if self.prior is None and found != unset and self.structure != "mmg":
                raise InputError(
                    f"{name}: {found!r} found without a prior; name one, or leave"
                    " it out"
                )

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Self:
        """Options by name; InputError for an unknown name."""
        for name in given:
            if name not in OPTIONS:
                hint = did_you_mean(name, OPTIONS) or f" Options: {quoted(OPTIONS)}"
                raise InputError(f"{name}: identify has no such option.{hint}")
        return cls(**given)

    def settings(self) -> dict[str, Any]:
        """The settings of the method that were given."""
        given = {
            name: getattr(self, name)
            for name, option in OPTIONS.items()
            if option.setting
        }
        return {name: value for name, value in given.items() if value is not None}

    def own(self) -> dict[str, Any]:
        """The options of `identify` itself."""
        return {
            name: getattr(self, name)
            for name, option in OPTIONS.items()
            if not option.setting
        }


def _is(value: Any, *kinds: type) -> bool:
    """Whether a value is of one of some types; a truth value is no number, and a blank no text."""
    if isinstance(value, bool):
        return bool in kinds
    return isinstance(value, kinds) and not (
        isinstance(value, str) and not value.strip()
    )


#: How each kind of value is recognised in a file; the words stand in messages.
KINDS: dict[str, Callable[[Any], bool]] = {
    TEXT: lambda value: _is(value, str),
    FLAG: lambda value: _is(value, bool),
    NUMBER: lambda value: _is(value, Real),
    WHOLE: lambda value: _is(value, int),
    TEXTS: lambda value: (
        isinstance(value, list) and all(_is(one, str) for one in value)
    ),
    TWO_NUMBERS: lambda value: (
        isinstance(value, list) and [_is(one, Real) for one in value] == [True] * 2
    ),
    WHOLE_OR_TEXT: lambda value: _is(value, int, str),
    TEXT_OR_TABLE: lambda value: _is(value, str, Mapping),
}


def check_options(table: Any, where: str) -> dict[str, Any]:
    """Check names, kinds and bounds of options; which of them fit together is known to the methods.

    Raises InputError, which begins with `where` (``"ship.toml: [identify]"``), for an
    unknown option, a value of another kind or out of bounds.
    """
    options = check_table(table, where, OPTIONS)
    for name, value in options.items():
        option = OPTIONS[name]
        if option.kind == TEXT:
            check_text(value, f"{where} {name}")
        if not KINDS[option.kind](value):
            raise InputError(
                f"{where} {name}: {value!r} found, expected {option.kind}:"
                f" {option.meaning}"
            )
        if option.bounds and (value != float("inf") or "at_most" in option.bounds):
            check_number(value, f"{where} {name}", **option.bounds)
    return dict(options)
