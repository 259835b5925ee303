"""Figure of the coefficients of a fit with their intervals."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.fit import Fit
from shipgym.arrays import Flags, Floats, Integers
from shipgym.manoeuvres.quantiles import NORMAL_95
from shipgym.plots import Panel, axis, compact, panels, points
from shipgym.plots.style import LIMIT, MODEL, Figure

PALE = "#b3bcc7"


@dataclass(frozen=True, eq=False)
class _Intervals:
    """95 % intervals of coefficients by their sizes, of one that is 0 by 1."""

    names: Sequence[str]
    centre: Floats  # -1, 0 or 1 squared: 0 for a coefficient that is 0
    half: Floats  # half of the width

    @property
    def significant(self) -> Flags:
        """Whether an interval does not reach 0."""
        return (self.half < 1.0) & (self.centre > 0.0)


def coefficients_figure(fit: Fit) -> Figure:
    """95 % interval of each coefficient by its size; one that reaches 0 is not significant."""
    intervals = _intervals(fit)
    count = len(intervals.names)
    columns = 1 if count < 12 else 2
    rows = -(-count // columns)  # rounded up
    shown = []
    for first in range(0, columns * rows, rows):
        places = np.arange(first, min(first + rows, count))
        shown.append(_panel(intervals, places, rows))
    return panels(
        shown,
        20 * rows + 110,
        columns,
        grid={"horizontal_spacing": 0.16},
        left=84,
        hovermode="closest",
    )


def _intervals(fit: Fit) -> _Intervals:
    values = np.array(list(fit.coefficients.values()))
    errors = np.array(list(fit.standard_errors.values()))
    size = np.abs(values)
    size[size == 0.0] = 1.0
    half = NORMAL_95 * np.nan_to_num(errors) / size
    return _Intervals(list(fit.coefficients), np.sign(values) ** 2, half)


def _panel(intervals: _Intervals, places: Integers, rows: int) -> Panel:
    """A column of intervals, the first coefficient on top."""
    significant = intervals.significant[places]
    traces = [
        _bars(intervals, places[significant], places[0], "significant", MODEL),
        _bars(intervals, places[~significant], places[0], "not significant", PALE),
    ]
    names = [intervals.names[place] for place in places]
    labels = axis(
        tickvals=list(range(len(names))), ticktext=names, range=[rows - 0.5, -0.5]
    )
    shares = axis(
        "per cent of the estimate",
        range=[-130, 330],
        zeroline=True,
        zerolinecolor=LIMIT,
    )
    return Panel(traces, shares, labels)


def _bars(
    intervals: _Intervals, places: Integers, first: int, name: str, colour: str
) -> Any:
    """Dots with bars from -150 to 350 per cent at most, by how far they lie below the first."""
    centre, half = intervals.centre[places], intervals.half[places]
    low = np.maximum(centre - half, -1.5)
    high = np.minimum(centre + half, 3.5)
    bars = {
        "type": "data",
        "symmetric": False,
        "array": compact(100.0 * (high - centre)),
        "arrayminus": compact(100.0 * (centre - low)),
        "color": colour,
        "thickness": 1.8,
        "width": 3,
    }
    text = []
    for place in places:
        per_cent = 100.0 * intervals.half[place]
        text.append(f"{intervals.names[place]}: ± {per_cent:.3g} %")
    return points(
        100.0 * centre,
        places - first,
        name,
        colour,
        error_x=bars,
        text=text,
        hovertemplate="%{text}<extra></extra>",
    )
