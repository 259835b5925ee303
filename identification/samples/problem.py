"""The problem to be identified: trials, structure, ship, and their regression."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from identification.samples.samples import Samples, build_samples
from shipgym import InputError, ShipModel, Trial
from shipgym.checks import check_choice
from shipgym.ships import Structure


@dataclass(frozen=True, eq=False)
class Problem:
    """Data, structure and settings that a method fits."""

    trials: tuple[Trial, ...]  # all, those held out marked `validate`
    used: tuple[Trial, ...]  # those to fit, repaired where asked
    blank: ShipModel  # the model but for its coefficients
    table: Structure  # of the regression; of the MMG form, which has none, a stand-in
    samples: Samples  # the regression
    #: correlations of the candidates for the reference ship of a grey box, where it was
    #: chosen among several
    similarity: dict[str, float]
    sampling: dict[str, Any]  # keywords of `build_samples`

    def rows_of(self, table: Structure, ship: ShipModel) -> Samples:
        """The regression of the same trials with another structure, of a ship."""
        return build_samples(
            self.used,
            structure=table,
            particulars=ship.particulars,
            shaft_speed=ship.service_shaft_speed,
            **self.sampling,
        )

    def without(self, trials: Sequence[int]) -> Self:
        """The problem of the other trials, by their places."""
        others = np.setdiff1d(range(len(self.used)), trials)
        return replace(
            self,
            samples=self.samples.select(np.isin(self.samples.trial, others)),
            used=tuple(self.used[place] for place in others),
        )


def held_out(trials: Any, names: str | Sequence[str]) -> Sequence[Trial]:
    """The trials, those named marked to validate only.

    Raises InputError for what is no list of trials of different names.
    """
    is_single = isinstance(trials, Trial | str)
    candidates: list[Any] = [None] if is_single else list(trials)
    if not all(isinstance(one, Trial) for one in candidates):
        raise InputError(
            "trials: expected a list of Trials, such as ship.trials() of a ship file,"
            f" got {trials!r}"
        )
    known = [trial.name for trial in candidates]
    repeated = [name for name in known if known.count(name) > 1]
    if repeated:
        raise InputError(
            f"trials: expected different names, got two trials named {repeated[0]!r};"
            " rename one with trial.with_(name=...)"
        )
    wanted = [names] if isinstance(names, str) else list(names)
    for name in wanted:
        check_choice(
            name,
            known,
            "hold_out",
        )

    return [
        trial.with_(use="validate") if trial.name in wanted else trial
        for trial in candidates
    ]
