"""Manoeuvres known by name: those of this package, and those that a user registers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from shipgym.checks import check_text
from shipgym.errors import InputError, UnstableModelError
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.trials.trial import Trial

FASTEST = 1.5  # speed by that of service that no manoeuvre at service power exceeds
QUICKEST_TURN = 3.0  # likewise the yaw rate by U / L
SIDES = (("starboard", 1.0), ("port", -1.0))


@dataclass(frozen=True)
class Manoeuvre:
    """One manoeuvre with all its settings, and the indices that are read from it."""

    sail: Callable[[ShipModel], Trial]
    indices: Callable[[Trial], Any]  # from the trial to its indices
    outcome: type  # the dataclass of its indices, units in the names of its fields
    caption: str = ""  # caption of its figure

    @property
    def no_indices(self) -> dict[str, float | None]:
        """Indices of a manoeuvre that did not finish: all None."""
        return dict.fromkeys(field.name for field in fields(self.outcome))

    def evaluate(self, model: ShipModel) -> Any:
        """Indices of a ship; UnstableModelError for motions that no ship can have."""
        sailed = self.sail(model)
        check_physical(model, sailed)
        return self.indices(sailed)


def check_physical(model: ShipModel, trial: Trial) -> None:
    """Refuse a run beyond every speed and yaw rate of a ship at service power."""
    speed = model.particulars["speed"]
    largest = {
        "u": FASTEST * speed,
        "v": speed,
        "r": QUICKEST_TURN / model.travel_time,
    }
    for name, most in largest.items():
        if name not in trial:
            continue
        beyond = np.abs(trial[name]) > most
        if beyond.any():
            k = int(np.argmax(beyond))
            time_s = float(trial.t[k])
            state = {name: float(row[k]) for name, row in trial.channels.items()}
            raise UnstableModelError(
                f"model {model.name!r} runs away after {time_s:.1f} s"
                f" ({name} = {state[name]:.3g})",
                time_s,
                state,
            )


#: From a ship to the manoeuvres of a family that suit her, by name.
Variants = Callable[[ShipModel], Mapping[str, Manoeuvre]]


class Family(NamedTuple):
    """Manoeuvres of one kind, a section of the page that `shipgym trials` writes."""

    title: str
    variants: Variants


#: All families by name, in the order in which they are run and reported.
FAMILIES: dict[str, Family] = {}


def register_manoeuvre(name: str, variants: Variants, title: str = "") -> None:
    """Register a family of manoeuvres.

    `standard_manoeuvres`, `index_intervals` and `shipgym trials` then know it.

    Raises InputError if a family of that name is registered already.

    Parameters
    ----------
    name : str
        Of the family, such as ``"zigzags"``.
    variants : callable
        From a ship to a dict of `Manoeuvre` by name; empty for a ship that the
        manoeuvre does not suit. Angles and durations are chosen for the ship there.
    """
    check_text(name, "manoeuvre: name")
    if name in FAMILIES:
        raise InputError(
            f"manoeuvre: expected a new name, got '{name}', which is registered already"
        )
    FAMILIES[name] = Family(title or name.capitalize(), variants)


def families_of(model: ShipModel) -> dict[str, dict[str, Manoeuvre]]:
    """Manoeuvres that suit a ship, by family and name; see `standard_manoeuvres`."""
    return {name: dict(one.variants(model)) for name, one in FAMILIES.items()}


@takes_name
def standard_manoeuvres(model: ShipModel) -> dict[str, Manoeuvre]:
    """Registered manoeuvres that suit a ship, from service speed in deep water.

    Her length and speed give durations and steps, her rudder's limit the angles.

    Returns
    -------
    dict of str to Manoeuvre
        Zigzags 10/10 and 20/20 and turning circles with full rudder, each to both
        sides; a crash stop where her equations hold for a shaft astern; and what was
        registered besides (`register_manoeuvre`).
    """
    found = dict[str, Manoeuvre]()
    for family in families_of(model).values():
        found |= family
    return found


def standard_time(model: ShipModel) -> tuple[float, float]:
    """Duration and step of a standard zigzag or turning circle, s."""
    # duration of a standard zigzag or turning circle, in times to travel one ship
    # length
    lengths = 40.0
    steps_per_length = 50  # of their simulation
    return lengths * model.travel_time, model.travel_time / steps_per_length
