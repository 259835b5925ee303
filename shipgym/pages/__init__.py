"""Pages of results: one self-contained HTML file each, made from a template.

A page extends `shipgym.pages/page.html` and consists of the macros in
`shipgym.pages/parts.html`.
"""

from shipgym.pages.numbers import NONE as NONE
from shipgym.pages.numbers import fixed as fixed
from shipgym.pages.numbers import number as number
from shipgym.pages.numbers import percent as percent
from shipgym.pages.templates import environment as environment
from shipgym.pages.templates import render as render
