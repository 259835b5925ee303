"""The oracle: copies of ships share their future, and what is found never costs more than the start."""

import numpy as np
import pytest
from lane_copies import copy_lanes
from oracle import OracleSettings, run_oracle

from agents import LQ, PID
from shipgym.envs.engine import Engine
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.tasks.task import course_keeping_task, path_following_task

MARINER = load_model("mariner")
QUICK = OracleSettings(
    candidates=24,
    elites=4,
    iterations=2,
    passes=1,
    horizon_steps=90,
    plan_steps=60,
    knot_steps=10,
)
SEEDS = np.arange(3)
ONE_TURN = path_following_task(
    waypoints=[(0.0, 0.0), (1000.0, 0.0), (1000.0, 1000.0)],
    episode_steps=260,
    ground=8.0,
)


@pytest.mark.parametrize(
    "randomisation",
    [None, Randomisation(speed_range=(0.6, 1.0))],
    ids=["one ship", "drawn ships"],
)
def test_copies_of_lanes_have_the_future_of_their_originals_bit_for_bit(
    randomisation: Randomisation | None,
) -> None:
    task = course_keeping_task(sea="rough", noise=2.0, change_interval_steps=10)
    ships, copies = (
        Engine(MARINER, 3, task, randomisation),
        Engine(MARINER, 70, task, randomisation),
    )
    rudder = np.random.default_rng(1).uniform(-1.0, 1.0, (60, 3, 1))
    ships.reset(SEEDS)
    for action in rudder[:25]:
        ships.step(action)
    lanes = np.arange(70) % 3
    copy_lanes(copies, ships, lanes)
    assert np.array_equal(copies.observations, ships.observations[lanes])
    for action in rudder[25:]:
        seen, rewards, *_ = ships.step(action)
        copied, copied_rewards, *_ = copies.step(action[lanes])
        assert np.array_equal(copied, seen[lanes])
        assert np.array_equal(copied_rewards, rewards[lanes])


def test_lanes_of_another_task_or_that_are_not_there_are_refused() -> None:
    ships = Engine(MARINER, 2, course_keeping_task())
    with pytest.raises(InputError, match="another task"):
        copy_lanes(
            ships, Engine(MARINER, 2, course_keeping_task(episode_steps=10)), [0, 1]
        )
    with pytest.raises(InputError, match="0 to 2 found, expected 0 to 1"):
        copy_lanes(ships, Engine(MARINER, 2, course_keeping_task()), [0, 2])
    for lanes, message in (
        ([0.0, 1.0], "lanes: float64 of shape"),
        ([0], r"lanes: int64 of shape \(1,\) found, expected 2 whole numbers"),
        ([-1, 0], "lanes: -1 to 0 found"),
    ):
        with pytest.raises(InputError, match=message):
            copy_lanes(ships, ships, lanes)


def test_it_prepares_a_turn_of_the_path_and_saves_more_than_a_quarter() -> None:
    found = run_oracle(MARINER, ONE_TURN, SEEDS, settings=QUICK)
    assert np.all(found.costs < 0.75 * found.start_costs)


def test_its_costs_are_those_of_its_rudder_and_of_its_start() -> None:
    start = PID.from_model(MARINER, frequency=0.02)
    found = run_oracle(MARINER, ONE_TURN, SEEDS, start, QUICK)
    ships = Engine(MARINER, len(SEEDS), ONE_TURN)
    ships.reset(SEEDS)
    steered = sum(
        ships.step(found.actions[:, [step]])[1]
        for step in range(ONE_TURN.episode_steps)
    )
    np.testing.assert_allclose(found.costs, -steered, rtol=1e-9)
    seen, costs = ships.reset(SEEDS), np.zeros(len(SEEDS))
    for _ in range(ONE_TURN.episode_steps):
        seen, rewards, *_ = ships.step(start.predict(seen)[0])
        costs -= rewards
    np.testing.assert_allclose(found.start_costs, costs, rtol=1e-12)


def test_it_never_costs_more_than_its_start_and_knows_the_state_behind_the_noise() -> (
    None
):
    task = course_keeping_task(
        sea="rough", noise=5.0, course_change_deg=5.0, episode_steps=120
    )
    found = run_oracle(MARINER, task, SEEDS, LQ.from_model(MARINER), QUICK)
    assert np.all(found.costs < found.start_costs)
    coarse = OracleSettings(
        candidates=4, elites=2, iterations=1, passes=1, deviation=3.0
    )
    found = run_oracle(MARINER, task, SEEDS, LQ.from_model(MARINER), coarse)
    assert np.all(found.costs <= found.start_costs)


def test_an_episode_is_the_same_again_and_in_any_company() -> None:
    task = course_keeping_task(
        course_change_deg=60.0, episode_steps=100, change_interval_steps=40
    )
    together, alone = (
        run_oracle(MARINER, task, SEEDS, settings=QUICK),
        run_oracle(MARINER, task, [1], settings=QUICK),
    )
    assert np.array_equal(together.actions[1], alone.actions[0])
    assert together.costs[1] == alone.costs[0]


def test_it_does_not_know_a_course_change_before_it_is_ordered() -> None:
    short = course_keeping_task(
        course_changes_deg=[0.0, 40.0], change_interval_steps=60, episode_steps=120
    )
    none = course_keeping_task(
        course_changes_deg=[0.0], change_interval_steps=60, episode_steps=120
    )
    quick = OracleSettings(candidates=16, elites=4, iterations=2, passes=1)
    turned, straight = (
        run_oracle(MARINER, task, [0], settings=quick).actions[0]
        for task in (short, none)
    )
    assert np.array_equal(turned[:60], straight[:60])
    assert np.abs(turned[60:]).max() > 0.3


def test_it_steers_by_the_rudder_alone() -> None:
    with pytest.raises(InputError, match="expected 'rudder'"):
        run_oracle(MARINER, course_keeping_task(action="rudder-discrete"), SEEDS)
