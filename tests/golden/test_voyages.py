"""Short episodes with every setting away from its default show what they showed when they were recorded."""

import pytest

from tests.golden import voyages
from tests.golden.record import beyond_tolerance


@pytest.mark.parametrize("case", voyages.cases())
def test_voyages_are_the_golden_ones(case):
    assert beyond_tolerance("voyages", case) == []
