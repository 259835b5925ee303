"""The table [identify] of a ship file: which options there are and what kind of value each takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

from shipgym.checks import check_keys, check_table, check_text
from shipgym.errors import InputError


@dataclass(frozen=True)
class Option:
    """An option of the identification.

    Attributes
    ----------
    kind : str
        A key of `KINDS`.
    meaning : str
        What it sets.
    """

    kind: str
    meaning: str


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _is_flag(value: Any) -> bool:
    return isinstance(value, bool)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(_is_text(item) for item in value)


def _are_two_numbers(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(_is_number(item) for item in value)


#: How each kind of value is recognised; the words stand in messages.
KINDS: dict[str, Callable[[Any], bool]] = {
    "a text": _is_text,
    "true or false": _is_flag,
    "a number": _is_number,
    "a whole number": _is_whole,
    "a list of texts": _are_texts,
    "a list of two numbers": _are_two_numbers,
    "a whole number or a text": lambda value: _is_whole(value) or _is_text(value),
    "a text or a table": lambda value: _is_text(value) or isinstance(value, Mapping),
}

_TEXT, _FLAG, _NUMBER, _WHOLE = "a text", "true or false", "a number", "a whole number"

#: Every option by name: first those of `identify` itself, then the settings of its methods.
OPTIONS: dict[str, Option] = {
    "structure": Option(_TEXT, "terms of the model"),
    "method": Option(_TEXT, "how the coefficients are fitted"),
    "samples": Option(_TEXT, "how a trial becomes a regression"),
    "name": Option(_TEXT, "of the model"),
    "window": Option(_WHOLE, "sampling steps over which velocities are integrated"),
    "smooth": Option(_FLAG, "whether noisy channels are smoothed first"),
    "preprocessing": Option(_TEXT, "how they are smoothed"),
    "repair": Option(_FLAG, "whether outliers are replaced and short dropouts filled first"),
    "uncertainty": Option(_TEXT, "where the standard errors come from"),
    "guarded": Option(_FLAG, "whether a model that runs away is fitted again with a penalty"),
    "hold_out": Option("a list of texts", "trials that are predicted only, by file"),
    "reference_model": Option(_TEXT, "reference ship of a grey box"),
    "prior": Option(_TEXT, "what the coefficients are pulled to"),
    "prior_strength": Option(_NUMBER, "how strongly"),
    "prior_folds": Option(_TEXT, "what its strength is judged by"),
    "service_shaft_speed": Option(_NUMBER, "shaft speed at service speed, 1/s"),
    "C": Option(_NUMBER, "weight of the errors"),
    "rank": Option(_WHOLE, "directions of the features that are kept"),
    "selection": Option(_TEXT, "how the rank is chosen"),
    "explained_variance": Option(_NUMBER, "share of the features that the rank keeps"),
    "scale": Option(_FLAG, "whether features are scaled to one size"),
    "robust": Option(_FLAG, "whether outliers are weighed down"),
    "alpha": Option(_NUMBER, "penalty of ridge regression"),
    "epsilon": Option(_NUMBER, "errors that a support vector machine does not see"),
    "objective": Option(_TEXT, "what a search makes small"),
    "optimiser": Option("a text or a table", "what searches"),
    "bounds": Option("a list of two numbers", "least and largest C of a search"),
    "folds": Option("a whole number or a text", "blocks of time, 'trials', or 'largest-rudder'"),
    "seed": Option(_WHOLE, "of a search"),
    "forgetting": Option(_NUMBER, "factor of a recursive method"),
    "omega": Option(_NUMBER, "how nonlinear the innovation of a recursive method is"),
    "innovations": Option(_WHOLE, "length of the innovation of a recursive method"),
    "inverse_free": Option(_FLAG, "whether multi-innovation steps avoid a matrix inverse"),
    "start_samples": Option(_WHOLE, "samples of the LS-SVR that a recursive method starts from"),
    "start_interval": Option(_WHOLE, "every how many samples one of them is taken"),
    "start_C": Option(_NUMBER, "its weight of the errors"),
    "regression": Option(_TEXT, "machine of RM-SVM"),
    "free_constant": Option(_FLAG, "whether RM-SVM frees the constant of the reference ship"),
    "constant": Option(_WHOLE, "column of that constant"),
    "segment_lengths": Option(_NUMBER, "ship lengths sailed in a segment of the refinement"),
    "staggered": Option(_FLAG, "whether a second set of segments begins half a segment later"),
    "segment_start": Option(_TEXT, "whether the state at the start of a segment is fitted"),
    "pull": Option(_NUMBER, "of the refinement toward its start"),
    "rudder_offsets": Option(_FLAG, "whether the zero of the rudder differs between the trials"),
    "extra_trials": Option("a list of texts", "trials that only the refinement sees, by file"),
    "extra_weight": Option(_NUMBER, "of their squared residuals"),
}


def check_options(table: Any, where: str) -> dict[str, Any]:
    """Check names and kinds of options; which words and numbers fit is known to the methods.

    Parameters
    ----------
    table : mapping
        Values by option.
    where : str
        Start of messages: ``"ship.toml: [identify]"``.

    Returns
    -------
    dict

    Raises
    ------
    InputError
        For an unknown option or a value of another kind.
    """
    options = check_table(table, where)
    check_keys(options, OPTIONS, where)
    for name, value in options.items():
        option = OPTIONS[name]
        if option.kind == _TEXT:
            check_text(value, f"{where} {name}")
        if not KINDS[option.kind](value):
            raise InputError(f"{where} {name}: {value!r} found, expected {option.kind}: {option.meaning}")
    return dict(options)
