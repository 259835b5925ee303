from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.linear_model import Ridge

from identification import (
    LSSVM,
    ArtificialBeeColony,
    DifferentialEvolution,
    GridSearch,
    ParticleSwarm,
    TunedLSSVM,
    minimise,
)
from identification.estimators.by_name import get_optimiser
from identification.estimators.objectives import (
    held_out_error,
    time_blocks,
    training_error,
)
from identification.estimators.optimisers import Colony
from identification.estimators.pattern_search import pattern_search
from identification.estimators.search import Optimiser, Recorder
from shipgym import InputError

Floats = np.ndarray[Any, np.dtype[np.float64]]

OPTIMISERS = [
    ArtificialBeeColony(rounds=150),
    ParticleSwarm(rounds=150),
    GridSearch(points=21, refinements=5),
    DifferentialEvolution(rounds=150),
]
BOX = [(-4.0, 5.0), (-3.0, 6.0)]


def sphere(x: Floats) -> Floats:
    values: Floats = np.sum((x - 1.0) ** 2, axis=1)
    return values


def rastrigin(x: Floats) -> Floats:
    """Hilly, with its only global minimum of 0 at (1, 1)."""
    z = x - 1.0
    values: Floats = np.sum(z**2 - 10.0 * np.cos(2.0 * np.pi * z) + 10.0, axis=1)
    return values


def regression(
    n: int = 400, m: int = 6, noise: float = 1.0, seed: int = 0
) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, m)) @ rng.standard_normal((m, m)) + 1.0
    return X, X @ rng.standard_normal(m) + 3.0 + noise * rng.standard_normal(n)


@pytest.mark.parametrize("optimiser", OPTIMISERS, ids=lambda o: type(o).__name__)
@pytest.mark.parametrize("objective", [sphere, rastrigin])
def test_optimisers_find_the_global_minimum(
    optimiser: Optimiser, objective: Any
) -> None:
    found = optimiser.minimise(objective, BOX, seed=3)
    np.testing.assert_allclose(found.x, [1.0, 1.0], atol=2e-3)
    assert found.value == objective(found.x[None])[0] == found.history[-1]


@pytest.mark.parametrize("name", ["abc", "pso", "grid", "de"])
def test_search_is_a_function_of_its_seed_and_keeps_its_course(name: str) -> None:
    first, again, other = (minimise(rastrigin, BOX, seed, name) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.course, again.course)
    assert name == "grid" or not np.array_equal(first.course, other.course)
    assert np.all(np.diff(first.history) <= 0.0)
    np.testing.assert_array_equal(rastrigin(first.course), first.history)


@pytest.mark.parametrize("optimiser", OPTIMISERS, ids=lambda o: type(o).__name__)
def test_candidates_stay_in_the_box_and_are_counted(optimiser: Optimiser) -> None:
    seen = []

    def outside(x: Floats) -> Floats:
        seen.append(x.copy())
        return sphere(x - 100.0)

    found = optimiser.minimise(outside, BOX)
    tried = np.vstack(seen)
    assert np.all((tried >= [-4.0, -3.0]) & (tried <= [5.0, 6.0]))
    assert found.evaluations == len(tried)
    np.testing.assert_allclose(found.x, [5.0, 6.0], atol=1e-2)


def test_bee_colony_of_zhu_is_20_sources_30_rounds_and_limit_20() -> None:
    colony = ArtificialBeeColony()
    assert (colony.sources, colony.rounds, colony.limit) == (20, 30, 20)
    found = colony.minimise(sphere, BOX)
    assert found.evaluations >= 20 + 30 * (20 + 20)
    assert len(found.history) == 31


def test_scouts_leave_a_barren_source() -> None:
    flat = ArtificialBeeColony(sources=4, rounds=10, limit=3).minimise(
        lambda x: np.ones(len(x)), BOX
    )
    assert flat.evaluations > 4 + 10 * 8


@pytest.mark.parametrize("optimiser", ["abc", DifferentialEvolution(rounds=9)])
def test_values_that_are_not_numbers_are_never_the_best(optimiser: Any) -> None:
    found = minimise(
        lambda x: np.where(x[:, 0] < 1.0, np.nan, sphere(x)), BOX, optimiser=optimiser
    )
    assert found.x[0] >= 1.0
    assert np.isfinite(found.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"optimiser": "acb"}, r"optimiser: .*Did you mean 'abc'"),
        ({"bounds": [(1.0, 0.0)]}, "lower one first"),
        ({"bounds": [(0.0, np.inf)]}, "finite"),
        ({"bounds": (0.0, 1.0)}, r"shape \(2,\)"),
        ({"bounds": [(0.0, 1.0, 2.0)]}, r"shape \(1, 3\)"),
        ({"bounds": np.zeros((0, 2))}, r"shape \(0, 2\)"),
        ({"bounds": "wide"}, r"bounds: .*'wide'"),
        ({"objective": lambda x: x}, "one value for each row"),
        ({"optimiser": ArtificialBeeColony(limit=0)}, "limit: "),
        ({"optimiser": ParticleSwarm(particles=0)}, "particles: "),
        (
            {"optimiser": ParticleSwarm(particles=2**62)},
            r"particles: .*100000",
        ),
        ({"optimiser": GridSearch(points=2)}, "points: "),
        ({"optimiser": DifferentialEvolution(members=1)}, "members: "),
    ],
)
def test_wrong_searches_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        minimise(**{"objective": sphere, "bounds": BOX, **arguments})


@pytest.mark.parametrize("fit_intercept", [True, False])
@pytest.mark.parametrize("scale", [True, False])
def test_held_out_error_is_that_of_fits_one_by_one(
    fit_intercept: bool, scale: bool
) -> None:
    X, y = regression()
    blocks = time_blocks(len(y), 5)
    error = held_out_error(X, y, scale, fit_intercept, blocks)
    for C in (1e-3, 1.0, 1e6):
        squares = []
        for k in range(5):
            away = blocks == k
            estimator = LSSVM(C=C, scale=scale, fit_intercept=fit_intercept).fit(
                X[~away], y[~away]
            )
            squares.extend((y[away] - estimator.predict(X[away])) ** 2)
            if not scale:
                oracle = Ridge(alpha=1.0 / C, fit_intercept=fit_intercept, solver="svd")
                np.testing.assert_allclose(
                    estimator.coef_, oracle.fit(X[~away], y[~away]).coef_, rtol=1e-7
                )
        assert error(np.log10([[C]]))[0] == pytest.approx(np.mean(squares), rel=1e-9)


def test_training_error_falls_with_the_weight_up_to_the_upper_bound() -> None:
    X, y = regression(noise=0.01)
    error = training_error(X, y, True, True)(np.linspace(-2.0, 4.0, 40)[:, None])
    assert np.all(np.diff(error) < 0.0)
    for optimiser in ("abc", "pso", "grid", "de"):
        estimator = TunedLSSVM(
            optimiser=optimiser, objective="training", bounds=(1e-2, 1e4)
        ).fit(X, y)
        assert pytest.approx(1e4, rel=0.1) == estimator.C_


def test_held_out_optimum_is_inside_and_predicts_better_where_data_are_few() -> None:
    rng = np.random.default_rng(4)
    gains = []
    for _ in range(20):
        X = rng.standard_normal((30, 10)) @ (np.eye(10) + 2.0)
        truth = rng.standard_normal(10)
        y = X @ truth + 10.0 * rng.standard_normal(30)
        tuned = TunedLSSVM(
            optimiser="grid", bounds=(1e-5, 1e6), fit_intercept=False
        ).fit(X, y)
        plain = LSSVM(C=np.inf, fit_intercept=False).fit(X, y)
        gains.append(
            np.linalg.norm(plain.coef_ - truth) / np.linalg.norm(tuned.coef_ - truth)
        )
    assert np.median(gains) > 1.5


def test_search_costs_the_same_for_any_number_of_samples() -> None:
    sizes, counts = [], []
    for n in (200, 2000):
        X, y = regression(n)
        error = held_out_error(X, y, True, True, time_blocks(n, 5))
        sizes.append((error.offset.size, error.gain.size, error.squares.size))
        counts.append(TunedLSSVM(optimiser="pso").fit(X, y).search_.evaluations)
    assert sizes[0] == sizes[1]
    assert counts[0] == counts[1]


@given(n=st.integers(2, 300), folds=st.integers(2, 12))
def test_blocks_follow_each_other_in_time_and_are_equally_long(
    n: int, folds: int
) -> None:
    folds = min(folds, n)
    blocks = time_blocks(n, folds)
    assert np.all(np.diff(blocks) >= 0)
    assert np.ptp(np.bincount(blocks, minlength=folds)) <= 1


def test_each_trial_may_be_a_block() -> None:
    np.testing.assert_array_equal(
        time_blocks(5, "trials", [3, 3, 7, 9, 9]), [0, 0, 1, 2, 2]
    )
    with pytest.raises(InputError, match=r"folds: .*2 trials"):
        time_blocks(5, "trials", [3] * 5)
    with pytest.raises(InputError, match=r"folds: .*samples \(5\)"):
        time_blocks(5, 6)


def test_robust_search_is_not_moved_by_outliers() -> None:
    X, y = regression()
    spoilt = y.copy()
    spoilt[::10] += 30.0
    clean, plain, robust = (
        TunedLSSVM(optimiser="grid", robust=on).fit(X, target)
        for on, target in ((False, y), (False, spoilt), (True, spoilt))
    )
    assert robust.search_.value < 3.0 < plain.search_.value
    away = [np.linalg.norm(X @ (m.coef_ - clean.coef_)) for m in (plain, robust)]
    assert away[1] < 0.3 * away[0]


def test_pattern_search_goes_downhill_on_a_mesh_that_it_halves() -> None:
    """From the corner of a box of 4 x 8 to (1, 2): no point twice or off the mesh."""
    seen: list[tuple[float, ...]] = []

    def bowl(x: Floats) -> float:
        seen.append(tuple(x.tolist()))
        return float((x[0] - 1.0) ** 2 + 3.0 * (x[1] - 2.0) ** 2)

    found = pattern_search(
        bowl, [4.0, 8.0], [0.0, 0.0], [4.0, 8.0], mesh=0.25, finest=1 / 64
    )
    np.testing.assert_allclose(found.x, [1.0, 2.0])
    assert found.value == 0.0 == found.history[-1]
    assert found.evaluations == len(seen) == len(set(seen))
    assert {a % 0.0625 for a, _ in seen} == {b % 0.125 for _, b in seen} == {0.0}
    assert np.all(np.diff(found.history) <= 0.0)
    assert found.history[0] == bowl(np.array([4.0, 8.0]))
    seen.clear()
    few = pattern_search(bowl, [9.0, -9.0], [0.0, 0.0], [4.0, 8.0], most_evaluations=10)
    assert seen[0] == (4.0, 0.0)  # the start is brought into the box
    assert 10 <= few.evaluations <= 13


@pytest.mark.parametrize(
    ("optimiser", "least"),
    [
        (ArtificialBeeColony, {"sources": 2, "rounds": 1, "limit": 1}),
        (ParticleSwarm, {"particles": 1, "rounds": 1}),
        (GridSearch, {"points": 3, "refinements": 0}),
        (DifferentialEvolution, {"members": 5, "rounds": 1}),
    ],
)
def test_searches_may_be_as_small_as_they_say(
    optimiser: Any, least: dict[str, int]
) -> None:
    found = optimiser(**least).minimise(sphere, BOX)
    assert np.isfinite(found.value)
    for name, value in least.items():
        with pytest.raises(InputError, match=f"{name}: "):
            optimiser(**{name: value - 1}).minimise(sphere, BOX)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"seed": -1}, "seed: "),
        ({"seed": 0.5}, "seed: "),
        ({"optimiser": "abd"}, r"optimiser: .*Did you mean 'abc'"),
        ({"objective": "training error"}, r"objective: .*Did you mean 'training'"),
        ({"objective": "free-running"}, r"objective: .*to identify"),
        ({"bounds": (1.0, 0.1)}, "bounds: "),
        ({"bounds": (0.0, 1.0)}, r"bounds: .*above 0"),
        ({"bounds": (1.0, np.inf)}, "bounds: "),
        ({"bounds": 3.0}, r"bounds: .*such as"),
        ({"folds": 1}, "folds: "),
        ({"folds": "trials"}, r"folds: .*got 0"),
        ({"optimiser": ArtificialBeeColony(sources=1)}, "sources: "),
    ],
)
def test_wrong_settings_are_named(wrong: dict[str, Any], message: str) -> None:
    X, y = regression(40)
    with pytest.raises(InputError, match=message):
        TunedLSSVM(**wrong).fit(X, y)


def colony(values: list[float]) -> Colony:
    places = np.random.default_rng(0).random((len(values), 3))
    return Colony(places, np.array(values), np.zeros(len(values), dtype=np.int64))


def test_bees_choose_good_sources_more_often() -> None:
    """Fitness 1 / (1 + f), or 1 - f below zero (Karaboga 2005); infinite: all alike."""
    expected = np.array([1.0, 1.5, 1.75, 3.75]) / 3.75
    np.testing.assert_allclose(colony([0.0, 1.0, 3.0, -1.0]).chances(), expected)
    np.testing.assert_allclose(colony([np.inf] * 4).chances(), [0.25, 0.5, 0.75, 1.0])


def test_bees_move_in_one_dimension_and_keep_the_best_move_of_a_source() -> None:
    bees, tried = colony([0.5] * 5), []

    def record(moved: Floats) -> Floats:
        tried.append(moved)
        return moved[:, 0]

    before = bees.places.copy()
    chosen = np.array([0, 0, 0, 1, 3])
    record_of: Any = Recorder(record)
    low, high = np.zeros(3), np.ones(3)
    bees.send_bees(chosen, record_of, low, high, np.random.default_rng(1))
    moves = np.abs(tried[0] - before[chosen]) > 0.0
    assert moves.sum(axis=1).max() == 1
    best = min(0.5, *(place[0] for place in tried[0][:3]))
    assert bees.values[0] == best
    assert bees.values[2] == 0.5
    tries = np.where(bees.values < 0.5, 0, [3, 1, 0, 1, 0])
    np.testing.assert_array_equal(bees.idle, tries)


def test_an_optimiser_is_a_name_a_table_or_an_object() -> None:
    swarm = get_optimiser({"name": "pso", "rounds": 7})
    assert swarm.rounds == 7  # type: ignore[attr-defined]
    assert get_optimiser(swarm) is swarm
    for wrong, message in (
        ("ant", "optimiser: "),
        ({"rounds": 7}, "optimiser: "),
        ({"name": "abc", "legs": 6}, r"optimiser: .*'abc'.*legs"),
    ):
        with pytest.raises(InputError, match=message):
            get_optimiser(wrong)  # type: ignore[arg-type]


def test_a_particle_is_constricted_as_clerc_and_kennedy_say() -> None:
    """With pulls of 2.05 the factor is 2 / (phi - 2 + root(phi^2 - 4 phi)), phi 4.1."""
    swarm, phi = ParticleSwarm(), 4.1
    factor = 2.0 / (phi - 2.0 + np.sqrt(phi**2 - 4.0 * phi))
    assert swarm.inertia == pytest.approx(factor, abs=5e-5)
    assert (swarm.own, swarm.common) == (pytest.approx(2.05 * factor, abs=1e-5),) * 2


@pytest.mark.parametrize(
    ("name", "candidates", "rounds"),
    [("grid", 58, 2), ("pso", 1220, 61), ("de", 1220, 60)],
)
def test_a_search_costs_what_it_says(name: str, candidates: int, rounds: int) -> None:
    """Two grids of 29 points; 20 members a dimension, 60 rounds after the first."""
    found = minimise(lambda x: 1.0 + 1e-9 * x[:, 0], [(-1.0, 1.0)], optimiser=name)
    assert (found.evaluations, len(found.history)) == (candidates, rounds)


def test_a_grid_is_refined_between_the_neighbours_of_its_best_point() -> None:
    seen: list[Floats] = []

    def away(x: Floats) -> Floats:
        seen.append(x[:, 0])
        return np.abs(x[:, 0] - 0.9)

    found = GridSearch(points=5, refinements=2).minimise(away, [(-1.0, 1.0)])
    np.testing.assert_allclose(seen[0], [-1.0, -0.5, 0.0, 0.5, 1.0])
    np.testing.assert_allclose(
        seen[1], np.linspace(0.5, 1.0, 5)
    )  # none outside the bounds
    np.testing.assert_allclose(seen[2], np.linspace(0.75, 1.0, 5))
    assert found.x == pytest.approx([0.875])
    np.testing.assert_allclose(found.history, [0.1, 0.025, 0.025])


def test_a_record_keeps_the_first_of_the_best_candidates() -> None:
    values = iter([[np.inf, np.nan], [3.0, 2.0], [2.0, 5.0], [1.0, 1.0]])
    record = Recorder(lambda _: np.array(next(values)))
    for k in range(4):
        record(np.array([[10.0 * k], [10.0 * k + 1.0]]))
        record.end_round()
    found = record.result()
    assert found.course.ravel().tolist() == [0.0, 11.0, 11.0, 30.0]
    assert found.history.tolist() == [np.inf, 2.0, 2.0, 1.0]
    assert (found.x.tolist(), found.value, found.evaluations) == ([30.0], 1.0, 8)
    assert found.of(0, "depth").variable == "depth"


def test_a_mesh_is_a_quarter_of_the_box_and_no_finer_than_a_64th() -> None:
    """Polled are the neighbours in both directions, at most some two hundred points."""
    seen: list[float] = []

    def valley(x: Floats) -> float:
        seen.append(float(x[0]))
        return abs(float(x[0]) - 4.0)

    found = pattern_search(valley, [4.0], [0.0], [8.0])
    assert seen == [4.0, 6.0, 2.0, 5.0, 3.0, 4.5, 3.5, 4.25, 3.75, 4.125, 3.875]
    assert found.history.tolist() == [0.0] * 6
    wide = np.full(2, 1e9)
    endless = pattern_search(
        lambda x: -float(np.sum(x)),
        0.0 * wide,
        0.0 * wide,
        wide,
        mesh=1e-4,
        finest=1e-9,
    )
    assert 200 <= endless.evaluations <= 203


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        (ArtificialBeeColony, "sources"),
        (ParticleSwarm, "particles"),
        (GridSearch, "points"),
        (DifferentialEvolution, "rounds"),
    ],
)
def test_a_search_of_more_than_a_hundred_thousand_is_refused(
    kind: Any, name: str
) -> None:
    with pytest.raises(InputError, match=f"{name}: .*100000"):
        kind(**{name: 100_001}).minimise(sphere, BOX)
