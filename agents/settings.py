"""Settings: dataclasses whose fields say what they mean, and which values they take."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from typing import Any, NamedTuple, Self

from shipgym.checks import check_choice, check_keys, check_number, check_whole
from shipgym.errors import InputError


class Step(NamedTuple):
    """How a search varies a setting of a controller.

    Attributes
    ----------
    size : float
        Change for a step of 1: in the setting's logarithm, or in the setting.
    start : float, optional
        Where the search begins, if not at the design: a small value in place of 0.
    reach : float
        Largest factor either way.
    is_factor : bool
        True to search the logarithm.
    """

    size: float
    start: float | None = None
    reach: float = 100.0
    is_factor: bool = True


def setting(
    meaning: str,
    default: Any = MISSING,
    *,
    options: Sequence[str] = (),
    word: str = "",
    search: Any = None,
    **bounds: float,
) -> Any:
    """Field of a setting: what it means, and which values it may have.

    A number has bounds, keywords of `check_number` or `check_whole`; a `word` may stand
    for it, and one that ends in an underscore may have a positive number after it. A
    text is one of the `options`, where there are any. `search`: how a search varies it.
    """
    about = {
        "meaning": meaning,
        "options": options,
        "word": word,
        "search": search,
        "bounds": bounds,
    }
    return field(default=default, metadata=about)


@dataclass(frozen=True)
class Settings:
    """Settings by name; InputError names one whose value is out of its range."""

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            object.__setattr__(self, one.name, _checked(value, one))

    def to_dict(self) -> dict[str, Any]:
        """Return the settings by name, ready for JSON."""
        values = {}
        for one in fields(self):
            value = getattr(self, one.name)
            values[one.name] = list(value) if isinstance(value, tuple) else value
        return values

    def changed(self, given: Mapping[str, Any]) -> Self:
        """Replace some; InputError for an unknown one or a value out of its range."""
        check_keys(given, [one.name for one in fields(self)], "settings")
        return replace(self, **given)


def _checked(value: Any, one: Field[Any]) -> Any:
    """Return the value of a setting, if its type and bounds allow it."""
    name, about = one.name, one.metadata
    bounds = about["bounds"]
    if value is None and one.default is None:
        return None
    if one.type is int:
        return check_whole(value, name, **bounds)
    if about["options"]:
        return check_choice(value, about["options"], name)
    if one.type is str:
        return value
    if one.type == tuple[int, ...]:
        if isinstance(value, str) or not isinstance(value, Sequence):
            raise InputError(
                f"{name}: expected widths of layers, such as [64, 64], got {value!r}"
            )
        return tuple(check_whole(width, name, **bounds) for width in value)
    if about["word"] and isinstance(value, str):
        return _word(value, name, about["word"])
    return check_number(value, name, **bounds)


def _word(value: str, name: str, word: str) -> str:
    """Return a word; after an underscore it has a positive number."""
    alone = word.rstrip("_")
    if value == alone:
        return value
    try:
        begins = word.endswith("_") and value.startswith(word)
        check_number(
            float(value.removeprefix(word)) if begins else 0.0, name, above=0.0
        )
    except (ValueError, InputError):
        more = f" or such as '{word}0.1'" if word.endswith("_") else ""
        raise InputError(
            f"{name}: expected a number or '{alone}'{more}, got {value!r}"
        ) from None
    return value
