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

PAGE = (Path(__file__).parents[2] / "docs" / "deployment.md").read_text(
    encoding="utf-8"
)
SECTION = PAGE.partition("## Gains")[2].partition("\n## ")[0]


class ByHand:
    """The four steps of the page."""

    def __init__(self, content):
        self.file = json.loads(json.dumps(content))
        scales = dict(
            zip(
                self.file["observation_names"],
                self.file["observation_scales"],
                strict=True,
            )
        )
        self.limit, self.bound = scales["rudder"], scales["heading_error_integral"]
        self.speed = scales["surge"]
        self.integral, self.first = 0.0, True
        self.rudder, self.smooth = -self.file["neutral_rudder"], 0.0

    def step(self, set_point, heading, yaw_rate, sway, surge):
        gains, neutral = self.file["gains"], self.file["neutral_rudder"]
        slowness = self.speed / min(max(surge, self.speed / 4.0), 2.0 * self.speed)
        error = (set_point - heading + math.pi) % (2.0 * math.pi) - math.pi
        if not self.first and abs(error) <= math.radians(10.0):
            self.integral += error * self.file["design"]["dt"]
        self.integral = max(-self.bound, min(self.bound, self.integral))
        if self.file["kind"] == "pid":
            asked = (
                gains["proportional"] * error
                + gains["integral"] / slowness * self.integral
                - gains["derivative"] * slowness * yaw_rate
            )
        else:
            asked = (
                gains["heading_error"] * error
                + gains["heading_error_integral"] / slowness * self.integral
                + gains["yaw_rate"] * slowness * yaw_rate
                + gains["sway"] * slowness * (sway - self.file["neutral_sway"])
                + gains["rudder"] * self.rudder
            )
        share = 1.0 if self.first else gains["rudder_update"]
        self.smooth += share * (asked - self.smooth)
        self.first = False
        order = max(-self.limit, min(self.limit, neutral + self.smooth))
        way = gains["gear_share"] * (order - neutral - self.rudder)
        self.rudder += max(-gains["gear_step"], min(gains["gear_step"], way))
        return order


@pytest.mark.parametrize("design", [PID, LQ])
def test_it_commands_what_the_controller_commands(design):
    controller = design.from_model(MARINER)
    by_hand = ByHand(controller.to_dict())
    env = gym.make("shipgym/CourseKeeping-v0", model="mariner")
    seen, _ = env.reset(seed=5)
    state = None
    for _ in range(80):
        values = dict(
            zip(
                controller.observation_names,
                seen * controller.observation_scales,
                strict=True,
            )
        )
        set_point = np.arctan2(values["heading_error_sin"], values["heading_error_cos"])
        order = by_hand.step(
            set_point, 0.0, values["yaw_rate"], values["sway"], values["surge"]
        )
        action, state = controller.predict(seen, state)
        assert order / by_hand.limit == pytest.approx(
            action[0], abs=2e-5
        )  # observations are single
        seen, *_ = env.step(action)


@pytest.mark.parametrize("design", [PID, LQ])
def test_every_field_is_described(design):
    described = set(re.findall(r"`(\w+)`", SECTION))
    content = design.from_model(MARINER).to_dict()
    assert {*content, *content["gains"], *content["margins"], "dt"} <= described
