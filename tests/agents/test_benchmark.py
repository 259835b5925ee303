import hashlib
import inspect
import json
import sys
from copy import deepcopy
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import LQ, PID, WheelOver, benchmark, load_results
from agents.agent_file import PRETRAINED
from agents.benchmarking.contestants import (
    Contestant,
    _is_like,
    check_agents,
    contestants,
    names_code,
    policy_hash,
    pretrained,
)
from agents.benchmarking.replays import EpisodeId, _gathered, rerun
from agents.benchmarking.results import BenchmarkResult, check_new, versions
from agents.benchmarking.results_shape import check_summary
from agents.benchmarking.run import _chosen, _run, checked_part, results_of
from agents.benchmarking.summary import _count, _place, summary_of
from agents.benchmarking.verification import Check, _compared, _sampled, verify
from agents.cli import app
from agents.cli.benchmark_tables import ranking_table
from agents.controllers.designs import design
from agents.suites.reference import best_costs, best_known, reference_costs
from agents.suites.suite import load_suite
from shipgym import load_model
from shipgym.errors import InputError
from tests.agents.policies import random_policy
from tests.golden.texts import same_text

TASKS = ["mariner-calm"]
N = 4


def shipgym(*arguments):
    return CliRunner().invoke(
        app, ["benchmark", *(str(argument) for argument in arguments)]
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of PID and LQ in one task, four episodes."""
    out = tmp_path_factory.mktemp("benchmark") / "results"
    benchmark("pid,lq", tasks=TASKS, out=out, episodes=N)
    return out


@pytest.fixture
def copy(folder, tmp_path):
    """The same, to be tampered with."""
    for name in ("results.json", "episodes.parquet"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    return tmp_path


def test_results_are_read_back_as_they_were_written(folder):
    again, fresh = load_results(folder), benchmark("pid,lq", tasks=TASKS, episodes=N)
    assert again.ranking == fresh.ranking == ["lq", "pid"]
    for name, column in fresh.episodes.items():
        np.testing.assert_array_equal(column, again.episodes[name], err_msg=name)
    costs = again.figures("lq", "mariner-calm")
    assert costs.shape == (1, N)
    found = again.summary["tasks"]["mariner-calm"]["lq"]
    assert found["cost"]["value"] == costs.mean()
    assert found["cost"]["low"] < costs.mean() < found["cost"]["high"]
    assert again.summary["improvement"]["lq"]["pid"]["value"] == np.mean(
        costs < again.figures("pid", "mariner-calm")
    )


def test_the_file_names_what_it_was_made_with(folder):
    summary = json.loads((folder / "results.json").read_text())
    assert {"shipgym", "numpy", "numba", "python", "processor"} <= set(
        summary["versions"]
    )
    assert len(summary["suite"]["sha256"]) == 64
    assert len(summary["suite"]["tasks"]["mariner-calm"]["model_sha256"]) == 64
    assert summary["seeds"] == {"first": 1_000_000, "count": N}
    assert summary["contestants"]["lq"]["source"] == "lq"
    assert len(summary["tasks"]["mariner-calm"]["lq"]["policy_sha256"][0]) == 64


def test_the_table_is_tidy(folder):
    import pyarrow.parquet as parquet

    table = parquet.read_table(folder / "episodes.parquet")
    assert table.num_rows == 2 * N
    assert table.column_names[:4] == ["contestant", "task", "run", "seed"]
    assert str(table.schema.field("success").type) == "bool"
    assert (
        table.column("cross_track_rmse_m").null_count == 2 * N
    )  # course keeping has no path
    assert table.column("seed").to_pylist() == 2 * [1_000_000 + k for k in range(N)]
    assert table.column("run").to_pylist() == 2 * N * [0]


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (
            ("pdi", "mariner-calm"),
            "contestant: expected one of 'pid', 'lq'",
        ),
        (
            ("pid", "mariner-clam"),
            "task: expected one of 'mariner-calm'",
        ),
        (("pid", "mariner-calm", "cots"), "figure: expected"),
    ],
)
def test_figures_of_nobody_are_refused(folder, asked, said):
    with pytest.raises(InputError, match=said):
        load_results(folder).figures(*asked)


def test_workers_find_the_same_bit_for_bit(folder, tmp_path):
    result = benchmark(
        "pid,lq", tasks=TASKS, out=tmp_path / "two", workers=2, episodes=N
    )
    for name, column in load_results(folder).episodes.items():
        np.testing.assert_array_equal(column, result.episodes[name], err_msg=name)


def test_what_was_done_is_kept_and_not_done_again(folder, copy, monkeypatch):
    parts = copy / "parts"
    parts.mkdir()
    for path in (folder / "parts").iterdir():
        (parts / path.name).write_bytes(path.read_bytes())
    with pytest.raises(InputError, match=r"already contains results.*--resume"):
        benchmark("pid,lq", tasks=TASKS, out=copy, episodes=N)
    asked = []
    monkeypatch.setattr(
        "agents.benchmarking.run.evaluate",
        lambda policy, *rest: asked.append(policy.name) or original(policy, *rest),
    )
    from agents.rollouts.metrics import evaluate as original

    result = benchmark("pid,lq,los", tasks=TASKS, out=copy, resume=True, episodes=N)
    assert asked == [
        "lq"
    ]  # los leads the LQ where there is no path; pid and lq are there
    np.testing.assert_array_equal(
        result.figures("los", "mariner-calm"), result.figures("lq", "mariner-calm")
    )
    assert load_results(copy).summary["contestants"].keys() == {"pid", "lq", "los"}


class Broken:
    name = "broken"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.full((len(observation), 1), np.nan), state


def test_a_contestant_that_fails_is_last_and_the_ranking_shows_it():
    result = benchmark([Broken(), "pid"], tasks=TASKS, episodes=N)
    assert result.ranking == ["pid", "broken"]
    assert result.summary["ranking"][1]["failed"] == N
    found = result.summary["tasks"]["mariner-calm"]["broken"]
    assert "no finite number for 4 of 4 ships" in found["failure"]
    assert found["metrics"]["failed"]["mean"] == 1.0


def test_places_are_by_tasks_then_score_then_cost():
    def entry(tasks, score, cost):
        return {"tasks": tasks, "score": {"value": score}, "relative_cost": cost}

    dear, cheap, part, unknown = (
        entry(2, 0.9, 5.0),
        entry(2, 0.1, 1.0),
        entry(1, 3.0, 0.5),
        entry(2, None, None),
    )
    for by_score, order in (
        (True, [dear, cheap, unknown, part]),
        (False, [cheap, dear, unknown, part]),
    ):
        assert (
            sorted([part, unknown, cheap, dear], key=partial(_place, by_score=by_score))
            == order
        )


def test_one_that_cannot_take_part_is_said_and_the_rest_go_on():
    other = LQ.from_model(load_model("kvlcc2"))
    result = benchmark({"other": other, "pid": "pid"}, tasks=TASKS, episodes=2)
    refused = result.summary["contestants"]["other"]["refused"]["mariner-calm"]
    assert "scale of 'yaw_rate'" in refused
    assert result.ranking == ["pid", "other"]
    assert result.figures("other", "mariner-calm").size == 0
    assert result.allow_code == ()


def test_where_nobody_can_take_part_there_are_no_results(tmp_path):
    for folder in ("new", "empty"):
        out = tmp_path / folder
        if folder == "empty":
            out.mkdir()
        answer = shipgym(
            "--controllers",
            "math:sqrt",
            "--tasks",
            "mariner-calm",
            "--episodes",
            1,
            "--workers",
            1,
            "--out",
            out,
        )
        assert (answer.exit_code, answer.stdout) == (2, "")
        assert answer.stderr.startswith(
            "error: controllers: nobody took part in any task; 'sqrt' in"
            " 'mariner-calm': TypeError: must be "
        )
    assert [path.name for path in tmp_path.rglob("*")] == ["empty"]


def test_a_write_protected_folder_is_refused_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setattr("agents.output.os.access", lambda path, mode: path != tmp_path)
    with pytest.raises(InputError, match="cannot be written to; choose another folder"):
        benchmark("pid", tasks=TASKS, out=tmp_path / "out", episodes=2)
    assert not list(tmp_path.iterdir())


def test_an_agent_that_observes_what_no_task_shows_is_refused_before_anything_is_run(
    tmp_path,
):
    guide = WheelOver.from_model(load_model("mariner"))
    guide.save(tmp_path / "guide.json")
    with pytest.raises(InputError) as error:
        benchmark(
            str(tmp_path / "guide.json"), tasks=TASKS, out=tmp_path / "out", episodes=2
        )
    assert (
        str(error.value)
        == f"controllers: 'guide' fits no task asked for: '{tmp_path / 'guide.json'}'"
        " on task 'mariner-calm': 8 observations found, expected 13; in one and not"
        " in the other: cross_track, course_error_sin, course_error_cos,"
        " turn_distance, turn_angle"
    )
    assert not (tmp_path / "out").exists()
    refused = benchmark(
        {"guide": guide, "pid": "pid"}, tasks=TASKS, episodes=2
    ).summary["contestants"]
    assert refused["guide"]["refused"]["mariner-calm"].startswith(
        "'guide' on task 'mariner-calm': 8 observ"
    )


def test_an_agent_of_the_first_suite_is_told_that_paths_of_the_second_show_more():
    said = (
        "that the agent learned with in shipgym/PathFollowing-v0: observation 11 is"
        " 'next_turn_distance'"
    )
    with pytest.raises(
        InputError, match=rf"fits no task asked for: .*: not those {said}"
    ):
        benchmark(
            str(PRETRAINED / "container-path-ppo.json"),
            "shipgym-v2",
            tasks=["sharp-turns"],
            episodes=2,
        )


def test_training_runs_of_one_contestant(tmp_path):
    ship = load_model("mariner")
    for run, frequency in enumerate((0.05, 0.08)):
        PID.from_model(ship, frequency=frequency).save(
            tmp_path / f"mariner-calm-pid-{run}.json"
        )
    result = benchmark(f"mine={tmp_path}/{{task}}-pid-*.json", tasks=TASKS, episodes=2)
    assert result.figures("mine", "mariner-calm").shape == (2, 2)
    assert result.summary["contestants"]["mine"]["runs"] == 2
    assert len(result.summary["contestants"]["mine"]["files"]) == 2
    profile = result.summary["improvement"]
    assert profile == {"mine": {}}


def test_functions_of_ones_own(tmp_path, monkeypatch):
    (tmp_path / "my_autopilots.py").write_text(
        "from agents import LQ\n\n\ndef gentle(task):\n    return"
        " LQ.from_model(task.ship, integral_lengths=50.0)\n"
    )
    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    by_text = benchmark("my_autopilots:gentle", tasks=TASKS, episodes=2)
    by_function = benchmark(
        {"gentle": lambda task: LQ.from_model(task.ship, integral_lengths=50.0)},
        tasks=TASKS,
        episodes=2,
    )
    assert sys.path == before  # the working folder is on it for this contestant only
    assert by_text.ranking == ["gentle"]
    np.testing.assert_array_equal(
        by_text.figures("gentle", "mariner-calm"),
        by_function.figures("gentle", "mariner-calm"),
    )
    assert len(by_text.summary["contestants"]["gentle"]["files"]) == 1
    assert (by_text.allow_code, by_function.allow_code) == (
        ("my_autopilots:gentle",),
        (),
    )


def test_settings_that_were_tuned_and_costs_that_are_kept(tmp_path, monkeypatch):
    kept = {
        "tuned": {
            "tasks": {
                "mariner-calm": {
                    "lq": {"settings": {"integral_lengths": 80.0}, "cost": 24.0},
                    "pid": {"settings": {"damping": 0.9}, "cost": 25.0},
                }
            }
        },
        "best": {
            "mariner-calm": {
                "zero": 30.0,
                "costs": [float(k) for k in range(2)],
                "by": ["lq", "ppo"],
            }
        },
    }
    for name, content in kept.items():
        (tmp_path / f"{name}.json").write_text(json.dumps(content))
    monkeypatch.setattr(
        "agents.suites.reference.suite_file",
        lambda suite, what: tmp_path / f"{what}.json",
    )
    with pytest.raises(
        InputError, match=r"best\.json: mariner-calm: expected costs of 100 episodes"
    ):
        reference_costs("shipgym-v1")
    look = benchmark("tuned-lq", tasks=TASKS, episodes=2)
    assert (
        look.summary["reference"] == {}
    )  # costs of all episodes say nothing of the first two
    for place in ("agents.benchmarking.summary", "agents.suites.reference"):
        monkeypatch.setattr(f"{place}.N_EPISODES", 2)
    result = benchmark(
        "tuned-best,tuned-lq,tuned-mpc,best-known", tasks=TASKS, episodes=2
    )
    own = benchmark(
        {"own": lambda task: LQ.from_model(task.ship, integral_lengths=80.0)},
        tasks=TASKS,
        episodes=2,
    )
    for name in ("tuned-best", "tuned-lq"):
        np.testing.assert_array_equal(
            result.figures(name, "mariner-calm"),
            own.figures("own", "mariner-calm"),
            err_msg=name,
        )
    refused = result.summary["contestants"]["tuned-mpc"]["refused"]["mariner-calm"]
    assert "no tuned settings of 'mpc'" in refused
    found = result.summary["tasks"]["mariner-calm"]
    assert (
        found["best-known"]["score"]["value"] == 1.0
    )  # its first two costs are 0 and 1
    cost = found["tuned-lq"]["cost"]["value"]
    assert found["tuned-lq"]["score"]["value"] == pytest.approx((30.0 - cost) / 29.5)
    assert result.ranking == ["best-known", "tuned-best", "tuned-lq", "tuned-mpc"]
    assert (
        ranking_table(result).row_count == 4
    )  # the best known, which acts in no time, too


def test_classical_controllers_are_designed_for_the_ship_of_the_task():
    keeping, path = (
        load_suite().task(name) for name in ("mariner-calm", "mariner-current")
    )
    assert design("lq", keeping) is design(
        "lq", path
    )  # the same ship and interval: designed once
    guided = design("ilos", path)
    assert guided.design["dt"] == path.task.interval(path.ship)
    assert (
        guided.observation_scales[8]
        == path.task.corridor * path.ship.particulars["length"]
    )
    (led,) = contestants("ilos")[0].policies(keeping, "any")
    assert led.kind == "lq"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("lqq", "'lqq' found.*Did you mean 'lq'"),
        ("pid,pid", "'pid' found twice"),
        ("x=nobody.json", "'nobody.json' found"),
        ("no_such_module:make", "'no_such_module:make' cannot be imported"),
        ("json:no_such_thing", "'json:no_such_thing' cannot be imported"),
        ("math:pi", r"'math:pi' is 3.14\d*, expected a controller"),
        ({"a": 3}, "'a' is 3, expected a controller"),
        (
            {"a": [LQ.from_model(load_model("mariner")), 3]},
            "'a' is 3, expected a controller",
        ),
        ([], "none found"),
        ("=pid", "name '' found, expected one without any of , = /"),
        ({"a,b": "pid"}, "name 'a,b' found, expected one without any of , = /"),
        ("a/b=pid", "name 'a/b' found, expected one without any of , = /"),
        (
            "tests+nobody.json",
            r"'tests\+nobody.json' found, expected .* a file of an agent that is there",
        ),
    ],
)
def test_wrong_contestants(given, said):
    with pytest.raises(InputError, match=said):
        contestants(given)


def test_contestants_are_told_by_texts_functions_controllers_and_names():
    class Keeps(LQ):
        def __iter__(self):
            return iter(())

    def make(task):
        return pid

    pid, lazy = PID.from_model(load_model("mariner")), Broken()
    lazy.name = None
    iterable = Keeps(**vars(LQ.from_model(load_model("mariner"))))
    for given, expected in (
        (" pid , mine = lq ", [("pid", "pid"), ("mine", "lq")]),
        (pid, [("pid", pid)]),
        (iterable, [("lq", iterable)]),
        (make, [("make", make)]),
        (Contestant("x", "lq"), [("x", "lq")]),
        (
            [lazy, "pid", Contestant("x", make)],
            [("Broken", lazy), ("pid", "pid"), ("x", make)],
        ),
        ({"both": [pid, make]}, [("both", [pid, make])]),
        (
            "{task}-pid-*.json",
            [("pid", "{task}-pid-*.json")],
        ),  # found when a task is run
        ("{task}.zip", [("agent", "{task}.zip")]),
    ):
        assert [(one.name, one.source) for one in contestants(given)] == expected
    (both,) = contestants({"both": [pid, make]})
    assert both.policies(load_suite().task("mariner-calm"), "any") == (pid, pid)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("mine:make", True),
        ("my.own:make", True),
        ("make", False),
        (":make", False),
        ("mine:", False),
        ("mine:two words", False),
        ("my-own:make", False),
        ("folder/mine:make", False),
    ],
)
def test_code_is_named_by_a_module_and_a_function(text, names):
    assert names_code(text) is names


def test_a_path_is_like_a_pattern_of_as_many_folders():
    assert _is_like(("runs", "a.json"), ("runs", "*.json"))
    assert not _is_like(("runs", "a.json"), ("runs",))
    assert not _is_like(("runs",), ("runs", "*.json"))
    assert not _is_like(("runs", "a.json"), ("run", "*.json"))


def test_files_that_have_the_name_of_a_contestant_are_not_its_own(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    for name in ("pid", "best-known", "tuned-lq"):
        (tmp_path / name).write_text("")
        assert (
            Contestant(name, name).fingerprint(load_suite().task("mariner-calm")) == {}
        )


def test_an_agent_for_one_of_the_tasks_takes_part(tmp_path):
    tasks = [load_suite().task(name) for name in ("mariner-calm", "mariner-current")]
    WheelOver.from_model(tasks[1].ship, task=tasks[1].task).save(
        tmp_path / "guide.json"
    )
    (guide,) = contestants(str(tmp_path / "guide.json"))
    check_agents(guide, tasks)
    with pytest.raises(InputError, match="'guide' fits no task asked for"):
        check_agents(guide, tasks[:1])


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("td3", "there is no file of a pretrained td3 agent for task 'mariner-calm'"),
        (
            "{task}-x.json",
            "there is no file of '{task}-x.json' for task 'mariner-calm'",
        ),
        (
            int,
            (
                "int: 3 found for task 'mariner-calm', expected a controller with"
                " `predict`"
            ),
        ),
    ],
)
def test_one_that_cannot_be_made_for_a_task_is_told(source, said, monkeypatch):
    made = Contestant("x", (lambda task: 3) if source is int else source)
    if source is int:
        made.source.__name__ = "int"
    with pytest.raises(InputError) as error:
        made.policies(load_suite().task("mariner-calm"), "any")
    assert str(error.value) == said


def test_the_hash_of_a_controller_is_that_of_its_content(tmp_path):
    pid = PID.from_model(load_model("mariner"))
    pid.save(tmp_path / "pid.json")
    content = json.dumps(
        json.loads((tmp_path / "pid.json").read_text()), sort_keys=True
    )
    assert policy_hash(pid) == hashlib.sha256(content.encode()).hexdigest()
    assert policy_hash(
        PID.from_model(load_model("mariner"), damping=0.9)
    ) != policy_hash(pid)
    assert policy_hash(Broken()) is None


def test_agents_in_the_box_are_found_by_task_and_algorithm():
    assert [path.name for path in pretrained("container-path", "ppo")] == [
        "container-path-ppo.json"
    ]
    runs = [path.name for path in pretrained("course-unstable", "ppo")]
    assert runs == [f"course-unstable-ppo-s{run}.json" for run in range(5)]
    assert pretrained("container", "ppo") == []


def test_wrong_task_and_suite():
    with pytest.raises(InputError, match="Did you mean 'mariner-calm'"):
        benchmark("pid", tasks=["mariner-clam"])
    with pytest.raises(InputError, match="suite: expected"):
        benchmark("pid", suite="shipgym-v9")


def test_what_the_results_say_is_true(folder):
    checks = verify(folder)
    assert [check.exact for check in checks] == [True, True]
    assert {check.episodes for check in checks} == {N}


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"sample": 0}, "sample: expected"),
        ({"tolerance": -1e-9}, "tolerance: expected"),
        ({"tolerance": np.nan}, "tolerance: expected"),
    ],
)
def test_a_sample_of_nothing_and_a_tolerance_below_zero_are_refused(
    folder, asked, said
):
    with pytest.raises(InputError, match=said):
        verify(folder, **asked)


def test_results_of_another_version_of_a_suite_are_not_verified(copy):
    summary = json.loads((copy / "results.json").read_text())
    summary["suite"]["sha256"] = "0" * 64
    (copy / "results.json").write_text(json.dumps(summary))
    with pytest.raises(
        InputError,
        match="another suite 'shipgym-v1' than that of this version of shipgym",
    ):
        verify(copy)


def told_of(runs=1, source="a"):
    """What results say of four contestants in three tasks, of which one is an object and one ran nothing."""
    sources = {"a": "pid", "b": "lq", "object": None, "idle": "los"}
    found = {name: {"runs": 0 if name == "idle" else runs} for name in sources}
    return SimpleNamespace(
        summary={
            "contestants": {
                name: {"source": one if source else None}
                for name, one in sources.items()
            },
            "tasks": dict.fromkeys(("one", "two", "three"), found),
        }
    )


def test_a_sample_takes_the_contestants_by_turns():
    every = {(name, task) for name in "ab" for task in ("one", "two", "three")}
    for seed in range(5):
        pairs = _sampled(told_of(), 8, seed)
        assert len(pairs) == 6
        assert set(pairs) == every
        for turn in (pairs[:2], pairs[2:4], pairs[4:]):
            assert {name for name, _ in turn} == {"a", "b"}
        assert _sampled(told_of(), 3, seed) == pairs[:3]
    assert len({tuple(_sampled(told_of(), 6, seed)) for seed in range(5)}) > 1
    for nothing in (told_of(runs=0), told_of(source=None)):
        with pytest.raises(
            InputError,
            match="results: no contestant that can be made again; name them by",
        ):
            _sampled(nothing, 8, 0)
    usual = inspect.signature(verify).parameters
    assert (usual["sample"].default, usual["seed"].default) == (8, 0)


@pytest.mark.parametrize("function", [benchmark, rerun, verify])
def test_work_is_done_in_one_process_unless_more_are_asked_for(function):
    assert inspect.signature(function).parameters["workers"].default == 1


COSTS = np.array([100.0, 50.0, 0.0])


def compared(
    cost=COSTS,
    turns=(1.0, np.nan, 3.0),
    *,
    source="pid",
    tolerance=None,
    numpy=None,
    runs=1,
):
    """What a check says of a contestant whose file holds `COSTS`, when it is run again."""
    known = {**versions(), **({} if numpy is None else {"numpy": numpy})}
    summary = {
        "contestants": {"x": {"source": source}},
        "tasks": {"calm": {}},
        "seeds": {"count": 3},
        "versions": known,
    }
    table = {
        "contestant": np.array(["x"] * 3),
        "task": np.array(["calm"] * 3),
        "cost": COSTS,
    }
    result = BenchmarkResult(
        summary, {**table, "reversals": np.array([1.0, np.nan, 3.0])}
    )
    again = {
        "cost": np.array(cost),
        "reversals": np.array(turns),
        "unknown": np.zeros(3),
    }
    found = {
        "refused": "" if runs else "it is gone",
        "runs": [{"episodes": again}] * runs,
    }
    return _compared(result, "x", "calm", found, tolerance)


def test_a_check_passes_up_to_what_is_allowed():
    of = partial(Check, "x", "calm", 3)
    assert compared() == of(0.0, True, 0.0, "")
    near = COSTS + np.array([0.0, 50e-7, 0.0])
    found = compared(near)
    assert (found.difference, found.allowed, found.passed) == (
        pytest.approx(1e-7, rel=1e-6),
        0.0,
        False,
    )
    assert compared(near, tolerance=1.001e-7).passed
    assert not compared(near, tolerance=0.999e-7).passed
    learned = compared(near, source="agent.json")
    assert (learned.allowed, learned.exact, learned.passed) == (1e-6, False, True)
    assert not compared(COSTS * (1.0 + 1.05e-6), source="agent.json").passed
    assert compared(near, source="agent.json", tolerance=0.0).passed is False
    other = compared(near, numpy="0.1")
    assert (other.allowed, other.passed) == (1e-6, True)
    assert other.note == "numpy differ from those of the file"
    assert compared(COSTS + np.array([0.0, 0.0, 2e-13])).difference == pytest.approx(
        0.2
    )  # in units of 1e-12 at least


def test_a_check_says_what_is_wrong_beside_the_costs():
    of = partial(Check, "x", "calm", 3)
    note = "the costs are the same, but another figure is not"
    assert compared(turns=(1.0, np.nan, 4.0)) == of(np.inf, False, 0.0, note)
    note = "numpy differ from those of the file"
    assert compared(turns=(1.0, 2.0, 3.0), numpy="0.1") == of(np.inf, False, 1e-6, note)
    assert compared(runs=2) == of(
        np.inf, False, 0.0, "2 training runs found, 1 in the file"
    )
    assert compared(runs=0, source="a.zip") == of(np.inf, False, 1e-6, "it is gone")


def _rewritten(copy, change):
    """Results whose table was changed, with hashes that fit."""
    result = load_results(copy)
    columns = {name: values.copy() for name, values in result.episodes.items()}
    change(columns)
    BenchmarkResult(result.summary, columns).save(copy)


def test_a_result_that_was_touched_up_is_found_out(copy):
    def flatter(columns):
        columns["cost"][columns["contestant"] == "lq"] *= 0.99

    _rewritten(copy, flatter)
    checks = {check.contestant: check for check in verify(copy)}
    assert (checks["pid"].passed, checks["pid"].difference) == (True, 0.0)
    assert not checks["lq"].passed
    assert checks["lq"].difference == pytest.approx(0.01, rel=0.02)
    told = checks["lq"].to_dict()
    assert (told["passed"], told["difference"]) == (False, checks["lq"].difference)
    answer = shipgym("--verify", copy, "--workers", 1)
    assert answer.exit_code == 1
    assert same_text("verify", answer.stdout + answer.stderr)
    assert "1 of 2 differ: lq on mariner-calm" in answer.stderr


@pytest.fixture
def renamed(copy, tmp_path, monkeypatch):
    """Results whose contestant LQ is said to be made of something else; a module that says if it was run."""
    monkeypatch.chdir(tmp_path)
    code = (
        "open('RAN', 'w').close()\nfrom agents import LQ\nmake = lambda task:"
        " LQ.from_model(task.ship)\n"
    )
    for name in ("evil_code.py", "evil_code"):
        (tmp_path / name).write_text(code)

    def rename(source, **files):
        summary = json.loads((copy / "results.json").read_text())
        summary["contestants"]["lq"] |= {"source": source, "files": files}
        (copy / "results.json").write_text(json.dumps(summary))
        return copy

    yield rename
    sys.modules.pop("evil_code", None)


@pytest.mark.parametrize(
    "source",
    [
        "evil_code:make",
        "evil_code",
        "evil_code.py",
        "*",
        "/dev/zero",
        "lq+evil_code:make",
    ],
)
def test_results_run_no_code_that_they_name(renamed, source, tmp_path):
    folder, before = renamed(source), list(sys.path)
    checks = {check.contestant: check for check in verify(folder)}
    assert (checks["pid"].passed, checks["pid"].difference) == (True, 0.0)
    assert not checks["lq"].passed
    assert (
        "run only if you name it" in checks["lq"].note
        or "no such file took part" in checks["lq"].note
    )
    answer = shipgym("--verify", folder, "--workers", 1, "--allow-code", "other:make")
    assert answer.exit_code == 1
    assert "1 of 2 differ: lq on mariner-calm" in answer.stderr
    refused = rerun(
        load_results(folder), [EpisodeId("lq", "mariner-calm", 0, 1_000_000)]
    ).refused
    assert list(refused) == [("lq", "mariner-calm")]
    assert not (tmp_path / "RAN").exists()
    assert sys.path == before


def test_a_contestant_that_cannot_be_made_again_is_allowed_no_difference(renamed):
    checks = {check.contestant: check for check in verify(renamed("evil_code:make"))}
    note = (
        "'evil_code:make' is code, run only if you name it: --allow-code evil_code:make"
    )
    assert checks["lq"] == Check("lq", "mariner-calm", N, np.inf, False, 0.0, note)
    assert checks["lq"].to_dict()["difference"] is None


def test_code_that_is_named_on_the_command_line_is_run(renamed, tmp_path):
    folder = renamed("evil_code:make")
    answer = shipgym(
        "--verify", folder, "--workers", 1, "--allow-code", "evil_code:make"
    )
    assert answer.exit_code == 0, answer.output
    assert (tmp_path / "RAN").exists()
    episode = EpisodeId("lq", "mariner-calm", 0, 1_000_000)
    given = rerun(load_results(folder), [episode], {"lq": "evil_code:make"})
    assert list(given.episodes) == [episode]


def test_files_are_verified_by_their_hashes(tmp_path):
    ship = load_model("mariner")
    for run in range(2):
        PID.from_model(ship, frequency=0.05 + 0.01 * run).save(
            tmp_path / f"mariner-calm-[pid]-{run}.json"
        )
    out = tmp_path / "results"
    benchmark(
        f"mine={tmp_path}/{{task}}-[[]pid]-*.json", tasks=TASKS, episodes=2, out=out
    )
    assert [check.exact for check in verify(out)] == [True]
    LQ.from_model(ship).save(tmp_path / "mariner-calm-[pid]-1.json")
    (check,) = verify(out)
    assert (check.passed, check.episodes) == (False, 4)
    assert (
        check.note
        == f"'{tmp_path}/mariner-calm-[pid]-1.json' is not the file that took part"
    )
    (tmp_path / "mariner-calm-[pid]-0.json").unlink()
    (check,) = verify(out)
    assert (
        check.note
        == f"'{tmp_path}/mariner-calm-[pid]-0.json' is not the file that took part"
    )


def test_an_episode_run_again_costs_the_same_to_a_billionth():
    costs = np.full(4, 1e6)
    table = {
        "contestant": np.array(["a"] * 4),
        "task": np.array(["calm"] * 4),
        "cost": costs,
    }
    about = {
        "contestants": {"a": {}},
        "tasks": {"calm": {}},
        "seeds": {"first": 100, "count": 4},
    }
    again = [
        1e6 + 0.99e-3,
        1e6 + 1.05e-3,
        1e6 - 1.05e-3,
        np.nan,
    ]  # the last failed at once
    run = {
        "run": 0,
        "seeds": [100, 101, 102, 103],
        "costs": again,
        "episodes": [None] * 4,
    }
    found = {
        ("a", "calm"): {"refused": "", "runs": [run]},
        ("b", "calm"): {"refused": "it is gone"},
    }
    done = _gathered(BenchmarkResult(about, table), found)
    assert done.different == tuple(
        EpisodeId("a", "calm", 0, seed) for seed in (101, 102)
    )
    assert (done.episodes, done.refused) == ({}, {("b", "calm"): "it is gone"})


@pytest.mark.parametrize(
    ("name", "damage", "said"),
    [
        ("results.json", lambda data: data[:500], "may be cut short"),
        (
            "results.json",
            lambda data: data.replace(b'"format": 2', b'"format": 9'),
            "expected format 2",
        ),
        (
            "results.json",
            lambda data: data.replace(b'"ranking"', b'"rankings"'),
            "unknown key 'rankings'",
        ),
        (
            "episodes.parquet",
            lambda data: data[:-10],
            "is not the one that results.json was written with",
        ),
    ],
)
def test_broken_results(copy, name, damage, said):
    path = copy / name
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=said):
        load_results(copy)


def test_results_that_do_not_agree_with_their_episodes_are_refused(copy):
    def one_more(columns):
        columns["contestant"][np.flatnonzero(columns["contestant"] == "lq")[0]] = "pid"

    summary = json.loads((copy / "results.json").read_text())
    _rewritten(copy, one_more)
    with pytest.raises(InputError) as error:
        load_results(copy)
    assert (
        str(error.value)
        == f"{copy / 'results.json'}: 5 episodes of 'pid' on 'mariner-calm' found in"
        " episodes.parquet, expected 1 runs of 4; run `shipgym benchmark` again"
    )
    (copy / "results.json").write_text(
        json.dumps({k: v for k, v in summary.items() if k != "seeds"})
    )
    with pytest.raises(
        InputError,
        match=r"results.json: field 'seeds' is missing; run `shipgym benchmark` again$",
    ):
        load_results(copy)
    (copy / "results.json").write_text(json.dumps(summary | {"kind": "model"}))
    with pytest.raises(
        InputError, match=r"kind 'model' found, expected .*: not benchmark results"
    ):
        load_results(copy / "results.json")


def test_contestants_of_the_file_and_of_the_table_are_the_same(copy):
    def exchange(columns):
        columns["contestant"][columns["contestant"] == "lq"] = "los"

    _rewritten(copy, exchange)
    with pytest.raises(
        InputError,
        match=r"0 episodes of 'lq' on 'mariner-calm' .* expected 1 runs of 4",
    ):
        load_results(copy)


def test_rows_of_nobody_in_the_summary_are_refused(copy):
    result = load_results(copy)
    columns = {
        name: np.append(values, values[:1]) for name, values in result.episodes.items()
    }
    columns["contestant"][-1] = "los"
    summary = result.summary | {
        "episodes": result.summary["episodes"] | {"rows": 2 * N + 1}
    }
    BenchmarkResult(summary, columns).save(copy)
    with pytest.raises(
        InputError,
        match=r"1 episodes of 'los' on 'mariner-calm' .* expected 0 runs of 4",
    ):
        load_results(copy)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda one: one["seeds"].update(count=0), "r.json: seeds.count: expected"),
        (lambda one: one["seeds"].update(count="4"), "r.json: seeds.count: expected"),
        (
            lambda one: one["ranking"][0].update(name="los"),
            "r.json: name of a contestant: expected",
        ),
        (
            lambda one: one["improvement"].update(los={}),
            "r.json: name of a contestant: expected",
        ),
        (
            lambda one: one["profile"]["shares"].update(los=[]),
            "r.json: name of a contestant: expected",
        ),
        (
            lambda one: one["tasks"].update(rough={}),
            "r.json: name of a task: expected",
        ),
        (
            lambda one: one["reference"].update(rough={"zero": 1, "best": 0}),
            "r.json: name of a task: expected",
        ),
        (
            lambda one: one["ranking"].pop(0),
            "r.json: tasks.mariner-calm: name of a contestant: expected",
        ),
        (
            lambda one: one["tasks"]["mariner-calm"]["lq"].pop("runs"),
            r"tasks.mariner-calm.lq.*runs",
        ),
    ],
)
def test_a_summary_names_whom_and_what_it_knows(folder, change, said):
    summary = deepcopy(load_results(folder).summary)
    check_summary(summary, "r.json")
    change(summary)
    with pytest.raises(InputError, match=said):
        check_summary(summary, "r.json")


def test_what_the_table_of_episodes_needs_is_missed_before_the_work(
    folder, tmp_path, monkeypatch
):
    result = load_results(folder)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    for call in (
        lambda: check_new(tmp_path / "out", False, "v1"),
        lambda: result.save(tmp_path / "out"),
    ):
        with pytest.raises(
            InputError,
            match=r"not installed, the table of episodes needs it: .*'shipgym\[bench",
        ):
            call()
    assert not (tmp_path / "out").exists()


def test_results_are_written_to_folders_that_are_made(folder, tmp_path):
    result = load_results(folder)
    assert result.save(None) is result
    saved = result.save(tmp_path / "a" / "b")
    assert load_results(tmp_path / "a" / "b").summary == saved.summary
    assert len(saved.summary["episodes"]["sha256"]) == 64


def test_parts_alone_are_gone_on_with(tmp_path):
    (tmp_path / "parts").mkdir()
    assert check_new(tmp_path, True, "shipgym-v1") == tmp_path
    with pytest.raises(
        InputError, match="already contains results; continue with --resume"
    ):
        check_new(tmp_path, False, "shipgym-v1")


def test_a_folder_takes_the_results_of_one_suite_only(copy, tmp_path):
    assert check_new(tmp_path / "new", False, "shipgym-v1") == tmp_path / "new"
    assert check_new(copy, True, "shipgym-v1") == copy
    with pytest.raises(
        InputError, match="already contains results; continue with --resume"
    ):
        check_new(copy, False, "shipgym-v1")
    with pytest.raises(
        InputError, match="holds results of another suite than 'shipgym-v2'"
    ):
        check_new(copy, True, "shipgym-v2")
    with pytest.raises(
        InputError,
        match=r"results.json: is not a folder, expected one to write the results to",
    ):
        check_new(copy / "results.json", False, "shipgym-v1")
    other = tmp_path / "other"
    other.mkdir()
    assert check_new(other, False, "shipgym-v1") == other
    (other / "letter.txt").write_text("")
    with pytest.raises(
        InputError, match=r"holds 'letter.txt', not a result of a benchmark"
    ):
        check_new(other, True, "shipgym-v1")


def test_a_part_that_was_kept_is_of_its_job():
    job = {"contestant": "pid", "task": "mariner-calm", "episodes": 2}

    def part(**figures):
        return {"refused": "", "runs": [_run(figures, "", 0.1, None)]}

    whole = part(cost=np.zeros(2), overshoot=np.zeros(2))
    assert checked_part(whole, job) is whole
    for wrong in (
        part(cost=np.zeros(3)),
        part(overshoot=np.zeros(2)),
        part(cost=np.zeros((2, 1))),
        part(cost=np.array(["1", "2"])),
        {
            "refused": "",
            "runs": [*whole["runs"], *part(cost=np.zeros(2))["runs"]],
        },  # which knows less
    ):
        with pytest.raises(
            InputError,
            match="part of 'pid' on 'mariner-calm': expected cost and other figures",
        ):
            checked_part(wrong, job)


def test_tasks_are_chosen_by_name_each_once():
    whole = load_suite("shipgym-v1").tasks
    assert _chosen("shipgym-v1", None) == whole
    both = _chosen("shipgym-v1", f"{whole[1].name}, {whole[0].name}, {whole[1].name}")
    assert both == (whole[1], whole[0])
    with pytest.raises(InputError, match="tasks: none found, expected at least one"):
        _chosen("shipgym-v1", [])
    for asked, ends in (
        ("strong-current", ["", "-on-model", "-far"]),
        ("strong-current-far", ["-far"]),
    ):
        assert [one.name for one in _chosen("shipgym-v2", [asked])] == [
            f"strong-current{end}" for end in ends
        ]


@pytest.mark.parametrize("episodes", [0, 101, 2.5])
def test_as_many_episodes_are_run_as_are_scored_at_most(episodes):
    with pytest.raises(InputError, match="episodes: expected"):
        benchmark("pid", tasks=TASKS, episodes=episodes)


def test_a_summary_of_two_episodes_by_hand(monkeypatch):
    """Of two tasks with a ship, in one of which 0 and 1 cost the same, and one far from the design."""
    references = {"calm": (30.0, 20.0), "same": (5.0, 5.0), "calm-far": (40.0, 10.0)}
    monkeypatch.setattr(
        "agents.benchmarking.summary.reference_costs", lambda suite: references
    )
    monkeypatch.setattr("agents.benchmarking.summary.N_EPISODES", 2)

    def runs(*costs):
        known = {
            "refused": "",
            "runs": [_run({"cost": np.array(costs)}, "", 1e-6, None)],
        }
        return known if costs else {"refused": "no", "runs": []}

    done = {
        ("a", "calm"): runs(25.0, 20.0),
        ("a", "same"): runs(5.0, 5.0),
        ("a", "calm-far"): runs(10.0, 10.0),
        ("b", "calm"): runs(30.0, 30.0),
        ("b", "same"): runs(10.0, 10.0),
        ("b", "calm-far"): runs(),
    }
    done["a", "calm"]["runs"] *= 2
    done["a", "calm"]["runs"][1] = {
        **done["a", "calm"]["runs"][0],
        "seconds_per_action": 3e-6,
    }
    tasks = [
        SimpleNamespace(name=name, on="far" if "far" in name else "ship")
        for name in references
    ]
    found = summary_of("mine", tasks, ["b", "a"], done)
    first, second = found["ranking"]
    assert (first["name"], first["tasks"], first["scored_tasks"]) == ("a", 2, 1)
    assert (first["score"]["value"], first["relative_cost"]) == pytest.approx(
        (0.75, 1.0)
    )
    assert (second["score"]["value"], second["relative_cost"]) == pytest.approx(
        (0.0, np.sqrt(8.0 / 3.0))
    )
    assert first["elsewhere"]["far"]["score"]["value"] == pytest.approx(1.0)
    assert (
        first["elsewhere"]["far"]["tasks"],
        second["elsewhere"]["far"]["tasks"],
    ) == (1, 0)
    assert found["tasks"]["calm"]["a"]["microseconds_per_action"] == pytest.approx(2.0)
    assert found["reference"]["calm-far"] == {"zero": 40.0, "best": 10.0}
    thresholds, shares = found["profile"]["thresholds"], found["profile"]["shares"]
    at = [thresholds.index(one) for one in (-1.0, -0.05, 0.0, 0.5, 1.0)]
    assert [shares["a"][k] for k in at] == [
        1.0,
        1.0,
        1.0,
        0.5,
        0.0,
    ]  # scores of 0.5 and 1 of `calm` alone
    assert [shares["b"][k] for k in at] == [1.0, 1.0, 0.0, 0.0, 0.0]
    assert found["improvement"]["a"]["b"]["value"] == 1.0


def test_episodes_without_a_figure_are_not_counted():
    lost = {"episodes": {"terminated": np.array([1.0, 0.0, np.nan])}}
    assert _count([lost, lost], "terminated") == 2
    assert _count([{"episodes": {}}] * 20, "terminated") == 0


def test_a_factory_may_raise_anything_and_best_known_costs_are_kept_by_task(
    monkeypatch,
):
    task = load_suite("shipgym-v1").task("mariner-calm")

    def fails(one, task, suite):
        raise KeyError("gain")

    monkeypatch.setattr(Contestant, "policies", fails)
    for source in ("mine:make", fails):
        done = results_of(Contestant("mine", source), task, "shipgym-v1", 2)
        assert done == {"refused": "KeyError: 'gain'", "runs": []}
    with pytest.raises(KeyError):  # of ours it is a fault
        results_of(Contestant("pid", "pid"), task, "shipgym-v1", 2)
    known = results_of(Contestant("best-known", "best-known"), task, "shipgym-v1", 3)[
        "runs"
    ][0]
    np.testing.assert_array_equal(
        known["episodes"]["cost"], best_costs(task, "shipgym-v1")[:3]
    )
    zero, one = reference_costs("shipgym-v1")["mariner-calm"]
    assert (zero, one) == (
        best_known("shipgym-v1")["mariner-calm"]["zero"],
        best_costs(task, "shipgym-v1").mean(),
    )
    with pytest.raises(
        InputError,
        match="no best known costs are kept for task 'mine' of suite 'shipgym-v1'",
    ):
        best_costs(replace(task, name="mine"), "shipgym-v1")


def test_the_command_ranks_and_writes(tmp_path):
    answer = shipgym(
        "--controllers",
        "pid",
        "--tasks",
        "mariner-calm",
        "--episodes",
        2,
        "--workers",
        1,
        "--out",
        tmp_path / "r",
        "--no-page",
    )
    assert answer.exit_code == 0, answer.stderr
    assert same_text(
        "benchmark", answer.stdout + answer.stderr, r"(?m)(?<=  )\d+\.\d\d$"
    )  # us by action
    assert "1 task of 2 episodes" in answer.stdout
    assert "for a quick look, not for a ranking" in answer.stderr
    assert load_results(tmp_path / "r").ranking == ["pid"]
    page = tmp_path / "r" / "index.html"
    page.touch()
    again = shipgym(
        "--controllers",
        "pid",
        "--tasks",
        "mariner-calm",
        "--episodes",
        2,
        "--workers",
        1,
        "--out",
        tmp_path / "r",
        "--resume",
        "--json",
        "--no-page",
    )
    assert json.loads(again.stdout)["ranking"][0]["name"] == "pid"
    assert not page.exists()  # it would be of the results before


def test_bad_input_is_told_in_one_line_and_nothing_is_written(tmp_path):
    out = tmp_path / "r"
    cut, weightless, other = (
        tmp_path / f"{name}.json" for name in ("cut", "weightless", "other")
    )
    random_policy(load_model("kvlcc2")).save(other)
    weightless.write_bytes(other.read_bytes())
    cut.write_bytes(other.read_bytes()[:300])
    for arguments, said in (
        (["--controllers", "pdi", "--out", out], "Did you mean 'pid'"),
        (["--controllers", "pid"], "--out"),
        (
            ["--controllers", "pid", "--out", out, "--engine", "rai"],
            "engine: expected",
        ),
        (["--verify", out], "there is no such file of benchmark results"),
        (
            ["--verify", out, "--tasks", "mariner-calm"],
            "--tasks: found together with --verify, which",
        ),
        (
            ["--submit", tmp_path / "s.json", "--episodes", 9, "--out", out],
            "--episodes: found together with",
        ),
        (["--tasks", "mariner-calm,", "--out", out], "task: expected one of"),
        (
            ["--controllers", f"pid,{cut}", "--tasks", "mariner-calm", "--out", out],
            "may be cut short",
        ),
        (
            [
                "--controllers",
                f"pid,{weightless}",
                "--tasks",
                "mariner-calm",
                "--out",
                out,
            ],
            "no such file",
        ),
        (
            ["--controllers", f"pid,{other}", "--tasks", "mariner-calm", "--out", out],
            "fits no task asked for",
        ),
    ):
        answer = shipgym(*arguments)
        assert (answer.exit_code, answer.stdout) == (2, "")
        assert said in answer.stderr
    assert not out.exists()
