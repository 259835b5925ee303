"""Names and units of the coefficients of a table of terms, which are but numbered."""

import re
from collections import Counter
from collections.abc import Mapping
from typing import Any

from agents.export.field_notes import Label
from agents.export.units_text import unit_text
from shipgym import ShipModel
from shipgym.engine.records import Record, field_types
from shipgym.ships.grey_boxes import GreyBox
from shipgym.ships.term_functions import speed_power
from shipgym.ships.terms import SHAFT_SPEEDS, SPEEDS, TURN_RATES


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
    is_prime = dynamics.normalisation == "prime"
    labels: list[Label] = []
    taken: set[str] = set()
    for equation, terms in dynamics.equations.items():
        for term in terms:
            letters = _letters(term.name)[:30]
            name = _free_name(f"{equation}dot_{letters}", taken)
            powers = Counter(dict(term.powers))
            if is_prime:
                powers["U"] += speed_power(equation, term)

            product = _product(powers)
            unit = _unit(equation, powers)
            note = f"{unit}, of {product} in the rate of {equation}"
            label = Label(name, note)
            labels.append(label)
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


def _product(powers: Mapping[str, int]) -> str:
    """Symbols with their powers, such as `U v |r|^2`."""
    factors = []
    for symbol, power in powers.items():
        if power:
            factors.append(symbol if power == 1 else f"{symbol}^{power}")
    return " ".join(factors) or "1"


def _unit(equation: str, powers: Mapping[str, int]) -> str:
    """SI unit of a coefficient of these symbols in an acceleration."""
    metres = 1 if equation in ("u", "v") else 0
    seconds = -3 if equation == "q" else -2
    for symbol, power in powers.items():
        if symbol in SPEEDS:
            metres -= power
            seconds += power
        elif symbol in (*TURN_RATES, *SHAFT_SPEEDS):
            seconds += power
    return unit_text({"m": metres, "s": seconds})
