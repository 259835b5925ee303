import hashlib
import re
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from agents.cli.autopilot import print_autopilot
from agents.verification.page import write_report
from shipgym import InputError, Trial
from shipgym.pages import environment, percent
from shipgym.plots import graph_objects
from tests.agents.browser import COMMAND, Browser
from tests.agents.conftest import DRAWS

PARTS = '{% import "shipgym.pages/parts.html" as parts with context %}'
HOSTILE = "</script><script>alert(1)</script>\"'&{{ 7 * 7 }}"


class Page(HTMLParser):
    """Collects what a browser would load, the sections and the text of a page."""

    def __init__(self, text):
        super().__init__()
        self.loaded, self.sections, self.links, self.text, self.depth = (
            [],
            [],
            [],
            [],
            [],
        )
        self.scripts = 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.loaded += [
            attributes[key] for key in ("src", "srcset", "data") if attributes.get(key)
        ]
        if tag == "link":
            self.loaded.append(attributes.get("href"))
        if tag == "a":
            self.links.append(attributes["href"])
        if tag == "section":
            self.sections.append(attributes["id"])
        if tag in ("script", "style"):
            self.depth.append(tag)
            self.scripts += tag == "script"

    def handle_endtag(self, tag):
        if tag in ("script", "style"):
            self.depth.pop()

    def handle_data(self, data):
        if not self.depth:
            self.text.append(data)


@pytest.fixture(scope="module")
def source(chain):
    return (chain[0] / "report.html").read_text()


@pytest.fixture(scope="module")
def page(source):
    return Page(source)


def test_nothing_is_loaded_from_anywhere(source, page):
    assert page.loaded == []
    assert "default-src 'none'" in source
    assert "@import" not in re.sub(r"<script>.*?</script>", "", source, flags=re.DOTALL)


def test_plotly_stands_in_the_page_once(source):
    assert source.count("plotly.js (cartesian - minified) v") == 1


def test_the_bundle_of_plotly_is_the_published_one():
    bundle = (
        files("shipgym.pages").joinpath("plotly/plotly-cartesian.min.js").read_bytes()
    )
    published = (  # npm, 4.1.1
        "79542150855a52c567260e3137095dbe2b744e6d702a5cabe67da246942fba7a"
    )
    assert hashlib.sha256(bundle).hexdigest() == published


def test_a_report_has_less_than_3_megabytes(source):
    assert len(source.encode()) < 3e6


def test_all_sections_are_there_and_in_the_contents(page):
    expected = [
        "data",
        "coefficients",
        "prediction",
        "manoeuvres",
        "autopilots",
        "ranking",
        "tracks",
        "origin",
    ]
    assert page.sections == expected
    assert page.links == ["#verdict", *(f"#{name}" for name in expected)]


def test_the_report_tells_what_the_metrics_hold(chain, page):
    text = " ".join(page.text)
    metrics = chain[1].metrics
    assert f"Unstable draws: {metrics['draws']['unstable']} of 24" in text
    assert f"{metrics['ranking'][0].upper()} steers best" in text
    for name in chain[1].model.coefficients:
        assert name in text
    for trial in chain[1].identification.trials:
        assert trial.name in text
    assert "estimated" in text


def test_the_chain_prints_its_tables(chain, capsys):
    print_autopilot(chain[1], Path("report.html"), DRAWS)
    printed = capsys.readouterr().out
    metrics = chain[1].metrics
    assert f"unstable draws: {metrics['draws']['unstable']} of {DRAWS}" in printed
    table = printed.partition("models drawn, best first")[2]
    places = [table.index(f"\n{name.upper()} ") for name in metrics["ranking"]]
    assert places == sorted(places)
    for name, criterion in chain[1].verification.criteria.items():
        assert name in printed
        if criterion.measured is not None:
            assert str(criterion.worse_measured).endswith(criterion.side)
            assert str(criterion.worse_measured) in printed
    assert "report: report.html" in printed


@pytest.mark.skipif(COMMAND is None, reason="no chromium is installed")
def test_a_browser_without_network_draws_every_figure_also_for_paper(chain):
    address = (chain[0] / "report.html").as_uri()
    browser = Browser()
    try:
        browser.open(address)
        browser.wait("document.querySelectorAll('.plot.js-plotly-plot').length === 6")
        browser.run("window.print = () => { window.printed = true; }")
        browser.click(".print")
        browser.wait("window.printed")
        widths = (
            "[...document.querySelectorAll('.js-plotly-plot')].map((plot) =>"
            " plot._fullLayout.width)"
        )
        browser.run("window.dispatchEvent(new Event('beforeprint'))")
        assert browser.run(widths) == 6 * [920]  # at a zoom of 0.75 the paper's
        browser.run("window.dispatchEvent(new Event('afterprint'))")
        assert min(browser.run(widths)) > 690
        assert (browser.complaints, browser.requests) == ([], [address])
    finally:
        browser.close()


def shown(template, **data):
    return environment().from_string(PARTS + template).render(contents=[], **data)


def test_texts_are_escaped_wherever_they_stand():
    template = """{% call parts.table([text], caption=text) %}
    {{ parts.row(text, parts.badge(text)) }}{% endcall %}
    {{ parts.header(text, text, text) }}
    {{ parts.note(text) }}
    {% call parts.verdict(text, "good") %}{% endcall %}
    {% call parts.section("one", text) %}{% endcall %}"""
    page = shown(template, text=HOSTILE)
    assert "<script" not in page
    assert page.count("&lt;/script&gt;&lt;script&gt;") == 10
    assert "49" not in page


def test_what_is_missing_is_a_dash():
    assert "<td>\N{EN DASH}</td>" in shown("{{ parts.row(none) }}")


def test_hostile_names_of_ship_trials_and_autopilots_stay_text(chain, tmp_path):
    """Escaped in the page's text, and unable to end the scripts that draw
    the figures."""
    result = chain[1]
    fit = result.identification
    ship = replace(
        result.ship, particulars=replace(result.ship.particulars, name=HOSTILE)
    )
    trials = tuple(
        Trial(one.t, one.channels, name=f"{HOSTILE}{k}", kind=one.kind, use=one.use)
        for k, one in enumerate(fit.trials)
    )
    names = {old.name: new.name for old, new in zip(fit.trials, trials, strict=True)}
    metrics = {
        "trials": {names[name]: found for name, found in fit.metrics["trials"].items()}
    }
    predictions = {
        names[name]: prediction for name, prediction in fit.predictions.items()
    }
    first, *others = result.verification.pilots
    found = replace(result.verification, pilots=(replace(first, key=HOSTILE), *others))
    hostile = replace(
        result,
        ship=ship,
        verification=found,
        identification=replace(
            fit, metrics=metrics, predictions=predictions, trials=trials
        ),
    )
    write_report(hostile, tmp_path / "report.html")
    source = (tmp_path / "report.html").read_text()
    assert Page(source).scripts == 8  # plotly.js, six figures, printing
    assert "<script>alert" not in source
    assert f"{HOSTILE}0" in " ".join(Page(source).text)
    assert HOSTILE.upper() in " ".join(Page(source).text)


def test_a_figure_cannot_end_the_script_it_stands_in():
    drawn = graph_objects().Figure(layout={"title": {"text": HOSTILE}, "height": 300})
    assert (
        shown('{{ parts.figure("plot", drawn, "") }}', drawn=drawn).count("</script>")
        == 1
    )


@pytest.mark.parametrize(
    ("share", "shown"),
    [(0.0, "0 %"), (0.004, "< 1 %"), (0.5, "50 %"), (0.995, "> 99 %"), (1.0, "100 %")],
)
def test_a_probability_is_certain_only_if_it_is(share, shown):
    assert percent(share) == shown


def test_figures_are_drawn_on_the_axes_of_a_user(chain):
    result = chain[1]
    for name in result.verification.panels(100.0):
        ax = Figure().subplots()
        assert result.plot(name, ax) is ax
        assert ax.lines
    labels = result.plot("heading", Figure().subplots()).get_legend_handles_labels()[1]
    pilots = {pilot.name for pilot in result.verification.pilots}
    assert {*labels} == {*pilots, "set course"}
    with pytest.raises(InputError, match="plot: expected one of 'criteria', 'heading'"):
        result.plot("step")
