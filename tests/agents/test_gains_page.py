"""An autopilot written after docs/deployment.md alone does what the controller does."""

import json
import math
import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import LQ, PID
from tests.agents.policies import MARINER

PAGE = (Path(__file__).parents[2] / "docs" / "deployment.md").read_text(encoding="utf-8")
SECTION = PAGE.partition("## Gains")[2].partition("\n## ")[0]


class ByHand:
    """The four steps of the page."""

    def __init__(self, path):
        self.file = json.loads(path.read_text())
        scales = dict(zip(self.file["observation_names"], self.file["observation_scales"], strict=True))
        self.limit, self.bound = scales["rudder"], scales["heading_error_integral"]
        self.integral, self.first = 0.0, True

    def step(self, set_point, heading, yaw_rate, sway, rudder):
        gains, neutral = self.file["gains"], self.file["neutral_rudder"]
        error = (set_point - heading + math.pi) % (2.0 * math.pi) - math.pi
        if not self.first and abs(error) <= math.radians(10.0):
            self.integral += error * self.file["design"]["dt"]
        self.first, self.integral = False, max(-self.bound, min(self.bound, self.integral))
        if self.file["kind"] == "pid":
            order = (
                neutral + gains["proportional"] * error + gains["integral"] * self.integral
                - gains["derivative"] * yaw_rate
            )  # fmt: skip
        else:
            order = (
                neutral + gains["heading_error"] * error + gains["heading_error_integral"] * self.integral
                + gains["yaw_rate"] * yaw_rate + gains["sway"] * (sway - self.file["neutral_sway"])
                + gains["rudder"] * (rudder - neutral)
            )  # fmt: skip
        return max(-self.limit, min(self.limit, order))


@pytest.mark.parametrize("design", [PID, LQ])
def test_it_commands_what_the_controller_commands(design, tmp_path):
    controller = design.from_model(MARINER)
    controller.save(tmp_path / "it.json")
    by_hand = ByHand(tmp_path / "it.json")
    env = gym.make("shipgym/CourseKeeping-v0", model="mariner")
    seen, _ = env.reset(seed=5)
    for _ in range(80):
        values = dict(zip(controller.observation_names, seen * controller.observation_scales, strict=True))
        set_point = np.arctan2(values["heading_error_sin"], values["heading_error_cos"])
        order = by_hand.step(set_point, 0.0, values["yaw_rate"], values["sway"], values["rudder"])
        action, _ = controller.predict(seen)
        assert order / by_hand.limit == pytest.approx(action[0], abs=2e-5)  # observations are single
        seen, *_ = env.step(action)


@pytest.mark.parametrize("design", [PID, LQ])
def test_every_field_is_described(design):
    described = set(re.findall(r"`(\w+)`", SECTION))
    content = design.from_model(MARINER).to_dict()
    assert {*content, *content["gains"], *content["margins"], "dt"} <= described
