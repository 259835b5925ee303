"""Samples, filters, forces, current and wind give the numbers and words that they gave when recorded."""

import pytest

from tests.golden import regression
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", regression.PARTS.cases())
def test_regression_are_the_golden_ones(case):
    assert beyond_tolerance("regression", case) == []


@pytest.mark.parametrize("case", regression.PARTS.cases())
def test_regression_say_the_golden_words(case):
    assert same_text(f"regression/{case}", regression.PARTS.texts(case))
