"""Suites of tasks: shipped ones, a user's own, and what is refused with its field."""

import shutil
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import shipgym
from agents.controllers.interface import model_hash
from agents.suites.benchmark_task import SETS, BenchmarkTask, judging_seeds, with_terms
from agents.suites.environments import read_environment
from agents.suites.suite import (
    find_task,
    load_suite,
    load_tuned,
    parse_suite,
    tuned_file,
)
from shipgym import InputError, load_model
from tests.agents.small_suite import TEXT as SMALL
from tests.agents.small_suite import write_suite

FAIRWAY = Path(__file__).parents[2] / "examples" / "fairway.py"
SHIPPED = load_suite()
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


@pytest.fixture
def registry():
    """The registered environments, as they were again afterwards."""
    before = dict(gymnasium.registry)
    yield gymnasium.registry
    gymnasium.registry.clear()
    gymnasium.registry.update(before)


def test_a_suite_is_read_task_by_task():
    suite = parse_suite(TEXT, "mine")
    assert suite.name == "mine-v1"
    assert [task.name for task in suite.tasks] == ["calm", "drift", "rough"]
    calm, drift, rough = suite.tasks
    assert (calm.env_id, calm.model) == ("shipgym/CourseKeeping-v0", "mariner")
    assert (drift.env_id, drift.ship.name) == ("shipgym/PathFollowing-v0", "kvlcc2")
    assert (calm.why, calm.arguments) == ("the easiest", {"noise": 1.0})
    assert calm.task.weather.calm
    assert drift.task.weather.current.speed == 0.5
    assert rough.task.weather.name == "rough"
    assert suite.task("drift") is drift
    np.testing.assert_array_equal(calm.seeds, 1_000_000 + np.arange(100))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('model = "mariner"', 'model = "marine"', "tasks.calm.*'marine'.*'mariner'"),
        ("noise = 1.0", "noise = -1.0", "tasks.calm: noise: expected .* got -1"),
        ("noise = 1.0", "nose = 1.0", "tasks.calm.*'nose'.*Did you mean 'noise'"),
        ('"course-keeping"', "3", "tasks.calm.environment: expected .* got 3"),
        (
            '"course-keeping"',
            '"shipgym/PathFollowing-v1"',
            "tasks.calm.environment: .*Did you mean 'shipgym/PathFollowing-v0'",
        ),
        (
            '"course-keeping"',
            '"nowhere.py"',
            "tasks.calm.environment: expected no code, got .nowhere.py.; .*-code",
        ),
        (
            "noise = 1.0",
            'reward = "my_reward.py"',
            "tasks.calm.options.reward: expected data, got 'my_reward.py'",
        ),
        ("speed = 0.5", "speed = -0.5", "tasks.drift: current speed"),
        (
            'sea = "rough"',
            'sea = "wild"',
            "tasks.rough: sea state: expected one of .* got 'wild'",
        ),
        ('why = "the easiest"', 'rule = "a:b"', "tasks.calm.rule: expected no code"),
        (
            'why = "the easiest"',
            "limits = { heel = 3.0 }",
            "tasks.calm.limits: .*heel_deg",
        ),
        ('name = "mine-v1"', "", "name"),
        ("[tasks.calm]", "[tsks.calm]", "unknown key 'tsks'"),
        ('model = "kvlcc2"', "", "tasks.drift.model: expected .* got None"),
        ('name = "mine-v1"', "name = ", "not valid TOML"),
    ],
)
def test_a_wrong_field_is_named(old, new, message, tmp_path):
    assert old in TEXT
    with pytest.raises(InputError, match=f"small.toml: {message}"):
        load_suite(write_suite(tmp_path, TEXT.replace(old, new, 1)))


def test_shipped_suites_are_known_by_name():
    assert (SHIPPED.name, SHIPPED.source) == ("shipgym-v1", "shipgym-v1")
    assert load_suite("shipgym-v1") is SHIPPED
    assert len(SHIPPED.sha256) == 64
    assert tuned_file("shipgym-v1").is_file()
    said = "suite: expected one of .* a TOML file, got 'shipgym-v2'.*'shipgym-v1'"
    with pytest.raises(InputError, match=said):
        load_suite("shipgym-v2")
    said = "suite 'shipgym-v1': task: .*Did you mean 'sharp-turns'"
    with pytest.raises(InputError, match=said):
        SHIPPED.task("sharp-turn")


def test_tasks_are_selected_by_name_each_once():
    assert SHIPPED.select(None) == SHIPPED.tasks
    for names in ("sharp-turns, seaway", ["sharp-turns", "seaway", "sharp-turns"]):
        found = [task.name for task in SHIPPED.select(names)]
        assert found == ["sharp-turns", "seaway"]
    with pytest.raises(InputError, match="tasks: expected at least one, got none"):
        SHIPPED.select([])
    with pytest.raises(InputError, match=r"task: expected one of .* got ''"):
        SHIPPED.select("roll-limit,")


def test_a_task_is_judged_on_a_ship_that_its_model_s_family_does_not_hold():
    for task in SHIPPED.tasks:
        learning = task.part == "learning"
        known = SETS[:2] if learning else SETS
        assert task.sets == (*known, "sweep-1", "sweep-2", "sweep-3")
        assert task.design.ship.name == task.model
        if not learning:
            ship = task.scenario("ship").ship
            assert ship.dynamics != task.ship.dynamics
            assert model_hash(ship) != model_hash(load_model(task.true_ship))
    seaway = SHIPPED.task("seaway")
    lags = [seaway.scenario(on).ship.steering.time_constant for on in seaway.sets]
    assert lags == [6.0, 6.0, 1.0, 8.0, 10.0, 12.0]
    far = SHIPPED.task("strong-current").scenario("sweep-3").task
    assert far.weather.current.speed == 4.0


def test_terms_are_accelerations_in_units_of_length_and_speed():
    mariner = load_model("mariner")
    ship = with_terms(mariner, {"v": {"|v| v": -2.0}, "r": {"|delta| delta": 0.5}})
    x = np.zeros(len(ship.state_names))
    x[ship.state_names.index("u")] = U = mariner.particulars["speed"]
    x[ship.state_names.index("v")] = 0.1 * U
    x[ship.state_names.index("delta")] = 0.2
    L, order = mariner.particulars.length, np.array([0.2])
    added = ship.derivatives(x, order) - mariner.derivatives(x, order)
    assert added[ship.state_names.index("v")] == pytest.approx(-0.02 * U**2 / L)
    assert added[ship.state_names.index("r")] == pytest.approx(0.02 * U**2 / L**2)


def test_the_design_task_does_not_name_the_ship():
    task = SHIPPED.task("sharp-turns")
    design = task.design_task
    assert (design.true_ship, design.judge, design.sweep) == ("", {}, ())
    assert design.scenario("ship").ship.name == task.model
    assert find_task("sharp-turns") == design
    assert not set(judging_seeds("fresh", 100)) & set(judging_seeds("ship", 100))


def test_a_ship_of_other_particulars_than_the_model_is_refused(tmp_path):
    text = SMALL.replace('ship = "mariner"', 'ship = "tanker"')
    said = "tasks.turns: .*expected the particulars of 'mariner-tls-svm', got 'tanker'"
    with pytest.raises(InputError, match=said):
        load_suite(write_suite(tmp_path, text))


# --- suites and tasks of a user's own


def own_suite(folder, environment, **lines):
    """A suite of one task in that environment, in a folder with the task's file."""
    shutil.copy(FAIRWAY, folder / "fairway.py")
    text = f'name = "own"\n[tasks.fairway]\nenvironment = "{environment}"\n'
    text += "".join(f"{name} = {value}\n" for name, value in lines.items())
    return write_suite(folder, text)


def test_a_suite_names_the_file_of_a_task_that_its_user_names_too(tmp_path):
    path = own_suite(
        tmp_path,
        "fairway.py",
        model='"kvlcc2"',
        options='{ action = "rudder-shaft", speed_limit = 0.5 }',
    )
    said = "tasks.fairway.environment: .* --allow-code"
    with pytest.raises(InputError, match=said):
        load_suite(path)
    suite = load_suite(path, allow_code=True)
    (task,) = suite.tasks
    assert (suite.name, suite.source, task.suite) == ("own", str(path), str(path))
    assert task.environment == str(tmp_path / "fairway.py")
    assert task.files == [tmp_path / "fairway.py"]
    assert BenchmarkTask(**task.to_dict()) == task
    env = gymnasium.make(task.env_id, model=task.model, **task.arguments)
    assert env.unwrapped.task == task.task
    assert task.task.speed_limit == 0.5


def test_a_suite_names_an_id_that_is_registered(tmp_path, registry):
    path = own_suite(tmp_path, "harbour/Fairway-v0", options="{ half_width = 3.0 }")
    with pytest.raises(InputError, match=r"tasks.fairway.environment: expected one of"):
        load_suite(path)
    shipgym.register_task(
        "harbour/Fairway-v0",
        tmp_path / "fairway.py",
        model="kvlcc2",
        action="rudder-shaft",
    )
    (task,) = load_suite(path).tasks
    assert (task.model, task.task.half_width, task.task.action) == (
        "kvlcc2",
        3.0,
        "rudder-shaft",
    )
    assert task.environment == str(tmp_path / "fairway.py")  # for other processes


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("path-following-v1", "env: expected one of .*Did you mean 'path-following'"),
        ("shipgym/PathFollowing-v1", "Did you mean 'shipgym/PathFollowing-v0'"),
        ("CartPole-v1", "env: expected one of 'course-keeping'"),
        ("nowhere.py", "env: expected the file of a task, got no file .*nowhere.py"),
        ("no_such_module:a/b-v0", "env: expected module:name, .*ModuleNotFoundError"),
    ],
)
def test_an_unknown_environment_is_refused(text, said):
    with pytest.raises(InputError, match=said):
        read_environment(text)


# --- what is kept beside a suite


def test_tuned_settings_are_tables_by_task(tmp_path):
    with pytest.raises(InputError, match="there is no such file of tuned settings"):
        load_tuned(str(write_suite(tmp_path)))
    with pytest.raises(InputError, match=r"tuned.json: tasks: expected .* got 3"):
        load_tuned(str(write_suite(tmp_path, tuned={"tasks": 3})))
    tasks = {"calm": {"lq": [{"cost": 1.0}]}}
    assert load_tuned(str(write_suite(tmp_path, tuned={"tasks": tasks}))) == tasks
