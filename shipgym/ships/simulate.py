"""Ships through time as Trials: with given commands, or open loop with the rudder of a measured trial."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import check_whole
from shipgym.engine.loops import ship_loop
from shipgym.engine.records import leaves
from shipgym.engine.trajectories import SEA_CHANNELS
from shipgym.errors import InputError, UnstableModelError
from shipgym.sea.conditions import Weather
from shipgym.sea.open_sea import Sea
from shipgym.sea.weather_column import as_weather, weather_column
from shipgym.ships.manoeuvring_model import (
    ManoeuvringModel,
    checked_orders,
    two_commands,
)
from shipgym.ships.term_table import Structure
from shipgym.trials.trial import Trial
from shipgym.trials.units import CHANNELS

LONGEST_STEP = 0.025  # of the time to travel one ship length
WIND = {"u": "wind_udot", "v": "wind_vdot", "r": "wind_rdot"}  # channels, by equation
Seed = int | np.random.Generator


@dataclass(frozen=True)
class Conditions:
    """Depth of the water and weather of a simulation."""

    water_depth: float = np.inf  # m
    weather: Weather | str | None = (
        None  # A weather, the name of a sea state, or None for calm
    )
    seed: Seed = 0  # of the random part of the weather


class Passage:
    """One ship on her way through given conditions: the loops for them and the arrays they work on.

    `numbers` are the ship's, `sea` is its state, that of its random numbers and its
    parameters, as loops take them, `windy` whether there is any weather; its filters
    are made for steps of `dt` seconds.
    """

    def __init__(
        self, model: ManoeuvringModel, conditions: Conditions, dt: float
    ) -> None:
        self.model, self.compiled, self.dt = model, model.compiled, dt
        self.numbers = model.ship_numbers(conditions.water_depth, dt)
        weather = as_weather(conditions.weather, "weather")
        self.windy = not weather.calm
        self.sea = np.zeros(0), np.zeros(0, dtype=np.uint64), np.zeros(0)
        if self.windy:
            seed, parameters = (
                conditions.seed,
                weather_column(model, weather, dt, conditions.water_depth),
            )
            if not isinstance(seed, np.random.Generator):
                check_whole(seed, "seed", at_least=0)
            word = np.random.default_rng(seed).integers(2**63)
            self.sea = (
                np.zeros(len(leaves(Sea))),
                np.array([word], dtype=np.uint64),
                parameters,
            )

    def loop(self, name: str) -> Any:
        """A loop of `shipgym.engine.loops`, compiled for the ship and for calm water or weather."""
        return ship_loop(self.compiled, name, self.windy)

    def run(
        self, name: str, states: Floats, *arguments: Any, since: float = 0.0
    ) -> Any:
        """Fill the states after the first by a loop, from its arguments but for the sea and the ship.

        Returns what the loop returns: the last row, or that and more. Raises
        UnstableModelError where the ship leaves every physical range, `since` s after
        the manoeuvre began.
        """
        found = self.loop(name)(states, *arguments, *self.sea, self.numbers)
        reached = found[0] if isinstance(found, tuple) else found
        if reached < len(states) - 1:
            raise unstable(
                self.model, since + self.dt * reached, states[reached], self.dt
            )
        return found

    def states(self, first: Floats, n_steps: int) -> Floats:
        """Rows for `n_steps` + 1 states, shape (n_columns,) each, and their weather; `first` filled in."""
        width = len(self.compiled.state_names) + (
            len(SEA_CHANNELS) if self.windy else 0
        )
        states = np.empty((n_steps + 1, width))
        states[0, : len(first)] = first
        if len(first) < width:
            self.loop("sample_sea")(states, *self.sea)
        return states


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
    if not (np.isfinite(dt) and dt > 0.0):
        raise InputError(f"dt: {dt} found, expected a step in s above 0")
    passage = Passage(model, Conditions(water_depth, weather, seed), dt)
    states = passage.states(initial_state(model, state), len(held))
    passage.run("simulate", states, two_commands(held), dt)
    return as_trial(model, dt, states, np.vstack([held, held[-1:]]), kind)


def orders(
    model: ManoeuvringModel, rudder: Floats, shaft: Floats | None = None
) -> Floats:
    """Commands of shape (n_steps, n_command): a rudder, rad, and a shaft, 1/s, by default as in service."""
    commands = np.repeat(model.service_command[None], len(rudder), axis=0)
    commands[:, 0] = rudder
    if shaft is not None:
        commands[:, 1] = shaft
    return commands


def open_loop(model: ManoeuvringModel, trial: Trial) -> Trial:
    """Predict a trial from its initial state and its measured rudder (and shaft speed) alone.

    The rudder is taken straight between the samples, as measured: no steering gear
    stands between. The trial has u, v, r, psi, delta (x and y where recorded; n where
    the model has a shaft), and where it has them accelerations by wind; the result is
    the simulated state at its times. Raises InputError if a channel is missing,
    UnstableModelError where the simulated ship leaves every physical range.
    """
    needed = ["psi", "u", "v", "r", "delta", *model.command_names[1:]]
    missing = [name for name in needed if name not in trial.channels]
    if missing:
        raise InputError(
            f"trial {trial.name!r}: channel {missing[0]!r} is missing, it is needed to"
            " predict the trial"
        )
    t = np.array(trial.t)
    states = np.empty((len(t), len(model.state_names)))
    states[0] = [
        trial[name][0] if name in trial.channels else 0.0 for name in model.state_names
    ]
    if "q" in model.state_names:  # which no trial records: that of a steady yaw rate
        rates = model.rates({name: trial[name][:1] for name in needed})
        states[0, model.state_names.index("q")] = -rates["r"][0]
    n = np.array(trial["n"]) if "n" in trial.channels else np.zeros(len(t))
    longest_step = LONGEST_STEP * model.travel_time
    wind = wind_accelerations(trial, model.dynamics)
    wind = 0.5 * (wind[1:] + wind[:-1])
    loop = ship_loop(model.compiled, "open_loop", bool(wind.any()))
    reached = loop(
        states, t, np.array(trial["delta"]), n, wind, longest_step, model.ship_numbers()
    )
    if reached < len(t) - 1:
        raise unstable(model, t[reached], states[reached])
    channels, length = _channels(model, states), model.particulars["length"]
    return Trial(
        t, channels, name=trial.name, kind=trial.kind, use=trial.use, length=length
    )


def wind_accelerations(trial: Trial, dynamics: Any = None) -> Floats:
    """Those in surge, sway and yaw that a trial has, of a structure's equations; shape (n_samples, 3)."""
    own = dynamics.equations if isinstance(dynamics, Structure) else "uvr"
    rows = [
        trial[name] if axis in own and name in trial else 0.0 * trial.t
        for axis, name in WIND.items()
    ]
    return np.column_stack(rows)


def initial_state(model: ManoeuvringModel, state: ArrayLike | None) -> Floats:
    """A given state, checked, or straight ahead at service speed."""
    if state is None:
        return model.service_state
    start = np.asarray(state, dtype=float)
    if start.shape != (len(model.state_names),) or not np.all(np.isfinite(start)):
        raise InputError(
            f"state: shape {start.shape} found, expected {len(model.state_names)}"
            f" finite numbers for {', '.join(model.state_names)}"
        )
    return start


def as_trial(
    model: ManoeuvringModel,
    dt: float,
    states: Floats,
    commands: Floats,
    kind: str | None = None,
) -> Trial:
    """States dt apart, the weather behind them and the commands held from each sample on as a Trial."""
    channels = _channels(model, states)
    for name, values in zip(
        SEA_CHANNELS, states[:, len(model.state_names) :].T, strict=False
    ):
        if name not in ("phi_wave", "p_wave") or "phi" in model.state_names:
            channels[name] = values
    for name, command in zip(model.command_names, commands.T, strict=True):
        channels[f"{name}_command"] = command
        if (
            name == "n"
        ):  # a shaft without lag turns as ordered, and is part of the record
            channels.setdefault("n", command)
    t = dt * np.arange(len(states), dtype=float)
    return Trial(
        t, channels, name=model.name, kind=kind, length=model.particulars["length"]
    )


def _channels(model: ManoeuvringModel, states: Floats) -> dict[str, Floats]:
    """What can be recorded of states; a memory of yaw cannot."""
    columns = zip(model.state_names, states.T, strict=False)
    return {name: column for name, column in columns if name in CHANNELS}


def unstable(
    model: ManoeuvringModel, time_s: float, state: Floats, step: float = 0.0
) -> UnstableModelError:
    """The error for a ship that ran away after a given time and physical state, in steps of so many s."""
    last = dict(zip(model.state_names, state.tolist(), strict=False))
    heel = f", phi = {np.degrees(last['phi']):.3g} deg" if "phi" in last else ""
    longest = LONGEST_STEP * model.travel_time
    long = (
        f", or steps of {step:g} s are too long: try {longest:.1g} s"
        if step > longest
        else ""
    )
    own = ", or her equations give no number (check_ship_model says where)"
    return UnstableModelError(
        f"model {model.name!r} runs away after {time_s:.1f} s (u = {last['u']:.3g} m/s,"
        f" v = {last['v']:.3g} m/s, r = {np.degrees(last['r']):.3g} deg/s{heel}): it is"
        f" unstable there{long}{own if getattr(model.dynamics, 'path', None) else ''}",
        time_s,
        last,
    )
