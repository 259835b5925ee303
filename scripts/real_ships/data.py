"""Where the measured runs lie and how they are read."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from shipgym.errors import InputError
from shipgym.models import ShipModel, converted_model
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.ship_file import ShipFile
from shipgym.trials.trial import Trial

CHANNELS = ("x", "y", "psi", "u", "v", "r", "delta", "n")


@dataclass(frozen=True)
class Data:
    """Folders of the measurements and of the ship files that read them.

    Attributes
    ----------
    ships : Path
        Folder of `kvlcc2_hsva.toml`, `kvlcc2_marin.toml`, `esso_osaka_3m.toml`.
    measured : Path
        Folder of the measurements, for what is not a trial.
    """

    ships: Path
    measured: Path

    def ship(self, name: str, every: int = 1) -> MeasuredShip:
        """A ship and its runs, every n-th sample of them.

        Raises
        ------
        InputError
            Where the measurements are not there.
        """
        file = ShipFile.load(self.ships / f"{name}.toml")
        runs = {Path(trial.name).stem: trial for trial in file.trials()}
        return MeasuredShip(
            file.particulars,
            file.steering,
            {
                key: thinned(trial, every, key, file.particulars.length)
                for key, trial in runs.items()
            },
        )


@dataclass(frozen=True, eq=False)
class MeasuredShip:
    """A ship and its runs by name."""

    particulars: Particulars
    steering: SteeringGear | None
    runs: dict[str, Trial]

    def bare_reference(self, reference: str) -> ShipModel:
        """A reference ship at this scale and at the first run's initial shaft speed."""
        first = next(iter(self.runs.values()))
        shaft = float(first["n"][0]) if "n" in first else 0.0
        gear = self.steering or SteeringGear()
        return replace(
            converted_model(reference, self.particulars, gear, shaft), name=reference
        )


def thinned(trial: Trial, every: int, name: str, length: float) -> Trial:
    """Every n-th sample of a trial, with the channels of manoeuvring."""
    if every < 1:
        raise InputError(f"every: expected at least 1, got {every}")
    channels = {c: trial[c][::every] for c in CHANNELS if c in trial}
    return Trial(trial.t[::every], channels, name=name, kind=trial.kind, length=length)
