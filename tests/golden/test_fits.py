"""Identifications give the numbers and words that they gave when these were recorded."""

import pytest

from tests.golden import fits
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_page, same_text


@pytest.mark.parametrize("case", fits.cases())
def test_fits_are_the_golden_ones(case):
    assert beyond_tolerance("fits", case) == []


@pytest.mark.parametrize("case", fits.cases())
def test_fits_say_the_golden_words(case):
    assert same_text(f"fits/{case}", fits.texts(case))


@pytest.mark.parametrize("case", fits.PAGES)
def test_reports_show_the_golden_figures(case):
    assert same_page(f"fits/page of {case}", fits.page(case))


def test_refusals_are_the_golden_ones():
    assert same_text("fits/refusals", "\n".join(fits.refusals()))
