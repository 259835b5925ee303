"""The printed structures by name, and those that users register."""

from collections.abc import Mapping, Sequence
from typing import Any

from shipgym.checks import check_choice, check_keys, check_table, placed
from shipgym.errors import InputError
from shipgym.ships import container, kvlcc2, mmg, tanker
from shipgym.ships.equations import ShipEquations
from shipgym.ships.pmm import PMM18, PMM38
from shipgym.ships.term_table import EQUATION_NAMES, FORCE_OF_EQUATION, Structure
from shipgym.ships.terms import SYMBOLS, Term, prime_terms, read_terms

__all__ = [
    "ABKOWITZ", "EQUATIONS", "EQUATION_NAMES", "FORCE_OF_EQUATION", "SHIPPED_EQUATIONS", "STRUCTURES",
    "SYMBOLS", "Structure", "Term", "get_dynamics", "get_structure", "list_structures", "own_structure",
    "prime_terms", "read_terms", "register_structure",
]  # fmt: skip

ZHU = "Zhu 2018, Optimized support vector regression algorithm-based modeling of ship dynamics"

SWAY_AND_YAW = prime_terms("0 0u 0uu v r d vvv ddd vvr vvd vdd ud uv ur uud")

ABKOWITZ = Structure(
    name="abkowitz",
    source="Chislett & Strom-Tejsen 1965, Planar motion mechanism tests and full-scale steering and "
    "manoeuvring predictions for a Mariner class vessel; Cao 2015, equations 13 to 17",
    equations={"u": prime_terms("u uu uuu vv rr dd udd vr vd uvd"), "v": SWAY_AND_YAW, "r": SWAY_AND_YAW},
)

FULL_SWAY_AND_YAW = prime_terms("0 0u 0uu v r d uv ur ud vvv vvr vrr rrr vvd vrd rrd vdd rdd ddd uuv uur uud")
ABKOWITZ_FULL = Structure(
    name="abkowitz-full",
    source="Abkowitz 1964, Lectures on ship hydrodynamics, steering and manoeuvrability: the expansion to "
    "third order, every product that port and starboard symmetry allows, and the asymmetry terms 0, 0u, 0uu",
    equations={
        "u": prime_terms("u uu uuu vv rr dd vr vd rd uvv urr udd uvr uvd urd"),
        "v": FULL_SWAY_AND_YAW,
        "r": FULL_SWAY_AND_YAW,
    },
)


def accelerations(name: str, source: str, normalisation: str = "si", **formulas: str) -> Structure:
    """A structure of accelerations from the formulas of its equations `u`, `v`, `r`."""
    equations = {equation: read_terms(text) for equation, text in formulas.items()}
    return Structure(name, source, equations, normalisation, "acceleration")


NOMOTO = accelerations(
    "nomoto",
    f"Nomoto 1957, T rdot + r = K delta as rdot = c_r r + c_d delta, K = -c_d / c_r, T = -1 / c_r; {ZHU}, "
    "equation 4.13",
    r="r, delta",
)
NORRBIN = accelerations(
    "norrbin",
    f"Norrbin 1963, T rdot + n1 r + n3 r^3 = K delta as rdot on r, r^3, delta; {ZHU}, equation 4.14; "
    "Song 2020, equation 3-1",
    r="r, r^3, delta",
)
NOMOTO2 = accelerations(
    "nomoto2",
    "Nomoto 1957, T1 T2 rddot + (T1 + T2) rdot + r = K (delta + T3 deltadot); "
    f"{ZHU}, equation 4.12 (the dot "
    "of the printed last term is lost); as rdot = c_r r + c_d delta + q, qdot = e_r r + e_d delta, where "
    "c_r = -(1/T1 + 1/T2), c_d = K T3 / (T1 T2), e_r = -1 / (T1 T2), e_d = K / (T1 T2)",
    r="r, delta",
    q="r, delta",
)
LINEAR_STEERING = accelerations(
    "linear-steering",
    f"Astrom & Kallstrom 1976, Identification of ship steering dynamics; {ZHU}, equation A.9, where b_v, "
    "b_r, b_d are a11, a12, b11 and c_v, c_r, c_d are a21, a22, b21",
    normalisation="prime",
    v="v, r, delta",
    r="v, r, delta",
)
LINEAR = accelerations(
    "linear",
    "Surge, sway and yaw to first order about straight running, asymmetries included (Abkowitz 1964)",
    normalisation="prime",
    u="1, du",
    v="1, v, r, delta",
    r="1, v, r, delta",
)
SURGE = accelerations("surge", f"{ZHU}, equation 4.7", u="u, |u| u, u^3, |n| n")
SURGE_PERTURBED = accelerations("surge-perturbed", f"{ZHU}, equation 5.8", u="du, du^3, dn")

SEVEN_TERMS = "v, |v| v, |r| v, r, |v| r, |r| r, delta"
STEERING7 = accelerations("steering7", f"{ZHU}, equation 7.1", v=SEVEN_TERMS, r=SEVEN_TERMS)
STEERING5 = accelerations(
    "steering5",
    f"{ZHU}, section 7.4.6: four terms and the acceleration, row 6 of Tables 7.4.9 and 7.4.10",
    v="v, r, |v| r, delta",
    r="v, r, |v| r, delta",
)

#: Sway and yaw of each row of Zhu's Tables 7.4.9 and 7.4.10; rows 1 and 4 are printed with the same columns.
ZHU_ROWS = {
    1: ("|v| v, |r| v, |v| r, |r| r, delta", "|v| v, |r| v, |v| r, |r| r, delta"),
    2: ("v, r, |v| v, |r| r, delta", "v, r, |v| v, |r| r, delta"),
    3: ("v, r, |v| v, |v| r, delta", "v, r, |v| v, |v| r, delta"),
    4: ("|v| v, |r| v, |v| r, |r| r, delta", "|v| v, |r| v, |v| r, |r| r, delta"),
    5: ("v, r, |r| v, delta", "v, r, |r| v, delta"),
    6: ("v, r, |v| r, delta", "v, r, |v| r, delta"),
    7: ("v, r, delta", "v, r, delta"),
    8: ("v, |v| v, delta", "r, |r| r, delta"),
    9: ("r, |v| v, delta", "v, |v| v, delta"),
    10: ("v, |r| v, delta", "r, |r| v, delta"),
}
ZHU_REDUCED = tuple(
    accelerations(f"zhu-{row}", f"{ZHU}, row {row} of Tables 7.4.9 and 7.4.10", v=sway, r=yaw)
    for row, (sway, yaw) in ZHU_ROWS.items()
)

CUBIC_STEERING = "n^2, U v, U r, v^3/U, v^2 r/U, v r^2/U, r^3/U, n^2 delta, n u delta, n^2 delta^3"
CUBIC = accelerations(
    "cubic",
    "Cubic in drift and yaw rate by the instantaneous speed, with propeller and rudder in its race; forms "
    "after Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions",
    normalisation="service",
    u="n^2, n u, u^2, v^2, v r, r^2, n^2 delta^2",
    v=CUBIC_STEERING,
    r=CUBIC_STEERING,
)

RUDDER_4DOF = "n^2 delta, n u delta, n^2 delta^3"
MMG_4DOF = accelerations(
    "mmg4dof",
    "Song 2020, Nonlinear innovation identification for ship maneuvering modeling via the full-scale trial "
    "data, equation 4-2 and Table 4-2: surge, sway, yaw and roll; thrust and normal force of the rudder, "
    "whose data are not printed, as n^2, n u and as n^2 delta, n u delta, n^2 delta^3; u r of sway and phi "
    "of roll, taken for known there, are terms",
    normalisation="service",
    u="u^2, u^3, v^2, r^2, v r, u v^2, u v phi^2, n^2, n u, n^2 delta^2",
    v="u v, u r, u p, u^2 v, r^3, v r^2, v^2 r, u v p^2, u r p^2, |v| v, |r| v, |v| r, |r| r, " + RUDDER_4DOF,
    r="u v, u p, u phi, u^2 r, u^2 v, v^3, r^3, v r^2, v^2 r, u r p^2, |r| v, |v| v, " + RUDDER_4DOF,
    p="p, phi, u v, u r, u^2 v, v^3, v^2 r, v r^2, u v phi^2, u r phi^2, |v| v, " + RUDDER_4DOF,
)

STRUCTURES: dict[str, Structure] = {
    structure.name: structure
    for structure in (
        NOMOTO, NORRBIN, NOMOTO2, LINEAR_STEERING, LINEAR, SURGE, SURGE_PERTURBED, STEERING7, STEERING5,
        *ZHU_REDUCED, ABKOWITZ, ABKOWITZ_FULL, CUBIC, MMG_4DOF, PMM38, PMM18,
    )
}  # fmt: skip
PRINTED = frozenset(STRUCTURES)
WITH_REFERENCE = "grey-box"  # a table that stands on a reference ship, which only a user can name


SHIPPED_EQUATIONS: dict[str, ShipEquations] = {
    ship.name: ship for ship in (container.SHIP, tanker.SHIP, kvlcc2.SHIP, mmg.SHIP)
}
#: Ships with equations of their own by name, registered ones included.
EQUATIONS = dict(SHIPPED_EQUATIONS)


def list_structures() -> list[str]:
    """Names of the structures that can be identified, registered ones, grey box and MMG form included."""
    return [*STRUCTURES, WITH_REFERENCE, mmg.MMG]


def get_structure(name: str) -> Structure:
    """An identified structure by name.

    Raises InputError if there is none of that name, it is the grey box, which takes a reference ship, or the
    MMG form, which is no table.
    """
    if name == mmg.MMG:
        raise InputError(
            "structure: 'mmg' found, which is no table of terms; choose one, such as 'abkowitz' or 'cubic'"
        )
    if name == WITH_REFERENCE:
        raise InputError(
            "structure: 'grey-box' found, which is a reference ship and a table of terms; give the reference "
            "ship: identify(..., structure='grey-box', reference_model='tanker'), or shipgym.ships.grey_box"
        )
    return STRUCTURES[check_choice(name, list_structures(), "structure")]


def get_dynamics(name: str) -> Structure | ShipEquations:
    """A structure, or the equations of a ship that has her own, by name; InputError if there is none."""
    return EQUATIONS[name] if name in EQUATIONS else get_structure(name)


def register_structure(
    name: str,
    equations: Mapping[str, str | Sequence[Term]],
    source: str = "own",
    normalisation: str = "si",
    quantity: str = "acceleration",
) -> Structure:
    """Make a table of terms known by a name, so that it works wherever a structure does.

    Models and their files carry their table, so only the process that identifies has to register it.

    Parameters
    ----------
    name : str
        By which `identify` and `ShipModel` are to know it.
    equations : dict of str to str
        Formulas of surge `u`, sway `v`, yaw `r`, roll `p` and the memory `q` of yaw (see `Structure`), or
        some of them, separated by commas: symbols side by
        side with spaces between, powers after `^`; `du` is the surge speed above service speed, `U` the
        speed through the water: `{"v": "v, r, |v| r, delta", "r": "v, r, v^2 r/U, delta"}`. See `read_terms`.
    source : str
        Where it comes from.
    normalisation : {"si", "prime", "service"}
        Units of the terms; see `Structure`.
    quantity : {"acceleration", "force"}
        What they make up; forces need the ship's mass and added mass.

    Raises
    ------
    InputError
        For a formula that cannot be read, a table that cannot be computed, or a name that another table has.
    """
    units = {"normalisation": normalisation, "quantity": quantity}
    table = {"name": name, "equations": equations, "source": source, **units}
    STRUCTURES[name] = own_structure(table, "register_structure")
    return STRUCTURES[name]


def own_structure(table: Any, where: str) -> Structure:
    """A structure from the arguments of `register_structure`; messages begin with `where`."""
    own = {"source": "own", "normalisation": "si", "quantity": "acceleration", **check_table(table, where)}
    check_keys(own, ("name", "source", "equations", "normalisation", "quantity"), where)
    for key in ("name", "equations"):
        if key not in own:
            raise InputError(
                f'{where}: no {key} found, expected a name and equations, such as r = "r, delta"'
            )
    given = check_table(own["equations"], f"{where}: equations")
    own["equations"] = {q: _terms(formulas, f"{where}: equations.{q}") for q, formulas in given.items()}
    with placed(where):
        structure = Structure(**own)
    name = structure.name
    if name in (*EQUATIONS, WITH_REFERENCE, "auto") or STRUCTURES.get(name, structure) != structure:
        raise InputError(f"{where}: name {name!r} found, which is another structure's; expected a new name")
    return structure


def _terms(given: Any, where: str) -> tuple[Term, ...]:
    """Terms from formulas, or terms as they are."""
    if isinstance(given, str):
        if not given.strip():
            raise InputError(f"{where}: no terms found, expected formulas such as 'v, |v| r, delta'")
        with placed(where):
            return read_terms(given)
    if not isinstance(given, Sequence):
        raise InputError(f"{where}: {given!r} found, expected formulas such as 'v, |v| r, delta'")
    for term in given:
        if not isinstance(term, Term):
            raise InputError(f"{where}: {term!r} found, expected a formula in one text, or Terms")
    return tuple(given)
