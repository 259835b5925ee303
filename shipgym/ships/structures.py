"""The printed structures by name (`structures.toml`), and those that users register."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from shipgym.checks import check_choice, check_keys, check_table, placed
from shipgym.errors import InputError
from shipgym.files import shipped_toml
from shipgym.ships import container, kvlcc2, mmg, tanker
from shipgym.ships.equations import ShipEquations
from shipgym.ships.shared_structure import read_shares, shared_structure
from shipgym.ships.term_table import Structure
from shipgym.ships.terms import Term, read_terms, short_terms

# a table that stands on a reference ship, which only a user can name
WITH_REFERENCE = "grey-box"
Read = TypeVar("Read")
USUAL = {
    "source": "own",
    "normalisation": "si",
    "quantity": "acceleration",
}  # where a table does not say


def _read_printed(
    name: str, table: dict[str, Any], papers: Mapping[str, str]
) -> Structure:
    """A structure of `structures.toml`, whose terms are formulas, letters or shares of coefficients."""
    source = table.pop("source").format(**papers)
    if "shares" in table:
        return shared_structure(name, source, _by_axis(table["shares"], read_shares))
    if "letters" in table:
        terms = _by_axis(table.pop("letters"), short_terms)
    else:
        terms = _by_axis(table.pop("equations"), read_terms)
    return Structure(name, source, terms, **table)


def _by_axis(texts: Mapping[str, str], read: Callable[[str], Read]) -> dict[str, Read]:
    """What is read of each text, for each of the axes in its key, such as "v r"."""
    return {axis: read(text) for axes, text in texts.items() for axis in axes.split()}


_TABLES = shipped_toml("shipgym.ships", "structures.toml")
_PAPERS = _TABLES.pop("papers")
STRUCTURES = {
    name: _read_printed(name, USUAL | table, _PAPERS) for name, table in _TABLES.items()
}
PRINTED = frozenset(STRUCTURES)

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

    Raises InputError if there is none of that name, it is the grey box, which takes a
    reference ship, or the MMG form, which is no table.
    """
    if name == mmg.MMG:
        raise InputError(
            "structure: 'mmg' found, which is no table of terms; choose one, such as"
            " 'abkowitz' or 'cubic'"
        )
    if name == WITH_REFERENCE:
        raise InputError(
            "structure: 'grey-box' found, which is a reference ship and a table of"
            " terms; give the reference ship: identify(..., structure='grey-box',"
            " reference_model='tanker'), or shipgym.ships.grey_box"
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
    units = {"normalisation": normalisation, "quantity": quantity}
    table = {"name": name, "equations": equations, "source": source, **units}
    STRUCTURES[name] = own_structure(table, "register_structure")
    return STRUCTURES[name]


def own_structure(table: Any, where: str) -> Structure:
    """A structure from the arguments of `register_structure`; messages begin with `where`."""
    own: dict[str, Any] = {**USUAL, **check_table(table, where)}
    check_keys(own, ("name", "equations", *USUAL), where)
    for key in ("name", "equations"):
        if key not in own:
            raise InputError(
                f"{where}: no {key} found, expected a name and equations, such as r ="
                ' "r, delta"'
            )
    given = check_table(own["equations"], f"{where}: equations")
    own["equations"] = {
        q: _terms(formulas, f"{where}: equations.{q}") for q, formulas in given.items()
    }
    with placed(where):
        structure = Structure(**own)
    name = structure.name
    if (
        name in (*EQUATIONS, WITH_REFERENCE, "auto")
        or STRUCTURES.get(name, structure) != structure
    ):
        raise InputError(
            f"{where}: name {name!r} found, which is another structure's; expected a"
            " new name"
        )
    return structure


def _terms(given: Any, where: str) -> tuple[Term, ...]:
    """Terms from formulas, or terms as they are."""
    if isinstance(given, str):
        if not given.strip():
            raise InputError(
                f"{where}: no terms found, expected formulas such as 'v, |v| r, delta'"
            )
        with placed(where):
            return read_terms(given)
    if not isinstance(given, Sequence):
        raise InputError(
            f"{where}: {given!r} found, expected formulas such as 'v, |v| r, delta'"
        )
    for term in given:
        if not isinstance(term, Term):
            raise InputError(
                f"{where}: {term!r} found, expected a formula in one text, or Terms"
            )
    return tuple(given)
