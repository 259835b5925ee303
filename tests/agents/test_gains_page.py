"""An autopilot written after docs/deployment.md alone does what the controller does."""

import json
import math
import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import LQ, PID, PreviewLQ, WheelOver
from shipgym.tasks.task import Task
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


def between(x, points, values):
    """On straight lines, that of the nearest beyond them."""
    k = max(j for j, point in enumerate(points) if point <= max(x, points[0]))
    if k == len(points) - 1:
        return values[-1]
    share = (max(x, points[0]) - points[k]) / (points[k + 1] - points[k])
    return values[k] + share * (values[k + 1] - values[k])


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


class SeenCurrent:
    """The current by steps 1 to 4 of the page."""

    def __init__(self, gains):
        self.gains, self.before = gains, None
        self.ahead = self.aside = 0.0
        self.is_known = False

    def see(self, given):
        gains, side = self.gains, 0.0
        off = wrap(given["set_point"] - given["heading"])
        over = wrap(given["course"] - given["set_point"])
        x = given["surge"] * math.cos(off) + given["sway"] * math.sin(off)
        y = given["sway"] * math.cos(off) - given["surge"] * math.sin(off)
        distance, angle = given["next_turn_distance"], given["next_turn_angle"]
        passed, turned = 0.0, 0.0
        first = self.before is None
        if not first:
            was, angle_before = self.before
            side = math.copysign(1.0, angle_before)
            swept = angle_before - angle
            arc = side * swept * (gains["path_radius"] - side * given["cross_track"])
            same_side = angle * angle_before > 0.0
            last = angle == angle_before == 0.0
            on_arc = distance <= 0.0 and same_side and side * swept > 0.0
            if on_arc and arc < 2.0 * gains["service_speed"] * gains["interval"]:
                turned = swept
                passed = arc if was <= 0.0 else 0.0
            elif distance > 0.0 and (last or (same_side and abs(swept) < 0.001)):
                passed = was - distance if was < gains["sight"] else 0.0
            elif was <= 0.0:
                turned = angle_before
        self.turn(turned)
        self.before = distance, angle

        speed = passed / gains["interval"]
        along = abs(over) < 1.2
        seen = along and 0.2 < speed / gains["service_speed"] < 2.0
        v = speed if seen else x + self.ahead
        most = 2.0 * gains["service_speed"]
        ahead = max(-most, min(most, v - x))
        aside = max(-most, min(most, v * math.tan(over) - y)) if along else self.aside
        share = gains["current_update"]
        if first or (seen and not self.is_known):
            share = 1.0
        self.is_known = self.is_known or seen
        self.ahead += share * (ahead - self.ahead)
        self.aside += share * (aside - self.aside)

    def turn(self, angle):
        cosine, sine = math.cos(angle), math.sin(angle)
        self.ahead, self.aside = (
            self.ahead * cosine + self.aside * sine,
            self.aside * cosine - self.ahead * sine,
        )


def weighed_course(given, gains):
    """The course by step 5 of the page."""
    knots = gains["reach"] * np.array([0.0, 0.1, 0.2, 0.3, 0.6, 1.0])
    weights = [*[gains[f"weight_{number}"] for number in range(5)], 0.0]

    def summed(to):
        points = np.append(knots[knots < to], to)
        return np.trapezoid(np.interp(points, knots, weights), points)

    course = -math.atan(given["cross_track"] / gains["lookahead"])
    for one in ("next", "second"):
        angle = given[f"{one}_turn_angle"]
        begin = max(0.0, given[f"{one}_turn_distance"])
        end = begin + gains["path_radius"] * abs(angle)
        turned = (summed(end) - summed(begin)) / gains["path_radius"]
        course += math.copysign(turned, angle)
    return course


def test_lq_with_preview_is_what_the_page_says():
    agent = PreviewLQ.from_model(MARINER, task=Task.of("PathFollowing"))
    random = np.random.default_rng(1)
    bridge, gains, integral = Bridge(agent), agent.gains, 0.0
    helm = json.loads(json.dumps(agent.to_dict()))["autopilot"]
    of, neutral, limit = helm["gains"], helm["neutral_rudder"], MARINER.steering.limit
    current = SeenCurrent(gains)
    step_m = 7.0 * gains["interval"]
    for step in range(300):
        given = {name: random.normal(0.0, 0.05) for name in bridge.inputs}
        to_go = 600.0 - step_m * step  # to the turn, and along it
        left = max(0.0, 1.0 - max(0.0, -to_go) / gains["path_radius"])
        if left == 0.0:  # behind it, the next one is to the other side
            to_go, left = to_go + 2500.0, -0.5
        if step >= 200:  # the last leg
            to_go, left = 9000.0 - step_m * step, 0.0
        given |= {
            "surge": 7.5 + given["surge"],
            "cross_track": 1000.0 * given["cross_track"],
            "next_turn_distance": to_go,
            "next_turn_angle": left,
            "second_turn_distance": to_go + 900.0,
            "second_turn_angle": -0.5,
        }
        current.see(given)
        course = weighed_course(given, gains)
        across = current.aside * math.cos(course) - current.ahead * math.sin(course)
        speed = max(given["surge"], 0.25 * gains["service_speed"])
        crab = math.asin(max(-0.8, min(0.8, across / speed)))
        off = given["set_point"] - given["heading"]
        error = wrap(off + course - gains["crab_share"] * crab)
        if step and abs(error) <= math.radians(10.0):
            integral += error * helm["design"]["dt"]

        order = neutral + of["heading_error"] * error
        order += of["heading_error_integral"] * integral
        order += of["yaw_rate"] * given["yaw_rate"]
        order += of["sway"] * (given["sway"] - helm["neutral_sway"])
        order += of["rudder"] * (given["rudder"] - neutral)
        within = max(-limit, min(limit, order))
        assert bridge.step(given) == pytest.approx(within, abs=1e-9)
    assert current.is_known
