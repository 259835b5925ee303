"""Figures of how a method chose its settings: the rank, the weight C or the insensitive band."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.estimators.lssvm import TruncatedLSSVM
from identification.fit import Fit
from identification.search import SearchResult
from identification.search.search import BAND, LOG_C
from identification.validation.warnings import EQUATIONS
from shipgym.plots import PALETTE, Panel, axis, compact, line, panels, points
from shipgym.plots.style import LIMIT, MUTED, Figure


def truncated(fit: Fit) -> dict[str, TruncatedLSSVM]:
    """The estimators, by equation, that chose or were given a rank."""
    return {
        q: estimator
        for q, estimator in fit.estimators.items()
        if isinstance(estimator, TruncatedLSSVM)
        and (estimator.selection != "full" or estimator.rank is not None)
    }


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
    x, y = compact(curve.residual_norm), compact(curve.solution_norm)
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
        x[own], y[own], "chosen", LIMIT, 9, hoverinfo="skip", cliponaxis=False
    )
    return Panel(
        [all_ranks, chosen],
        _logarithmic("norm of the residuals", x),
        _logarithmic("norm of the solution", y),
        f"{EQUATIONS[q]}: rank {rank} of {len(x)}",
    )


def _logarithmic(title: str, values: NDArray[np.float32]) -> dict[str, Any]:
    """An axis in decades, or in steps of 1, 2, 5 where there are few."""
    smallest = max(values.min(), np.finfo(np.float32).tiny)
    few_decades = values.max() < 100.0 * smallest
    step = "D2" if few_decades else 1
    return axis(title, type="log", dtick=step, tickformat="~g")


def search_figure(searches: Mapping[str, SearchResult]) -> Figure:
    """Objective, and weight C or insensitive band, that a search had found after each of its rounds.

    By equation; relative to the final objective.
    """
    histories = {id(search.history) for search in searches.values()}
    one_for_all = len(histories) == 1
    weights = all(search.variable == LOG_C for search in searches.values())

    objectives, best = list[Any](), list[Any]()
    for (q, search), colour in zip(searches.items(), PALETTE, strict=False):
        name = EQUATIONS.get(q, q)
        rounds = np.arange(len(search.history))
        relative = search.history
        if search.value > 0.0:
            relative = search.history / search.value
        if not objectives or not one_for_all:
            objectives.append(line(rounds, relative, name, colour, showlegend=False))
        values = search.course[:, 0]
        if weights:
            values = 10.0**values
        best.append(line(rounds, values, name, colour))

    round_axis = axis("round", rangemode="tozero")
    title = "best objective, relative to the final one"
    left = Panel(objectives, round_axis, axis(), title)
    right = Panel(best, round_axis, axis(range=[0.0, 1.0]), f"best {BAND}")
    if weights:
        log_axis = axis(type="log", tickformat=".0e")
        right = Panel(best, round_axis, log_axis, "best C")
    grid = {"horizontal_spacing": 0.1}
    return panels([left, right], 340, 2, grid=grid, hovermode="closest")
