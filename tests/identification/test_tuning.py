from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from identification import LSSVM, TunedLSSVM
from identification.estimators.tuned import minimised
from shipgym import InputError

Floats = np.ndarray[Any, np.dtype[np.float64]]

OPTIMISERS = [
    {"name": "abc", "rounds": 150},
    {"name": "pso", "rounds": 150},
    {"name": "grid", "points": 21, "refinements": 5},
]
BOUNDS = (-4.0, 5.0)


def sphere(x: Floats) -> Floats:
    return (x - 1.0) ** 2


def rastrigin(x: Floats) -> Floats:
    """Hilly, with its only global minimum of 0 at 1."""
    z = x - 1.0
    return z**2 - 10.0 * np.cos(2.0 * np.pi * z) + 10.0


def regression(
    n: int = 400, m: int = 6, noise: float = 1.0, seed: int = 0
) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, m)) @ rng.standard_normal((m, m)) + 1.0
    return X, X @ rng.standard_normal(m) + 3.0 + noise * rng.standard_normal(n)


@pytest.mark.parametrize("optimiser", OPTIMISERS, ids=lambda o: o["name"])
@pytest.mark.parametrize("objective", [sphere, rastrigin])
def test_optimisers_find_the_global_minimum(
    optimiser: dict[str, Any], objective: Any
) -> None:
    found = minimised(optimiser, objective, BOUNDS, seed=3)
    assert found.x == pytest.approx(1.0, abs=2e-3)
    assert found.value == objective(np.array([found.x]))[0]


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


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"seed": -1}, "seed: "),
        ({"seed": 0.5}, "seed: "),
        ({"optimiser": "abd"}, r"optimiser: .*Did you mean 'abc'"),
        ({"objective": "training error"}, r"objective: .*Did you mean 'training'"),
        ({"bounds": (1.0, 0.1)}, "bounds: "),
        ({"bounds": (0.0, 1.0)}, r"bounds: .*above 0"),
        ({"bounds": (1.0, np.inf)}, "bounds: "),
        ({"bounds": 3.0}, r"bounds: .*such as"),
        ({"folds": 1}, "folds: "),
        ({"folds": "trials"}, "folds: "),
        ({"optimiser": {"name": "pso", "particles": 2**62}}, r"particles: .*100000"),
        ({"optimiser": {"rounds": 7}}, "optimiser: "),
        ({"optimiser": {"name": "abc", "legs": 6}}, "optimiser: .*legs"),
    ],
)
def test_wrong_settings_are_named(wrong: dict[str, Any], message: str) -> None:
    X, y = regression(40)
    with pytest.raises(InputError, match=message):
        TunedLSSVM(**wrong).fit(X, y)
