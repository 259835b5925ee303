"""What a simulation happens in: depth of the water, weather, and the seed that the weather follows from."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError
from shipgym.kernels import layout, weather_rows
from shipgym.sea.conditions import Weather
from shipgym.sea.weather_column import as_weather, weather_column
from shipgym.ships.ship_model import Seed, ShipModel

Floats = NDArray[np.float64]
CALM = Weather(name="calm")


@dataclass(frozen=True)
class Conditions:
    """Depth of the water and weather of a simulation.

    Attributes
    ----------
    water_depth : float
        m.
    weather : Weather or str or None
        A weather, the name of a sea state, or None for calm.
    seed : int or Generator
        Of the random part of the weather.
    """

    water_depth: float = np.inf
    weather: Weather | str | None = None
    seed: Seed = 0


class Passage:
    """One ship on her way through given conditions: the kernels for them and the arrays they work on.

    Parameters
    ----------
    model : ShipModel
        The ship.
    conditions : Conditions
        Where she sails.
    dt : float
        Step, s; the filters of the weather are made for it.

    Attributes
    ----------
    ship, sky, words : array
        Tiles of the ship, of the state of the weather and of its random numbers.
    """

    def __init__(self, model: ShipModel, conditions: Conditions, dt: float) -> None:
        self.model = model
        weather = as_weather(conditions.weather, "weather")
        self.windy = not weather.calm
        self.sky, self.words = np.zeros(0), np.zeros(0, dtype=np.uint64)
        column = None
        if self.windy:
            column = weather_column(model, weather, dt, conditions.water_depth)
            self.sky = np.zeros(weather_rows.SKY_END)
            self.words = np.zeros(layout.LANES, dtype=np.uint64)
            self.words[0] = _first_word(conditions.seed)
        self.ship = model.ship_tile(conditions.water_depth, column)

    def kernel(self, name: str) -> ModuleType:
        """One file of kernels, compiled for the ship and for calm water or weather."""
        return self.model.kernel(name, self.windy)

    def states(self, first: Floats, n_steps: int) -> Floats:
        """Rows for n_steps + 1 states of the kernels, and the weather behind each, with the first filled in.

        Parameters
        ----------
        first : array of shape (n_columns,)
            A state of the kernels; the weather begins with it, unless it comes with one.
        n_steps : int
        """
        width = layout.N_STATE + (len(weather_rows.CHANNEL_NAMES) if self.windy else 0)
        states = np.empty((n_steps + 1, width))
        states[0, : len(first)] = first
        if len(first) < width:
            self.kernel("trajectories").meet(states, self.sky, self.words, self.ship)
        return states


def _first_word(seed: Seed) -> np.uint64:
    """State of the weather's random numbers at its beginning."""
    if not isinstance(seed, np.random.Generator) and (
        isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0
    ):
        raise InputError(f"seed: {seed!r} found, expected a whole number >= 0")
    return np.uint64(np.random.default_rng(seed).integers(2**63))
