"""Golden section `estimators`: every estimator and search with its options, on one made-up regression."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.linear_model import Lasso, Ridge

from identification import (
    LSSVM,
    RMSVM,
    MultiInnovationLeastSquares,
    RecursiveLeastSquares,
    Samples,
    StochasticGradient,
    TruncatedLSSVM,
    TunedLSSVM,
    coefficient_history,
    minimise,
    polynomial_coefficients,
)
from identification.estimators.comparators import LinearSupportVectorMachine
from identification.estimators.decomposition import centre_and_scale, decompose
from identification.estimators.estimator import FitTask
from identification.estimators.kernel_fit import (
    chosen_centres,
    principal,
    stabilised,
)
from identification.estimators.l_curve import (
    corner_rank,
    gcv_rank,
    l_curve,
    variance_rank,
)
from identification.estimators.linear import check_weight
from identification.estimators.methods import (
    METHODS,
    fit_held,
    get_method,
    make_method,
    method_options,
)
from identification.estimators.rm_svm import most_regularised
from identification.estimators.robust import hampel_weights
from identification.search import get_optimiser
from identification.search.objectives import held_out_error, time_blocks, training_error
from identification.search.pattern_search import pattern_search
from shipgym import Particulars, ShipModel, SteeringGear
from shipgym.ships.kernel_boxes import Kernel
from tests.golden.made_up import Parts, mariner, refused, regression, sampled, trials
from tests.golden.store import Floats

#: Solvers of support vectors stop early, and robust weights when they hardly change.
TOLERANCES = {
    "": 1e-5,
    "support vectors: ": 1e-3,
    "methods: svr": 1e-3,
    "methods: ls.": 1e-4,
}
SIGNLESS = ("directions_",)
LEFT_OUT = ("ridge_", "search_", "feature_names")


def told(estimator: Any) -> dict[str, Any]:
    """What a fitted estimator says of itself, and of a sample that it has not seen."""
    found = {
        name: value for name, value in vars(estimator).items() if name.endswith("_")
    }
    found = {
        k: np.abs(v) if k in SIGNLESS else v
        for k, v in found.items()
        if k not in LEFT_OUT
    }
    unseen = np.array([[0.3, -0.1, 2.0, 0.01, 0.4, 1.1]])
    found |= (
        {"search": vars(estimator)["search_"]} if "search_" in vars(estimator) else {}
    )
    return found | {"prediction": estimator.predict(unseen)}


def record_lssvm() -> dict[str, Any]:
    """LS-SVM in primal and dual form."""
    X, y = regression()
    options: dict[str, dict[str, Any]] = {
        "default": {},
        "weak": {"C": 0.7, "fit_intercept": False},
        "free": {"C": np.inf, "scale": False},
        "given scale": {"C": 13.0, "scale": [1.0, 2.0, 3.0, 0.5, 0.7, 1.3]},
        "robust": {"robust": True},
        "rbf": {"kernel": "rbf", "C": 7.0},
        "rbf, robust": {"kernel": "rbf", "gamma": 0.3, "robust": True, "C": 20.0},
        "poly": {"kernel": "poly", "degree": 2, "gamma": 0.4, "coef0": 0.7, "C": 13.0},
        "poly, centred": {
            "kernel": "poly",
            "degree": 2,
            "C": 3.0,
            "fit_intercept": False,
            "scale": False,
        },
    }
    fitted = {name: LSSVM(**given).fit(X, y) for name, given in options.items()}
    found: dict[str, Any] = {name: told(one) for name, one in fitted.items()}
    for name in ("poly", "poly, centred"):
        found[f"{name}: polynomial"] = polynomial_coefficients(fitted[name])
    wrong: tuple[dict[str, Any], ...] = (
        {"kernel": "sigmoid"},
        {"C": -1.3},
        {"C": True},
        {"gamma": 0.0},
        {"degree": 0},
        {"coef0": np.nan},
        {"kernel": "rbf", "C": np.inf},
        {"scale": [1.0, 2.0]},
        {"scale": [1.0, 0.0, 1.0, 1.0, 1.0, 1.0]},
    )
    found["refused"] = {
        str(given): refused(lambda g=given: LSSVM(**g).fit(X, y)) for given in wrong
    }
    found["refused"]["kernel"] = refused(
        lambda: polynomial_coefficients(fitted["default"])
    )
    found["constant feature"] = told(
        LSSVM().fit(np.where(np.arange(6) == 2, 3.7, X), y)
    )
    found["exact"] = LSSVM(robust=True).fit(X, X[:, 0] * 2.0).weights_
    return found


def record_truncated() -> dict[str, Any]:
    """Truncated LS-SVM by each choice of rank."""
    X, y = regression()
    options: dict[str, dict[str, Any]] = {
        "default": {},
        "gcv": {"selection": "gcv", "fit_intercept": False},
        "rank": {"rank": 3, "C": 50.0},
        "too many": {"rank": 99},
        "full": {"selection": "full", "robust": True},
        "robust": {"robust": True},
        "variance": {
            "selection": "explained-variance",
            "explained_variance": 0.9,
            "scale": False,
        },
        "all variance": {"selection": "explained-variance", "explained_variance": 1.0},
    }
    found: dict[str, Any] = {
        name: told(TruncatedLSSVM(**given).fit(X, y)) for name, given in options.items()
    }
    found["few samples"] = told(TruncatedLSSVM().fit(X[:4], y[:4]))
    found["few samples, gcv"] = told(
        TruncatedLSSVM(selection="gcv", fit_intercept=False).fit(X[:5], y[:5])
    )
    twice = TruncatedLSSVM().fit(np.hstack([X[:, :5], X[:, :1] * 2.0]), y)
    found["exactly collinear"] = told(twice)
    found["names"] = [*map(" ".join, twice.collinear_names_)]
    wrong: tuple[dict[str, Any], ...] = (
        {"selection": "best"},
        {"C": 0.0},
        {"rank": 0},
        {"rank": 1.5},
        {"explained_variance": 0.0},
        {"explained_variance": 1.1},
    )
    found["refused"] = {
        str(given): refused(lambda g=given: TruncatedLSSVM(**g).fit(X, y))
        for given in wrong
    }
    falling, solved = np.array([9.0, 5.0, 1.2, 0.3]), np.array([3.0, 1.0, 0.5, 0.4])
    curve = l_curve(falling, solved, falling / (falling**2 + 0.7), 0.013)
    found["curve"] = curve
    found["corner"] = [corner_rank(curve, n) for n in (4, 5, 9, 40, 1000)]
    found["gcv rank"] = [gcv_rank(curve, n) for n in (2, 4, 5, 40)]
    found["variance rank"] = [
        variance_rank(falling, share) for share in (0.5, 0.75, 0.98, 0.9999, 1.0)
    ]
    problem = decompose(X, y, True, True)
    found["filters"] = problem.filters([[0.3], [40.0]], 4)
    found["outside"] = [problem.outside, problem.n_free, problem.numerical_rank]
    found["scale"] = [
        *centre_and_scale(X, True, True),
        *centre_and_scale(X, False, False),
    ]
    found["weights"] = hampel_weights(
        np.array([0.1, -0.2, 0.3, -0.15, 0.7, 0.62, 3.0]), 5.0
    )
    found["weight"] = [check_weight(3), check_weight(np.inf)]
    return found


def record_tuned() -> dict[str, Any]:
    """LS-SVM with C by each search and objective."""
    X, y = regression()
    quick = {"sources": 3, "rounds": 3, "limit": 2}
    options: dict[str, dict[str, Any]] = {
        "grid": {"optimiser": {"name": "grid", "points": 5, "refinements": 2}},
        "abc": {
            "optimiser": {"name": "abc", **quick},
            "folds": 3,
            "seed": 4,
            "robust": True,
        },
        "pso": {
            "optimiser": {"name": "pso", "particles": 3, "rounds": 4},
            "objective": "training",
            "seed": 2,
        },
        "de": {
            "optimiser": {"name": "de", "members": 5, "rounds": 2},
            "bounds": (1e-3, 30.0),
            "scale": False,
        },
        "trials": {
            "optimiser": {"name": "grid", "points": 7},
            "folds": "trials",
            "fit_intercept": False,
        },
        "many folds": {
            "optimiser": {"name": "grid", "points": 4, "refinements": 0},
            "folds": 999,
        },
    }
    groups = np.repeat([2, 5, 9], [20, 15, 10])
    found: dict[str, Any] = {
        name: told(TunedLSSVM(**given).fit(X, y, groups if name == "trials" else None))
        for name, given in options.items()
    }
    wrong: tuple[dict[str, Any], ...] = (
        {"objective": "free-running"},
        {"objective": "best"},
        {"seed": -1},
        {"bounds": (2.0, 1.0)},
        {"folds": 1},
        {"bounds": (1.0, np.inf)},
        {"bounds": 3.0},
        {"folds": "trials"},
        {"folds": True},
        {"optimiser": "ga"},
        {"optimiser": {"name": "abc", "bees": 3}},
    )
    found["refused"] = {
        str(given): refused(lambda g=given: TunedLSSVM(**g).fit(X, y))
        for given in wrong
    }
    exponents, weights = np.array([[-1.0], [0.7], [5.0]]), np.linspace(0.2, 1.7, len(y))
    found["training"] = training_error(X, y, True, False, weights)(exponents)
    found["held out"] = held_out_error(
        X, y, True, True, time_blocks(len(y), 4), weights
    )(exponents)
    found["blocks"] = [time_blocks(11, 3), time_blocks(4, "trials", [5, 3, 3, 9])]
    return found


def record_searches() -> dict[str, Any]:
    """Every optimiser on a skew bowl with a hole in it, and on what is infinite or negative."""

    def bowl(x: Floats) -> Floats:
        values = (
            (x[:, 0] - 0.3) ** 2
            + 3.0 * (x[:, 1] + 1.2) ** 2
            + 0.7 * x[:, 0] * x[:, 1]
            - 0.5
        )
        return np.where(x[:, 0] > 1.5, np.nan, values)

    box = [(-2.0, 2.5), (-3.0, 1.0)]
    settings: dict[str, dict[str, Any]] = {
        "grid": {"points": 5, "refinements": 2},
        "pso": {"particles": 4, "rounds": 6, "inertia": 0.6, "own": 1.3, "common": 1.7},
        "de": {"members": 5, "rounds": 3},
        "abc": {"sources": 4, "rounds": 8, "limit": 2},
    }
    found: dict[str, Any] = {}
    for name, given in settings.items():
        optimiser = get_optimiser({"name": name, **given})
        found[name] = minimise(bowl, box, 5, optimiser)
        found[f"{name}, high"] = minimise(lambda x: bowl(x) + 4.0, box, 6, optimiser).x
        if name != "de":  # SciPy warns of its own arithmetic
            found[f"{name}, infinite"] = optimiser.minimise(
                lambda x: np.full(len(x), np.inf), box, 7
            )
        first = next(iter(given))
        found[f"{name}, refused"] = refused(
            lambda n=name, f=first: minimise(
                bowl, box, 0, get_optimiser({"name": n, f: 0})
            )
        )
    found["one"] = found["grid"].of(1, "insensitive band")
    for limits in ([(1.0, 0.0)], [1.0, 2.0], [(0.0, np.inf)], "wide", []):
        found[f"bounds {limits}"] = refused(lambda b=limits: minimise(bowl, b))
    found["shape"] = refused(lambda: minimise(lambda x: x, box))
    found["default"] = minimise(lambda x: np.abs(x[:, 0] - 0.123), [(-1.0, 1.0)]).x
    for name, given in {
        "coarse": {"finest": 0.1},
        "fine": {"mesh": 0.3},
        "short": {"most_evaluations": 9},
    }.items():
        found[f"pattern, {name}"] = pattern_search(
            lambda x: float(bowl(x[None])[0]),
            [9.0, 0.7],
            [-2.0, -3.0],
            [1.4, 1.0],
            **given,
        )
    return found


def record_recursions() -> dict[str, Any]:
    """Every recursion at once and sample by sample, and what becomes of a coefficient over a trial."""
    X, y = regression()
    options: dict[str, Any] = {
        "rls": RecursiveLeastSquares(),
        "rls, forgetting": RecursiveLeastSquares(forgetting=0.93, C=30.0),
        "rls, started": RecursiveLeastSquares(
            start_samples=6, start_interval=2, start_C=70.0, forgetting=0.97
        ),
        "tmils": MultiInnovationLeastSquares(innovations=3, C=200.0),
        "tmils, bounded": MultiInnovationLeastSquares(
            omega=0.7, forgetting=0.95, scale=False
        ),
        "mils": MultiInnovationLeastSquares(
            inverse_free=False, innovations=4, C=900.0, forgetting=0.98
        ),
        "mils, bounded": MultiInnovationLeastSquares(inverse_free=False, omega=1.3),
        "sg": StochasticGradient(forgetting=0.9),
        "nisg": StochasticGradient(omega=0.5, scale=np.arange(1.0, 7.0)),
        "sg, started": StochasticGradient(start_samples=9, C=11.0),
        "all start": RecursiveLeastSquares(start_samples=99),
    }
    found: dict[str, Any] = {}
    for name, one in options.items():
        history = one.fit_history(X, y)
        found[name] = told(one) | {
            "history": sampled(history),
            "of theta": one.covariance,
        }
    two = MultiInnovationLeastSquares(innovations=3, C=50.0, forgetting=0.96)
    two.update(X[:9], np.stack([y, -0.7 * y], axis=1)[:9])
    for k in range(9, 14):
        two.update(np.stack([X[k : k + 1], 2.0 * X[k : k + 1]], axis=1), [[y[k], 0.3]])
    found["two signals"] = [two.theta, two.covariance]
    found["one by one"] = (
        StochasticGradient(scale=[1.0, 2.0])
        .update([0.3, 0.7], 1.3)
        .update([0.1, -0.4], 0.2)
        .theta
    )
    wrong: tuple[Any, ...] = (
        RecursiveLeastSquares(forgetting=0.0),
        RecursiveLeastSquares(forgetting=1.1),
        RecursiveLeastSquares(C=0.0),
        RecursiveLeastSquares(start_C=-1.0),
        RecursiveLeastSquares(start_samples=-1),
        StochasticGradient(omega=-0.1),
        RecursiveLeastSquares(start_interval=0),
        MultiInnovationLeastSquares(innovations=0),
        MultiInnovationLeastSquares(omega=-1.0),
    )
    found["refused"] = [refused(lambda one=one: one.fit(X, y)) for one in wrong]
    for phi, target in (
        (X[:3], y[:2]),
        (np.ones((2, 3, 4)), np.ones((2, 2))),
        (X[:2] * np.nan, y[:2]),
        (X[:2, :3], y[:2]),
    ):
        found["refused"].append(refused(lambda p=phi, t=target: two.update(p, t)))
    ship = mariner().particulars
    history = coefficient_history(
        trials()[:2], "linear-steering", ship, "tmils", window=5, samples="integral"
    )
    found["histories"] = [
        history.last,
        sampled(history["N_r" if "N_r" in history.names else history.names[-1]]),
    ]
    found["times"] = [sampled(history.t), sampled(history.trial.astype(float))]
    one = coefficient_history(
        trials()[0],
        "abkowitz",
        ship,
        RecursiveLeastSquares(C=1e4),
        window=7,
        smoothing="none",
    )
    found["one history"] = one.last
    found["not recursive"] = refused(
        lambda: coefficient_history(trials()[0], "abkowitz", ship, "ls")
    )
    found["no coefficient"] = refused(lambda: history["Q"])
    return found


def record_support_vectors() -> dict[str, Any]:
    """Epsilon-SVR and its relatives."""
    X, y = regression()
    X = X[:, [0, 1, 2, 3, 5, 5]] * [1.0, 1.0, 1.0, 1.0, 1.0, 0.0]
    found: dict[str, Any] = {
        "svr": told(LinearSupportVectorMachine(C=3.0, epsilon=0.1).fit(X, y)),
        "svr, no intercept": told(
            LinearSupportVectorMachine(C=0.7, fit_intercept=False, seed=3).fit(X, y)
        ),
    }
    with_one = np.column_stack([X[:, :5], np.linspace(0.9, 1.2, len(y))])
    options: dict[str, dict[str, Any]] = {
        "band": {"C": 3.0, "epsilon": 0.2},
        "default": {},
        "none": {"C": 0.0},
        "ls-svm": {"regression": "ls-svm", "C": 13.0},
        "constant": {"constant": 5, "C": 30.0, "epsilon": 0.15},
        "constant, ls-svm": {"constant": 5, "regression": "ls-svm", "C": 0.7},
    }
    found |= {
        name: told(RMSVM(**given).fit(with_one, y)) for name, given in options.items()
    }
    collinear = regression()[0][:15]  # where coordinate descent does not settle
    found["not settled"] = (
        RMSVM(C=150.0, epsilon=0.01).fit(collinear, y[:15]).predict(collinear[:3])
    )
    found["alone"] = RMSVM(constant=0).fit(with_one[:, 5:], y).coef_
    wrong: tuple[dict[str, Any], ...] = (
        {"objective": "x"},
        {"regression": "x"},
        {"folds": "x"},
        {"C": -1.0},
        {"epsilon": -0.1},
    )
    found["refused"] = [
        refused(lambda g=given: RMSVM(**g).fit(X, y)) for given in wrong
    ]
    for other in ({"C": 0.0}, {"seed": -1}, {"epsilon": -0.1}):
        found["refused"].append(
            refused(lambda g=other: LinearSupportVectorMachine(**g).fit(X, y))
        )
    found["choice"] = [
        most_regularised([3, 4, 5], errors)
        for errors in ([9.0, 1.05, 1.0], [np.inf] * 3)
    ]
    return found


def record_methods() -> dict[str, Any]:
    """Every method on a regression of two equations, estimators of others, and what is held back."""
    X, y = regression()
    X = X[:, [0, 1, 2, 3, 5]]
    start = np.arange(len(y)) * 1.5
    samples = Samples(
        {"u": X, "r": X[:, :3] * 0.7},
        {"u": y, "r": 0.2 * y + X[:, 0]},
        start,
        np.linspace(1.0, 2.0, len(y)),
        (start > 30.0).astype(int),
        1,
    )
    task = FitTask(samples, mariner(), ())
    quick = {
        "abc-lssvr": {"optimiser": {"name": "abc", "sources": 3, "rounds": 2}},
        "pso-lssvr": {"optimiser": {"name": "pso", "particles": 3, "rounds": 2}},
        "de-lssvr": {"optimiser": {"name": "de", "members": 5, "rounds": 2}},
        "ridge": {"alpha": 0.03},
        "svr": {"C": 2.0},
        "ls": {"scale": False, "robust": True},
    }
    found: dict[str, Any] = {}
    for name in METHODS:
        if name != "rm-svm":
            fitted = get_method(make_method(name, quick.get(name, {}))).fitted(task)
            found[name] = {
                q: [one.coef_, one.covariance_, one.inverse_moment_]
                for q, one in fitted.items()
            }
    found["ridge, none"] = make_method("ridge", {"alpha": 0.0}).error_weight()
    for name, one in {
        "lasso": Lasso(0.05),
        "ridge": Ridge(0.3, fit_intercept=True),
        "own": LSSVM(C=2.0),
    }.items():
        fitted = get_method(one).fitted(task)
        found[f"object {name}"] = {
            q: [
                one.coef_,
                one.covariance_,
                one.inverse_moment_,
                one.predict(samples.features[q][:2]),
            ]
            for q, one in fitted.items()
        }
    held = fit_held(
        samples, {"u": np.arange(1.0, 6.0), "r": np.array([0.3, 0.7, 1.3])}, 0.2
    )
    found["held"] = {q: [one.coef_, one.C] for q, one in held.items()}
    known = ("C", "alpha", "rank", "omega", "robust", "optimiser", "seed", "rounds")
    found["knows"] = {
        name: [one in method_options(name) for one in known] for name in METHODS
    }
    found["kinds"] = {
        name: [method.regularised, method.refinement is not None]
        for name, method in ((name, get_method(name)) for name in METHODS)
    }
    found["refused"] = [
        refused(call)
        for call in (
            lambda: get_method("best"),
            lambda: get_method(3.0),
            lambda: get_method(LSSVM(kernel="rbf")),
            lambda: make_method("ls", {"C": 3.0, "rank": 2}),
            lambda: get_method("rm-svm").fitted(task),
            lambda: make_method("ridge", {"alpha": -0.1}).check(),
            lambda: get_method(Unfinished()).fitted(task),
        )
    ]
    return found


class Unfinished:
    """An estimator without coefficients."""

    def __repr__(self) -> str:
        return "Unfinished()"

    def fit(self, X: Floats, y: Floats) -> None:
        """Do nothing."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return none."""
        return {}


def record_kernels() -> dict[str, Any]:
    """Centres and components of a kernel, and the linear ship beneath it."""
    random = np.random.default_rng(8)
    x = random.uniform(-1.0, 1.2, (90, 4)) * [0.1, 0.3, 0.5, 0.001] + [
        0.0,
        0.0,
        0.0,
        0.9,
    ]
    offset, scale, centres = chosen_centres(x, 6)
    order = np.lexsort(centres.T)
    kernel = principal(Kernel(offset, scale * 1.3, centres[order] / 1.3, np.eye(6)), x)
    ship, gear = (
        Particulars(name="made up", length=7.0, speed=1.2),
        SteeringGear(35.0, 16.0, 0.0),
    )
    values = {
        "a_0": 0.002,
        "a_du": 0.04,
        "b_0": 0.0,
        "b_v": -0.4,
        "b_r": -0.35,
        "b_d": -0.15,
        "c_0": 0.0,
        "c_v": -1.5,
        "c_r": 0.3,
        "c_d": 1.0,
    }
    return {
        "offset": offset,
        "scale": scale,
        "centres": centres[order],
        "basis": np.abs(kernel.basis),
        "damped": (
            stabilised(ShipModel("linear", "linear", ship, gear, values)).coefficients
        ),
        "steady": (
            stabilised(
                ShipModel(
                    "l",
                    "linear",
                    ship,
                    gear,
                    values | {"b_v": -2.0, "c_r": -3.0, "a_du": -0.7},
                )
            ).coefficients
        ),
        "refused": [
            refused(lambda: chosen_centres(x, 32)),
            refused(
                lambda: stabilised(
                    ShipModel("l", "linear", ship, gear, values | {"c_r": 1e3})
                )
            ),
        ],
    }


PARTS = Parts(
    {
        "lssvm": record_lssvm,
        "truncated": record_truncated,
        "tuned": record_tuned,
        "searches": record_searches,
        "recursions": record_recursions,
        "support vectors": record_support_vectors,
        "methods": record_methods,
        "kernels": record_kernels,
    }
)
