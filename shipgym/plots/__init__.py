"""Figures of trials and manoeuvres.

The figures are made with plotly, from the extra ``report``; nothing else of shipgym needs it.
"""

from shipgym.plots.manoeuvres import (
    excitation_figure,
    manoeuvre_figure,
    pull_out_figure,
    speed_figure,
    spiral_figure,
    turning_figure,
    zigzag_figure,
)
from shipgym.plots.style import (
    GRID,
    INK,
    LIMIT,
    MEASURED,
    MODEL,
    MUTED,
    PALETTE,
    axis,
    compact,
    graph_objects,
    label,
    layout,
    line,
    line_styles,
    subplots,
    translucent,
)
from shipgym.plots.trials import AXES, history_figure, path_figure

__all__ = [
    "AXES", "GRID", "INK", "LIMIT", "MEASURED", "MODEL", "MUTED", "PALETTE", "axis", "compact",
    "excitation_figure", "graph_objects", "history_figure", "label", "layout", "line", "line_styles",
    "manoeuvre_figure", "path_figure", "pull_out_figure", "speed_figure", "spiral_figure", "subplots",
    "translucent", "turning_figure", "zigzag_figure",
]  # fmt: skip
