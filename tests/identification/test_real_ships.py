"""The study of measured ships: facts of its data and of how its page is written."""

from __future__ import annotations

from pathlib import Path

import pytest
from real_ships import Data
from real_ships.marin import full_scale
from real_ships.measures import mean_errors, turns, zigzag_errors
from real_ships.mmg import CIRCLES, HSVA, OTHERS, circle, fitted

from identification import PriorKnowledge

SHIPS = Path(__file__).parents[1] / "ships"
MEASURED_RUNS = Path(__file__).parents[2].parent / "shared" / "data"

measured = pytest.mark.skipif(
    not MEASURED_RUNS.is_dir(), reason=f"the measured runs are not at {MEASURED_RUNS}"
)


@pytest.fixture
def data() -> Data:
    return Data(SHIPS, MEASURED_RUNS)


@measured
def test_a_model_keeps_its_turn_when_it_is_taken_to_full_scale(data: Data) -> None:
    hsva, marin = data.ship(HSVA, 20), data.ship("kvlcc2_marin", 10)
    from identification import identify

    model = identify(
        [hsva.runs["Z_20_05"], hsva.runs["Z_30_05"]],
        "steering5",
        particulars=hsva.particulars,
        steering=hsva.steering,
    ).model
    at_full_scale = full_scale(model, marin)
    small, large = turns(model)[0], turns(at_full_scale)[0]
    assert small is not None
    assert large is not None
    assert large.advance_lengths == pytest.approx(small.advance_lengths, rel=0.02)


@measured
def test_the_mmg_form_of_three_zigzags_predicts_the_others_and_the_circle(
    data: Data,
) -> None:
    """Aims: 0.095 deg/s, 4.3 deg of heading, 4 % of diameter, 1.5 deg of drift."""
    hsva = data.ship(HSVA, 4)
    model = fitted(hsva, prior=PriorKnowledge("kvlcc2-l7", 2.0))
    yaw_rate, heading, *_ = mean_errors(
        zigzag_errors(model, hsva.runs[name]) for name in OTHERS
    )
    assert yaw_rate < 0.095
    assert heading < 4.3
    _, diameter, drift, _ = circle(
        full_scale(model, data.ship("kvlcc2_marin", 10)), 1.0
    )
    assert diameter == pytest.approx(CIRCLES[0][1], rel=0.04)
    assert drift == pytest.approx(CIRCLES[0][2], abs=1.5)
