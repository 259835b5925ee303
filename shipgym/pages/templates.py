"""Pages from Jinja2 templates, which escape every text that they show."""

import json
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from shipgym.pages.numbers import NONE, counted, degrees, fixed, number, percent
from shipgym.plots.style import Figure


def render(template: str, **data: Any) -> str:
    """A page, as text; the same data gives the same text.

    The template is the package it lies in and its file, such as
    "identification.report/report.html". A variable of it that `data` lacks is an error.
    """
    return environment().get_template(template).render(contents=[], **data)


@cache
def environment() -> Environment:
    """Environment of all templates: escaping, number formats, and plotly.js."""
    made = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        loader=FunctionLoader(_source),
        finalize=lambda value: NONE if value is None else value,
        extensions=["jinja2.ext.do"],
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "counted": counted,
        "degrees": degrees,
        "fixed": fixed,
        "number": number,
        "percent": percent,
        "plotted": plotted,
        "sentence": sentence,
    }
    made.globals |= {
        "plotly_script": plotly_script,
        "dash": NONE,
        "version": version("shipgym"),
    }
    made.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    return made


def _source(name: str) -> tuple[str, str, None]:
    """The text of a template, and what tracebacks call it."""
    package, _, file = name.partition("/")
    return files(package).joinpath(file).read_text(encoding="utf-8"), name, None


def plotly_script() -> Markup:
    """The source of plotly.js, to stand once in a page.

    Its bundle `cartesian`, a third of the whole: lines, bars, boxes, histograms, heat
    maps, contours. The file is that of the npm package plotly.js-cartesian-dist-min
    4.1.1: plotly's Python package has the whole only, with which a page that works
    offline would be 5.5 MB.
    """
    source, *_ = _source("shipgym.pages/plotly/plotly-cartesian.min.js")
    return Markup(source.replace("</script", "<\\/script"))


def plotted(plot: Figure) -> dict[str, Any]:
    """Data and layout of a figure, ready for JSON."""
    fields: dict[str, Any] = json.loads(plot.to_json())
    return fields


def sentence(text: str) -> str:
    """A text with a capital at its beginning and a full stop at its end."""
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."
