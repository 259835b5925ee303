"""Checks of a user's input; a refusal is `place: expected X, got Y; do Z`."""

import difflib
import math
import reprlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from numbers import Integral, Real
from pathlib import Path
from types import NoneType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError

#: Types of a JSON value; a list of what all entries are, or of what each of several is;
#: a table by key, or by `ANY_KEY` what all values are.
Shape: TypeAlias = "tuple[type, ...] | list[Shape] | dict[str, Shape]"
ANY_KEY = "*"
_WORDS = {
    str: "a string",
    int: "an integer",
    float: "a number",
    bool: "a boolean",
    NoneType: "null",
}

_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = 200


def shown(value: Any) -> str:
    """Write a value as Python does, for a message; a long one is shortened."""
    try:
        return _SHORT.repr(value)
    except ValueError:  # an integer of thousands of digits
        return f"a {type(value).__name__}"


def unexpected(where: str, expected: str, value: Any, remedy: str = "") -> InputError:
    """Make the error for a value: `where: expected ..., got value; remedy`."""
    remedy = f"; {remedy}" if remedy else ""
    return InputError(f"{where}: expected {expected}, got {shown(value)}{remedy}")


@contextmanager
def placed(where: str, separator: str = ": ") -> Iterator[None]:
    """Let refusals within the block begin with the place `where`."""
    try:
        yield
    except InputError as error:
        if str(error).startswith(where):
            raise
        raise InputError(f"{where}{separator}{error}") from None


def quoted(words: Iterable[str]) -> str:
    """List words for a message: ``'x', 'y', 'psi'``."""
    return ", ".join(f"'{word}'" for word in words) or "none"


def did_you_mean(word: str, options: Iterable[str]) -> str:
    """Hint such as ``" Did you mean 'beam'?"``; empty if no option is like `word`."""
    by_lower_case = {option.lower(): option for option in options}
    known = list(by_lower_case)
    text = str(word).strip().lower()
    close = difflib.get_close_matches(text, known, n=1)
    if not close and len(text) > 2:
        close = [option for option in known if text in option]
    if not close:
        return ""
    nearest = by_lower_case[close[0]]
    return f" Did you mean '{nearest}'?"


def check_keys(
    mapping: Mapping[str, Any],
    allowed: Collection[str],
    where: str,
    required: Iterable[str] = (),
) -> None:
    """Refuse an unknown key, naming the nearest, and a missing required one."""
    for key in mapping:
        if key not in allowed:
            raise InputError(
                f"{where}: unknown key '{key}'.{did_you_mean(key, allowed)} Known keys:"
                f" {quoted(allowed)}"
            )
    for key in required:
        if key not in mapping:
            raise InputError(
                f"{where}: field '{key}' is missing; give {quoted(required)}"
            )


def check_fields(
    content: Mapping[str, Any],
    names: Collection[str],
    where: str,
    remedy: str,
) -> None:
    """Refuse an unknown field of a file, and a missing one, with its `remedy`."""
    check_keys(content, names, where)
    for name in names:
        if name not in content:
            raise InputError(f"{where}: field '{name}' is missing; {remedy}")


def check_format(content: Mapping[str, Any], known: int, where: str) -> None:
    """Refuse a file whose number `format` is another than the known one."""
    found = content.get("format", known)
    if found != known:
        expected = f"format {known}, which this version of shipgym reads"
        raise unexpected(where, expected, found)


def check_table(
    value: Any,
    where: str,
    allowed: Collection[str] | None = None,
    required: Iterable[str] = (),
) -> Mapping[str, Any]:
    """Return `value`, which must be a table, of the keys `allowed` if given."""
    if not isinstance(value, Mapping):
        raise unexpected(where, "a table of keys and values", value)
    if allowed is not None:
        check_keys(value, allowed, where, required)
    return value


def check_text(value: Any, where: str) -> str:
    """Return `value`, which must be a non-empty string of no great length."""
    longest = 4096
    if not isinstance(value, str) or not value.strip():
        raise unexpected(where, "a non-empty string", value)
    if len(value) > longest:
        raise InputError(
            f"{where}: expected at most {longest} characters, got {len(value)}"
        )
    return value


def check_choice(
    value: Any,
    options: Collection[str],
    where: str,
    also: str = "",
) -> str:
    """Return `value`, one of `options`; `also` ends the list of them in messages."""
    if isinstance(value, str) and value in options:
        return value
    hint = did_you_mean(value, options) if isinstance(value, str) else ""
    raise InputError(
        f"{where}: expected one of {quoted(options)}{also}, got {shown(value)}.{hint}"
    )


def data_only(value: Any, where: str, own: Any = None, named: bool = False) -> None:
    """Refuse Python files named in a file's content: only a user's own word runs code.

    At any depth of `value` these are paths that end in ``.py``, and all that the
    environments' options `task`, `reward` and `sensors` name (`named`: whether `value`
    is one of them). `own`: what the user has given in the same place, which is allowed.
    """
    if value == own:
        return
    if isinstance(value, Mapping):
        given = own if isinstance(own, Mapping) else {}
        for name, entry in value.items():
            names_code = name in ("task", "reward", "sensors")
            data_only(entry, f"{where}.{name}", given.get(name), names_code)
    elif isinstance(value, list | tuple):
        for entry in value:
            data_only(entry, where, None, named)
    elif isinstance(value, str) and (named or Path(value).suffix == ".py"):
        raise InputError(
            f"{where}: expected data, got {value!r}, which is code: no file makes"
            " shipgym run another; name it on the command line or in your own code"
        )


def check_number(
    value: Any,
    where: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    hint: str = "",
) -> float:
    """Return `value` as float; it must be finite and within open and closed bounds.

    Booleans and numbers in quotes are refused. The InputError begins with `where`, the
    place, such as ``"ship.toml: [ship] length"``, and says what is expected, explained
    by `hint`, such as ``"in m"``, and what the value is.
    """
    number = _as_float(value)
    within = (
        math.isfinite(number)
        and (above is None or number > above)
        and (at_least is None or number >= at_least)
        and (below is None or number < below)
        and (at_most is None or number <= at_most)
    )
    if not within:
        bounds = {">": above, ">=": at_least, "<": below, "<=": at_most}
        raise _no_such_number(value, where, bounds, hint)
    return number


def _no_such_number(
    value: Any,
    where: str,
    bounds: Mapping[str, float | None],
    hint: str,
) -> InputError:
    stated = []
    for sign, bound in bounds.items():
        if bound is not None:
            stated.append(f"{sign} {bound:g}")
    expected = f"a number {' and '.join(stated)}".rstrip()
    if hint:
        expected += f" ({hint})"
    if isinstance(value, str):
        remedy = "write the number without quotes"
        return unexpected(where, expected, value, remedy)
    if isinstance(value, bool) or not isinstance(value, Real):
        return unexpected(where, expected, value)
    return InputError(f"{where}: expected {expected}, got {_as_float(value):g}")


def _as_float(value: Any) -> float:
    """Convert to float: infinite where too large, nan for anything but a number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def check_whole(
    value: Any,
    where: str,
    *,
    at_least: int,
    at_most: float = math.inf,
    hint: str = "",
) -> int:
    """Return `value`, which must be an integer from `at_least` to `at_most`."""
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if whole and at_least <= int(value) <= at_most:
        return int(value)

    expected = f"an integer of at least {at_least}"
    if at_most < math.inf:
        expected += f" and at most {at_most}"
    if hint:
        expected += f" ({hint})"
    raise unexpected(where, expected, value)


def check_flag(value: Any, where: str) -> bool:
    """Return `value`, which must be a boolean."""
    if not isinstance(value, bool):
        raise unexpected(where, "a boolean", value)
    return value


def check_finite(values: Any, where: str, hint: str = "") -> NDArray[np.float64]:
    """Return `values` as a read-only copy; they must be finite numbers."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise unexpected(where, "an array of numbers", values) from None
    wrong = np.argwhere(~np.isfinite(array))
    if len(wrong):
        place = tuple(wrong[0].tolist())
        sample = place[0] if len(place) == 1 else place
        remedy = f"; {hint}" if hint else ""
        raise InputError(
            f"{where}: expected finite numbers, got {array[place]} at sample"
            f" {sample}{remedy}"
        )
    array.setflags(write=False)
    return array


def check_array(
    value: Any,
    shape: tuple[int | None, ...],
    where: str,
) -> NDArray[np.float64]:
    """Return the numbers of nested lists as an array of a shape; None is any length.

    Strings, booleans, numbers that are not finite and rows that differ in length are
    refused.
    """
    size, *row_shape = shape
    if not isinstance(value, list) or size not in (None, len(value)):
        count = "" if size is None else f"{size} "
        kind = "lists" if row_shape else "numbers"
        found = f"{len(value)} entries" if isinstance(value, list) else shown(value)
        raise InputError(f"{where}: expected a list of {count}{kind}, got {found}")
    if not row_shape:
        return _check_numbers(value, where)

    has_lists = bool(value) and isinstance(value[0], list)
    if row_shape[0] is None and has_lists:
        row_shape[0] = len(value[0])  # all rows are as long as the first
    rows = []
    for i, row in enumerate(value):
        rows.append(check_array(row, tuple(row_shape), f"{where}[{i}]"))
    return np.array(rows)


def _check_numbers(values: list[Any], where: str) -> NDArray[np.float64]:
    for i, number in enumerate(values):
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise unexpected(f"{where}[{i}]", "a number", number)
    return check_finite(values, where)


def check_shape(value: Any, shape: Shape, where: str) -> None:
    """Refuse nested JSON values that differ from a shape; further keys are allowed."""
    if isinstance(shape, dict):
        _check_table_shape(value, shape, where)
    elif isinstance(shape, list):
        _check_list_shape(value, shape, where)
    elif type(value) not in shape:
        words = []
        for kind in shape:
            word = _WORDS.get(kind, kind.__name__)
            words.append(word)
        expected = " or ".join(dict.fromkeys(words))
        raise unexpected(where, expected, value)


def _check_table_shape(value: Any, shape: dict[str, Shape], where: str) -> None:
    table = check_table(value, where)
    keys = table if ANY_KEY in shape else shape
    for key in keys:
        if key not in table:
            raise InputError(f"{where}: '{key}' is missing; give {quoted(shape)}")
        expected = shape[key] if key in shape else shape[ANY_KEY]
        check_shape(table[key], expected, f"{where}.{key}")


def _check_list_shape(value: Any, shape: list[Shape], where: str) -> None:
    if not isinstance(value, list):
        raise unexpected(where, "a list", value)
    shapes = shape
    if len(shape) == 1:
        shapes = shape * len(value)
    elif len(value) != len(shape):
        raise unexpected(where, f"a list of {len(shape)}", value)
    for i, (entry, entry_shape) in enumerate(zip(value, shapes, strict=True)):
        check_shape(entry, entry_shape, f"{where}[{i}]")
