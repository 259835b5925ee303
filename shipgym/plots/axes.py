"""Panels of figures on axes of matplotlib."""

from typing import Any

from shipgym.extras import axes_of
from shipgym.plots.style import Panel, as_axis

DASHES = {"dot": ":", "dash": "--"}


def draw(panel: Panel, ax: Any = None) -> Any:
    """Draw a panel on axes of matplotlib, by default the current ones; returns them."""
    ax = axes_of(ax)
    named = set[str]()
    for trace in panel.traces:
        name = trace["name"]
        label = None if name in named else name
        named.add(name)
        x, y, line = trace["x"], trace["y"], trace["line"]
        if "fillcolor" in trace:
            ax.fill(x, y, color=trace["fillcolor"], linewidth=0, label=label)
        elif trace["mode"] == "markers":
            dots = {"color": trace["marker"]["color"], "markeredgewidth": 0}
            ax.plot(x, y, "o", markersize=3, label=label, **dots)
        else:
            dash = DASHES.get(trace.get("line_dash", ""), "-")
            width = 0.75 * line["width"]  # of pixels in points
            ax.plot(x, y, dash, color=line["color"], linewidth=width, label=label)
    x_axis, y_axis = as_axis(panel.x), as_axis(panel.y)
    ax.set(xlabel=x_axis["title"]["text"], ylabel=y_axis["title"]["text"])
    if "ticktext" in y_axis:
        ax.set_yticks(y_axis["tickvals"], y_axis["ticktext"])
        ax.invert_yaxis()
    if "scaleanchor" in y_axis:
        ax.set_aspect("equal", "datalim")
    ax.legend()
    return ax
