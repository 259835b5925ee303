"""An autopilot written after docs/deployment.md alone does what the controller does."""

import json
import math
import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import LQ, PID, WheelOver
from shipgym.tasks import Task
from tests.agents.bridge import Bridge
from tests.agents.policies import MARINER

PAGE = (Path(__file__).parents[2] / "docs" / "deployment.md").read_text(
    encoding="utf-8"
)
SECTION = PAGE.partition("## Gains")[2].partition("\n## ")[0]


class ByHand:
    """The four steps of the page."""

    def __init__(self, path):
        self.file = json.loads(path.read_text())
        scales = dict(
            zip(
                self.file["observation_names"],
                self.file["observation_scales"],
                strict=True,
            )
        )
        self.limit, self.bound = scales["rudder"], scales["heading_error_integral"]
        self.integral, self.first = 0.0, True

    def step(self, set_point, heading, yaw_rate, sway, rudder):
        gains, neutral = self.file["gains"], self.file["neutral_rudder"]
        error = (set_point - heading + math.pi) % (2.0 * math.pi) - math.pi
        if not self.first and abs(error) <= math.radians(10.0):
            self.integral += error * self.file["design"]["dt"]
        self.first, self.integral = (
            False,
            max(-self.bound, min(self.bound, self.integral)),
        )
        if self.file["kind"] == "pid":
            order = (
                neutral
                + gains["proportional"] * error
                + gains["integral"] * self.integral
                - gains["derivative"] * yaw_rate
            )
        else:
            order = (
                neutral
                + gains["heading_error"] * error
                + gains["heading_error_integral"] * self.integral
                + gains["yaw_rate"] * yaw_rate
                + gains["sway"] * (sway - self.file["neutral_sway"])
                + gains["rudder"] * (rudder - neutral)
            )
        return max(-self.limit, min(self.limit, order))


@pytest.mark.parametrize("design", [PID, LQ])
def test_it_commands_what_the_controller_commands(design, tmp_path):
    controller = design.from_model(MARINER)
    controller.save(tmp_path / "it.json")
    by_hand = ByHand(tmp_path / "it.json")
    env = gym.make("shipgym/CourseKeeping-v0", model="mariner")
    seen, _ = env.reset(seed=5)
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
            set_point, 0.0, values["yaw_rate"], values["sway"], values["rudder"]
        )
        action, _ = controller.predict(seen)
        assert order / by_hand.limit == pytest.approx(
            action[0], abs=2e-5
        )  # observations are single
        seen, *_ = env.step(action)


@pytest.mark.parametrize("design", [PID, LQ])
def test_every_field_is_described(design):
    described = set(re.findall(r"`(\w+)`", SECTION))
    content = design.from_model(MARINER).to_dict()
    assert {*content, *content["gains"], *content["margins"], "dt"} <= described


def wrap(angle):
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def test_wheel_over_is_what_the_page_says():
    agent, random = (
        WheelOver.from_model(MARINER, task=Task.of("PathFollowing")),
        np.random.default_rng(1),
    )
    bridge, gains, integral = Bridge(agent), agent.gains, 0.0
    helm = json.loads(json.dumps(agent.to_dict()))["autopilot"]
    sizes = {
        "surge": 1.0,
        "sway": 0.3,
        "cross_track": 80.0,
        "next_turn_distance": 300.0,
    }
    for step in range(300):
        given = {
            name: random.normal(0.0, sizes.get(name, 0.05)) for name in bridge.inputs
        }
        given |= {
            "surge": 7.5 + given["surge"],
            "second_turn_distance": 900.0,
            "second_turn_angle": -0.5,
        }
        crab = wrap(
            given["course"]
            - given["heading"]
            - math.atan2(given["sway"], given["surge"])
        )
        bend = 0.0
        for one in ("next", "second"):
            angle, ahead = (
                given[f"{one}_turn_angle"],
                gains["turn_reach"] - given[f"{one}_turn_distance"],
            )
            bend += math.copysign(
                max(0.0, min(abs(angle), ahead / gains["path_radius"])), angle
            )
        wanted = (
            given["set_point"]
            - math.atan(given["cross_track"] / gains["lookahead"])
            + bend
        )
        error = wrap(wanted - gains["crab_share"] * crab - given["heading"])
        integral += (
            error * helm["design"]["dt"]
            if step and abs(error) <= math.radians(10.0)
            else 0.0
        )
        of, neutral = helm["gains"], helm["neutral_rudder"]
        order = (
            neutral
            + of["heading_error"] * error
            + of["heading_error_integral"] * integral
        )
        order += of["yaw_rate"] * given["yaw_rate"] + of["sway"] * (
            given["sway"] - helm["neutral_sway"]
        )
        order += of["rudder"] * (given["rudder"] - neutral)
        limit = MARINER.steering.limit
        assert bridge.step(given) == pytest.approx(
            max(-limit, min(limit, order)), abs=1e-9
        )
