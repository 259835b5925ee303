"""The benchmark: who takes part, what is run, its results and its command."""

import hashlib
import json
import shutil
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from pyarrow import parquet
from typer.testing import CliRunner

from agents import LQ, PID, WheelOver, benchmark, load_results
from agents.agent_file import PRETRAINED
from agents.benchmarking.cells import Cell, ScoredRun, run_cell
from agents.benchmarking.entries import Entry, check_agents, read_entries
from agents.benchmarking.replays import EpisodeId, rerun
from agents.benchmarking.results import BenchmarkResult, check_new
from agents.benchmarking.results_format import check_summary
from agents.benchmarking.sources import names_code, policy_hash, pretrained
from agents.benchmarking.summary import summarise
from agents.cli import app
from agents.controllers.designs import design
from agents.suites.suite import find_task, load_suite, parse_suite
from shipgym import load_model
from shipgym.errors import InputError
from tests.agents.policies import random_policy
from tests.agents.small_suite import TEXT, TURNS, write_suite

N, FIRST = 4, 1_000_000
MARINER = load_model("mariner")
SMALL = parse_suite(TEXT, "small")
CALM = SMALL.task("calm")
FAIRWAY = Path(__file__).parents[2] / "examples" / "fairway.py"


def shipgym(*arguments):
    words = [str(argument) for argument in arguments]
    return CliRunner().invoke(app, ["benchmark", *words])


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    """The path of the small suite."""
    return write_suite(tmp_path_factory.mktemp("suite"))


@pytest.fixture(scope="module")
def folder(suite, tmp_path_factory):
    """Results of PID and LQ in one task, four episodes."""
    out = tmp_path_factory.mktemp("benchmark") / "results"
    benchmark("pid,lq", suite, "calm", out, episodes=N)
    return out


@pytest.fixture
def copy(folder, tmp_path):
    """The same, to be tampered with."""
    return Path(shutil.copytree(folder, tmp_path / "copy"))


class Broken:
    """Gives no number."""

    name = "broken"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.full((len(observation), 1), np.nan), state


# --- what is run, and its results


def test_results_are_read_back_as_they_were_written(folder, suite):
    again, fresh = load_results(folder), benchmark("pid,lq", suite, "calm", episodes=N)
    assert again.ranking == fresh.ranking
    for name, column in fresh.episodes.items():
        np.testing.assert_array_equal(column, again.episodes[name], err_msg=name)
    costs, others = (again.figures(name, "calm") for name in ("lq", "pid"))
    assert costs.shape == (1, N)
    cost = again.summary["tasks"]["calm"]["lq"]["cost"]
    assert cost["low"] < cost["value"] == costs.mean() < cost["high"]
    better = again.summary["improvement"]["lq"]["pid"]["value"]
    assert better == np.mean((costs < others) + 0.5 * (costs == others))


def test_the_file_names_what_it_was_made_with(folder):
    summary = json.loads((folder / "results.json").read_text())
    versions = {"shipgym", "numpy", "numba", "python", "processor"}
    assert versions <= set(summary["versions"])
    assert summary["suite"]["name"] == "small-v1"
    assert (summary["suite"]["file"], summary["suite"]["complete"]) == (
        "small.toml",
        False,
    )
    assert summary["seeds"] == {"first": FIRST, "count": N}
    assert summary["controllers"]["lq"]["source"] == "lq"
    hashes = [
        summary["suite"]["sha256"],
        summary["suite"]["tasks"]["calm"]["model_sha256"],
        summary["tasks"]["calm"]["lq"]["policy_sha256"][0],
        summary["episodes"]["sha256"],
    ]
    assert [len(one) for one in hashes] == [64] * 4


def test_the_table_is_tidy(folder):
    table = parquet.read_table(folder / "episodes.parquet")
    assert table.column_names[:4] == ["controller", "task", "run", "seed"]
    assert str(table.schema.field("success").type) == "bool"
    # course keeping has no path
    assert table.column("cross_track_rmse_m").null_count == table.num_rows == 2 * N
    assert table.column("seed").to_pylist() == 2 * [FIRST + k for k in range(N)]
    assert table.column("run").to_pylist() == 2 * N * [0]


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (("pdi", "calm"), "controller: expected one of 'pid', 'lq', got 'pdi'"),
        (("pid", "clam"), "task: expected one of 'calm', got 'clam'"),
        (("pid", "calm", "cots"), "figure: expected one of .* got 'cots'"),
    ],
)
def test_figures_of_unknown_names_are_refused(folder, asked, said):
    with pytest.raises(InputError, match=said):
        load_results(folder).figures(*asked)


def test_workers_find_the_same_bit_for_bit(folder, suite):
    result = benchmark("pid,lq", suite, "calm", workers=2, episodes=N)
    for name, column in load_results(folder).episodes.items():
        np.testing.assert_array_equal(column, result.episodes[name], err_msg=name)


def test_what_was_run_is_kept_and_not_run_again(copy, suite):
    with pytest.raises(InputError, match=r"already contains results.*--resume"):
        benchmark("pid,lq", suite, "calm", copy, episodes=N)
    (part,) = [one for one in (copy / "parts").iterdir() if '"pid"' in one.read_text()]
    kept = part.read_text()
    part.write_text(kept.replace('\\"failure\\": \\"\\"', '\\"failure\\": \\"kept\\"'))
    result = benchmark("pid,lq,los", suite, "calm", copy, resume=True, episodes=N)
    assert load_results(copy).summary["controllers"].keys() == {"pid", "lq", "los"}
    assert result.summary["tasks"]["calm"]["pid"]["failure"] == "kept"
    # los leads the LQ where there is no path
    for name in ("los", "lq"):
        np.testing.assert_array_equal(
            result.figures(name, "calm"), load_results(copy).figures("lq", "calm")
        )


def test_a_part_without_costs_is_refused(copy, suite):
    for part in (copy / "parts").iterdir():
        part.write_text(part.read_text().replace('\\"cost\\"', '\\"cots\\"'))
    said = r"part of 'pid' on 'calm': expected cost and other figures of 4 episodes"
    with pytest.raises(InputError, match=said):
        benchmark("pid,lq", suite, "calm", copy, resume=True, episodes=N)


@pytest.mark.parametrize(
    "figures",
    [
        {"cost": np.zeros(3)},
        {"overshoot": np.zeros(2)},
        {"cost": np.zeros((2, 1))},
        {"cost": np.array(["1", "2"])},
    ],
)
def test_a_cell_is_of_the_episodes_that_were_asked_for(figures):
    rest = {"failure": "", "seconds_per_action": 0.1, "policy_sha256": None}
    whole = {"cost": np.zeros(2)}
    runs = [{"figures": one, **rest} for one in (whole, figures)]
    with pytest.raises(InputError, match="here: expected cost and other figures of 2"):
        Cell.from_dict({"refused": "", "runs": runs}, 2, "here")
    cell = Cell.from_dict({"refused": "", "runs": runs[:1]}, 2, "here")
    assert cell.costs.tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize("episodes", [0, 101, 2.5])
def test_as_many_episodes_are_run_as_are_scored_at_most(suite, episodes):
    with pytest.raises(InputError, match=f"episodes: expected .* got {episodes}"):
        benchmark("pid", suite, episodes=episodes)


def test_a_controller_that_fails_is_last_and_the_ranking_shows_it(suite):
    result = benchmark([Broken(), "pid"], suite, "calm", episodes=N)
    assert result.ranking == ["pid", "broken"]
    assert result.summary["ranking"][1]["failed"] == N
    cell = result.summary["tasks"]["calm"]["broken"]
    assert "no finite number for 4 of 4 ships" in cell["failure"]
    assert cell["metrics"]["failed"]["mean"] == 1.0
    (failure,) = result.failures
    assert failure == f"broken failed in 4 episodes of calm: {cell['failure']}"


def test_one_that_cannot_run_a_task_is_named_and_the_rest_go_on(suite):
    other = LQ.from_model(load_model("kvlcc2"))
    result = benchmark({"other": other, "pid": "pid"}, suite, "calm", episodes=2)
    refused = result.summary["controllers"]["other"]["refused"]["calm"]
    assert "scale of 'yaw_rate'" in refused
    assert result.failures == [f"other could not run calm: {refused}"]
    assert result.ranking == ["pid", "other"]
    assert result.figures("other", "calm").size == 0


def test_where_no_controller_can_run_a_task_there_are_no_results(suite, tmp_path):
    (tmp_path / "empty").mkdir()
    for name in ("new", "empty"):
        words = ["--controllers", "math:sqrt", "--suite", suite, "--episodes", 1]
        answer = shipgym(*words, "--workers", 1, "--out", tmp_path / name)
        assert (answer.exit_code, answer.stdout) == (2, "")
        warning, error = answer.stderr.splitlines()
        assert warning.startswith("warning: 'math:sqrt' runs as part of this command")
        assert error.startswith(
            "error: controllers: no controller could run any task; 'sqrt' in 'calm':"
            " TypeError: must be "
        )
    assert [path.name for path in tmp_path.rglob("*")] == ["empty"]


def test_the_ranking_is_of_the_ship_and_the_rest_stands_beside_it(suite, tmp_path):
    result = benchmark("wheel-over,lq", suite, "turns", tmp_path / "out", episodes=3)
    assert result.tasks == TURNS
    assert result.summary == load_results(tmp_path / "out").summary
    for ranked in result.summary["ranking"]:
        assert ranked["tasks"] == 1
        elsewhere = {on: total["tasks"] for on, total in ranked["elsewhere"].items()}
        assert elsewhere == {"model": 1, "far": 1}
    assert result.summary["suite"]["tasks"]["turns-far"]["ship"] == "mariner"
    costs = [result.figures("wheel-over", task).mean() for task in TURNS]
    assert len(set(costs)) == 3


def test_scores_are_relative_to_the_rule_and_settings_are_those_that_were_tuned(
    tmp_path,
):
    tuned = {
        "lq": {"settings": {"integral_lengths": 80.0}, "cost": 24.0},
        "pid": {"settings": {"damping": 0.9}, "cost": 25.0},
    }
    known = {
        "rule_costs": [20.0, 40.0] * 50,
        "costs": [0.0, 1.0] * 50,
        "by": ["lq", "ppo"] * 50,
    }
    suite = write_suite(
        tmp_path, best={"calm": known}, tuned={"tasks": {"calm": tuned}}
    )
    look = benchmark("tuned-lq", suite, "calm", episodes=3)
    known_costs = {"rule": pytest.approx(80.0 / 3.0), "bound": pytest.approx(1.0 / 3.0)}
    assert look.summary["reference"] == {"calm": known_costs}  # of these episodes
    names = "tuned-best,tuned-lq,tuned-mpc,best-known"
    own = {"own": lambda task: LQ.from_model(task.ship, integral_lengths=80.0)}
    result, other = (benchmark(one, suite, "calm") for one in (names, own))
    for name in ("tuned-best", "tuned-lq"):
        costs = result.figures(name, "calm")
        np.testing.assert_array_equal(costs, other.figures("own", "calm"))
    refused = result.summary["controllers"]["tuned-mpc"]["refused"]["calm"]
    assert "expected one that was tuned" in refused
    cells = result.summary["tasks"]["calm"]
    assert cells["best-known"]["score"]["value"] == pytest.approx(60.0)
    cost = cells["tuned-lq"]["cost"]["value"]
    assert cells["tuned-lq"]["score"]["value"] == pytest.approx(30.0 / cost)
    assert cells["tuned-lq"]["gain"]["value"] == pytest.approx(1.0 - cost / 30.0)
    assert result.ranking == ["best-known", "tuned-best", "tuned-lq", "tuned-mpc"]


def kept(rule, bound):
    """What a suite keeps of a task: the rule and the bound cost the same in each."""
    return {"rule_costs": [rule] * 100, "costs": [bound] * 100, "by": ["lq"] * 100}


def test_a_summary_of_a_hundred_episodes_by_hand(tmp_path):
    """Two tasks, in one of which the rule costs nothing, and one far from design."""
    best = {
        "calm": kept(30.0, 20.0),
        "free": kept(0.0, 0.0),
        "calm-far": kept(40.0, 10.0),
    }
    source = str(write_suite(tmp_path, best=best))
    tasks = [
        SimpleNamespace(
            name=name,
            on="far" if "far" in name else "ship",
            suite=source,
            limits={},
        )
        for name in best
    ]

    def cell(*costs, times=(1e-6,)):
        figures = {"cost": np.array(costs * 50)}
        return Cell([ScoredRun(figures, seconds_per_action=time) for time in times])

    cells = {
        ("a", "calm"): cell(25.0, 20.0, times=(1e-6, 3e-6)),
        ("a", "free"): cell(5.0, 5.0),
        ("a", "calm-far"): cell(10.0, 10.0),
        ("b", "calm"): cell(30.0, 30.0),
        ("b", "free"): cell(10.0, 10.0),
        ("b", "calm-far"): Cell(refused="no"),
    }
    summary = summarise(tasks, ["b", "a"], cells)
    first, second = summary["ranking"]
    assert (first["name"], first["tasks"], first["scored_tasks"]) == ("a", 2, 1)
    names = ("score", "score_iqm", "improvement")
    assert [first[name]["value"] for name in names] == pytest.approx(
        [4.0 / 3.0, 4.0 / 3.0, 1.0]
    )
    assert [second[name]["value"] for name in names] == pytest.approx([1.0, 1.0, 0.5])
    assert first["relative_cost"] == pytest.approx(1.0)
    assert second["relative_cost"] == pytest.approx(np.sqrt(8.0 / 3.0))
    gain = summary["tasks"]["calm"]["a"]["gain"]
    assert gain["value"] == pytest.approx(0.25)
    assert 0.2 < gain["low"] < gain["high"] < 0.3
    assert summary["tasks"]["free"]["a"]["gain"]["value"] is None
    far, other_far = first["elsewhere"]["far"], second["elsewhere"]["far"]
    assert far["score"]["value"] == pytest.approx(4.0)
    assert (far["tasks"], other_far["tasks"]) == (1, 0)
    time = summary["tasks"]["calm"]["a"]["microseconds_per_action"]
    assert time == pytest.approx(2.0)
    assert summary["reference"]["calm-far"] == {"rule": 40.0, "bound": 10.0}
    thresholds, shares = summary["profile"].values()
    at = [thresholds.index(one) for one in (0.0, 0.95, 1.0, 1.2, 1.5)]
    # scores of 1.2 and 1.5 of `calm` alone
    assert [shares["a"][k] for k in at] == [1.0, 1.0, 1.0, 0.5, 0.0]
    assert [shares["b"][k] for k in at] == [1.0, 1.0, 0.0, 0.0, 0.0]
    assert summary["improvement"]["a"]["b"]["value"] == 1.0


@pytest.mark.parametrize("rule", [True, False])
def test_controllers_that_could_run_more_tasks_come_first(tmp_path, rule):
    """Then those with a higher geometric mean of the scores, which one hard task shows.

    Without the rule's costs that of the relative costs: the order is the same.
    """
    names = [f"task-{k}" for k in range(8)]
    best = {name: kept(100.0, 50.0) for name in names} if rule else {}
    suite = str(write_suite(tmp_path, best=best))
    tasks = [
        SimpleNamespace(name=name, on="ship", suite=suite, limits={}) for name in names
    ]
    costs = {
        "part": [1.0],
        "hidden": [99.0] * 7 + [1000.0],
        "even": [100.0] * 8,
    }
    cells = {("part", name): Cell(refused="no") for name in names}
    for controller, means in costs.items():
        for name, mean in zip(names, means, strict=False):
            run = ScoredRun({"cost": np.full(100, mean)})
            cells[controller, name] = Cell([run])

    ranking = summarise(tasks, list(costs), cells)["ranking"]
    assert [one["name"] for one in ranking] == ["even", "hidden", "part"]
    if rule:
        even, hidden, _ = ranking
        assert hidden["score_iqm"]["value"] > even["score_iqm"]["value"]


def test_episodes_without_a_figure_are_not_counted():
    run = ScoredRun({"terminated": np.array([1.0, 0.0, np.nan])})
    assert Cell([run, run]).count("terminated") == 2
    assert Cell([run]).count("failed") == 0


# --- who takes part


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("lqq", "got 'lqq'.*Did you mean 'lq'"),
        ("one-for-all", "expected one of 'pid'.*got 'one-for-all'"),
        ("pid,pid", "got 'pid' twice"),
        ("x=nobody.json", "got 'nobody.json'"),
        ("no_such_module:make", "whose module 'no_such_module' is not found"),
        ({"a": 3}, "'a': expected a controller.* got 3"),
        ({"a": [LQ.from_model(MARINER), 3]}, "'a': expected a controller.* got 3"),
        ([], "controllers: expected at least one, got none"),
        ("=pid", r"expected a name without any of , = / .*, got ''"),
        ({"a,b": "pid"}, "expected a name without any of .*, got 'a,b'"),
        ("a/b=pid", "expected a name without any of .*, got 'a/b'"),
        ("tests+nobody.json", r"an existing file of an agent.* got 'tests\+nobody"),
    ],
)
def test_wrong_controllers_are_refused(given, said):
    with pytest.raises(InputError, match=said):
        read_entries(given)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("json:no_such_thing", "got 'json:no_such_thing', which cannot be imported"),
        ("math:pi", r"'math:pi': expected a controller.* got 3.14\d*"),
    ],
)
def test_code_that_makes_no_controller_is_refused_when_it_is_run(given, said):
    with pytest.raises(InputError, match=said):
        benchmark(given, tasks="sharp-turns", episodes=1)


def test_controllers_are_given_as_texts_functions_objects_and_by_name():
    class Iterable(LQ):
        def __iter__(self):
            return iter(())

    def make(task):
        return pid

    pid, lazy = PID.from_model(MARINER), Broken()
    lazy.name = None
    iterable = Iterable(**vars(LQ.from_model(MARINER)))
    pattern = "{task}-pid-*.json"  # its files are looked for when a task is run
    for given, expected in (
        (" pid , mine = lq ", [("pid", "pid"), ("mine", "lq")]),
        (pid, [("pid", pid)]),
        (iterable, [("lq", iterable)]),
        (make, [("make", make)]),
        (Entry("x", "lq"), [("x", "lq")]),
        ([lazy, "pid"], [("Broken", lazy), ("pid", "pid")]),
        ({"both": [pid, make]}, [("both", [pid, make])]),
        (pattern, [("pid", pattern)]),
        ("{task}.zip", [("agent", "{task}.zip")]),
    ):
        found = [(entry.name, entry.source) for entry in read_entries(given)]
        assert found == expected
    (both,) = read_entries({"both": [pid, make]})
    assert both.policies(CALM) == (pid, pid)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("mine:make", True),
        ("my.own:make", True),
        ("make", False),
        (":make", False),
        ("mine:two words", False),
        ("folder/mine:make", False),
    ],
)
def test_code_is_named_by_a_module_and_a_function(text, names):
    assert names_code(text) is names


def test_files_that_have_the_name_of_a_controller_are_not_its_own(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    for name in ("pid", "best-known", "tuned-lq"):
        (tmp_path / name).write_text("")
        assert Entry(name, name).fingerprint(CALM) == {}


def test_classical_controllers_are_designed_for_the_ship_of_the_task():
    keeping = parse_suite(TEXT.replace('"mariner"', '"mariner-tls-svm"', 1), "x").tasks[
        0
    ]
    path = SMALL.task("turns").design_task
    assert design("lq", keeping) is design("lq", path)  # designed once for both
    guided = design("ilos", path)
    assert guided.design["dt"] == path.task.interval(path.ship)
    corridor = path.task.corridor * path.ship.particulars["length"]
    assert guided.observation_scales[8] == corridor
    (led,) = Entry("ilos", "ilos").policies(keeping)
    assert led.kind == "lq"


def test_controllers_are_given_the_model_only():
    task = SMALL.task("turns-far")
    given = []
    Entry("mine", lambda one: given.append(one) or LQ.from_model(one.ship)).policies(
        task
    )
    assert (given[0].name, given[0].true_ship, given[0].far) == ("turns", "", {})
    assert given[0].evaluation.ship.name == "mariner-tls-svm"


def test_a_design_on_the_ship_is_refused_wherever_it_is_hidden():
    task = SMALL.task("turns-far")
    ship = task.evaluation.ship

    def with_parts(design_task, **parts):
        policy = LQ.from_model(design_task.ship)
        for name, part in {"policy": policy, **parts}.items():
            object.__setattr__(policy, name, part)  # its class is frozen
        return policy

    (policy,) = Entry("mine", with_parts).policies(task)
    assert policy.policy is policy
    hidden = partial(with_parts, fallback=LQ.from_model(ship))
    for cheat in (lambda one: WheelOver.from_model(ship, task=one.task), hidden):
        with pytest.raises(InputError, match="got one on the ship 'mariner'"):
            Entry("cheat", cheat).policies(task)
    with pytest.raises(InputError, match="LQ: expected a policy made of at most 1000"):
        Entry("endless", partial(with_parts, base=Mock())).policies(task)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("td3", "there is no pretrained td3 agent for task 'calm'"),
        ("{task}-x.json", "there is no file '{task}-x.json' for task 'calm'"),
        (lambda task: 3, "with `predict` for task 'calm', got 3"),
    ],
)
def test_one_that_cannot_be_made_for_a_task_is_refused(source, said):
    with pytest.raises(InputError, match=said):
        Entry("x", source).policies(CALM)


def test_a_function_may_raise_anything():
    def fails(task):
        raise KeyError("gain")

    cell = run_cell(Entry("mine", fails), CALM, 2)
    assert (cell.refused, cell.runs) == ("KeyError: 'gain'", ())


def test_training_runs_are_files_of_one_controller(suite, tmp_path):
    for run, frequency in enumerate((0.05, 0.08)):
        pid = PID.from_model(MARINER, frequency=frequency)
        pid.save(tmp_path / f"calm-pid-{run}.json")
    result = benchmark(
        f"mine={tmp_path}/{{task}}-pid-*.json", suite, "calm", episodes=2
    )
    assert result.figures("mine", "calm").shape == (2, 2)
    about = result.summary["controllers"]["mine"]
    assert (about["runs"], len(about["files"])) == (2, 2)
    assert result.summary["improvement"] == {"mine": {}}


def test_functions_of_ones_own(suite, tmp_path, monkeypatch):
    (tmp_path / "my_autopilots.py").write_text(
        "from agents import LQ\n\n\ndef gentle(task):\n    return"
        " LQ.from_model(task.ship, integral_lengths=50.0)\n"
    )
    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    by_text = benchmark("my_autopilots:gentle", suite, "calm", episodes=2)
    gentle = {"gentle": lambda task: LQ.from_model(task.ship, integral_lengths=50.0)}
    by_function = benchmark(gentle, suite, "calm", episodes=2)
    assert sys.path == before  # the working folder is on it for this controller only
    costs, others = (one.figures("gentle", "calm") for one in (by_text, by_function))
    np.testing.assert_array_equal(costs, others)
    assert len(by_text.summary["controllers"]["gentle"]["files"]) == 1


def test_an_agent_that_fits_no_task_is_refused_before_anything_is_run(suite, tmp_path):
    guide = WheelOver.from_model(MARINER)
    guide.save(tmp_path / "guide.json")
    file = str(tmp_path / "guide.json")
    said = (
        "controllers: 'guide' fits none of the tasks: .*expected 15 observations, got 8"
    )
    with pytest.raises(InputError, match=said):
        benchmark(file, suite, "calm", tmp_path / "out", episodes=2)
    assert not (tmp_path / "out").exists()
    both = benchmark({"guide": guide, "pid": "pid"}, suite, "calm", episodes=2)
    refused = both.summary["controllers"]["guide"]["refused"]["calm"]
    assert "expected 15 observations, got 8" in refused

    path = find_task("sharp-turns")
    WheelOver.from_model(path.ship, task=path.task).save(file)
    (entry,) = read_entries(file)
    check_agents(entry, [CALM, path])  # it fits one of them
    other = str(PRETRAINED / "course-unstable-ppo-s0.json")
    with pytest.raises(InputError, match="that the agent learned with"):
        benchmark(other, suite, "calm", episodes=2)


def test_the_hash_of_a_controller_is_that_of_its_content(tmp_path):
    pid = PID.from_model(MARINER)
    pid.save(tmp_path / "pid.json")
    content = json.loads((tmp_path / "pid.json").read_text())
    text = json.dumps(content, sort_keys=True)
    assert policy_hash(pid) == hashlib.sha256(text.encode()).hexdigest()
    assert policy_hash(PID.from_model(MARINER, damping=0.9)) != policy_hash(pid)
    assert policy_hash(Broken()) is None


def test_agents_in_the_box_are_found_by_task_and_algorithm():
    runs = [path.name for path in pretrained("course-unstable", "ppo")]
    assert runs == [f"course-unstable-ppo-s{run}.json" for run in range(5)]
    assert pretrained("course", "ppo") == []


# --- tasks and suites of a user's own


OWN = """
name = "own"
[tasks.fairway]
environment = "fairway.py"
model = "kvlcc2"
options = { action = "rudder-shaft", episode_steps = 20 }
[tasks.narrow]
environment = "my_helm:harbour/Fairway-v0"
options = { half_width = 1.0, episode_steps = 20 }
"""
HELM = """
import numpy as np
import shipgym

shipgym.register_task(
    "harbour/Fairway-v0", "fairway.py", model="kvlcc2", action="rudder-shaft"
)


class Ahead:
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.tile([0.0, 0.8], (len(observation), 1)).astype(np.float32), state


def make(task):
    return Ahead()
"""
ALLOW = ("--allow-code", "fairway.py", "--allow-code", "my_helm:harbour/Fairway-v0")


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A folder in which a user has a task, a helm and a suite."""
    import gymnasium

    registered = dict(gymnasium.registry)
    shutil.copy(FAIRWAY, tmp_path / "fairway.py")
    (tmp_path / "my_helm.py").write_text(HELM)
    (tmp_path / "own.toml").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("my_helm", None)
    gymnasium.registry.clear()
    gymnasium.registry.update(registered)


def test_a_suite_of_ones_own_is_run_as_a_shipped_one(own):
    words = ["--suite", "own.toml", "--controllers", "helm=my_helm:make,lq"]
    words += ["--episodes", 2, "--workers", 2, "--out", "out", "--no-page"]
    refused = shipgym(*words)
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "--allow-code fairway.py" in refused.stderr
    answer = shipgym(*words, *ALLOW)
    assert answer.exit_code == 0, answer.stderr
    result = load_results(own / "out")
    assert result.ranking == ["helm", "lq"]
    assert result.tasks == ("fairway", "narrow")
    assert (result.figures("helm", "fairway", "success") == 1.0).all()
    about = result.summary["suite"]["tasks"]["narrow"]
    assert about["environment"] == str(own / "fairway.py")
    (refused, _) = result.summary["controllers"]["lq"]["refused"].values()
    assert "expected 'heading_error_sin', got 'heading_sin'" in refused


def test_episodes_of_a_suite_of_ones_own_are_run_again_where_it_is_given(own):
    code = ["fairway.py", "my_helm:harbour/Fairway-v0"]
    benchmark("my_helm:make", "own.toml", "fairway", "out", episodes=1, allow_code=code)
    episode = EpisodeId("make", "fairway", 0, FIRST)
    refused = rerun(load_results("out"), [episode], "my_helm:make").refused
    assert "suite: expected the one of the results, 'own'" in refused["make", "fairway"]
    suite = load_suite("own.toml", code)
    again = rerun(load_results("out", suite), [episode], "my_helm:make")
    assert (again.refused, again.different) == ({}, ())
    assert again.episodes[episode].arguments["task"] == str(own / "fairway.py")
    other = load_suite(write_suite(own))
    with pytest.raises(InputError, match="expected results of this suite"):
        load_results("out", other)


# --- files of results, which may come from anybody


def rewrite(folder, change):
    """Change the table of results, with hashes that fit."""
    result = load_results(folder)
    columns = {name: values.copy() for name, values in result.episodes.items()}
    rows = change(columns) or len(columns["seed"])
    episodes = {**result.summary["episodes"], "rows": rows}
    BenchmarkResult({**result.summary, "episodes": episodes}, columns).save(folder)


@pytest.mark.parametrize("source", ["evil_code:make", "evil_code", "*", "/dev/zero"])
def test_results_run_nothing_that_they_name(copy, suite, source, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = "open('RAN', 'w').close()\nfrom agents import LQ\n"
    code += "make = lambda task: LQ.from_model(task.ship)\n"
    for name in ("evil_code.py", "evil_code"):
        (tmp_path / name).write_text(code)
    summary = json.loads((copy / "results.json").read_text())
    summary["controllers"]["lq"] |= {"source": source, "files": {}}
    (copy / "results.json").write_text(json.dumps(summary))

    result, before = load_results(copy, load_suite(suite)), list(sys.path)
    episode = EpisodeId("lq", "calm", 0, FIRST)
    said = "expected 'lq', which results do not hold"
    assert said in rerun(result, [episode]).refused["lq", "calm"]
    assert not (tmp_path / "RAN").exists()
    assert sys.path == before
    assert rerun(result, [episode], "lq").episodes.keys() == {episode}


@pytest.mark.parametrize(
    ("name", "damage", "said"),
    [
        ("results.json", lambda data: data[:500], "may be cut short"),
        (
            "results.json",
            lambda data: data.replace(b'"format": 2', b'"format": 9'),
            "expected format 2, .* got 9",
        ),
        (
            "results.json",
            lambda data: data.replace(b'"ranking"', b'"rankings"'),
            "unknown key 'rankings'",
        ),
        (
            "results.json",
            lambda data: data.replace(b'"shipgym-benchmark"', b'"model"'),
            "kind: expected 'shipgym-benchmark', got 'model'",
        ),
        (
            "episodes.parquet",
            lambda data: data[:-10],
            "expected the file that results.json was written with",
        ),
    ],
)
def test_broken_results_are_refused(copy, name, damage, said):
    path = copy / name
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=said):
        load_results(copy)


def one_more(columns):
    columns["controller"][np.flatnonzero(columns["controller"] == "lq")[0]] = "pid"


def exchange(columns):
    columns["controller"][columns["controller"] == "lq"] = "los"


def row_of_another(columns):
    for name, values in columns.items():
        columns[name] = np.append(values, values[:1])
    columns["controller"][-1] = "los"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (one_more, "expected 1 runs of 4 episodes of 'pid' .* got 5 episodes"),
        (exchange, "expected 1 runs of 4 episodes of 'lq' .* got 0 episodes"),
        (row_of_another, "expected 0 runs of 4 episodes of 'los' .* got 1 episodes"),
    ],
)
def test_results_that_do_not_agree_with_their_episodes_are_refused(copy, change, said):
    rewrite(copy, change)
    with pytest.raises(InputError, match=said):
        load_results(copy)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda one: one["seeds"].update(count=0),
            "r.json: seeds.count: expected .* got 0",
        ),
        (
            lambda one: one["seeds"].update(count="4"),
            "r.json: seeds.count: expected .* got '4'",
        ),
        (
            lambda one: one["ranking"][0].update(name="los"),
            "r.json: name of a controller: expected .* got 'los'",
        ),
        (
            lambda one: one["improvement"].update(los={}),
            "r.json: name of a controller: expected .* got 'los'",
        ),
        (
            lambda one: one["profile"]["shares"].update(los=[]),
            "r.json: name of a controller: expected .* got 'los'",
        ),
        (
            lambda one: one["tasks"].update(rough={}),
            "r.json: name of a task: expected .* got 'rough'",
        ),
        (
            lambda one: one["reference"].update(rough={"rule": 1, "bound": 0}),
            "r.json: name of a task: expected .* got 'rough'",
        ),
        (
            lambda one: one["ranking"].clear(),
            "r.json: tasks.calm: name of a controller: expected .* got 'pid'",
        ),
        (lambda one: one["tasks"]["calm"]["lq"].pop("runs"), r"tasks.calm.lq.*runs"),
    ],
)
def test_a_summary_describes_the_controllers_and_tasks_that_it_names(
    folder, change, said
):
    summary = json.loads((folder / "results.json").read_text())
    check_summary(summary, "r.json")
    change(summary)
    with pytest.raises(InputError, match=said):
        check_summary(summary, "r.json")


def test_what_the_table_of_episodes_needs_is_missed_before_the_work(
    folder, tmp_path, monkeypatch
):
    result = load_results(folder)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    said = r"not installed, the table of episodes needs it: .*'shipgym\[bench"
    for call in (
        lambda: check_new(tmp_path / "out", False, "small-v1"),
        lambda: result.save(tmp_path / "out"),
    ):
        with pytest.raises(InputError, match=said):
            call()
    assert not (tmp_path / "out").exists()


def test_a_folder_takes_the_results_of_one_suite_only(copy, tmp_path):
    new, parts, other = (tmp_path / name for name in ("new", "parts-only", "other"))
    (parts / "parts").mkdir(parents=True)
    other.mkdir()
    for folder, resume in ((new, False), (other, False), (copy, True), (parts, True)):
        assert check_new(folder, resume, "small-v1") == folder
    (other / "letter.txt").write_text("")
    for folder, resume, suite, said in (
        (copy, False, "small-v1", "already contains results; continue with --resume"),
        (parts, False, "small-v1", "already contains results; continue with --resume"),
        (copy, True, "other-v1", "expected results of suite 'other-v1', got those of"),
        (copy / "results.json", False, "small-v1", "expected a folder .* got a file"),
        (other, True, "small-v1", "or nothing, got 'letter.txt'"),
    ):
        with pytest.raises(InputError, match=said):
            check_new(folder, resume, suite)


# --- the command


def test_the_command_ranks_and_writes(suite, tmp_path):
    out = tmp_path / "r"
    words = ["--controllers", "pid", "--suite", suite, "--tasks", "calm"]
    words += ["--episodes", 2, "--workers", 1, "--out", out, "--no-page"]
    answer = shipgym(*words)
    assert answer.exit_code == 0, answer.stderr
    assert answer.stdout.startswith("small-v1: 1 task of 2 episodes, best first")
    assert f"written: {out}" in answer.stdout.replace("\n", "")
    assert load_results(out).ranking == ["pid"]
    (out / "index.html").touch()
    again = shipgym(*words, "--resume", "--json")
    assert json.loads(again.stdout)["ranking"][0]["name"] == "pid"
    assert not (out / "index.html").exists()  # it would be of the results before


def test_the_command_goes_on_where_it_was_interrupted(suite, tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    words = ["--controllers", "lq,pid", "--suite", suite]
    words += ["--tasks", "calm", "--episodes", 2, "--workers", 1, "--out", "r"]
    with monkeypatch.context() as patched:
        patched.setattr(PID, "predict", interrupted)
        answer = shipgym(*words)
    assert answer.exit_code == 130
    assert "what was done is kept in r: continue with --resume" in answer.stderr

    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    answer = shipgym(*words, "--resume", "--page")
    assert answer.exit_code == 0
    assert "warning: there is no index.html: plotly" in answer.stderr
    assert "warning: 2 of 100 episodes: for a quick look" in answer.stderr
    assert set(load_results("r").ranking) == {"lq", "pid"}


def test_bad_input_is_one_message_and_nothing_is_written(suite, tmp_path):
    out = tmp_path / "r"
    cut, weightless, other = (
        tmp_path / f"{name}.json" for name in ("cut", "weightless", "other")
    )
    random_policy(load_model("kvlcc2")).save(other)
    weightless.write_bytes(other.read_bytes())
    cut.write_bytes(other.read_bytes()[:300])
    calm = ["--suite", suite, "--tasks", "calm"]
    for words, said in (
        (["--controllers", "pdi"], "Did you mean 'pid'"),
        (["--engine", "rai"], "engine: expected one of 'local', 'ray', got 'rai'"),
        (["--suite", "shipgym-v2"], "Did you mean 'shipgym-v1'"),
        (["--suite", tmp_path / "none.toml"], "there is no such TOML file of a suite"),
        (["--suite", suite, "--tasks", "calm,"], "task: expected one of"),
        ([*calm, "--controllers", f"pid,{cut}"], "may be cut short"),
        ([*calm, "--controllers", f"pid,{weightless}"], "no such file"),
        ([*calm, "--controllers", f"pid,{other}"], "fits none of the tasks"),
    ):
        answer = shipgym(*words, "--out", out)
        assert (answer.exit_code, answer.stdout) == (2, "")
        assert said in answer.stderr
    assert "Missing option '--out'" in shipgym("--controllers", "pid").stderr
    assert not out.exists()
