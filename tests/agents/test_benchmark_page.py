"""The benchmark's page: what it holds, and how it looks in a browser."""

import re
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import benchmark
from agents.benchmarking.page import write_page
from agents.cli import app
from shipgym.errors import InputError
from tests.agents.browser import COMMAND, Browser
from tests.agents.small_suite import write_suite


class Lazy:
    """Leaves the rudder amidships."""

    name = "a <b>lazy one"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.zeros((len(observation), 1), dtype=np.float32), state


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    return write_suite(tmp_path_factory.mktemp("suite"))


@pytest.fixture(scope="module")
def result(suite):
    """PID, and one that is given as an object and cannot run `turns`."""
    controllers = {"pid": "pid", Lazy.name: Lazy(), "none": lambda task: task.ship}
    return benchmark(controllers, suite, episodes=5)


@pytest.fixture(scope="module")
def page(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "index.html"
    write_page(result, path)
    return path


def test_the_page_holds_its_numbers_and_where_they_are_from(result, page):
    text = page.read_text(encoding="utf-8")
    summary = result.summary
    assert len(text) < 2e6
    for one in (
        summary["suite"]["sha256"][:16],
        summary["versions"]["numba"],
        "1000000 to 1000004",
        "a &lt;b&gt;lazy one",
        "none could not run calm, turns, turns-on-model, turns-far: ",
        "pid,a &lt;b&gt;lazy one=...,none=...",
        "--suite small.toml --episodes 5 --out results",
        "rudder reversals, 1/min",
    ):
        assert one in text
    assert "<b>lazy" not in text
    shown = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.findall(r'(?:src|href)="(?!#)[^"]', shown)  # it loads nothing
    for cells in summary["tasks"].values():
        for cell in cells.values():
            assert f"{cell['cost']['value']:#.3g}"[:3] in text


def test_a_page_that_cannot_be_written_is_refused(result, tmp_path):
    with pytest.raises(InputError, match=r"ends in \.html"):
        write_page(result, tmp_path / "page.txt")


@pytest.mark.parametrize("there", [True, False])
def test_the_command_writes_the_page_where_plotly_is_there(
    suite, tmp_path, monkeypatch, there
):
    if not there:
        monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    out = tmp_path / "results"
    words = ["benchmark", "--controllers", "pid", "--suite", str(suite)]
    words += ["--tasks", "calm", "--episodes", "2", "--workers", "1"]
    answer = CliRunner().invoke(app, [*words, "--page", "--out", str(out)])
    assert answer.exit_code == 0, answer.stderr
    assert (out / "results.json").exists()
    assert (out / "index.html").exists() == there
    assert ("there is no index.html: plotly is not installed" in answer.stderr) != there


@pytest.mark.skipif(COMMAND is None, reason="no chromium is installed")
@pytest.mark.parametrize("width", [1200, 400])
def test_the_page_is_drawn_offline_and_nothing_sticks_out(page, width):
    browser = Browser(width, 900)
    browser.resize(width, 900, mobile=width < 500)
    browser.open(page.as_uri())
    browser.wait("document.querySelectorAll('#scores .scatterlayer .trace').length > 1")
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.complaints == []
    assert set(browser.requests) == {page.as_uri()}
    browser.close()
