"""Style that all figures share; plotly itself is imported when first used."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.extras import library

if TYPE_CHECKING:
    from plotly.graph_objects import Figure as Figure
else:
    Figure = Any  # plotly is imported when the first figure is made

Axis: TypeAlias = "str | dict[str, Any]"  # a title, or an `axis` with more than that

INK, MUTED, GRID = "#1f2a37", "#64748b", "#e5e9ef"
MEASURED, MODEL, LIMIT = "#1f2a37", "#1d70b8", "#c2412d"
PALETTE = (MODEL, "#d9822b", "#0f8a7e", "#a1478f", "#6b7a1e", "#7a5c45")
_FONT = "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'Liberation Sans', sans-serif"


def graph_objects() -> Any:
    """The module `plotly.graph_objects`; InputError if plotly is not installed."""
    return _plotly("graph_objects")


def _plotly(module: str) -> Any:
    return library(f"plotly.{module}", "report", "figures and reports need it")


class Panel(NamedTuple):
    """A part of a figure."""

    #: as plotly takes them; lines and points of one name are one entry of the legend
    traces: list[dict[str, Any]]
    x: Axis = ""
    y: Axis = ""
    title: str = ""


def panels(
    shown: Sequence[Panel],
    height: int,
    columns: int = 1,
    *,
    outer: bool = False,
    grid: Mapping[str, Any] | None = None,
    **changes: Any,
) -> Figure:
    """A figure of panels in the shared style, row by row.

    Its height is in pixels; with `outer`, titles of axes stand below the last row and
    next to the first column only. `grid` has settings of plotly's `make_subplots`, and
    `changes` those of `layout`.
    """
    columns = max(min(columns, len(shown)), 1)
    rows = max(math.ceil(len(shown) / columns), 1)
    if columns > 1:
        shown = [panel if panel.title else _titled(panel) for panel in shown]
    titles = [panel.title for panel in shown]
    is_titled = any(titles)
    settings = {"vertical_spacing": 0.36 / max(rows, 2)}
    if grid is not None:
        settings |= grid
    figure = _plotly("subplots").make_subplots(
        rows=rows,
        cols=columns,
        subplot_titles=titles if is_titled else None,
        **settings,
    )
    figure.update_annotations(font={"size": 12.5, "color": INK})

    # as plain dicts, since plotly checks a whole figure faster than one change after
    # the other
    drawn = figure.layout.to_plotly_json()
    for k, panel in enumerate(shown):
        number = _axis_number(k)
        x = as_axis(panel.x)
        y = as_axis(panel.y)
        if outer and k < columns * (rows - 1):
            x["title"] = {"text": ""}
        if outer and k % columns:
            y["title"] = {"text": ""}
        drawn[f"xaxis{number}"] |= x
        drawn[f"yaxis{number}"] |= y
    drawn |= _layout(height, titled=is_titled, **changes)
    figure.layout = plain_texts(drawn)
    figure.add_traces([plain_texts(trace) for trace in _placed_traces(shown)])
    return figure


def plain_texts(part: Any) -> Any:
    """A part of a figure whose texts mean no mark-up to plotly: names come from files.

    Its `hovertemplate`, which is ours, stays.
    """
    if isinstance(part, str):
        return part.replace("&", "&amp;").replace("<", "&lt;")
    if isinstance(part, dict):
        return {
            key: value if key == "hovertemplate" else plain_texts(value)
            for key, value in part.items()
        }
    if isinstance(part, np.ndarray) and part.dtype.kind in "OU":
        part = part.tolist()
    if isinstance(part, list | tuple):
        return [plain_texts(value) for value in part]
    return part


def _axis_number(k: int) -> str:
    """The number of the k-th panel's axes, as plotly names them: x, x2, x3, ..."""
    return str(k + 1) if k else ""


def _titled(panel: Panel) -> Panel:
    """A panel whose vertical axis is told above it: a title beside it takes width."""
    y = as_axis(panel.y)
    title = y["title"]["text"]
    return panel._replace(y={**y, "title": {"text": ""}}, title=title)


def as_axis(given: Axis) -> dict[str, Any]:
    """An axis, also of its title alone."""
    return axis(given) if isinstance(given, str) else dict(given)


def _placed_traces(shown: Sequence[Panel]) -> list[dict[str, Any]]:
    """Traces on the axes of their panels, the first of each name in the legend."""
    traces = []
    names = set[str]()
    for k, panel in enumerate(shown):
        number = _axis_number(k)
        for trace in panel.traces:
            drawn = {**trace, "xaxis": f"x{number}", "yaxis": f"y{number}"}
            name = trace.get("legendgroup")
            if name is not None and trace.get("showlegend", True):
                drawn["showlegend"] = name not in names
                names.add(name)
            traces.append(drawn)
    return traces


def _layout(
    height: int, *, titled: bool = False, left: int = 62, **changes: Any
) -> dict[str, Any]:
    """The layout that all figures share: white, a light grid, the legend above.

    Height and left margin in pixels (the width is that of the page); `titled` makes
    room for titles of panels below the legend; `changes` are entries of a plotly layout
    that replace these.
    """
    shared = {
        "height": height,
        "template": "none",
        "font": {"family": _FONT, "size": 12, "color": INK},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "margin": {"l": left, "r": 18, "t": 76 if titled else 36, "b": 46},
        "legend": {
            "orientation": "h",
            "x": 0.0,
            "y": 1.0,
            "yref": "container",
            "yanchor": "top",
            "font": {"size": 12},
        },
        "hoverlabel": {"font": {"family": _FONT, "size": 12}},
        "hovermode": "x unified",
    }
    return shared | changes


def axis(title: str = "", zero: bool = False, **changes: Any) -> dict[str, Any]:
    """Axis in the shared style, with a title and perhaps a line at zero."""
    shared = {
        "title": {"text": title, "font": {"size": 12, "color": MUTED}, "standoff": 8},
        "gridcolor": GRID,
        "zeroline": zero,
        "zerolinecolor": GRID,
        "linecolor": "#c5ccd6",
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": "#c5ccd6",
        "tickfont": {"size": 11, "color": MUTED},
    }
    return shared | changes


def compact(values: ArrayLike) -> NDArray[np.float32]:
    """Values in single precision: half the size in a file, and finer than a pixel."""
    return np.asarray(values, dtype=np.float32)


def line_styles(labels: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Line of each label: measurements thin and dark, others by the palette."""
    styles: dict[str, dict[str, Any]] = {}
    palette = cycle(PALETTE)
    for label in labels:
        if label == "measured":
            styles[label] = {"colour": MEASURED, "width": 1.5}
        else:
            styles[label] = {"colour": next(palette), "width": 2.0}
    return styles


def translucent(colour: str, opacity: float) -> str:
    """A colour "#rrggbb" with an opacity."""
    return f"{colour}{round(255 * opacity):02x}"


def line(
    x: ArrayLike,
    y: ArrayLike,
    name: str,
    colour: str,
    width: float = 1.9,
    mode: str = "lines",
    **more: Any,
) -> dict[str, Any]:
    """A line; `more` are settings of plotly's `Scatter`."""
    return {
        "type": "scatter",
        "x": compact(x),
        "y": compact(y),
        "name": name,
        "legendgroup": name,
        "mode": mode,
        "line": {"color": colour, "width": width},
        **more,
    }


def points(
    x: ArrayLike, y: ArrayLike, name: str, colour: str, size: float = 7.0, **more: Any
) -> dict[str, Any]:
    """Markers; `more` are settings of plotly's `Scatter`."""
    return line(
        x,
        y,
        name,
        colour,
        mode="markers",
        marker={"color": colour, "size": size},
        **more,
    )
