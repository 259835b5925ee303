"""Sums of short Fourier series over an angle, by its cosine and sine alone."""

from collections.abc import Callable
from typing import Any, NamedTuple

from shipgym.engine.record_code import written


class Sines(NamedTuple):
    """A series of sines: the amplitudes of six harmonics."""

    first: float
    second: float
    third: float
    fourth: float
    fifth: float
    sixth: float


class Cosines(NamedTuple):
    """A series of cosines: its mean, and the amplitudes of six harmonics."""

    mean: float
    first: float
    second: float
    third: float
    fourth: float
    fifth: float
    sixth: float


def _series(record: type[Any], beginning: str) -> Callable[..., float]:
    """Write the sum of a series by Chebyshev's recurrence.

    cos((k + 1) angle) = 2 cos(angle) cos(k angle) - cos((k - 1) angle), and sines
    likewise; `beginning` says what k = 0 and k = 1 have.
    """
    lines = ["d = 2.0 * cosine", f"h0, h1 = {beginning}"]
    lines += [f"h{k + 1} = d * h{k} - h{k - 1}" for k in range(1, 6)]
    first = 7 - len(record._fields)  # no mean of sines
    sums = [f"a.{name} * h{k}" for k, name in enumerate(record._fields, first)]
    name = record.__name__
    return written(
        f"sum_of_{name}", "cosine, sine, a", [*lines, f"return {' + '.join(sums)}"], {}
    )


#: (cosine, sine, amplitudes): the sum over the harmonics of an angle.
sum_of_sines = _series(Sines, "0.0, sine")
sum_of_cosines = _series(Cosines, "1.0, cosine")
