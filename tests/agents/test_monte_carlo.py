"""Monte Carlo gives the same in this process, in others, resumed, and draw by draw."""

from dataclasses import fields

import numpy as np
import pytest

from agents import LQ, PID
from agents.jobs import JobEngine
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
    assert [draw.coefficients for draw in one.draws] == [
        draw.coefficients for draw in other.draws
    ]
    np.testing.assert_array_equal(one.course_unstable, other.course_unstable)
    np.testing.assert_array_equal(one.manoeuvres.unstable, other.manoeuvres.unstable)
    for name, criterion in one.manoeuvres.criteria.items():
        np.testing.assert_array_equal(
            criterion.drawn.values, other.manoeuvres.criteria[name].drawn.values
        )
    for a, b in zip(one.episodes, other.episodes, strict=True):
        for item in fields(a):
            np.testing.assert_array_equal(getattr(a, item.name), getattr(b, item.name))


def test_two_workers_give_the_same_and_what_they_did_is_resumed(
    found, ship, pilots, tmp_path
):
    told = []
    engine = JobEngine(workers=2, keep=tmp_path)
    assert_same(
        monte_carlo(pilots, ship, DRAWS, SEED, where=engine, progress=told.append),
        found,
    )
    assert told == sorted(told)
    assert (told[0], told[-1]) == (0, DRAWS)
    assert set(told) <= {0, 25, DRAWS}  # 25 in a job
    told.clear()
    assert_same(
        monte_carlo(
            pilots,
            ship,
            DRAWS,
            SEED,
            where=JobEngine(keep=tmp_path),
            progress=told.append,
        ),
        found,
    )
    assert told == [DRAWS]


def test_wrong_arguments(ship, pilots):
    with pytest.raises(InputError, match="expected a covariance"):
        monte_carlo([], load_model("mariner"), 10)
    with pytest.raises(InputError, match=r"draws: expected.*got 1"):
        monte_carlo(pilots, ship, 1)
    with pytest.raises(InputError, match="Did you mean 'local'"):
        JobEngine("lokal")
