"""The options of an identification, each said once: its name, kind of value, default, bounds and meaning.

They are the keywords of `identification.identify`, the keys of the table [identify] of a ship file, the
options of `shipgym identify` and the tables of `docs/identification.md`: all are made from `Options`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from numbers import Real
from typing import Any

from shipgym.checks import (
    check_choice,
    check_keys,
    check_number,
    check_table,
    check_text,
    did_you_mean,
    quoted,
)
from shipgym.errors import InputError

AUTO = "auto"  # the structure where a ship file names none: ranked by trials held out
TEXT, FLAG, NUMBER, WHOLE = "a text", "true or false", "a number", "a whole number"
TEXTS, TWO_NUMBERS = "a list of texts", "a list of two numbers"
WHOLE_OR_TEXT, TEXT_OR_TABLE = "a whole number or a text", "a text or a table"


@dataclass(frozen=True)
class Option:
    """What is known of an option."""

    section: str  # part of the documentation that it belongs to
    kind: str  # a key of `KINDS`; in Python some options take objects besides
    meaning: str  # what it sets, as the help of the command line says it
    # meaning of each value that it may have; empty where there is no fixed set of them
    choices: Mapping[str, str] = field(default_factory=dict)
    bounds: Mapping[str, Any] = field(default_factory=dict)  # keywords of `shipgym.checks.check_number`
    # whether it belongs to the method, which has a default of its own, and not to `identify`
    setting: bool = False
    # whether the command line has it by name; the others are given as `--set NAME=VALUE`
    common: bool = False


def _option(
    section: str,
    kind: str,
    meaning: str,
    default: Any = None,
    choices: Mapping[str, str] | None = None,
    setting: bool = False,
    common: bool = False,
    **bounds: float,
) -> Any:
    """A field of `Options`."""
    told = Option(section, kind, meaning, choices or {}, bounds, setting, common)
    return field(default=default, metadata={"option": told})


_trials, _model = partial(_option, "trials"), partial(_option, "model")
_samples = partial(_option, "regression")
_method = partial(_option, "method")
_fit = partial(_option, "method", setting=True)
_recursive = partial(_option, "recursive", setting=True)
_rm_svm = partial(_option, "rm-svm", setting=True)
_search = partial(_option, "tuning", setting=True)
_refinement = partial(_option, "refinement", setting=True)
_uncertainty, _prior = partial(_option, "uncertainty"), partial(_option, "prior")


@dataclass(frozen=True, eq=False, kw_only=True)
class Options:
    """The options of `identify`; each field says in its metadata what it is.

    Settings of the method are None where they were not given: the method has defaults of its own. Raises
    InputError for an unknown uncertainty, and for settings of a prior without one.
    """

    structure: Any = _model(TEXT, "terms of the model; auto: by trials held out", "abkowitz", common=True)
    name: str | None = _model(TEXT, "name of the model; by default that of the ship")
    service_shaft_speed: float | None = _model(
        NUMBER, "shaft speed at service speed, 1/s; by default that at the start of the trials", above=0.0
    )
    reference_model: Any = _model(
        TEXT, "reference ship of a grey box or of the prior of `mmg`: auto (the one most like this ship), a "
        "name, or a file",
        common=True,
    )  # fmt: skip

    hold_out: Sequence[str] = _trials(
        TEXTS, "trials that are predicted only, by file, as if they were marked validate", (), common=True
    )
    extra_trials: Sequence[Any] | None = _trials(
        TEXTS, "files of trials that only the refinement (output-error) sees, such as turns of another ship",
        setting=True,
    )  # fmt: skip
    extra_weight: float | None = _trials(
        NUMBER, "weight of their squared residuals; by default 1", setting=True, above=0.0
    )

    current: Any = _trials(
        TEXT_OR_TABLE, "steady current in velocities over ground, or a known one as a table of m/s, such as "
        "`{ north = 0.2, east = -0.1 }`; columns current_north and current_east come first",
        "auto", common=True, choices={
            "auto": "estimated, one of all trials unless these contradict it, and taken out where it differs "
            "from zero",
            "shared": "one of all trials, taken out", "trial": "one of each trial, taken out",
            "none": "left in the velocities",
        },
    )  # fmt: skip
    wind: Any = _trials(
        TEXT_OR_TABLE, "force of the wind in columns wind_speed and wind_from, by `shipgym.sea`'s names of "
        "coefficients, or a table such as `{ coefficients = \"isherwood\", relative = true }`, relative for "
        "a wind felt on board, from the bow", "auto", common=True, choices={
            "auto": "by Blendermann's coefficients, where wind was logged", "none": "not taken out",
            "constant": "a constant sway and yaw acceleration of each trial fitted",
        },
    )  # fmt: skip

    samples: str = _samples(
        TEXT, "how a trial becomes a regression", "spline", common=True, choices={
            "spline": "Gauss quadrature on splines through the samples, broken at corners of the rudder",
            "integral": "trapezoid rule over each window (ISSI of Cao 2015)",
            "euler": "start of each step (ESSI of Cao 2015); biased at long steps",
        },
    )  # fmt: skip
    window: int | None = _samples(
        WHOLE, "sampling steps over which velocities are integrated; by default 1 without noise, else as the "
        "noise asks", at_least=1,
    )  # fmt: skip
    smooth: bool = _samples(FLAG, "whether noisy channels are smoothed first", True)
    preprocessing: str | None = _samples(
        TEXT, "how noisy channels are smoothed; by default by splines", common=True, choices={
            "spline": "smoothing splines by the noise level",
            "savgol": "Savitzky-Golay",
            "median": "running median",
            "rts": "Kalman filter and Rauch-Tung-Striebel smoother, with position and heading",
            "none": "as recorded",
        },
    )  # fmt: skip
    repair: bool = _samples(
        FLAG, "whether outliers are replaced and dropouts of up to 10 steps filled first; the provenance "
        "counts them", False, common=True,
    )  # fmt: skip

    method: Any = _method(TEXT, "how the coefficients are fitted", "tls-svm", common=True)
    guarded: bool = _method(
        FLAG, "whether a model that runs away in a hard turn is fitted again with the weakest penalty on "
        "what is large there and invisible in the data", True,
    )  # fmt: skip
    C: float | None = _fit(NUMBER, "weight of the errors; inf is least squares", common=True, at_least=0.0)
    alpha: float | None = _fit(NUMBER, "penalty of ridge regression", at_least=0.0)
    epsilon: float | None = _fit(NUMBER, "errors that a support vector machine does not see", at_least=0.0)
    scale: Any = _fit(FLAG, "whether features are scaled to one size before the penalty")
    robust: bool | None = _fit(FLAG, "whether outliers lose their influence (weighted LS-SVM)")
    rank: int | None = _fit(WHOLE, "directions of the features that are kept", common=True, at_least=1)
    selection: str | None = _fit(
        TEXT, "how the rank is chosen where it is not given", choices={
            "l-curve": "the corner of the L-curve",
            "gcv": "generalised cross-validation",
            "explained-variance": "as many directions as hold the share `explained_variance`",
            "full": "every direction that rounding leaves",
        },
    )  # fmt: skip
    explained_variance: float | None = _fit(
        NUMBER, "share of the variance of the features that the rank keeps", above=0.0, at_most=1.0
    )

    forgetting: float | None = _recursive(
        NUMBER, "factor by which older samples count less at each step", above=0.0, at_most=1.0
    )
    innovations: int | None = _recursive(WHOLE, "samples that a multi-innovation step uses", at_least=1)
    omega: float | None = _recursive(
        NUMBER, "slope of the nonlinear innovation tanh(omega e) / omega; 0 keeps it linear", at_least=0.0
    )
    inverse_free: bool | None = _recursive(FLAG, "whether multi-innovation steps avoid a matrix inverse")
    start_samples: int | None = _recursive(
        WHOLE, "samples of the LS-SVR that a recursive method starts from", at_least=0
    )
    start_interval: int | None = _recursive(WHOLE, "take every n-th sample for that start", at_least=1)
    start_C: float | None = _recursive(NUMBER, "weight of the errors of that start", above=0.0)

    regression: str | None = _rm_svm(
        TEXT, "regression of RM-SVM", choices={
            "svr": "epsilon-SVR", "ls-svm": "LS-SVM, as the Lagrangian of the paper has it"
        },
    )  # fmt: skip
    kernel: str | None = _rm_svm(
        TEXT, "kernel of an LS-SVM on what a reference ship leaves: that of `grey-box`, the fitted model of "
        "the structure named, or, as a black box, a linear one", common=True, choices={
            "rbf": "radial basis functions on a few centres (fixed-size LS-SVM); fades outside its data",
        },
    )  # fmt: skip
    centres: int | None = _rm_svm(
        WHOLE, "of these functions, by default 64, at most 100", at_least=2, at_most=100
    )
    kernel_length: float | None = _rm_svm(
        NUMBER, "of these functions, in root mean squares of the data; by default by trials held out, as `C`",
        above=0.0,
    )  # fmt: skip
    free_constant: bool | None = _rm_svm(
        FLAG, "whether the constant is left without a penalty, as in the paper"
    )
    constant: int | None = _rm_svm(WHOLE, "column of that constant, which `identify` finds by itself")

    objective: str | None = _search(
        TEXT, "what a search makes small", common=True, choices={
            "k-fold": "error of blocks of time held out; the default",
            "free-running": "error of the simulated trials: slower, and what counts in the end",
            "training": "error on the samples fitted (Zhu 2018): its optimum is the upper bound of C",
            "rmse": "of `rm-svm`: error of the simulated heading; its default",
            "correlation": "of `rm-svm`: correlation of simulated and measured heading, as in the paper",
        },
    )  # fmt: skip
    folds: int | str | None = _search(
        WHOLE_OR_TEXT, "number of blocks of time held out", choices={
            "trials": "each trial in turn", "largest-rudder": "of `rm-svm`: the trials of the largest rudder",
        },
    )  # fmt: skip
    bounds: tuple[float, float] | None = _search(TWO_NUMBERS, "least and largest C of a search")
    optimiser: Any = _search(
        TEXT_OR_TABLE, "what searches; with its settings as a table, such as "
        '`{ name = "pso", particles = 30, rounds = 40 }`', choices={
            "abc": "artificial bee colony", "pso": "particle swarm", "de": "differential evolution",
            "grid": "logarithmic grid, refined",
        },
    )  # fmt: skip
    seed: int | None = _search(WHOLE, "the same seed gives the same search", at_least=0)

    segment_lengths: float | None = _refinement(
        NUMBER, "ship lengths sailed at service speed in a segment of the refinement", above=0.0
    )
    staggered: bool | None = _refinement(FLAG, "whether a second set of segments begins half a segment later")
    segment_start: str | None = _refinement(
        TEXT, "where a segment starts", choices={
            "free": "at a state that is fitted with it, which leaves no bias by noise",
            "measured": "at the smoothed measurement",
        },
    )  # fmt: skip
    pull: float | None = _refinement(NUMBER, "strength of the pull toward the start", at_least=0.0)
    rudder_offsets: bool | None = _refinement(
        FLAG, "whether the zero of the rudder differs between the trials"
    )
    anchor: Any = _refinement(
        TEXT,
        "reference ship whose turning circles at this ship's scale are fitted too: auto, a name, or a file",
    )
    anchor_weight: float | None = _refinement(
        NUMBER, "weight of the squared residuals of those turns", above=0.0
    )

    uncertainty: str = _uncertainty(
        TEXT, "where the covariance of the coefficients comes from", "analytic", common=True, choices={
            "analytic": "the residuals, correlated over the time to sail one ship length and between the "
            "equations",
            "bootstrap": "refits to blocks of that time drawn with replacement",
        },
    )  # fmt: skip

    model_error: bool = _uncertainty(
        FLAG, "whether the covariance is scaled until trials left out in turn are predicted within it", True
    )

    prior: Any = _prior(
        TEXT, "what the coefficients are pulled to: a reference ship at this ship's scale (auto, a name or a "
        "file), or the regression formulas clarke or kijima; of `mmg` yoshimura (its default) or kijima",
        common=True,
    )  # fmt: skip
    prior_strength: float | None = _prior(
        NUMBER, "strength of that pull: 0 for none, inf for the prior itself; of `mmg` by what its standard "
        "deviations are divided; by default by cross-validation",
        common=True, at_least=0.0,
    )  # fmt: skip
    prior_folds: str = _prior(
        TEXT, "what the cross-validation holds out", "trials", choices={
            "trials": "each trial in turn", "largest-rudder": "the trials of the largest rudder",
        },
    )  # fmt: skip

    def __post_init__(self) -> None:
        check_choice(self.uncertainty, OPTIONS["uncertainty"].choices, "uncertainty")
        for name, unset in (("prior_strength", None), ("prior_folds", "trials")):
            found = getattr(self, name)
            if self.prior is None and found != unset and self.structure != "mmg":
                raise InputError(f"{name}: {found!r} found without a prior; name one, or leave it out")

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Options:
        """Options by name; InputError for an unknown name."""
        for name in given:
            if name not in OPTIONS:
                hint = did_you_mean(name, OPTIONS) or f" Options: {quoted(OPTIONS)}"
                raise InputError(f"{name}: identify has no such option.{hint}")
        return cls(**given)

    def settings(self) -> dict[str, Any]:
        """The settings of the method that were given."""
        return {
            name: value
            for name, option in OPTIONS.items()
            if option.setting and (value := getattr(self, name)) is not None
        }

    def own(self) -> dict[str, Any]:
        """The options of `identify` itself."""
        return {name: getattr(self, name) for name, option in OPTIONS.items() if not option.setting}


#: Every option by name.
OPTIONS: dict[str, Option] = {item.name: item.metadata["option"] for item in fields(Options)}


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


#: How each kind of value is recognised in a file; the words stand in messages.
KINDS: dict[str, Callable[[Any], bool]] = {
    TEXT: _is_text,
    FLAG: lambda value: isinstance(value, bool),
    NUMBER: _is_number,
    WHOLE: _is_whole,
    TEXTS: lambda value: isinstance(value, list) and all(map(_is_text, value)),
    TWO_NUMBERS: lambda value: isinstance(value, list) and len(value) == 2 and all(map(_is_number, value)),
    WHOLE_OR_TEXT: lambda value: _is_whole(value) or _is_text(value),
    TEXT_OR_TABLE: lambda value: _is_text(value) or isinstance(value, Mapping),
}


def check_options(table: Any, where: str) -> dict[str, Any]:
    """Check names, kinds and bounds of options; which of them fit together is known to the methods.

    Raises InputError, which begins with `where` (``"ship.toml: [identify]"``), for an unknown option, a value
    of another kind or out of bounds.
    """
    options = check_table(table, where)
    check_keys(options, OPTIONS, where)
    for name, value in options.items():
        option = OPTIONS[name]
        if option.kind == TEXT:
            check_text(value, f"{where} {name}")
        if not KINDS[option.kind](value):
            raise InputError(f"{where} {name}: {value!r} found, expected {option.kind}: {option.meaning}")
        if option.bounds and (value != float("inf") or "at_most" in option.bounds):
            check_number(value, f"{where} {name}", **option.bounds)
    return dict(options)
