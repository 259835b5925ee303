"""Standard manoeuvres of a model for `shipgym trials`: runs, indices, criteria."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from identification.progress import counted
from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
from shipgym.manoeuvres import Criterion, IndexInterval, Manoeuvre
from shipgym.manoeuvres.imo import imo_criteria
from shipgym.manoeuvres.intervals import intervals_of
from shipgym.manoeuvres.standard import families_of
from shipgym.models import ShipModel
from shipgym.trials.trial import Trial


@dataclass(frozen=True, eq=False)
class StandardTrials:
    """Standard manoeuvres of a model, and of models drawn from its covariance.

    Attributes
    ----------
    families : dict
        Manoeuvres by family and name.
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

    families: dict[str, dict[str, Manoeuvre]]
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
    families = families_of(model)
    manoeuvres: dict[str, Manoeuvre] = {}
    for family in families.values():
        manoeuvres |= family

    nominal = _simulate(model, manoeuvres)
    drawn = []
    if draws and model.covariance is not None:
        drawn = model.sample(draws, seed)
    evaluate = {name: manoeuvre.evaluate for name, manoeuvre in manoeuvres.items()}
    sailed = counted("models drawn", drawn)
    indices = intervals_of(nominal.indices, sailed, evaluate)
    return StandardTrials(
        families=families,
        runs=nominal.runs,
        indices=indices,
        criteria=imo_criteria(model, indices),
        refused=nominal.refused,
        draws=len(drawn),
    )


class _Nominal(NamedTuple):
    """Manoeuvres of the model itself: runs, indices, and why there are none."""

    runs: dict[str, Trial]
    indices: dict[str, dict[str, float | None]]
    refused: dict[str, str]


def _simulate(model: ShipModel, manoeuvres: Mapping[str, Manoeuvre]) -> _Nominal:
    nominal = _Nominal({}, {}, {})
    for name, manoeuvre in manoeuvres.items():
        nominal.indices[name] = manoeuvre.no_indices
        try:
            run = manoeuvre.sail(model)
            nominal.runs[name] = run
            nominal.indices[name] = asdict(manoeuvre.indices(run))
        except (InputError, ManoeuvreError, UnstableModelError) as error:
            nominal.refused[name] = str(error)
            last_error = error
    if manoeuvres and not nominal.runs:
        raise last_error
    return nominal
