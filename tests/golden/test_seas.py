"""Forces, spectra, filters and sensors give the numbers that they gave when they were recorded."""

import pytest

from tests.golden import seas
from tests.golden.record import beyond_tolerance


@pytest.mark.parametrize("case", seas.cases())
def test_seas_are_the_golden_ones(case):
    assert beyond_tolerance("seas", case) == []
