"""The benchmark: who takes part, what is run, its results and its command."""

import json
import shutil
import sys
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import gymnasium
import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from agents import LQ, PID, WheelOver, benchmark, load_results
from agents.benchmarking.entries import Entry, read_entries
from agents.cli import app
from agents.controllers.designs import design
from agents.suites.suite import parse_suite
from shipgym import load_model
from shipgym.errors import InputError
from tests.agents.policies import random_policy
from tests.agents.small_suite import TEXT, TURNS, write_suite

N, FIRST = 4, 1_000_000
MARINER = load_model("mariner")
SMALL = parse_suite(TEXT, "small")
CALM = SMALL.task("calm")
FAIRWAY = Path(__file__).parents[2] / "shipgym" / "examples" / "fairway.py"


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
    again = load_results(folder)
    fresh = benchmark("pid,lq", suite, "calm", workers=2, episodes=N)
    assert again.ranking == fresh.ranking
    pd.testing.assert_frame_equal(again.episodes, fresh.episodes, check_exact=True)
    costs = again.figures("lq", "calm")
    assert costs.shape == (1, N)
    cell = again.summary["tasks"]["calm"]["lq"]
    assert cell["cost"]["low"] < cell["cost"]["value"] == costs.mean()
    rule = again.summary["rule"]
    assert rule["controller"] == "preview-lq"  # the suite has no tuned settings
    assert cell["score"]["value"] == pytest.approx(rule["costs"]["calm"] / costs.mean())


def test_the_files_name_what_they_were_made_with(folder):
    summary = json.loads((folder / "results.json").read_text())
    versions = {"shipgym", "numpy", "numba", "python", "processor"}
    assert versions <= set(summary["versions"])
    suite = summary["suite"]
    about = (suite["name"], suite["file"], suite["complete"])
    assert about == ("small-v1", "small.toml", False)
    assert summary["seeds"] == {"first": FIRST, "count": N}
    assert summary["controllers"]["lq"]["source"] == "lq"
    hashes = (suite["sha256"], summary["episodes"]["sha256"])
    assert [len(one) for one in hashes] == [64] * 2

    table = pd.read_parquet(folder / "episodes.parquet")
    assert list(table)[:4] == ["controller", "task", "run", "seed"]
    assert table["cross_track_rmse_m"].isna().all()  # course keeping has no path
    assert table["seed"].tolist() == 2 * [FIRST + k for k in range(N)]


def test_what_was_run_is_kept_and_not_run_again(copy, suite):
    with pytest.raises(InputError, match=r"already contains results.*--resume"):
        benchmark("pid,lq", suite, "calm", copy, episodes=N)
    (part,) = [one for one in (copy / "parts").iterdir() if '"pid"' in one.read_text()]
    kept = part.read_text()
    part.write_text(kept.replace('\\"failure\\": \\"\\"', '\\"failure\\": \\"kept\\"'))
    result = benchmark("pid,lq,ilos", suite, "calm", copy, resume=True, episodes=N)
    assert load_results(copy).summary["controllers"].keys() == {"pid", "lq", "ilos"}
    assert result.summary["tasks"]["calm"]["pid"]["failure"] == "kept"
    # ilos leads the LQ where there is no path
    for name in ("ilos", "lq"):
        np.testing.assert_array_equal(
            result.figures(name, "calm"), load_results(copy).figures("lq", "calm")
        )


def test_a_controller_that_fails_or_cannot_run_a_task_is_named_and_comes_last(suite):
    other = LQ.from_model(load_model("kvlcc2"))
    given = {"other": other, "broken": Broken(), "pid": "pid"}
    result = benchmark(given, suite, "calm", episodes=N)
    assert result.ranking == ["pid", "broken", "other"]
    assert result.summary["ranking"][1]["failed"] == N
    cell = result.summary["tasks"]["calm"]["broken"]
    assert "no finite number for 4 of 4 ships" in cell["failure"]
    refused = result.summary["controllers"]["other"]["refused"]["calm"]
    assert "scale of 'yaw_rate'" in refused
    assert result.failures == [
        f"other could not run calm: {refused}",
        f"broken failed in 4 episodes of calm: {cell['failure']}",
    ]
    assert result.figures("other", "calm").size == 0


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
        "preview-lq": {"settings": {}, "cost": 25.0},
    }
    suite = write_suite(tmp_path, tuned={"tasks": {"turns": tuned, "calm": tuned}})
    names = "tuned-preview-lq,tuned-best,tuned-lq,tuned-mpc"
    own = {"own": lambda task: design("lq", task, tuned["lq"]["settings"])}
    result = benchmark(names, suite, "turns", episodes=3)
    other = benchmark(own, suite, "turns", episodes=3).figures("own", "turns")
    for name in ("tuned-best", "tuned-lq"):
        np.testing.assert_array_equal(result.figures(name, "turns"), other)
    refused = result.summary["controllers"]["tuned-mpc"]["refused"]["turns"]
    assert "expected one that was tuned" in refused
    assert result.summary["rule"]["controller"] == "tuned-preview-lq"
    cells = result.summary["tasks"]["turns"]
    assert cells["tuned-preview-lq"]["score"]["value"] == 1.0
    rule, lq = (cells[name]["cost"]["value"] for name in list(cells)[::2])
    assert cells["tuned-lq"]["score"]["value"] == pytest.approx(rule / lq)
    assert result.ranking[-1] == "tuned-mpc"


def test_those_beyond_a_limit_come_after_those_within(tmp_path):
    suite = write_suite(
        tmp_path,
        TEXT.replace("far = {", "limits = { rudder_travel_deg_min = 20.0 }\nfar = {"),
    )

    def busy(task):
        lq = LQ.from_model(task.ship, dt=task.task.interval(task.ship))
        calls = iter(range(10_000))

        class Busy:
            def predict(self, seen, state=None, starts=None, deterministic=True):
                actions, state = lq.predict(seen, state, starts, deterministic)
                return actions + 0.3 * (-1.0) ** next(calls), state

        return Busy()

    lazy = Mock(spec=["predict"])
    lazy.predict = lambda seen, *_: (np.zeros((len(seen), 1)), None)
    result = benchmark({"busy": busy, "lazy": lazy}, suite, "turns", episodes=2)
    assert result.ranking == ["lazy", "busy"]
    assert result.summary["ranking"][1]["exceeding"] == 1


# --- who takes part


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("lqq", "got 'lqq'.*Did you mean 'lq'"),
        ("best-known", "expected one of 'pid'.*got 'best-known'"),
        ("pid,pid", "got 'pid' twice"),
        ("x=nobody.json", "got 'nobody.json'"),
        ("model.zip", r"LearnedPolicy\.from_sb3\(agent\)\.save\('agent\.json'\)"),
        ("no_such_module:make", "whose module 'no_such_module' is not found"),
        ({"a": 3}, "'a': expected a controller.* got 3"),
        ({"a": [LQ.from_model(MARINER), 3]}, "'a': expected a controller.* got 3"),
        ([], "controllers: expected at least one, got none"),
        ("=pid", r"expected a name before '=', got none"),
    ],
)
def test_wrong_controllers_are_refused(given, said):
    with pytest.raises(InputError, match=said):
        read_entries(given)


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
        ("{task}.json", [("agent", "{task}.json")]),
    ):
        found = [(entry.name, entry.source) for entry in read_entries(given)]
        assert found == expected
    (both,) = read_entries({"both": [pid, make]})
    assert both.policies(CALM) == [pid, pid]


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

    (policy,) = Entry("mine", partial(with_parts, base=Mock())).policies(task)
    assert policy.policy is policy
    hidden = partial(with_parts, fallback=LQ.from_model(ship))
    for cheat in (lambda one: WheelOver.from_model(ship, task=one.task), hidden):
        with pytest.raises(InputError, match="got one on the ship 'mariner'"):
            Entry("cheat", cheat).policies(task)


def test_training_runs_are_files_of_one_controller(suite, tmp_path):
    for run, frequency in enumerate((0.05, 0.08)):
        pid = PID.from_model(MARINER, frequency=frequency)
        pid.save(tmp_path / f"calm-pid-{run}.json")
    pattern = f"mine={tmp_path}/{{task}}-pid-*.json"
    result = benchmark(pattern, suite, "calm", episodes=2)
    assert result.figures("mine", "calm").shape == (2, 2)
    about = result.summary["controllers"]["mine"]
    assert (about["runs"], len(about["files"])) == (2, 2)


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
    # the rule cannot steer this ship by her shaft too: there are no scores
    assert result.summary["ranking"][0]["score"]["value"] is None
    about = result.summary["suite"]["tasks"]["narrow"]
    assert about["environment"] == str(own / "fairway.py")
    (refused, _) = result.summary["controllers"]["lq"]["refused"].values()
    assert "expected 'heading_error_sin', got 'heading_sin'" in refused


# --- files of results, which may come from anybody


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("results.json", b'"versions"', b'"', "may be cut short"),
        ("results.json", b'"format": 3', b'"format": 2', "expected format 3, .* got 2"),
        ("results.json", b'"ranking"', b'"rankings"', "unknown key 'rankings'"),
        (
            "results.json",
            b'"shipgym-benchmark"',
            b'"model"',
            "kind: expected 'shipgym-benchmark', got 'model'",
        ),
        ("results.json", b'"runs": 1', b'"runs": 2', "got other content"),
        (
            "episodes.parquet",
            b"PAR1",
            b"PAR2",
            "expected the file that results.json was written with",
        ),
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
    answer = shipgym(*words, "--resume")
    assert answer.exit_code == 0
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
        (["--episodes", 101], "--episodes"),
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
