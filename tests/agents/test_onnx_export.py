"""The ONNX graph commands what the policy does, for any number of ships."""

import json
import sys

import numpy as np
import onnx
import onnxruntime
import pytest
from typer.testing import CliRunner

from agents import LQ
from agents.cli import app
from agents.policies.onnx_export import export_onnx, onnx_model
from shipgym.errors import InputError
from tests.agents.policies import MARINER, random_network, random_policy

LQ_MARINER = LQ.from_model(MARINER)
POLICIES = {
    "relu": random_policy(),
    "tanh": random_policy(
        network=random_network(8, 16, 1, activation="tanh", output="tanh")
    ),
    "discrete": random_policy(action="rudder-discrete"),
    "shaft": random_policy(action="rudder-shaft"),
    "frame_stack": random_policy(frame_stack=3),
    "residual": random_policy(base=LQ_MARINER, authority=0.6, frame_stack=2),
}
HELD = random_policy(base=LQ_MARINER, authority=0.6, action_repeat=2)


@pytest.mark.parametrize("name", POLICIES)
def test_the_graph_commands_what_the_policy_does(name, tmp_path):
    policy = POLICIES[name]
    export_onnx(policy, tmp_path / "policy.onnx")
    session = onnxruntime.InferenceSession(
        tmp_path / "policy.onnx", providers=["CPUExecutionProvider"]
    )
    random = np.random.default_rng(0)
    for n in (1, 64):
        state, past = None, None
        for step in range(4):
            seen = random.uniform(-1.0, 1.0, (n, 8)).astype(np.float32)
            expected, state = policy.predict(seen, state, np.full(n, step == 0))
            past = [seen] * policy.frame_stack if past is None else [*past[1:], seen]
            inputs = {"observations": np.concatenate(past, axis=1)}
            if policy.base is not None:
                inputs["base_action"] = policy.base.predict(seen)[0]
            (action,) = session.run(["action"], inputs)
            np.testing.assert_allclose(action, expected, rtol=0.0, atol=1e-6)


def test_between_decisions_the_part_of_the_last_one_is_added_to_the_base(tmp_path):
    export_onnx(HELD, tmp_path / "policy.onnx")
    session = onnxruntime.InferenceSession(
        tmp_path / "policy.onnx", providers=["CPUExecutionProvider"]
    )
    repeat = json.loads(session.get_modelmeta().custom_metadata_map["action_repeat"])
    random, state, part = np.random.default_rng(0), None, None
    for step in range(5):
        seen = random.uniform(-1.0, 1.0, (3, 8)).astype(np.float32)
        expected, state = HELD.predict(seen, state, np.full(3, step == 0))
        base = LQ_MARINER.predict(seen)[0]
        if step % repeat == 0:
            (part,) = session.run(["part"], {"observations": seen, "base_action": base})
        np.testing.assert_allclose(
            np.clip(base + part, -1.0, 1.0), expected, rtol=0.0, atol=1e-6
        )


def test_the_metadata_say_what_it_observes(tmp_path):
    policy = POLICIES["residual"]
    export_onnx(policy, tmp_path / "policy.onnx")
    session = onnxruntime.InferenceSession(
        tmp_path / "policy.onnx", providers=["CPUExecutionProvider"]
    )
    found = {
        key: json.loads(text)
        for key, text in session.get_modelmeta().custom_metadata_map.items()
    }
    assert tuple(found["observation_names"]) == policy.observation_names
    assert tuple(found["observation_scales"]) == policy.observation_scales
    assert found["model"] == {"name": "mariner", "sha256": policy.model_sha256}
    assert found["environment"]["id"] == "shipgym/CourseKeeping-v0"
    assert (found["frame_stack"], found["authority"], found["base"]["kind"]) == (
        2,
        0.6,
        "lq",
    )
    assert found["action_repeat"] == 1
    assert not found.keys() & {"training", "network", "format", "kind"}


def test_what_runs_on_ships_need_not_be_new():
    """Runtimes of 2022 read the operators of opset 17 in files of version 8."""
    model = onnx_model(HELD)
    assert [(one.domain, one.version) for one in model.opset_import] == [("", 17)]
    assert (model.ir_version, model.producer_name) == (8, "shipgym")


def test_operators_have_the_attributes_that_all_runtimes_know():
    told = {
        (node.op_type, one.name, one.i)
        for name in ("residual", "discrete")
        for node in onnx_model(POLICIES[name]).graph.node
        for one in node.attribute
    }
    assert told == {
        ("Concat", "axis", 1),
        ("Gemm", "transB", 1),
        ("ArgMax", "axis", 1),
        ("ArgMax", "keepdims", 1),
        ("Gather", "axis", 0),
    }


def test_a_graph_that_onnx_refuses_is_not_written(tmp_path, monkeypatch):
    def refused(model, full_check):
        raise onnx.checker.ValidationError("no such operator" if full_check else "")

    monkeypatch.setattr(onnx.checker, "check_model", refused)
    with pytest.raises(onnx.checker.ValidationError, match="no such operator"):
        export_onnx(POLICIES["relu"], tmp_path / "policy.onnx")
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_it(tmp_path):
    POLICIES["relu"].save(tmp_path / "ppo.json")
    result = CliRunner().invoke(
        app,
        ["export", str(tmp_path / "ppo.json"), "--onnx", str(tmp_path / "ppo.onnx")],
    )
    assert result.exit_code == 0, result.output
    assert (tmp_path / "ppo.onnx").stat().st_size < 10_000
    LQ_MARINER.save(tmp_path / "lq.json")
    result = CliRunner().invoke(
        app, ["export", str(tmp_path / "lq.json"), "--onnx", str(tmp_path / "lq.onnx")]
    )
    assert result.exit_code == 2
    assert not (tmp_path / "lq.onnx").exists()


def test_what_is_no_network_is_refused(tmp_path):
    with pytest.raises(InputError, match="policy: LQ found, expected a learned policy"):
        export_onnx(LQ_MARINER, tmp_path / "policy.onnx")


def test_without_onnx_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(InputError, match=r"pip install 'shipgym\[onnx\]'"):
        export_onnx(POLICIES["relu"], tmp_path / "policy.onnx")
