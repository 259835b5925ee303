"""What a simulation happens in: depth of the water, weather, and the seed that the weather follows from."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_whole
from shipgym.engine.loops import ship_loop
from shipgym.engine.passages import SEA_CHANNELS
from shipgym.engine.records import leaves
from shipgym.errors import UnstableModelError
from shipgym.sea.conditions import Weather
from shipgym.sea.open_sea import Sea
from shipgym.sea.weather_column import as_weather, weather_column
from shipgym.ships.manoeuvring_model import ManoeuvringModel

Seed = int | np.random.Generator
CALM = Weather(name="calm")


@dataclass(frozen=True)
class Conditions:
    """Depth of the water and weather of a simulation."""

    water_depth: float = np.inf  # m
    weather: Weather | str | None = None  # A weather, the name of a sea state, or None for calm
    seed: Seed = 0  # of the random part of the weather


class Passage:
    """One ship on her way through given conditions: the loops for them and the arrays they work on.

    `numbers` are the ship's, `sea` is its state, that of its random numbers and its parameters, as loops take
    them, `windy` whether there is any weather; its filters are made for steps of `dt` seconds.
    """

    def __init__(self, model: ManoeuvringModel, conditions: Conditions, dt: float) -> None:
        self.model, self.vessel, self.dt = model, model.vessel, dt
        self.numbers = model.ship_numbers(conditions.water_depth)
        weather = as_weather(conditions.weather, "weather")
        self.windy = not weather.calm
        self.sea = np.zeros(0), np.zeros(0, dtype=np.uint64), np.zeros(0)
        if self.windy:
            parameters = weather_column(model, weather, dt, conditions.water_depth)
            self.sea = np.zeros(len(leaves(Sea))), np.array([_first_word(conditions.seed)]), parameters

    def loop(self, name: str) -> Any:
        """A loop of `shipgym.engine.loops`, compiled for the ship and for calm water or weather."""
        return ship_loop(self.vessel, name, self.windy)

    def run(self, name: str, states: Floats, *arguments: Any, since: float = 0.0) -> Any:
        """Fill the states after the first by a loop, from its arguments but for the sea and the ship.

        Returns what the loop returns: the last row, or that and more. Raises UnstableModelError where the
        ship leaves every physical range, `since` s after the manoeuvre began.
        """
        found = self.loop(name)(states, *arguments, *self.sea, self.numbers)
        reached = found[0] if isinstance(found, tuple) else found
        if reached < len(states) - 1:
            raise unstable(self.model, since + self.dt * reached, states[reached])
        return found

    def states(self, first: Floats, n_steps: int) -> Floats:
        """Rows for `n_steps` + 1 states, shape (n_columns,) each, and their weather; `first` filled in."""
        width = len(self.vessel.state_names) + (len(SEA_CHANNELS) if self.windy else 0)
        states = np.empty((n_steps + 1, width))
        states[0, : len(first)] = first
        if len(first) < width:
            self.loop("meet")(states, *self.sea)
        return states


def _first_word(seed: Seed) -> np.uint64:
    """State of the weather's random numbers at its beginning."""
    if not isinstance(seed, np.random.Generator):
        check_whole(seed, "seed", at_least=0)
    return np.uint64(np.random.default_rng(seed).integers(2**63))


def unstable(model: ManoeuvringModel, time_s: float, state: Floats) -> UnstableModelError:
    """The error for a ship that ran away after a given time and physical state."""
    last = dict(zip(model.state_names, state.tolist(), strict=False))
    heel = f", phi = {np.degrees(last['phi']):.3g} deg" if "phi" in last else ""
    long = "" if time_s > 0.0 else ", or the step is far too long for it"
    return UnstableModelError(
        f"model {model.name!r} runs away after {time_s:.1f} s (u = {last['u']:.3g} m/s, "
        f"v = {last['v']:.3g} m/s, r = {np.degrees(last['r']):.3g} deg/s{heel}): it is unstable there{long}",
        time_s,
        last,
    )
