"""The vectorial models of captive tests, in full (38 coefficients) and reduced (18), with published values.

Source: Xu, Hassani & Guedes Soares 2020, Truncated least square support vector machine for parameter
estimation of a nonlinear manoeuvring model based on PMM tests: equations 19 to 21, 39 to 41 and Table 11.

How the damaged print is read
-----------------------------
* Equation 19 prints Y_vdot vdot + Y_rdot rdot in X. Equations 25 and 26 have v r and r r in their place, as
  the matrix of equation 16 has; so here. Their sign is that printed. Kirchhoff's equations have the other one
  (-Y_vdot v r - Y_rdot r r); the difference is taken up by X_rvu and X_urr, whose values of Table 11 belong
  to the sign as printed.
* Two terms of equations 20 and 21 are printed as Y_rvv and Y_vvr; Table 1's units make the first v r r.
* Absolute values: r |v|, v |v|, v |r|, r |r|, four of each of Y and N (Table 1), 38 coefficients in all.
* Equations 40 and 41 print Y_uvv and Y_urr on u u v and u u r: Y_uuv and Y_uur (equations 28 and 30); so N's.
* In N of equation 41 and Table 11 the value -1.69e-2 is printed on v |v|, -1.00e-3 on r |v|; equation 38, the
  matrix of equation 42 and Table 2 have v |r|, and equation 41 r |r|: so here.
"""

from shipgym.ships.shared_structure import read_shares, shared_structure

XU = (
    "Xu, Hassani & Guedes Soares 2020, Truncated least square support vector machine for parameter "
    "estimation of a nonlinear manoeuvring model based on PMM tests"
)

FULL = "uv ur uur uuv vvv rrr vrr vvr r|v| v|v| v|r| r|r|"
KIRCHHOFF_X, KIRCHHOFF_Y = "Y_vdot:vr Y_rdot:rr", "X_udot:ur"
KIRCHHOFF_N = "Y_vdot:uv -X_udot:uv Y_rdot:ur"


def _named(letter: str, terms: str) -> str:
    """Coefficients of one force by their terms."""
    return " ".join(f"{letter}_{term}" for term in terms.split())


PMM38 = shared_structure(
    "pmm38",
    f"{XU}, equations 19 to 21",
    {
        "u": read_shares(f"X_udot {KIRCHHOFF_X} " + _named("X", "uu uuu rvu vv rv uvv rr urr u|v|")),
        "v": read_shares(f"Y_vdot Y_rdot {KIRCHHOFF_Y} " + _named("Y", FULL)),
        "r": read_shares(f"N_vdot N_rdot {KIRCHHOFF_N} " + _named("N", FULL)),
    },
)
PMM18 = shared_structure(
    "pmm18",
    f"{XU}, equations 39 to 41",
    {
        "u": read_shares(f"X_udot {KIRCHHOFF_X} " + _named("X", "uuu uvv rvu urr")),
        "v": read_shares(f"Y_vdot Y_rdot {KIRCHHOFF_Y} " + _named("Y", "uuv v|v| uur r|v|")),
        "r": read_shares(f"N_vdot N_rdot {KIRCHHOFF_N} " + _named("N", "uur r|r| uuv v|r| r|v|")),
    },
)

#: Xu 2020, Table 11: the reduced model of the ship towed at SINTEF Ocean, prime system.
TABLE_11 = {
    "X_udot": -1.04e-2, "X_uuu": -2.67e-4, "X_uvv": -9.29e-3, "X_rvu": 5.84e-2, "X_urr": -1.22e-3,
    "Y_vdot": -3.82e-2, "Y_rdot": -2.66e-4, "Y_uuv": -6.16e-2, "Y_v|v|": -1.22e-1, "Y_uur": 3.13e-2,
    "Y_r|v|": 1.12e-3,
    "N_rdot": -1.20e-3, "N_vdot": 1.87e-3, "N_uur": -8.41e-3, "N_r|r|": -1.00e-3, "N_uuv": 2.14e-2,
    "N_v|r|": -1.69e-2, "N_r|v|": 1.11e-2,
}  # fmt: skip
