"""Pages of results: one HTML file with its figures, which loads nothing from anywhere."""

from shipgym.pages.elements import (
    MINUS,
    NONE,
    Html,
    badge,
    columns,
    figure,
    fixed,
    html,
    join,
    note,
    number,
    paragraph,
    percent,
    section,
    table,
)
from shipgym.pages.page import card, cards, header, page, plotly_script, verdict

__all__ = [
    "MINUS",
    "NONE",
    "Html",
    "badge",
    "card",
    "cards",
    "columns",
    "figure",
    "fixed",
    "header",
    "html",
    "join",
    "note",
    "number",
    "page",
    "paragraph",
    "percent",
    "plotly_script",
    "section",
    "table",
    "verdict",
]
