"""Golden values: named vectors of numbers, how small files keep them, and how two sets
are compared."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
#: By case, then by quantity.
Values = dict[str, dict[str, Floats]]

KEPT_BITS = (
    40  # of the 52 of a mantissa: 1e-12 of a number, and a third less in the file
)
SMALLEST_SCALE = (
    1e-6  # in whatever unit; what is smaller altogether counts as noise around zero
)


@dataclass(frozen=True)
class Deviation:
    """Where two sets of values differ most, measured by what is allowed there.

    Attributes
    ----------
    size : float
        Largest difference over the largest stored number of the quantity; inf where a
        number turned into NaN, or a quantity is missing or new.
    tolerance : float
        What is allowed there.
    where : str
        Case and quantity.
    """

    size: float
    tolerance: float
    where: str

    @property
    def excess(self) -> float:
        """The deviation over what is allowed."""
        return self.size / self.tolerance


def vector(numbers: ArrayLike) -> Floats:
    """Numbers as one flat vector."""
    return np.atleast_1d(np.asarray(numbers, dtype=np.float64)).reshape(-1)


def numbers_in(
    content: Any, path: str = "", left_out: Iterable[str] = ()
) -> dict[str, Floats]:
    """All numbers of nested tables and lists, by their path; None is NaN, texts are
    passed over.

    `left_out` are parts of names of tables' fields that are not looked into.
    """
    if isinstance(content, Mapping):
        found: dict[str, Floats] = {}
        for key, value in content.items():
            if not any(part in str(key) for part in left_out):
                found |= numbers_in(
                    value, f"{path}.{key}" if path else str(key), left_out
                )
        return found
    if isinstance(content, list | tuple):
        if content and all(isinstance(one, int | float | None) for one in content):
            return {
                path: vector(
                    [math.nan if one is None else float(one) for one in content]
                )
            }
        found = {}
        for i, value in enumerate(content):
            found |= numbers_in(value, f"{path}[{i}]", left_out)
        return found
    if content is None or isinstance(content, int | float):
        return {path: vector(math.nan if content is None else float(content))}
    return {}


def save(values: Values, path: Path) -> None:
    """Write values as one compressed file: an index in JSON, and all numbers in a row,
    byte by byte."""
    index = {
        case: {name: len(row) for name, row in rows.items()}
        for case, rows in values.items()
    }
    every = np.concatenate([row for rows in values.values() for row in rows.values()])
    words = _shortened(every).view(np.uint8).reshape(len(every), 8)
    text = np.frombuffer(
        json.dumps(index, separators=(",", ":")).encode(), dtype=np.uint8
    )
    np.savez_compressed(path, index=text, bytes=np.ascontiguousarray(words.T))


def load(path: Path) -> Values:
    """Read what `save` wrote."""
    with np.load(path) as file:
        index = json.loads(file["index"].tobytes())
        every = np.ascontiguousarray(file["bytes"].T).view(np.float64).reshape(-1)
    values: Values = {}
    start = 0
    for case, lengths in index.items():
        values[case] = {}
        for name, length in lengths.items():
            values[case][name] = every[start : start + length]
            start += length
    return values


def _shortened(numbers: Floats) -> Floats:
    """Numbers rounded to `KEPT_BITS` bits of their mantissa; what is not
    finite stays."""
    mantissa, exponent = np.frexp(numbers)
    with np.errstate(invalid="ignore"):
        rounded = np.ldexp(
            np.round(np.ldexp(mantissa, KEPT_BITS)), exponent - KEPT_BITS
        )
    return np.where(np.isfinite(numbers), rounded, numbers)


def compare(
    stored: Values, found: Values, tolerances: Mapping[str, float]
) -> list[Deviation]:
    """The deviation of each quantity, the worst by its tolerance first.

    Parameters
    ----------
    stored, found : dict
        What was kept, and what is computed now.
    tolerances : mapping of str to float
        By the beginning of a quantity's name, or of its case; "" for all others.
    """
    deviations = []
    for case in stored.keys() | found.keys():
        old, new = stored.get(case, {}), found.get(case, {})
        for name in old.keys() | new.keys():
            where = f"{case}: {name}"
            fitting = [
                key
                for key in tolerances
                if name.startswith(key) or where.startswith(key)
            ]
            size = difference(old.get(name), new.get(name))
            deviations.append(Deviation(size, tolerances[max(fitting, key=len)], where))
    return sorted(deviations, key=lambda one: (-one.excess, one.where))


def difference(old: Floats | None, new: Floats | None) -> float:
    """Largest difference over the largest stored number."""
    if old is None or new is None or old.shape != new.shape:
        return math.inf
    known = np.isfinite(old)
    strange = ~known
    if np.any(known != np.isfinite(new)) or not np.array_equal(
        old[strange], new[strange], equal_nan=True
    ):
        return math.inf
    if not known.any():
        return 0.0
    scale = max(float(np.abs(old[known]).max()), SMALLEST_SCALE)
    return float(np.abs(new[known] - old[known]).max()) / scale
