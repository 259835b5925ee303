"""A criterion has a verdict only where the trials decide it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from shipgym import Trial, UnstableModelError, load_model
from shipgym.manoeuvres import (
    imo_assessment,
    standard_manoeuvres,
    turning_circle,
    turning_indices,
    zigzag,
    zigzag_indices,
)
from shipgym.manoeuvres.deciding import remedy_for
from shipgym.manoeuvres.evidence import Side, chances_of
from shipgym.manoeuvres.imo_rules import RULES
from shipgym.manoeuvres.intervals import IndexInterval
from shipgym.manoeuvres.measured import MeasuredIndex, measured_indices
from shipgym.manoeuvres.registry import check_physical
from shipgym.manoeuvres.verdicts import (
    criterion_of,
    judged,
    outside_envelope,
    with_measured,
)
from shipgym.trials.sensors import Sensors


@pytest.fixture(scope="module")
def of_zigzags():
    """KVLCC2, identified from zigzags up to 20 degrees."""
    return imo_assessment(load_model("kvlcc2-rm-svm"), n_draws=20)


def test_a_turn_outside_the_envelope_of_the_trials_is_not_decided(of_zigzags):
    for name in ("advance", "tactical_diameter"):
        criterion = of_zigzags[name]
        assert (criterion.decided, criterion.passed, criterion.probability) == (
            False,
            None,
            None,
        )
        assert criterion.note.endswith(
            "outside the envelope of the trials; no single trial decides it, run a 35"
            " deg turn to both sides"
        )
        assert len(criterion.deciding_trials) == 2
        assert criterion.interval[0] <= criterion.value <= criterion.interval[1]
    told = of_zigzags["advance"].to_dict()
    assert told["decided"] is False
    assert told["probability"] is told["measured"] is None


def test_within_the_trials_the_interval_decides(of_zigzags):
    criterion = of_zigzags["overshoot_1_20_20"]
    assert criterion.interval[1] < criterion.limit
    assert (criterion.decided, criterion.passed, criterion.probability) == (
        True,
        True,
        1.0,
    )


def test_an_interval_on_both_sides_of_the_limit_decides_nothing(of_zigzags):
    one = of_zigzags["overshoot_1_20_20"]
    found = judged(replace(one, limit=sum(one.interval) / 2.0))
    assert not found.decided
    assert "both sides of the limit; " in found.note


def sides_of(starboard, port, spread, /, **measured):
    """Sides of an index with 200 models drawn, and what trials measured."""
    rng = np.random.default_rng(0)
    sides = []
    for name, value in (("starboard", starboard), ("port", port)):
        noise = spread * rng.standard_normal(200)
        drawn = IndexInterval(value, value + noise, np.zeros(200, dtype=bool))
        index = measured.get(name)
        known = None if index is None else MeasuredIndex(*index, name)
        sides.append(Side(name, drawn, measured=known))
    return sides


def overshoot(*args, limit=13.8, **measured):
    rule = replace(RULES["overshoot_1_10_10"], limit=limit)
    return criterion_of(rule, sides_of(*args, **measured), "10/10 zigzag")


def test_a_trial_to_one_side_decides_no_pass_that_the_model_leaves_open():
    """The port side has 14.5 deg; the model says 12.8 to 17.2 deg."""
    found = overshoot(12.3, 15.0, 1.1, starboard=(12.1, 0.1))
    assert (found.decided, found.passed, found.probability) == (False, None, None)
    assert (found.measured, found.measured_error, found.side) == (
        12.1,
        0.1,
        "starboard",
    )
    assert found.deciding_trials == ("10/10 zigzag, port first",)
    assert found.note == (
        "not decided by these trials: it was measured to starboard alone, and"
        " otherwise the models drawn lie on both sides of the limit; run a 10/10"
        " zigzag, port first"
    )


def test_a_trial_to_one_side_decides_a_failure():
    found = overshoot(12.0, 12.0, 2.0, port=(14.5, 0.1))
    assert (found.decided, found.passed, found.decided_by) == (True, False, "trials")
    assert found.probability < 1e-6
    assert found.side == "port"


@pytest.mark.parametrize(("error", "passed"), [(0.1, True), (0.3, None), (0.03, True)])
def test_a_measured_margin_counts_against_its_error(error, passed):
    found = overshoot(12.0, 12.0, 1.0, starboard=(13.4, error), port=(12.0, error))
    assert found.passed == passed
    if passed is None:
        assert "13.40 was measured with a standard error of 0.3" in found.note
        assert found.note.endswith("no single trial decides it")
        assert found.deciding_trials == ()


def test_a_model_that_is_off_on_one_side_is_off_on_the_other():
    close = sides_of(11.0, 11.0, 0.2, starboard=(11.0, 0.1))
    off = sides_of(8.0, 11.0, 0.2, starboard=(11.0, 0.1))
    assert chances_of(close, 13.8).passes > 0.999
    assert chances_of(off, 13.8).passes < 0.8


def test_one_trial_is_named_where_it_decides_else_both_or_none():
    likely_failure = sides_of(15.0, 17.0, 1.5)
    assert remedy_for(likely_failure, 13.8, 0.1).run == ["port"]
    outside = [side._replace(outside=True) for side in sides_of(9.0, 9.0, 3.0)]
    assert remedy_for(outside, 13.8, 0.1).run == ["starboard", "port"]
    assert remedy_for(sides_of(13.8, 13.8, 0.1), 13.8, 0.2).run == []


def test_what_noisy_trials_measure_is_not_high_and_has_its_error():
    ship = load_model("container")
    run = zigzag(ship, 10, 10, duration=500.0, dt=0.25)
    own = zigzag_indices(run).overshoot_1_deg
    offs = []
    for seed in range(8):
        noisy = Sensors(sampling_s=1.0).measure(run, seed)
        found = measured_indices(ship, noisy)["overshoot_1_10_10"]
        assert found.side == "starboard"
        assert 0.02 < found.error < 0.15
        offs.append((found.value - own) / found.error)
    assert abs(np.mean(offs)) < 1.0
    assert np.sqrt(np.mean(np.square(offs))) < 2.0


def test_a_measured_manoeuvre_goes_before_the_model(of_zigzags):
    ship = load_model("kvlcc2")
    turn = turning_circle(ship, -35.0, duration=1200.0, dt=1.0)
    small = turning_circle(ship, 20.0, duration=1200.0, dt=1.0)
    weave = zigzag(ship, 10, 10, duration=900.0, dt=1.0)
    found = with_measured(of_zigzags, ship, [turn, small, weave])
    advance = found["advance"]
    own = turning_indices(turn, 320.0).advance_lengths
    assert advance.measured == pytest.approx(own, abs=0.01)
    assert (advance.decided, advance.side) == (False, "port")
    assert advance.value == of_zigzags["advance"].value
    assert found["overshoot_1_10_10"].measured == pytest.approx(4.9, abs=0.1)
    assert found["overshoot_1_20_20"].measured is None

    other = turning_circle(ship, 35.0, duration=1200.0, dt=1.0)
    passed = with_measured(of_zigzags, ship, [turn, other])["advance"]
    assert (passed.passed, passed.decided_by) == (True, "trials")
    assert passed.probability > 0.999
    strict = {"advance": replace(of_zigzags["advance"], limit=2.0)}
    failed = with_measured(strict, ship, [turn])["advance"]
    assert failed.passed is False
    assert failed.probability < 1e-3


def test_the_turn_is_that_of_the_rudder_s_own_limit(of_zigzags):
    assert of_zigzags["advance"].manoeuvre == "35 deg turn"
    ship = load_model("mariner")
    ship = replace(ship, steering=replace(ship.steering, rudder_limit_deg=30.0))
    assert imo_assessment(ship)["advance"].manoeuvre == "30 deg turn"


def test_a_draw_that_spins_as_no_ship_can_has_no_index():
    ship = load_model("mariner")
    spins = replace(
        ship, coefficients=ship.coefficients | {"N_d": 10.0 * ship.coefficients["N_d"]}
    )
    circle = standard_manoeuvres(ship)["turning circle 35 deg to starboard"]
    assert circle.evaluate(ship).advance_lengths > 3.0
    with pytest.raises(UnstableModelError, match="runs away after"):
        circle.evaluate(spins)


@pytest.mark.parametrize(
    ("share", "passed"), [(0.98, True), (0.97, None), (0.03, None), (0.02, False)]
)
def test_draws_decide_where_97_and_a_half_per_cent_are_on_one_side(share, passed):
    drawn = np.where(np.arange(1000) < 1000 * share, 1.0, 9.0)
    index = IndexInterval(1.0, drawn, np.zeros(1000, dtype=bool))
    rule = replace(RULES["overshoot_1_20_20"], limit=2.0)
    found = criterion_of(rule, [Side("port", index)], "20/20 zigzag")
    assert found.passed == passed


@pytest.mark.parametrize(("distance", "outside"), [(1.14, False), (1.16, True)])
def test_a_manoeuvre_is_outside_beyond_115_per_cent_of_the_envelope_up_to_half_a_turn(
    distance, outside
):
    seen = []

    def of(u, v, r, delta):
        seen.append((len(u), r.tolist(), delta[-1]))
        return np.full(len(u), distance)

    psi = np.radians([5.0, 90.0, 184.0, 186.0, 200.0])
    channels = {"psi": psi, "u": np.ones(5), "v": np.ones(5), "delta": np.arange(5.0)}
    trial = Trial(np.arange(5.0), channels)
    model = SimpleNamespace(envelope=SimpleNamespace(distance=of))
    assert (
        outside_envelope(model, SimpleNamespace(outcome=None, sail=lambda _: trial))
        == outside
    )
    assert seen == [(3, [0.0, 0.0, 0.0], 2.0)]


def test_a_measured_turn_has_the_rudder_within_a_degree_and_a_tenth_of_the_speed():
    ship = load_model("kvlcc2")
    turn = turning_circle(ship, -35.0, duration=1200.0, dt=1.0)
    for rudder, speed, counts in (
        (34.05, 1.0, True),
        (33.95, 1.0, False),
        (35.0, 0.905, True),
        (35.0, 0.895, False),
    ):
        changed = {name: speed * turn[name] for name in ("u", "v")}
        changed |= {
            name: rudder / 35.0 * turn[name] for name in ("delta", "delta_command")
        }
        assert (
            "advance" in measured_indices(ship, turn.with_channels(changed))
        ) == counts


@pytest.mark.parametrize(
    ("channel", "most"),
    [("u", 1.5 * 7.7175), ("v", 7.7175), ("r", 3.0 * 7.7175 / 160.93)],
)
def test_no_ship_is_half_as_fast_again_or_turns_three_radians_a_length(channel, most):
    ship = load_model("mariner")
    for share, wild in ((0.99, False), (-1.01, True)):
        trial = Trial([0.0, 1.0, 2.0], {channel: [0.0, share * most, 0.0]})
        if not wild:
            check_physical(ship, trial)
            continue
        with pytest.raises(
            UnstableModelError, match=rf"runs away after 1\.0 s \({channel} = -"
        ) as away:
            check_physical(ship, trial)
        assert (away.value.time_s, away.value.state) == (1.0, {channel: share * most})


def test_standard_manoeuvres_last_forty_ship_lengths_in_steps_of_a_fiftieth():
    second = 160.93 / 7.7175
    turn = standard_manoeuvres(load_model("mariner"))[
        "turning circle 35 deg to starboard"
    ].sail(load_model("mariner"))
    np.testing.assert_allclose(turn.t, second / 50.0 * np.arange(2001))
