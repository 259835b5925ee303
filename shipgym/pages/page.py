"""A whole page: sections, contents, style and plotly.js in one file that works offline."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from string import Template

import shipgym
from shipgym.errors import InputError
from shipgym.pages.elements import Html, html, join


def plotly_script() -> str:
    """The source of plotly.js, to stand once in a page.

    Raises
    ------
    InputError
        If plotly is not installed.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ModuleNotFoundError as error:
        raise InputError(
            "plotly is not installed, the report needs it: pip install 'shipgym[report]'"
        ) from error
    return str(get_plotlyjs()).replace("</script", "<\\/script")


def page(title: str, body: Mapping[str, Html], titles: Mapping[str, str], head: Html | None = None) -> str:
    """A whole page.

    Parameters
    ----------
    title : str
        Of the browser's window.
    body : mapping of str to Html
        Sections by their name, in order.
    titles : mapping of str to str
        What the table of contents calls them; sections without a title are not in it.
    head : Html, optional
        What stands at the end of the page's head; by default plotly.js.

    Returns
    -------
    str

    Raises
    ------
    InputError
        If plotly is not installed.
    """
    template = Template(files("shipgym.pages").joinpath("template.html").read_text(encoding="utf-8"))
    contents = join(
        Html(f'<li><a href="#{name}">{html(titles[name])}</a></li>') for name in body if name in titles
    )
    return template.substitute(
        title=html(title),
        version=html(shipgym.__version__),
        head=Html(f"<script>{plotly_script()}</script>") if head is None else head,
        contents=contents,
        body=join(body.values(), "\n"),
    )


def header(kicker: str, title: object, lead: object) -> Html:
    """Top of a page: what kind of page it is, its title, and one sentence."""
    return Html(
        f"<header><p class=kicker>{html(kicker)}</p><h1>{html(title)}</h1>"
        f"<p class=lead>{html(lead)}</p></header>"
    )


def card(label: str, value: object, detail: object) -> Html:
    """One fact of a verdict."""
    return Html(
        f'<div class="card"><div class="label">{html(label)}</div><div class="value">{html(value)}</div>'
        f'<div class="detail">{html(detail)}</div></div>'
    )


def verdict(headline: object, kind: str, *parts: Html) -> Html:
    """The box on top of a page: a sentence, marked "good", "warn" or "bad", and what belongs to it."""
    return Html(
        f'<div class="verdict {kind}" id="verdict"><div class="headline">{html(headline)}</div>'
        f"{join(parts)}</div>"
    )


def cards(*found: Html) -> Html:
    """Facts of a verdict, side by side."""
    return Html(f'<div class="cards">{join(found)}</div>')
