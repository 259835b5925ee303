"""Checks of what a user wrote, each answering with one message that names the place and the remedy."""

import difflib
import math
import reprlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from numbers import Integral, Real
from operator import ge, gt, le, lt
from pathlib import Path
from types import NoneType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError

#: Most characters of a name, a source or a path.
LONGEST_TEXT = 4096

#: Types of a JSON value; a list of what all entries are, or of what each of several is;
#: a table by key, or by `ANY_KEY` what all values are.
Shape: TypeAlias = "tuple[type, ...] | list[Shape] | dict[str, Shape]"
ANY_KEY = "*"
_WORDS = {
    str: "a text",
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    NoneType: "null",
}

_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = 200


def shown(value: Any) -> str:
    """A value as Python writes it, for a message; of a long text or list only what begins and ends it."""
    try:
        return _SHORT.repr(value)
    except ValueError:  # a whole number of thousands of digits
        return f"a {type(value).__name__}"


@contextmanager
def placed(where: str) -> Iterator[None]:
    """Let refusals within the block begin with `where`, the place, unless they do already."""
    try:
        yield
    except InputError as error:
        if str(error).startswith(where):
            raise
        raise InputError(f"{where}: {error}") from None


@dataclass(frozen=True)
class Findings:
    """What a battery of checks found."""

    name: str  # of what was checked
    problems: tuple[
        str, ...
    ]  # what makes it unfit to be used, each with a remedy or its place
    remarks: tuple[str, ...] = ()  # what is unusual, and may be right

    @property
    def ok(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    @property
    def verdict(self) -> str:
        """Whether it is sound, in words."""
        return "sound" if self.ok else f"{len(self.problems)} problem(s)"

    def __str__(self) -> str:
        """Verdict, then a line for each problem and remark."""
        lines = [
            f"{self.name}: {self.verdict}",
            *(f"  problem: {problem}" for problem in self.problems),
        ]
        return "\n".join(lines + [f"  remark: {remark}" for remark in self.remarks])


def quoted(words: Iterable[str]) -> str:
    """List words for a message: ``'x', 'y', 'psi'``."""
    return ", ".join(f"'{word}'" for word in words) or "none"


def did_you_mean(word: str, options: Iterable[str]) -> str:
    """``" Did you mean 'beam'?"`` where one of the options looks like `word`, else an empty string."""
    by_lower_case = {option.lower(): option for option in options}
    text = str(word).strip().lower()
    close = difflib.get_close_matches(text, list(by_lower_case), n=1, cutoff=0.6)
    close = close or [
        option for option in by_lower_case if len(text) > 2 and (text in option)
    ]
    return f" Did you mean '{by_lower_case[close[0]]}'?" if close else ""


def check_keys(
    mapping: Mapping[str, Any],
    allowed: Collection[str],
    where: str,
    required: Iterable[str] = (),
) -> None:
    """Refuse a key that is not among `allowed`, naming the nearest one, and the lack of a required one."""
    for key in mapping:
        if key not in allowed:
            raise InputError(
                f"{where}: unknown key '{key}'.{did_you_mean(key, allowed)} Known keys:"
                f" {quoted(allowed)}"
            )
    for key in required:
        if key not in mapping:
            raise InputError(
                f"{where}: field '{key}' is missing, expected {quoted(required)}"
            )


def check_fields(
    content: Mapping[str, Any], names: Collection[str], where: str, remedy: str
) -> None:
    """Refuse an unknown field of a file, and the lack of any of `names`, ending the latter with `remedy`."""
    check_keys(content, names, where)
    for name in names:
        if name not in content:
            raise InputError(f"{where}: field '{name}' is missing; {remedy}")


def check_format(content: Mapping[str, Any], known: int, where: str) -> None:
    """Refuse a file whose number `format` is another than the known one."""
    if (found := content.get("format", known)) != known:
        raise InputError(
            f"{where}: format {shown(found)} found, this version of shipgym reads"
            f" format {known}"
        )


def check_table(
    value: Any,
    where: str,
    allowed: Collection[str] | None = None,
    required: Iterable[str] = (),
) -> Mapping[str, Any]:
    """Return `value`, which must be a table (a mapping with text as keys), of these keys where given."""
    if not isinstance(value, Mapping):
        raise InputError(
            f"{where}: {shown(value)} found, expected a table of keys and values"
        )
    if allowed is not None:
        check_keys(value, allowed, where, required)
    return value


def check_text(value: Any, where: str) -> str:
    """Return `value`, which must be text that is not empty, of at most `LONGEST_TEXT` characters."""
    if not isinstance(value, str) or not value.strip():
        raise InputError(
            f"{where}: {shown(value)} found, expected a text that is not empty"
        )
    if len(value) > LONGEST_TEXT:
        raise InputError(
            f"{where}: {len(value)} characters found, expected at most {LONGEST_TEXT}"
        )
    return value


def check_choice(
    value: Any, options: Collection[str], where: str, also: str = ""
) -> str:
    """Return `value`, which must be one of the words in `options`; `also` ends the list in the message."""
    if not isinstance(value, str) or value not in options:
        hint = did_you_mean(value, options) if isinstance(value, str) else ""
        raise InputError(
            f"{where}: {shown(value)} found, expected one of"
            f" {quoted(options)}{also}.{hint}"
        )
    return value


def data_only(value: Any, where: str, own: Any = None, named: bool = False) -> None:
    """Refuse Python files named in what a file holds: code is run at a user's own word, not at a file's.

    At any depth of `value` these are paths that end in ``.py``, and all that the
    environments' options `task`, `reward` and `sensors` name (`named`: whether `value`
    is one of them). `own`: what the user has given in the same place, which is allowed.
    """
    if value == own:
        return
    if isinstance(value, Mapping):
        given = own if isinstance(own, Mapping) else {}
        for name, one in value.items():
            data_only(
                one,
                f"{where}.{name}",
                given.get(name),
                name in ("task", "reward", "sensors"),
            )
    elif isinstance(value, list | tuple):
        for one in value:
            data_only(one, where, None, named)
    elif isinstance(value, str) and (named or Path(value).suffix == ".py"):
        raise InputError(
            f"{where}: {value!r} found, which is code: no file makes shipgym run"
            " another; name it on the command line or in your own code"
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
    """Return `value` as float; it must be a finite number within the open and closed bounds.

    Truth values and numbers in quotes are refused. The InputError begins with `where`,
    the place, such as ``"ship.toml: [ship] length"``, names the value and what is
    expected, and ends with `hint`, what to do.
    """
    bounds = (
        (">", gt, above),
        (">=", ge, at_least),
        ("<", lt, below),
        ("<=", le, at_most),
    )
    given = [(sign, holds, bound) for sign, holds, bound in bounds if bound is not None]
    stated = " and ".join(f"{sign} {bound:g}" for sign, _, bound in given)
    expected = f"expected a number {stated}".rstrip() + (f"; {hint}" if hint else "")
    if isinstance(value, bool) or not isinstance(value, Real):
        quotes = (
            " (a text; write the number without quotes)"
            if isinstance(value, str)
            else ""
        )
        raise InputError(f"{where}: {shown(value)}{quotes} found, {expected}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not (
        math.isfinite(number) and all(holds(number, bound) for _, holds, bound in given)
    ):
        raise InputError(f"{where}: {number:g} found, {expected}")
    return number


def check_whole(
    value: Any, where: str, *, at_least: int, at_most: float = math.inf, hint: str = ""
) -> int:
    """Return `value`, which must be a whole number from `at_least` to `at_most`."""
    if (
        isinstance(value, bool)
        or not isinstance(value, Integral)
        or not at_least <= int(value) <= at_most
    ):
        expected = f"a whole number of at least {at_least}"
        expected += (f" and at most {at_most}" if at_most < math.inf else "") + (
            f", {hint}" if hint else ""
        )
        raise InputError(f"{where}: {shown(value)} found, expected {expected}")
    return int(value)


def check_flag(value: Any, where: str) -> bool:
    """Return `value`, which must be true or false."""
    if not isinstance(value, bool):
        raise InputError(f"{where}: {shown(value)} found, expected true or false")
    return value


def check_finite(values: Any, where: str, hint: str = "") -> NDArray[np.float64]:
    """Return `values` as a read-only copy; they must be finite numbers, of any shape."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{where}: expected an array of numbers") from None
    wrong = np.argwhere(~np.isfinite(array))
    if len(wrong):
        place = tuple(wrong[0].tolist())
        sample = place[0] if len(place) == 1 else place
        remedy = f"; {hint}" if hint else ""
        raise InputError(
            f"{where}: {array[place]} found at sample {sample}, expected finite"
            f" numbers{remedy}"
        )
    array.setflags(write=False)
    return array


def check_array(
    value: Any, shape: tuple[int | None, ...], where: str
) -> NDArray[np.float64]:
    """Return the numbers of a list, or of lists within it, as an array of this shape; None is any length.

    Texts, truth values, numbers that are not finite and rows that differ in length are
    refused.
    """
    size = shape[0]
    if not isinstance(value, list) or len(value) != (
        len(value) if size is None else size
    ):
        found = f"{len(value)} entries" if isinstance(value, list) else shown(value)
        what = "lists" if len(shape) > 1 else "numbers"
        raise InputError(
            f"{where}: {found} found, expected a list of"
            f" {'' if size is None else f'{size} '}{what}"
        )
    if len(shape) == 1:
        for i, number in enumerate(value):
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise InputError(
                    f"{where}[{i}]: {shown(number)} found, expected a number"
                )
        return check_finite(value, where)
    width = (
        len(value[0])
        if shape[1] is None and value and isinstance(value[0], list)
        else shape[1]
    )
    return np.array(
        [
            check_array(row, (width, *shape[2:]), f"{where}[{i}]")
            for i, row in enumerate(value)
        ]
    )


def check_shape(value: Any, shape: Shape, where: str) -> None:
    """Refuse nested JSON values that differ from a shape, naming the place; further keys may be there."""
    if isinstance(shape, dict):
        table = check_table(value, where)
        for key in table if ANY_KEY in shape else shape:
            if key not in table:
                raise InputError(
                    f"{where}: '{key}' is missing, expected {quoted(shape)}"
                )
            check_shape(
                table[key], shape.get(key, shape.get(ANY_KEY, ())), f"{where}.{key}"
            )
    elif isinstance(shape, list):
        several = len(shape) > 1
        if not isinstance(value, list) or (several and len(value) != len(shape)):
            raise InputError(
                f"{where}: {shown(value)} found, expected a"
                f" list{f' of {len(shape)}' * several}"
            )
        for i, entry in enumerate(value):
            check_shape(entry, shape[i if several else 0], f"{where}[{i}]")
    elif type(value) not in shape:
        words = " or ".join(
            dict.fromkeys(_WORDS.get(kind, kind.__name__) for kind in shape)
        )
        raise InputError(f"{where}: {shown(value)} found, expected {words}")
