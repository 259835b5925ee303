"""Zhu 2018: LS-SVR of simplified ship models, with C by bee colony.

One file per case study: 7.2 Nomoto's forms (`response_models`), 7.3 recursive least
squares from LS-SVR's start (`recursive_start`), 7.4 the container ship
(`container_ship`, `steering_forms`).
"""

from __future__ import annotations

from collections.abc import Iterator

from papers.row import Conclusion, Paper, Row
from papers.zhu2018 import (
    container_ship,
    recursive_start,
    response_models,
    steering_forms,
)

CASES = (
    response_models,
    recursive_start,
    container_ship,
    steering_forms,
)


def rows() -> Iterator[Row]:
    """All rows, in the order of the thesis."""
    for case in CASES:
        yield from case.rows()


_NOMOTO = f"Table 7.4.8: linear Nomoto: {steering_forms.ERROR['r']}"
_SEVEN, _FIVE = (
    [f"{case} {words}" for case, words in pairs]
    for pairs in (
        (
            ("Table 7.4.4: ABC, sway:", "mean squared error of prediction, m2/s2"),
            ("Table 7.4.4: ABC, yaw:", "mean squared error of prediction, deg2/s2"),
        ),
        (
            ("Table 7.4.9: row 6:", steering_forms.ERROR["v"]),
            ("Table 7.4.10: row 6:", steering_forms.ERROR["r"]),
        ),
    )
)
_START = (
    "RLS: a22, error, %",
    "LSSVR-RLS: a22, error, %",
    f"RLS: {recursive_start.MOVES}",
    f"LSSVR-RLS: {recursive_start.MOVES}",
)


def _start_helps(plain: Row, started: Row, moves: Row, fewer: Row) -> bool:
    """Both claims of section 7.3: nearer to the truth, and steadier."""
    pairs = ((plain, started), (moves, fewer))
    return all(
        abs(after.as_paper or 0.0) < abs(before.as_paper or 0.0)
        for before, after in pairs
    )


CONCLUSIONS = (
    Conclusion(
        "The further simplified model of steering (five terms) is more accurate than"
        " Nomoto's forms",
        (_NOMOTO, _FIVE[1]),
        lambda nomoto, five: five.as_paper < nomoto.as_paper,
    ),
    Conclusion(
        "The model of seven terms predicts poorly; with fewer terms it predicts better",
        (_SEVEN[0], _FIVE[0], _SEVEN[1], _FIVE[1]),
        lambda sway, less_sway, yaw, less_yaw: (
            less_sway.as_paper < sway.as_paper and less_yaw.as_paper < yaw.as_paper
        ),
    ),
    Conclusion(
        "LS-SVR is more robust to outliers than least squares",
        tuple(
            f"Section 7.2.2: linear: mean error of {name} by {method}, %"
            for name in "KT"
            for method in ("LS", "LS-SVR")
        ),
        lambda k_ls, k, t_ls, t: (
            k.as_paper < 0.9 * k_ls.as_paper and t.as_paper < 0.9 * t_ls.as_paper
        ),
        "more robust: by a tenth of the error; both have a squared loss. Output error"
        " after repair (at best) is",
    ),
    Conclusion(
        "A start by LS-SVR makes RLS more accurate and steadier (ship integrated by"
        " Euler's rule)",
        tuple(f"{recursive_start.EULER_CASE}: {what}" for what in _START),
        _start_helps,
        "by that rule the ship obeys the regression exactly",
    ),
    Conclusion(
        "A start by LS-SVR makes RLS more accurate and steadier (ship integrated"
        " accurately)",
        tuple(f"Table 7.3.2: {what}" for what in _START),
        _start_helps,
        "the start from LS-SVR then has the error of Euler's rule",
    ),
    Conclusion(
        "The bee colony selects a better C than cross-validation and the particle"
        " swarm",
        tuple(
            f"Table 7.4.4: {method}, {what}"
            for what in (
                "sway: mean squared error of prediction, m2/s2",
                "yaw: mean squared error of prediction, deg2/s2",
            )
            for method in ("CV", "PSO", "ABC")
        ),
        lambda v_cv, v_pso, v_abc, r_cv, r_pso, r_abc: (
            v_abc.as_paper < min(v_cv.as_paper, v_pso.as_paper)
            and r_abc.as_paper < min(r_cv.as_paper, r_pso.as_paper)
        ),
        "the objective, the error on the training data, falls with C up to the bound of"
        " the search; cross-validation does not have that flaw",
    ),
    Conclusion(
        "The particle swarm sometimes ends in a local optimum, the bee colony does not",
        tuple(
            f"Table 7.4.4: {method}, {q}: C"
            for q in ("surge", "sway", "yaw")
            for method in ("PSO", "ABC")
        ),
        lambda *found: any(
            abs(pso.as_paper / abc.as_paper - 1.0) > 0.01
            for pso, abc in zip(found[::2], found[1::2], strict=True)
        ),
        "both end at the bound, where the objective has its one minimum",
    ),
    Conclusion(
        "The model is valid for ships of different types, a small vessel among them",
        remark=(
            "her records are not published; a stand-in that obeys the printed model is"
            " no test of it"
        ),
    ),
)
PAPER = Paper(
    "zhu2018",
    "Zhu 2018, Optimized support vector regression algorithm-based modeling of ship"
    " dynamics",
    "Nomoto's forms, the Mariner's linear steering, the container ship of Son & Nomoto"
    " by least squares, recursive least squares and LS-SVR with C by cross-validation,"
    " particle swarm and bee colony.",
    rows,
    conclusions=CONCLUSIONS,
    differences=(
        "The thesis' source integrates by Euler's rule at the 0.5 s of the samples, and"
        " so is the ship here of which the coefficients are identified as the paper"
        " does.",
        "A steady 7 % is left in the linear terms of sway (damping too small, rudder"
        " too large).",
        "b1 is near 1, so 1 - b1 is compared, and 1 - a1.",
        "Upper bounds of C are not printed. They were picked to come nearest: 20 for"
        " yaw in Table 7.4.4 and 1e4 in Table 7.4.10.",
        "Table 7.3.2: the order of the two recursions is that of a ship integrated by"
        " Euler's rule.",
        "The log of 7.2 is not published, a stand-in takes its place; that of 7.5 is"
        " not published either.",
    ),
)
