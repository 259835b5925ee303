"""Checks of a user's input; a refusal is `place: expected X, got Y; do Z`."""

import difflib
import math
import reprlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, field, fields
from numbers import Integral, Real
from operator import ge, gt, le, lt
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError

Kind = TypeVar("Kind")

_COMPARED = {">": gt, ">=": ge, "<": lt, "<=": le}
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
    """Refuse an unknown key, naming the nearest or all, and a missing required one."""
    for key in mapping:
        if key not in allowed:
            near = did_you_mean(key, allowed)
            known = near or f" Known keys: {quoted(allowed)}"
            raise InputError(f"{where}: unknown key '{key}'.{known}")
    for key in required:
        if key not in mapping:
            raise InputError(
                f"{where}: field '{key}' is missing; give {quoted(required)}"
            )


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
    bounds = {">": above, ">=": at_least, "<": below, "<=": at_most}
    stated = {sign: bound for sign, bound in bounds.items() if bound is not None}
    number = _as_float(value)
    if math.isfinite(number) and all(
        _COMPARED[sign](number, bound) for sign, bound in stated.items()
    ):
        return number

    limits = " and ".join(f"{sign} {bound:g}" for sign, bound in stated.items())
    expected = f"a number {limits}".rstrip()
    if hint:
        expected += f" ({hint})"
    remedy = "write the number without quotes" if isinstance(value, str) else ""
    raise unexpected(where, expected, value, remedy)


def _as_float(value: Any) -> float:
    """Convert to float: nan for what is no number, or too large a one."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan


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


def bounded(default: Any = MISSING, **bounds: Any) -> Any:
    """Field of a dataclass that is a number within bounds, as `check_number` has them.

    With a default of None it may be unknown.
    """
    return field(default=default, metadata={"bounds": bounds})


def keep_numbers(part: Any, where: str = "") -> None:
    """Make floats of the `bounded` fields of a dataclass, which must be in bounds."""
    for one in fields(part):
        value = getattr(part, one.name)
        unknown = value is None and one.default is None
        if "bounds" in one.metadata and not unknown:
            number = check_number(value, where + one.name, **one.metadata["bounds"])
            object.__setattr__(part, one.name, number)


def read_fields(kind: type[Kind], content: Any, where: str) -> Kind:
    """Make a dataclass of a table; an unknown or a missing field is refused."""
    known: Any = fields(kind)  # type: ignore[arg-type]
    table = check_table(
        content,
        where,
        allowed=[one.name for one in known],
        required=[one.name for one in known if one.default is MISSING],
    )
    return kind(**table)


def check_flag(value: Any, where: str) -> bool:
    """Return `value`, which must be a boolean."""
    if not isinstance(value, bool):
        raise unexpected(where, "a boolean", value)
    return value


def check_finite(values: Any, where: str, hint: str = "") -> NDArray[np.float64]:
    """Return `values` as a read-only copy; they must be finite numbers."""
    try:
        given = np.array(values)
        if given.dtype.kind in "USbc":  # texts, booleans, complex numbers
            raise TypeError
        array = given.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        raise unexpected(where, "an array of numbers", values) from None
    wrong = np.argwhere(~np.isfinite(array))
    if len(wrong):
        place = tuple(wrong[0].tolist())
        where_in_it = f" at sample {', '.join(map(str, place))}" if place else ""
        remedy = f"; {hint}" if hint else ""
        raise InputError(
            f"{where}: expected finite numbers, got {array[place]}{where_in_it}{remedy}"
        )
    array.setflags(write=False)
    return array


def check_arrays(
    content: Any, shapes: Mapping[str, tuple[int | None, ...]], where: str
) -> dict[str, NDArray[np.float64]]:
    """Return the arrays of a table by name, each of its shape (`check_array`)."""
    table = check_table(content, where, shapes)
    return {
        name: check_array(table.get(name), shape, f"{where}.{name}")
        for name, shape in shapes.items()
    }


def check_array(
    value: Any,
    shape: tuple[int | None, ...],
    where: str,
) -> NDArray[np.float64]:
    """Return the numbers of nested lists as an array of a shape; None is any length.

    Anything but finite numbers, and rows that differ in length, are refused.
    """
    try:
        array = np.array(value)
    except ValueError:  # rows that differ in length
        array = np.array(None)
    if array.size == 0 and None in shape:
        return np.zeros([length or 0 for length in shape])
    fits = array.ndim == len(shape) and array.dtype.kind in "fiu"
    if fits:
        sizes = zip(shape, array.shape, strict=True)
        fits = all(length in (None, size) for length, size in sizes)
    if not fits:
        lengths = " x ".join("any" if one is None else str(one) for one in shape)
        raise unexpected(where, f"a list of numbers, size {lengths}", value)
    return check_finite(array, where)
