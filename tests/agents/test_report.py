import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest

from agents.verification.figures import band, translucent
from shipgym.pages import Html, figure, fixed, html, number, percent, table
from shipgym.plots import graph_objects


class Page(HTMLParser):
    """Collects what a browser would load, the sections and the text of a page."""

    def __init__(self, text):
        super().__init__()
        self.loaded, self.sections, self.links, self.text, self.depth = [], [], [], [], []
        self.scripts = 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.loaded += [attributes[key] for key in ("src", "srcset", "data") if attributes.get(key)]
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
    assert source.count("plotly.js v") == 1


def test_all_sections_are_there_and_in_the_contents(page):
    expected = ["data", "coefficients", "prediction", "manoeuvres", "autopilots", "ranking", "origin"]
    assert page.sections == expected
    assert page.links == ["#verdict", *(f"#{name}" for name in expected)]


def test_the_report_tells_what_the_metrics_hold(chain, page):
    text = " ".join(page.text)
    metrics = chain[1].metrics
    assert f"Unstable draws: {metrics['draws']['unstable']} of 24" in text
    assert f"{metrics['ranking'][0].upper()} steers best" in text
    for name in chain[1].model.coefficients:
        assert name in text
    for trial in chain[1].trials:
        assert trial.name in text
    assert "estimated" in text


def test_every_figure_has_a_caption_and_a_place(source):
    names = re.findall(r'Plotly.newPlot\("plot-([\w-]+)"', source)
    assert len(names) == len(set(names)) == source.count("<figcaption>") == 7
    for name in names:
        assert f'id="plot-{name}"' in source


@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
def test_a_browser_without_network_draws_every_figure(chain):
    browser = ("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage")
    quiet = ("--disable-background-networking", "--disable-component-update", "--disable-sync")
    offline = ("--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=8000", "--dump-dom")
    drawn = subprocess.run(
        [*browser, *quiet, *offline, f"file://{chain[0] / 'report.html'}"],
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    assert drawn.stdout.count('class="plot js-plotly-plot"') == 7


def test_text_is_escaped_and_html_is_not():
    assert html("<b>") == "&lt;b&gt;"
    assert html(Html("<b>")) == "<b>"
    assert "&lt;script&gt;" in table(["<script>"], [])


def test_a_figure_cannot_end_the_script_it_stands_in():
    drawn = graph_objects().Figure(layout={"title": {"text": "</script><script>alert(1)"}})
    assert figure(drawn, "plot", "").count("</script>") == 1


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0012345, "0.00123"),
        (-12.345, "\N{MINUS SIGN}12.3"),
        (1234.5, "1234"),
        (0.0, "0"),
        (None, "\N{EN DASH}"),
        (np.inf, "\N{EN DASH}"),
        (1.2345e-6, "1.23 · 10<sup>\N{MINUS SIGN}6</sup>"),
    ],
)
def test_numbers_have_three_significant_digits(value, shown):
    assert number(value) == shown


def test_a_minus_is_a_minus():
    assert fixed(-1.0, 1) == "\N{MINUS SIGN}1.0"


@pytest.mark.parametrize(
    ("share", "shown"),
    [(0.0, "0 %"), (0.004, "&lt; 1 %"), (0.5, "50 %"), (0.995, "&gt; 99 %"), (1.0, "100 %")],
)
def test_a_probability_is_certain_only_if_it_is(share, shown):
    assert percent(share) == shown


def test_a_band_goes_from_5_to_95_per_cent():
    t, values = np.arange(3.0), np.linspace(0.0, 1.0, 101)[:, None] * np.ones(3)
    (drawn,) = band(t, values, "spread", "#1d70b8")
    assert np.asarray(drawn.y, dtype=float) == pytest.approx([0.95] * 3 + [0.05] * 3)


def test_a_translucent_colour():
    assert translucent("#1d70b8", 0.5) == "rgba(29,112,184,0.5)"
