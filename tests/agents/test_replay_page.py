"""The replay page in a browser: what a person does with it, and what it shows then."""

import re

import numpy as np
import pytest

from agents.rollouts import write_replay
from tests.agents.browser import COMMAND, Browser
from tests.agents.test_replay import DT, END, STEPS, episode

pytestmark = pytest.mark.skipif(COMMAND is None, reason="no chromium is installed")


@pytest.fixture(scope="module")
def browser():
    browser = Browser()
    yield browser
    browser.close()


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Two runs of different ships, the second half as long and 200 m to the east."""
    folder = tmp_path_factory.mktemp("replay")
    first = episode()
    half = STEPS // 2
    states = {name: values[: half + 1] for name, values in first.states.items()}
    second = episode(
        model="</script><b>container",
        length=50.0,
        states={**states, "y": states["y"] + 200.0},
        commands={},
        reward_parts={},
        info={},
        rewards=first.rewards[:half],
        actions=first.actions[:half],
    )
    first.save(folder / "first.json")
    second.save(folder / "second.json")
    write_replay(
        [folder / "first.json", folder / "second.json"], folder / "replay.html"
    )
    return (folder / "replay.html").as_uri()


@pytest.fixture
def opened(browser, page):
    """The page at its beginning; after each test it must be quiet and offline."""
    browser.resize(1000, 700)
    browser.open("about:blank")
    browser.open(page)
    browser.wait("document.querySelectorAll('.ship').length === 2")
    yield browser
    assert browser.complaints == []
    assert browser.requests == [page]


def ship(browser, run=0):
    """Position and heading of the ship of a run on the chart: east, south, heading."""
    script = f"chart.ships[{run}].ship.getAttribute('transform')"
    return [
        float(number)
        for number in re.findall(r"-?[\d.]+(?:e-?\d+)?", browser.run(script))
    ]


def slide(browser, time):
    script = (
        f"slider.value = {time}; slider.dispatchEvent(new Event('input', {{ bubbles:"
        " true }))"
    )
    browser.run(f"(() => {{ {script} }})()")


def readout(browser, name):
    found = (
        "[...document.querySelectorAll('.readouts div')].find((d) =>"
        f" d.textContent.startsWith('{name}'))"
    )
    return browser.run(f"{found}.querySelector('dd').textContent")


def test_the_slider_moves_the_ship(opened):
    assert ship(opened) == pytest.approx([20.0, 0.0, 0.0])
    slide(opened, 102.5)  # between two samples
    assert ship(opened) == pytest.approx(
        [20.0, -5.0 * 102.5, np.degrees(0.002 * 102.5)]
    )
    assert opened.run("find('clock').textContent") == "103 s of 200 s"


@pytest.mark.parametrize("time", [30.0, 90.0])  # to starboard and to port
def test_the_trailing_edge_of_the_rudder_goes_to_its_side(opened, time):
    slide(opened, time)
    edge = opened.run(
        # 20 m behind the stern, amidships
        "((each) => new DOMPoint(0, 70).matrixTransform("
        "each.ship.getScreenCTM().inverse().multiply(each.blade.getScreenCTM())).x)(chart.ships[0])"
    )
    rudder = np.radians(10.0) * np.sin(time / 20.0)
    assert edge == pytest.approx(20.0 * np.sin(rudder), abs=0.05)


def test_a_run_that_is_over_stays_where_it_ended(opened):
    slide(opened, END)
    assert ship(opened, 1) == pytest.approx(
        [220.0, -5.0 * END / 2, np.degrees(0.002 * END / 2)]
    )


def test_keys_step_play_and_go_to_the_ends(opened):
    opened.press("ArrowRight")
    assert ship(opened)[1] == pytest.approx(-5.0 * DT)
    opened.press("Shift+ArrowRight")
    assert ship(opened)[1] == pytest.approx(-5.0 * 11 * DT)
    opened.press("ArrowLeft")
    assert ship(opened)[1] == pytest.approx(-5.0 * 10 * DT)
    opened.press("End")
    assert ship(opened)[1] == pytest.approx(-5.0 * END)
    opened.press("Home")
    opened.press("Space")
    opened.wait("time > 1")
    opened.press("Space")
    stopped = opened.run("time")
    assert 0 < stopped < END
    assert ship(opened)[1] == pytest.approx(-5.0 * stopped)
    assert f"{stopped:.1f} s" in opened.run("find('status').textContent")


def test_readouts_show_the_state(opened):
    slide(opened, 100.0)
    assert readout(opened, "speed") == "5.00 m/s"
    assert readout(opened, "heading") == f"{np.degrees(0.2):.1f} deg"
    assert (
        readout(opened, "heading error") == f"\N{MINUS SIGN}{np.degrees(0.1):.1f} deg"
    )
    assert readout(opened, "cross-track") == "20.0 m"
    assert readout(opened, "rudder") == f"\N{MINUS SIGN}{abs(10 * np.sin(5.0)):.1f} deg"
    cells = opened.run(
        "[...document.querySelectorAll('#rewards td')].map((cell) => cell.textContent)"
    )
    minus = "\N{MINUS SIGN}"
    assert cells[:3] == ["cross track", f"{minus}0.400", f"{minus}8.00"]
    assert cells[-3:] == ["sum", f"{minus}0.500", f"{minus}10.00"]


def test_the_legend_shows_hides_and_chooses_runs(opened):
    assert "</script><b>container, 50 m" in opened.run("find('legend').textContent")
    opened.click("#run-1")
    assert opened.run("chart.ships[1].group.style.display") == "none"
    opened.click("#legend li:nth-child(2) button")
    assert opened.run("[chosen, shown[1], chart.ships[1].group.style.display]") == [
        1,
        True,
        "",
    ]


def test_a_click_on_a_history_goes_to_that_time(opened):
    opened.click(".history .plot", 0.25)
    assert ship(opened)[1] == pytest.approx(-5.0 * END / 4, rel=0.02)


def test_following_keeps_the_ship_in_the_middle(opened):
    opened.press("f")
    slide(opened, 150.0)
    east, south, _ = ship(opened)
    assert opened.run("chart.centre") == pytest.approx([east, south])
    opened.click("#whole")
    assert opened.run("chart.follows") is False


@pytest.mark.parametrize(("width", "height"), [(1000, 700), (390, 844)])
def test_nothing_sticks_out_or_is_cut_off(opened, width, height):
    opened.resize(width, height, mobile=width < 500)
    opened.wait(f"innerWidth === {width}")
    assert opened.run("document.documentElement.scrollWidth") <= width
    cut = (
        "[...document.querySelectorAll('.readouts dt, .readouts dd, .controls output,"
        " h1')].filter((e) => e.scrollWidth > e.clientWidth + 1).map((e) =>"
        " e.textContent)"
    )
    assert opened.run(cut) == []
    assert opened.run("chart.svg.clientHeight") > 0.4 * height
    dots = opened.run(
        "document.querySelector('.waypoint').getBoundingClientRect().toJSON()"
    )
    whole = opened.run("chart.svg.getBoundingClientRect().toJSON()")
    assert whole["left"] < dots["left"] <= dots["right"] < whole["right"]
    assert whole["top"] < dots["top"] < dots["bottom"] < whole["bottom"]
