"""What a verification finds is what was recorded."""

import pytest

from tests.golden import verification
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", verification.cases())
def test_what_is_found_of_a_ship_is_golden(case):
    """Draws, tracks, standards and figures are what they were when this was recorded."""
    assert beyond_tolerance("verification", case) == []


def test_what_is_said_of_a_ship_is_golden():
    """Why models are refused, and the verdict on one that is not, are in the words that were recorded."""
    assert same_text("verification", verification.said())
