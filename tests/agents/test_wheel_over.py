"""Wheel-over: turns begun by the ship's own turning circle, a current countered, guards at sharp turns."""

from types import SimpleNamespace

import numpy as np
import pytest

from agents import LQ, LineOfSight, WheelOver, check_controller, load_agent
from agents.controllers import wheel_over
from agents.controllers.wheel_over import STEEPEST, bend, own_lead, own_turn
from agents.rollouts.metrics import evaluate
from agents.suites.suite import BenchmarkTask, load_suite
from shipgym.errors import InputError
from shipgym.manoeuvres import turning_circle, turning_indices
from shipgym.ships import load_model
from shipgym.ships.linear import straight_running
from shipgym.tasks.task import path_following_task

MARINER, KVLCC2 = load_model("mariner"), load_model("kvlcc2")
SHARP = load_suite("shipgym-v1").task("kvlcc2-sharp-turns")


def test_radius_and_reach_are_those_of_the_turning_circle():
    radius, reach = own_turn(MARINER, share=20.0 / np.degrees(MARINER.steering.limit))
    for side in (20.0, -20.0):
        turn = turning_indices(
            turning_circle(MARINER, side, 1500.0), MARINER.particulars["length"]
        )
        assert abs(turn.tactical_diameter_lengths) == pytest.approx(
            2.0 * radius, rel=0.05
        )
        assert turn.advance_lengths == pytest.approx(radius + reach, rel=0.1)
    with pytest.raises(
        InputError,
        match=r"does not turn round within .* lengths with 0\.4 degrees of rudder",
    ):
        own_turn(MARINER, share=0.01)


def test_it_steers_the_next_leg_within_the_tangent_and_the_reach_and_mirrors():
    guide = WheelOver.from_model(MARINER, radius_lengths=3.0, reach_lengths=1.0)
    length = MARINER.particulars["length"]
    turn, zero = np.radians(60.0), np.zeros(1)
    begin = (3.0 * np.tan(turn / 2.0) + 1.0) * length
    before, after = (
        guide.course_along(zero, [zero + begin + d, zero + turn])[0]
        for d in (1.0, -1.0)
    )
    assert before == 0.0
    lookahead = guide.gains["turn_lookahead"]
    assert after == pytest.approx(
        turn - np.arctan2((begin - 1.0) * np.sin(turn), lookahead)
    )
    cross, ahead = np.linspace(-100.0, 100.0, 9), np.linspace(0.0, 1500.0, 9)
    for angle in (0.5, 1.2, 2.4):
        port = guide.course_along(-cross, [ahead, zero - angle])
        assert np.array_equal(port, -guide.course_along(cross, [ahead, zero + angle]))


def test_beyond_90_degrees_it_goes_forward_on_the_leg_until_that_ends():
    guide, turn = WheelOver.from_model(KVLCC2), np.full(50, np.radians(150.0))
    to_go = np.linspace(0.0, 10.0, 50) * KVLCC2.particulars["length"]
    assert guide.course_along(np.zeros(50), [to_go, turn]).max() <= STEEPEST


@pytest.mark.parametrize("options", [{"acceptance": 0.5}, {"max_turn_deg": 140.0}])
def test_sharp_turns_and_a_small_acceptance_radius_lose_no_ship(options):
    far = BenchmarkTask(
        "far", SHARP.environment, SHARP.model, "", {**SHARP.options, **options}
    )
    figures, _ = evaluate(
        WheelOver.from_model(far.ship, task=SHARP.task), far, range(32)
    )
    assert figures["grounded"].sum() == 0.0
    assert figures["success"].all()


def test_without_any_search_it_costs_less_than_the_best_of_the_old_classical_ones_after_theirs():
    """Tuned line of sight cost 559.0 on this task (docs/benchmark.md of version 1)."""
    figures, _ = evaluate(
        WheelOver.from_model(SHARP.ship, task=SHARP.task), SHARP, SHARP.seeds[:16]
    )
    plain, _ = evaluate(
        LineOfSight.from_model(SHARP.ship, task=SHARP.task), SHARP, SHARP.seeds[:16]
    )
    assert figures["cost"].mean() < 0.7 * plain["cost"].mean()


def test_the_course_of_a_path_bends_by_its_arcs():
    ahead = [np.array([100.0]), np.array([-1.0]), np.array([500.0]), np.array([0.5])]
    for distance, course in (
        (100.0, 0.0),
        (150.0, -0.25),
        (300.0, -1.0),
        (600.0, -0.5),
        (900.0, -0.5),
    ):
        assert bend(distance, ahead, 200.0)[0] == pytest.approx(course)


def test_an_arc_is_seen_as_far_ahead_as_heading_and_drift_lag_and_a_quarter_of_a_length():
    """In a turn with a twentieth of a degree of rudder, to both sides: heading and way lag by that."""
    pilot, neutral, turns = LQ.from_model(MARINER), straight_running(MARINER), []
    length, speed, side = (
        MARINER.particulars["length"],
        MARINER.particulars["speed"],
        np.radians(0.05),
    )
    for rudder in (side, -side):
        turn = MARINER.simulate(
            np.full((1500, 1), neutral.rudder + rudder), 1.0, neutral.state(MARINER)
        )
        turns.append((turn["v"][-1], turn["r"][-1]))
    sway, rate = np.subtract(*turns)
    gains = pilot.gains
    order = (
        2.0 * side * (1.0 - gains["rudder"])
        - gains["yaw_rate"] * rate
        - gains["sway"] * sway
    )
    behind = order / gains["heading_error"] / rate * speed - sway / rate
    assert own_lead(MARINER, pilot) == pytest.approx(behind / length + 0.25, abs=1e-3)


def test_it_is_a_controller_and_a_file(tmp_path):
    task = path_following_task(noise=1.0)
    guide = WheelOver.from_model(MARINER, task=task)
    check_controller(guide, MARINER, task, n_steps=20)
    guide.save(tmp_path / "guide.json")
    again = load_agent(tmp_path / "guide.json", MARINER)
    assert (again.kind, again.gains) == ("wheel-over", guide.gains)
    with pytest.raises(InputError, match="crab_share: expected"):
        WheelOver.from_model(MARINER, crab_share=3.0)


def test_a_length_that_is_no_length_is_refused_by_the_name_that_it_was_given_by():
    """Radius and reach are gains by other names than the arguments'."""
    for name in (
        "lookahead_lengths",
        "turn_lookahead_lengths",
        "radius_lengths",
        "reach_lengths",
    ):
        with pytest.raises(InputError, match=f"^{name}: expected a number > 0"):
            WheelOver.from_model(
                MARINER, **{"radius_lengths": 3.0, "reach_lengths": 1.0} | {name: 0.0}
            )


@pytest.mark.parametrize(
    ("diameter", "advance", "radius", "reach"),
    [(4.0, 3.5, 2.0, 1.5), (4.0, 1.9, 2.0, 0.01)],
)
def test_a_ship_that_turns_at_once_runs_on_for_a_hundredth_of_a_length(
    diameter, advance, radius, reach, monkeypatch
):
    """Diameters to port are negative; of both sides the mean is taken."""
    sides = iter([1.0, -1.0])

    def indices(*_):
        side = next(sides)
        return SimpleNamespace(
            tactical_diameter_lengths=side * diameter + 0.2,
            advance_lengths=advance + 0.3 * side,
        )

    monkeypatch.setattr(wheel_over, "turning_circle", lambda *_: None)
    monkeypatch.setattr(wheel_over, "turning_indices", indices)
    assert own_turn.__wrapped__(MARINER) == pytest.approx((radius, reach))


@pytest.mark.parametrize("missing", ["tactical_diameter_lengths", "advance_lengths"])
def test_a_ship_that_does_not_turn_round_to_one_side_has_no_turn(missing, monkeypatch):
    whole = {"tactical_diameter_lengths": 4.0, "advance_lengths": 3.0}
    sides = iter([whole, whole | {missing: None}])
    monkeypatch.setattr(wheel_over, "turning_circle", lambda *_: None)
    monkeypatch.setattr(
        wheel_over, "turning_indices", lambda *_: SimpleNamespace(**next(sides))
    )
    with pytest.raises(
        InputError, match=r"does not turn round within 60 lengths with 12\.0 degrees"
    ):
        own_turn.__wrapped__(MARINER)


def test_an_arc_is_seen_a_tenth_of_a_length_ahead_at_least_and_ten_at_most(monkeypatch):
    for late, lead in ((-100.0, 0.1), (100.0, 10.0)):
        monkeypatch.setattr(wheel_over, "LATE", late)
        assert own_lead(MARINER, None) == lead
