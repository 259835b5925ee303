"""Names and units of the coefficients of a table of terms, which are but numbered."""

import re
from collections.abc import Mapping
from typing import Any

from agents.deployment.field_notes import Label
from agents.deployment.units_text import unit_text
from shipgym import ShipModel
from shipgym.engine.records import Record, field_types
from shipgym.ships.grey_boxes import GreyBox
from shipgym.ships.term_functions import speed_power
from shipgym.ships.terms import SHAFT_SPEEDS, SPEEDS, TURN_RATES, Term


def coefficient_labels(model: ShipModel) -> dict[Record, Mapping[str, Label]]:
    """Labels of the coefficients of a ship's terms, and of her reference ship's."""
    dynamics: Any = model.dynamics
    record = model.compiled.coefficients
    labels: dict[Record, Mapping[str, Label]] = {}
    if isinstance(dynamics, GreyBox):
        reference: Any = dynamics.ship
        labels |= coefficient_labels(reference)
        record = field_types(record)["terms"]

    numbered = getattr(record, "_fields", ())
    if numbered and all(re.fullmatch(r"c\d+", name) for name in numbered):
        labels[record] = _term_labels(numbered, dynamics)
    return labels


def _term_labels(numbered: tuple[str, ...], dynamics: Any) -> dict[str, Label]:
    """Labels of the terms of a table's equations by their numbers."""
    labels: list[Label] = []
    taken: set[str] = set()
    for equation, terms in dynamics.equations.items():
        for term in terms:
            name = _free_name(f"{equation}dot_{_letters(term.name)}", taken)
            product = " ".join(_factor(*power) for power in term.powers)
            unit = _unit(equation, term, prime=dynamics.normalisation == "prime")
            note = f"{unit}, of {product or '1'} in the rate of {equation}"
            labels.append(Label(name, note))
    return dict(zip(numbered, labels, strict=True))


def _free_name(name: str, taken: set[str]) -> str:
    """A name that is not taken yet, with underscores if need be; it is taken then."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _letters(term: str) -> str:
    """Name of a term in the letters of C: `|v|r` as `abs_v_r`."""
    magnitudes = re.sub(r"\|(\w+)\|", r"abs_\1_", term)
    return re.sub(r"\W", "_", magnitudes, flags=re.ASCII).strip("_")


def _factor(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}^{power}"


def _unit(equation: str, term: Term, prime: bool) -> str:
    """SI unit of a term's coefficient in an acceleration."""
    n_speeds = term.power(*SPEEDS)
    if prime:
        n_speeds += speed_power(equation, term)
    n_rates = term.power(*TURN_RATES, *SHAFT_SPEEDS)
    metres = 1 if equation in ("u", "v") else 0
    per_seconds = 3 if equation == "q" else 2
    return unit_text(
        {"m": metres - n_speeds, "s": n_speeds + n_rates - per_seconds},
    )
