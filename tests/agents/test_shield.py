"""The shield catches policies that lead ships astray, and leaves good ones alone."""

import numpy as np
import pytest

from agents import LQ, PID, Shielded, WheelOver, check_controller, interventions
from agents.controllers.memory import records
from agents.policies.shield import WATCH, Limits
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.tasks.task import course_keeping_task, path_following_task
from tests.agents.policies import MARINER, random_policy

IDENTIFIED = load_model("mariner-tls-svm")
STRAIGHT = course_keeping_task(course_change_deg=0.0)
GOOD = LQ.from_model(MARINER)
N = 16


class Always:
    """One command whatever it sees."""

    def __init__(self, command):
        self.command = command

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return (
            np.full((*np.shape(observation)[:-1], 1), self.command, np.float32),
            state,
        )


class Once(Always):
    """Hard to starboard for a while, then LQ; remembers the steps."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        step = 0 if state is None else state
        good, _ = GOOD.predict(observation)
        return (np.ones_like(good) if step < self.command else good), step + 1


def sailed(policy, model=MARINER, task=STRAIGHT, steps=600):
    """Heading errors in degrees of shape (steps, N), which ships were lost, and the states."""
    engine = Engine(model, N, task)
    seen, state, errors, states = engine.reset(np.arange(N)), None, [], []
    lost = np.zeros(N, bool)
    for step in range(steps):
        action, state = policy.predict(seen, state, np.full(N, step == 0), True)
        seen, _, terminated, _ = engine.step(action)
        lost |= terminated
        errors.append(np.degrees(engine.info("heading_error")))
        states.append(state)
    return np.array(errors), lost, states


@pytest.mark.parametrize("name", ["mariner", "kvlcc2"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_policy_hard_over_is_caught_and_the_ship_keeps_her_course(name, side):
    model = load_model(name)
    _, lost, _ = sailed(Always(side), model, steps=200)
    assert lost.all()  # without a shield
    errors, lost, states = sailed(Shielded.from_model(model, Always(side)), model)
    assert not lost.any()
    assert np.abs(errors).max() < 40.0
    found = interventions(states[-1])
    assert (found.count >= 1).all()
    assert (found.intervals > 0.5 * 600).all()
    assert np.abs(errors[-1]).max() < 40.0


@pytest.mark.parametrize("course_change_deg", [30.0, 90.0])
@pytest.mark.parametrize(
    "model", [MARINER, IDENTIFIED, load_model("kvlcc2")], ids=lambda model: model.name
)
def test_a_good_controller_is_never_interrupted_in_calm_water(model, course_change_deg):
    task = course_keeping_task(
        course_change_deg=course_change_deg, max_heading_error_deg=180.0
    )
    for good in (LQ.from_model(model), PID.from_model(model)):
        shield = Shielded.from_model(model, good)
        _, _, states = sailed(shield, model, task, steps=300)
        assert interventions(states[-1]).count.sum() == 0


def test_noisy_instruments_in_a_sea_do_not_call_it():
    task = course_keeping_task(sea="moderate", noise=1.0)
    _, _, states = sailed(
        Shielded.from_model(IDENTIFIED, LQ.from_model(IDENTIFIED)), IDENTIFIED, task
    )
    assert interventions(states[-1]).count.sum() == 0


def test_it_hands_back_once_and_does_not_chatter():
    errors, _, states = sailed(Shielded.from_model(MARINER, Once(60)), steps=400)
    steering = np.array([interventions(state).steering for state in states])
    changes = np.abs(np.diff(steering.astype(int), axis=0)).sum(axis=0)
    assert (changes == 2).all()  # to the fallback and back
    found = interventions(states[-1])
    assert (found.count == 1).all()
    np.testing.assert_array_equal(found.intervals, steering.sum(axis=0))
    held = np.argmax(steering[::-1], axis=0)
    last = len(steering) - held  # first interval of the policy again
    assert (np.abs(errors[last - 1, np.arange(N)]) <= 5.5).all()


def test_leaving_the_envelope_calls_it_before_the_heading_does():
    """Far outside the data it takes over though the ship turns towards her course."""
    limits = Limits(runaway_deg=180.0)
    shield = Shielded.from_model(IDENTIFIED, Always(0.0), limits=limits)
    scales = np.array(shield.observation_scales)
    u, v, r, delta = IDENTIFIED.envelope.centre
    shown = np.array([0.0, 1.0, r, v, 2.0 * u, delta, delta, 0.0]) / scales
    assert IDENTIFIED.envelope.distance(2.0 * u, v, r, delta) > limits.envelope_out
    state, steering = None, []
    for _ in range(6):
        _, state = shield.predict(shown.astype(np.float32), state)
        steering.append(bool(interventions(state).steering))
    length_time = 1.0 / scales[2]
    expected = int(np.ceil(limits.out_lengths * length_time / shield.dt))
    assert steering == [step + 1 >= expected for step in range(6)]
    inside = shown.copy()
    inside[4] = u / scales[4]
    for _ in range(int(np.ceil(length_time / shield.dt)) - 1):
        _, state = shield.predict(inside.astype(np.float32), state)
        assert interventions(state).steering
    _, state = shield.predict(inside.astype(np.float32), state)
    assert not interventions(state).steering
    assert interventions(state).count == 1


def test_a_command_that_is_no_number_calls_it_at_once():
    errors, lost, states = sailed(
        Shielded.from_model(MARINER, Always(np.nan)), steps=100
    )
    assert not lost.any()
    assert np.abs(errors).max() < 2.0
    np.testing.assert_array_equal(interventions(states[-1]).intervals, 100)
    np.testing.assert_array_equal(interventions(states[-1]).count, 1)


def test_a_new_course_is_no_running_away():
    """The course changes by 170 degrees against the turn."""
    shield = Shielded.from_model(MARINER, Always(0.5))
    state = None
    for error in (0.0, -170.0, 170.0, -60.0):
        shown = np.array(
            [np.sin(np.radians(error)), np.cos(np.radians(error)), 0, 0, 1, 0, 0, 0],
            np.float32,
        )
        action, state = shield.predict(shown, state)
        np.testing.assert_array_equal(action, [0.5])
    assert interventions(state).count == 0


def test_an_early_turn_that_is_planned_is_no_running_away_and_a_turn_the_wrong_way_is():
    task = path_following_task(max_turn_deg=90.0, acceptance=1.0)
    early = WheelOver.from_model(MARINER, task=task)
    found = {}
    for lengths in (0.0, 8.0):
        limits = Limits(turn_lengths=lengths)
        *_, states = sailed(
            Shielded.from_model(MARINER, early, limits=limits), task=task, steps=900
        )
        found[lengths] = interventions(states[-1]).count.sum()
    assert found[0.0] > 0
    assert found[8.0] == 0

    class Away(WheelOver):
        """Turns before waypoints, to the other side."""

        def course_along(self, cross, turns):
            return super().course_along(cross, [turns[0], -turns[1]])

    wrong = Shielded.from_model(MARINER, Away(**vars(early)))
    *_, states = sailed(wrong, task=task, steps=900)
    assert interventions(states[-1]).count.sum() > 0


@pytest.mark.parametrize("turn_deg", [60.0, -60.0, 0.0])
def test_before_a_turn_headings_up_to_the_course_beyond_it_are_on_course(
    turn_deg, monkeypatch
):
    """Within 5 degrees of them a ship that turns away is not counted as running away."""
    errors = np.arange(-90.0, 91.0, 4.0)
    low, high = min(-turn_deg, 0.0) - 5.0, max(-turn_deg, 0.0) + 5.0
    shown = np.zeros((len(errors), 8), np.float32)
    shown[:, 0], shown[:, 1], shown[:, 4] = (
        np.sin(np.radians(errors)),
        np.cos(np.radians(errors)),
        1.0,
    )
    shown[:, 2] = -np.sign(errors + 0.5 * turn_deg)  # away from the middle of the turn
    shield = Shielded(Always(0.2), GOOD, dt=1.0)
    monkeypatch.setattr(
        Shielded, "_planned_turn", lambda self, seen: np.radians(turn_deg)
    )
    _, state = shield.predict(shown)
    turned = records(state.watch, WATCH)["turned"]
    np.testing.assert_array_equal(turned > 0.0, (errors < low) | (errors > high))
    yaw_rate = GOOD.observation_scales[2]
    assert turned.max() == pytest.approx(
        0.5 * 1.0 * yaw_rate
    )  # from no rate of turn to that, in a second


def test_a_shaft_command_that_is_no_number_is_none():
    class Broken(Always):
        def predict(
            self, observation, state=None, episode_start=None, deterministic=True
        ):
            return np.array([[0.3, np.nan], [0.3, 0.7]]), state

    shown = np.tile(np.eye(8)[1], (2, 1)).astype(np.float32)
    action, state = Shielded(Broken(0.0), GOOD, dt=1.0).predict(shown)
    assert action[:, 1].tolist() == [0.0, np.float32(0.7)]
    assert interventions(state).steering.tolist() == [True, False]


def test_counts_begin_anew_with_an_episode():
    _, _, states = sailed(Shielded.from_model(MARINER, Always(-1.0)), steps=100)
    assert interventions(states[-1]).count.all()
    shown = np.zeros((N, 8), np.float32)
    shown[:, 1] = 1.0
    begins = np.arange(N) < 4
    _, state = Shielded.from_model(MARINER, Always(-1.0)).predict(
        shown, states[-1], begins
    )
    assert (interventions(state).count[:4] == 0).all()
    assert interventions(state).count[4:].all()


@pytest.mark.parametrize("seed", range(3))
def test_random_policies_never_lose_the_ship_under_it(seed):
    shield = Shielded.from_model(IDENTIFIED, random_policy(IDENTIFIED, seed=seed))
    errors, lost, _ = sailed(
        shield, IDENTIFIED, course_keeping_task(course_change_deg=30.0), steps=300
    )
    assert not lost.any()
    assert np.abs(errors).max() < 80.0


def test_it_keeps_the_promises_of_a_controller():
    check_controller(
        Shielded.from_model(MARINER, random_policy(frame_stack=2)), n_steps=30
    )
    shield = Shielded.from_model(MARINER, LQ.from_model(MARINER))
    check_controller(shield, MARINER, path_following_task(), n_steps=5)
    assert shield.name == "lq-shielded"


def test_the_shaft_stays_with_the_policy():
    policy = random_policy(action="rudder-shaft")
    shown = np.zeros((2, 8), np.float32)
    shown[:, 1], shown[1, 0], shown[1, 2] = 1.0, -1.0, 2.0
    shield = Shielded(policy, GOOD, dt=1.0)
    state = None
    for _ in range(20):
        action, state = shield.predict(shown, state)
    np.testing.assert_array_equal(interventions(state).steering, [False, True])
    expected, _ = policy.predict(shown)
    np.testing.assert_array_equal(action[:, 1], expected[:, 1])
    np.testing.assert_array_equal(action[0], expected[0])
    assert action[1, 0] == shield.fallback.predict(shown)[0][1, 0]


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"envelope_out": 0.5}, "limits.envelope_out: expected"),
        (
            {"envelope_back": 1.5},
            "limits.envelope_back: expected.*< 1.5 .less than to take over",
        ),
        ({"back_deg": 10.0}, "limits.back_deg: expected"),
        ({"runaway_deg": 200.0}, "limits.runaway_deg: expected"),
        ({"calm_lengths": -1.0}, "limits.calm_lengths: expected"),
    ],
)
def test_limits_that_do_not_fit_are_refused(limits, message):
    with pytest.raises(InputError, match=message):
        Limits(**limits)


def test_another_ship_is_refused():
    kvlcc2 = load_model("kvlcc2")
    with pytest.raises(InputError, match="fallback: the scale of 'yaw_rate'"):
        Shielded.from_model(kvlcc2, random_policy())
    with pytest.raises(InputError, match="model 'kvlcc2': the scale of 'yaw_rate'"):
        Shielded.from_model(MARINER, random_policy()).check_fits_model(kvlcc2)
    with pytest.raises(
        InputError, match="fallback: Always found, expected a controller"
    ):
        Shielded.from_model(MARINER, random_policy(), fallback=Always(0.0))


class ForHer(Always):
    """Knows one ship by her name, and no more than the names of what it sees."""

    observation_names = GOOD.observation_names

    def check_fits_model(self, model):
        if model.name != self.command:
            raise InputError(f"not for {model.name}")


def test_policy_and_fallback_are_asked_whether_they_fit_the_ship():
    assert (
        Shielded.from_model(MARINER, ForHer("mariner")).observation_names
        == GOOD.observation_names
    )
    with pytest.raises(InputError, match=r"^not for mariner$"):
        Shielded.from_model(MARINER, ForHer("kvlcc2"))
    other = LQ.from_model(load_model("kvlcc2"))
    with pytest.raises(InputError, match="model 'mariner': the scale of 'yaw_rate'"):
        Shielded.from_model(MARINER, Always(0.0), fallback=other)
    names, scales = list(GOOD.observation_names), list(GOOD.observation_scales)
    for shield in (Shielded(Always(0.0), GOOD, 1.0), Shielded(GOOD, GOOD, 1.0)):
        shield.check_fits(names, scales)
        with pytest.raises(
            InputError, match="place: the scale of 'heading_error_sin' is 2, but"
        ):
            shield.check_fits(names, [2.0 * scale for scale in scales], "place")


def test_times_are_in_ship_lengths_and_one_interval_at_least():
    length_time = MARINER.particulars["length"] / MARINER.particulars["speed"]
    shield = Shielded.from_model(MARINER, Always(0.0), dt=0.5)
    assert shield._intervals(2.0) == pytest.approx(2.0 * length_time / 0.5)
    assert shield._intervals(0.0) == shield._intervals(1e-6) == 1.0
    assert Shielded.from_model(MARINER, Always(0.0), dt=0.05).dt == 0.05
    with pytest.raises(InputError, match="dt: expected a number > 0"):
        Shielded.from_model(MARINER, Always(0.0), dt=0.0)


def test_a_limit_of_no_time_calls_it_at_the_first_interval_beyond():
    shield = Shielded.from_model(
        IDENTIFIED, Always(0.0), limits=Limits(runaway_deg=180.0, out_lengths=0.0)
    )
    u, v, r, delta = IDENTIFIED.envelope.centre
    shown = (
        np.array([0.0, 1.0, r, v, 2.0 * u, delta, delta, 0.0])
        / shield.observation_scales
    )
    _, state = shield.predict(shown.astype(np.float32))
    assert interventions(state).steering


def test_a_shield_waits_a_quarter_and_a_whole_ship_length():
    assert Limits() == Limits(1.5, 1.1, 0.25, 10.0, 5.0, 1.0, 8.0)
    wrong = {
        "envelope_out": 0.9,
        "envelope_back": 1.5,
        "runaway_deg": 181.0,
        "back_deg": 10.0,
    }
    for name, value in wrong.items():
        with pytest.raises(InputError, match=rf"limits\.{name}: expected"):
            Limits(**{name: value})
    for name in ("out_lengths", "calm_lengths"):
        with pytest.raises(InputError, match=rf"limits\.{name}: expected"):
            Limits(**{name: -1.0})
        assert getattr(Limits(**{name: 0.0}), name) == 0.0
