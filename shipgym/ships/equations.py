"""Hand-written equations of reference ships: a file of kernels, with the numbers it holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.ships.particulars import Particulars

Floats = NDArray[np.float64]

KERNELS = Path(__file__).parents[1] / "kernels"


@dataclass(frozen=True)
class Equations:
    """The accelerations of one reference ship, as a file of `shipgym/kernels`.

    Attributes
    ----------
    name : str
        Name of the structure, and of the file.
    source : str
        Where it was published.
    command_names : tuple of str
        Rudder, and shaft speed where the ship has a propeller.
    shallow_water : bool
        Whether the depth of the water is known to them.
    astern : bool
        Whether their propeller holds for a shaft that turns astern.
    """

    name: str
    source: str
    command_names: tuple[str, ...]
    shallow_water: bool = False
    astern: bool = False

    @cached_property
    def module(self) -> ModuleType:
        """The file, imported as plain Python."""
        return import_module(f"shipgym.kernels.{self.name}")

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        """Names of the numbers in the file that are coefficients."""
        names: tuple[str, ...] = self.module.COEFFICIENTS
        return names

    @property
    def coefficients(self) -> dict[str, float]:
        """The published coefficients."""
        return {name: float(getattr(self.module, name)) for name in self.coefficient_names}

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state."""
        roll = ("p", "phi") if self.module.ROLL else ()
        shaft = ("n",) if self.module.SHAFT else ()
        return ("x", "y", "psi", "u", "v", "r", *roll, "delta", *shaft)

    def accelerations_source(self, coefficients: Mapping[str, float]) -> str:
        """The file, with the coefficients that differ from the published ones put in their place."""
        text = (KERNELS / f"{self.name}.py").read_text(encoding="utf-8")
        changed = {name: value for name, value in coefficients.items() if value != self.coefficients[name]}
        return text + "".join(f"{name} = {value!r}\n" for name, value in changed.items())

    def kernel_coefficients(
        self, coefficients: Mapping[str, float], particulars: Particulars, shaft_speed: float = 0.0
    ) -> Floats:
        """None: they are compiled into the kernels."""
        return np.empty(0)

    def to_dict(self) -> dict[str, Any]:
        """As it stands in a model file."""
        return {"name": self.name, "source": self.source}


SON_NOMOTO = Equations(
    "container",
    "Son & Nomoto 1981, On the coupled motion of steering and rolling of a high speed container ship",
    ("delta", "n"),
)
VAN_BERLEKOM = Equations(
    "tanker",
    "van Berlekom & Goddard 1972, Maneuvering of large tankers",
    ("delta", "n"),
    shallow_water=True,
    astern=True,
)
MMG_KVLCC2 = Equations(
    "kvlcc2",
    "Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions",
    ("delta", "n"),
)
EQUATIONS = {equations.name: equations for equations in (SON_NOMOTO, VAN_BERLEKOM, MMG_KVLCC2)}
