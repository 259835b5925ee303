"""Settings and plans of learning: what is allowed, where a value comes from, what is
refused."""

import gymnasium
import pytest

from agents.training.evaluation import HeldOut
from agents.training.plan import make_plan, training_options
from agents.training.settings import (
    load_settings,
    read_settings_file,
)
from shipgym import InputError

FREE = {"base": "none", "authority": 1.0}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"net_arch": "64"}, r"net_arch: expected widths .* such as \[64, 64\]"),
        ({"ent_coef": "auto_x"}, "ent_coef: expected a number or 'auto' or such as"),
        ({"target_entropy": "auto_1"}, "target_entropy: expected a number or 'auto'"),
        ({"ships": 10, "buffer_size": 9}, "buffer_size: expected at least 10, one for"),
        ({"authority": 2.1, "base": "lq"}, "authority: expected a number > 0 and <= 2"),
        ({"authority": 0.5}, "authority: expected 1 without a base, got 0.5"),
        ({"frame_stack": 2, "base": "lq"}, "frame_stack: expected 1 with a base"),
        ({"base": "designs/mine.toml"}, "base: expected one of 'none', 'tuned', "),
        ({"gama": 0.9}, "unknown key 'gama'. Did you mean 'gamma'"),
    ],
)
def test_settings_that_cannot_be_meant_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        load_settings("sac", given={**FREE, **given})


def test_words_and_files_stand_for_values_where_they_may():
    given = {"ent_coef": "auto_0.1", "target_entropy": "auto", "gamma": 1}
    given |= {"reward_scale": "running", "base": "designs/mine.json"}
    settings = load_settings("sac", given=given)
    assert settings.to_dict().items() >= given.items()
    assert type(settings.gamma) is float


def test_a_value_comes_from_the_nearest_table():
    """Residual tables for the rudder alone, the task's before the suite's, what is
    given before all."""
    scratch, residual = load_settings("ppo", given=FREE), load_settings("ppo")
    assert (scratch.n_steps, scratch.reward_scale) == (64, 100.0)
    assert (residual.base, residual.n_steps, residual.clip_range) == ("lq", 256, 0.2)
    assert load_settings("ppo", "path-following").base == "ilos"
    assert load_settings("ppo", task="of no suite") == residual
    assert load_settings("ppo", given={"gamma": 0.5, "n_steps": 128}).gamma == 0.5
    with pytest.raises(InputError, match="environment: "):
        load_settings("ppo", "paths")


@pytest.mark.parametrize(
    ("name", "env_id"),
    [
        ("course-keeping", "shipgym/CourseKeeping-v0"),
        ("path-following", "shipgym/PathFollowing-v0"),
        ("encounter", "shipgym/Encounter-v0"),
    ],
)
def test_a_short_name_has_the_ship_of_its_id(name, env_id):
    env = gymnasium.make(env_id)
    assert make_plan("ppo", name).task.model == env.unwrapped.model.name
    assert make_plan("ppo", env_id).task.model == env.unwrapped.model.name


def test_on_paths_an_agent_is_compared_with_lq_with_preview():
    held_out = HeldOut(make_plan("ppo", "path-following").task, 900_000, 20)
    costs = held_out.costs
    assert costs["LQ with preview"] < costs["LQ"] < costs["zero action"]


def test_the_command_goes_before_the_file_of_settings_and_that_before_tuned_ones(
    tmp_path,
):
    file = tmp_path / "mine.toml"
    file.write_text("gamma = 0.7\nclip_range = 0.3\n")
    given = {"gamma": 0.6, "n_epochs": 2}
    settings = make_plan("ppo", settings_file=file, settings=given).settings
    assert (settings.gamma, settings.clip_range, settings.n_epochs) == (0.6, 0.3, 2)
    assert settings.n_steps == load_settings("ppo").n_steps
    file.write_text("gamma = \n")
    with pytest.raises(InputError, match="not valid TOML"):
        read_settings_file(file, "ppo")


def test_domain_randomisation_draws_ships_where_a_model_has_a_covariance():
    def options(model="mariner-tls-svm", **request):
        return training_options(make_plan("ppo", model=model, **request))

    alone = {"randomise": "covariance", "reward": "bounded"}
    assert options(settings=alone) == {
        "model_uncertainty": "covariance",
        "bounded": True,
    }
    assert options("mariner", settings=alone) == {"bounded": True}  # no covariance


def test_agents_of_a_suite_learn_over_drawn_models_and_never_see_the_true_ship():
    plan = make_plan("ppo", task="roll-limit")
    assert (plan.task.true_ship, plan.task.sweep) == ("", ())
    own = {"model_uncertainty": "covariance", "bounded": False}
    assert training_options(plan) == {**plan.task.options, **own}


SHAFT = {"action": "rudder-shaft"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": 800}, "seed: expected an integer of at least 0 and at most 799"),
        ({"options": {"rate_limit": 0.1}}, "--option rate_limit: expected a setting"),
        ({"options": SHAFT}, "action: .*'mariner-tls-svm'"),
        (
            {"options": SHAFT, "model": "kvlcc2", "settings": {"base": "lq"}},
            "base: expected 'none' with action 'rudder-shaft', got 'lq'",
        ),
        (
            {"task": "sharp-turns", "options": {"noise": 1.0}},
            "--task: expected alone, got --option too",
        ),
    ],
)
def test_plans_that_cannot_be_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        make_plan("ppo", **arguments)
