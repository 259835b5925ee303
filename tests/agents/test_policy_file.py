"""Policy files: read back bit for bit, without torch, and refused with file and field
named."""

import hashlib
import json
import subprocess
import sys

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from agents import PID, load_agent, load_results
from shipgym import load_model
from shipgym.errors import InputError
from shipgym.sea import Current, Weather
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


def test_no_torch_is_needed(tmp_path):
    POLICIES["residual"].save(tmp_path / "agent.json")
    code = (
        "import sys; import numpy as np\n"
        "from agents import load_agent; from shipgym import load_model\n"
        "agent = load_agent(sys.argv[1], load_model('mariner'))\n"
        "agent.predict(np.zeros(8, np.float32))\n"
        "assert not {'torch', 'stable_baselines3', 'onnx'} & set(sys.modules)"
    )
    subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "agent.json")], check=True
    )


@pytest.mark.parametrize(
    ("name", "training", "message"),
    [
        ("nowhere/a.json", {}, "cannot be written"),
        ("a.safetensors", {}, r"expected a name that ends in \.json"),
    ],
)
def test_a_policy_that_cannot_be_written_leaves_nothing_behind(
    name, training, message, tmp_path
):
    with pytest.raises(InputError, match=message):
        random_policy(training=training).save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def edited(path, field, value):
    """The file with one field set, or taken away with None."""
    content = json.loads(path.read_text())
    place = content
    *parents, name = field.split("__")
    for parent in parents:
        place = place[parent]
    if value is None:
        del place[name]
    else:
        place[name] = value
    path.write_text(json.dumps(content))


NAMES = list(POLICIES["plain"].observation_names)
#: Field, its value (None: taken away), and what the message says.
BAD_FIELDS = [
    ("format", 2, "expected format 1"),
    ("kind", "learnt", "kind: .*'learnt'.*Did you mean 'learned'"),
    ("weights__sha256", "00", r"safetensors: expected SHA-256 00\.\.\..*cut short"),
    ("network__activation", "sigmoid", "network.activation: .*got 'sigmoid'"),
    ("network__sizes", 8, "network.sizes: expected a list .*got 8"),
    ("network__sizes", [8, "0"], "network: expected weights of float32 and shapes"),
    ("network__sizes", [8, 1], r"network: .*'layers.0.weight': \(1, 8\).* got "),
    ("observation_names", [*NAMES, "sway"], "expected a list of numbers, size 9"),
    ("observation_scales", [1.0], "scales: expected a list of numbers, size 8"),
    (
        "observation_scales",
        [-1.0] * 8,
        r"scales: 'heading_error_sin': .*got -1",
    ),
    ("frame_stack", 1.5, "frame_stack: .*got 1.5"),
    ("frame_stack", 2, "network: expected 16 inputs"),
    ("environment__options", [], "environment.options: expected a table"),
    ("model__sha256", None, "model.sha256: .*got None"),
]


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "agent.json"
    POLICIES["plain"].save(path)
    return path


@pytest.mark.parametrize(("field", "value", "message"), BAD_FIELDS)
def test_a_wrong_field_is_named(field, value, message, saved):
    edited(saved, field, value)
    with pytest.raises(InputError, match=message) as caught:
        load_agent(saved)
    assert str(caught.value).startswith(str(saved.with_suffix("")))


#: Weights that are changed, and what the message says.
BAD_WEIGHTS = [
    ("layers.1.weight", np.full((16, 16), np.nan), r"layers\[1\].weight: .*finite"),
    ("layers.1.bias", None, "network: expected weights of float32 and shapes"),
    ("x", np.zeros(1), "network: expected weights of float32 and shapes"),
    ("layers.0.bias", np.zeros(16), "network: expected weights of float32 and shapes"),
]


@pytest.mark.parametrize(("name", "value", "message"), BAD_WEIGHTS)
def test_wrong_weights_are_named(name, value, message, saved):
    file = saved.with_suffix(".safetensors")
    tensors = {key: array.copy() for key, array in load_file(file).items()}
    if value is None:
        del tensors[name]
    elif name.endswith("weight"):
        tensors[name] = value.astype(np.float32)
    else:
        tensors[name] = value
    save_file(tensors, file)
    edited(saved, "weights__sha256", hashlib.sha256(file.read_bytes()).hexdigest())
    with pytest.raises(InputError, match=message):
        load_agent(saved)


@pytest.mark.parametrize("end", ["json", "safetensors"])
def test_a_file_cut_short_or_missing_is_refused(end, saved):
    cut = saved.with_suffix(f".{end}")
    cut.write_bytes(cut.read_bytes()[:-20])
    with pytest.raises(InputError, match=f"agent.{end}: .*cut short"):
        load_agent(saved)
    cut.unlink()
    with pytest.raises(InputError, match=f"agent.{end}: there is no such"):
        load_agent(saved)


def test_weights_in_another_form_are_refused(saved):
    file = saved.with_suffix(".safetensors")
    file.write_bytes(b"\xff" * 100)
    edited(saved, "weights__sha256", hashlib.sha256(file.read_bytes()).hexdigest())
    with pytest.raises(InputError, match=r"agent.safetensors: expected a safetensors"):
        load_agent(saved)


def test_a_name_too_long_for_a_path_is_refused():
    for read in (load_agent, load_results, load_model):
        with pytest.raises(InputError, match="expected"):
            read("x" * 5000 + ".py" * (read is load_model))
