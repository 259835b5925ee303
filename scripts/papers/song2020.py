"""Song 2020: Nomoto's coefficients of Hual Trooper by recursive methods.

Rudder, duration, sampling time, start and omega of the paper's runs are not printed.
Zigzags of the printed Nomoto ships stand in their place.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from time import process_time

import numpy as np
from numpy.typing import NDArray

from identification.estimators.recursive import MultiInnovationLeastSquares
from identification.pipeline import identify
from papers.row import Conclusion, Paper, Row, off, sampled, within
from shipgym.manoeuvres import zigzag
from shipgym.models import ShipModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

PARTICULARS = Particulars(
    name="Hual Trooper",
    length=190.0,
    beam=32.26,
    draught=6.9,
    block_coefficient=0.535,
    speed=20.8 * 1852.0 / 3600.0,
    rudder_area=34.1,
)
K, T, ALPHA, BETA = 0.15, 47.61, 13.27, 11087.2
#: rdot = c_r r + c_r3 r^3 + c_d delta, equations 2-16 and 3-1
TRUTH = {
    "nomoto": {"c_r": -1.0 / T, "c_d": K / T},
    "norrbin": {"c_r": -ALPHA * K / T, "c_r3": -BETA * K / T, "c_d": K / T},
}
#: Of the zigzag, deg: the cube of r wants a large one.
ANGLE = {"nomoto": 10, "norrbin": 20}
DURATION, INTERVAL = 2000.0, 0.4  # s
OMEGA = 0.5  # between the printed bounds 0.1 and 1
WITHIN = 1.0  # aim: error of a coefficient, or of a prediction of its span, %
INNOVATIONS, REPEATS = (2, 5, 20), 5  # innovations at once; repetitions of a timing
#: Errors of Tables 3-3 and 3-4, %, and estimates of K and T, by the stochastic gradient
#: and with nonlinear innovation.
TABLES = {
    "nomoto": {"SG": {"K": 52.0, "T": 52.0}, "NISG": {"K": 22.3, "T": 15.3}},
    "norrbin": {
        "SG": {"alpha": 2.6, "beta": 5.5},
        "NISG": {"alpha": 0.04, "beta": 2.0},
    },
}
ESTIMATES = {"SG": (0.072, 22.9088), "NISG": (0.1165, 40.2886)}
MEAN = "mean by {}: error, %"


def ship(structure: str, coefficients: Mapping[str, float] | None = None) -> ShipModel:
    """Hual Trooper by Nomoto's equation (`nomoto`), or with r^3 (`norrbin`)."""
    values = dict(coefficients or TRUTH[structure])
    return ShipModel(PARTICULARS.name, structure, PARTICULARS, SteeringGear(), values)


@cache
def trial(structure: str) -> Trial:
    """A sampled zigzag."""
    angle = ANGLE[structure]
    run = zigzag(ship(structure), angle, angle, duration=DURATION, dt=0.1)
    return sampled(run, round(INTERVAL / 0.1), f"zigzag {angle}/{angle}")


def regression(structure: str) -> tuple[Floats, Floats]:
    """Equation 3-2: the difference of r on r, r^3 and delta at its end.

    Returns
    -------
    X : array of shape (n_samples, n_terms)
    y : array of shape (n_samples,)
    """
    run = trial(structure)
    r, delta = run["r"], run["delta"]
    columns = (r, delta) if structure == "nomoto" else (r, r**3, delta)
    return np.column_stack(columns)[1:], np.diff(r) / INTERVAL


def indices(coefficients: Mapping[str, float]) -> dict[str, float]:
    """K and T of the linear equation; alpha and beta of the other."""
    c_r = coefficients["c_r"]
    c_d = coefficients["c_d"]
    if "c_r3" in coefficients:
        return {"alpha": -c_r / c_d, "beta": -coefficients["c_r3"] / c_d}
    return {"K": -c_d / c_r, "T": -1.0 / c_r}


def errors(structure: str, coefficients: Mapping[str, float]) -> dict[str, float]:
    """How far off K and T, or alpha and beta, and K/T are, %, and the first's mean."""
    found, truth = indices(coefficients), indices(TRUTH[structure])
    sizes = {name: 100.0 * abs(found[name] / truth[name] - 1.0) for name in truth}
    effect = 100.0 * abs(coefficients["c_d"] * T / K - 1.0)
    return {**sizes, "mean": float(np.mean(list(sizes.values()))), "K/T": effect}


def gradient(
    X: Floats, y: Floats, omega: float = 0.0, gain: float = 1.0
) -> tuple[Floats, float]:
    """Equations 3-3 to 3-8 as printed, with the innovation e or tanh(omega e).

    Parameters
    ----------
    X : array of shape (n_samples, n_terms)
        Divided by the root mean square of each column here; the start is 0.
    y : array of shape (n_samples,)
    omega : float
        0 for the innovation as it is.
    gain : float
        Factor of each step.

    Returns
    -------
    coefficients : array of shape (n_terms,)
    largest : float
        The largest |omega e|, which tells whether the tanh bends.
    """
    size = np.sqrt(np.mean(X**2, axis=0))
    theta = np.zeros(X.shape[1])
    total = 0.0  # sum of squares of the regressors so far
    largest = 0.0
    for phi, target in zip(X / size, y.tolist(), strict=True):
        error = target - float(phi @ theta)
        total += float(phi @ phi)
        if total > 0.0:
            innovation = np.tanh(omega * error) if omega else error
            theta = theta + gain * innovation / total * phi
            largest = max(largest, abs(omega * error))
    return theta / size, largest


def multi_innovation(structure: str, is_odd: bool) -> dict[str, float]:
    """Equation 4-12, one innovation a step, as printed (even in e) or odd."""
    X, y = regression(structure)
    size = np.sqrt(np.mean(X**2, axis=0))
    theta = np.zeros(X.shape[1])
    P = 1e6 * np.eye(X.shape[1])
    for phi, target in zip(X / size, y.tolist(), strict=True):
        error = target - float(phi @ theta)
        bend = np.tanh(OMEGA * error)
        gain = P @ phi / (1.0 + phi @ P @ phi)
        theta = theta + gain * (bend / OMEGA if is_odd else error * bend)
        P = P - np.outer(gain, phi @ P)
    return dict(zip(TRUTH[structure], (theta / size).tolist(), strict=True))


@cache
def by_gradient(structure: str, method: str) -> dict[str, float]:
    """Coefficients by SG or NISG as printed."""
    theta, _ = gradient(*regression(structure), OMEGA if method == "NISG" else 0.0)
    return dict(zip(TRUTH[structure], theta.tolist(), strict=True))


@cache
def at_best(structure: str) -> Mapping[str, float]:
    """Inverse-free multi-innovation least squares on splines."""
    return identify(
        [trial(structure)],
        structure,
        MultiInnovationLeastSquares(omega=OMEGA),
        particulars=PARTICULARS,
        rudder_bias="none",
    ).coefficients


def table_rows() -> Iterator[Row]:
    """Tables 3-3 and 3-4: errors of K and T, of alpha and beta, their mean, and K/T."""
    for case, (structure, methods) in zip(
        ("Table 3-3", "Table 3-4"), TABLES.items(), strict=True
    ):
        best = errors(structure, at_best(structure))
        for method, values in methods.items():
            printed = {**values, "mean": float(np.mean(list(values.values())))}
            if structure == "nomoto":
                gain, time = ESTIMATES[method]
                printed["K/T"] = 100.0 * abs(gain / time * T / K - 1.0)
            ours = errors(structure, by_gradient(structure, method))
            for name, value in printed.items():
                yield Row(
                    case,
                    f"{name} by {method}: error, %",
                    value,
                    ours[name],
                    best[name],
                    *within(WITHIN, best[name]),
                )


def innovation_rows() -> Iterator[Row]:
    """What the innovation of either chapter does."""
    largest = gradient(*regression("nomoto"), omega=1.0)[1]
    yield Row(
        "Equation 3-7", "largest omega e of the run, omega 1", None, float(largest)
    )
    forms = {
        "e tanh(omega e), as printed, even in e": False,
        "tanh(omega e) / omega, odd in e": True,
    }
    truth = indices(TRUTH["nomoto"])
    for form, is_odd in forms.items():
        found = indices(multi_innovation("nomoto", is_odd))
        for name, value in truth.items():
            yield Row(
                "Equations 4-9 to 4-12",
                f"{name} by {form}: error, %",
                None,
                100.0 * (found[name] / value - 1.0),
            )


def prediction_rows() -> Iterator[Row]:
    """Figures 3.6 and 3.7: yaw rate and track of zigzags by the identified models."""
    found = (TRUTH["norrbin"], by_gradient("norrbin", "NISG"), at_best("norrbin"))
    for angle in (5, 10, 20):
        truth, ours, best = (
            zigzag(ship("norrbin", values), angle, angle, duration=600.0)
            for values in found
        )
        for figure, channel in (("3.6", "r"), ("3.7", "y")):
            least = off(best, truth, channel)
            yield Row(
                f"Figure {figure}",
                f"{angle}/{angle} zigzag, {channel}: rms error, % of span",
                None,
                off(ours, truth, channel),
                least,
                *within(WITHIN, least),
            )


def time_rows() -> Iterator[Row]:
    """Chapter 4: least squares with a matrix inverse (MILS) and without (TMILS)."""
    X, y = regression("norrbin")

    def seconds(length: int, inverse_free: bool) -> float:
        estimator = MultiInnovationLeastSquares(
            innovations=length, inverse_free=inverse_free
        )
        times = []
        for _ in range(REPEATS):
            start = process_time()
            estimator.fit(X, y)
            times.append(process_time() - start)
        return min(times)

    for length in INNOVATIONS:
        yield Row(
            "Section 4.2",
            f"time of TMILS by that of MILS, {length} innovations",
            None,
            seconds(length, True) / seconds(length, False),
        )


def rows() -> Iterator[Row]:
    """All rows."""
    yield from table_rows()
    yield from innovation_rows()
    yield from prediction_rows()
    yield from time_rows()


CONCLUSIONS = (
    Conclusion(
        "The nonlinear innovation greatly improves the accuracy over the stochastic"
        " gradient",
        tuple(
            f"{table}: {MEAN.format(method)}"
            for table in ("Table 3-3", "Table 3-4")
            for method in ("SG", "NISG")
        ),
        lambda k_sg, k_nisg, a_sg, a_nisg: (
            k_nisg.as_paper < k_sg.as_paper and a_nisg.as_paper < a_sg.as_paper
        ),
        "with the printed equations it only shortens the steps",
    ),
    Conclusion(
        "The hyperbolic tangent acts on the innovation",
        ("Equation 3-7: largest omega e of the run, omega 1",),
        lambda largest: largest.as_paper > 0.1,
        "acts: bends it by more than a third of a per cent; of a yaw acceleration in"
        " rad/s2 it does not",
    ),
    Conclusion(
        "The multi-innovation least squares with tanh(omega e) converge to the true"
        " values (equations 4-9 to 4-23)",
        tuple(
            f"Equations 4-9 to 4-12: {name} by e tanh(omega e), as printed, even in e:"
            " error, %"
            for name in ("K", "T")
        ),
        lambda *found: all(abs(row.as_paper) < 10.0 for row in found),
        "converge: within 10 % after 2000 s without noise; the odd form, which is ours,"
        " does",
    ),
    Conclusion(
        "It converges better than the other methods",
        ("Table 3-3: K/T by SG: error, %", "Table 3-3: K/T by NISG: error, %"),
        lambda sg, nisg: nisg.as_paper < sg.as_paper,
        "after 2000 s neither has converged; least squares (at best) has",
    ),
    Conclusion(
        "Without the matrix inverse the multi-innovation least squares are faster",
        tuple(
            f"Section 4.2: time of TMILS by that of MILS, {length} innovations"
            for length in INNOVATIONS
        ),
        lambda *found: all(row.as_paper < 1.0 for row in found),
        "with the same estimate",
    ),
    Conclusion(
        "It is effective in seas and with the full-scale trials of Yukun",
        remark=(
            "her trials, propeller and rudder are not published, and two of the printed"
            " numbers are not a ship's (Table 4-2)"
        ),
    ),
)
PAPER = Paper(
    "song2020",
    "Song 2020, Nonlinear innovation identification for ship maneuvering modeling via"
    " the full-scale trial data",
    f"Hual Trooper's printed Nomoto equations in zigzags of {DURATION:g} s sampled at"
    f" {INTERVAL:g} s.",
    rows,
    CONCLUSIONS,
    (
        "Equations 4-9 to 4-12 as printed are even in the innovation: an error of"
        " either sign pushes the same way, and K and T end far off. The odd form,"
        " tanh(omega e) / omega, is ours.",
        "Equation 3-7: of a yaw acceleration in rad/s2 the tanh bends nothing, so NISG"
        " is SG with shorter steps; the start, which decides the printed errors, is not"
        " printed.",
    ),
)
