"""What public functions answer, as plain numbers and words: results, and the messages of refusals."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import chdir, contextmanager
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

import shipgym
from shipgym.manoeuvres.standard import FAMILIES
from shipgym.ships.structures import REGISTERED_EQUATIONS, REGISTERED_STRUCTURES
from shipgym.trials.trial import KINDS, Trial
from tests.golden.store import Floats, numbers_in

REFUSED = (shipgym.InputError, shipgym.ManoeuvreError, shipgym.UnstableModelError)
SHIPPED_FAMILIES = ("zigzags", "circles", "spirals", "pull-outs", "stops")
SHIPPED_KINDS = (
    "zigzag",
    "turning-circle",
    "spiral",
    "pull-out",
    "straight",
    "captive",
    "random",
)
# numbers of an array that are kept whole; of longer ones samples and two means are
MOST = 20


def plain(value: Any) -> Any:
    """Nested tables and lists of numbers and words: of a result, or of what a function answers now."""
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if callable(value) and not isinstance(value, type):
        return asked(value)
    if isinstance(value, complex):
        return [value.real, value.imag]
    if isinstance(value, Trial):
        facts = {
            name: getattr(value, name)
            for name in ("name", "kind", "use", "length", "over_ground", "notes")
        }
        facts |= {"derived": sorted(value.derived), "repaired": dict(value.repaired)}
        return plain(
            {**{name: value[name] for name in ("t", *value.channels)}, **facts}
        )
    if isinstance(value, np.ndarray | np.generic):
        return thinned(np.asarray(value))
    if is_dataclass(value) and not isinstance(value, type):
        return plain({one.name: getattr(value, one.name) for one in fields(value)})
    if hasattr(value, "_asdict"):
        return plain(value._asdict())
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, set | frozenset):
        return [plain(one) for one in sorted(value, key=str)]
    if isinstance(value, Iterable):
        return [plain(one) for one in value]
    return str(value)


def thinned(values: np.ndarray[Any, Any]) -> list[Any]:
    """The elements of an array; of a long one its size, two means, and samples."""
    if values.dtype.kind not in "fiubc":
        return [str(one) for one in values.reshape(-1)[:: max(values.size // MOST, 1)]]
    flat = values.astype(np.complex128).reshape(-1)
    flat = (
        np.concatenate([flat.real, flat.imag]) if np.iscomplexobj(values) else flat.real
    )
    if flat.size <= MOST:
        return list(map(float, flat))
    known = flat[np.isfinite(flat)]
    means = [known.mean(), np.sqrt(np.mean(known**2))] if known.size else []
    samples = flat[np.linspace(0, flat.size - 1, MOST // 2).round().astype(int)]
    return [
        float(flat.size),
        float(known.size),
        *map(float, means),
        *map(float, samples),
    ]


def asked(question: Callable[[], Any]) -> Any:
    """The plain answer, or the message of a refusal."""
    try:
        return plain(question())
    except REFUSED as error:
        return f"{type(error).__name__}: {error}"


def refused(question: Callable[[Any], Any], values: Iterable[Any]) -> list[int]:
    """Of each value, tried around a limit, whether it is refused."""
    found = []
    for value in values:
        try:
            question(value)
            found.append(0)
        except REFUSED:
            found.append(1)
    return found


def words(answers: Any, place: str = "") -> list[str]:
    """The words of answers, each with its place, in lines."""
    if isinstance(answers, str):
        return [f"{place}: {answers}"]
    pairs: Iterable[tuple[Any, Any]] = ()
    if isinstance(answers, Mapping):
        pairs = answers.items()
    elif isinstance(answers, list):
        pairs = enumerate(answers)
    return [
        line
        for key, one in pairs
        for line in words(one, f"{place}.{key}" if place else str(key))
    ]


@contextmanager
def as_shipped() -> Iterator[None]:
    """An empty folder, and nothing registered but what is shipped, whatever was registered before."""
    tables = (
        (REGISTERED_STRUCTURES, ()),
        (REGISTERED_EQUATIONS, ()),
        (FAMILIES, SHIPPED_FAMILIES),
    )
    before, kinds = [dict(table) for table, _ in tables], KINDS[:]
    for table, shipped in tables:
        for name in table.keys() - set(shipped):
            del table[name]
    KINDS[:] = SHIPPED_KINDS
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        try:
            yield
        finally:
            KINDS[:] = kinds
            for (table, _), whole in zip(tables, before, strict=True):
                table.clear()
                table.update(whole)


@dataclass(frozen=True, eq=False)
class Questions:
    """A section whose cases ask many things at once: each function returns answers by name."""

    functions: Mapping[str, Callable[[], Mapping[str, Any]]]

    def cases(self) -> list[str]:
        """Names of the cases."""
        return list(self.functions)

    @cache  # noqa: B019 - there are a few, which live as long as the program
    def answers(self, case: str) -> Any:
        """All answers of a case, asked once."""
        with as_shipped():
            return plain(self.functions[case]())

    def record(self, case: str) -> dict[str, Floats]:
        """The numbers of the answers."""
        return numbers_in(self.answers(case))

    def told(self, case: str) -> str:
        """The words of the answers, in lines."""
        return "\n".join(words(self.answers(case)))
