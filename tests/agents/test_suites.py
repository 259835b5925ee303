"""Suites of tasks: how they are read, and what is refused with its field."""

import inspect
import json

import numpy as np
import pytest

from agents.suites.reference import best_known, load_tuned, reference_costs
from agents.suites.suite import (
    FOLDER,
    BenchmarkTask,
    list_suites,
    load_suite,
    parse_suite,
    suite_file,
    suite_hash,
)
from shipgym import InputError, Weather

TEXT = """
name = "mine-v1"
[tasks.calm]
environment = "course-keeping"
model = "mariner"
why = "the easiest"
options = { noise = 1.0 }
[tasks.drift]
environment = "path-following"
model = "kvlcc2"
sea = { current = { speed = 0.5, towards_deg = 90.0 } }
[tasks.rough]
environment = "course-keeping"
model = "mariner"
sea = "rough"
"""


def test_a_suite_is_read_task_by_task():
    suite = parse_suite(TEXT, "mine")
    assert suite.name == "mine-v1"
    assert [task.name for task in suite.tasks] == ["calm", "drift", "rough"]
    calm, drift, rough = suite.tasks
    assert (calm.env_id, calm.model, calm.why) == (
        "shipgym/CourseKeeping-v0",
        "mariner",
        "the easiest",
    )
    assert (drift.env_id, drift.ship.name) == ("shipgym/PathFollowing-v0", "kvlcc2")
    assert calm.options == {"noise": 1.0}
    assert calm.task.weather.calm
    assert isinstance(drift.options["sea"], Weather)
    assert drift.task.weather.current.speed == 0.5
    assert rough.task.weather.name == "rough"
    assert suite.task("drift") is drift
    np.testing.assert_array_equal(calm.seeds, 1_000_000 + np.arange(100))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "mine-v1"', "name = mine", "mine: not valid TOML"),
        ('name = "mine-v1"', "", "mine: name: expected .*got None"),
        ('name = "mine-v1"', 'name = "m"\nnote = 1', "mine: unknown key 'note'"),
        ('why = "the easiest"', 'what = "x"', r"tasks\.calm: unknown key 'what'"),
        (
            'environment = "course-keeping"',
            'environment = "course-keping"',
            r"calm: .*Did you mean 'course-k",
        ),
        ('model = "kvlcc2"', 'model = "kvlcc3"', r"tasks\.drift: .*kvlcc3"),
        ('model = "kvlcc2"', "", r"tasks\.drift\.model: expected .*got None"),
        (
            "options = { noise = 1.0 }",
            "options = 3",
            r"tasks\.calm\.options: expected .*got 3",
        ),
        (
            "options = { noise = 1.0 }",
            "options = { nois = 1.0 }",
            r"tasks\.calm: .*Did you mean 'noise'",
        ),
        ("speed = 0.5", "sped = 0.5", r"tasks\.drift\.sea.*sped"),
        ('sea = "rough"', 'sea = "rogh"', r"tasks\.rough: .*Did you mean 'rough'"),
        (
            "options = { noise = 1.0 }",
            'ship = ""',
            r"tasks\.calm\.ship: expected .*got ''",
        ),
        (
            "options = { noise = 1.0 }",
            'options = { reward = "mine:cost" }',
            "calm.options.reward: .* is code",
        ),
        (
            'model = "kvlcc2"',
            'model = "kvlcc2.py"',
            r"tasks\.drift\.model: expected data, got 'kvlcc2.py', which is code",
        ),
    ],
)
def test_a_wrong_field_is_named(old, new, message):
    with pytest.raises(InputError, match=message):
        parse_suite(TEXT.replace(old, new, 1), "mine")


def test_shipped_suites_are_known_by_name():
    assert "shipgym-v1" in list_suites()
    assert load_suite().name == "shipgym-v1"
    assert len(suite_hash()) == 64
    assert suite_hash() == suite_hash("shipgym-v1")
    assert suite_file("shipgym-v1", "best").name == "shipgym-v1-best.json"
    assert suite_file("shipgym-v1", "best").is_file()
    for call in (load_suite, suite_hash):
        with pytest.raises(InputError, match=r"suite: expected .*got 'shipgym-v3'"):
            call("shipgym-v3")
    with pytest.raises(
        InputError, match=r"suite 'shipgym-v1': task: .*Did you mean 'mariner-calm'"
    ):
        load_suite().task("mariner-clam")


V2 = load_suite("shipgym-v2")


def test_a_task_with_a_ship_is_evaluated_on_her_on_the_model_and_far_from_the_design():
    assert {task.on for task in V2.tasks} == {"ship", "model", "far"}
    for name in ("failing-gear", "strong-current"):
        ship, model, far = (V2.task(name + end) for end in ("", "-on-model", "-far"))
        assert (ship.handed_out, far.handed_out) == (model.handed_out, model.handed_out)
        assert ship.ship.name == model.sailed[0].name == ship.model
        assert ship.sailed[0].name == far.sailed[0].name == ship.behind
    assert V2.task("failing-gear-far").engine(1).model.steering.time_constant == 8.0
    assert V2.task("failing-gear").engine(1).model.steering.time_constant == 1.0
    assert V2.task("strong-current-far").sailed[1].weather.current.speed == 4.0


def test_every_model_has_the_ship_behind_it_named_in_its_file():
    for task in V2.tasks:
        if task.on == "ship":
            assert task.ship.provenance["truth"] == task.behind


def test_what_contestants_are_handed_does_not_name_the_ship():
    handed = V2.task("two-zigzags-far").handed_out
    assert (handed.behind, dict(handed.far), handed.sailed[0].name) == (
        "",
        {},
        "container-two-zigzags",
    )


def test_a_ship_of_other_particulars_than_the_model_is_refused():
    text = (
        (FOLDER / "shipgym-v2.toml")
        .read_text()
        .replace('ship = "kvlcc2"', 'ship = "tanker"')
    )
    with pytest.raises(
        InputError,
        match=r"tasks.strong-current: .*expected a ship of the same particulars",
    ):
        parse_suite(text, "suite")


def test_a_ship_that_is_never_far_from_the_design_has_two_sets_of_episodes():
    text = TEXT.replace(
        'model = "mariner"\nsea', 'model = "mariner-tls-svm"\nship = "mariner"\nsea'
    )
    *alone, first, second = parse_suite(text, "mine").tasks
    assert [(task.on, task.behind, dict(task.far)) for task in alone] == [
        ("ship", "", {})
    ] * 2
    assert [(one.name, one.on, one.behind) for one in (first, second)] == [
        ("rough", "ship", "mariner"),
        ("rough-on-model", "model", ""),
    ]
    assert inspect.signature(BenchmarkTask.engine).parameters["threads"].default == 1


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Writes a file that is kept with a suite."""
    monkeypatch.setattr(
        "agents.suites.reference.suite_file",
        lambda suite, what: tmp_path / f"{what}.json",
    )
    return lambda what, content: (tmp_path / f"{what}.json").write_text(
        json.dumps(content)
    )


def test_a_suite_without_best_known_costs_has_no_references(kept):
    assert (best_known("mine"), reference_costs("mine")) == ({}, {})
    with pytest.raises(InputError, match="there is no such file of tuned settings"):
        load_tuned("mine")


def test_references_are_the_cost_of_wheel_over_and_the_mean_of_the_best(kept):
    kept("best", {"calm": {"zero": 30, "costs": [1.0, 3.0] * 50, "by": ["lq"] * 100}})
    assert reference_costs("mine") == {"calm": (30.0, 2.0)}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"zero": "30"}, r"best.json.*calm.zero: expected .*got '30'"),
        ({"costs": ["1"] * 100}, r"best.json.*calm.costs\[0\]: expected .*got '1'"),
        (
            {"costs": [1.0] * 99},
            "best.json: calm: expected costs of 100 episodes, and by what",
        ),
        (
            {"by": ["lq"] * 99},
            "best.json: calm: expected costs of 100 episodes, and by what",
        ),
        (
            {"costs": [1.0] * 101, "by": ["lq"] * 101},
            "best.json: calm: expected costs of 100 episodes",
        ),
    ],
)
def test_best_known_costs_with_a_wrong_field_are_refused(kept, changes, said):
    kept(
        "best",
        {"calm": {"zero": 30.0, "costs": [1.0] * 100, "by": ["lq"] * 100} | changes},
    )
    with pytest.raises(InputError, match=said):
        best_known("mine")


def test_tuned_settings_are_tables_by_task(kept):
    for content, said in (
        ({"tasks": 3}, "tuned.json: tasks: expected .*got 3"),
        ({"tasks": {"calm": 3}}, "tasks.calm: expected a table"),
    ):
        kept("tuned", content)
        with pytest.raises(InputError, match=said):
            load_tuned("mine")
    kept("tuned", {"tasks": {"calm": {"lq": {"cost": 1.0}}}})
    assert load_tuned("mine") == {"calm": {"lq": {"cost": 1.0}}}
