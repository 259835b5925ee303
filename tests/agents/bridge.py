"""An exported autopilot in plain Python: the functions that become C, step by step."""

from types import SimpleNamespace

import numpy as np

from agents import Controller
from agents.controllers.guided import Guided
from agents.controllers.law import Nothing
from agents.controllers.memory import from_columns
from agents.export.autopilot import (
    BridgeInput,
    BridgeState,
    bridge_parameters,
    heading_step,
    needed_inputs,
    observation_bounds,
    own_observations,
    path_step,
)


class Bridge:
    """A controller or policy, stepped once a control interval in double precision."""

    def __init__(self, agent, limit=None):
        self.agent = agent
        self.inputs = needed_inputs(agent)
        self.pilot = agent.autopilot if isinstance(agent, Guided) else agent
        parameters = bridge_parameters(agent)
        self.parameters = parameters._replace(limit=limit or parameters.limit)
        guided = isinstance(agent, Guided)
        guidance = no_memory(agent) if guided else Nothing()
        zero = np.zeros(1)
        self.state = BridgeState(zero, zero, zero, no_memory(self.pilot), guidance)

    @property
    def limit(self):
        return self.parameters.limit

    def step(self, given):
        """Ordered rudder, rad, for the numbers named in `inputs`."""
        numbers = {name: np.array([given[name]]) for name in self.inputs}
        self.given = BridgeInput(**numbers)
        known = self.given, self.state, self.parameters
        if isinstance(self.agent, Guided):
            guide = lambda seen, memory, _: self.agent.course(seen, memory)  # noqa: E731
            order, self.state = path_step(*known, guide, self.law)
        else:
            order, self.state = heading_step(*known, self.law)
        return float(order[0])

    def law(self, seen, memory, _):
        """Rudder of the heading autopilot, by its law or by its network."""
        if isinstance(self.pilot, Controller):
            return self.pilot.steer(seen, memory)
        error, integral = seen.heading_error, seen.heading_error_integral
        last = self.state.last_command
        own = own_observations(error, integral, self.given, last)
        known = SimpleNamespace(**self.given._asdict(), **own._asdict())
        shown = []
        names, scales = self.pilot.observation_names, self.pilot.observation_scales
        for name, scale in zip(names, scales, strict=True):
            shown.append(
                np.clip(getattr(known, name) / scale, *observation_bounds()[name])
            )
        starts = self.state.started == 0.0
        action, memory = self.pilot.predict(np.array(shown).T, memory, starts)
        return action[:, 0].astype(float) * self.limit, memory


def no_memory(agent):
    """Memory of an autopilot that is switched on."""
    if not isinstance(agent, Controller):
        return None
    columns = iter(np.zeros((agent.memory_size, 1)))
    return from_columns(agent.memory_record, columns)
