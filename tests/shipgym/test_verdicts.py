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
)
from shipgym.manoeuvres.intervals import IndexInterval
from shipgym.manoeuvres.registry import check_physical
from shipgym.manoeuvres.verdicts import (
    decided_by_model,
    measured_indices,
    outside_envelope,
    with_measured,
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
        assert criterion.note.endswith(
            "outside the envelope of the trials; run a 35 deg turn to both sides"
        )
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
    middle = replace(one, limit=sum(one.interval) / 2.0)
    found = decided_by_model(middle, "20/20 zigzag", outside=False)
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
def test_draws_decide_where_97_and_a_half_per_cent_are_on_one_side(
    of_zigzags, share, passed
):
    drawn = np.where(np.arange(1000) < 1000 * share, 1.0, 9.0)
    index = IndexInterval(
        1.0 if share > 0.5 else 9.0, drawn, np.zeros(1000, dtype=bool)
    )
    one = replace(
        of_zigzags["overshoot_1_20_20"], drawn=index, limit=2.0, passed=share > 0.5
    )
    assert decided_by_model(one, "20/20 zigzag", outside=False).passed == passed


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
