"""Ships move, convert, scale and are read as they once did, and refusals have the words that they had."""

import pytest

from tests.golden.models import QUESTIONS
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", QUESTIONS.cases())
def test_ships_are_what_they_were(case):
    assert beyond_tolerance("models", case) == []
    assert same_text(f"models {case}", QUESTIONS.told(case))
