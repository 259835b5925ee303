"""A family of ships that are not known: what is drawn, its physics, its costs."""

import gymnasium
import numpy as np
import pytest

from shipgym import InputError, load_model, scale_model
from shipgym.envs.family import (
    HULL_RANGES,
    SHIP_RANGES,
    FamilyHull,
    FamilyShip,
    family,
    particulars_of,
    sea_of,
    ship_of,
)
from shipgym.models.linear import nomoto
from shipgym.sea import Weather

pytestmark = pytest.mark.interpreted

COURSE = "shipgym/CourseKeeping-v0"
UNKNOWN = "shipgym/UnknownShip-v0"
LENGTH = 320.0
FAMILY = family(16, 0, LENGTH)
MIDDLE = FamilyHull(**{name: np.mean(one) for name, one in HULL_RANGES.items()})
SHIP = FamilyShip(**{name: np.mean(one) for name, one in SHIP_RANGES.items()})


def own_nomoto(model):
    """Gain and time constant by the time in which a ship sails her length."""
    own = nomoto(model)
    time = model.travel_time
    return own.K * time, own.T / time


def test_ships_and_seas_are_within_the_ranges():
    froude, gears, heights = [], [], []
    for model, sea in FAMILY:
        ship = model.particulars
        assert ship.length == LENGTH
        assert 0.55 <= ship["block_coefficient"] <= 0.85
        froude.append(ship["speed"] / np.sqrt(9.81 * LENGTH))
        gears.append(model.steering.rudder_rate_deg_s)
        heights.append(sea.waves.significant_height)
    assert 0.06 < min(froude) < max(froude) < 0.32
    # of a ship of 30 m the gear is slower by the root of the scale
    assert 1.0 * np.sqrt(30.0 / 320.0) < min(gears) < max(gears) < 5.0
    assert 0.0 < min(heights) < max(heights) < LENGTH / 40.0 + 1e-9


def test_a_third_of_the_family_is_not_stable_on_course_and_all_obey_the_rudder():
    own = np.array([own_nomoto(model) for model, _ in FAMILY])
    unstable = own[:, 0] < 0.0
    assert 0.2 < unstable.mean() < 0.5
    assert np.all(own[unstable, 1] < 0.0)
    rudder_effect = own[:, 0] / own[:, 1]
    assert np.all((rudder_effect > 0.2) & (rudder_effect < 1.5))


@pytest.mark.parametrize(
    ("changed", "sign"),
    [({"balance": 1.5}, -1.0), ({"damping": 1.1}, 1.0), ({"depth": 1.3}, 1.0)],
)
def test_drift_moment_unsettles_and_damping_and_shallow_water_steady(changed, sign):
    loaded = particulars_of(MIDDLE, LENGTH)
    usual = SHIP._replace(balance=0.8, depth=10.0)
    _, before = own_nomoto(ship_of(usual, MIDDLE, loaded))
    _, after = own_nomoto(ship_of(usual._replace(**changed), MIDDLE, loaded))
    assert sign * (1.0 / after - 1.0 / before) > 0.0


def test_similar_ships_of_two_lengths_in_similar_seas_are_the_same_ship():
    short = MIDDLE._replace(length=80.0, wave_height=1.0)
    long = MIDDLE._replace(length=320.0, wave_height=4.0)
    in_short = particulars_of(short, LENGTH)
    in_long = particulars_of(long, LENGTH)
    one = ship_of(SHIP._replace(gear=4.0), short, in_short)
    other = ship_of(SHIP._replace(gear=2.0), long, in_long)
    np.testing.assert_allclose(one.ship_numbers(), other.ship_numbers())
    in_sea = [sea_of(hull, LENGTH).waves.significant_height for hull in (short, long)]
    assert in_sea == pytest.approx([4.0, 4.0])


def test_similar_ships_of_two_lengths_pay_the_same_for_the_same_manoeuvre():
    options = {"cost_lengths": 0.25, "episode_steps": 60}
    small = load_model("mariner")
    large = scale_model(small, 2.0 * small.particulars.length, speed=10.0)
    costs = []
    for ship in (small, large):
        env = gymnasium.make(COURSE, model=ship, dt=0.2 * ship.travel_time, **options)
        env.reset(seed=3)
        total = 0.0
        for action in 0.3 * np.sin(np.arange(60.0)):
            *_, info = env.step(np.array([action], dtype=np.float32))
            total += info["cost"]
        costs.append(total)
    assert costs[0] > 0.1
    assert costs[1] == pytest.approx(costs[0], rel=1e-9)


def test_rows_of_a_batch_are_the_single_environment():
    few = {"family": 2, "episode_steps": 30}
    many = gymnasium.make_vec(UNKNOWN, num_envs=3, **few)
    observations, _ = many.reset(seed=[5, 6, 7])
    one = gymnasium.make(UNKNOWN, **few)
    alone, _ = one.reset(seed=6)
    np.testing.assert_array_equal(observations[1], alone)
    for _ in range(20):
        action = np.full((3, 1), 0.4, dtype=np.float32)
        observations, rewards, *_ = many.step(action)
        alone, reward, *_ = one.step(action[1])
        np.testing.assert_array_equal(observations[1], alone)
        assert rewards[1] == reward


def test_set_points_change_by_5_to_60_degrees():
    env = gymnasium.make_vec(UNKNOWN, num_envs=200, family=2)
    env.reset(seed=1)
    state = env.unwrapped.physical_state()
    degrees = np.abs(np.degrees(state["set_point"] - state["psi"]))
    assert 5.0 - 1e-9 < degrees.min() < 8.0
    assert 55.0 < degrees.max() < 60.0 + 1e-9


def test_other_seeds_draw_other_ships():
    other = family(16, 1, LENGTH)
    assert other[0][0].coefficients != FAMILY[0][0].coefficients
    assert isinstance(other[0][1], Weather)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"model": "mariner"}, "family: expected a model in the MMG form"),
        ({"sea": "rough"}, "family: expected no sea and no other randomisation"),
        ({"speed_range": (0.5, 1.0)}, "family: expected no sea and no other"),
        ({"family": -1}, "family: expected"),
    ],
)
def test_what_a_family_cannot_be_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        gymnasium.make(UNKNOWN, **options)
