"""Structures by name: printed ones, ships with equations, and those users register."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

from shipgym.checks import check_choice, check_table, placed, unexpected
from shipgym.errors import InputError
from shipgym.files import shipped_toml
from shipgym.ships.term_table import Structure
from shipgym.ships.terms import Term, read_terms, short_terms

if TYPE_CHECKING:  # few models have equations
    from shipgym.ships.equations import ShipEquations

GREY_BOX = "grey-box"
MMG = "mmg"  # the MMG method in its general form
#: The grey box stands on a reference ship, which only a user can name; the MMG form is
#: no table.
NO_TABLES = {
    GREY_BOX: (
        "a table of terms, got 'grey-box', which is a reference ship and a table; give"
        " the reference ship: identify(..., structure='grey-box',"
        " reference_model='tanker'), or shipgym.models.grey_box"
    ),
    MMG: (
        "a table of terms, got 'mmg', which is none; choose one, such as 'abkowitz' or"
        " 'cubic'"
    ),
}
# where a table does not say
USUAL = {"source": "own", "normalisation": "si", "quantity": "acceleration"}

#: What users registered, by name.
REGISTERED_STRUCTURES: dict[str, Structure] = {}
REGISTERED_EQUATIONS: dict[str, ShipEquations] = {}

Read = TypeVar("Read")


# ---- what is shipped -----------------------------------------------------------------


@cache
def printed_tables() -> dict[str, dict[str, Any]]:
    """Tables of `structures.toml` by name, with the papers in their sources."""
    tables = shipped_toml("shipgym.ships", "structures.toml")
    papers = tables.pop("papers")
    for table in tables.values():
        source = table["source"]
        table["source"] = source.format(**papers)
    return tables


@cache
def printed_structure(name: str) -> Structure:
    """Structure of `structures.toml`, given by formulas, letters or shares."""
    tables = printed_tables()
    table = dict(tables[name])
    if "shares" in table:
        from shipgym.ships.shared_structure import SharedStructure

        return SharedStructure.of(name, table["source"], table["shares"])
    if "letters" in table:
        letters = table.pop("letters")
        table["equations"] = _by_axis(letters, short_terms)
    else:
        table["equations"] = _by_axis(table["equations"], read_terms)
    fields = USUAL | table
    return Structure(name=name, **fields)


def _by_axis(texts: Mapping[str, str], read: Callable[[str], Read]) -> dict[str, Read]:
    """Read each text for each of the axes in its key, such as "v r"."""
    by_axis: dict[str, Read] = {}
    for axes, text in texts.items():
        by_axis |= dict.fromkeys(axes.split(), read(text))
    return by_axis


# ---- by name -------------------------------------------------------------------------


def list_structures() -> list[str]:
    """Names of the structures that can be identified, registered ones included."""
    return [*printed_tables(), *REGISTERED_STRUCTURES, *NO_TABLES]


def get_structure(name: str) -> Structure:
    """Return an identified structure by name.

    Raises InputError if there is none of that name, it is the grey box, which takes a
    reference ship, or the MMG form, which is no table.
    """
    if name in REGISTERED_STRUCTURES:
        return REGISTERED_STRUCTURES[name]
    if name in NO_TABLES:
        expected = NO_TABLES[name]
        raise InputError(f"structure: expected {expected}")
    known = list_structures()
    check_choice(name, known, "structure")
    return printed_structure(name)


def list_equations() -> list[str]:
    """Names of ships with equations of their own, registered ones included."""
    shipped = ("container", "tanker", "kvlcc2", MMG)  # each in a file of that name
    return [*shipped, *REGISTERED_EQUATIONS]


def get_equations(name: str) -> ShipEquations:
    """Return a ship's own equations by name; InputError if there are none."""
    if name in REGISTERED_EQUATIONS:
        return REGISTERED_EQUATIONS[name]
    check_choice(name, list_equations(), "equations")
    ship: ShipEquations = import_module(f"shipgym.ships.{name}").SHIP
    return ship


def get_dynamics(name: str) -> Structure | ShipEquations:
    """Return a structure, or a ship's own equations, by name; InputError if unknown."""
    if name in list_equations():
        return get_equations(name)
    return get_structure(name)


# ---- a user's own --------------------------------------------------------------------


def register_structure(
    name: str,
    equations: Mapping[str, str | Sequence[Term]],
    source: str = "own",
    normalisation: str = "si",
    quantity: str = "acceleration",
) -> Structure:
    """Register a table of terms by name, so that it works wherever a structure does.

    Models and their files carry their table, so only the process that identifies has to
    register it.

    Raises InputError for a formula that cannot be read, a table that cannot be
    computed, or a name that another table has.

    Parameters
    ----------
    name : str
        Name for `identify` and `ShipModel`.
    equations : dict of str to str
        Formulas of surge `u`, sway `v`, yaw `r`, roll `p` and the memory `q` of yaw
        (see `Structure`), or some of them, separated by commas: symbols side by side
        with spaces between, powers after `^`; `du` is the surge speed above service
        speed, `U` the speed through the water: `{"v": "v, r, |v| r, delta", "r": "v, r,
        v^2 r/U, delta"}`. See `read_terms`.
    source : str
        Where it comes from.
    normalisation : {"si", "prime", "service"}
        Units of the terms; see `Structure`.
    quantity : {"acceleration", "force"}
        What the terms add up to; forces need the ship's mass and added mass.
    """
    table = {
        "name": name,
        "equations": equations,
        "source": source,
        "normalisation": normalisation,
        "quantity": quantity,
    }
    structure = own_structure(table, "register_structure")
    if name not in printed_tables():  # which it equals
        REGISTERED_STRUCTURES[name] = structure
    return structure


def own_structure(table: Any, where: str) -> Structure:
    """Structure from `register_structure`'s arguments; errors begin with `where`."""
    needed = ("name", "equations")
    own = USUAL | dict(check_table(table, where, (*needed, *USUAL), needed))
    equations = check_table(own["equations"], f"{where}: equations")
    own["equations"] = {
        equation: _terms(given, f"{where}: equations.{equation}")
        for equation, given in equations.items()
    }
    with placed(where):
        structure = Structure(**own)
    name = structure.name
    taken = (*list_equations(), *NO_TABLES, "auto")
    other = name in (*printed_tables(), *REGISTERED_STRUCTURES) and (
        get_structure(name) != structure
    )
    if name in taken or other:
        raise InputError(
            f"{where}: name: expected a new one, got {name!r}, which is another"
            " structure's"
        )
    return structure


def _terms(given: Any, where: str) -> tuple[Term, ...]:
    """Terms from formulas, or terms as they are."""
    formulas = "formulas such as 'v, |v| r, delta'"
    if isinstance(given, str):
        if not given.strip():
            raise InputError(f"{where}: expected {formulas}, got no terms")
        with placed(where):
            return read_terms(given)
    if not isinstance(given, Sequence):
        raise unexpected(where, formulas, given)
    for term in given:
        if not isinstance(term, Term):
            raise unexpected(where, "a formula in one text, or Terms", term)
    return tuple(given)
