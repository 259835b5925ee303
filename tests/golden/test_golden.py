"""The quick part of the golden results; all of them: `python tests/golden/record.py --compare`."""

import pytest

from tests.golden.record import beyond_tolerance

QUICK = [
    ("environments", "CourseKeeping"),
    ("environments", "PathFollowing"),
    ("environments", "CourseKeeping single"),
    ("derivatives", "mariner-tls-svm"),
]


@pytest.mark.parametrize(("section", "case"), QUICK)
def test_results_are_the_golden_ones(section, case):
    assert beyond_tolerance(section, case) == []
