"""The ships of which an environment gives each episode one: draws from a posterior, an ensemble, ranges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from pathlib import Path
from typing import Any, Self

import numpy as np

from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError
from shipgym.models import ShipModel, load_model
from shipgym.models.structures import Structure
from shipgym.weather.conditions import Weather

POOL_SIZE = 256  # ships drawn from what is continuous
POOL_SEED = 20260101
Range = tuple[float, float]
SmallFleet = list[tuple[ShipModel, Weather]]


@dataclass(frozen=True)
class Variety:
    """What differs from episode to episode beside task and sea.

    Attributes
    ----------
    model_uncertainty : {None, "posterior"}
        Whether each episode's ship is drawn from the identified covariance.
    ensemble : sequence of str, Path or ShipModel
        Further models of the same structure, of which each episode has one.
    speed_range : tuple of float or None
        Least and largest approach speed, parts of the service speed; the shaft turns in proportion.
    loading_range : tuple of float or None
        Least and largest displacement, parts of that of the model: accelerations are divided by it.
    """

    model_uncertainty: str | None = None
    ensemble: Sequence[str | Path | ShipModel] = ()
    speed_range: Range | None = None
    loading_range: Range | None = None

    def __post_init__(self) -> None:
        if self.model_uncertainty is not None:
            check_choice(self.model_uncertainty, ("posterior",), "model_uncertainty")
        for name in ("speed_range", "loading_range"):
            if (given := getattr(self, name)) is not None:
                _check_range(given, name)

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Its keywords."""
        return tuple(item.name for item in fields(cls))

    @classmethod
    def take_from(cls, options: Mapping[str, Any]) -> tuple[Self, dict[str, Any]]:
        """The variety that is named among an environment's options, and the others."""
        own = {key: value for key, value in options.items() if key in cls.names()}
        return cls(**own), {key: value for key, value in options.items() if key not in own}

    def ships(self, model: ShipModel, seas: Sequence[Weather]) -> SmallFleet:
        """Ship and sea of the pool that episodes are drawn from; a single one where nothing differs.

        Parameters
        ----------
        model : ShipModel
            The environment's model.
        seas : sequence of Weather

        Returns
        -------
        list of tuple of ShipModel and Weather
            The same for the same arguments.

        Raises
        ------
        InputError
            If a model cannot be drawn from, has another structure, or is not loaded by its coefficients.
        """
        models = [model, *(one if isinstance(one, ShipModel) else load_model(one) for one in self.ensemble)]
        for other in models[1:]:
            if other.accelerations_source != model.accelerations_source:
                raise InputError(
                    f"ensemble: {other.name!r} has other equations than {model.name!r}, expected models of "
                    "one structure; make an environment for each"
                )
        if not (self.model_uncertainty or self.speed_range or self.loading_range):
            return list(product(models, seas))
        random = np.random.default_rng(POOL_SEED)
        return [self._drawn(models, seas, i, random) for i in range(POOL_SIZE)]

    def _drawn(
        self, models: Sequence[ShipModel], seas: Sequence[Weather], i: int, random: np.random.Generator
    ) -> tuple[ShipModel, Weather]:
        """Number i of the pool; models and seas in turn, so that all are as frequent."""
        ship = models[i % len(models)]
        if self.model_uncertainty:
            (ship,) = ship.sample(1, random)
        if self.loading_range:
            ship = _loaded(ship, random.uniform(*self.loading_range))
        if self.speed_range:
            ship = _at_speed(ship, random.uniform(*self.speed_range))
        return ship, seas[i // len(models) % len(seas)]


def _check_range(given: Any, name: str) -> None:
    if not isinstance(given, Sequence) or len(given) != 2:
        raise InputError(f"{name}: {given!r} found, expected the least and the largest, two numbers")
    check_number(given[0], f"{name}: the least", above=0.0)
    check_number(given[1], f"{name}: the largest", at_least=given[0])


def _at_speed(ship: ShipModel, part: float) -> ShipModel:
    """A ship with another approach speed and shaft speed."""
    particulars = replace(ship.particulars, speed=part * ship.particulars["speed"])
    return replace(ship, particulars=particulars, service_shaft_speed=part * ship.service_shaft_speed)


def _loaded(ship: ShipModel, displacement: float) -> ShipModel:
    """A ship that forces accelerate less, the heavier it is."""
    if not isinstance(ship.dynamics, Structure):
        raise InputError(
            f"loading_range: the equations of {ship.name!r} are not a table of coefficients; name its "
            "loading conditions as models of their own in `ensemble`"
        )
    lighter = {name: value / displacement for name, value in ship.coefficients.items()}
    return replace(ship, coefficients=lighter, covariance=None)
