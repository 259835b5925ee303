"""Manoeuvres run, and are judged, as they once were, and refusals have the words that they had."""

import pytest

from tests.golden.indices import QUESTIONS
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", QUESTIONS.cases())
def test_manoeuvres_are_what_they_were(case):
    assert beyond_tolerance("indices", case) == []
    assert same_text(f"indices {case}", QUESTIONS.told(case))
