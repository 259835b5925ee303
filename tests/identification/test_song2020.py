import numpy as np
import pytest
from papers import get_paper, song2020


@pytest.fixture(scope="module")
def rows():
    return list(get_paper("song2020").rows())


def test_every_aim_is_met(rows):
    aims = [row.met for row in rows if row.met is not None]
    assert len(aims) == 20
    assert all(aims)


def test_nomoto_s_coefficients_come_within_a_thousandth(rows):
    tables = [row for row in rows if row.case.startswith("Table")]
    assert len(tables) == 14
    assert all(row.best < 0.1 for row in tables)


def test_the_printed_innovation_only_shortens_the_steps():
    """tanh(omega e) of an acceleration is omega e: the path of SG with longer steps."""
    X, y = song2020.regression("nomoto")
    bent, largest = song2020.gradient(X[:2000], y[:2000], omega=0.5)
    short, _ = song2020.gradient(X[:2000], y[:2000], gain=0.5)
    assert largest < 1e-3
    np.testing.assert_allclose(bent, short, rtol=1e-4)


def test_the_printed_innovation_is_even_and_fails_where_the_odd_one_converges(rows):
    found = {
        row.quantity: row.as_paper
        for row in rows
        if row.case == "Equations 4-9 to 4-12"
    }
    assert len(found) == 4
    for quantity, error in found.items():
        assert (abs(error) < 2.0) == ("odd" in quantity)
