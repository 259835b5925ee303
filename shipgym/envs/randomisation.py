"""Domain randomisation: the ships of which an environment gives each episode one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from pathlib import Path
from typing import Any, Self

import numpy as np

from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError
from shipgym.sea.conditions import Weather
from shipgym.ships import ShipModel, load_model
from shipgym.ships.particulars import Particulars
from shipgym.ships.term_table import Structure

POOL_SIZE = 256  # ships drawn from what is continuous
POOL_SEED = 20260101
N_SPEEDS = 9  # approach speeds, evenly over their range
Range = tuple[float, float]
Pool = list[tuple[ShipModel, Weather]]


@dataclass(frozen=True)
class Randomisation:
    """What differs from episode to episode beside task and sea."""

    # {None, "covariance"}; whether each episode's ship is drawn from the identified
    # covariance ("posterior" is taken too)
    model_uncertainty: str | None = None
    # further models of the same structure, of which each episode has one
    ensemble: Sequence[str | Path | ShipModel] = ()
    # least and largest approach speed, parts of the service speed; the shaft turns in
    # proportion
    speed_range: Range | None = None
    # least and largest displacement, parts of that of the model: accelerations are
    # divided by it
    loading_range: Range | None = None

    def __post_init__(self) -> None:
        if self.model_uncertainty is not None:
            check_choice(
                self.model_uncertainty, ("covariance", "posterior"), "model_uncertainty"
            )
        if isinstance(self.ensemble, str | Path | ShipModel):
            raise InputError(
                f"ensemble: {self.ensemble!r} found, expected a list of models"
            )
        for name in ("speed_range", "loading_range"):
            if (given := getattr(self, name)) is not None:
                _check_range(given, name)

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Its keywords."""
        return tuple(item.name for item in fields(cls))

    @classmethod
    def take_from(cls, options: Mapping[str, Any]) -> tuple[Self, dict[str, Any]]:
        """What is randomised among an environment's options, and the others."""
        own = {key: value for key, value in options.items() if key in cls.names()}
        return cls(**own), {
            key: value for key, value in options.items() if key not in own
        }

    def ships(self, model: ShipModel, seas: Sequence[Weather]) -> Pool:
        """The pool of ships and seas that episodes are drawn from; a single one where nothing differs.

        The same for the same arguments. Raises InputError if a model cannot be drawn
        from, has another structure, or is not loaded by its coefficients.
        """
        models = [
            model,
            *(
                one if isinstance(one, ShipModel) else load_model(one)
                for one in self.ensemble
            ),
        ]
        for other in models[1:]:
            if other.compiled is not model.compiled:
                raise InputError(
                    f"ensemble: {other.name!r} has other equations than {model.name!r},"
                    " expected models of one structure; make an environment for each"
                )
        if not (self.model_uncertainty or self.speed_range or self.loading_range):
            return list(product(models, seas))
        random = np.random.default_rng(POOL_SEED)
        turns = -(-POOL_SIZE // len(models))
        drawn = [
            one.sample(turns, random) if self.model_uncertainty else [one] * turns
            for one in models
        ]
        ships = [ship for turn in zip(*drawn, strict=True) for ship in turn]
        in_turn = [
            (ship, seas[i // len(models) % len(seas)])
            for i, ship in enumerate(ships[:POOL_SIZE])
        ]
        paces = self._paces(models)
        return [(self._varied(ship, paces, random), sea) for ship, sea in in_turn]

    def _paces(self, models: Sequence[ShipModel]) -> dict[int, list[Particulars]]:
        """Particulars at each approach speed, one object each, because the weather is worked out for each."""
        parts = np.linspace(*(self.speed_range or (1.0, 1.0)), N_SPEEDS)
        known = {id(one.particulars): one.particulars for one in models}
        return {
            key: [replace(own, speed=part * own["speed"]) for part in parts.tolist()]
            for key, own in known.items()
        }

    def _varied(
        self,
        ship: ShipModel,
        paces: dict[int, list[Particulars]],
        random: np.random.Generator,
    ) -> ShipModel:
        """A ship at a speed and of a loading within the ranges."""
        if self.loading_range:
            ship = _loaded(ship, random.uniform(*self.loading_range))
        if self.speed_range:
            own, pace = (
                ship.particulars,
                paces[id(ship.particulars)][random.integers(N_SPEEDS)],
            )
            shaft = (
                pace["speed"] / own["speed"] * ship.service_shaft_speed
            )  # in proportion
            ship = replace(ship, particulars=pace, service_shaft_speed=shaft)
        return ship


def _check_range(given: Any, name: str) -> None:
    if not isinstance(given, Sequence) or len(given) != 2:
        raise InputError(
            f"{name}: {given!r} found, expected the least and the largest, two numbers"
        )
    check_number(given[0], f"{name}: the least", above=0.0)
    check_number(given[1], f"{name}: the largest", at_least=given[0])


def _loaded(ship: ShipModel, displacement: float) -> ShipModel:
    """A ship that forces accelerate less, the heavier it is."""
    if not isinstance(ship.dynamics, Structure):
        raise InputError(
            f"loading_range: the equations of {ship.name!r} are not a table of"
            " coefficients; name its loading conditions as models of their own in"
            " `ensemble`"
        )
    lighter = {name: value / displacement for name, value in ship.coefficients.items()}
    return replace(ship, coefficients=lighter, covariance=None)
