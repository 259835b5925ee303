"""Pieces of an HTML page: escaped text, numbers, tables, figures."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

NONE = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"
FIGURE_SETTINGS = {
    "displaylogo": False,
    "displayModeBar": "hover",
    "modeBarButtons": [["toImage", "resetScale2d"]],
    "responsive": True,
}


class Html(str):
    """Text that is HTML already; every other text is escaped."""

    __slots__ = ()


def html(value: Any) -> Html:
    """A value as HTML: escaped unless it is `Html`; None as a dash."""
    if isinstance(value, Html):
        return value
    return Html(NONE if value is None else escape(str(value)))


def number(value: float | None, digits: int = 3) -> Html:
    """A number with so many significant digits, a true minus, and no needless exponent."""
    if value is None or not np.isfinite(value):
        return Html(NONE)
    if value == 0.0:
        return Html("0")
    if not 1e-4 <= abs(value) < 1e7:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return Html(f"{mantissa} · 10<sup>{int(exponent)}</sup>".replace("-", MINUS))
    decimals = max(digits - 1 - int(np.floor(np.log10(abs(value)))), 0)
    return Html(f"{value:.{decimals}f}".replace("-", MINUS))


def fixed(value: float | None, decimals: int = 2) -> Html:
    """A number with so many decimals and a true minus."""
    if value is None or not np.isfinite(value):
        return Html(NONE)
    return Html(f"{value:.{decimals}f}".replace("-", MINUS))


def percent(share: float) -> Html:
    """A share as a percentage: whole per cents, but never 0 or 100 unless it is so."""
    if not np.isfinite(share):
        return Html(NONE)
    if 0.0 < share < 0.01:
        return Html("&lt; 1 %")
    if 0.99 < share < 1.0:
        return Html("&gt; 99 %")
    return Html(f"{100.0 * share:.0f} %")


def badge(text: str, kind: str) -> Html:
    """A coloured word; kind is "good", "warn", "bad" or "plain"."""
    return Html(f'<span class="badge {kind}">{html(text)}</span>')


def table(
    head: Sequence[Any], rows: Iterable[Sequence[Any]], text_columns: int = 1, caption: Any = None
) -> Html:
    """A table; the first `text_columns` columns hold text, the others numbers, set to the right.

    Parameters
    ----------
    head : sequence
        Head of each column.
    rows : iterable of sequence
        Cells, escaped unless they are `Html`.
    text_columns : int
        How many columns from the left hold text.
    caption : str or Html, optional
        What the table shows, with units.
    """

    def row(cells: Sequence[Any], tag: str) -> str:
        shown = (
            f"<{tag}{'' if k < text_columns else ' class=num'}>{html(cell)}</{tag}>"
            for k, cell in enumerate(cells)
        )
        return f"<tr>{''.join(shown)}</tr>"

    body = "\n".join(row(cells, "td") for cells in rows)
    legend = "" if caption is None else f"<caption>{html(caption)}</caption>"
    return Html(
        f'<div class="scroll"><table>{legend}<thead>{row(head, "th")}</thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def figure(plot: Figure, name: str, caption: Any) -> Html:
    """A plotly figure in place, with its caption; the page must hold plotly.js once.

    Parameters
    ----------
    plot : plotly.graph_objects.Figure
    name : str
        Unique in the page.
    caption : str or Html
        What the figure shows.
    """
    fields = json.loads(plot.to_json())
    data = _script_safe(json.dumps(fields["data"]))
    layout = _script_safe(json.dumps(fields["layout"]))
    settings = json.dumps(FIGURE_SETTINGS)
    height = fields["layout"].get("height", 400)
    return Html(
        f'<figure id="{escape(name)}">'
        f'<div class="plot" id="plot-{escape(name)}" style="height:{height}px"></div>'
        f"<figcaption>{html(caption)}</figcaption>"
        f'<script>Plotly.newPlot("plot-{escape(name)}",{data},{layout},{settings});</script></figure>'
    )


def _script_safe(text: str) -> str:
    """JSON that cannot end the script element it stands in."""
    return text.replace("<", "\\u003c")


def paragraph(*parts: Any) -> Html:
    """A paragraph of texts and HTML."""
    return Html(f"<p>{''.join(html(part) for part in parts)}</p>")


def note(text: Any, kind: str = "plain") -> Html:
    """A set-off remark; kind as in `badge`."""
    return Html(f'<div class="note {kind}">{html(text)}</div>')


def section(name: str, title: str, *parts: Html) -> Html:
    """A section with its heading."""
    return Html(f'<section id="{escape(name)}"><h2>{html(title)}</h2>\n{"".join(parts)}</section>')


def columns(*parts: Html) -> Html:
    """Parts side by side where the screen is wide enough."""
    return Html(f'<div class="columns">{"".join(f"<div>{part}</div>" for part in parts)}</div>')


def join(parts: Iterable[Any], separator: str = "") -> Html:
    """Parts one after the other."""
    return Html(separator.join(html(part) for part in parts))
