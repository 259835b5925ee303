"""The benchmark: who takes part, what is run, its results and its command."""

import json
import shutil
import sys
from pathlib import Path
from unittest.mock import Mock

import gymnasium
import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from agents import LQ, PID, benchmark, load_results
from agents.benchmarking.entries import Entry, read_entries
from agents.cli import app
from agents.controllers.designs import design
from agents.suites.suite import parse_suite
from shipgym import load_model
from shipgym.errors import InputError
from tests.agents.small_suite import SETS, TEXT, write_suite

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


def test_results_are_those_of_any_worker_and_read_back_as_they_were_written(
    folder, suite
):
    result = load_results(folder)
    fresh = benchmark("pid,lq", suite, "calm", workers=2, episodes=N)
    pd.testing.assert_frame_equal(result.episodes, fresh.episodes)
    assert result.ranking == ["lq", "pid"]
    summary = json.loads((folder / "results.json").read_text())
    assert {"shipgym", "numpy", "python"} <= set(summary["versions"])
    about = [summary["suite"][name] for name in ("name", "file", "n_tasks")]
    assert about == ["small-v1", "small.toml", 2]
    assert summary["suite"]["tasks"]["calm"]["rule"] == "preview-lq"
    table = pd.read_parquet(folder / "episodes.parquet")
    assert list(table)[:5] == ["controller", "task", "set", "run", "seed"]
    assert table["cross_track_rmse_m"].isna().all()  # course keeping has no path
    seeds = [FIRST + k for k in range(N)] + [2 * FIRST + k for k in range(N)]
    assert table["seed"].tolist() == 2 * seeds
    frame = result.to_frame()
    assert frame["set"].tolist() == ["ship", "ship", "fresh", "fresh"]
    cost = result.figures("lq", "calm").mean()
    assert frame.query("controller == 'lq'")["cost"].iloc[0] == pytest.approx(cost)


def test_what_was_run_is_kept_and_not_run_again(copy, suite):
    with pytest.raises(InputError, match=r"already contains results.*--resume"):
        benchmark("pid,lq", suite, "calm", copy, episodes=N)
    (part,) = [
        one for one in (copy / "parts").iterdir() if '\\"pid\\"' in one.read_text()
    ]
    was, now = (f'\\"failures\\": {{{how}}}' for how in ("", '\\"ship\\": \\"kept\\"'))
    kept = part.read_text().replace(was, now)
    assert kept != part.read_text()
    part.write_text(kept)
    result = benchmark("pid,lq,ilos", suite, "calm", copy, resume=True, episodes=N)
    assert result.failures == ["pid in calm: kept (0 episodes failed)"]
    # ilos leads the LQ where there is no path
    costs = load_results(copy).figures("lq", "calm")
    np.testing.assert_array_equal(result.figures("ilos", "calm"), costs)


def test_each_seed_has_other_episodes(suite):
    first, other = (
        benchmark("lq", suite, "calm", episodes=2, seed=seed) for seed in (0, 1)
    )
    assert set(other.episodes["seed"]).isdisjoint(first.episodes["seed"])


def test_a_controller_that_fails_or_cannot_run_a_task_is_named_and_comes_last(suite):
    other = LQ.from_model(load_model("kvlcc2"))
    given = {"other": other, "broken": Broken(), "pid": "pid"}
    result = benchmark(given, suite, "calm", episodes=N)
    assert result.ranking == ["pid", "broken", "other"]
    first, second, last = result.summary["ranking"]["steering"]
    assert (first["scores"], first["tasks"], first["of"]) == ({}, 1, 2)
    assert (second["failed"], last["tasks"]) == (N, 0)
    refused, *failed = result.failures
    assert "other could not run calm: " in refused
    assert "scale of 'yaw_rate'" in refused
    assert "broken in calm: step 0: expected numbers in [-1, 1]" in failed[0]
    assert result.figures("other", "calm").size == 0


def test_the_ranking_is_of_the_ship_and_the_rest_stands_beside_it(tmp_path):
    text = TEXT.replace('model = "mariner"', 'model = "mariner"\npart = "other"')
    suite = write_suite(tmp_path, text)
    result = benchmark("wheel-over,lq", suite, "turns", tmp_path / "out", episodes=3)
    assert result.summary == load_results(tmp_path / "out").summary
    assert list(result.summary["tasks"]["turns"]) == SETS
    for ranked in result.summary["ranking"]["steering"]:
        assert list(ranked["scores"]) == SETS
    costs = [result.figures("wheel-over", "turns", on=on).mean() for on in SETS]
    assert len(set(costs)) == 5
    assert [result.figures("lq", "turns", on=on).shape[1] for on in SETS] == 3 * [3] + [
        1,
        1,
    ]


def test_scores_are_relative_to_the_rule_and_settings_are_those_that_were_tuned(
    tmp_path,
):
    tuned = {
        "lq": [
            {"settings": {"integral_lengths": n}, "cost": 24.0} for n in (80.0, 60.0)
        ],
        "preview-lq": [{"settings": {}, "cost": 25.0, "ship_steps": 9}],
    }
    suite = write_suite(
        tmp_path,
        "budget = 8"
        + TEXT.replace('ship = "mariner"', 'ship = "mariner"\nrule = "tuned-lq"'),
        tuned={"tasks": {"turns": tuned}},
    )
    own = {"own": lambda task, seed: design("lq", task, tuned["lq"][seed]["settings"])}
    names = {name: name for name in ("tuned-lq", "tuned-mpc", "tuned-preview-lq")}
    result = benchmark(names | own, suite, "turns", episodes=3, runs=2)
    costs = result.figures("own", "turns")
    assert costs.shape == (2, 3)
    np.testing.assert_array_equal(result.figures("tuned-lq", "turns"), costs)
    cells = result.cells("turns")
    assert cells["tuned-lq"]["score"] == {"value": 1.0, "low": 1.0, "high": 1.0}
    refused = {
        name: about["refused"].get("turns", "")
        for name, about in result.summary["controllers"].items()
    }
    assert "expected one that was tuned" in refused["tuned-mpc"]
    assert "expected at most 8 ship steps" in refused["tuned-preview-lq"]


def test_those_beyond_a_limit_come_after_those_within(tmp_path):
    limits = "limits = { rudder_travel_deg_min = 20.0 }\nsweep = ["
    suite = write_suite(tmp_path, TEXT.replace("sweep = [", limits))

    def busy(task):
        lq = LQ.from_model(task.ship, dt=task.task.interval(task.ship))
        calls = iter(range(10_000))
        bang = Mock(spec=["predict"])
        bang.predict = lambda seen, state, *rest: (
            lq.predict(seen)[0] + 0.9 * (-1.0) ** next(calls),
            state,
        )
        return bang

    lazy = Mock(spec=["predict"])
    lazy.predict = lambda seen, *_: (np.zeros((len(seen), 1)), None)
    result = benchmark({"busy": busy, "lazy": lazy}, suite, "turns", episodes=2)
    assert result.ranking == ["lazy", "busy"]
    assert result.summary["ranking"]["steering"][1]["exceeding"] == ["turns"]
    assert "expected numbers in [-1, 1], got others" in result.failures[0]


# --- who takes part


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("lqq", "got 'lqq'.*Did you mean 'lq'"),
        ("pid,pid", "got 'pid' twice"),
        ("x=nobody.json", "got 'nobody.json'"),
        ("no_such_module:make", "'no_such_module:make', which cannot be imported"),
        ({"a": 3}, "'a': expected a controller.* got 3"),
        ([], "controllers: expected at least one, got none"),
        ("=pid", r"expected different names before '=', got ''"),
    ],
)
def test_wrong_controllers_are_refused(given, said):
    with pytest.raises(InputError, match=said):
        read_entries(given)


PILOTS = """\
class Pilot:
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return 1 / 0


def factory(task):
    return Pilot()
"""


def test_a_function_in_a_file_makes_a_controller_and_its_fault_has_a_line(
    suite, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    file = Path("my_pilots.py")
    file.write_text(PILOTS, "utf-8")
    result = benchmark("my_pilots.py:factory", suite, "calm", episodes=2)
    assert "my_pilots.py, line 3)" in result.failures[0]
    for given, said in (
        ("my_pilots.py", "expected my_pilots.py:function"),
        ("my_pilots.py:factry", "got 'factry'. Did you mean 'factory'"),
        ("no_pilots.py:factory", "expected a Python file, got no such file"),
    ):
        with pytest.raises(InputError, match=said):
            read_entries(given)
    file.write_text("def factory(task:\n", "utf-8")
    with pytest.raises(InputError, match=r"my_pilots\.py, line 1: cannot be exec"):
        read_entries("my_pilots.py:factory")


def test_controllers_are_given_as_texts_functions_objects_and_by_name():
    def make(task):
        return pid

    pid, lazy = PID.from_model(MARINER), Broken()
    lazy.name = None
    pattern = "{task}-pid-*.json"  # its files are looked for when a task is run
    for given, expected in (
        (" pid , mine = lq ", [("pid", "pid"), ("mine", "lq")]),
        (pid, [("pid", pid)]),
        (make, [("make", make)]),
        (Entry("x", "lq"), [("x", "lq")]),
        ([lazy, "pid"], [("Broken", lazy), ("pid", "pid")]),
        (pattern, [(pattern, pattern)]),
    ):
        found = [(entry.name, entry.source) for entry in read_entries(given)]
        assert found == expected
    (made,) = read_entries(make)
    assert made.made(CALM).policies == [pid]


def test_controllers_are_given_the_model_only_and_designs_on_the_ship_are_refused():
    task = SMALL.task("turns")
    given = []
    mine = Entry("mine", lambda one: given.append(one) or LQ.from_model(one.ship))
    mine.made(task)
    assert (given[0].name, given[0].true_ship, given[0].sweep) == ("turns", "", ())
    assert given[0].scenario("ship").ship.name == "mariner-tls-svm"

    with pytest.raises(InputError, match="got one on the ship 'mariner'"):
        Entry("cheat", lambda _: LQ.from_model(MARINER)).made(task)


def test_a_run_that_sails_more_than_the_budget_is_refused():
    def trained(task, seed):
        task.engine(10).reset(np.arange(10))
        engine = task.engine(10)
        engine.reset(np.arange(10))
        for _ in range(9):
            engine.step(np.zeros((10, 1)))
        env = gymnasium.make(task.env_id, model=task.ship, **task.arguments)
        env.reset(seed=0)
        env.step(np.zeros(1))
        return LQ.from_model(task.ship)

    made = Entry("mine", trained).made(CALM, runs=3, budget=91)
    assert (len(made.policies), made.ship_steps) == (3, 91.0)
    with pytest.raises(InputError, match=r"at most 90 ship steps .* got 91"):
        Entry("mine", trained).made(CALM, budget=90)


def test_training_runs_are_files_of_one_controller(suite, tmp_path):
    for run, frequency in enumerate((0.05, 0.08)):
        pid = PID.from_model(MARINER, frequency=frequency)
        pid.save(tmp_path / f"calm-pid-{run}.json")
    pattern = f"mine={tmp_path}/{{task}}-pid-*.json"
    result = benchmark(pattern, suite, "calm", episodes=2)
    assert result.figures("mine", "calm").shape == (2, 2)
    assert len(result.summary["controllers"]["mine"]["files"]) == 2


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


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A folder in which a user has a task, a helm and a suite."""
    registered = dict(gymnasium.registry)
    shutil.copy(FAIRWAY, tmp_path / "fairway.py")
    (tmp_path / "my_helm.py").write_text(HELM)
    (tmp_path / "own.toml").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("my_helm", None)
    gymnasium.registry.clear()
    gymnasium.registry.update(registered)


def test_a_task_in_which_losing_pays_is_not_ranked(own):
    text = FAIRWAY.read_text().replace("def worst_cost(", "def not_it(")
    (own / "fairway.py").write_text(text)
    words = ["--suite", "own.toml", "--controllers", "lq", "--allow-code"]
    answer = shipgym(*words, "--tasks", "fairway", "--out", "out")
    assert answer.exit_code == 2
    assert "fairway: expected worst_cost(settings) in " in answer.stderr


def test_a_suite_of_ones_own_is_run_as_a_shipped_one(own):
    words = ["--suite", "own.toml", "--controllers", "helm=my_helm:make,lq"]
    words += ["--episodes", 2, "--workers", 2, "--out", "out"]
    refused = shipgym(*words)
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "if you trust the suite: --allow-code" in refused.stderr
    answer = shipgym(*words, "--allow-code")
    assert answer.exit_code == 0, answer.stderr
    result = load_results(own / "out")
    assert result.ranking == ["helm", "lq"]
    assert result.tasks == ("fairway", "narrow")
    # 20 steps do not lead her past the zone
    assert (result.figures("helm", "fairway", "success") == 0.0).all()
    # the rule cannot steer this ship by her shaft too: there are no scores
    assert result.summary["ranking"]["steering"][0]["scores"]["ship"]["value"] is None
    about = result.summary["suite"]["tasks"]["narrow"]
    assert about["environment"] == str(own / "fairway.py")
    (refused, _) = result.summary["controllers"]["lq"]["refused"].values()
    assert "expected 'heading_error_sin', got 'heading_sin'" in refused


# --- files of results, which may come from anybody


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("results.json", b'"versions"', b'"', "may be cut short"),
        ("results.json", b'"format": 5', b'"format": 4', "expected format 5, .* got 4"),
        ("results.json", b'"shipgym-benchmark"', b'"model"', "kind: expected"),
        ("results.json", b'"runs": 1', b'"runs": 2', "got other content"),
        ("episodes.parquet", b"PAR1", b"PAR2", "expected it and episodes"),
    ],
)
def test_broken_results_are_refused(copy, name, old, new, said):
    path = copy / name
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))
    with pytest.raises(InputError, match=said):
        load_results(copy)


# --- the command


def test_the_command_ranks_and_writes(suite, tmp_path):
    out = tmp_path / "r"
    words = ["--controllers", "pid", "--suite", suite, "--tasks", "calm"]
    words += ["--episodes", 2, "--workers", 1, "--out", out]
    answer = shipgym(*words)
    assert answer.exit_code == 0, answer.stderr
    assert answer.stdout.startswith("small-v1, steering: 2 episodes of each task")
    assert "score" not in answer.stdout  # which needs all tasks
    assert "warning: 2 of 100 episodes: for a quick look" in answer.stderr
    assert (out / "index.html").exists()
    again = shipgym(*words, "--resume", "--json")
    (ranked,) = json.loads(again.stdout)["ranking"]["steering"]
    assert (ranked["name"], ranked["tasks"], ranked["of"]) == ("pid", 1, 2)


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
    kept, _, again = answer.stderr.partition("; go on with: shipgym benchmark ")
    assert kept == "error: interrupted; finished jobs kept in r: 1"
    assert shipgym(*again.split()).exit_code == 0
    assert set(load_results("r").ranking) == {"lq", "pid"}


def test_bad_input_is_one_message_and_nothing_is_written(suite, tmp_path):
    out = tmp_path / "r"
    for words, said in (
        (["--controllers", "pdi"], "Did you mean 'pid'"),
        (["--episodes", 101], "--episodes"),
        (["--engine", "rai"], "engine: expected one of 'local', 'ray', got 'rai'"),
        (["--suite", "shipgym-v2"], "Did you mean 'shipgym-v1'"),
        (["--suite", tmp_path / "none.toml"], "there is no such TOML file of a suite"),
        (["--suite", suite, "--tasks", "calm,"], "task: expected one of"),
        (["--suite", suite, "--resume"], "no results are there; leave --resume out"),
    ):
        answer = shipgym(*words, "--out", out)
        assert (answer.exit_code, answer.stdout) == (2, "")
        assert said in answer.stderr
    assert not out.exists()
