"""The ONNX graph commands what the policy does, for any number of ships."""

import json

import numpy as np
import onnxruntime
import pytest
from typer.testing import CliRunner

from agents import LQ
from agents.cli import app
from agents.policies.onnx_export import onnx_model
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


def opened(policy):
    """Session of a policy's graph."""
    graph = onnx_model(policy).SerializeToString()
    return onnxruntime.InferenceSession(graph, providers=["CPUExecutionProvider"])


@pytest.mark.parametrize("name", POLICIES)
def test_the_graph_commands_what_the_policy_does(name):
    policy = POLICIES[name]
    session = opened(policy)
    random = np.random.default_rng(0)
    for n in (1, 64):
        state, base_state, past = None, None, None
        for step in range(4):
            seen = random.uniform(-1.0, 1.0, (n, 8)).astype(np.float32)
            expected, state = policy.predict(seen, state, np.full(n, step == 0))
            past = [seen] * policy.frame_stack if past is None else [*past[1:], seen]
            inputs = {"observations": np.concatenate(past, axis=1)}
            if policy.base is not None:
                base_action, base_state = policy.base.predict(seen, base_state)
                inputs["base_action"] = base_action
            (action,) = session.run(["action"], inputs)
            np.testing.assert_allclose(action, expected, rtol=0.0, atol=1e-6)
            if policy.base is not None:
                base_state = policy.base.after_order(base_state, expected)


def test_the_metadata_say_what_it_observes():
    policy = POLICIES["residual"]
    texts = opened(policy).get_modelmeta().custom_metadata_map
    found = {key: json.loads(text) for key, text in texts.items()}
    assert tuple(found["observation_names"]) == policy.observation_names
    assert tuple(found["observation_scales"]) == policy.observation_scales
    assert found["model"] == {"name": "mariner", "sha256": policy.model_sha256}
    assert found["environment"]["id"] == "shipgym/CourseKeeping-v0"
    assert found["frame_stack"] == 2
    assert found["authority"] == 0.6
    assert found["base"]["kind"] == "lq"
    assert not found.keys() & {"training", "network", "format", "kind"}


def test_the_command_writes_it(tmp_path):
    POLICIES["relu"].save(tmp_path / "ppo.json")
    LQ_MARINER.save(tmp_path / "lq.json")
    for name, exit_code in (("ppo", 0), ("lq", 2)):
        files = [str(tmp_path / f"{name}.{end}") for end in ("json", "onnx")]
        result = CliRunner().invoke(app, ["export", files[0], "--onnx", files[1]])
        assert result.exit_code == exit_code, result.output
    assert (tmp_path / "ppo.onnx").stat().st_size < 10_000
    assert not (tmp_path / "lq.onnx").exists()
