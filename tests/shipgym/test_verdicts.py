"""A criterion has a verdict only where the trials decide it."""

from dataclasses import replace

import pytest

from shipgym import UnstableModelError, load_model
from shipgym.manoeuvres import imo_assessment, standard_manoeuvres, turning_circle, turning_indices, zigzag
from shipgym.manoeuvres.imo import with_measured


@pytest.fixture(scope="module")
def of_zigzags():
    """KVLCC2, identified from zigzags up to 20 degrees."""
    return imo_assessment(load_model("kvlcc2-rm-svm"), n_draws=20)


def test_a_turn_outside_the_envelope_of_the_trials_is_not_decided(of_zigzags):
    for name in ("advance", "tactical_diameter"):
        criterion = of_zigzags[name]
        assert (criterion.decided, criterion.passed, criterion.probability) == (False, None, None)
        assert criterion.note.endswith("outside the envelope of the trials; run a 35 deg turn to both sides")
        assert criterion.interval[0] <= criterion.value <= criterion.interval[1]
    told = of_zigzags["advance"].to_dict()
    assert told["decided"] is False
    assert told["probability"] is told["measured"] is None


def test_within_the_trials_the_interval_decides(of_zigzags):
    criterion = of_zigzags["overshoot_1_20_20"]
    assert criterion.interval[1] < criterion.limit
    assert (criterion.decided, criterion.passed, criterion.probability) == (True, True, 1.0)


def test_an_interval_on_both_sides_of_the_limit_decides_nothing(of_zigzags):
    from shipgym.manoeuvres.imo import _decided

    one = of_zigzags["overshoot_1_20_20"]
    middle = replace(one, limit=sum(one.interval) / 2.0)
    found = _decided(middle, "20/20 zigzag", outside=False)
    assert not found.decided
    assert "both sides of the limit; run a 20/20 zigzag" in found.note


def test_a_measured_manoeuvre_goes_before_the_model(of_zigzags):
    ship = load_model("kvlcc2")
    turn = turning_circle(ship, -35.0, duration=1200.0, dt=1.0)
    small = turning_circle(ship, 20.0, duration=1200.0, dt=1.0)
    weave = zigzag(ship, 10, 10, duration=900.0, dt=1.0)
    found = with_measured(of_zigzags, ship, [turn, small, weave])
    advance = found["advance"]
    assert advance.measured == turning_indices(turn, 320.0).advance_lengths
    assert (advance.decided, advance.passed, advance.probability) == (True, True, 1.0)
    assert advance.value == of_zigzags["advance"].value
    assert found["overshoot_1_10_10"].measured == pytest.approx(4.9, abs=0.1)
    assert found["overshoot_1_20_20"].measured is None
    strict = {"advance": replace(of_zigzags["advance"], limit=2.0)}
    failed = with_measured(strict, ship, [turn])["advance"]
    assert (failed.passed, failed.probability) == (False, 0.0)


def test_the_turn_is_that_of_the_rudder_s_own_limit(of_zigzags):
    assert of_zigzags["advance"].manoeuvre == "35 deg turn"
    ship = load_model("mariner")
    ship = replace(ship, steering=replace(ship.steering, rudder_limit_deg=30.0))
    assert imo_assessment(ship)["advance"].manoeuvre == "30 deg turn"


def test_a_draw_that_spins_as_no_ship_can_has_no_index():
    ship = load_model("mariner")
    spins = replace(ship, coefficients=ship.coefficients | {"N_d": 10.0 * ship.coefficients["N_d"]})
    circle = standard_manoeuvres(ship)["turning circle 35 deg to starboard"]
    assert circle.evaluate(ship).advance_lengths > 3.0
    with pytest.raises(UnstableModelError, match="runs away after"):
        circle.evaluate(spins)
