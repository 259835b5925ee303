import numpy as np
import pytest
from papers import get_paper, song2020
from papers.song2020_container import (
    PROPULSION,
)


@pytest.fixture(scope="module")
def rows():
    return list(get_paper("song2020").rows())


def quantities(rows, *cases):
    return [row for row in rows if row.case in cases]


def test_every_aim_is_met(rows):
    assert [row for row in rows if row.met is False] == []
    assert sum(row.met is True for row in rows) > 50


def test_nomoto_s_coefficients_come_within_a_thousandth(rows):
    tables = quantities(rows, "Table 3-3", "Table 3-4", "Figure 3.4", "Figure 3.5")
    assert len(tables) == 18
    assert all(row.best < 0.1 for row in tables)


def test_the_printed_means_are_those_of_the_printed_errors(rows):
    means = {
        row.quantity: row.printed for row in rows if row.quantity.startswith("mean by")
    }
    assert means == {
        "mean by SG: error, %": pytest.approx(4.05),
        "mean by NISG: error, %": pytest.approx(1.02),
    }
    linear = [
        row.printed
        for row in rows
        if row.case == "Table 3-3" and row.quantity.startswith("mean")
    ]
    assert linear == pytest.approx([52.0, 18.8])


def test_with_the_noise_of_instruments_they_come_within_one_per_cent(rows):
    noisy = quantities(rows, "Section 3.1")
    assert len(noisy) == 5
    assert all(row.best < 1.0 for row in noisy)


def test_the_printed_innovation_only_shortens_the_steps():
    """tanh(omega e) of an acceleration is omega e: the path of SG with longer steps."""
    X, y = song2020.regression("nomoto", song2020.trial("nomoto"))
    bent, largest = song2020.gradient(X[:2000], y[:2000], omega=0.5)
    short, _ = song2020.gradient(X[:2000], y[:2000], gain=0.5)
    assert largest < 1e-3
    np.testing.assert_allclose(bent, short, rtol=1e-4)


def test_propeller_and_rudder_come_out_near_the_container_ship_s(rows):
    for name, (_, _, true) in PROPULSION.items():
        row = next(row for row in rows if row.quantity == name)
        assert row.best == pytest.approx(true, rel=0.12), name
        assert row.as_paper == pytest.approx(true, rel=0.12), name


def test_the_printed_innovation_is_even_and_fails_where_the_odd_one_converges(rows):
    found = {
        row.quantity: row.as_paper
        for row in rows
        if row.case == "Equations 4-9 to 4-12"
    }
    assert len(found) == 4
    for quantity, error in found.items():
        assert (abs(error) < 2.0) == ("odd" in quantity)


def test_knowing_the_seas_halves_every_error_at_least(rows):
    seas = [row for row in rows if row.case == "Sea state 2 to 3"]
    assert len(seas) == 8
    for known, left_in in zip(seas[::2], seas[1::2], strict=True):
        assert known.met
        assert known.best < 0.5 * left_in.best
