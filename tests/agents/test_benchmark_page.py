"""The benchmark's page: what it holds, and how it looks in a browser."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from agents import benchmark
from agents.benchmarking.page import write_page
from shipgym.errors import InputError
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
    assert 1e6 < len(text) < 4e6  # with plotly.js
    for one in (
        summary["suite"]["sha256"][:16],
        summary["versions"]["numba"],
        "1000000 to 1000004",
        "a &lt;b&gt;lazy one",
        "none could not run calm, turns: ",
        "3 controllers in 2 of 2 tasks, 5 episodes of each set",
        "rudder reversals, 1/min",
    ):
        assert one in text
    assert "<b>lazy" not in text
    shown = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.findall(r'(?:src|href)="(?!#)[^"]', shown)  # it loads nothing
    for sets in summary["tasks"].values():
        shown = [cell for on in ("ship", "fresh") for cell in sets[on].values()]
        for cell in shown:
            assert f"{cell['cost']['value']:#.3g}"[:3] in text


def test_a_page_that_cannot_be_written_is_refused(result, tmp_path):
    with pytest.raises(InputError, match=r"ends in \.html"):
        write_page(result, tmp_path / "page.txt")


def test_the_ranking_is_drawn_on_the_axes_of_a_user(result):
    ax = Figure().subplots()
    assert result.plot(ax) is ax
    (dots,) = ax.lines
    ranked = result.summary["ranking"]["steering"]
    scores = [one["scores"]["ship"] for one in ranked if one["scores"]]
    assert dots.get_xdata().tolist() == [one["value"] for one in scores]
    ranges = ax.collections[0].get_segments()
    assert [ends[0][0] for ends in ranges] == [one["low"] for one in scores]
