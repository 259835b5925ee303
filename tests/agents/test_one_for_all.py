"""One agent for all ships: what it is told, and what is made of it for a ship."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fleet import Pilots

from agents.agent_file import load_agent, read_agent
from agents.benchmarking.contestants import contestants
from agents.controllers.wheel_over import WheelOver, own_lead
from agents.policies.one_for_all import (
    CONTEXT,
    ONE_FOR_ALL,
    OneForAll,
    base_for,
    context,
)
from agents.suites.suite import load_suite
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.ships.linear import steering_state_space
from shipgym.ships.scaling import scale_model
from shipgym.tasks.task import Task
from tests.agents.policies import random_network

SHIP, TASK = load_model("container-abc-lssvr"), Task.of("PathFollowing-v1")
TOLD = context(SHIP, TASK)
OBSERVED = TASK.observed(SHIP)
N_SEEN = len(OBSERVED) + 1  # and the base's action
AGENT = OneForAll(
    random_network(N_SEEN + len(CONTEXT), 16, 1),
    tuple(one.name for one in OBSERVED),
    np.stack([TOLD + 0.5, np.full(12, 2.0), TOLD - 1.0, TOLD + 1.0], axis=1),
    decision=0.4,
    authority=0.5,
)
SEEN = (
    np.random.default_rng(1).uniform(-0.5, 0.5, (5, len(OBSERVED))).astype(np.float32)
)


def mirrored(model):
    """The ship's mirror image: in surge terms odd in sway, yaw and rudder change sign, else even ones."""
    table, coefficients = model.dynamics, dict(model.coefficients)
    for equation in table.equations:
        for name, term in zip(
            table.names(equation), table.terms(equation), strict=True
        ):
            odd = term.power("v", "r", "delta") % 2 == 1
            coefficients[name] *= -1.0 if odd == (equation == "u") else 1.0
    return replace(model, coefficients=coefficients)


@pytest.mark.parametrize("similar", [lambda ship: scale_model(ship, 7.0), mirrored])
def test_context_is_that_of_a_ship_scaled_by_froudes_law_or_mirrored(similar):
    assert context(similar(SHIP), TASK) == pytest.approx(TOLD, rel=2e-3)


def test_context_is_the_prime_linear_dynamics():
    told = dict(zip(CONTEXT, TOLD, strict=True))
    mariner = dict(
        zip(
            CONTEXT,
            context(load_model("mariner"), TASK.changed(corridor=0.5)),
            strict=True,
        )
    )
    assert told["rudder_limit"] == pytest.approx(np.radians(35.0))
    assert (told["path_radius"], told["corridor"], mariner["corridor"]) == (
        4.0,
        1.0,
        0.5,
    )
    assert mariner["rudder_gain"] / mariner["stability"] == pytest.approx(
        3.854, abs=1e-3
    )  # Nomoto's K'
    tanker = dict(zip(CONTEXT, context(load_model("tanker"), TASK), strict=True))
    assert tanker["stability"] < 0.0  # unstable on her course
    assert (
        tanker["drift"] < 0.0
    )  # the bow turns into the turn: sway to port in a turn to starboard
    A, B = steering_state_space(SHIP)
    (sway, rate), p = np.linalg.solve(A, -B[:, 0]), SHIP.particulars
    assert told["drift"] == pytest.approx(sway / rate / p["length"])
    gear, time = SHIP.steering, p["length"] / p["speed"]
    assert told["gear_rate"] == pytest.approx(
        gear.rudder_rate_deg_s * time / gear.rudder_limit_deg
    )


def test_policy_of_a_ship_is_the_network_told_her_context():
    policy = AGENT.for_ship(SHIP)
    base, _ = policy.base.predict(SEEN)
    inputs = np.concatenate(
        [SEEN, base, np.tile(AGENT.inputs(TOLD), (5, 1))], axis=1
    ).astype(np.float32)
    expected = np.clip(
        base + 0.5 * np.clip(AGENT.network(inputs), -1.0, 1.0), -1.0, 1.0
    )
    action, _ = policy.predict(SEEN)
    assert action == pytest.approx(expected, abs=1e-5)
    assert policy.base.kind == "wheel-over"
    assert (
        policy.action_repeat == 8
    )  # 0.4 of 20.9 s for a ship length, in intervals of 1 s
    assert AGENT.for_ship(scale_model(SHIP, 7.0)).action_repeat == pytest.approx(
        0.4 * 7.0 / 1.68 / 0.2, abs=0.5
    )


def test_what_it_is_told_is_in_deviations_from_the_fleets_mean_and_within_three():
    assert AGENT.inputs(TOLD) == pytest.approx(
        -0.25
    )  # the mean half above, a deviation of two
    assert AGENT.inputs(np.stack([TOLD + 100.0, TOLD - 100.0])).tolist() == [
        [3.0] * 12,
        [-3.0] * 12,
    ]


def test_file_holds_all_of_it(tmp_path):
    AGENT.save(tmp_path / "all.json")
    found = read_agent(tmp_path / "all.json")
    assert found.fleet.tolist() == AGENT.fleet.tolist()
    for agent in (found.for_ship(SHIP), load_agent(tmp_path / "all.json", SHIP)):
        assert (
            agent.predict(SEEN)[0].tolist()
            == AGENT.for_ship(SHIP).predict(SEEN)[0].tolist()
        )
    with pytest.raises(InputError, match="give her model"):
        load_agent(tmp_path / "all.json")
    text = (tmp_path / "all.json").read_text()
    (tmp_path / "all.json").write_text(text.replace('"drift"', '"drifts"'))
    with pytest.raises(InputError, match=r"context: unknown key 'drifts'.*'drift'"):
        read_agent(tmp_path / "all.json")


def test_a_ship_outside_the_fleet_is_told_and_one_far_outside_refused():
    sluggish = replace(
        SHIP, steering=replace(SHIP.steering, rudder_limit_deg=35.0, time_constant=27.0)
    )
    policy, inside = AGENT.for_ship(sluggish), AGENT.for_ship(SHIP)
    assert policy.training["outside"] == {"gear_lag": pytest.approx(0.12, abs=0.02)}
    assert policy.authority == pytest.approx(
        0.5 * (1.0 - policy.training["outside"]["gear_lag"] / 0.2)
    )
    assert (inside.training["outside"], inside.authority) == ({}, 0.5)
    dead = replace(SHIP, steering=replace(SHIP.steering, time_constant=60.0))
    with pytest.raises(
        InputError,
        match=r"gear_lag 2.87 found, one-for-all was trained on .* take wheel-over",
    ):
        AGENT.for_ship(dead)


def test_paths_of_version_0_are_refused():
    with pytest.raises(InputError, match="one-for-all on 'PathFollowing'"):
        AGENT.for_ship(SHIP, Task.of("PathFollowing"))


def test_the_shipped_one_is_made_for_the_model_of_a_task():
    (one,), task = (
        contestants(ONE_FOR_ALL),
        load_suite("shipgym-v2").task("failing-gear"),
    )
    (policy,) = one.policies(task, "shipgym-v2")
    file = Path(next(iter(one.fingerprint(task))))
    assert (
        file.stat().st_size + file.with_suffix(".safetensors").stat().st_size < 300_000
    )
    assert (policy.model_name, policy.name) == ("container-abc-lssvr", ONE_FOR_ALL)


def test_the_shipped_one_is_the_best_on_the_fleet_held_out():
    agent = read_agent(ONE_FOR_ALL)
    runs = [run["validation"] for run in agent.training["runs"]]
    assert agent.training["validation"] <= min(
        runs
    )  # in costs of the rule without a network
    assert not any("mariner" in name for name in agent.training["fleet"]["models"])


def test_the_base_follows_the_rule_for_its_path():
    rule = {
        "lookahead": 2.0,
        "lookahead_power": 1.0,
        "crab_share": 0.5,
        "rudder_weight": 4.0,
    }
    rule |= {"integral": 2.0, "rate_weight": 3.0, "reach": 0.5}
    narrow = TASK.changed(corridor=0.25)
    plain, ruled = (base_for(SHIP, narrow, one) for one in ({}, rule))
    assert plain.gains == WheelOver.from_model(SHIP, task=narrow).gains
    assert ruled.gains["lookahead"] == pytest.approx(
        plain.gains["lookahead"] * 2.0 * 0.25
    )
    assert ruled.gains["crab_share"] == 0.5
    ours, own = ruled.autopilot.design, plain.autopilot.design
    assert ours["rudder_weight"] == 4.0 * own["rudder_weight"]
    assert (ours["integral_lengths"], own["integral_lengths"]) == (40.0, 20.0)
    assert ours["rate_weight_s2"] == 3.0 * own["rate_weight_s2"]
    lead = own_lead(SHIP, ruled.autopilot) * SHIP.particulars["length"]
    assert ruled.gains["turn_reach"] == pytest.approx(0.5 * lead)
    assert (
        base_for(SHIP, narrow, {"crab_share": 9.0}).gains["crab_share"] == 2.0
    )  # at most
    wide = TASK.changed(corridor=3.0)
    plain, ruled = (base_for(SHIP, wide, one) for one in ({}, rule))
    assert ruled.gains["lookahead"] == pytest.approx(plain.gains["lookahead"] * 2.0)


def test_pilots_asked_at_once_steer_as_each_alone():
    ships = [
        load_model(name)
        for name in ("container-abc-lssvr", "container-4dof-output-error")
    ]
    pilots = [base_for(ship, TASK, {}) for ship in ships]
    on_course = np.array(
        [[1.0 if one.name.endswith("_cos") else 0.0 for one in OBSERVED]] * 2
    )
    on_course[:, [one.name for one in OBSERVED].index("yaw_rate")] = 0.01, -0.02
    actions, _ = Pilots(pilots).predict(on_course)
    for seen, pilot, action in zip(on_course, pilots, actions, strict=True):
        assert np.abs(action) < 1.0
        assert pilot.predict(seen[None])[0][0] == pytest.approx(action, abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"rule": {"speed": 1.0}}, "unknown"),
        ({"rule": {"reach": 0.00099}}, "rule.reach: expected .*got 0.00099"),
        ({"rule": {"reach": 1001.0}}, "rule.reach: expected .*got 1001"),
        ({"rule": {"reach_power": -4.1}}, "rule.reach_power: expected .*got -4.1"),
        ({"decision": 0.0}, "decision: expected .*got 0"),
        ({"authority": 0.0}, "authority: expected .*got 0"),
        (
            {"fleet": AGENT.fleet * [1.0, 0.0, 1.0, 1.0]},
            r"context.damping\[1\]: expected .*got 0",
        ),
        (
            {"fleet": AGENT.fleet[:, [0, 1, 2, 2]]},
            r"context.damping\[3\]: expected a number > ",
        ),
        (
            {"observation_names": ("yaw_rate",)},
            r"network: sizes .* found, expected 14 inputs and 1 output",
        ),
    ],
)
def test_settings_beyond_their_bounds_are_refused(changes, why):
    within = {"rule": {"reach": 1e-3, "integral": 1e3, "reach_power": -4.0}}
    assert (
        replace(AGENT, **within, decision=0.01, authority=0.01)
        .for_ship(SHIP)
        .action_repeat
        == 1
    )
    with pytest.raises(InputError, match=why):
        replace(AGENT, **changes)
