"""Domain randomisation: the ships from which each episode of an environment has one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from pathlib import Path
from typing import Any, Self

import numpy as np

from shipgym.checks import check_choice, check_number, unexpected
from shipgym.errors import InputError
from shipgym.models import ShipModel, load_model
from shipgym.sea.conditions import Weather
from shipgym.ships.particulars import Particulars
from shipgym.ships.term_table import Structure

POOL_SIZE = 256  # ships drawn from continuous distributions
N_SPEEDS = 9  # approach speeds, evenly over their range
Range = tuple[float, float]
Pool = list[tuple[ShipModel, Weather]]


@dataclass(frozen=True)
class Randomisation:
    """Variation from episode to episode, in addition to task and sea."""

    # {None, "covariance"}; whether each episode's ship is drawn from the identified
    # covariance
    model_uncertainty: str | None = None
    # least and largest rate of the steering gear, deg/s
    rudder_rate_range: Range | None = None
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
            check_choice(self.model_uncertainty, ["covariance"], "model_uncertainty")
        if isinstance(self.ensemble, str | Path | ShipModel):
            expected = "a list of models"
            raise unexpected("ensemble", expected, self.ensemble)
        for name in ("speed_range", "loading_range", "rudder_rate_range"):
            given = getattr(self, name)
            if given is not None:
                _check_range(given, name)

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Keywords of the fields."""
        return tuple(item.name for item in fields(cls))

    @classmethod
    def take_from(cls, options: Mapping[str, Any]) -> tuple[Self, dict[str, Any]]:
        """Make it from an environment's options; return the other options too."""
        others = dict(options)
        own = {}
        for name in cls.names():
            if name in others:
                own[name] = others.pop(name)
        return cls(**own), others

    def ships(self, model: ShipModel, seas: Sequence[Weather]) -> Pool:
        """Pool of ships and seas that episodes are drawn from.

        It is the same for the same arguments, and a single pair where nothing differs.
        Raises InputError if a model cannot be drawn from, has another structure, or is
        not loaded by its coefficients.
        """
        models = [model]
        if self.ensemble:
            models += self._others(model)
        ranges = (self.speed_range, self.loading_range, self.rudder_rate_range)
        if self.model_uncertainty or any(ranges):
            return self._drawn(models, seas)
        return list(product(models, seas))

    def _others(self, model: ShipModel) -> list[ShipModel]:
        """Load the ensemble; InputError for a model of another structure."""
        models = []
        for given in self.ensemble:
            other = load_model(given)
            if other.compiled is not model.compiled:
                raise InputError(
                    f"ensemble: expected models of one structure, got {other.name!r},"
                    f" which has other equations than {model.name!r}; make an"
                    " environment for each"
                )
            models.append(other)
        return models

    def _drawn(self, models: Sequence[ShipModel], seas: Sequence[Weather]) -> Pool:
        """Draw ships of each model in turn, and give each round a sea."""
        pool_seed = 20260101
        random = np.random.default_rng(pool_seed)
        n_rounds = -(-POOL_SIZE // len(models))
        samples = []
        for model in models:
            drawn = [model] * n_rounds
            if self.model_uncertainty:
                drawn = model.sample(n_rounds, random)
            samples.append(drawn)

        paces: dict[Any, Particulars] = {}
        pool: Pool = []
        for round_number, in_turn in enumerate(zip(*samples, strict=True)):
            sea = seas[round_number % len(seas)]
            left = POOL_SIZE - len(pool)
            for ship in in_turn[:left]:
                pool.append((self._varied(ship, paces, random), sea))
        return pool

    def _varied(
        self,
        ship: ShipModel,
        paces: dict[Any, Particulars],
        random: np.random.Generator,
    ) -> ShipModel:
        """Ship at a speed, of a loading and with a gear within the ranges.

        `paces`: particulars at each approach speed, one object each, because the
        weather is computed once for an object.
        """
        if self.loading_range:
            ship = _loaded(ship, random.uniform(*self.loading_range))
        if self.speed_range:
            own = ship.particulars
            parts = np.linspace(*self.speed_range, N_SPEEDS).tolist()
            speed = parts[random.integers(N_SPEEDS)] * own["speed"]
            pace = paces.setdefault((id(own), speed), replace(own, speed=speed))
            ship = replace(
                ship,
                particulars=pace,
                service_shaft_speed=speed / own["speed"] * ship.service_shaft_speed,
            )
        if self.rudder_rate_range:
            rate = random.uniform(*self.rudder_rate_range)
            gear = replace(ship.steering, rudder_rate_deg_s=rate)
            ship = replace(ship, steering=gear)
        return ship


def _check_range(given: Any, name: str) -> None:
    if not isinstance(given, Sequence) or len(given) != 2:
        raise unexpected(name, "the least and the largest, two numbers", given)
    least, largest = given
    check_number(least, f"{name}: the least", above=0.0)
    check_number(largest, f"{name}: the largest", at_least=least)


def _loaded(ship: ShipModel, displacement: float) -> ShipModel:
    """Ship of another loading: the heavier, the less forces accelerate it."""
    if not isinstance(ship.dynamics, Structure):
        raise InputError(
            "loading_range: expected a ship whose equations are a table of"
            f" coefficients, got {ship.name!r}; name its loading conditions as models"
            " of their own in `ensemble`"
        )
    lighter = {}
    for name, value in ship.coefficients.items():
        lighter[name] = value / displacement
    return replace(ship, coefficients=lighter, covariance=None, draws=None)
