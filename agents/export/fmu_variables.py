"""Variables of an FMU as its description and documentation list them."""

from typing import NamedTuple

from agents.export.c99 import Source
from agents.export.units_text import unit_powers


class FmuVariable(NamedTuple):
    """A variable with its value reference and attributes of FMI."""

    name: str
    reference: int
    causality: str
    variability: str
    start: float
    unit: str
    description: str
    is_limit: bool = False  # may not be negative


def fmu_variables(source: Source) -> list[FmuVariable]:
    """Inputs, outputs and parameters of an exported ship or autopilot, in order."""
    found: list[FmuVariable] = []
    for causality, variables in (("input", source.inputs), ("output", source.outputs)):
        for name, about in variables.items():
            variable = FmuVariable(
                name=name,
                reference=len(found) + 1,
                causality=causality,
                variability="continuous",
                start=about.start,
                unit=about.unit,
                description=about.meaning,
            )
            found.append(variable)

    for parameter in source.parameters:
        variable = FmuVariable(
            name=parameter.path,
            reference=len(found) + 1,
            causality="parameter",
            variability="tunable",
            start=float(parameter.value),
            unit=parameter.unit,
            description=parameter.note,
            is_limit=parameter.is_limit,
        )
        found.append(variable)
    return found


def unit_definitions(variables: list[FmuVariable]) -> dict[str, dict[str, int]]:
    """Powers of the base units of each unit that occurs, and of the time's."""
    units = {}
    for unit in ("s", *(one.unit for one in variables)):
        powers = unit_powers(unit)
        if powers is not None:
            units[unit] = powers
    return units
