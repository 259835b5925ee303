"""Monte Carlo over the covariance gives the same in this process, in others, resumed, and draw by draw."""

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest

from agents import LQ, PID, sail
from agents.engines.jobs import JobEngine
from agents.verification.index_uncertainty import nominal_runs, sail_draws, uncertainty_of
from agents.verification.monte_carlo import monte_carlo
from shipgym import InputError, load_model

DRAWS, SEED = 28, 3  # two jobs


@pytest.fixture(scope="module")
def ship():
    return load_model("mariner-tls-svm")


@pytest.fixture(scope="module")
def pilots(ship):
    return PID.from_model(ship), LQ.from_model(ship)


@pytest.fixture(scope="module")
def found(ship, pilots):
    return monte_carlo(pilots, ship, DRAWS, SEED)


def assert_same(one, other):
    assert [draw.coefficients for draw in one.draws] == [draw.coefficients for draw in other.draws]
    np.testing.assert_array_equal(one.course_unstable, other.course_unstable)
    np.testing.assert_array_equal(one.manoeuvres.unstable, other.manoeuvres.unstable)
    np.testing.assert_array_equal(one.manoeuvres.zigzag_headings, other.manoeuvres.zigzag_headings)
    for name, criterion in one.manoeuvres.criteria.items():
        np.testing.assert_array_equal(criterion.drawn.values, other.manoeuvres.criteria[name].drawn.values)
    for a, b in zip(one.episodes, other.episodes, strict=True):
        for item in fields(a):
            np.testing.assert_array_equal(getattr(a, item.name), getattr(b, item.name))


def test_two_workers_give_the_same_and_what_they_did_is_resumed(found, ship, pilots, tmp_path):
    told = []
    engine = JobEngine(workers=2, keep=tmp_path)
    assert_same(monte_carlo(pilots, ship, DRAWS, SEED, where=engine, progress=told.append), found)
    assert told == sorted(told)
    assert (told[0], told[-1]) == (0, DRAWS)
    told.clear()
    assert_same(
        monte_carlo(pilots, ship, DRAWS, SEED, where=JobEngine(keep=tmp_path), progress=told.append), found
    )
    assert told == [DRAWS]


def test_jobs_change_nothing_in_what_is_sailed(found, ship, pilots):
    drawn = ship.sample(DRAWS, SEED)
    together = sail(pilots[1], drawn, seeds=SEED + np.arange(DRAWS))
    np.testing.assert_array_equal(found.episodes[1].cost, together.cost)
    whole = uncertainty_of(ship, nominal_runs(ship), [sail_draws(ship, drawn)])
    for name, criterion in whole.criteria.items():
        assert criterion.to_dict() == found.manoeuvres.criteria[name].to_dict()
    for one, other in zip(whole.circle_paths, found.manoeuvres.circle_paths, strict=True):
        np.testing.assert_array_equal(one, other)


def test_wrong_arguments(ship, pilots):
    with pytest.raises(InputError, match="no covariance"):
        monte_carlo([], load_model("mariner"), 10)
    with pytest.raises(InputError, match="draws: 1 found"):
        monte_carlo(pilots, ship, 1)
    with pytest.raises(InputError, match="Did you mean 'local'"):
        JobEngine("lokal").check()


def test_draws_that_run_away_in_any_manoeuvre_count_once_and_have_no_paths(ship, monkeypatch):
    """Of seven draws the second runs away in one criterion, the fifth loses the runs that are kept."""
    module = "agents.verification.index_uncertainty"
    away = np.arange(7) == 1
    criteria = {
        "overshoot": SimpleNamespace(drawn=SimpleNamespace(ran_away=away)),
        "advance": SimpleNamespace(drawn=SimpleNamespace(ran_away=np.zeros(7, dtype=bool))),
        "stop": SimpleNamespace(drawn=None),
    }
    monkeypatch.setattr(f"{module}.imo_manoeuvres", lambda model: {})
    monkeypatch.setattr(f"{module}.imo_criteria", lambda model, found: criteria)
    parts = []
    for part in (np.arange(3), np.arange(3, 7)):
        kept = part[part != 4]
        parts.append({"values": {}, "ran_away": {}, "lost": part == 4, "headings": kept, "paths": kept})
    found = uncertainty_of(ship, ("zigzag", "circle"), parts)
    assert found.criteria.keys() == {"overshoot", "advance"}
    assert found.unstable.tolist() == [False, True, False, False, True, False, False]
    assert found.zigzag_headings.tolist() == list(found.circle_paths) == [0, 2, 3, 5, 6]
    assert (found.zigzag, found.circle) == ("zigzag", "circle")
