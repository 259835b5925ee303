"""Standard manoeuvres of one model, for `shipgym trials`: runs, indices and criteria."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
from shipgym.manoeuvres import Criterion, IndexInterval, Manoeuvre
from shipgym.manoeuvres.imo import imo_criteria
from shipgym.manoeuvres.intervals import intervals_of
from shipgym.manoeuvres.spirals import Spiral
from shipgym.manoeuvres.standard import families_of
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial


@dataclass(frozen=True, eq=False)
class StandardTrials:
    """Standard manoeuvres of a model, and of models drawn from its covariance."""

    families: dict[str, dict[str, Manoeuvre]]  # the manoeuvres by family and name
    sailed: dict[
        str, Trial | Spiral
    ]  # by manoeuvre, as simulated with the model itself
    indices: dict[
        str, dict[str, IndexInterval]
    ]  # by manoeuvre and index, units in the names
    #: the criteria of IMO resolution MSC.137(76); none in shallow water, which they are
    #: not made for
    criteria: dict[str, Criterion]
    refused: dict[str, str]  # why a manoeuvre could not be sailed
    draws: int  # models drawn
    water_depth: float = np.inf  # m

    @property
    def water(self) -> str:
        """Where they were sailed, in words."""
        return (
            "deep water"
            if np.isinf(self.water_depth)
            else f"water of {self.water_depth:g} m"
        )

    def to_dict(self) -> dict[str, Any]:
        """As `--json` prints it."""
        return {
            "draws": self.draws,
            "water_depth": None if np.isinf(self.water_depth) else self.water_depth,
            "manoeuvres": {
                name: {index: found.to_dict() for index, found in indices.items()}
                for name, indices in self.indices.items()
            },
            "refused": self.refused,
            "imo": {
                name: criterion.to_dict() for name, criterion in self.criteria.items()
            },
        }


def standard_trials(
    model: ShipModel,
    draws: int = 0,
    seed: int = 0,
    progress: Callable[[int], None] | None = None,
    water_depth: float = np.inf,
) -> StandardTrials:
    """Sail every standard manoeuvre that suits the ship, with the model and with models drawn from it.

    `model`: the ship; `draws`: models drawn from its covariance; a ship without one has
    none; `seed`: of the draws; `progress`: told the number of draws done;
    `water_depth`: m, for ships with shallow-water equations. Raises InputError for
    water too shallow, or a ship without such equations; UnstableModelError if the ship
    itself runs away in every manoeuvre; where she does in some, or an index cannot be
    read, these are in `refused` and the others stay.
    """
    families = families_of(model, water_depth)
    manoeuvres = {
        name: one for family in families.values() for name, one in family.items()
    }
    sailed: dict[str, Trial | Spiral] = {}
    own: dict[str, dict[str, float | None]] = {}
    refused: dict[str, str] = {}
    lost: Exception | None = None
    for name, manoeuvre in manoeuvres.items():
        own[name] = manoeuvre.no_indices
        try:
            sailed[name] = manoeuvre.sail(model)
            own[name] = asdict(manoeuvre.indices(sailed[name]))
        except (InputError, ManoeuvreError, UnstableModelError) as error:
            refused[name], lost = str(error), error
    if not sailed and lost is not None:
        raise lost
    drawn = model.sample(draws, seed) if draws and model.covariance is not None else []
    evaluated = {name: manoeuvre.evaluate for name, manoeuvre in manoeuvres.items()}
    found = intervals_of(own, drawn, evaluated, progress)
    criteria = imo_criteria(model, found) if np.isinf(water_depth) else {}
    return StandardTrials(
        families, sailed, found, criteria, refused, len(drawn), water_depth
    )
