"""Monte Carlo gives the same in this process, in others, resumed, and draw by draw."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from agents import LQ, PID, sail
from agents.jobs import JobEngine
from agents.verification.index_uncertainty import (
    NominalRuns,
    SailedDraws,
    joined,
    nominal_runs,
    sail_draws,
    uncertainty_of,
    with_paths,
)
from agents.verification.monte_carlo import draw_jobs, monte_carlo
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
    np.testing.assert_array_equal(
        one.manoeuvres.zigzag_headings, other.manoeuvres.zigzag_headings
    )
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


def test_jobs_change_nothing_in_what_is_sailed(found, ship, pilots):
    drawn = ship.sample(DRAWS, SEED)
    together = sail(pilots[1], drawn, seeds=SEED + np.arange(DRAWS))
    np.testing.assert_array_equal(found.episodes[1].cost, together.cost)
    whole = uncertainty_of(ship, nominal_runs(ship), sail_draws(ship, drawn))
    for name, criterion in whole.criteria.items():
        assert criterion.to_dict() == found.manoeuvres.criteria[name].to_dict()
    for one, other in zip(
        whole.circle_paths, found.manoeuvres.circle_paths, strict=True
    ):
        np.testing.assert_array_equal(one, other)


def test_wrong_arguments(ship, pilots):
    with pytest.raises(InputError, match="expected a covariance"):
        monte_carlo([], load_model("mariner"), 10)
    with pytest.raises(InputError, match=r"draws: expected.*got 1"):
        monte_carlo(pilots, ship, 1)
    with pytest.raises(InputError, match="Did you mean 'local'"):
        JobEngine("lokal")


def test_draws_are_shared_out_in_jobs_of_25_that_go_on_with_the_seeds(ship):
    drawn = ship.sample(51, 0)
    jobs = draw_jobs([], ship, drawn, 7)
    assert [len(job["names"]) for job in jobs] == [25, 25, 1]
    assert [job["first_seed"] for job in jobs] == [7, 32, 57]
    assert [name for job in jobs for name in job["names"]] == [
        draw.name for draw in drawn
    ]
    rows = [row for job in jobs for row in job["coefficients"]]
    assert rows == [list(draw.coefficients.values()) for draw in drawn]


def test_runs_are_kept_for_25_and_30_lengths_and_the_circle_within_the_rudder_s_limit(
    ship,
):
    narrow = replace(ship, steering=replace(ship.steering, rudder_limit_deg=25.0))
    time = ship.particulars["length"] / ship.particulars["speed"]
    for model, rudder in ((ship, 35.0), (narrow, 25.0)):
        zigzag, circle = nominal_runs(model)
        assert np.degrees(np.abs(circle["delta"]).max()) == pytest.approx(
            rudder, abs=1e-6
        )
        assert np.degrees(np.abs(zigzag["delta"]).max()) == pytest.approx(
            20.0, abs=1e-6
        )
        assert (zigzag.t[-1] / time, circle.t[-1] / time) == pytest.approx(
            (25.0, 30.0), abs=0.11
        )
        assert np.diff(circle.t) == pytest.approx(0.1 * time)


def sailed(count, lost=()):
    """Draws, some without runs that are kept; headings and paths by their number."""
    numbers = [np.full((3, 2), float(k)) for k in range(count) if k not in lost]
    return SailedDraws(
        values={"turn": {"advance": np.arange(float(count))}},
        ran_away={"turn": np.zeros(count, dtype=bool)},
        lost=np.isin(np.arange(count), lost),
        headings=numbers,
        paths=numbers,
    )


def criteria_of(*ran_away):
    """Criteria, some with draws that run away, one that could not be sailed."""
    drawn = [SimpleNamespace(drawn=SimpleNamespace(ran_away=row)) for row in ran_away]
    return dict(enumerate([*drawn, SimpleNamespace(drawn=None)]))


def test_draws_that_run_away_in_any_manoeuvre_count_once_and_have_no_paths(ship):
    """Of seven draws the second runs away in one criterion, the fifth has no runs."""
    away = np.arange(7) == 1
    criteria = criteria_of(away, np.zeros(7, dtype=bool))
    found = with_paths(criteria, NominalRuns("zigzag", "circle"), sailed(7, [4]))
    assert found.unstable.tolist() == [False, True, False, False, True, False, False]
    numbers = [path[0, 0] for path in found.circle_paths]
    assert numbers == found.zigzag_headings[:, 0, 0].tolist() == [0, 2, 3, 5, 6]
    assert (found.zigzag, found.circle) == ("zigzag", "circle")


def test_parts_are_joined_in_their_order():
    whole = joined([sailed(3, [1]), sailed(2)])
    assert whole.values["turn"]["advance"].tolist() == [0.0, 1.0, 2.0, 0.0, 1.0]
    assert whole.lost.tolist() == [False, True, False, False, False]
    assert [heading[0, 0] for heading in whole.headings] == [0.0, 2.0, 0.0, 1.0]


def test_forty_circles_are_kept_for_the_report_and_all_headings(ship):
    criteria = criteria_of(np.zeros(45, dtype=bool))
    found = with_paths(criteria, NominalRuns("", ""), sailed(45))
    assert [path[0, 0] for path in found.circle_paths] == list(range(40))
    assert len(found.zigzag_headings) == 45
