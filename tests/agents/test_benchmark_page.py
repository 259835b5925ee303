"""The benchmark's page: what it holds, and in a browser what a person does with it."""

import base64
import gzip
import json
import re
import sys
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

from agents import PID, benchmark
from agents.benchmarking.page import command, packed, write_page
from agents.benchmarking.page_figures import COLOURS
from agents.benchmarking.page_replays import (
    Choice,
    best_controllers,
    choices,
    differences,
    hardest_seed,
    replayable,
    short,
    usable_controllers,
    worst_episodes,
)
from agents.benchmarking.page_tables import metrics_table
from agents.benchmarking.replays import EpisodeId, rerun
from agents.benchmarking.results import BenchmarkResult
from agents.cli import app
from agents.rollouts.episodes import recorded
from agents.suites.suite import BenchmarkTask
from shipgym.errors import InputError
from tests.agents.browser import COMMAND, Browser
from tests.agents.small_suite import write_suite

SUITE = """
name = "small-v1"
[tasks.calm]
environment = "course-keeping"
model = "mariner"
why = "the easiest"
options = { episode_steps = 60, change_interval_steps = 25 }
[tasks.current]
environment = "path-following"
model = "mariner"
why = "a current across the path"
options = { episode_steps = 150, n_legs = 2, leg_lengths = [5.0, 6.0], corridor = 0.8 }
sea = { current = { speed = 1.0, towards_deg = 90.0 } }
"""
REFERENCES = {"calm": (30.0, 2.0), "current": (3000.0, 40.0)}
TASKS = list(REFERENCES)
N, FIRST = 100, 1_000_000


class Lazy:
    """Leaves the rudder amidships."""

    name = "a <b>lazy one"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.zeros((len(observation), 1), dtype=np.float32), state


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    """The path of a suite with best known costs."""
    best = {
        task: {"rule_costs": [rule] * N, "costs": [bound] * N, "by": ["search"] * N}
        for task, (rule, bound) in REFERENCES.items()
    }
    return write_suite(tmp_path_factory.mktemp("suite"), SUITE, best=best)


@pytest.fixture(scope="module")
def result(suite):
    """PID, the same again, and one that is given as an object."""
    controllers = {"pid": "pid", "again": "pid", Lazy.name: Lazy()}
    found = benchmark(controllers, suite)
    for cells in found.summary["tasks"].values():
        for cell in cells.values():
            cell["microseconds_per_action"] = 7.25  # which differs from run to run
    return found


@pytest.fixture(scope="module")
def page(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "index.html"
    write_page(result, path, worst=2)
    return path


def unpacked(page, name):
    text = page.read_text(encoding="utf-8")
    found = re.search(rf'<script type="text/plain" id="{name}">(.*?)</script>', text)
    return gzip.decompress(base64.b64decode(found[1])).decode()


def test_the_page_holds_its_numbers_and_where_they_are_from(result, page):
    text = page.read_text(encoding="utf-8")
    assert len(text) < 3e6
    summary = result.summary
    assert summary["suite"]["sha256"][:16] in text
    assert summary["suite"]["tasks"]["calm"]["model_sha256"][:16] in text
    assert summary["versions"]["numba"] in text
    assert "1000000 to 1000099" in text
    assert "a &lt;b&gt;lazy one" in text
    assert "<b>lazy" not in text
    assert not re.findall(r'(?:src|href)="(?!#)[^"]', text)  # it loads nothing


def test_what_cannot_be_replayed_is_named(result, tmp_path):
    path = tmp_path / "index.html"
    write_page(result, path, {"pid": "pid", "again": "pid"}, worst=1)
    assert "Not to be replayed: a &lt;b&gt;lazy one" in path.read_text(encoding="utf-8")
    entries = json.loads(unpacked(path, "replay-data"))["entries"]["calm"]
    assert {entry["who"] for entry in entries} == {"", "pid", "again"}


def test_an_episode_to_replay_has_its_cost_to_the_hundredth(result, page):
    data = json.loads(unpacked(page, "replay-data"))
    assert len(data["entries"]["calm"]) == 1 + 3 * 2
    for task, entries in data["entries"].items():
        for entry in entries:
            name = entry["who"] or data["runs"][entry["runs"][0]]["name"]
            cost = result.figures(name, task)[0, entry["seed"] - FIRST]
            assert entry["cost"] == round(float(cost), 2)


def test_the_command_of_the_page_names_what_is_not_the_default(result):
    words = ["pid,again=pid", "--suite small.toml --out results"]
    assert all(one in command(result) for one in words)
    suite = {"name": "shipgym-v1", "file": "", "complete": True}
    controllers = {"lq": {"source": "lq"}, "mine": {"source": None}}
    summary = {
        "controllers": controllers,
        "suite": suite,
        "tasks": {"calm": {}, "rough": {}},
        "seeds": {"first": FIRST, "count": 100},
    }
    whole = "shipgym benchmark --controllers lq,mine=... --suite shipgym-v1"
    assert command(BenchmarkResult(summary, {})) == f"{whole} --out results"
    part = summary | {"suite": suite | {"complete": False}}
    part["seeds"] = {"first": FIRST, "count": 99}
    expected = f"{whole} --tasks calm,rough --episodes 99 --out results"
    assert command(BenchmarkResult(part, {})) == expected


def test_the_same_text_is_packed_the_same_whenever():
    content = base64.b64decode(packed("a page"))
    assert gzip.decompress(content) == b"a page"
    assert content[4:8] == bytes(4)  # the time at which it was packed


def test_a_page_that_cannot_be_written_or_drawn_is_refused_at_once(
    result, tmp_path, monkeypatch
):
    told = []
    with pytest.raises(InputError, match=r"ends in \.html"):
        write_page(result, tmp_path / "page.txt", progress=told.append)
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    with pytest.raises(InputError, match="plotly is not installed"):
        write_page(result, tmp_path / "index.html", progress=told.append)
    assert told == []  # nothing was run again


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


def test_rare_metrics_are_shown_only_where_they_are_not_zero_throughout():
    def heads(**means):
        metrics = {name: {"mean": mean, "p95": mean} for name, mean in means.items()}
        cell = {"cost": {"value": 1.0}, "metrics": metrics, "lost": 0, "failed": 0}
        cell["exceeded"] = {}
        cells = {"pid": cell | {"microseconds_per_action": None}}
        ranking = [{"name": "pid"}]
        suite = {"tasks": {"calm": {"limits": {}}}}
        summary = {"tasks": {"calm": cells}, "ranking": ranking, "suite": suite}
        result = BenchmarkResult(summary, {})
        return {head.text for head in metrics_table(result, "calm", "x").heads}

    assert "outside model" in heads(extrapolating=0.1)
    assert "outside model" not in heads(extrapolating=0.0)
    assert "success" in heads(success=0.0)
    assert "success" not in heads(success=None)


# --- episodes that are run again


def test_what_is_run_again_costs_the_same(result):
    episodes = [EpisodeId("pid", task, 0, FIRST + k) for task in TASKS for k in (0, 3)]
    told = []
    again = rerun(result, episodes, progress=lambda *stage: told.append(stage))
    assert (again.different, again.refused) == ((), {})
    assert told[-1] == ("episodes run again", 2, 2)
    for episode in episodes:
        place = 0, episode.seed - FIRST
        found = again.episodes[episode]
        cost, lost = (
            result.figures("pid", episode.task, name)[place]
            for name in ("cost", "terminated")
        )
        assert found.rewards.sum() == pytest.approx(-cost)
        assert found.seed == episode.seed
        assert found.terminated == bool(lost or found.success)
        assert found.truncated == (not found.terminated)
        assert (found.waypoints is None) == (episode.task == "calm")


def test_a_changed_result_is_reported_beyond_a_billionth(result):
    episodes = [EpisodeId("pid", "calm", 0, FIRST + k) for k in range(2)]
    for change, different in ((1.0 + 1e-10, ()), (1.0 + 1e-8, tuple(episodes))):
        columns = {**result.episodes, "cost": result.episodes["cost"] * change}
        assert rerun(replace(result, episodes=columns), episodes).different == different


def test_controllers_are_those_that_were_run_or_that_are_given(result):
    episode = EpisodeId(Lazy.name, "calm", 0, FIRST)
    again = rerun(result, [episode])
    assert (again.refused, again.different) == ({}, ())
    assert not again.episodes[episode].actions.any()
    refused = rerun(result, [episode], "pid").refused
    assert "which results do not hold" in refused[Lazy.name, "calm"]

    def fails(task):
        raise KeyError("gain")

    refused = rerun(result, [episode], {Lazy.name: fails}).refused
    assert refused == {(Lazy.name, "calm"): "KeyError: 'gain'"}


CALM = BenchmarkTask("calm", "course-keeping", "mariner")
PILOT = PID.from_model(CALM.ship, dt=CALM.task.interval(CALM.ship))


def test_an_episode_run_again_is_that_of_the_single_environment():
    (found,), (cost,) = recorded(PILOT, CALM, [FIRST], samples=200)
    env = gymnasium.make(found.environment, **found.arguments).unwrapped
    observation, _ = env.reset(seed=FIRST)
    rewards, states, over = [], [env.physical_state()], False
    while not over:
        action, _ = PILOT.predict(observation)
        observation, reward, terminated, truncated, _ = env.step(action)
        rewards.append(reward)
        states.append(env.physical_state())
        over = terminated or truncated
    assert (len(rewards), found.n_steps, found.dt) == (600, 200, 3.0 * env.dt)
    sums = np.reshape(rewards, (200, 3)).sum(axis=1)
    assert found.rewards == pytest.approx(sums, abs=1e-9)
    assert cost == pytest.approx(-sum(rewards))
    for name in ("x", "y", "psi", "u", "delta", "set_point"):
        expected = [state[name] for state in states[::3]]
        assert found.states[name] == pytest.approx(expected, abs=1e-6)


def test_the_last_interval_is_filled_up():
    options = {"n_legs": 1, "episode_steps": 700}
    path = BenchmarkTask("path", "path-following", "mariner", options=options)
    (whole,), _ = recorded(PILOT, path, [FIRST], samples=700)
    (found,), _ = recorded(PILOT, path, [FIRST], samples=100)
    assert whole.success
    assert whole.n_steps < 700
    assert found.n_steps == -(-whole.n_steps // 7)
    assert found.states["x"][-1] == whole.states["x"][-1]
    assert found.rewards.sum() == pytest.approx(whole.rewards.sum())
    assert (found.success, found.terminated) == (True, True)


def test_a_controller_that_fails_is_shown_up_to_then():
    class Fails(Lazy):
        def predict(self, observation, state=None, episode_start=None, sure=True):
            if (state or 0) == 11:
                raise ValueError
            return super().predict(observation)[0], (state or 0) + 1

    (found,), (cost,) = recorded(Fails(), CALM, [FIRST], samples=300)
    assert (found.n_steps, found.terminated, found.truncated) == (5, False, False)
    assert np.isnan(cost)


# --- which episodes are shown


def test_the_worst_come_first_and_the_hardest_is_hard_for_all(result):
    costs = result.figures("pid", "calm")[0]
    worst = [one.seed - FIRST for one in worst_episodes(result, "pid", "calm", N)]
    assert worst == np.argsort(-costs, kind="stable").tolist()
    every = [result.figures(name, "calm")[0] for name in result.ranking]
    hardest = int(np.argmax(np.median(every, axis=0)))
    assert hardest_seed(result, "calm") == FIRST + hardest
    assert sorted(best_controllers(result, "calm")) == [
        "again",
        "pid",
    ]  # they are equal


def test_each_is_shown_with_the_best_in_the_same_episode(result):
    best = best_controllers(result, "calm")[0]
    hardest, *others = choices(result, "calm", 2)
    assert hardest.controller == ""
    names = {episode.controller for episode in hardest.episodes}
    assert names == set(result.ranking)
    assert len(others) == 2 * 3
    for name, episodes in others:
        expected = [name] if name == best else [name, best]
        assert [episode.controller for episode in episodes] == expected
        assert len({episode.seed for episode in episodes}) == 1


def made_up(costs, means, ranking):
    """Results of controllers in one task, whose seeds begin at 100."""
    n_episodes = max((values.shape[1] for values in costs.values()), default=1)
    names = [name for name, values in costs.items() for _ in values.flat]
    summary = {
        "ranking": [{"name": name} for name in ranking],
        "controllers": dict.fromkeys(ranking),
        "tasks": {"calm": {name: {"cost": {"value": means[name]}} for name in means}},
        "seeds": {"first": 100, "count": n_episodes},
    }
    episodes = {
        "controller": np.array(names),
        "task": np.full(len(names), "calm"),
        "cost": np.concatenate([np.zeros(0), *map(np.ravel, costs.values())]),
    }
    return BenchmarkResult(summary, episodes)


def test_worst_hardest_and_best_by_hand():
    """Two training runs of `a` and one of `b`; a cost that is no number is
    the worst."""
    costs = {
        "a": np.array([[1.0, 3.0, 2.0], [0.0, 9.0, np.nan]]),
        "b": np.array([[1.0, 1.0, 4.0]]),
    }
    ranking = ["best-known", "b", "a", "c"]
    for mean, best in ((2.0, ["b"]), (1.0 + 1e-13, ["b", "a"]), (None, ["b"])):
        means = {"a": mean, "b": 1.0, "best-known": 0.5}
        result = made_up(costs, means, ranking)
        assert usable_controllers(result, "calm") == ["b", "a"]
        assert best_controllers(result, "calm") == best
    worst = worst_episodes(result, "a", "calm", 3)
    assert [(one.run, one.seed) for one in worst] == [(1, 102), (1, 101), (0, 101)]
    assert hardest_seed(result, "calm") == 102
    costs["a"][1, 2] = 2.0
    result = made_up(costs, means, ranking)
    assert hardest_seed(result, "calm") == 101  # medians of 0.75, 3.5 and 3
    assert choices(result, "calm", 1) == [
        Choice("", [EpisodeId(name, "calm", 0, 101) for name in "ba"]),
        Choice("b", [EpisodeId("b", "calm", 0, 102)]),
        Choice("a", [EpisodeId("a", "calm", 1, 101), EpisodeId("b", "calm", 0, 101)]),
    ]
    nobody = made_up({}, {"best-known": 1.0}, ["best-known"])
    assert (hardest_seed(nobody, "calm"), best_controllers(nobody, "calm")) == (100, [])


def test_a_page_holds_three_hundred_runs_at_most():
    costs = {"pid": np.arange(1.0, 312.0)[None]}
    result = made_up(costs, {"pid": 1.0}, ["pid"])
    for wanted, count in ((311, 300), (299, 299)):
        found, episodes = replayable(result, wanted)
        assert (found, len(episodes)) == (count, count)


def test_differences_add_up():
    decimals, *steps = differences([1.04, -2.26, 300.0], 1)
    assert np.cumsum(steps) / 10**decimals == pytest.approx([1.0, -2.3, 300.0])


def test_histories_are_as_fine_as_they_are_read():
    """Heel to 0.01 deg, shaft speed to 0.1 1/min, wind to 0.1 m/s, current
    to 0.01 m/s."""
    fine = {"heel": 0.01, "shaft_speed": 0.1, "wind_speed": 0.1, "current_speed": 0.01}
    values = [123.45678, 123.98766]
    found = short(
        {
            "series": dict.fromkeys(fine, values),
            "parts": {"a": values, "b": [0.0, 0.0]},
            "rewards": values,
            "other": {"u": values},
            "name": "pid",
        }
    )

    def told(differences):
        decimals, *steps = differences
        return np.cumsum(steps) / 10.0**decimals

    for name, step in fine.items():
        expected = np.round(np.array(values) / step) * step
        assert told(found["series"][name]) == pytest.approx(expected, abs=1e-9), name
    assert told(found["rewards"]) == pytest.approx([123.4568, 123.9877], abs=1e-9)
    assert list(found["parts"]) == ["a"]  # what is 0 throughout is not kept
    assert (found["other"], found["name"]) == ({}, "pid")


# --- in the browser


@pytest.fixture(scope="module")
def browser():
    if COMMAND is None:
        pytest.skip("no chromium is installed")
    browser = Browser(1200, 900)
    yield browser
    browser.close()


@pytest.fixture
def opened(browser, page):
    """The page at its beginning; after each test it must have kept quiet and stayed
    offline."""
    browser.resize(1200, 900)
    browser.open("about:blank")
    browser.open(page.as_uri())
    yield browser
    assert browser.complaints == []
    assert set(browser.requests) <= {page.as_uri(), "about:srcdoc"}


def column(browser, table, number):
    return browser.run(
        f"[...document.querySelectorAll('#{table} tbody tr')]"
        f".map((row) => row.cells[{number}].dataset.key ?? '')"
    )


def see(browser, name):
    browser.run(
        f"document.getElementById('{name}').scrollIntoView({{ behavior: 'instant' }})"
    )


def test_a_click_on_a_head_sorts_and_another_turns_round(opened):
    head = "#costs-table thead th:nth-child(2)"
    see(opened, "costs")
    before = column(opened, "costs-table", 1)
    opened.click(f"{head} button", 0.5)
    up = [float(key) for key in column(opened, "costs-table", 1)]
    assert up == sorted(map(float, before))
    assert opened.run(f"document.querySelector('{head}').ariaSort") == "ascending"
    opened.click(f"{head} button", 0.5)
    assert [float(key) for key in column(opened, "costs-table", 1)] == up[::-1]
    assert opened.run(f"document.querySelector('{head}').ariaSort") == "descending"
    unsorted = "document.querySelectorAll('#costs-table [aria-sort=none]').length"
    assert opened.run(unsorted) == 3


def test_a_key_sorts_texts_and_what_has_no_number_stays_last(opened):
    opened.run("document.querySelector('#ranking-table thead button').focus()")
    opened.press("Space")
    names = column(opened, "ranking-table", 0)
    assert names == sorted(names)
    table = "document.querySelector('#improvement-table')"
    for _ in range(2):
        opened.run(f"{table}.querySelector('thead th:nth-child(2) button').click()")
        assert column(opened, "improvement-table", 1)[-1] == ""


def test_scores_come_with_the_best_first(opened):
    head = "#ranking-table thead th:nth-child(3) button"
    opened.run(f"document.querySelector('{head}').click()")
    scores = [float(key) for key in column(opened, "ranking-table", 2)]
    assert scores == sorted(scores, reverse=True)


def test_figures_are_drawn_when_they_come_into_sight_and_runs_can_be_hidden(opened):
    see(opened, "tasks")
    opened.wait("document.querySelector('#costs-0 .drawn .boxlayer .trace') !== null")
    boxes = "document.querySelectorAll('#costs-0 .boxlayer .trace').length"
    assert opened.run(boxes) == 3
    opened.run("document.querySelector('#tasks .chips button').click()")
    opened.wait(f"{boxes} === 2")


def test_all_figures_are_drawn_for_who_prints_without_scrolling(opened):
    missing = "document.querySelectorAll('.late:not(.drawn)').length"
    opened.wait(f"{missing} === 0")
    assert opened.run(missing) == 0
    assert opened.run("document.querySelectorAll('.late.drawn .main-svg').length") > 0


def test_tabs_show_one_task_at_a_time(opened):
    panels = "[...document.querySelectorAll('[role=tabpanel]')]"
    shown = f"{panels}.filter((p) => !p.hidden).map((p) => p.id)"
    assert opened.run(shown) == ["task-calm"]
    opened.run("document.querySelector('[role=tab]').focus()")
    opened.press("ArrowRight")
    assert opened.run(shown) == ["task-current"]
    link = '#costs-table a[href="#task-calm"]'
    opened.run(f"document.querySelector('{link}').click()")
    opened.wait(f"{shown}[0] === 'task-calm'")


def test_a_chosen_episode_is_replayed_and_its_ship_moves(opened, result):
    opened.run("document.querySelector('[data-replay=\"current\"]').click()")
    frame = "document.getElementById('player').contentDocument"
    ships = f"{frame}?.querySelectorAll('.ship').length"
    opened.wait(f"{ships} === 3")  # all controllers, in the hardest episode
    assert opened.run("document.getElementById('replay-task').value") == "current"
    other = result.ranking[1] if result.ranking[1] != Lazy.name else result.ranking[0]
    opened.run(
        "(() => { const who = document.getElementById('replay-who'); who.value ="
        f" '{other}'; who.dispatchEvent(new Event('change')); }})()"
    )
    opened.wait(f"{ships} === 2 && {frame}.readyState === 'complete'")
    where = f"{frame}.querySelector('.ship').getAttribute('transform')"
    begin = opened.run(where)
    opened.run(
        f"(() => {{ const slider = {frame}.getElementById('time'); slider.value ="
        " slider.max / 2; slider.dispatchEvent(new Event('input', { bubbles: true"
        " })); })()"
    )
    opened.wait(f"{where} !== '{begin}'")
    colour = COLOURS[result.ranking.index(other)]
    chip = (
        "[...document.querySelectorAll('.chips button')].find((each) =>"
        f" each.dataset.name === '{other}')"
    )
    entry = f"{frame}.querySelector('#legend li')"
    for shown in (chip, entry):
        assert opened.run(f"{shown}.style.getPropertyValue('--run')") == colour
    assert other in opened.run(f"{frame}.getElementById('legend').textContent")
    worst = worst_episodes(result, other, "current", 1)[0]
    chosen = "document.getElementById('replay-episode').selectedOptions[0].text"
    assert f"seed {worst.seed}" in opened.run(chosen)


@pytest.mark.parametrize("width", [1200, 400])
def test_nothing_sticks_out(opened, width):
    opened.resize(width, 900, mobile=width < 500)
    opened.wait(f"innerWidth === {width}")
    for name in ("profile", "tasks", "replays"):
        see(opened, name)
    frame = "document.getElementById('player').contentDocument"
    opened.wait(f"{frame}?.querySelector('.ship') != null")
    assert opened.run("document.documentElement.scrollWidth") <= width
    inner = f"{frame}.documentElement"
    assert opened.run(f"{inner}.scrollWidth <= {inner}.clientWidth")


def test_everything_that_can_be_operated_has_a_name(opened):
    tree = opened.ask("Accessibility.getFullAXTree")["nodes"]
    roles = {"button", "combobox", "tab", "link"}
    operated = [
        node
        for node in tree
        if node.get("role", {}).get("value") in roles and not node["ignored"]
    ]
    assert len(operated) > 40
    unnamed = [node for node in operated if not node["name"]["value"].strip()]
    assert len(unnamed) <= 1  # the corner of the matrix
