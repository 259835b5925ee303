import numpy as np
import pytest
from papers import get_paper
from papers.cao2015 import FORCES, as_printed, errors, printed_errors


@pytest.fixture(scope="module")
def rows():
    return list(get_paper("cao2015").rows())


def test_all_forty_derivatives_come_within_one_per_cent(rows):
    tables = [
        row for row in rows if row.case.startswith("Table") and row.met is not None
    ]
    assert len(tables) == 80
    assert all(row.best < 0.1 and row.met for row in tables)


def test_predictions_by_the_best_model_are_within_a_thousandth_of_the_span(rows):
    figures = [row for row in rows if row.case.startswith("Figures")]
    assert len(figures) == 24
    assert all(row.best < 0.1 and row.met for row in figures)


@pytest.mark.parametrize("samples", ["integral", "euler"])
def test_their_way_fails_where_and_as_much_as_printed(samples):
    printed = {
        name: error
        for q in FORCES
        for name, error in printed_errors(samples, q).items()
    }
    ours = errors(as_printed(samples))
    assert printed.keys() == ours.keys()
    decades = [np.log10((ours[name] + 1.0) / (printed[name] + 1.0)) for name in printed]
    assert abs(np.median(decades)) < 0.1
    worst = max(printed, key=printed.get)
    assert worst == "Y_vdd"
    assert ours[worst] == pytest.approx(printed[worst], rel=0.1)


def test_84_of_the_86_printed_figures_come_out(rows):
    agree = [row.agrees for row in rows if row.printed is not None]
    assert len(agree) == 86
    assert sum(agree) >= 84


def test_what_the_columns_hold_decides_the_errors(rows):
    """With r for r L the penalty drives X_rr away."""
    found = [row.as_paper for row in rows if " with r and not " in row.quantity]
    assert len(found) == 2
    assert min(found) > 80.0
