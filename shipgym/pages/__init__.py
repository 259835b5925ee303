"""Pages of results: one self-contained HTML file each, made from a template.

A page extends `shipgym.pages/page.html` and consists of the macros in
`shipgym.pages/parts.html`.
"""

from shipgym.pages.numbers import MINUS, NONE, fixed, number, percent
from shipgym.pages.templates import environment, plotly_script, render

__all__ = [
    "MINUS",
    "NONE",
    "environment",
    "fixed",
    "number",
    "percent",
    "plotly_script",
    "render",
]
