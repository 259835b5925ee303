"""Integrals of the terms of a model over the steps of a record.

Three rules: Euler, trapezoid rule, and Gauss quadrature on broken splines.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from identification.samples.rudder import Rudder
from shipgym.arrays import Floats, Integers

Channels = Mapping[str, Floats]
#: The terms of each equation, arrays of shape (n_samples, n_terms), from the channels
#: at some times.
Terms = Callable[[Channels], dict[str, Floats]]

DEGREE = 3
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


class Integrals(NamedTuple):
    """Integrals over each step, by equation.

    Attributes
    ----------
    terms : dict of str to array of shape (n_samples - 1, n_terms)
        Of the terms.
    moments : dict of str to array of shape (n_samples - 1, n_terms)
        Of each term times the time that is left to the end of the step.
    """

    terms: dict[str, Floats]
    moments: dict[str, Floats]


def step_integrals(t: Floats, channels: Channels, terms: Terms, rule: str) -> Integrals:
    """Integrals over each step by its start ("euler") or by the trapezoid rule."""
    steps = np.diff(t)[:, None]
    found = Integrals({}, {})
    for equation, values in terms(channels).items():
        start = values[:-1]
        mean = start
        if rule != "euler":
            end = values[1:]
            mean = 0.5 * (start + end)
        integral = mean * steps
        found.terms[equation] = integral
        found.moments[equation] = 0.5 * integral * steps
    return found


def spline_integrals(
    t: Floats,
    channels: Channels,
    terms: Terms,
    rudder: Rudder,
) -> Integrals:
    """Integrals over each step by Gauss quadrature on splines.

    Both break where the rudder has corners.
    """
    rule = _quadrature(t, rudder.corners)
    times = rule.nodes.ravel()
    at_nodes = {}
    for name, values in channels.items():
        if name == "delta":
            at_nodes[name] = rudder(times)
        elif name == "n":  # it may jump
            at_nodes[name] = np.interp(times, t, values)
        else:
            at_nodes[name] = broken_spline(t, values, rudder)(times)
    found = Integrals({}, {})
    for equation, values in terms(at_nodes).items():
        found.terms[equation] = rule.integrated(values, rule.weights)
        found.moments[equation] = rule.integrated(values, rule.weights * rule.to_end)
    return found


class _Quadrature(NamedTuple):
    """Gauss quadrature between edges, the samples and the rudder's corners.

    Nodes, their weights and their times to the end of the step have the shape
    (n_pieces, 5).
    """

    nodes: Floats
    weights: Floats
    to_end: Floats
    first_of_step: Integers  # index of each step's first piece

    def integrated(self, values: Floats, weights: Floats) -> Floats:
        """Integrals over each step of values at the nodes, (n_nodes, n_terms)."""
        by_piece = values.reshape(*self.nodes.shape, -1)
        pieces = np.einsum("ijk,ij->ik", by_piece, weights)
        return np.asarray(np.add.reduceat(pieces, self.first_of_step, axis=0))


def _quadrature(t: Floats, corners: Floats) -> _Quadrature:
    edges = np.union1d(t, corners)
    middle = 0.5 * (edges[1:] + edges[:-1])
    half = 0.5 * np.diff(edges)[:, None]
    nodes = middle[:, None] + half * NODES

    following = np.searchsorted(
        t,
        middle,
        side="right",
    )
    ends = t[following]
    step = following - 1
    return _Quadrature(
        nodes=nodes,
        weights=half * WEIGHTS,
        to_end=ends[:, None] - nodes,
        first_of_step=np.flatnonzero(np.diff(step, prepend=-1)),
    )


def broken_spline(t: Floats, values: Floats, rudder: Rudder) -> BSpline:
    """Cubic spline through the samples of a velocity, broken at the rudder's corners.

    Where the rate of the rudder jumps the second derivative of a velocity does; at a
    jump of its acceleration the third does. A corner takes the place of as many knots
    at the nearest samples; one too close to another or to an end is passed over.
    """
    if len(t) <= DEGREE:
        return make_interp_spline(t, values, k=1)
    return make_interp_spline(t, values, k=DEGREE, t=_broken_knots(t, rudder))


def _broken_knots(t: Floats, rudder: Rudder) -> Floats:
    """Knots of the spline, at samples and corners."""
    not_a_knot = slice(2, len(t) - 2)
    knots = t[not_a_knot]
    corners: list[float] = []
    for corner, smoothness in zip(rudder.corners, rudder.smoothness, strict=True):
        multiplicity = DEGREE - 1 - int(smoothness)
        distances = np.abs(knots - corner)
        nearest = np.argsort(
            distances,
            kind="stable",
        )[:multiplicity]
        if len(nearest) < multiplicity or _is_far(t, knots[nearest], corner):
            continue
        kept = np.delete(knots, nearest)
        broken = corners + multiplicity * [corner]
        if _is_solvable(t, _with_ends(t, kept, broken)):
            knots = kept
            corners = broken
    return _with_ends(t, knots, corners)


def _is_far(t: Floats, knots: Floats, corner: float) -> bool:
    """Return whether a knot is more than two samples away from a corner."""
    away = np.searchsorted(t, knots) - np.searchsorted(t, corner)
    return bool(np.any(np.abs(away) > 2))


def _with_ends(t: Floats, knots: Floats, corners: list[float]) -> Floats:
    """Knots of the whole spline, with as many at either end as a cubic needs."""
    inner = np.sort(np.concatenate([knots, corners]))
    return np.pad(inner, DEGREE + 1, constant_values=(t[0], t[-1]))


def _is_solvable(t: Floats, knots: Floats) -> bool:
    """Return whether every basis function has a sample of its own.

    Source: Schoenberg & Whitney 1953. The first and the last have those at the ends.
    """
    has_sample = (knots[: len(t)] < t) & (t < knots[DEGREE + 1 :])
    return bool(np.all(has_sample[1:-1]))


def twice_integrated(t: Floats, integrals: Floats, moments: Floats) -> Floats:
    """Integral over each step of the integral since the first sample.

    `integrals` of the terms over each step and their `moments` (`Integrals`), all of
    shape (n_samples - 1, n_terms).
    """
    steps = np.diff(t)[:, None]
    before = np.cumsum(integrals, axis=0) - integrals
    return before * steps + moments
