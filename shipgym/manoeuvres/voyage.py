"""Legs of a manoeuvre that last until the motion is steady."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import Conditions, Passage, as_trial
from shipgym.trials.trial import Trial


class Voyage:
    """Builder of a manoeuvre, leg by leg, from service speed in calm water.

    Samples are dt apart, s; by default a fortieth of the time to travel one ship
    length. The water depth is in m.
    """

    def __init__(self, model: ShipModel, dt: float | None, water_depth: float) -> None:
        self.model = model
        self.length_time = model.travel_time
        steps_per_length = 40  # simulation steps in the time to travel one ship length
        self.dt = self.length_time / steps_per_length
        if dt is not None:
            self.dt = check_number(dt, "dt", above=0.0, at_most=self.length_time)
        self.passage = Passage(model, Conditions(water_depth), self.dt)
        self._states = [self.passage.states(model.service_state, 0)]
        self._commands: list[Floats] = []

    def hold(self, rudder: float, shaft: float, n_steps: int) -> Floats:
        """Hold rudder, rad, and shaft speed, 1/s; states (n_steps, n_state)."""
        states = self.passage.states(self._states[-1][-1], n_steps)
        commands = np.tile([rudder, shaft], (n_steps, 1))
        sailed = sum(len(part) for part in self._commands)
        self.passage.run("simulate", states, commands, self.dt, since=self.dt * sailed)
        after_start = states[1:]
        self._states.append(after_start)
        self._commands.append(commands)
        return after_start

    def settle(self, rudder: float, shaft: float) -> float:
        """Hold until the motion no longer changes; the yaw rate, rad/s.

        Means over stretches of five ship lengths are compared; the leg lasts at most
        300.
        """
        speed = self.model.particulars["speed"]
        units = np.array([speed, speed, 1.0 / self.length_time])
        names = self.model.state_names
        columns = [names.index(name) for name in ("u", "v", "r")]
        n_steps = round(5.0 * self.length_time / self.dt)
        most_stretches = 60
        # largest change of (u, v, r L) / U0 from one stretch to the next
        steady = 2e-5
        motion = np.full(len(units), np.inf)
        for _ in range(most_stretches):
            before = motion
            states = self.hold(rudder, shaft, n_steps)
            motion = states[:, columns].mean(axis=0)
            change = np.abs(motion - before) / units
            if change.max() < steady:
                break
        return float(motion[2])

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
