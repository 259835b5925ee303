"""Prior knowledge of the coefficients of the MMG form, before the trials."""

from dataclasses import dataclass

from shipgym import InputError, ShipModel
from shipgym.checks import bounded, keep_numbers
from shipgym.ships.hull_formulas import YOSHIMURA


@dataclass(frozen=True, eq=False)
class PriorKnowledge:
    """Prior toward which the coefficients of structure `mmg` are pulled.

    Parameters
    ----------
    source : str or ShipModel
        "yoshimura" for the regression formulas of Yoshimura & Masumoto 2012, or a
        reference ship in the MMG form: a model, its name or file.
    strength : float or None, above 0
        The number by which its standard deviations are divided. None chooses it by
        trials held out.
    """

    source: str | ShipModel = YOSHIMURA
    strength: float | None = bounded(None, above=0.0)

    def __post_init__(self) -> None:
        if not isinstance(self.source, str | ShipModel):
            raise InputError(
                "prior: expected a reference ship or the name of formulas, got"
                f" {self.source!r}"
            )
        keep_numbers(self, "prior.")
