"""Check that a table of terms can be computed; refusals name equation and term."""

from collections.abc import Mapping

from shipgym.checks import check_choice, check_text, quoted
from shipgym.errors import InputError
from shipgym.ships.terms import MOST_TERMS, ROLL, Term, symbols_in

#: Equations in their order, with the first letter of the names of accelerations'
#: coefficients: as Zhu 2018 has them for surge, sway and yaw; roll, and the memory of
#: yaw, go on from there.
ACCELERATION_OF_EQUATION = {"u": "a", "v": "b", "r": "c", "p": "d", "q": "e"}
EQUATION_NAMES = tuple(ACCELERATION_OF_EQUATION)

Equations = Mapping[str, tuple[Term, ...]]


def check_structure(
    name: str, source: str, equations: Equations, normalisation: str, quantity: str
) -> None:
    """Refuse names, units, equations or terms that a `Structure` cannot compute."""
    where = f"structure '{name}'"
    check_text(name, "structure: name")
    check_text(source, f"{where}: source")
    check_choice(
        normalisation,
        ("prime", "service", "si"),
        f"{where}: normalisation",
    )
    check_choice(
        quantity,
        ("force", "acceleration"),
        f"{where}: quantity",
    )
    known = [equation for equation in EQUATION_NAMES if equation in equations]
    if not known or list(equations) != known:
        raise InputError(
            f"{where}: expected equations, some of {quoted(EQUATION_NAMES)} in this"
            f" order, got {quoted(equations)}"
        )
    for equation, terms in equations.items():
        _check_terms(terms, normalisation, f"{where}: equations.{equation}")
    has_roll = not symbols_in(equations.values()).isdisjoint(ROLL)
    if has_roll and "p" not in equations:
        raise InputError(
            f"{where}: expected an equation of roll 'p' where terms have roll, got"
            " none; give its terms, or leave roll out"
        )
    if "p" in equations or "q" in equations:
        _check_roll_and_memory(equations, quantity, where)
    if quantity == "force":
        _check_forces(equations, normalisation, where)


def _check_terms(terms: tuple[Term, ...], normalisation: str, where: str) -> None:
    if not 1 <= len(terms) <= MOST_TERMS:
        raise InputError(
            f"{where}: expected 1 to {MOST_TERMS} terms, got {len(terms) or 'none'}"
        )
    seen: set[object] = set()
    for term in terms:
        term.check(where)
        if normalisation == "prime" and term.power("U"):
            raise InputError(
                f"{where}: term '{term.name}': expected no 'U', which is 1 in the prime"
                " system; leave it out, or choose the 'service' or 'si'"
                " normalisation"
            )
        if term.name in seen or term.product in seen:
            raise InputError(
                f"{where}: expected each term once, got '{term.name}' twice"
            )
        seen |= {term.name, term.product}


def _check_roll_and_memory(equations: Equations, quantity: str, where: str) -> None:
    if "q" in equations and ("r" not in equations or "p" in equations):
        raise InputError(
            f"{where}: expected the memory 'q' of yaw with an equation 'r' and without"
            f" one of roll 'p', got equations {quoted(equations)}"
        )
    if quantity != "acceleration":
        raise InputError(
            f"{where}: expected accelerations in a table with roll 'p' or memory 'q',"
            " got forces"
        )


def _check_forces(equations: Equations, normalisation: str, where: str) -> None:
    if normalisation == "si":
        raise InputError(
            f"{where}: expected forces in the 'prime' or 'service' normalisation, got"
            " 'si'"
        )
    if "v" not in equations or "r" not in equations:
        return
    sway = [term.powers for term in equations["v"]]
    yaw = [term.powers for term in equations["r"]]
    if sway != yaw:
        raise InputError(
            f"{where}: expected the same terms in the same order in 'v' and 'r',"
            " because inertia couples the two forces, got others; make them the same,"
            " or write accelerations"
        )
