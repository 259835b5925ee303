"""Estimators and searches give the numbers and words that they gave when these were recorded."""

import pytest

from tests.golden import estimators
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", estimators.PARTS.cases())
def test_estimators_are_the_golden_ones(case):
    assert beyond_tolerance("estimators", case) == []


@pytest.mark.parametrize("case", estimators.PARTS.cases())
def test_estimators_say_the_golden_words(case):
    assert same_text(f"estimators/{case}", estimators.PARTS.texts(case))
