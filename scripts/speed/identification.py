"""Identification: regression, searches, recursion, refinement by simulation."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from papers.dense_dual import dense_dual_solution
from sensors import Sensors

import shipgym
from agents.verification.chain import build_autopilot
from identification import (
    RecursiveLeastSquares,
    TruncatedLSSVM,
    TunedLSSVM,
    identify,
)
from shipgym.manoeuvres import zigzag
from speed.measure import Row, best_time

Floats = NDArray[np.float64]


def made_up_regression(n_samples: int, n_terms: int) -> tuple[Floats, Floats]:
    """Correlated features and noisy targets."""
    random = np.random.default_rng(0)
    X = random.standard_normal((n_samples, n_terms)) @ random.standard_normal(
        (n_terms, n_terms)
    )
    return X, X @ random.standard_normal(n_terms) + 0.1 * random.standard_normal(
        n_samples
    )


def truncated_fit(n_samples: int, aim: str, n_terms: int = 15) -> Row:
    """TLS-SVM in primal form with its L-curve, against the dense dual LS-SVM."""
    X, y = made_up_regression(n_samples, n_terms)
    primal = best_time(lambda: TruncatedLSSVM(C=1e6).fit(X, y), 200)
    dense = best_time(
        lambda: dense_dual_solution(X, y, C=1e6), 3 if n_samples < 3000 else 1
    )
    return Row(
        f"TLS-SVM fit, {n_samples} samples, {n_terms} terms",
        f"{primal * 1e3:.2f} ms",
        f"dense dual solve {dense:.2f} s",
        dense / primal,
        aim,
    )


def bee_colony_search(objective: str, n_samples: int = 1800, n_terms: int = 7) -> Row:
    """Zhu's bee colony for C (20 sources, 30 rounds), on 1 and 10 times the samples."""

    def least(n: int) -> float:
        X, y = made_up_regression(n, n_terms)
        machine = TunedLSSVM(optimiser="abc", objective=objective)
        return best_time(lambda: machine.fit(X, y), 50)

    once, tenfold = least(n_samples), least(10 * n_samples)
    return Row(
        f"bee colony, {objective} error, {n_samples} samples",
        f"{once * 1e3:.1f} ms",
        f"{10 * n_samples} samples {tenfold * 1e3:.1f} ms",
        tenfold / once,
        "10 ms, ratio at most 10",
    )


def recursive_updates(n_samples: int = 50_000, n_terms: int = 15) -> Row:
    """Recursive least squares with forgetting, against the same update in NumPy."""
    random = np.random.default_rng(0)
    X = random.standard_normal((n_samples, n_terms))
    y = X @ random.standard_normal(n_terms) + 0.1 * random.standard_normal(n_samples)
    machine = RecursiveLeastSquares(forgetting=0.999).fit(X[:100], y[:100])

    def in_numpy(n: int = 2000) -> None:
        theta, P = np.zeros(n_terms), 1e6 * np.eye(n_terms)
        for phi, target in zip(X[:n], y[:n], strict=True):
            gain = P @ phi
            gain /= 0.999 + phi @ gain
            theta += gain * (target - phi @ theta)
            P = (P - np.outer(gain, phi @ P)) / 0.999

    compiled = n_samples / best_time(lambda: machine.fit(X, y))
    plain = 2000 / best_time(in_numpy)
    return Row(
        f"recursive least squares, {n_terms} coefficients",
        f"{compiled / 1e6:.2f} M updates/s",
        f"NumPy {plain / 1e6:.3f} M updates/s",
        compiled / plain,
        "1 M updates/s",
    )


def refinement() -> Row:
    """Refinement of 40 coefficients on four noisy trials, against the regression."""
    ship = shipgym.load_model("mariner")
    plan = ((10, 10), (15, 15), (20, 20), (30, 20))
    trials = [
        Sensors(sampling_s=1.0)
        .measure(zigzag(ship, *angles, duration=400.0), seed)
        .with_(name=f"zigzag {seed}")
        for seed, angles in enumerate(plan)
    ]

    def fit(method: str) -> float:
        return best_time(
            lambda: identify(
                trials,
                method=method,
                particulars=ship.particulars,
                steering=ship.steering,
            ),
            2,
        )

    refined, start = fit("output-error"), fit("tls-svm")
    return Row(
        "identify by output error, 40 coefficients, 4 trials",
        f"{refined:.1f} s",
        f"its start, TLS-SVM {start:.2f} s",
        start / refined,
        "10 s",
    )


def five_zigzags() -> tuple[shipgym.ShipModel, list[shipgym.Trial]]:
    """KVLCC2 and her noisy zigzags: every structure without roll can be tried."""
    ship = shipgym.load_model("kvlcc2")
    plan = ((10, False), (10, True), (20, False), (20, True), (15, False))
    trials = [
        Sensors(sampling_s=1.0)
        .measure(zigzag(ship, angle, angle, port, 1200.0, 0.25), seed)
        .with_(name=f"zigzag {seed}")
        for seed, (angle, port) in enumerate(plan)
    ]
    return ship, trials


def identification_of(structure: str, aim: str) -> Row:
    """A structure on five zigzags, against Abkowitz' by TLS-SVM on the same."""
    ship, trials = five_zigzags()

    def fit(name: str) -> float:
        return best_time(
            lambda: identify(
                trials,
                structure=name,
                particulars=ship.particulars,
                steering=ship.steering,
            ),
            2,
        )

    own, plain = fit(structure), fit("abkowitz")
    return Row(
        f"identify, structure {structure}, 5 zigzags",
        f"{own:.1f} s",
        f"abkowitz by TLS-SVM {plain:.2f} s",
        plain / own,
        aim,
    )


def whole_chain() -> Row:
    """`shipgym autopilot` on five zigzags, against the identification in it."""
    ship, trials = five_zigzags()
    with TemporaryDirectory() as folder:
        path = write_ship_file(ship, trials, Path(folder))
        report = Path(folder) / "report"
        whole = best_time(lambda: build_autopilot(path, report), 2)
    alone = best_time(
        lambda: identify(
            trials,
            structure="auto",
            particulars=ship.particulars,
            steering=ship.steering,
        ),
        1,
    )
    return Row(
        "shipgym autopilot, 5 zigzags, 200 draws",
        f"{whole:.1f} s",
        f"identification in it {alone:.1f} s",
        alone / whole,
        "30 s",
    )


def write_ship_file(
    ship: shipgym.ShipModel, trials: list[shipgym.Trial], folder: Path
) -> Path:
    """A ship file with trials as CSV files."""
    lines = ["[ship]", f'name = "{ship.name}"']
    known = ("length", "beam", "draught", "mass", "block_coefficient", "speed", "xg")
    lines += [f"{key} = {ship.particulars[key]}" for key in known]
    for trial in trials:
        file = f"{trial.name.replace(' ', '_')}.csv"
        trial.to_csv(folder / file)
        lines += ["[[trials]]", f'file = "{file}"', 'kind = "zigzag"']
    path = folder / "ship.toml"
    path.write_text("\n".join(lines))
    return path
