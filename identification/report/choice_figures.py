"""Figures of how a method chose its settings: rank, weight C or insensitive band."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.estimators.lssvm import TruncatedLSSVM
from identification.estimators.search import BAND, LOG_C, SearchResult
from identification.judging.fit import Fit
from identification.judging.warnings import EQUATIONS
from shipgym.arrays import Floats
from shipgym.plots import PALETTE, Panel, axis, compact, line, panels, points
from shipgym.plots.style import LIMIT, MUTED, Figure


def truncated(fit: Fit) -> dict[str, TruncatedLSSVM]:
    """The estimators, by equation, that chose or were given a rank."""
    found = {}
    for q, estimator in fit.estimators.items():
        if not isinstance(estimator, TruncatedLSSVM):
            continue
        full = estimator.selection == "full" and estimator.rank is None
        if not full:
            found[q] = estimator
    return found


def l_curve_figure(estimators: Mapping[str, TruncatedLSSVM]) -> Figure:
    """Size of residuals and of solution for every rank, one panel for each equation."""
    shown = [_l_curve_panel(q, estimator) for q, estimator in estimators.items()]
    return panels(
        shown,
        360,
        len(shown),
        outer=True,
        grid={"horizontal_spacing": 0.09},
        left=70,
        hovermode="closest",
    )


def _l_curve_panel(q: str, estimator: TruncatedLSSVM) -> Panel:
    curve, rank = estimator.l_curve_, estimator.rank_
    x = compact(curve.residual_norm)
    y = compact(curve.solution_norm)
    ranks = [str(k) for k in range(1, len(x) + 1)]
    all_ranks = line(
        x,
        y,
        "rank 1, 2, ...",
        MUTED,
        1.2,
        "lines+markers",
        marker={"color": MUTED, "size": 5},
        text=ranks,
        hovertemplate="rank %{text}<extra></extra>",
    )
    own = slice(rank - 1, rank)
    chosen = points(
        x[own],
        y[own],
        "chosen",
        LIMIT,
        9,
        hoverinfo="skip",
        cliponaxis=False,
    )
    return Panel(
        [all_ranks, chosen],
        _logarithmic("norm of the residuals", x),
        _logarithmic("norm of the solution", y),
        f"{EQUATIONS[q]}: rank {rank} of {len(x)}",
    )


def _logarithmic(title: str, values: NDArray[np.float32]) -> dict[str, Any]:
    """An axis in decades, or in steps of 1, 2, 5 where there are few."""
    positive = np.finfo(np.float32).tiny
    smallest = max(values.min(), positive)
    few_decades = values.max() < 100.0 * smallest
    return axis(
        title,
        type="log",
        dtick="D2" if few_decades else 1,
        tickformat="~g",
    )


def search_figure(searches: Mapping[str, SearchResult]) -> Figure:
    """Objective, and weight C or insensitive band, by the rounds of a search.

    By equation; the objective relative to the final one.
    """
    objectives, best = list[Any](), list[Any]()
    one_for_all = _is_one_for_all(searches)
    for (q, search), colour in zip(searches.items(), PALETTE, strict=False):
        name = EQUATIONS.get(q, q)
        rounds = np.arange(len(search.history))
        setting = line(rounds, _best_settings(search), name, colour)
        best.append(setting)
        if not objectives or not one_for_all:
            relative = _relative_objective(search)
            curve = line(rounds, relative, name, colour, showlegend=False)
            objectives.append(curve)

    round_axis = axis("round", rangemode="tozero")
    title = "best objective, relative to the final one"
    left = Panel(objectives, round_axis, axis(), title)
    right = Panel(best, round_axis, *_setting_axis(searches))
    return panels(
        [left, right],
        height=340,
        columns=2,
        grid={"horizontal_spacing": 0.1},
        hovermode="closest",
    )


def _is_one_for_all(searches: Mapping[str, SearchResult]) -> bool:
    """Tell whether all equations share one search."""
    histories = {id(search.history) for search in searches.values()}
    return len(histories) == 1


def _setting_axis(searches: Mapping[str, SearchResult]) -> tuple[Any, str]:
    """The axis of what was searched for, and the title above it."""
    if all(_finds_weight(search) for search in searches.values()):
        return axis(type="log", tickformat=".0e"), "best C"
    return axis(range=[0.0, 1.0]), f"best {BAND}"


def _finds_weight(search: SearchResult) -> bool:
    return search.variable == LOG_C


def _best_settings(search: SearchResult) -> Floats:
    """Weight C or insensitive band that was best after each round."""
    values = search.course[:, 0]
    if _finds_weight(search):
        return np.asarray(10.0**values)
    return values


def _relative_objective(search: SearchResult) -> Floats:
    if search.value > 0.0:
        return search.history / search.value
    return search.history
