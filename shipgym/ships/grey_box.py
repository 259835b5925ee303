"""The grey box: the accelerations of a reference ship, converted by similarity, and a table of terms.

Source: Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via adaptive RM-SVM with
minor rudder. Their equation 11 adds accelerations of two different ships; here those of the reference ship
are converted back to the target first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError
from shipgym.ships.particulars import Particulars
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import WITH_REFERENCE
from shipgym.ships.term_table import Structure
from shipgym.ships.terms import CHANNEL, Term, read_terms

Floats = NDArray[np.float64]

GREY_BOX = WITH_REFERENCE
SOURCE = (
    "Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via adaptive RM-SVM with "
    "minor rudder"
)
LINEAR = read_terms("du, v, r, delta, 1")
CHANNELS = ("u", "v", "r", "p", "phi", "delta", "n")


@dataclass(frozen=True)
class GreyBox(Structure):
    """A reference ship's accelerations plus a table of terms.

    The target's state is converted to the reference ship by the prime system of the service speeds (u and v
    by the ratio of the speeds, r and p by that of speed over length, heel and rudder as they are), and the
    reference ship's accelerations back to the target. The terms are added. Water is deep. The shaft turns as
    commanded, whatever lag the reference ship's has.

    Attributes
    ----------
    reference : ShipModel
        The reference ship: with equations of its own or a table of terms, without heave or trim.
    shaft : bool
        Whether the target's shaft speed is known: then the reference ship's is that times the ratio of the
        shaft speeds at service speed. If not, its shaft turns as at service speed.

    Raises
    ------
    InputError
        For a table of forces, and for a reference ship that is a grey box itself or has no rudder.
    """

    reference: ShipModel | None = None
    shaft: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        where = f"structure '{self.name}'"
        if self.reference is None:
            raise InputError(
                f"{where}: no reference found, expected a ShipModel, or the name of a shipped model"
            )
        if isinstance(self.reference.dynamics, GreyBox):
            raise InputError(
                f"{where}: reference {self.reference.name!r} is a grey box itself, expected a reference ship "
                "or a table of terms; take that grey box's own reference"
            )
        if self.quantity != "acceleration":
            raise InputError(
                f"{where}: quantity 'force' found, expected 'acceleration': the terms are added to the "
                "reference ship's accelerations"
            )
        if self.shaft and "n" not in self.reference.command_names:
            raise InputError(
                f"{where}: shaft true found, but reference {self.reference.name!r} knows no shaft speed; "
                "leave it out"
            )

    @property
    def ship(self) -> ShipModel:
        """The reference ship."""
        assert self.reference is not None
        return self.reference

    @property
    def rolls(self) -> bool:
        """Whether the reference ship has a rolling motion, and with it the target."""
        return "phi" in self.ship.state_names

    @cached_property
    def required_channels(self) -> tuple[str, ...]:
        """Channels a trial needs: those of the terms and those that the reference ship is evaluated at."""
        needed = {CHANNEL[symbol] for symbol in self.symbols} | {"u", "v", "r", "delta"}
        needed |= {"p", "phi"} if self.rolls else set()
        needed |= {"n"} if self.shaft else set()
        return tuple(name for name in CHANNELS if name in needed)

    @property
    def has_rudder(self) -> bool:
        """Whether a rudder turns it: that of the reference ship does."""
        return True

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state, with roll where the reference ship rolls."""
        roll = ("p", "phi") if self.rolls else ()
        return ("x", "y", "psi", "u", "v", "r", *roll, "delta")

    @property
    def needs_shaft_speed(self) -> bool:
        """Whether the shaft speed at service speed has to be known."""
        return self.shaft or super().needs_shaft_speed

    def accelerations_source(self, coefficients: Mapping[str, float]) -> str:
        """Source of the compiled accelerations; the coefficients of the terms are read at run time."""
        return self._source

    @cached_property
    def _source(self) -> str:
        """Written once, however many models share the grey box."""
        from shipgym.engine.grey_box_source import grey_box_source

        return grey_box_source(self)

    def converted_accelerations(
        self, channels: Mapping[str, Any], particulars: Particulars, shaft_speed: float = 0.0
    ) -> dict[str, Floats]:
        """Accelerations of the reference ship, evaluated at and converted back to the target.

        Parameters
        ----------
        channels : mapping of str to array of shape (n_samples,)
            Of the target: u, v, r, delta, and n, p, phi where known; SI units.
        particulars : Particulars
            The target's length and service speed.
        shaft_speed : float
            The target's at service speed, 1/s.

        Returns
        -------
        dict of str to array of shape (n_samples,)
            By equation `u`, `v`, `r`: m/s^2 and rad/s^2 of the target.
        """
        ship = self.ship
        fast = ship.particulars["speed"] / particulars["speed"]
        quick = fast * particulars["length"] / ship.particulars["length"]
        u = np.asarray(channels["u"], dtype=float)
        zero = np.zeros_like(u)
        n = np.full_like(u, ship.service_shaft_speed)
        if self.shaft:
            n = np.asarray(channels["n"], dtype=float) * (ship.service_shaft_speed / shaft_speed)
        scale = {"u": fast, "v": fast, "r": quick, "p": quick, "phi": 1.0, "delta": 1.0}
        values = {name: scale[name] * np.asarray(channels.get(name, zero), dtype=float) for name in scale}
        values["n"] = n
        states = np.stack([values.get(name, zero) for name in ship.state_names], axis=-1)
        commands = np.stack([values[name] for name in ship.command_names], axis=-1)
        rates = ship.derivatives(states, commands)
        back = {"u": 1.0 / (fast * quick), "v": 1.0 / (fast * quick), "r": 1.0 / (quick * quick)}
        return {q: rates[:, ship.state_names.index(q)] * back[q] for q in back}

    def to_dict(self) -> dict[str, Any]:
        """The table and the whole reference ship, as they stand in a model file."""
        from shipgym.ships.model_file import model_fields

        return {**super().to_dict(), "shaft": self.shaft, "reference": model_fields(self.ship)}


def grey_box(
    reference: str | ShipModel,
    equations: Mapping[str, str | tuple[Term, ...]] | None = None,
    shaft: bool | None = None,
    name: str = GREY_BOX,
) -> GreyBox:
    """A reference ship plus a table of terms.

    Parameters
    ----------
    reference : str or ShipModel
        A shipped model's name, the path of a model file, or a model.
    equations : mapping of str to str or Terms, optional
        Terms by equation `u`, `v`, `r` in units of service speed (`read_terms`); by default Mei's: du (the
        speed above service speed), v, r, delta and a constant, in all three.
    shaft : bool, optional
        Whether the target's shaft speed is known; by default if the reference ship knows one.
    name : str
        Of the structure.

    Returns
    -------
    GreyBox

    Raises
    ------
    InputError
        For a reference that does not exist or cannot be one, or a table that cannot be computed.
    """
    from shipgym.ships.catalogue import load_model

    ship = reference if isinstance(reference, ShipModel) else load_model(reference)
    table = {
        q: read_terms(terms) if isinstance(terms, str) else tuple(terms)
        for q, terms in (equations or dict.fromkeys("uvr", LINEAR)).items()
    }
    stripped = replace(ship, covariance=None, envelope=None, provenance=None)
    known = "n" in ship.command_names if shaft is None else shaft
    return GreyBox(name, SOURCE, table, "service", "acceleration", stripped, known)


def converted_model(
    reference: str | ShipModel | GreyBox,
    particulars: Particulars,
    steering: SteeringGear,
    service_shaft_speed: float = 0.0,
    name: str | None = None,
) -> ShipModel:
    """The bare reference ship as a model of another ship: a grey box whose terms are all zero.

    Parameters
    ----------
    reference : str, ShipModel or GreyBox
        As in `grey_box`.
    particulars : Particulars
        Of the target, with its service speed.
    steering : SteeringGear
        Of the target.
    service_shaft_speed : float
        Of the target, 1/s; 0: not known, and the reference ship's is taken as at service speed.
    name : str, optional
        By default the target's.

    Returns
    -------
    ShipModel
    """
    box = reference
    if not isinstance(box, GreyBox):
        box = grey_box(box)
        box = replace(box, shaft=box.shaft and service_shaft_speed > 0.0)
    return ShipModel(
        name=particulars.name if name is None else name,
        structure=box.name,
        particulars=particulars,
        steering=steering,
        coefficients=dict.fromkeys(box.coefficient_names, 0.0),
        own_table=box,
        service_shaft_speed=service_shaft_speed,
        provenance={"source": box.source, "reference": box.ship.name},
    )
