"""Policies with weights at random, for tests."""

from itertools import pairwise

import numpy as np

from agents import LearnedPolicy
from agents.policies.network import Layer, Network
from shipgym.models import load_model
from shipgym.tasks.scales import OBSERVATION_NAMES, observation_scales

MARINER = load_model("mariner")


def random_network(*sizes, seed=0, activation="relu", output="linear"):
    random = np.random.default_rng(seed)
    layers = []
    for n_in, n_out in pairwise(sizes):
        weight = random.normal(0.0, n_in**-0.5, (n_out, n_in))
        bias = random.normal(0.0, 0.1, n_out)
        layers.append(Layer(weight.astype(np.float32), bias.astype(np.float32)))
    return Network(tuple(layers), activation, output)


def random_policy(model=MARINER, seed=0, **more):
    """Of course keeping, with hidden layers of 16."""
    inputs = max(more.get("frame_stack", 1), 1) * 8 + ("base" in more)
    outputs = {"rudder-discrete": 9, "rudder-shaft": 2}.get(more.get("action"), 1)
    given = {
        "network": random_network(inputs, 16, 16, outputs, seed=seed),
        "observation_names": OBSERVATION_NAMES,
        "observation_scales": tuple(observation_scales(model).tolist()),
        "model_name": model.name,
    }
    return LearnedPolicy(**(given | more))
