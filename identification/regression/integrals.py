"""Integrals of the terms of a model over each step: Euler, trapezoid rule, Gauss on broken splines."""

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from identification.regression.rudder import Rudder
from shipgym.arrays import Floats

Channels = Mapping[str, Floats]
#: The terms of an equation, an array of shape (n_samples, n_terms), from the channels
#: at some times.
Terms = Callable[[str, Channels], Floats]
Integrals = tuple[dict[str, Floats], dict[str, Floats]]

DEGREE = 3
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


def step_integrals(
    t: Floats, channels: Channels, equations: Iterable[str], terms: Terms, euler: bool
) -> Integrals:
    """As `spline_integrals`, by the value at the start of each step or by the trapezoid rule."""
    integrals, moments = {}, {}
    for q in equations:
        values = terms(q, channels)
        mean = values[:-1] if euler else 0.5 * (values[:-1] + values[1:])
        integrals[q] = mean * np.diff(t)[:, None]
        moments[q] = 0.5 * integrals[q] * np.diff(t)[:, None]
    return integrals, moments


def spline_integrals(
    t: Floats,
    channels: Channels,
    equations: Iterable[str],
    terms: Terms,
    rudder: Rudder,
) -> Integrals:
    """Integrals over each step by Gauss quadrature on splines, broken where the rudder has corners.

    Returns `integrals, moments` by equation, shape (n_samples - 1, n_terms); moments
    about the step's end.
    """
    edges = np.union1d(t, rudder.corners)
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    times = middle[:, None] + half[:, None] * NODES
    at_nodes = {
        name: _between(t, name, values, rudder)(times.ravel())
        for name, values in channels.items()
    }
    step = np.searchsorted(t, middle, side="right") - 1
    starts = np.flatnonzero(np.diff(step, prepend=-1))
    weights = half[:, None] * WEIGHTS
    to_end = t[step + 1][:, None] - times
    integrals, moments = {}, {}
    for q in equations:
        values = terms(q, at_nodes).reshape(*times.shape, -1)
        integrals[q] = np.add.reduceat(
            np.einsum("ijk,ij->ik", values, weights), starts, axis=0
        )
        moments[q] = np.add.reduceat(
            np.einsum("ijk,ij->ik", values, weights * to_end), starts, axis=0
        )
    return integrals, moments


def _between(
    t: Floats, name: str, values: Floats, rudder: Rudder
) -> Callable[[Floats], Floats]:
    """A channel between its samples; a shaft speed, which may jump, is taken straight."""
    if name == "n":
        return lambda times: np.interp(times, t, values)
    return rudder if name == "delta" else broken_spline(t, values, rudder)


def broken_spline(t: Floats, values: Floats, rudder: Rudder) -> BSpline:
    """Cubic spline through the samples of a velocity, broken where the rudder has a corner.

    Where the rate of the rudder jumps the second derivative of a velocity does; at a
    jump of its acceleration the third does.
    """
    if len(t) <= DEGREE:
        return make_interp_spline(t, values, k=1)
    interior = list(range(2, len(t) - 2))  # not-a-knot ends
    broken: list[float] = []
    for corner, smoothness in zip(rudder.corners, rudder.smoothness, strict=True):
        multiplicity = DEGREE - 1 - int(smoothness)
        nearest = sorted(interior, key=lambda i: abs(t[i] - corner))[:multiplicity]
        after = int(np.searchsorted(t, corner))
        if any(abs(i - after) > 2 for i in nearest) or len(nearest) < multiplicity:
            continue  # too close to another corner or to an end
        kept = [i for i in interior if i not in nearest]
        if _solvable(t, _knots(t, kept, [*broken, *[corner] * multiplicity])):
            interior, broken = kept, [*broken, *[corner] * multiplicity]
    return make_interp_spline(t, values, k=DEGREE, t=_knots(t, interior, broken))


def _knots(t: Floats, interior: Sequence[int], broken: Sequence[float]) -> Floats:
    inner = np.sort(
        np.concatenate([t[list(interior)], np.asarray(broken, dtype=float)])
    )
    return np.concatenate(
        [np.repeat(t[0], DEGREE + 1), inner, np.repeat(t[-1], DEGREE + 1)]
    )


def _solvable(t: Floats, knots: Floats) -> bool:
    """Whether every basis function has a sample of its own (Schoenberg & Whitney 1953)."""
    inner = slice(1, len(t) - 1)
    return bool(
        np.all(
            (knots[: len(t)][inner] < t[inner])
            & (t[inner] < knots[DEGREE + 1 :][inner])
        )
    )


def twice_integrated(t: Floats, integrals: Floats, moments: Floats) -> Floats:
    """Integral over each step of the integral since the first sample, shape (n_samples - 1, n_terms).

    `integrals` are those of the terms over each step, `moments` those of term times the
    time left to its end.
    """
    before = np.cumsum(integrals, axis=0) - integrals
    return before * np.diff(t)[:, None] + moments
