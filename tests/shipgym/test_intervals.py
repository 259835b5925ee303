"""Indices with their intervals over the posterior, and what is judged by them."""

from dataclasses import replace

import numpy as np
import pytest

from shipgym import load_model, manoeuvres
from shipgym.manoeuvres import IndexInterval
from shipgym.manoeuvres.imo import assess_draws
from shipgym.manoeuvres.intervals import intervals_of


@pytest.fixture(scope="module")
def identified():
    return load_model("mariner-tls-svm")


def test_the_interval_is_that_of_the_linearised_index(identified):
    """For small uncertainty an index is linear in the coefficients.

    Its spread is root(g' S g).
    """
    covariance = 1e-2 * identified.covariance
    model = replace(identified, covariance=covariance)
    found = manoeuvres.index_intervals(
        model, "turning circle 35 deg to starboard", n_draws=300, seed=0
    )
    names, deviations = list(model.coefficients), np.sqrt(np.diag(covariance))
    judged = manoeuvres.standard_manoeuvres(model)[
        "turning circle 35 deg to starboard"
    ].evaluate

    def advance(name, change):
        moved = {**model.coefficients, name: model.coefficients[name] + change}
        return judged(replace(model, coefficients=moved)).advance_lengths

    slope = np.array(
        [
            (advance(n, d) - advance(n, -d)) / (2 * d)
            for n, d in zip(names, deviations, strict=True)
        ]
    )
    expected = np.sqrt(slope @ covariance @ slope)
    assert np.std(found["advance_lengths"].values) == pytest.approx(expected, rel=0.15)


def test_draws_that_run_away_or_never_reach_are_counted():
    ship = load_model("mariner")
    wild = replace(
        ship, coefficients=ship.coefficients | {"N_r": 5e-3}
    )  # yaw that feeds itself
    numb = {
        name: 0.0 if "d" in name.split("_")[1] else value
        for name, value in ship.coefficients.items()
    }
    numb = replace(
        ship,
        coefficients=numb
        | dict.fromkeys(("Y_0", "N_0", "Y_0u", "N_0u", "Y_0uu", "N_0uu"), 0.0),
    )
    name = "turning circle 35 deg to starboard"
    manoeuvre = manoeuvres.standard_manoeuvres(ship)[name]
    own = {name: {"advance_lengths": manoeuvre.evaluate(ship).advance_lengths}}
    found = intervals_of(
        own,
        [ship, wild, numb, ship],
        {name: lambda s: _only_advance(manoeuvre.evaluate(s))},
    )
    index = found[name]["advance_lengths"]
    assert (index.n_ran_away, index.n_never_reached) == (1, 1)
    assert "1 of 4 draws ran away, 1 of 4 draws did not finish" in str(index)
    criterion = assess_draws(ship, [ship, wild, numb, ship])["advance"]
    assert np.sum(criterion.drawn.values <= criterion.limit) == 2


def _only_advance(indices):
    from dataclasses import make_dataclass

    return make_dataclass("Advance", ["advance_lengths"])(indices.advance_lengths)


def test_an_identified_ship_is_judged_with_intervals(identified):
    criteria = manoeuvres.imo_assessment(identified, n_draws=20)
    low, high = criteria["advance"].interval
    assert low < criteria["advance"].value < high < criteria["advance"].limit
    assert criteria["advance"].probability == 1.0
    assert criteria["tactical_diameter"].probability == 0.0


def index(value, values, ran_away=(), is_size=True):
    return IndexInterval(
        value,
        np.array(values, dtype=float),
        np.isin(np.arange(len(values)), ran_away),
        is_size,
    )


@pytest.mark.parametrize(
    ("value", "draws", "is_size", "interval"),
    [
        (5.35, [0.0, 4.0], True, (0.1, 5.35)),  # it contains its own estimate
        (1.0, [2.0, 4.0], True, (1.0, 3.95)),
        (2.0, [-1.0, 4.0], True, (0.1, 3.9)),  # no negative bound of a diameter
        (2.0, [np.nan, np.nan], True, (2.0, None)),
        (None, [2.0, 2.0], True, (2.0, None)),  # the model itself ran away
        (None, [np.nan, np.nan], True, None),
        (-1.0, [-3.0, 3.0], False, (-2.85, 2.85)),  # a drift angle has a sign
        (1.0, [2.0, np.nan], False, None),  # and no end where runaways belong
        (None, [2.0, 2.0], False, None),
        (1.0, [], True, None),
    ],
)
def test_an_interval_counts_all_draws_and_contains_its_estimate(
    value, draws, is_size, interval
):
    found = index(value, draws, is_size=is_size).interval
    assert found == (interval if interval is None else pytest.approx(interval))
