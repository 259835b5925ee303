"""Policy files: read back bit for bit, without torch, and refused with file and field named."""

import hashlib
import json
import subprocess
import sys

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from agents import PID, check_controller, load_agent
from shipgym.errors import InputError
from shipgym.sea import Current, Weather
from shipgym.ships.mariner import mariner
from tests.agents.policies import MARINER, random_policy

POLICIES = {
    "plain": random_policy(),
    "frame_stack": random_policy(frame_stack=3),
    "residual": random_policy(
        base=PID.from_model(MARINER), authority=0.4, action_repeat=2
    ),
    "limited": random_policy(
        base=PID.from_model(MARINER), action_repeat=2, rate_limit=0.1
    ),
    "discrete": random_policy(action="rudder-discrete"),
}


def steered(policy):
    """Actions over some steps of four ships."""
    random = np.random.default_rng(0)
    actions, state = [], None
    for step in range(5):
        seen = random.uniform(-1.0, 1.0, (4, 8)).astype(np.float32)
        action, state = policy.predict(seen, state, np.full(4, step == 0))
        actions.append(action)
    return np.array(actions)


@pytest.mark.parametrize("name", POLICIES)
def test_a_file_holds_the_whole_policy(name, tmp_path):
    policy, path = POLICIES[name], tmp_path / "agent.json"
    policy.save(path)
    again = load_agent(path, MARINER)
    assert type(again) is type(policy)
    np.testing.assert_array_equal(steered(again), steered(policy))
    again.save(tmp_path / "again.json")
    assert json.loads((tmp_path / "again.json").read_text()) == json.loads(
        path.read_text()
    )
    assert set(tmp_path.glob("agent*")) == {path, path.with_suffix(".safetensors")}


def test_what_was_recorded_comes_back(tmp_path):
    sea = Weather(current=Current(speed=1.0))
    training = {
        "algorithm": "ppo",
        "seeds": (0, 1),
        "curve": np.array([1.0, np.nan]),
        "steps": np.int64(5),
    }
    policy = random_policy(
        training=training, env_options={"sea": sea, "leg_lengths": (5.0, 10.0)}
    )
    policy.save(tmp_path / "ppo.json")
    again = load_agent(tmp_path / "ppo.json")
    assert again.training == {
        "algorithm": "ppo",
        "seeds": [0, 1],
        "curve": [1.0, None],
        "steps": 5,
    }
    assert again.name == "ppo"
    assert again.env_options["leg_lengths"] == [5.0, 10.0]
    assert Weather.from_dict(again.env_options["sea"]) == sea
    assert again.model_name == "mariner"


def test_files_may_be_renamed_together_and_stay_small(tmp_path):
    random_policy().save(tmp_path / "a.json")
    for end in ("json", "safetensors"):
        (tmp_path / f"a.{end}").rename(tmp_path / f"b.{end}")
    np.testing.assert_array_equal(
        steered(load_agent(tmp_path / "b.json")), steered(random_policy())
    )


def test_no_torch_is_needed(tmp_path):
    POLICIES["residual"].save(tmp_path / "agent.json")
    code = (
        "import sys; import numpy as np\n"
        "from agents import load_agent; from shipgym.ships import load_model\n"
        "agent = load_agent(sys.argv[1], load_model('mariner'))\n"
        "agent.predict(np.zeros(8, np.float32))\n"
        "assert not {'torch', 'stable_baselines3', 'onnx'} & set(sys.modules)"
    )
    subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "agent.json")], check=True
    )


def test_a_policy_that_cannot_be_written_leaves_nothing_behind(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        random_policy().save(tmp_path / "nowhere" / "a.json")
    with pytest.raises(InputError, match=r"a policy's file ends in \.json"):
        random_policy().save(tmp_path / "a.safetensors")
    with pytest.raises(
        InputError, match=r"training and env_options: .*not JSON serializable"
    ):
        random_policy(training={"made": object()}).save(tmp_path / "a.json")
    assert list(tmp_path.iterdir()) == []


def edited(path, field, value):
    """The file with one field set, or taken away with None."""
    content = json.loads(path.read_text())
    place, (*parents, name) = content, field.split("__")
    for parent in parents:
        place = place[parent]
    if value is None:
        del place[name]
    else:
        place[name] = value
    path.write_text(json.dumps(content))


NAMES = list(POLICIES["plain"].observation_names)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("format", 2, "format 2 found, this version of shipgym reads format 1"),
        ("kind", "learnt", "kind: .*'learnt'.*Did you mean 'learned'"),
        ("network", None, "field 'network' is missing"),
        ("weight", {}, "unknown key 'weight'. Did you mean 'weights'"),
        ("weights", {"sha": "1"}, "weights: unknown key 'sha'"),
        (
            "weights__sha256",
            "00",
            r"safetensors: SHA-256 .* found in \d+ bytes, expected 00.*cut short",
        ),
        (
            "weights__sha256",
            "5" * 64,
            r"SHA-256 [0-9a-f]{12}\.\.\. found in \d+ bytes, expected 5{12}\.\.\., ",
        ),
        (
            "network__sizes",
            [8],
            r"network.sizes: \[8\] found, expected a list of two numbers or more",
        ),
        (
            "network__sizes",
            [8, 0, 1],
            r"network.sizes\[1\]: 0 found, expected a whole number of at least 1",
        ),
        ("network__activation", "sigmoid", "network.activation: 'sigmoid' found"),
        (
            "network__sizes",
            [8, 1],
            r"'layers.0.weight': float32 of shape \(16, 8\) found, expected .*\(1, 8\)",
        ),
        ("network__sizes", [8, 16, 16, 1, 1], "weights 'layers.3.weight' are missing"),
        ("network__sizes", [8, 16, 16], "network: 16 outputs found, expected 1"),
        ("network__sizes", [8, "16", 1], r"network.sizes\[1\]: '16' found"),
        ("network__sizes", 8, "network.sizes: 8 found, expected a list"),
        (
            "observation_names",
            "sway",
            "observation_names: 'sway' found, expected a list of names",
        ),
        (
            "observation_names",
            [*NAMES[:2], NAMES[3], NAMES[2], *NAMES[4:]],
            "observation 2: expected 'yaw_rate', got 'sway'",
        ),
        (
            "observation_names",
            NAMES[:7],
            "expected 8 observations, got 7; .* heading_error_integral",
        ),
        ("observation_names", [*NAMES, "sway"], "a name twice"),
        (
            "observation_scales",
            [1.0],
            "observation_scales: expected 8 numbers, got 1",
        ),
        (
            "observation_scales",
            [-1.0] * 8,
            r"observation_scales\[0\] \('heading_error_sin'\): -1 found",
        ),
        ("action", "helm", "action: 'helm' found"),
        ("frame_stack", 1.5, "frame_stack: 1.5 found"),
        ("frame_stack", 2, "network: 8 inputs found, expected 16: 2 x 8 observations"),
        ("authority", "1", "authority: '1' .* found"),
        ("base", {"kind": "lq"}, "base: field 'format' is missing"),
        ("environment__id", "", "environment.id: '' found"),
        ("environment__options", [], "environment.options: .* expected a table"),
        ("model__sha256", None, "model.sha256: None found"),
        ("training", 5, "training: 5 found, expected a table"),
    ],
)
def test_a_wrong_field_is_named(field, value, message, tmp_path):
    path = tmp_path / "agent.json"
    POLICIES["plain"].save(path)
    edited(path, field, value)
    with pytest.raises(InputError, match=message) as caught:
        load_agent(path)
    assert str(caught.value).startswith(str(path.with_suffix("")))


def rewritten(path, change):
    """The weights changed, and their hash with them."""
    weights = path.with_suffix(".safetensors")
    tensors = {name: array.copy() for name, array in load_file(weights).items()}
    change(tensors)
    save_file(tensors, weights)
    edited(path, "weights__sha256", hashlib.sha256(weights.read_bytes()).hexdigest())


def spoil(tensors):
    tensors["layers.1.weight"][2, 3] = np.nan


CHANGES = {
    "not finite": (
        spoil,
        r"layers\[1\].weight: nan found at \[2, 3\], expected finite",
    ),
    "missing": (
        lambda tensors: tensors.pop("layers.1.bias"),
        "weights 'layers.1.bias' are missing",
    ),
    "more": (
        lambda tensors: tensors.update(x=np.zeros(1)),
        "unknown 'x' found with the weights",
    ),
    "double": (
        lambda tensors: tensors.update({"layers.0.bias": np.zeros(16)}),
        r"'layers.0.bias': float64 of shape \(16,\) found, expected float32",
    ),
}


@pytest.mark.parametrize("name", CHANGES)
def test_wrong_weights_are_named(name, tmp_path):
    path = tmp_path / "agent.json"
    POLICIES["plain"].save(path)
    change, message = CHANGES[name]
    rewritten(path, change)
    with pytest.raises(InputError, match=message):
        load_agent(path)


@pytest.mark.parametrize("end", ["json", "safetensors"])
def test_a_file_cut_short_or_missing_is_refused(end, tmp_path):
    path = tmp_path / "agent.json"
    POLICIES["plain"].save(path)
    cut = path.with_suffix(f".{end}")
    cut.write_bytes(cut.read_bytes()[:-20])
    with pytest.raises(InputError, match=f"agent.{end}: .*cut short"):
        load_agent(path)
    cut.unlink()
    with pytest.raises(InputError, match=f"agent.{end}: there is no such"):
        load_agent(path)


def test_weights_that_are_none_are_refused_though_their_hash_is_right(tmp_path):
    path = tmp_path / "agent.json"
    POLICIES["plain"].save(path)
    path.with_suffix(".safetensors").write_bytes(b"pickle")
    edited(path, "weights__sha256", hashlib.sha256(b"pickle").hexdigest())
    with pytest.raises(InputError, match=r"agent\.safetensors: not a safetensors file"):
        load_agent(path)


def test_a_policy_of_another_ship_is_refused_with_the_difference(tmp_path):
    for name in ("plain", "residual"):
        POLICIES[name].save(tmp_path / "agent.json")
        with pytest.raises(
            InputError,
            match=r"model 'mariner': scale of 'yaw_rate': expected 0\.0479.* got 0\.0248",
        ):
            load_agent(tmp_path / "agent.json", mariner(service_speed=4.0))


def test_what_is_loaded_passes_the_conformance_suite(tmp_path):
    POLICIES["residual"].save(tmp_path / "agent.json")
    check_controller(load_agent(tmp_path / "agent.json"), MARINER, n_steps=5)


def test_a_run_s_folder_names_its_agent(tmp_path):
    POLICIES["residual"].save(tmp_path / "agent.json")
    np.testing.assert_array_equal(
        steered(load_agent(tmp_path)), steered(POLICIES["residual"])
    )
