"""Standard manoeuvres of a model for `shipgym trials`: runs, indices, criteria."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from identification.progress import counted
from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
from shipgym.manoeuvres import Criterion, IndexInterval, Manoeuvre
from shipgym.manoeuvres.imo import imo_criteria
from shipgym.manoeuvres.intervals import intervals_of
from shipgym.manoeuvres.standard import standard_manoeuvres
from shipgym.models import ShipModel
from shipgym.trials.trial import Trial


@dataclass(frozen=True, eq=False)
class StandardTrials:
    """Standard manoeuvres of a model, and of models drawn from its covariance.

    Attributes
    ----------
    runs : dict
        Simulation of each manoeuvre with the model itself.
    indices : dict
        Indices by manoeuvre and name, units in the names.
    criteria : dict
        Criteria of IMO resolution MSC.137(76).
    refused : dict
        Why a manoeuvre could not be simulated, or has no indices.
    draws : int
        Number of models drawn.
    """

    runs: dict[str, Trial]
    indices: dict[str, dict[str, IndexInterval]]
    criteria: dict[str, Criterion]
    refused: dict[str, str]
    draws: int

    def to_dict(self) -> dict[str, Any]:
        """The content for `--json`."""
        manoeuvres = {}
        for name, indices in self.indices.items():
            manoeuvres[name] = {key: index.to_dict() for key, index in indices.items()}
        criteria = {name: one.to_dict() for name, one in self.criteria.items()}
        return {
            "draws": self.draws,
            "manoeuvres": manoeuvres,
            "refused": self.refused,
            "imo": criteria,
        }


def standard_trials(model: ShipModel, draws: int = 0, seed: int = 0) -> StandardTrials:
    """Simulate the standard manoeuvres of a ship, with its model and with draws of it.

    A manoeuvre that cannot be simulated, or has no indices, is in `refused`. Raises
    UnstableModelError if the model runs away in every manoeuvre.

    Parameters
    ----------
    model : ShipModel
        The ship.
    draws : int
        Models drawn from the covariance; a model without one has none.
    seed : int
        Seed of the draws.
    """
    manoeuvres = standard_manoeuvres(model)
    runs, own, refused = _simulate(model, manoeuvres)
    drawn = []
    if draws and model.covariance is not None:
        drawn = model.sample(draws, seed)
    evaluate = {name: manoeuvre.evaluate for name, manoeuvre in manoeuvres.items()}
    indices = intervals_of(own, counted("models drawn", drawn), evaluate)
    return StandardTrials(
        runs=runs,
        indices=indices,
        criteria=imo_criteria(model, indices),
        refused=refused,
        draws=len(drawn),
    )


def _simulate(
    model: ShipModel, manoeuvres: Mapping[str, Manoeuvre]
) -> tuple[dict[str, Trial], dict[str, Any], dict[str, str]]:
    """Manoeuvres of the model itself: runs, indices, and why there are none."""
    runs, indices, refused = {}, {}, {}
    for name, manoeuvre in manoeuvres.items():
        indices[name] = manoeuvre.no_indices
        try:
            runs[name] = manoeuvre.sail(model)
            indices[name] = asdict(manoeuvre.indices(runs[name]))
        except (InputError, ManoeuvreError, UnstableModelError) as error:
            refused[name] = str(error)
            last_error = error
    if manoeuvres and not runs:
        raise last_error
    return runs, indices, refused
