"""A suite with ships behind its models, and submissions: what is handed out, written and refused."""

import json
from dataclasses import replace
from functools import partial
from unittest.mock import Mock

import numpy as np
import pytest

from agents import LQ, Shielded, WheelOver, benchmark, load_results
from agents.benchmarking import results, run, submission
from agents.benchmarking.contestants import Contestant
from agents.benchmarking.submission import read_submission, submit
from agents.benchmarking.verification import verify
from agents.suites import suite
from agents.suites.suite import load_suite, parse_suite
from shipgym.errors import InputError

TEXT = """
name = "small"
[tasks.turns]
environment = "path-following"
model = "mariner-tls-svm"
ship = "mariner"
options = { episode_steps = 120, n_legs = 2 }
far = { gear = { time_constant = 8.0 } }
"""
TASKS = ("turns", "turns-on-model", "turns-far")
N = 3


@pytest.fixture(autouse=True)
def small(monkeypatch, tmp_path):
    """A suite of one task, all of whose three episodes are scored."""
    (tmp_path / "suites").mkdir()
    (tmp_path / "suites" / "small.toml").write_text(TEXT)
    monkeypatch.setattr(suite, "FOLDER", tmp_path / "suites")
    for place in (suite, run, submission):
        monkeypatch.setattr(place, "N_EPISODES", N)
    monkeypatch.setattr(submission, "SEEDS", {"first": suite.FIRST_SEED, "count": N})
    load_suite.cache_clear()
    yield
    load_suite.cache_clear()


def ran(out=None, who="wheel-over,lq"):
    return benchmark(who, suite="small", out=out, episodes=N)


def test_the_ranking_is_of_the_ship_and_the_rest_stands_beside_it(tmp_path):
    found = ran(tmp_path / "out")
    assert found.tasks == TASKS
    assert found.summary == load_results(tmp_path / "out").summary
    for entry in found.summary["ranking"]:
        assert entry["tasks"] == 1
        assert {on: one["tasks"] for on, one in entry["elsewhere"].items()} == {
            "model": 1,
            "far": 1,
        }
    assert found.summary["suite"]["tasks"]["turns-far"]["ship"] == "mariner"
    costs = [found.figures("wheel-over", task).mean() for task in TASKS]
    assert len(set(costs)) == 3


def test_contestants_are_handed_the_model_only():
    task = load_suite("small").task("turns-far")
    handed = []
    Contestant(
        "mine", lambda one: handed.append(one) or LQ.from_model(one.ship)
    ).policies(task, "small")
    assert (handed[0].name, handed[0].behind, handed[0].far) == ("turns", "", {})
    assert handed[0].ship.name == handed[0].sailed[0].name == "mariner-tls-svm"
    cheat = Contestant(
        "cheat", lambda handed: WheelOver.from_model(task.sailed[0], task=handed.task)
    )
    said = (
        "'cheat' on task 'turns-far': was designed on the ship, 'mariner', expected on"
        " the model that it is handed, 'mariner-tls-svm'"
    )
    with pytest.raises(InputError, match=said):
        cheat.policies(task, "small")
    rescue = LQ.from_model(task.sailed[0])
    hidden = Contestant(
        "cheat", lambda handed: Shielded(LQ.from_model(handed.ship), rescue, 1.0)
    )
    with pytest.raises(InputError, match=said):
        hidden.policies(task, "small")


def test_a_policy_that_is_its_own_part_is_still_searched_for_the_ship():
    task = load_suite("small").task("turns-far")
    rescue = LQ.from_model(task.sailed[0])

    def looped(handed, **parts):
        made = LQ.from_model(handed.ship)
        for name, part in {"policy": made, **parts}.items():
            object.__setattr__(made, name, part)  # its class is frozen
        return made

    (policy,) = Contestant("mine", looped).policies(task, "small")
    assert policy.policy is policy
    with pytest.raises(InputError, match="was designed on the ship, 'mariner'"):
        Contestant("cheat", partial(looped, fallback=rescue)).policies(task, "small")
    with pytest.raises(
        InputError, match="LQ: more than 1000 policies within one another found"
    ):
        Contestant("endless", partial(looped, base=Mock())).policies(task, "small")


def test_a_submission_is_verified(tmp_path):
    found = ran()
    submit(found, "wheel-over", tmp_path / "mine.json")
    checks = verify(tmp_path / "mine.json")
    assert {check.task for check in checks} == set(TASKS)
    assert all(check.exact for check in checks)
    content = json.loads((tmp_path / "mine.json").read_text())
    read = read_submission(content, "mine.json")
    assert read.episodes["seed"].tolist() == [1_000_000, 1_000_001, 1_000_002] * len(
        TASKS
    )
    for task in TASKS:
        np.testing.assert_array_equal(
            read.figures("wheel-over", task), found.figures("wheel-over", task)
        )
    content["costs"]["turns"][0][1] *= 0.9
    (tmp_path / "mine.json").write_text(json.dumps(content))
    assert [
        check.task for check in verify(tmp_path / "mine.json") if not check.passed
    ] == ["turns"]


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("seeds", {"first": 7, "count": N}, "seeds: .* found, expected .*1000000"),
        ("suite", {"name": "small", "sha256": "0"}, "suite.sha256: 0 found, expected"),
        ("versions", {"shipgym": "0.0.1"}, "versions.shipgym: 0.0.1 found, expected"),
        (
            "costs",
            {"turns": [[1.0, 2.0, 3.0]]},
            "costs: tasks: .* found, expected .*turns-far",
        ),
        (
            "costs",
            {task: [[1.0]] for task in TASKS},
            r"costs: episodes: \{1\} found, expected \{3\}",
        ),
        ("costs", {task: [["1"]] for task in TASKS}, "costs"),
        ("kind", "shipgym-other", "kind 'shipgym-other' found"),
        ("format", 2, "expected format 1, which this version of shipgym reads, got 2"),
        (
            "contestant",
            {"name": "lq", "source": None, "files": {}},
            "contestant.source: ",
        ),
    ],
)
def test_a_submission_of_other_seeds_suite_or_versions_is_refused(
    field, value, said, tmp_path
):
    path = tmp_path / "mine.json"
    submit(ran(), "lq", path)
    assert json.loads(path.read_text())["format"] == 1
    path.write_text(json.dumps(json.loads(path.read_text()) | {field: value}))
    with pytest.raises(InputError, match=said) as caught:
        verify(path)
    assert str(caught.value).startswith(str(path))


def test_what_nobody_else_can_make_or_was_not_run_through_is_not_submitted(tmp_path):
    given = ran(who={"mine": lambda task: LQ.from_model(task.ship)})
    with pytest.raises(InputError, match="submit: 'mine': an object found"):
        submit(given, "mine", tmp_path / "mine.json")
    some = benchmark("lq", suite="small", tasks=["turns-far"], episodes=N)
    with pytest.raises(InputError, match="no results in turns, turns-on-model found"):
        submit(some, "lq", tmp_path / "mine.json")
    every = dict.fromkeys(TASKS, some.summary["tasks"]["turns-far"])
    fewer = replace(
        some,
        summary={
            **some.summary,
            "tasks": every,
            "seeds": {"first": 1_000_000, "count": 2},
        },
    )
    said = (
        "seeds {'first': 1000000, 'count': 2} found, expected a contestant .* with all"
        " 3 episodes of all"
    )
    with pytest.raises(InputError, match=said):
        submit(fewer, "lq", tmp_path / "mine.json")
    with pytest.raises(InputError, match="submit: expected one of 'lq'"):
        submit(fewer, "lg", tmp_path / "mine.json")
    assert not (tmp_path / "mine.json").exists()


def test_a_folder_of_another_suite_and_results_of_the_first_format_are_refused(
    tmp_path,
):
    ran(tmp_path / "out", "lq")
    (tmp_path / "suites" / "other.toml").write_text(TEXT.replace("small", "other"))
    with pytest.raises(InputError, match="holds results of another suite than 'other'"):
        benchmark("lq", suite="other", out=tmp_path / "out", resume=True, episodes=N)
    file = tmp_path / "out" / results.RESULTS
    file.write_text(json.dumps(json.loads(file.read_text()) | {"format": 1}))
    with pytest.raises(
        InputError,
        match=r"results.json: expected format 2, which this version of shipgym reads, got 1",
    ):
        load_results(tmp_path / "out")


def test_a_far_set_without_a_ship_is_refused():
    with pytest.raises(InputError, match=r"tasks.turns.far: found without a ship"):
        parse_suite(TEXT.replace('ship = "mariner"\n', ""), "suite")
    assert np.all([task.base == "turns" for task in parse_suite(TEXT, "suite").tasks])
