"""Priors, guards, rankings and advice give the numbers and words that they gave when recorded."""

import pytest

from tests.golden import validation
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_page, same_text


@pytest.mark.parametrize("case", validation.PARTS.cases())
def test_validation_is_the_golden_one(case):
    assert beyond_tolerance("validation", case) == []


@pytest.mark.parametrize("case", validation.PARTS.cases())
def test_validation_says_the_golden_words(case):
    assert same_text(f"validation/{case}", validation.PARTS.texts(case))


def test_a_comparison_shows_the_golden_figures():
    assert same_page("validation/page of comparison", validation.page())
