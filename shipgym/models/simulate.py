"""Simulate ships as Trials, with given commands or those of a measured trial."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.arrays import Floats
from shipgym.checks import check_number, check_whole, unexpected
from shipgym.engine.compiled_ship import STILL_WATER
from shipgym.engine.loops import ship_loop
from shipgym.engine.records import leaves
from shipgym.engine.trajectories import SEA_CHANNELS
from shipgym.errors import InputError, UnstableModelError
from shipgym.sea.conditions import Weather, as_weather
from shipgym.sea.open_sea import OPEN_SEA, Sea
from shipgym.sea.weather_column import weather_column
from shipgym.ships.manoeuvring_model import (
    ManoeuvringModel,
    check_units,
    two_commands,
)
from shipgym.ships.term_table import Structure
from shipgym.trials.trial import Trial
from shipgym.trials.units import CHANNELS

LONGEST_STEP = 0.025  # of the time to travel one ship length
WIND = {"u": "wind_udot", "v": "wind_vdot", "r": "wind_rdot"}  # channels, by equation
Seed = int | np.random.Generator


class Passage:
    """One ship in given conditions: the loops for them and the arrays they work on.

    `numbers` are the ship's, `sea` is its state, that of its random numbers and its
    parameters, as loops take them, `windy` whether there is any weather; its filters
    are made for steps of `dt` seconds.
    """

    def __init__(
        self,
        model: ManoeuvringModel,
        dt: float,
        water_depth: float = np.inf,
        weather: Weather | str | None = None,
        seed: Seed = 0,
    ) -> None:
        self.model = model
        self.compiled = model.compiled
        self.dt = dt
        self.numbers = model.ship_numbers(water_depth, dt)
        known = as_weather(weather, "weather")
        self.windy = not known.calm
        self.sea = np.zeros(0), np.zeros(0, dtype=np.uint64), np.zeros(0)
        if self.windy:
            state = np.zeros(len(leaves(Sea)))
            random = _random_word(seed)
            parameters = weather_column(model, known, dt, water_depth)
            self.sea = state, random, parameters

    def loop(self, name: str) -> Any:
        """Loop of `shipgym.engine.loops` for the ship in calm water or weather."""
        return ship_loop(self.compiled, name, OPEN_SEA if self.windy else STILL_WATER)

    def run(self, name: str, states: Floats, *arguments: Any) -> Any:
        """Fill the states after the first by a loop; sea and ship are added here.

        Returns what the loop returns: the last row, or that and more. Raises
        UnstableModelError where the ship leaves every physical range.
        """
        loop = self.loop(name)
        found = loop(
            states,
            *arguments,
            *self.sea,
            self.numbers,
        )
        reached = found[0] if isinstance(found, tuple) else found
        if reached < len(states) - 1:
            raise unstable(
                self.model,
                self.dt * reached,
                states[reached],
            )
        return found

    def states(self, first: Floats, n_steps: int) -> Floats:
        """Rows for `n_steps` + 1 states and their weather, with `first` filled in."""
        width = len(self.compiled.state_names)
        if self.windy:
            width += len(SEA_CHANNELS)
        states = np.empty((n_steps + 1, width))
        states[0, : len(first)] = first
        if len(first) < width:
            self.loop("sample_sea")(states, *self.sea)
        return states


def _random_word(seed: Seed) -> NDArray[np.uint64]:
    """State of a loop's random numbers, by a seed, shape (1,)."""
    if not isinstance(seed, np.random.Generator):
        check_whole(seed, "seed", at_least=0)
    rng = np.random.default_rng(seed)
    word = rng.integers(2**63)
    return np.array([word], dtype=np.uint64)


def simulate(
    model: ManoeuvringModel,
    commands: ArrayLike,
    dt: float,
    state: ArrayLike | None = None,
    water_depth: float = np.inf,
    kind: str | None = None,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Trial:
    """Simulate a ship with commands held over each step (see `ShipModel.simulate`)."""
    held = checked_orders(model, commands)
    check_number(dt, "dt", above=0.0, hint="in s")
    passage = Passage(model, dt, water_depth, weather, seed)
    first = initial_state(model, state)
    states = passage.states(first, len(held))
    passage.run("simulate", states, two_commands(held), dt)
    commands = np.vstack([held, held[-1:]])
    return as_trial(model, dt, states, commands, kind)


def checked_orders(model: ManoeuvringModel, commands: ArrayLike) -> Floats:
    """Orders of shape (n_steps, n_command), within the limits of rudder and shaft.

    A rudder ordered beyond its limit is brought to the limit, as its gear would do;
    beyond a right angle it was meant in other units. InputError names the first row out
    of range.
    """
    orders = np.asarray(commands, dtype=float)
    names = model.command_names
    n = len(names)
    is_table = orders.ndim == 2 and orders.shape[1] == n
    if not is_table or len(orders) < 2:
        listed = ", ".join(names)
        shape = orders.shape
        raise InputError(
            f"commands: expected shape (n_steps, {n}) for {listed},"
            f" with at least 2 steps, got {shape}"
        )
    check_units(model, orders)
    return orders


def orders(
    model: ManoeuvringModel, rudder: Floats, shaft: Floats | None = None
) -> Floats:
    """Commands of shape (n_steps, n_command): rudder, rad, and shaft, 1/s."""
    commands = np.repeat(model.service_command[None], len(rudder), axis=0)
    commands[:, 0] = rudder
    if shaft is not None:
        commands[:, 1] = shaft
    return commands


def open_loop(model: ManoeuvringModel, trial: Trial) -> Trial:
    """Predict a trial from its initial state and measured commands alone.

    The rudder is taken straight between the samples, as measured: no steering gear
    stands between. The trial has u, v, r, psi, delta (x and y where recorded; n where
    the model has a shaft), and where it has them accelerations by wind; the result is
    the simulated state at its times. Raises InputError if a channel is missing,
    UnstableModelError where the simulated ship leaves every physical range.
    """
    (states,) = open_loop_states(model, trial, first_state(model, trial)[None])
    return Trial(
        np.array(trial.t),
        _channels(model, states),
        name=trial.name,
        kind=trial.kind,
        use=trial.use,
        length=model.particulars["length"],
    )


def open_loop_states(model: ManoeuvringModel, trial: Trial, starts: Floats) -> Floats:
    """States along a trial from some first ones, by its measured commands alone.

    From shape (n_starts, n_state) to (n_starts, n_samples, n_state); as `open_loop`.
    """
    t = np.array(trial.t)
    delta = np.array(trial["delta"])
    n = np.array(trial["n"]) if "n" in trial.channels else np.zeros(len(t))
    wind = wind_accelerations(trial, model.dynamics)
    mean_wind = 0.5 * (wind[1:] + wind[:-1])
    numbers = model.ship_numbers()
    loop = ship_loop(
        model.compiled, "open_loop", OPEN_SEA if mean_wind.any() else STILL_WATER
    )
    found = np.zeros(
        (
            len(starts),
            len(t),
            len(model.state_names),
        )
    )
    found[:, 0] = starts
    longest_step = LONGEST_STEP * model.travel_time
    for states in found:
        reached = loop(
            states,
            t,
            delta,
            n,
            mean_wind,
            longest_step,
            numbers,
        )
        if reached < len(t) - 1:
            raise unstable(model, t[reached], states[reached])
    return found


def first_state(model: ManoeuvringModel, trial: Trial) -> Floats:
    """State at a trial's first sample, by its channels; 0 for those it has not."""
    needed = ("psi", "u", "v", "r", "delta", *model.command_names[1:])
    first = {name: trial[name][:1] for name in needed}
    state = np.zeros(len(model.state_names))
    for i, name in enumerate(model.state_names):
        if name in trial.channels:
            state[i] = trial[name][0]
        elif name == "q":  # which no trial records: that of a steady yaw rate
            state[i] = -model.rates(first)["r"][0]
    return state


def wind_accelerations(trial: Trial, dynamics: Any = None) -> Floats:
    """Accelerations by wind in a trial: surge, sway, yaw; shape (n_samples, 3).

    Those of equations that a structure does not have are 0.
    """
    equations = dynamics.equations if isinstance(dynamics, Structure) else WIND
    accelerations = np.zeros((len(trial), len(WIND)))
    for column, axis in enumerate(WIND):
        name = WIND[axis]
        if axis in equations and name in trial:
            accelerations[:, column] = trial[name]
    return accelerations


def initial_state(model: ManoeuvringModel, state: ArrayLike | None) -> Floats:
    """State to start from: a given one, checked, or straight ahead at service speed."""
    if state is None:
        return model.service_state
    start = np.asarray(state, dtype=float)
    if start.shape != (len(model.state_names),) or not np.all(np.isfinite(start)):
        expected = f"finite numbers for {', '.join(model.state_names)}"
        raise unexpected("state", expected, start.tolist())
    return start


def as_trial(
    model: ManoeuvringModel,
    dt: float,
    states: Floats,
    commands: Floats,
    kind: str | None = None,
) -> Trial:
    """Trial of states dt apart, their weather, and the commands held from each on."""
    channels = _channels(model, states)
    weather = states[:, len(model.state_names) :]
    for name, values in zip(SEA_CHANNELS, weather.T, strict=False):
        channels[name] = values
    for name, command in zip(model.command_names, commands.T, strict=True):
        channels[f"{name}_command"] = command
        if name == "n":
            # a shaft without lag turns as ordered, and is part of the record
            channels.setdefault("n", command)
    return Trial(
        dt * np.arange(len(states), dtype=float),
        channels,
        name=model.name,
        kind=kind,
        length=model.particulars["length"],
    )


def _channels(model: ManoeuvringModel, states: Floats) -> dict[str, Floats]:
    """Channels of states that can be recorded; a memory of yaw cannot."""
    columns = zip(model.state_names, states.T, strict=False)
    return {name: column for name, column in columns if name in CHANNELS}


def unstable(
    model: ManoeuvringModel, time_s: float, state: Floats
) -> UnstableModelError:
    """Make the error for a ship whose state grew beyond bounds at a given time."""
    last = dict(zip(model.state_names, state.tolist(), strict=False))
    named = ("u", "v", "r", "phi")
    values = [f"{name} = {last[name]:.3g}" for name in named if name in last]
    there = ", ".join(values)
    message = (
        f"model {model.name!r} runs away after {time_s:.1f} s ({there}, SI units): it"
        " is unstable there; check_ship_model says more"
    )
    return UnstableModelError(message, time_s, last)
