"""Policy files: read back bit for bit, without torch, and refused with file and field named."""

import hashlib
import json
import subprocess
import sys

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from agents import LQ, PID, Shielded, check_controller, load_agent
from agents.policies.shield import Limits
from shipgym.errors import InputError
from shipgym.sea import Current, Weather
from shipgym.ships import load_model
from shipgym.ships.mariner import mariner
from tests.agents.policies import MARINER, random_policy

IDENTIFIED = load_model("mariner-tls-svm")
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
    "shielded": Shielded.from_model(
        IDENTIFIED, random_policy(IDENTIFIED), limits=Limits(runaway_deg=12.0)
    ),
    "shielded pid": Shielded.from_model(MARINER, PID.from_model(MARINER)),
    "twice": Shielded.from_model(
        MARINER, Shielded.from_model(MARINER, random_policy())
    ),
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
    again = load_agent(path, IDENTIFIED if name == "shielded" else MARINER)
    assert type(again) is type(policy)
    np.testing.assert_array_equal(steered(again), steered(policy))
    again.save(tmp_path / "again.json")
    assert json.loads((tmp_path / "again.json").read_text()) == json.loads(
        path.read_text()
    )
    weights = {path.with_suffix(".safetensors")} if name != "shielded pid" else set()
    assert set(tmp_path.glob("agent*")) == {path, *weights}


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
    POLICIES["shielded"].save(tmp_path / "agent.json")
    code = (
        "import sys; import numpy as np\n"
        "from agents import load_agent; from shipgym.ships import load_model\n"
        "agent = load_agent(sys.argv[1], load_model('mariner-tls-svm'))\n"
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
    stranger = type("Helmsman", (), {"predict": lambda self, *args: None})()
    with pytest.raises(
        InputError, match="policy: Helmsman found, expected a learned policy"
    ):
        Shielded.from_model(MARINER, stranger).save(tmp_path / "a.json")
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
        ("format", 2, "expected format 1, which this version of shipgym reads, got 2"),
        ("kind", "learnt", "kind: expected.*Did you mean 'learned'"),
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
            r"network.sizes\[1\]: expected an integer of at least 1",
        ),
        ("network__activation", "sigmoid", "network.activation: expected"),
        (
            "network__sizes",
            [8, 1],
            r"'layers.0.weight': float32 of shape \(16, 8\) found, expected .*\(1, 8\)",
        ),
        ("network__sizes", [8, 16, 16, 1, 1], "weights 'layers.3.weight' are missing"),
        ("network__sizes", [8, 16, 16], "network: 16 outputs found, expected 1"),
        ("network__sizes", [8, "16", 1], r"network.sizes\[1\]: expected"),
        ("network__sizes", 8, "network.sizes: 8 found, expected a list"),
        (
            "observation_names",
            "sway",
            "observation_names: 'sway' found, expected a list of names",
        ),
        (
            "observation_names",
            [*NAMES[:2], NAMES[3], NAMES[2], *NAMES[4:]],
            "observation 2 is 'sway'",
        ),
        (
            "observation_names",
            NAMES[:7],
            "7 observations found, expected 8; .* heading_error_integral",
        ),
        ("observation_names", [*NAMES, "sway"], "a name twice"),
        (
            "observation_scales",
            [1.0],
            "observation_scales: 1 found, expected 8 numbers",
        ),
        (
            "observation_scales",
            [-1.0] * 8,
            r"observation_scales\[0\] \('heading_error_sin'\): expected",
        ),
        ("action", "helm", "action: expected"),
        ("frame_stack", 1.5, "frame_stack: expected"),
        ("frame_stack", 2, "network: 8 inputs found, expected 16: 2 x 8 observations"),
        ("authority", "1", "authority: expected"),
        ("base", {"kind": "lq"}, "base: field 'format' is missing"),
        ("environment__id", "", "environment.id: expected"),
        ("environment__options", [], "environment.options: expected a table"),
        ("model__sha256", None, "model.sha256: expected"),
        ("training", 5, "training: expected a table"),
    ],
)
def test_a_wrong_field_is_named(field, value, message, tmp_path):
    path = tmp_path / "agent.json"
    POLICIES["plain"].save(path)
    edited(path, field, value)
    with pytest.raises(InputError, match=message) as caught:
        load_agent(path)
    assert str(caught.value).startswith(str(path.with_suffix("")))


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("dt", 0.0, "dt: expected"),
        ("fallback", POLICIES, "fallback: .*expected a table"),
        ("fallback__gains__yaw_rate", None, "fallback: gains: 'yaw_rate' is missing"),
        (
            "envelope__low",
            [1.0],
            r"envelope.low: expected a list of 4",
        ),
        (
            "limits__back_deg",
            20.0,
            "limits.back_deg: expected a number > 0 and < 12 .less than",
        ),
        ("limits__calm", 1.0, "limits: unknown key 'calm'"),
        ("policy__network__sizes", [8, 9], "policy: network: .*shape"),
        ("policy", {}, "policy: field 'format' is missing"),
    ],
)
def test_a_wrong_field_of_a_shield_is_named(field, value, message, tmp_path):
    path = tmp_path / "agent.json"
    POLICIES["shielded"].save(path)
    edited(path, field, "LQ" if value is POLICIES else value)
    with pytest.raises(InputError, match=message) as caught:
        load_agent(path)
    assert str(caught.value).startswith(str(path))


def test_a_shield_of_an_older_file_knows_of_no_planned_turns(tmp_path):
    path = tmp_path / "agent.json"
    POLICIES["shielded"].save(path)
    edited(path, "limits__turn_lengths", None)
    edited(path, "dt", 0.05)
    found = load_agent(path)
    assert (found.limits.turn_lengths, found.limits.runaway_deg, found.dt) == (
        0.0,
        12.0,
        0.05,
    )
    edited(path, "limits__calm_lengths", None)
    with pytest.raises(InputError, match=r"limits\.calm_lengths: expected a number"):
        load_agent(path)


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
    for name in ("plain", "residual", "shielded pid"):
        POLICIES[name].save(tmp_path / "agent.json")
        with pytest.raises(
            InputError,
            match=r"model 'mariner': the scale of 'yaw_rate' is 0\.0248.* 0\.0479",
        ):
            load_agent(tmp_path / "agent.json", mariner(service_speed=4.0))


def test_what_is_loaded_passes_the_conformance_suite(tmp_path):
    POLICIES["twice"].save(tmp_path / "agent.json")
    check_controller(load_agent(tmp_path / "agent.json"), MARINER, n_steps=5)
    assert isinstance(load_agent(tmp_path / "agent.json").fallback, LQ)


def test_older_files_are_read_and_a_run_s_folder_names_its_agent(tmp_path):
    for name, repeats in (("plain", None), ("residual", 2)):
        POLICIES[name].save(tmp_path / "agent.json")
        content = json.loads((tmp_path / "agent.json").read_text())
        content["history"] = content.pop("frame_stack")
        assert content.pop("action_repeat") == (repeats or 1)
        assert content.pop("rate_limit") == 2.0
        content |= {} if repeats is None else {"hold": repeats}
        (tmp_path / "agent.json").write_text(json.dumps(content))
        np.testing.assert_array_equal(
            steered(load_agent(tmp_path)), steered(POLICIES[name])
        )
