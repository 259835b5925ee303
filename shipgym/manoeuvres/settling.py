"""Legs of a manoeuvre that last until the motion is steady."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import Conditions, Passage, as_trial
from shipgym.trials.trial import Trial

#: Fills states of shape (n_steps + 1, n_columns), which begin with the start, and
#: commands (n_steps, 2).
Sail = Callable[[Floats, Floats], None]


class SteadyMotion(NamedTuple):
    """Means over the last stretch of a leg."""

    rudder: float  # ordered, rad
    yaw_rate: float  # rad/s


class Voyage:
    """Builder of a manoeuvre, leg by leg, from service speed or a given state.

    Samples are dt apart, s; by default a fortieth of the time to travel one ship
    length. In weather the motion is never steady: legs that wait for it last their
    longest.
    """

    def __init__(
        self,
        model: ShipModel,
        dt: float | None,
        conditions: Conditions,
        state: Floats | None = None,
    ) -> None:
        self.model = model
        self.water_depth = conditions.water_depth
        self.length_time = model.travel_time
        steps_per_length = 40  # simulation steps in the time to travel one ship length
        self.dt = self.length_time / steps_per_length
        if dt is not None:
            self.dt = check_number(dt, "dt", above=0.0, at_most=self.length_time)
        self.passage = Passage(model, conditions, self.dt)
        start = model.service_state if state is None else state
        self._states = [self.passage.states(start, 0)]
        self._commands: list[Floats] = []

    @property
    def state(self) -> Floats:
        """The state now, and what is recorded of the weather, shape (n_columns,)."""
        return np.asarray(self._states[-1][-1])

    def go(self, sail: Sail, n_steps: int) -> tuple[Floats, Floats]:
        """Sail some steps; states (n_steps, n_columns) and commands (n_steps, 2)."""
        states = self.passage.states(self.state, n_steps)
        commands = np.empty((n_steps, 2))
        sail(states, commands)
        after_start = states[1:]
        self._states.append(after_start)
        self._commands.append(commands)
        return after_start, commands

    def _run(self, loop: str, states: Floats, *arguments: Any) -> None:
        steps = sum(len(commands) for commands in self._commands)
        self.passage.run(loop, states, *arguments, since=self.dt * steps)

    def hold(self, rudder: float, shaft: float) -> Sail:
        """Leg with constant orders: rudder in rad, shaft speed in 1/s."""

        def sail(states: Floats, commands: Floats) -> None:
            commands[:] = rudder, shaft
            self._run("simulate", states, commands, self.dt)

        return sail

    def rate_helmsman(self) -> Callable[[float], Sail]:
        """Map a yaw rate, rad/s, to the leg in which a helmsman holds it by PI control.

        The helmsman is designed from the rudder's effect at service speed, for a
        bandwidth of 2 U0 / L and a reset time of 4 L / U0; the integral part carries
        over from leg to leg.
        """
        bandwidth = 2.0 / self.length_time
        gain = bandwidth / rudder_effect(self.model, self.water_depth)
        reset_time = 4.0 * self.length_time
        memory = np.zeros(1)
        shaft = self.model.service_shaft_speed

        def at_rate(rate: float) -> Sail:
            def sail(states: Floats, commands: Floats) -> None:
                rudder = np.empty(len(commands))
                self._run(
                    "steer_rate",
                    states,
                    rudder,
                    memory,
                    rate,
                    shaft,
                    self.dt,
                    gain,
                    reset_time,
                )
                commands[:, 0] = rudder
                commands[:, 1] = shaft

            return sail

        return at_rate

    def settle(self, sail: Sail) -> SteadyMotion:
        """Sail until the motion no longer changes, 300 ship lengths at most."""
        speed = self.model.particulars["speed"]
        units = np.array([speed, speed, 1.0 / self.length_time, 1.0])
        motion = np.full(len(units), np.inf)
        most_stretches = 60  # after which a leg ends, steady or not
        # largest change of (u, v, r L) / U0 and rudder from one stretch to the next
        steady = 2e-5
        for _ in range(most_stretches):
            before = motion
            motion = self._stretch(sail)
            change = np.abs(motion - before) / units
            if change.max() < steady:
                break
        _, _, yaw_rate, rudder = motion.tolist()
        return SteadyMotion(rudder, yaw_rate)

    def _stretch(self, sail: Sail) -> Floats:
        """Sail a stretch; means of u, v, r and the ordered rudder, shape (4,)."""
        stretch = 5.0  # ship lengths at service speed over which the motion is averaged
        n_steps = round(stretch * self.length_time / self.dt)
        states, commands = self.go(sail, n_steps)
        names = self.model.state_names
        columns = [names.index(name) for name in ("u", "v", "r")]
        velocities = states[:, columns].mean(axis=0)
        rudder = commands[:, 0].mean()
        return np.append(velocities, rudder)

    def trial(self, kind: str | None = None, last: int | None = None) -> Trial:
        """Recording of the legs sailed so far, up to the sample number `last`."""
        states = np.concatenate(self._states)
        commands = np.concatenate(self._commands)
        # the last order is held at the last sample too
        commands = np.append(commands, commands[-1:], axis=0)
        end = len(states) if last is None else last + 1
        n_orders = len(self.model.command_names)
        return as_trial(
            self.model,
            self.dt,
            states[:end],
            commands[:end, :n_orders],
            kind,
        )


def rudder_effect(model: ShipModel, water_depth: float) -> float:
    """Yaw acceleration per rudder angle at service speed, 1/s^2.

    InputError for a rudder that turns the ship to the other side.
    """
    angle = float(np.radians(5.0))
    columns = {
        "u": np.full(2, model.particulars["speed"]),
        "delta": np.array([angle, -angle]),
        "n": np.full(2, model.service_shaft_speed),
    }
    rates = model.rates(columns, water_depth)
    to_starboard, to_port = rates["r"]
    effect = float(to_starboard - to_port) / (2.0 * angle)
    if not effect > 0.0:
        raise InputError(
            f"model {model.name!r}: expected a rudder that turns the ship to its side,"
            f" got rdot by delta of {effect:g} 1/s^2 at service speed; check the signs"
            " of its coefficients"
        )
    return effect
