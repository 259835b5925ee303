"""The benchmark's page: what it holds, and in a browser what a person does with it."""

import base64
import gzip
import inspect
import json
import re
import sys
from functools import partial
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

from agents import PID, benchmark
from agents.benchmarking import page as benchmark_page
from agents.benchmarking import page_replays
from agents.benchmarking.page import command, write_page
from agents.benchmarking.page_figures import COLOURS
from agents.benchmarking.page_replays import (
    bests_of,
    differences,
    entries_of,
    hardest_of,
    replayable,
    worst_of,
)
from agents.benchmarking.replays import EpisodeId, rerun
from agents.benchmarking.results import BenchmarkResult
from agents.cli import app
from agents.rollouts.episodes import recorded
from agents.suites.suite import load_suite
from shipgym.errors import InputError
from tests.agents.browser import COMMAND, Browser
from tests.golden.texts import flat, same_page, same_text

TASKS = ["mariner-calm", "mariner-current"]
N, FIRST = 4, 1_000_000


class Lazy:
    """Leaves the rudder amidships."""

    name = "a <b>lazy one"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.zeros((len(observation), 1), dtype=np.float32), state


@pytest.fixture(scope="module")
def result():
    """PID, the same again, and one that is given as an object; scores as if the suite had references."""
    references = {"mariner-calm": (30.0, 20.0), "mariner-current": (3000.0, 900.0)}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "agents.benchmarking.summary.reference_costs", lambda suite: references
        )
        patch.setattr("agents.benchmarking.summary.N_EPISODES", N)
        found = benchmark(
            {"pid": "pid", "again": "pid", Lazy.name: Lazy()}, tasks=TASKS, episodes=N
        )
    for by_name in found.summary["tasks"].values():
        for one in by_name.values():
            one["microseconds_per_action"] = 7.25  # which differs from run to run
    return found


@pytest.fixture(scope="module")
def page(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "index.html"
    write_page(result, path, worst=2)
    return path


def test_the_page_is_the_golden_one(page):
    """Its words and tables, what its figures draw, and the episodes to replay."""
    versions = r"\| (python|processor|numpy|numba|scipy|control) \| .*"
    assert same_page("benchmark page", page.read_text(encoding="utf-8"), versions)


def test_the_summary_is_the_golden_one(result):
    """Costs, scores, intervals, improvements, profiles and metrics of each task."""
    told = {name: part for name, part in result.summary.items() if name != "versions"}
    lines = [line for line in flat(told, "") if ".again.metrics" not in line]
    assert same_text("benchmark summary", "\n".join(lines))


def unpacked(page, name):
    text = page.read_text(encoding="utf-8")
    found = re.search(rf'<script type="text/plain" id="{name}">(.*?)</script>', text)
    return gzip.decompress(base64.b64decode(found[1])).decode()


def test_the_worst_come_first_and_the_hardest_is_hard_for_all(result):
    costs = result.figures("pid", "mariner-calm")[0]
    worst = worst_of(result, "pid", "mariner-calm", N)
    assert [episode.seed - FIRST for episode in worst] == np.argsort(-costs).tolist()
    medians = np.median(
        [result.figures(name, "mariner-calm")[0] for name in result.ranking], axis=0
    )
    assert hardest_of(result, "mariner-calm") == FIRST + np.argmax(medians)


def test_equals_share_the_first_place(result):
    assert sorted(bests_of(result, "mariner-calm")) == ["again", "pid"]


def test_each_is_shown_beside_the_best_in_the_same_episode(result):
    best = bests_of(result, "mariner-calm")[0]
    (nobody, everybody), *others = entries_of(result, "mariner-calm", 2)
    assert nobody == ""
    assert {episode.contestant for episode in everybody} == set(result.ranking)
    assert len(others) == 2 * 3
    for who, episodes in others:
        assert episodes[0].contestant == who
        assert [episode.contestant for episode in episodes[1:]] == (
            [] if who == best else [best]
        )
        assert len({episode.seed for episode in episodes}) == 1


def test_too_many_runs_are_cut_down(result, monkeypatch):
    count, episodes = replayable(result, 3)
    assert count == 3
    monkeypatch.setattr("agents.benchmarking.page_replays.MOST_RUNS", len(episodes) - 1)
    fewer, fewer_episodes = replayable(result, 3)
    assert fewer < 3
    assert set(fewer_episodes) < set(episodes)


def test_what_is_run_again_costs_the_same(result):
    episodes = [EpisodeId("pid", task, 0, FIRST + k) for task in TASKS for k in (0, 3)]
    told = []
    again = rerun(result, episodes, progress=lambda *stage: told.append(stage))
    assert (again.different, again.refused) == ((), {})
    assert told[-1] == ("episodes run again", 2, 2)
    for episode in episodes:
        found = again.episodes[episode]
        cost = result.figures("pid", episode.task)[0, episode.seed - FIRST]
        lost = result.figures("pid", episode.task, "terminated")[
            0, episode.seed - FIRST
        ]
        assert found.rewards.sum() == pytest.approx(-cost)
        assert (found.seed, found.terminated) == (
            episode.seed,
            bool(lost) or bool(found.success),
        )
        assert (found.waypoints is None) == (episode.task == "mariner-calm")
        assert found.truncated == (not found.terminated)


def test_an_episode_run_again_is_that_of_the_single_environment():
    task = load_suite().task("mariner-calm")
    pilot = PID.from_model(task.ship, dt=task.task.interval(task.ship))
    (found,), (cost,) = recorded(pilot, task, [FIRST], samples=200)
    env = gymnasium.make(found.environment, **found.arguments).unwrapped
    observation, _ = env.reset(seed=FIRST)
    rewards, states, over = [], [env.physical_state()], False
    while not over:
        observation, reward, terminated, truncated, _ = env.step(
            pilot.predict(observation)[0]
        )
        rewards.append(reward)
        states.append(env.physical_state())
        over = terminated or truncated
    assert (len(rewards), found.n_steps, found.dt) == (600, 200, 3.0 * env.dt)
    assert found.rewards == pytest.approx(
        np.reshape(rewards, (200, 3)).sum(axis=1), abs=1e-9
    )
    assert cost == pytest.approx(-sum(rewards))
    for name in ("x", "y", "psi", "u", "delta", "set_point"):
        assert found.states[name] == pytest.approx(
            [state[name] for state in states[::3]], abs=1e-6
        )


def test_the_last_interval_is_filled_up():
    task = load_suite().task("mariner-current")
    (whole,), _ = recorded(
        PID.from_model(task.ship, dt=task.task.interval(task.ship)),
        task,
        [FIRST],
        samples=task.task.episode_steps,
    )
    (found,), _ = recorded(
        PID.from_model(task.ship, dt=task.task.interval(task.ship)),
        task,
        [FIRST],
        samples=-(-task.task.episode_steps // 7),
    )
    assert whole.success
    assert whole.n_steps < task.task.episode_steps
    assert found.n_steps == -(-whole.n_steps // 7)
    assert found.states["x"][-1] == whole.states["x"][-1]
    assert found.rewards.sum() == pytest.approx(whole.rewards.sum())
    assert (found.success, found.terminated) == (True, True)


def test_a_controller_that_fails_is_shown_up_to_then():
    task = load_suite().task("mariner-calm")

    class Fails(Lazy):
        def predict(
            self, observation, state=None, episode_start=None, deterministic=True
        ):
            if (state or 0) == 11:
                raise ValueError
            return super().predict(observation)[0], (state or 0) + 1

    (found,), (cost,) = recorded(Fails(), task, [FIRST], samples=300)
    assert (found.n_steps, found.terminated, found.truncated) == (5, False, False)
    assert np.isnan(cost)


def test_a_changed_result_is_reported(result):
    costs = result.episodes["cost"].copy()
    result.episodes["cost"] = costs * 1.001
    try:
        episode = EpisodeId("pid", "mariner-calm", 0, FIRST)
        assert rerun(result, [episode]).different == (episode,)
    finally:
        result.episodes["cost"] = costs


def test_objects_are_replayed_where_they_are_given(result):
    episode = EpisodeId(Lazy.name, "mariner-calm", 0, FIRST)
    assert (
        "given as an object"
        in rerun(result, [episode]).refused[Lazy.name, "mariner-calm"]
    )

    def fails(task):
        raise KeyError("gain")

    refused = rerun(result, [episode], {Lazy.name: fails}).refused
    assert refused == {(Lazy.name, "mariner-calm"): "KeyError: 'gain'"}
    given = rerun(result, [episode], {Lazy.name: Lazy()})
    assert (given.refused, given.different) == ({}, ())
    assert not given.episodes[episode].actions.any()


def test_differences_add_up():
    decimals, *steps = differences([1.04, -2.26, 300.0], 1)
    assert np.cumsum(steps) / 10**decimals == pytest.approx([1.0, -2.3, 300.0])


def test_the_command_names_what_is_not_the_default(result):
    said = command(result)
    assert "pid,again=pid" in said
    assert "--tasks mariner-calm,mariner-current --episodes 4 --out results" in said


def test_the_whole_suite_is_the_default_of_the_command():
    tasks = dict.fromkeys(task.name for task in load_suite("shipgym-v1").tasks)
    about = {
        "contestants": {"lq": {"source": "lq"}, "mine": {"source": None}},
        "seeds": {"count": 100},
    }
    about |= {"suite": {"name": "shipgym-v1"}, "tasks": tasks}
    whole = (
        "shipgym benchmark --controllers lq,mine=... --suite shipgym-v1 --out results"
    )
    assert command(SimpleNamespace(summary=about)) == whole
    tasks.popitem()
    some = command(SimpleNamespace(summary={**about, "seeds": {"count": 99}}))
    assert some.endswith(f"--tasks {','.join(tasks)} --episodes 99 --out results")


def test_the_same_text_is_packed_the_same_whenever():
    packed = base64.b64decode(benchmark_page.packed("a page"))
    assert gzip.decompress(packed) == b"a page"
    assert packed[4:8] == bytes(4)  # the time at which it was packed


def test_a_page_that_cannot_be_drawn_is_refused_before_episodes_are_run_again(
    result, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    monkeypatch.setattr(
        benchmark_page, "rerun", lambda *given: pytest.fail("was run again")
    )
    with pytest.raises(InputError, match="plotly is not installed"):
        write_page(result, tmp_path / "index.html")


def test_a_page_holds_three_hundred_runs_at_most():
    costs, count = np.arange(1.0, 312.0)[None], 311
    result = SimpleNamespace(
        ranking=["pid"],
        tasks=["calm"],
        summary={
            "tasks": {"calm": {"pid": {"cost": {"value": 1.0}}}},
            "seeds": {"first": FIRST},
        },
        figures=lambda name, task: costs,
    )
    usual = inspect.signature(write_page).parameters
    assert (usual["worst"].default, usual["workers"].default) == (3, 1)
    for wanted, found in ((count, 300), (299, 299)):
        assert replayable(result, wanted)[0] == found
    assert len(replayable(result, count)[1]) == 300


def test_a_task_that_only_the_best_known_ran_has_a_first_episode():
    summary = {
        "tasks": {"calm": {"best-known": {"cost": {"value": 1.0}}}},
        "seeds": {"first": FIRST},
    }
    result = SimpleNamespace(ranking=["best-known"], summary=summary)
    assert (hardest_of(result, "calm"), bests_of(result, "calm")) == (FIRST, [])


def test_histories_are_as_fine_as_they_are_read():
    """Heel to 0.01 deg, shaft speed to 0.1 1/min, wind to 0.1 m/s and 1 deg, current to 0.01 m/s."""
    fine = {
        "x": 0.1,
        "y": 0.1,
        "psi": 0.1,
        "delta": 0.1,
        "heading_error": 0.1,
        "course_order": 0.1,
    }
    fine |= {
        "rudder_order": 0.1,
        "cross_track_error": 0.1,
        "speed": 0.01,
        "yaw_rate": 0.001,
        "heel": 0.01,
    }
    fine |= {
        "shaft_speed": 0.1,
        "wind_speed": 0.1,
        "wind_from": 1.0,
        "current_speed": 0.01,
    }
    fine |= {"current_towards": 1.0, "reward_so_far": 0.001}
    values = [123.45678, 123.98766]
    whole = {
        "series": dict.fromkeys(fine, values),
        "parts": {"a": values, "b": [0.0, 0.0]},
        "rewards": values,
    }
    found = page_replays.short({**whole, "other": {"u": values}, "name": "pid"})

    def told(packed):
        decimals, *steps = packed
        return np.cumsum(steps) / 10.0**decimals

    for name, step in fine.items():
        expected = np.round(np.array(values) / step) * step
        assert told(found["series"][name]) == pytest.approx(expected, abs=1e-9), name
    assert told(found["rewards"]) == pytest.approx([123.4568, 123.9877], abs=1e-9)
    assert list(found["parts"]) == ["a"]  # what is 0 throughout is not kept
    assert told(found["parts"]["a"]) == pytest.approx([123.4568, 123.9877], abs=1e-9)
    assert (found["other"], found["name"]) == ({}, "pid")


def test_the_page_holds_its_numbers_and_where_they_are_from(result, page):
    text = page.read_text(encoding="utf-8")
    assert len(text) < 3e6
    assert result.summary["suite"]["sha256"][:16] in text
    assert result.summary["suite"]["tasks"]["mariner-calm"]["model_sha256"][:16] in text
    assert result.summary["versions"]["numba"] in text
    assert "1000000 to 1000003" in text
    assert "a &lt;b&gt;lazy one" in text
    assert "<b>lazy" not in text
    assert not re.findall(r'(?:src|href)="(?!#)[^"]', text)  # it loads nothing


def test_the_page_says_why_one_cannot_be_replayed(page):
    assert "Not to be replayed: a &lt;b&gt;lazy one" in page.read_text(encoding="utf-8")
    names = {
        entry["who"]
        for entry in json.loads(unpacked(page, "replay-data"))["entries"][
            "mariner-calm"
        ]
    }
    assert names == {"", "pid", "again"}


def test_an_episode_to_replay_has_its_cost_to_the_hundredth(result, page):
    data = json.loads(unpacked(page, "replay-data"))
    assert len(data["entries"]["mariner-calm"]) == 1 + 2 * 2
    for task, entries in data["entries"].items():
        for entry in entries:
            costs = result.figures(
                entry["who"] or data["runs"][entry["runs"][0]]["name"], task
            )
            assert entry["cost"] == round(float(costs[0, entry["seed"] - FIRST]), 2)


def test_a_page_that_cannot_be_written_is_refused_at_once(result, tmp_path):
    with pytest.raises(InputError, match=r"ends in \.html"):
        write_page(result, tmp_path / "page.txt")


@pytest.mark.parametrize("there", [True, False])
def test_the_command_writes_the_page_where_plotly_is_there(
    tmp_path, monkeypatch, there
):
    if not there:
        monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    out = tmp_path / "results"
    words = [
        "benchmark",
        "--controllers",
        "pid",
        "--tasks",
        "mariner-calm",
        "--episodes",
        "2",
        "--workers",
        "1",
    ]
    answer = CliRunner().invoke(app, [*words, "--out", str(out)])
    assert answer.exit_code == 0, answer.stderr
    assert (out / "results.json").exists()
    assert (out / "index.html").exists() == there
    assert ("there is no index.html: plotly is not installed" in answer.stderr) != there


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
    """The page at its beginning; after each test it must have kept quiet and stayed offline."""
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
    assert (
        opened.run("document.querySelectorAll('#costs-table [aria-sort=none]').length")
        == 3
    )


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
    opened.run(
        "document.querySelector('#ranking-table thead th:nth-child(3) button').click()"
    )
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
    shown = (
        "[...document.querySelectorAll('[role=tabpanel]')].filter((p) =>"
        " !p.hidden).map((p) => p.id)"
    )
    assert opened.run(shown) == ["task-mariner-calm"]
    opened.run("document.querySelector('[role=tab]').focus()")
    opened.press("ArrowRight")
    assert opened.run(shown) == ["task-mariner-current"]
    opened.run(
        "document.querySelector('#costs-table a[href=\"#task-mariner-calm\"]').click()"
    )
    opened.wait(f"{shown}[0] === 'task-mariner-calm'")


def test_a_chosen_episode_is_replayed_and_its_ship_moves(opened, result):
    opened.run("document.querySelector('[data-replay=\"mariner-current\"]').click()")
    ready = "document.getElementById('player').contentDocument?.querySelectorAll('.ship').length"
    opened.wait(f"{ready} === 2")  # PID twice, in the hardest episode
    assert (
        opened.run("document.getElementById('replay-task').value") == "mariner-current"
    )
    other = result.ranking[1] if result.ranking[1] != Lazy.name else result.ranking[0]
    opened.run(
        "(() => { const who = document.getElementById('replay-who'); who.value ="
        f" '{other}'; who.dispatchEvent(new Event('change')); }})()"
    )
    opened.wait(
        f"{ready} === 2 && document.getElementById('player').contentDocument.readyState"
        " === 'complete'"
    )
    frame = "document.getElementById('player').contentDocument"
    where = f"{frame}.querySelector('.ship').getAttribute('transform')"
    begin = opened.run(where)
    opened.run(
        f"(() => {{ const slider = {frame}.getElementById('time'); slider.value ="
        " slider.max / 2; slider.dispatchEvent(new Event('input', { bubbles: true"
        " })); })()"
    )
    opened.wait(f"{where} !== '{begin}'")
    chip = (
        "[...document.querySelectorAll('.chips button')].find((each) =>"
        f" each.dataset.name === '{other}')"
    )
    assert (
        opened.run(f"{chip}.style.getPropertyValue('--run')")
        == COLOURS[result.ranking.index(other)]
    )
    assert (
        opened.run(
            f"{frame}.querySelector('#legend li').style.getPropertyValue('--run')"
        )
        == (COLOURS[result.ranking.index(other)])
    )
    legend = opened.run(f"{frame}.getElementById('legend').textContent")
    assert other in legend
    worst = worst_of(result, other, "mariner-current", 1)[0]
    assert f"seed {worst.seed}" in opened.run(
        "document.getElementById('replay-episode').selectedOptions[0].text"
    )


@pytest.mark.parametrize("width", [1200, 400])
def test_nothing_sticks_out(opened, width):
    opened.resize(width, 900, mobile=width < 500)
    opened.wait(f"innerWidth === {width}")
    for name in ("profile", "tasks", "replays"):
        see(opened, name)
    opened.wait(
        "document.getElementById('player').contentDocument?.querySelector('.ship') !="
        " null"
    )
    assert opened.run("document.documentElement.scrollWidth") <= width
    inner = "document.getElementById('player').contentDocument.documentElement"
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


def test_runs_are_numbered_where_there_are_several():
    def called(runs):
        summary = {"tasks": {"calm": {"ppo": {"runs": runs}}}}
        return page_replays._called(
            SimpleNamespace(summary=summary), EpisodeId("ppo", "calm", 1, FIRST)
        )

    assert [called(runs) for runs in (1, 2, 5)] == ["ppo", "ppo, run 2", "ppo, run 2"]


def test_rare_metrics_are_shown_only_where_they_are_not_zero_throughout():
    def shown(metric, *means):
        found = {
            k: {"metrics": {metric: {"mean": mean}}} for k, mean in enumerate(means)
        }
        return benchmark_page._is_shown(metric, found)

    assert shown("extrapolating", 0.0, 0.1)
    assert not shown("extrapolating", 0.0, 0.0)
    assert not shown("extrapolating", None, 0.0)
    assert shown("success", 0.0)
    assert shown("success", None, 0.0)
    assert not shown("success", None, None)
    assert not benchmark_page._is_shown("success", {"pid": {"metrics": {}}})


def test_who_failed_or_did_not_take_part_is_told_with_the_task():
    tasks = {
        "calm": {
            "pid": {"failed": 0, "failure": ""},
            "mine": {"failed": 3, "failure": "no number"},
        },
        "rough": {"pid": {"failed": 0, "failure": ""}},
    }
    contestants = {
        "pid": {"refused": {}},
        "mine": {"refused": {"rough": "other observations"}},
    }
    result = BenchmarkResult({"tasks": tasks, "contestants": contestants}, {})
    assert result.failures == [
        "mine did not take part in rough: other observations",
        "mine failed in 3 episodes of calm: no number",
    ]


def test_the_hardest_episode_has_tracks_where_there_is_a_path(result):
    worst = {task: hardest_of(result, task) for task in TASKS}
    for task, names in (
        ("mariner-calm", {"histories"}),
        ("mariner-current", {"histories", "tracks"}),
    ):
        one = EpisodeId("pid", task, 0, worst[task])
        suited = load_suite().task(task)
        pilot = PID.from_model(suited.ship, dt=suited.task.interval(suited.ship))
        episodes = recorded(pilot, suited, [worst[task]]).episodes
        again = SimpleNamespace(episodes={one: episodes[0]})
        assert benchmark_page._hardest(result, again, task).keys() == names
        assert benchmark_page._hardest(result, SimpleNamespace(episodes={}), task) == {}


def test_worst_hardest_and_best_by_hand(monkeypatch):
    """Two training runs of `a` and one of `b` in three episodes; a cost that is no number is the worst."""
    costs = {
        "a": np.array([[1.0, 3.0, 2.0], [0.0, 9.0, np.nan]]),
        "b": np.array([[1.0, 1.0, 4.0]]),
    }
    means = {
        "a": {"cost": {"value": 2.0}},
        "b": {"cost": {"value": 1.0}},
        "best-known": {"cost": {"value": 0.5}},
    }
    result = SimpleNamespace(
        ranking=["best-known", "b", "a", "c"],
        tasks=["calm"],
        summary={"tasks": {"calm": means}, "seeds": {"first": 100}},
        figures=lambda name, task: costs[name],
    )
    assert page_replays.contestants_of(result, "calm") == ["b", "a"]
    assert page_replays.bests_of(result, "calm") == ["b"]
    means["a"]["cost"]["value"] = 1.0 + 1e-13
    assert page_replays.bests_of(result, "calm") == ["b", "a"]
    means["a"]["cost"]["value"] = None
    assert page_replays.bests_of(result, "calm") == ["b"]
    worst = page_replays.worst_of(result, "a", "calm", 3)
    assert [(one.run, one.seed) for one in worst] == [(1, 102), (1, 101), (0, 101)]
    assert page_replays.hardest_of(result, "calm") == 102
    costs["a"][1, 2] = 2.0
    assert page_replays.hardest_of(result, "calm") == 101  # medians of 0.75, 3.5 and 3
    of = partial(EpisodeId, task="calm")
    entries = page_replays.entries_of(result, "calm", 1)
    assert entries == [
        ("", [of("b", run=0, seed=101), of("a", run=0, seed=101)]),
        ("b", [of("b", run=0, seed=102)]),
        ("a", [of("a", run=1, seed=101), of("b", run=0, seed=101)]),
    ]
    for most, count, shown in ((20, 3, 6), (5, 2, 5), (4, 1, 4), (1, 1, 4)):
        monkeypatch.setattr(page_replays, "MOST_RUNS", most)
        found, episodes = page_replays.replayable(result, 3)
        assert (found, len(episodes)) == (count, shown)
