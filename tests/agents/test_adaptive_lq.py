"""Adaptive LQ: it ends at the design of the ship that it steers, whatever it was designed on."""

import json
from dataclasses import replace

import control
import numpy as np
import pytest

from agents import LQ, AdaptiveLQ, check_controller, load_agent, sail
from agents.controllers.adaptive_lq import SIZES, _stable
from agents.controllers.linear_loop import (
    SIGNALS,
    rate_weight,
    sample_ship,
    sampled_ships,
)
from agents.controllers.lq import lq_rows
from agents.controllers.memory import records
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.ships.conversions import nomoto, nomoto2_ship
from shipgym.ships.linear import linearise, straight_running
from shipgym.tasks.steering import RUDDER_WEIGHT
from shipgym.tasks.task import control_interval, course_keeping_task

MARINER = load_model("mariner")
GENTLE = course_keeping_task(course_change_deg=10.0, episode_steps=2000)


@pytest.mark.parametrize(
    "name", ["mariner", "container", "tanker", "kvlcc2", "kvlcc2-l7"]
)
def test_many_designs_at_once_are_those_of_python_control(name):
    model = load_model(name)
    dt, time = control_interval(model), 20.0 * model.travel_time
    ship = sample_ship(model, dt)
    linear = np.concatenate(linearise(model, straight_running(model)), axis=1)
    A, B = sampled_ships(
        np.stack([linear, 0.5 * linear]), model.steering.time_constant, dt
    )
    np.testing.assert_allclose(A[0], ship.A, atol=1e-12)
    np.testing.assert_allclose(B[0], ship.B[:, 0], atol=1e-12)
    for rate, rudder in (
        (rate_weight(model), RUDDER_WEIGHT),
        (2.0 * rate_weight(model), 0.3),
    ):
        weights = np.sqrt(
            [1.0, rudder, rate / dt**2, 1.0 / time**2]
        )  # of error, rudder, its rate, integral
        cost, effect = (
            weights[:, None] * matrix[[2, 3, 3, 4]] for matrix in (A[1], B[1][:, None])
        )
        cost[2, 3] -= weights[2]
        plant = control.ss(A[1], B[1][:, None], np.eye(5), 0.0, dt)
        wanted, _, _ = control.lqr(
            plant, cost.T @ cost, effect.T @ effect, cost.T @ effect
        )
        np.testing.assert_allclose(
            lq_rows(A, B, dt, rate, time, rudder)[1], -wanted[0], rtol=1e-9
        )


def changed(**factors):
    coefficients = {
        name: value * factors.get(name, 1.0)
        for name, value in MARINER.coefficients.items()
    }
    return replace(MARINER, coefficients=coefficients)


WEAK_RUDDER = changed(N_d=0.5, N_ud=0.5, N_r=1.5, N_ur=1.5, N_v=1.3, N_uv=1.3)
UNSTABLE = changed(N_v=1.7, N_uv=1.7)


def state_after(controller, model, steps, task=GENTLE, state=None):
    """State after so many steps of two episodes, shape (2, memory_size)."""
    engine = Engine(model, 2, task)
    seen = engine.reset(np.arange(2))
    for _ in range(steps):
        action, state = controller.predict(seen, state)
        seen, *_ = engine.step(action)
    return state


@pytest.mark.parametrize(
    ("believed", "true"),
    [(WEAK_RUDDER, MARINER), (MARINER, UNSTABLE), (MARINER, WEAK_RUDDER)],
)
def test_it_converges_to_the_design_of_the_true_ship(believed, true):
    adaptive = AdaptiveLQ.from_model(believed, noise=0.0)
    wanted = np.array([LQ.from_model(true).gains[signal] for signal in SIGNALS])
    begun = np.array([adaptive.gains[signal] for signal in SIGNALS])
    reached = records(state_after(adaptive, true, 1500), adaptive.record)["gains"]
    size = np.abs(wanted)
    assert np.all(np.abs(reached - wanted) < 0.12 * size)
    before, after = (
        np.linalg.norm((gains - wanted) / size, axis=-1) for gains in (begun, reached)
    )
    assert np.all(after < 0.35 * before)


def test_a_ship_that_changes_at_sea_is_followed():
    """The rudder loses half of its effect; after half an hour its new one is known."""
    adaptive = AdaptiveLQ.from_model(MARINER, noise=0.0, forgetting_lengths=10.0)
    effects = []
    state = None
    for ship in (MARINER, WEAK_RUDDER):
        state = state_after(
            adaptive, ship, 1000 if state is None else 2000, state=state
        )
        effects.append(
            adaptive.coefficients(state[0])[1, 2]
            / AdaptiveLQ.from_model(ship).prior[1, 2]
        )
    assert effects == pytest.approx([1.0, 1.0], abs=0.08)


def test_on_its_own_ship_it_stays_near_its_design_at_no_more_cost():
    adaptive, lq = AdaptiveLQ.from_model(MARINER), LQ.from_model(MARINER)
    ours, theirs = (
        sail(pilot, MARINER, seeds=np.arange(12)) for pilot in (adaptive, lq)
    )
    assert ours.cost.mean() < 1.01 * theirs.cost.mean()


def test_in_noise_it_keeps_what_it_gained():
    """A model wrong by half in the rudder's effect; noise of a sea trial's sensors."""
    task = course_keeping_task(course_change_deg=30.0, episode_steps=1500, noise=1.0)
    ours, theirs = (
        sail(kind.from_model(WEAK_RUDDER), MARINER, task, np.arange(12))
        for kind in (AdaptiveLQ, LQ)
    )
    assert ours.cost.mean() < theirs.cost.mean()
    assert not ours.terminated.any()


def test_it_is_a_controller_and_a_file(tmp_path):
    adaptive = AdaptiveLQ.from_model(MARINER)
    check_controller(adaptive, MARINER, n_steps=45)
    adaptive.save(tmp_path / "adaptive.json")
    again = load_agent(tmp_path / "adaptive.json", MARINER)
    assert np.array_equal(*(state_after(one, MARINER, 50) for one in (adaptive, again)))


@pytest.mark.parametrize(
    "weights", [{}, {"rudder_weight": 0.02, "rate_weight_s2": 30.0}]
)
def test_designed_anew_for_the_same_ship_it_is_the_lq_of_the_same_weights(weights):
    settings = {"integral_lengths": 15.0, **weights}
    adaptive, lq = (kind.from_model(MARINER, **settings) for kind in (AdaptiveLQ, LQ))
    assert adaptive.gains == lq.gains
    (anew,) = adaptive._redesigned(adaptive._fresh())["gains"]
    np.testing.assert_allclose(
        anew, [lq.gains[signal] for signal in SIGNALS], rtol=1e-8
    )


def test_weights_go_through_the_file_and_an_older_one_has_the_environment_s(tmp_path):
    path = tmp_path / "adaptive.json"
    weighty = AdaptiveLQ.from_model(
        MARINER, rudder_weight=0.02, redesign_lengths=0.1, noise=0.0
    )
    weighty.save(path)
    again = load_agent(path, MARINER)
    assert np.array_equal(*(state_after(one, MARINER, 20) for one in (weighty, again)))
    plain = AdaptiveLQ.from_model(MARINER, redesign_lengths=0.1, noise=0.0)
    plain.save(path)
    content = json.loads(path.read_text())
    del content["design"]["rudder_weight"]
    path.write_text(json.dumps(content))
    older = load_agent(path, MARINER)
    assert np.array_equal(*(state_after(one, MARINER, 20) for one in (plain, older)))


@pytest.mark.parametrize("name", ["rudder_weight", "rate_weight_s2"])
def test_weights_must_be_above_zero(name):
    with pytest.raises(InputError, match=f"{name}: expected"):
        AdaptiveLQ.from_model(MARINER, **{name: 0.0})


def test_a_ship_without_sway_is_refused():
    ship = nomoto2_ship(nomoto(MARINER), MARINER.particulars, MARINER.steering)
    with pytest.raises(
        InputError, match="has no sway, expected one with surge, sway and yaw"
    ):
        AdaptiveLQ.from_model(ship)


def test_waves_teach_it_little_that_is_wrong():
    """First-order yawing is not steering: without a guard the gains run away (cost 700 in place of 27)."""
    task, seeds = course_keeping_task(sea="moderate", noise=1.0), np.arange(16)
    ours, theirs = (
        sail(kind.from_model(MARINER), MARINER, task, seeds)
        for kind in (AdaptiveLQ, LQ)
    )
    assert not ours.terminated.any()
    assert ours.cost.mean() < 1.2 * theirs.cost.mean()


@pytest.mark.parametrize(
    ("name", "value"),
    [("forgetting_lengths", 0.0), ("redesign_lengths", 0.0), ("noise", -1.0)],
)
def test_numbers_beyond_their_bounds_are_refused(name, value):
    with pytest.raises(InputError, match=f"{name}: expected"):
        AdaptiveLQ.from_model(MARINER, **{name: value})


def test_a_rudder_five_times_as_strong_or_weak_is_believed_and_no_stronger_or_weaker_one():
    adaptive = AdaptiveLQ.from_model(MARINER)
    for share, believed in (
        (4.9, True),
        (5.2, False),
        (0.205, True),
        (0.195, False),
        (-1.0, False),
    ):
        kept = adaptive._fresh()
        kept["theta"][0, 1, 2] *= share
        changed_gains = not np.array_equal(
            adaptive._redesigned(kept)["gains"], kept["gains"]
        )
        assert changed_gains == believed, share


def test_gains_hold_a_ship_whose_sampled_poles_are_within_the_unit_circle():
    A = np.array([np.diag([size, 0.5]) for size in (0.98, 1.02, -1.02)])
    assert _stable(A, np.zeros((3, 2)), np.zeros((3, 2))).tolist() == [
        True,
        False,
        False,
    ]


def test_a_coefficient_may_be_as_wrong_as_it_is_large_and_a_hundredth_at_least():
    adaptive = AdaptiveLQ.from_model(MARINER)
    scaled = np.array([[3.0, -2.0, 0.02, 0.0], [0.005, 1.0, 4.0, -0.5]])
    own = replace(adaptive, prior=scaled * adaptive.error_size[:, None] / SIZES)
    expected = [[9.0, 4.0, 0.0004, 0.0001], [0.0001, 1.0, 16.0, 0.25]]
    np.testing.assert_allclose(own._doubt(), expected, rtol=1e-9)
    covariance = own._fresh()["covariance"][0]
    np.testing.assert_allclose(
        covariance, [np.diag(row) for row in expected], rtol=1e-9
    )


def seen_of(**values):
    """What one ship observes that is at rest on her course but for the values given."""
    rest = dict.fromkeys(
        ("sway", "yaw_rate", "rudder", "surge", "heading_error_sin"), 0.0
    )
    known = {**rest, "heading_error_cos": 1.0, "heading_error_integral": 0.0, **values}
    return {name: np.array([value]) for name, value in known.items()}


def test_a_ship_without_way_counts_as_one_with_a_tenth_of_hers():
    adaptive = AdaptiveLQ.from_model(MARINER)
    memory, begins = np.zeros((1, adaptive.memory_size)), np.array([True])
    for surge, sway, speed in (
        (0.0, 0.0, 0.1 * adaptive.design["speed"]),
        (3.0, -4.0, 5.0),
    ):
        _, after = adaptive.steer(seen_of(surge=surge, sway=sway), memory, begins)
        assert records(after, adaptive.record)["last"][0, 3] == pytest.approx(speed)


def test_nothing_is_learned_before_the_yaw_rate_was_calm_for_a_while():
    """What is remembered of its unrest begins ten times above the limit, and decays within a ship length."""
    adaptive = AdaptiveLQ.from_model(MARINER, redesign_lengths=2.0)
    steps, memory = (
        adaptive.design["redesign_steps"],
        np.zeros((1, adaptive.memory_size)),
    )
    begins, learned = np.array([True]), []
    for step in range(int(4.0 * steps)):
        seen = seen_of(
            surge=7.7,
            rudder=0.02 * np.sin(0.05 * step),
            yaw_rate=1e-4 * np.cos(0.05 * step),
        )
        _, memory = adaptive.steer(seen, memory, begins)
        begins = np.array([False])
        learned.append(bool(np.any(records(memory, adaptive.record)["terms"])))
    first = np.log(0.1) / np.log(1.0 - 1.0 / steps)
    assert learned.index(True) + 1 == pytest.approx(first, abs=1.0)


def test_it_is_designed_anew_once_in_a_control_interval_at_most():
    assert (
        AdaptiveLQ.from_model(MARINER, redesign_lengths=1e-3).design["redesign_steps"]
        == 1.0
    )


@pytest.mark.parametrize(
    ("sway", "turn", "learned"),
    [
        (0.095, 0.0, True),
        (-0.105, 0.0, False),
        (0.0, -0.24, True),
        (0.0, 0.26, False),
        (0.105, 0.24, False),
    ],
)
def test_drift_of_a_tenth_and_turns_of_a_quarter_are_too_hard_to_learn_from(
    sway, turn, learned
):
    """Over speed, and times length over speed; the mean of an interval counts, and none where it begins."""
    adaptive = AdaptiveLQ.from_model(MARINER)
    speed, length = 6.0, adaptive.design["length"]
    ends = np.array([[sway * speed, turn * speed / length, 0.05, speed]])
    spread = np.array([[0.3, 0.002, 0.0, 0.0]])
    for begins in (False, True):
        kept = adaptive._fresh()
        kept["last"] = ends - spread
        adaptive._learn(kept, ends + spread, np.array([begins]), np.array([True]))
        assert bool(np.any(kept["terms"])) == (learned and not begins)
        if learned and not begins:
            terms = np.array([sway, turn, 0.05, 1.0]) / SIZES
            np.testing.assert_allclose(kept["terms"][0, -1], terms, rtol=1e-12)
            units = np.array([length / speed**2, (length / speed) ** 2])
            targets = (
                2.0
                * spread[0, :2]
                / adaptive.design["dt"]
                * units
                / adaptive.error_size
            )
            np.testing.assert_allclose(kept["targets"][0, -1], targets, rtol=1e-12)
