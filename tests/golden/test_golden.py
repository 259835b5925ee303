"""The quick part of the golden results; all of them: `python tests/golden/record.py
--compare`."""

import pytest

from tests.golden import ships, voyages
from tests.golden.record import beyond_tolerance

QUICK = [
    ("environments", "CourseKeeping"),
    ("environments", "PathFollowing"),
    ("environments", "CourseKeeping single"),
    *(("voyages", case) for case in voyages.cases()),
    *(("derivatives", ship) for ship in ships.all_ships()),
    *(("identification", method) for method in ("default", "ls", "rm-svm")),
]


@pytest.mark.parametrize(("section", "case"), QUICK)
def test_results_are_the_golden_ones(section, case):
    assert beyond_tolerance(section, case) == []
