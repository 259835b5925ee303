"""Section 7.4.2 to 7.4.4: the container ship by LS-SVR tuned by CV, PSO and ABC.

*As the paper* is of the ship integrated as the thesis' source does (`ships`), *at best*
of the ship integrated accurately.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from time import process_time

import numpy as np
from numpy.typing import NDArray

from identification.estimators.lssvm import LSSVM
from identification.estimators.tuned import TunedLSSVM
from identification.samples.prediction import predict
from papers.row import COMPUTED, ELSEWHERE, PICKED, Row
from papers.zhu2018.fits import (
    MOST_C,
    PREFIX,
    RAN_AWAY,
    Difference,
    mean_square,
    search,
    spline_fit,
    steer,
    steering_fit,
    steering_terms,
)
from papers.zhu2018.ships import (
    RPM,
    SHAFT_RPM,
    SPEED,
    ship,
    straight_line,
    zigzag_trial,
)
from shipgym.models import ShipModel
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

OTHER_TERMS = (
    "at best: U v, U r, v^2 r/U, U^2 delta, with surge: not the thesis' terms, which"
    " have |v| r"
)
ACCEPTED = 0.5  # mean squared error of surge that the thesis accepts, m^2/s^2
REPEATS = 30  # of timings
FAST = 0.010  # aim, s

EQUATIONS = {"u": "surge", "v": "sway", "r": "yaw"}
UNITS = {"u": "m2/s2", "v": "m2/s2", "r": "deg2/s2"}
PRINTED_C = {
    "CV": {"u": 0.2318e7, "v": 0.8968e9, "r": 14.7966},
    "PSO": {"u": 1.7492e7, "v": 6.0e9, "r": 19.7130},
    "ABC": {"u": 4.3313e7, "v": 8.9486e9, "r": 19.9067},
}
PRINTED_TIME = {
    "CV": {"u": 0.2318, "v": 0.2450, "r": 0.2729},
    "PSO": {"u": 0.3181, "v": 0.2659, "r": 0.2553},
    "ABC": {"u": 0.7143, "v": 0.2700, "r": 0.3285},
}
PRINTED_MSE = {
    "CV": {"u": 0.5296, "v": 1.6221, "r": 1.0096},
    "PSO": {"u": 0.4868, "v": 0.2340, "r": 0.1903},
    "ABC": {"u": 0.1289, "v": 0.3380, "r": 0.1196},
}
PRINTED_COEFFICIENTS = {
    "CV": {
        "u": (0.99420, -1.8293e-5, 85.926e-5),
        "v": (0.9744, 0.0045, 1.4094, -1.6364, 3.5224, -145.7, -0.0278),
        "r": (-0.0104, 0.0002, -0.0011, 0.0235, 0.0024, 0.0001, 0.0153),
    },
    "PSO": {
        "u": (0.99340, -0.9270e-5, 84.218e-5),
        "v": (0.9743, 0.0043, 1.5306, -1.6533, 3.5656, -140.3, -0.0278),
        "r": (-0.0110, 0.0002, -0.0035, 0.0230, 0.0025, 0.0001, 0.0152),
    },
    "ABC": {
        "u": (0.99420, -1.8484e-5, 85.739e-5),
        "v": (0.9743, 0.0045, 1.5075, -1.6488, 3.573, -142.2, -0.0278),
        "r": (-0.0092, 0.0002, -0.0010, 0.0223, 0.0024, 0.0001, 0.0153),
    },
}
PRINTED_FIRST = {  # Table 7.4.3
    "u": (0.9942, -1.603e-5, 85.962e-5),
    "v": (0.9743, 0.0043, 1.5306, -1.6533, 3.5656, -140.312, -0.0278),
    "r": (-0.0092, 0.0002, -0.0010, 0.0223, 0.0024, 0.0001, 0.0153),
}
PRINTED_REGRESSION = {"u": 4.0346e-6, "v": 3.5005e-6, "r": 4.3924e-6}
PREFIX_OF = {"u": "a", **PREFIX}
SHIP = {True: "", False: ", ship integrated accurately"}
TABLES = {"u": "7.4.5", "v": "7.4.6", "r": "7.4.7"}
BOUND = (
    "the training objective drives C to the upper bound of the search, which is not"
    " printed and was picked here to come near the printed C: "
)

#: Terms of `WITH_SPEED`: u^2, n^2, n u; u^2, v r, n^2; U v, U r, v^2 r/U, U^2 delta,
#: which is not row 6 of Tables 7.4.9 and 7.4.10: that has |v| r in place of v^2 r/U.
SURGE_ALONE, SURGE_IN_TURNS, FOUR_WITH_SPEED = (0, 2, 3), (0, 1, 2), (0, 3, 7, 6)


def surge_terms(trial: Trial) -> Floats:
    """Terms of equation 5.8: surge speed above 8 m/s and its cube, order over 80 rpm.

    The thesis does not say whether it took order or shaft speed; with the order come
    its coefficients.
    """
    faster = trial["u"] - SPEED
    return np.column_stack([faster, faster**3, trial["n_command"] / RPM - SHAFT_RPM])


def surge_fit(trial: Trial, estimator: LSSVM | TunedLSSVM) -> Difference:
    """Fit the difference equation of surge."""
    fitted = estimator.fit(surge_terms(trial)[:-1], trial["u"][1:] - SPEED)
    return Difference(fitted.coef_.tolist(), fitted.intercept_, 0.0, fitted)


def surge(fit: Difference, trial: Trial) -> dict[str, Floats]:
    """Predict surge from the first sample and orders; infinite after running away."""
    faster = np.full(len(trial), np.inf)
    x = float(trial["u"][0]) - SPEED
    for k, quicker in enumerate(surge_terms(trial)[:, 2].tolist()):
        faster[k] = x
        x = fit.step(x, (x, x**3, quicker))
        if not abs(x) < RAN_AWAY:
            break
    return {"u": SPEED + faster}


def fit_equation(
    equation: str, estimator: LSSVM | TunedLSSVM, by_euler: bool = True
) -> Difference:
    """One equation as the thesis identifies it, on one of the two ships."""
    if equation == "u":
        return surge_fit(straight_line("learned", by_euler), estimator)
    return steering_fit(zigzag_trial(10, by_euler=by_euler), equation, estimator)


@cache
def as_printed(method: str, by_euler: bool = True) -> dict[str, Difference]:
    """The three equations by one of the thesis' methods, on one of the two ships."""
    return {q: fit_equation(q, search(method, q), by_euler) for q in EQUATIONS}


def predicted_errors(
    fits: dict[str, Difference], by_euler: bool = True
) -> dict[str, float]:
    """Mean squared errors of the second straight line and the 20/20 zigzag."""
    line = straight_line("verified", by_euler)
    turns = zigzag_trial(20, by_euler=by_euler)
    driven = surge(fits["u"], line)
    steered = steer(fits["v"], fits["r"], turns)
    return {
        "u": mean_square(driven, line, "u"),
        "v": mean_square(steered, turns, "v"),
        "r": mean_square(steered, turns, "r"),
    }


@cache
def best_surge() -> ShipModel:
    """Surge on u^2, n^2 and n u, from spline samples of the first straight line."""
    return spline_fit(straight_line("learned"), ship(), {"u": SURGE_ALONE})


@cache
def best_steering(rudder_limit_deg: float = 35.0) -> ShipModel:
    """Four terms with instantaneous speed in sway and yaw, from 10/10 splines."""
    columns = {"u": SURGE_IN_TURNS, "v": FOUR_WITH_SPEED, "r": FOUR_WITH_SPEED}
    return spline_fit(
        zigzag_trial(10, rudder_limit_deg), ship(rudder_limit_deg), columns
    )


@cache
def best_errors() -> dict[str, float]:
    """What the best models here reach in the thesis' predictions."""
    line = straight_line("verified")
    turns = zigzag_trial(20)
    driven = predict(best_surge(), line)
    steered = predict(best_steering(), turns)
    return {
        "u": mean_square(driven, line, "u"),
        "v": mean_square(steered, turns, "v"),
        "r": mean_square(steered, turns, "r"),
    }


@cache
def seconds() -> dict[tuple[str, str], float]:
    """Processor time of each search with its fit by method and equation, s.

    The least of several, taken in turns, so that other work on the estimator does not
    count.
    """
    searches = [(method, q) for method in PRINTED_TIME for q in EQUATIONS]
    least = dict.fromkeys(searches, np.inf)
    for _ in range(REPEATS):
        for method, q in searches:
            start = process_time()
            fit_equation(q, search(method, q))
            least[method, q] = min(least[method, q], process_time() - start)
    return least


def regression_rows() -> Iterator[Row]:
    """Table 7.4.2: C and the errors of the regression by ABC."""
    for q, printed in PRINTED_REGRESSION.items():
        fit, trial = (
            as_printed("ABC")[q],
            straight_line("learned", by_euler=True)
            if q == "u"
            else zigzag_trial(10, by_euler=True),
        )
        terms = surge_terms(trial) if q == "u" else steering_terms(trial)
        offset = SPEED if q == "u" else 0.0
        error = terms[:-1] @ np.array(fit.gains) + fit.constant + offset - trial[q][1:]
        yield Row(
            "Table 7.4.2",
            f"{EQUATIONS[q]}: mean squared error of the regression,"
            f" {'rad2/s2' if q == 'r' else 'm2/s2'}",
            printed,
            float(np.mean(error**2)),
            None,
            note=(
                "printed in deg2/s2, but its size is that of rad2/s2"
                if q == "r"
                else ""
            ),
        )


def weight_rows() -> Iterator[Row]:
    """Table 7.4.4: C."""
    for method, by_equation in PRINTED_C.items():
        for q, printed in by_equation.items():
            estimator = as_printed(method)[q].estimator
            assert isinstance(estimator, TunedLSSVM)
            note = f"{BOUND}{MOST_C[q]:g}"
            if method == "ABC":
                note += (
                    "; Table 7.4.4 has this row shifted, the value is that of Table"
                    " 7.4.2"
                )
            if method == "CV":
                note = "folds are not printed: 5 blocks of time here"
            yield Row(
                "Table 7.4.4",
                f"{method}, {EQUATIONS[q]}: C",
                printed,
                estimator.C_,
                None,
                note=note,
                basis=COMPUTED if method == "CV" else PICKED,
            )


def condition() -> float:
    """Condition number of the seven standardised terms of the 10/10 zigzag."""
    terms = steering_terms(zigzag_trial(10))
    return float(np.linalg.cond((terms - terms.mean(axis=0)) / terms.std(axis=0)))


def printed_coefficients() -> Iterator[tuple[str, str, str, tuple[float, ...]]]:
    """Table, method, equation and coefficients of Tables 7.4.3 and 7.4.5 to 7.4.7."""
    for q, printed in PRINTED_FIRST.items():
        yield "7.4.3", "ABC", q, printed
    for q, table in TABLES.items():
        for method in PRINTED_COEFFICIENTS:
            yield table, method, q, PRINTED_COEFFICIENTS[method][q]


def coefficient_rows() -> Iterator[Row]:
    """Tables 7.4.3 and 7.4.5 to 7.4.7, with the printed C, on both ships."""
    drift = (
        f"C as printed; seven collinear terms, condition number {condition():.0f}:"
        " easily changed"
    )
    notes = {"u": "C as printed", "v": drift, "r": drift}
    for table, method, q, printed in printed_coefficients():
        estimator = LSSVM(C=PRINTED_C[method][q], scale=False)
        for by_euler in (True, False):
            gains = list(fit_equation(q, estimator, by_euler).gains)
            note = notes[q]
            if (table, q) == ("7.4.3", "v"):
                note += "; they are those of PSO in Table 7.4.6, a slip"
            for k, value in enumerate(printed, start=1):
                name, expected, found = f"{PREFIX_OF[q]}{k}", value, gains[k - 1]
                is_repeated = table == "7.4.3" and value in {
                    values[q][k - 1] for values in PRINTED_COEFFICIENTS.values()
                }
                if k == 1 and q != "r":  # of the state itself, near 1
                    name, expected, found = f"1 - {name}", 1.0 - value, 1.0 - found
                yield Row(
                    f"Table {table}{SHIP[by_euler]}",
                    f"{method}: {name}",
                    expected,
                    found,
                    None,
                    note=note if k == 1 else "",
                    basis=COMPUTED if by_euler and not is_repeated else ELSEWHERE,
                )


def prediction_rows() -> Iterator[Row]:
    """Table 7.4.4: errors of the predicted straight line and 20/20 zigzag."""
    for method, printed in PRINTED_MSE.items():
        ours = predicted_errors(as_printed(method))
        exact = predicted_errors(as_printed(method, by_euler=False), by_euler=False)
        for q, value in printed.items():
            least = min(by_equation[q] for by_equation in PRINTED_MSE.values())
            best = best_errors()[q]
            yield Row(
                "Table 7.4.4",
                f"{method}, {EQUATIONS[q]}: mean squared error of prediction,"
                f" {UNITS[q]}",
                value,
                ours[q],
                best,
                f"below {least:g}" + (f" (accepted: {ACCEPTED:g})" if q == "u" else ""),
                best < least,
                (
                    "shaft orders of the straight lines are not printed: a stand-in; at"
                    " best: u^2, n^2 and n u"
                    if q == "u"
                    else f"does not come out on either ship; {OTHER_TERMS}"
                ),
            )
            yield Row(
                f"Table 7.4.4{SHIP[False]}",
                f"{method}, {EQUATIONS[q]}: mean squared error of prediction,"
                f" {UNITS[q]}",
                value,
                exact[q],
                None,
                basis=ELSEWHERE,
            )


def time_rows() -> Iterator[Row]:
    """Table 7.4.4: time of search and fit at 1800 samples."""
    for method, printed in PRINTED_TIME.items():
        for q, value in printed.items():
            best = seconds()[method, q]
            yield Row(
                "Table 7.4.4",
                f"{method}, {EQUATIONS[q]}: time, s",
                value,
                None,
                best,
                f"below {FAST:g}",
                best < FAST,
                f"the same search, by one decomposition; least of {REPEATS} on this"
                " machine",
            )


def rows() -> Iterator[Row]:
    """All rows of the sections."""
    yield from regression_rows()
    yield from coefficient_rows()
    yield from weight_rows()
    yield from prediction_rows()
    yield from time_rows()
