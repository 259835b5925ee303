"""The quick part of the golden results; all of them: `python tests/golden/record.py --compare`."""

import pytest

from tests.golden.record import RESULTS, compared, run_section
from tests.golden.store import load

QUICK = [
    ("environments", "CourseKeeping"),
    ("environments", "PathFollowing"),
    ("environments", "CourseKeeping single"),
    ("derivatives", "mariner-tls-svm"),
]


@pytest.mark.parametrize(("section", "case"), QUICK)
def test_results_are_the_golden_ones(section, case):
    stored = {case: load(RESULTS / f"{section}.npz")[case]}
    deviations = compared(section, stored, run_section(section, stored))
    assert [one for one in deviations if one.excess > 1.0] == []
