"""A criterion has a verdict only where the trials decide it."""

from dataclasses import replace

import numpy as np
import pytest
from sensors import Sensors

from shipgym import InputError, Trial, UnstableModelError, load_model
from shipgym.manoeuvres import (
    Criterion,
    IndexInterval,
    imo_assessment,
    standard_manoeuvres,
    turning_circle,
    turning_indices,
    zigzag,
    zigzag_indices,
)
from shipgym.manoeuvres.criteria import (
    Side,
    chances_of,
    trials_to_run,
    with_measured,
)
from shipgym.manoeuvres.imo_rules import RULES
from shipgym.manoeuvres.measured import (
    MeasuredIndex,
    measured_by,
    measured_in_file,
    measured_indices,
)


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
        assert "it is outside the envelope of the trials" in criterion.note
        assert len(criterion.deciding_trials) == 2
        assert criterion.interval[0] <= criterion.value <= criterion.interval[1]
    assert "35 deg turn to both sides" in trials_to_run(of_zigzags)
    told = of_zigzags["advance"].to_dict()
    assert told["decided"] is False
    assert told["probability"] is told["measured"] is None


def test_a_structure_without_speed_decides_no_turn():
    model = load_model("mariner-nomoto")
    found = imo_assessment(model, n_draws=20)
    for name in ("advance", "tactical_diameter"):
        assert not found[name].decided
        assert "or of the structure" in found[name].note


def test_within_the_trials_the_interval_decides(of_zigzags):
    criterion = of_zigzags["overshoot_1_20_20"]
    assert criterion.interval[1] < criterion.limit
    assert (criterion.decided, criterion.passed, criterion.probability) == (
        True,
        True,
        1.0,
    )


def sides_of(starboard, port, spread, /, **measured):
    """Sides of an index with 200 models drawn, and what trials measured."""
    rng = np.random.default_rng(0)
    sides = []
    for name, value in (("starboard", starboard), ("port", port)):
        noise = spread * rng.standard_normal(200)
        drawn = IndexInterval(value, value + noise, np.zeros(200, dtype=bool))
        index = measured.get(name)
        known = None if index is None else MeasuredIndex(*index[:2], name, *index[2:])
        sides.append(Side(name, drawn, measured=known))
    return sides


def overshoot(*args, limit=13.8, **measured):
    rule = replace(RULES["overshoot_1_10_10"], limit=limit)
    return Criterion(rule, "10/10 zigzag", tuple(sides_of(*args, **measured)))


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
    assert repr(found) == (
        "15 [13.32, 17.24], measured 12.10±0.10 starboard; limit 13.8 deg: not decided"
    )
    assert found.note == (
        "not decided by these trials: it was measured to starboard alone, and"
        " otherwise the models drawn lie on both sides of the limit"
    )


def test_a_trial_to_one_side_decides_a_failure():
    found = overshoot(12.0, 12.0, 2.0, port=(14.5, 0.1))
    assert found.decided
    assert found.passed is False
    assert found.probability < 1e-6
    assert found.side == "port"


@pytest.mark.parametrize(("error", "passed"), [(0.1, True), (0.3, None), (0.03, True)])
def test_a_measured_margin_counts_against_its_error(error, passed):
    found = overshoot(12.0, 12.0, 1.0, starboard=(13.4, error), port=(12.0, error))
    assert found.passed == passed
    if passed is None:
        assert "13.40 was measured with a standard error of 0.3" in found.note
        assert found.deciding_trials == ()


def test_a_model_that_is_off_on_one_side_is_off_on_the_other():
    close = sides_of(11.0, 11.0, 0.2, starboard=(11.0, 0.1))
    off = sides_of(8.0, 11.0, 0.2, starboard=(11.0, 0.1))
    assert chances_of(close, 13.8).passes > 0.999
    assert chances_of(off, 13.8).passes < 0.8


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


@pytest.mark.parametrize("wander_deg", [0.4, 2.5])
def test_an_overshoot_is_known_as_well_as_the_course_of_the_approach(wander_deg):
    ship = load_model("container")
    run = zigzag(ship, 10, 10, duration=500.0, dt=1.0)
    before = np.arange(60)
    channels = {
        name: np.concatenate([np.full(60, values[0]), values])
        for name, values in ((name, run[name]) for name in ("psi", "u", "v", "delta"))
    }
    channels["delta"][:60] = 0.0
    channels["psi"][:60] += np.radians(wander_deg * np.sin(0.1 * before))
    t = np.arange(60 + len(run), dtype=float)
    wandering = Trial(t, channels, kind="zigzag")
    index = measured_indices(ship, wandering)["overshoot_1_10_10"]
    assert index.error == pytest.approx(wander_deg / np.sqrt(2.0), rel=0.3)
    own = zigzag_indices(run).overshoot_1_deg
    assert abs(index.value - own) < 2.0 * index.error


def test_a_measured_manoeuvre_goes_before_the_model(of_zigzags):
    ship = load_model("kvlcc2")
    turn = turning_circle(ship, -35.0, duration=1200.0, dt=1.0)
    small = turning_circle(ship, 20.0, duration=1200.0, dt=1.0)
    weave = zigzag(ship, 10, 10, duration=900.0, dt=1.0)
    found = with_measured(of_zigzags, measured_by(ship, [turn, small, weave], {}))
    advance = found["advance"]
    own = turning_indices(turn, 320.0).advance_lengths
    assert advance.measured == pytest.approx(own, abs=0.01)
    assert (advance.decided, advance.side) == (False, "port")
    assert advance.value == of_zigzags["advance"].value
    assert found["overshoot_1_10_10"].measured == pytest.approx(4.9, abs=0.1)
    assert found["overshoot_1_20_20"].measured is None

    other = turning_circle(ship, 35.0, duration=1200.0, dt=1.0)
    passed = with_measured(of_zigzags, measured_by(ship, [turn, other], {}))["advance"]
    assert passed.passed
    assert passed.probability > 0.999
    rule = replace(RULES["advance"], limit=2.0)
    strict = {"advance": replace(of_zigzags["advance"], rule=rule)}
    failed = with_measured(strict, measured_by(ship, [turn], {}))["advance"]
    assert failed.passed is False
    assert failed.probability < 1e-3


def test_what_trials_measured_travels_in_the_model_file():
    index = {"value": 3.0, "error": 0.1, "side": "port", "predicted": 3.1}
    provenance = {
        "trials": [{"name": "turn"}],
        "measured": {"turn": {"advance": index}},
    }
    ship = replace(load_model("kvlcc2"), provenance=provenance)
    assert measured_in_file(ship) == [("advance", MeasuredIndex(**index))]
    both = {"advance": index, "overshoot_1_10_10": index}
    for name, wrong, message in (
        ("measured", {"other": {"advance": index}}, "measured: .*'other'"),
        ("measured", {"turn": both}, "turn: expected indices of one manoeuvre"),
        ("measured", {"turn": {"advance": index | {"side": "aft"}}}, "advance side: "),
        ("measured", {"turn": {"advanse": index}}, "turn: .*Did you mean 'advance'"),
        ("trials", "turn", "trials: expected a list of tables, got 'turn'"),
        ("trials", ["turn"], "trials: expected a table"),
        ("trials", [{}], "trials name: expected a non-empty string"),
    ):
        known = replace(ship, provenance=provenance | {name: wrong})
        with pytest.raises(InputError, match=rf"kvlcc2: provenance\..*{message}"):
            measured_in_file(known)


def test_a_model_whose_interval_excludes_a_measurement_is_at_fault():
    found = overshoot(1.8, 1.8, 0.1, starboard=(1.45, 0.02))
    assert "the model is at fault" in found.note
    near = overshoot(1.8, 1.8, 0.1, starboard=(1.75, 0.02))
    assert "at fault" not in near.note


def test_a_trial_that_was_sailed_otherwise_accuses_no_model():
    """By the trial's own rudder the model says what was measured."""
    found = overshoot(1.8, 1.8, 0.1, starboard=(1.45, 0.02, 1.48))
    assert "at fault" not in found.note


def test_a_draw_that_spins_as_no_ship_can_has_no_index():
    ship = load_model("mariner")
    spins = replace(
        ship, coefficients=ship.coefficients | {"N_d": 10.0 * ship.coefficients["N_d"]}
    )
    circle = standard_manoeuvres(ship)["turning circle 35 deg to starboard"]
    assert circle.evaluate(ship).advance_lengths > 3.0
    with pytest.raises(UnstableModelError, match="runs away after"):
        circle.evaluate(spins)
