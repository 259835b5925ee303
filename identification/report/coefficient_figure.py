"""Figure of the coefficients of a fit with their intervals."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from identification.judging.fit import Fit
from shipgym.manoeuvres.quantiles import NORMAL_95
from shipgym.plots import Panel, axis, compact, panels, points
from shipgym.plots.style import LIMIT, MODEL, Figure


class _Bar(NamedTuple):
    """95 % interval of a coefficient, per cent of its size, of one that is 0 of 1."""

    name: str
    centre: float
    half: float  # of the width

    @property
    def significant(self) -> bool:
        """True where the interval does not reach 0."""
        return self.half < self.centre


def coefficients_figure(fit: Fit) -> Figure:
    """95 % interval of each coefficient; one that reaches 0 is not significant."""
    bars = [_bar(fit, name) for name in fit.coefficients]
    columns = 1 if len(bars) < 12 else 2
    rows = -(-len(bars) // columns)  # rounded up
    shown = []
    for first in range(0, columns * rows, rows):
        shown.append(_panel(bars[first : first + rows], rows))
    return panels(
        shown,
        20 * rows + 110,
        columns,
        grid={"horizontal_spacing": 0.16},
        left=84,
        hovermode="closest",
    )


def _bar(fit: Fit, name: str) -> _Bar:
    value = fit.coefficients[name]
    error = float(np.nan_to_num(fit.standard_errors[name]))
    half = 100.0 * NORMAL_95 * error
    if value == 0.0:
        return _Bar(name, centre=0.0, half=half)
    return _Bar(
        name,
        centre=100.0,
        half=half / abs(value),
    )


def _panel(bars: Sequence[_Bar], rows: int) -> Panel:
    """A column of intervals, the first coefficient on top."""
    pale = "#b3bcc7"
    traces = [
        _trace(bars, True, "significant", MODEL),
        _trace(bars, False, "not significant", pale),
    ]
    labels = axis(
        tickvals=list(range(len(bars))),
        ticktext=[bar.name for bar in bars],
        range=[rows - 0.5, -0.5],
    )
    shares = axis(
        "per cent of the estimate",
        range=[-130, 330],
        zeroline=True,
        zerolinecolor=LIMIT,
    )
    return Panel(traces, shares, labels)


def _trace(bars: Sequence[_Bar], significant: bool, name: str, colour: str) -> Any:
    """Dots with bars, of the coefficients that are significant or of the others."""
    places = [k for k, bar in enumerate(bars) if bar.significant == significant]
    shown = [bars[place] for place in places]
    error = {
        "type": "data",
        "array": compact([bar.half for bar in shown]),
        "color": colour,
        "thickness": 1.8,
        "width": 3,
    }
    return points(
        [bar.centre for bar in shown],
        places,
        name,
        colour,
        error_x=error,
        text=[f"{bar.name}: ± {bar.half:.3g} %" for bar in shown],
        hovertemplate="%{text}<extra></extra>",
    )
