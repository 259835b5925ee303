"""The eight requirements of chapter 3, and what shows each of them here."""

from __future__ import annotations

REQUIREMENTS = (
    (
        "R1",
        "Every term has a physical meaning",
        "Linear damping, cross-flow drag, rudder: the four terms of Section 7.4.6. A term that the data do "
        "not ask for goes: `identification.reduction`, `tests/identification/test_reduction.py`. The rows of "
        "Tables 7.4.9 and 7.4.10 without linear damping show what becomes of a model that lacks the meaning.",
    ),
    (
        "R2",
        "Simple form, low order, few terms",
        "Four terms in sway and in yaw reach 0.02 m2/s2 and 0.005 deg2/s2: rows of Section 7.4.6; the seven "
        "of Table 7.4.4 in the thesis' way do not.",
    ),
    (
        "R3",
        "The model is identifiable",
        "From a clean record all six parameters of the Mariner come back: Figure 7.3.2, at best. Where terms "
        "are collinear the summary names them: `tests/identification/test_diagnostics.py`. What cannot be "
        "told apart is said so: K and a in Table 7.2.1.",
    ),
    (
        "R4",
        "Acceptable accuracy",
        "Mean squared errors of prediction in Tables 7.4.4, 7.4.9 and 7.4.10 and Section 7.5.2.",
    ),
    (
        "R5",
        "The method is robust",
        "Rows of Section 7.2.2: outliers and coloured noise. Plain LS-SVR is not robust; its weighted form "
        "is.",
    ),
    (
        "R6",
        "Not sensitive to start values",
        "The fit has none; its search for C gives the same coefficients from any seed: "
        "`test_the_fit_has_no_start_and_its_search_forgets_its_own` in "
        "`tests/identification/test_zhu2018.py`. Recursive forms that start from zero do feel it: Table "
        "7.3.2.",
    ),
    (
        "R7",
        "The global optimum",
        "For a given C the cost is strictly convex, so that the point of zero gradient is the only minimum: "
        "`test_the_cost_is_strictly_convex_and_the_fit_is_its_minimum`, the same file. Over log C the search "
        "is compared with a fine grid in the same test as R6.",
    ),
    (
        "R8",
        "Low complexity",
        "Times in Table 7.4.4 and their growth in Figures 7.4.7 and 7.4.8: one decomposition, O(N m^2), for "
        "the whole search.",
    ),
)


def table() -> str:
    """The requirements as a table in Markdown."""
    lines = ["### Requirements", "", "| | requirement of the thesis | shown by |", "| --- | --- | --- |"]
    return "\n".join([*lines, *(f"| {name} | {what} | {where} |" for name, what, where in REQUIREMENTS)])
