"""A ship as a manoeuvring model that is simulated, sampled from, saved and loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import placed
from shipgym.errors import InputError
from shipgym.files import expecting, read_json, write_json
from shipgym.models.model_file import read_model
from shipgym.ships.manoeuvring_model import ManoeuvringModel

if TYPE_CHECKING:  # for annotations, and where a ship is simulated
    from shipgym.models.simulate import Seed
    from shipgym.sea.conditions import Weather
    from shipgym.ships.equations import ShipEquations
    from shipgym.ships.term_table import Structure
    from shipgym.trials.trial import Trial


@dataclass(frozen=True, eq=False)
class ShipModel(ManoeuvringModel):
    """A manoeuvring model of one ship.

    Attributes
    ----------
    name : str
        Name of the ship or of the model file.
    structure : str
        Name of its structure.
    particulars : Particulars
        Length, mass, added mass, service speed, ...; what was estimated is marked.
    steering : SteeringGear
        Rudder limit, rate and lag.
    coefficients : dict of str to float
        By name, in the normalisation of the structure, rudder positive to starboard.
    covariance : array of shape (n_coefficients, n_coefficients) or None
        Of the coefficients in their order; None where not identified.
    envelope : Envelope or None
        Of the data it was identified from.
    provenance : dict or None
        Method, settings, software version and trials it came from, or the source of a
        reference ship.
    dynamics : Structure or ShipEquations
        The table of terms, or the equations of a ship that has her own; by default what
        is shipped or registered under the structure's name.
    service_shaft_speed : float
        Shaft speed at service speed, 1/s; 0 where the model knows no shaft.
    draws : array of shape (n_draws, n_coefficients) or None
        Coefficients drawn from a posterior by sampling, whose covariance is
        `covariance`.
    """

    def simulate(
        self,
        commands: ArrayLike,
        dt: float,
        state: ArrayLike | None = None,
        water_depth: float = np.inf,
        weather: Weather | str | None = None,
        seed: Seed = 0,
    ) -> Trial:
        """Simulate with commands held over each step (classical Runge-Kutta).

        Raises UnstableModelError where the ship leaves every physical range; carries
        the time and the last physical state.

        Parameters
        ----------
        commands : array-like of shape (n_steps, n_command)
            Rudder angle in rad, positive to starboard.
        dt : float
            Step, s.
        state : array-like of shape (n_state,), optional
            Where to start; by default straight ahead at service speed.
        water_depth : float
            In m, for ships whose equations cover shallow water.
        weather : Weather or str, optional
            A weather or the name of a sea state; by default calm.
        seed : int or Generator
            Of the weather.

        Returns
        -------
        Trial
            n_steps + 1 samples with the state and the commands (`delta_command`). In
            weather x and y are over ground, u and v through the water; psi and r
            are without the first-order motion in waves, which is in `psi_wave` and
            `r_wave`; `current_north`, `current_east`, `wind_speed` and `wind_from`
            tell the weather.
        """
        from shipgym.models.simulate import simulate  # an environment does without

        return simulate(
            self, commands, dt, state, water_depth, weather=weather, seed=seed
        )

    def sample(self, n: int, seed: int | np.random.Generator) -> list[Self]:
        """Draw n models whose coefficients follow the identified covariance.

        Those of a model with draws of a posterior are among these, none twice while
        there are enough. Raises InputError if the model has no covariance.
        """
        if self.covariance is None:
            raise InputError(
                f"model {self.name!r}: expected a covariance, which only identified"
                " models have, to sample from, got none"
            )
        rng = np.random.default_rng(seed)
        draws = self._drawn_coefficients(self.covariance, n, rng)
        tables = self._drawn_tables(n, rng)
        models = []
        for i in range(n):
            drawn = replace(
                self,
                name=f"{self.name}-draw-{i}",
                covariance=None,
                draws=None,
                dynamics=tables[i],
            )
            drawn = drawn.with_coefficients(draws[i])
            models.append(drawn)
        return models

    def _drawn_coefficients(
        self, covariance: Floats, n: int, rng: np.random.Generator
    ) -> Floats:
        """Coefficients of n models, shape (n, n_coefficients)."""
        if self.draws is not None:
            n_kept = len(self.draws)
            chosen = rng.choice(n_kept, n, replace=n > n_kept)
            return np.asarray(self.draws[chosen])
        mean = list(self.coefficients.values())
        normal = rng.standard_normal((n, len(mean)))
        return np.asarray(mean + normal @ _square_root(covariance).T)

    def _drawn_tables(
        self, n: int, rng: np.random.Generator
    ) -> list[Structure | ShipEquations]:
        """Its table n times, with a fitted reference ship drawn each time."""
        from shipgym.ships.grey_boxes import GreyBox

        box = self.dynamics
        if not isinstance(box, GreyBox) or box.ship.covariance is None:
            return [box] * n
        ship = box.reference
        assert isinstance(ship, ShipModel)
        references = ship.sample(n, rng)
        return [replace(box, reference=drawn) for drawn in references]

    def __repr__(self) -> str:
        """Return the name, the structure and how much is known."""
        known = f"{len(self.coefficients)} coefficients"
        if self.covariance is not None:
            known += " with their covariance"
        return f"<ShipModel {self.name}: {self.structure}, {known}>"

    def save(self, path: str | Path) -> None:
        """Write the model as a JSON file (format in `shipgym.models.model_file`)."""
        write_json(self.to_dict(), Path(path))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a model file; InputError, naming the file and the field at fault."""
        file = Path(path)
        remedy = "identify the model again or take another copy"
        with expecting("model file", file):
            return cls.from_dict(read_json(file, "model file", remedy), str(file))

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any], where: str = "model") -> Self:
        """Read what `to_dict` gave, or a model file holds.

        Raises InputError, naming the field at fault, after `where`.
        """
        with placed(where):
            return read_model(fields, where, cls)


def _square_root(covariance: Floats) -> Floats:
    """Square root of a covariance by its correlations, which are of similar size."""
    deviation = np.sqrt(np.diag(covariance))
    scale = np.where(deviation > 0.0, deviation, 1.0)
    column = scale[:, None]
    correlations = covariance / (column * scale)
    values, vectors = np.linalg.eigh(correlations)
    # rounding may leave an eigenvalue below 0
    variances = np.clip(values, 0.0, None)
    root: Floats = column * vectors * np.sqrt(variances)
    return root
