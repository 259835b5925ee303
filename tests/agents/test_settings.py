"""Settings and plans of learning: what is allowed, where a value comes from, what is
refused."""

import json
from dataclasses import fields

import pytest

from agents.benchmarking.sources import pretrained
from agents.suites.suite import load_suite
from agents.training.plan import (
    EVALUATION_SEED,
    N_EVALUATIONS,
    TrainingPlan,
    check_same,
    first_difference,
    training_options,
)
from agents.training.request import TrainingRequest, make_plan
from agents.training.settings import (
    ALGORITHMS,
    SACSettings,
    changed,
    load_settings,
    make_settings,
    read_settings_file,
)
from shipgym import InputError
from shipgym.files import named_values
from shipgym.models.conversions import nomoto1_ship
from shipgym.sea import Current, Weather

FREE = {"base": "none", "authority": 1.0}
#: The least and the largest value that is allowed, and the nearest that is not.
BOUNDS = [
    ("ppo", "total_steps", 1, 0),
    ("sac", "ships", 1, 0),
    ("ppo", "learning_rate", 1.0, 1.1),
    ("ppo", "learning_rate", 1e-9, 0.0),
    ("ppo", "gamma", 0.0, -0.01),
    ("ppo", "gamma", 1.0, 1.01),
    ("ppo", "frame_stack", 1, 0),
    ("ppo", "action_repeat", 1, 0),
    ("ppo", "reward_scale", 1e-9, 0.0),
    ("ppo", "n_epochs", 1, 0),
    ("ppo", "gae_lambda", 0.0, -0.01),
    ("ppo", "gae_lambda", 1.0, 1.01),
    ("ppo", "clip_range", 1e-9, 0.0),
    ("ppo", "ent_coef", 0.0, -0.1),
    ("ppo", "vf_coef", 1e-9, 0.0),
    ("ppo", "log_std_init", -10.0, -10.1),
    ("ppo", "log_std_init", 3.0, 3.1),
    ("ppo", "log_std_end", -10.0, -10.1),
    ("ppo", "log_std_end", 3.0, 3.1),
    ("ppo", "batch_size", 2, 1),
    ("ppo", "net_arch", [1], [0]),
    ("ppo", "evaluate_every", 1, 0),
    ("ppo", "max_grad_norm", 1e-9, 0.0),
    ("sac", "learning_starts", 0, -1),
    ("sac", "train_freq", 1, 0),
    ("sac", "gradient_steps", 1, 0),
    ("sac", "tau", 1.0, 1.1),
    ("sac", "tau", 1e-9, 0.0),
    ("sac", "critic_arch", [1], [0]),
    ("sac", "target_entropy", 1.0, 1.1),
    ("sac", "ent_coef", 0.0, -0.1),
    ("td3", "policy_delay", 1, 0),
    ("td3", "action_noise", 1e-9, 0.0),
    ("td3", "target_policy_noise", 0.0, -0.1),
    ("td3", "target_noise_clip", 0.0, -0.1),
    ("tqc", "n_critics", 1, 0),
    ("tqc", "n_quantiles", 3, 2),
    ("tqc", "top_quantiles_to_drop", 0, -1),
    ("tqc", "top_quantiles_to_drop", 24, 25),
]


@pytest.mark.parametrize(("algorithm", "name", "allowed", "beyond"), BOUNDS)
def test_settings_reach_to_their_bounds_and_no_further(
    algorithm, name, allowed, beyond
):
    usual = load_settings(algorithm)
    kept = changed(usual, {name: allowed})
    assert getattr(kept, name) == (
        tuple(allowed) if isinstance(allowed, list) else allowed
    )
    with pytest.raises(InputError, match=rf"{name}: .*expected|top_quantiles_to_drop"):
        changed(usual, {name: beyond})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"net_arch": "64"},
            r"net_arch: expected widths of layers, such as \[64, 64\]",
        ),
        ({"net_arch": 64}, "net_arch: expected widths of layers"),
        ({"ent_coef": "auto_x"}, "ent_coef: expected a number, 'auto' or such as 'aut"),
        ({"ent_coef": "auto_-1"}, "expected a number, 'auto' or such as 'auto_0.1'"),
        ({"ent_coef": "auto_0"}, "expected a number, 'auto' or such as 'auto_0.1'"),
        ({"ent_coef": "otto"}, "ent_coef: expected a number"),
        ({"ent_coef": True}, "ent_coef: expected a number"),
        ({"target_entropy": "auto_1"}, r"target_entropy: .*number <= 1 .*or 'auto'"),
        ({"target_entropy": "auto1"}, r"target_entropy: .*number <= 1 .*or 'auto'"),
        ({"schedule": "liner"}, "Did you mean 'linear'"),
        ({"activation": "elu"}, "activation: expected one of 'relu', 'tanh'"),
        ({"ships": 10, "buffer_size": 9}, "buffer_size: expected at least 10, one for"),
        ({"authority": 2.1, "base": "lq"}, "authority: expected a number > 0 and <= 2"),
        ({"authority": 0.0, "base": "lq"}, "authority: expected a number > 0 and <= 2"),
        ({"authority": 0.5}, "authority: expected 1 without a base, got 0.5"),
        ({"total_steps": 1.5}, "total_steps: expected an integer"),
        ({"base": "designs/mine.toml"}, "base: expected one of 'none', 'tuned', "),
        ({"base": "lqq"}, "base: .*Did you mean 'lq'"),
        ({"base": ""}, "base: expected a non-empty string"),
    ],
)
def test_settings_that_cannot_be_meant_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        changed(load_settings("sac", given=FREE), given)


@pytest.mark.parametrize("algorithm", ["sac", "td3", "tqc"])
def test_the_store_of_past_steps_has_room_for_a_step_of_every_ship(algorithm):
    settings = load_settings(algorithm, given=FREE)
    assert changed(settings, {"ships": 10, "buffer_size": 10}).buffer_size == 10
    with pytest.raises(InputError, match="buffer_size: expected at least 10, one for"):
        changed(settings, {"ships": 10, "buffer_size": 9})


def test_a_base_may_be_the_file_of_a_controller():
    settings = load_settings("ppo")
    assert changed(settings, {"base": "designs/mine.json"}).base == "designs/mine.json"
    assert changed(settings, {"base": "none", "authority": 1.0}).authority == 1.0


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (("pqo",), "algorithm: expected one of.* Did you mean 'ppo'"),
        (("ppo", "harbour"), "environment: expected one of 'course-keeping', "),
    ],
)
def test_settings_of_what_is_not_known_are_refused(asked, message):
    with pytest.raises(InputError, match=message):
        load_settings(*asked)


@pytest.mark.parametrize("kind", ALGORITHMS.values())
def test_every_setting_says_what_it_means(kind):
    for one in fields(kind):
        assert one.metadata["meaning"].strip(), one.name


def test_words_stand_for_numbers_where_they_may():
    words = {"ent_coef": "auto_0.1", "target_entropy": "auto"}
    sac = changed(load_settings("sac"), words)
    assert {name: getattr(sac, name) for name in words} == words
    assert changed(sac, {"ent_coef": "auto"}).ent_coef == "auto"
    given = {"reward_scale": "running", "log_std_end": "learned", "gamma": 1}
    ppo = changed(load_settings("ppo"), given)
    assert {name: getattr(ppo, name) for name in given} == given
    assert type(ppo.gamma) is float


def test_a_value_comes_from_the_nearest_table():
    """Residual tables for the rudder alone, the task's before the suite's, what is
    given before all."""
    scratch, residual = load_settings("ppo", given=FREE), load_settings("ppo")
    assert (scratch.total_steps, scratch.n_steps, scratch.reward_scale) == (
        1_000_000,
        64,
        100.0,
    )
    assert (residual.base, residual.n_steps, residual.clip_range) == ("lq", 256, 0.2)
    assert load_settings("ppo", "path-following").base == "ilos"
    assert load_settings("ppo", action="rudder-shaft") == scratch
    on_task = load_settings("ppo", "path-following", "roll-limit", suite="shipgym-v1")
    assert on_task.base == "tuned"
    assert load_settings("ppo", task="of no suite") == residual
    assert load_settings("ppo", given={"gamma": 0.5, "n_steps": 128}).gamma == 0.5
    for algorithm, kind in ALGORITHMS.items():
        table = load_settings(algorithm).to_dict()
        assert type(make_settings(algorithm, table)) is kind
        assert make_settings(algorithm, table).to_dict() == table
        del table["net_arch"]
        with pytest.raises(
            InputError, match=f"settings of {algorithm}: field 'net_arch' is missing"
        ):
            make_settings(algorithm, table)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_tuned_settings_have_a_base_in_every_task_of_the_suite(algorithm):
    for task in load_suite().tasks:
        settings = load_settings(
            algorithm, task.environment, task.name, suite="shipgym-v1"
        )
        assert settings.base != "none"
        assert settings.authority <= 1.0


def test_settings_of_the_command_line_and_of_files(tmp_path):
    texts = "gamma=0.9", "net_arch = [8, 8]", "base=lq", 'schedule="linear"', "note=a=b"
    found = named_values(texts, "--set", "gamma=0.98")
    assert found == {
        "gamma": 0.9,
        "net_arch": [8, 8],
        "base": "lq",
        "schedule": "linear",
        "note": "a=b",
    }
    for wrong in ("gamma", "=0.9"):
        with pytest.raises(
            InputError, match=r"expected name=value, such as --set gamma=0\.98"
        ):
            named_values([wrong], "--set", "gamma=0.98")
    path = tmp_path / "mine.toml"
    path.write_text("action_repeat = 3\ngamma = 1\n")
    assert read_settings_file(path, "ppo") == {"action_repeat": 3, "gamma": 1.0}
    path.write_text("gamma = \n")
    with pytest.raises(InputError, match=r"mine\.toml: not valid TOML"):
        read_settings_file(path, "ppo")
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="got UTF-16"):
        read_settings_file(path, "ppo")


@pytest.mark.parametrize(
    ("found", "difference"),
    [
        ({"a": 1, "b": {"c": 2, "d": [3]}}, None),
        ({"a": 1, "b": {"c": 2, "d": [4]}}, "b.d: expected [3], got [4]"),
        ({"a": 1, "b": {"c": 2, "d": [3]}, "e": 5}, "e: expected None, got 5"),
        ({"b": {"c": 2, "d": [3]}}, "a: expected 1, got None"),
        ({"a": 1, "b": 3}, "b: expected {'c': 2, 'd': [3]}, got 3"),
        ({"a": {"c": 1}, "b": {}}, "a: expected 1, got {'c': 1}"),
    ],
)
def test_the_first_difference_of_two_configurations_is_told(found, difference):
    own = {"a": 1, "b": {"c": 2, "d": [3]}}
    assert first_difference(found, own) == difference
    if difference is None:
        check_same(found, own, "run")
    else:
        with pytest.raises(InputError, match=r"^run: "):
            check_same(found, own, "run")


def test_seas_and_lists_in_the_options_of_a_run_come_back_from_json():
    weather = Weather(name="stream", current=Current(speed=1.5, towards_deg=90.0))
    options = {"sea": [weather, "calm"]}
    plan = make_plan(TrainingRequest("ppo", options=options, seed=2, randomise=True))
    again = TrainingPlan.from_configuration(
        json.loads(json.dumps(plan.configuration())), 3
    )
    assert again.configuration() == plan.configuration()
    assert again.task.options == plan.task.options
    assert (again.seed, again.randomise, again.threads) == (2, True, 3)


def test_what_is_not_asked_for_is_as_it_was():
    """A run that is resumed: seed, threads, model and options are those of the stored
    one."""
    own = {"episode_steps": 50}
    first = make_plan(
        TrainingRequest(
            "ppo",
            model="kvlcc2",
            options=own,
            settings={"gamma": 0.8},
            seed=3,
            threads=2,
        )
    )
    assert (first.seed, first.randomise, first.threads) == (3, False, 2)
    assert first.training_seed == 3000
    assert TrainingPlan.from_configuration(first.configuration(), 2) == first
    assert make_plan(TrainingRequest("ppo"), first) == first
    changes = {"model": "mariner", "seed": 0, "randomise": True}
    request = TrainingRequest("ppo", settings={"n_epochs": 1}, **changes)
    other = make_plan(request, first)
    assert (other.task.model, other.task.options) == ("mariner", own)
    assert (other.seed, other.randomise, other.threads) == (0, True, 2)
    assert (other.settings.gamma, other.settings.n_epochs) == (0.8, 1)
    another = make_plan(TrainingRequest("sac", settings=FREE), first)
    assert type(another.settings) is SACSettings
    assert training_options(first) == {**own, "bounded": False}
    assert training_options(other)["speed_range"] == (0.8, 1.1)
    assert make_plan(TrainingRequest("ppo")).configuration()["task"] == ""


def test_all_agents_were_chosen_on_the_same_hundred_episodes():
    seeds = [EVALUATION_SEED, EVALUATION_SEED + N_EVALUATIONS - 1]
    paths = [
        path for task in load_suite().tasks for path in pretrained(task.name, "ppo")
    ]
    assert [
        json.loads(path.read_text())["training"]["evaluation_seeds"] for path in paths
    ] == [seeds] * 12 * 5  # training runs
    assert (
        min(min(task.seeds) for task in load_suite().tasks)
        >= EVALUATION_SEED + N_EVALUATIONS
    )
    assert (
        make_plan(TrainingRequest("ppo", seed=799)).training_seed + 1000
        <= EVALUATION_SEED
    )


def test_the_command_goes_before_the_file_of_settings_and_that_before_tuned_ones(
    tmp_path,
):
    (tmp_path / "mine.toml").write_text("gamma = 0.7\nclip_range = 0.3\n")
    settings = make_plan(
        TrainingRequest(
            "ppo",
            settings_file=tmp_path / "mine.toml",
            settings={"gamma": 0.6, "n_epochs": 2},
        )
    ).settings
    assert (settings.gamma, settings.clip_range, settings.n_epochs) == (0.6, 0.3, 2)
    assert settings.n_steps == load_settings("ppo").n_steps


def test_domain_randomisation_draws_ships_seas_and_speeds_and_leaves_what_was_asked(
    tmp_path,
):
    def options(model="mariner-tls-svm", **request):
        plan = make_plan(TrainingRequest("ppo", model=str(model), **request))
        return training_options(plan)

    drawn = options(sea="moderate", randomise=True)
    seas = [sea.name for sea in drawn["sea"]]
    assert seas == ["moderate", "calm", "slight", "rough"]  # each once
    assert drawn["model_uncertainty"] == "covariance"
    asked = {"speed_range": (0.5, 0.6)}
    assert asked.items() <= options(options=asked, randomise=True).items()
    alone = {"model_uncertainty": "covariance", "reward": "bounded"}
    assert options(settings=alone) == {
        "model_uncertainty": "covariance",  # neither seas nor speeds
        "bounded": True,
    }
    assert options("mariner", settings=alone) == {"bounded": True}
    bare = nomoto1_ship(0.1, 20.0, {"length": 160.0, "speed": 7.0})
    bare.save(tmp_path / "ship.json")
    found = options(tmp_path / "ship.json", randomise=True)
    assert [sea.name for sea in found["sea"]] == ["calm"]  # no beam, no weather


SHAFT = {"action": "rudder-shaft"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": 800}, "seed: expected an integer of at least 0 and at most 799"),
        ({"seed": -1}, "seed: expected an integer"),
        ({"threads": 0}, "threads: expected an integer"),
        ({"settings": {"ships": 1001, "batch_size": 1001}}, "ships: .* at most 1000"),
        ({"settings": {"ships": 0}}, "ships: expected an integer"),
        ({"settings": {"action_repeat": 601}}, "action_repeat: .* at most 600"),
        ({"options": SHAFT}, "action: .*'mariner'"),
        (
            {"options": SHAFT, "model": "kvlcc2", "settings": {"base": "lq"}},
            "base: expected 'none' with action 'rudder-shaft', got 'lq'",
        ),
        (
            {"task": "sharp-turns", "options": {"noise": 1.0}},
            "--task: expected alone, got --option too",
        ),
        (
            {"task": "sharp-turns", "model": "kvlcc2"},
            "--task: expected alone, got --model too",
        ),
    ],
)
def test_plans_that_cannot_be_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        make_plan(TrainingRequest("ppo", **arguments))


def test_plans_reach_to_their_bounds():
    last = make_plan(TrainingRequest("ppo", seed=799, threads=1))
    assert last.training_seed == 799_000
    long = make_plan(TrainingRequest("ppo", settings={"action_repeat": 600}))
    assert long.settings.action_repeat == 600
    few = {"ships": 1, "action_repeat": 1}
    assert make_plan(TrainingRequest("sac", settings=few)).settings.ships == 1


def test_an_unknown_algorithm_is_told_before_an_unknown_task():
    with pytest.raises(InputError, match=r"algorithm: .*'pqo'"):
        make_plan(TrainingRequest("pqo", task="sharp-trns"))
    with pytest.raises(InputError, match=r"expected one that sac learns, .*; take ppo"):
        make_plan(
            TrainingRequest(
                "sac", environment="shipgym/CourseKeepingDiscrete-v0", settings=FREE
            )
        )
    discrete = make_plan(
        TrainingRequest(
            "ppo", environment="shipgym/CourseKeepingDiscrete-v0", settings=FREE
        )
    )
    assert discrete.task.options == {"action": "rudder-discrete"}


def test_a_plan_has_the_settings_of_its_algorithm():
    plan = make_plan(TrainingRequest("ppo"))
    with pytest.raises(
        InputError, match="settings: expected SACSettings for sac, got PPOSettings"
    ):
        TrainingPlan("sac", plan.task, plan.settings)
    assert (plan.seed, plan.randomise, plan.threads) == (
        0,
        False,
        1,
    )  # where none are given
