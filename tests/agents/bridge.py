"""An exported autopilot in plain Python: the functions that become C, step by step."""

import numpy as np

from agents.controllers.guided import Guided
from agents.controllers.law import Nothing
from agents.controllers.memory import from_columns
from agents.export.autopilot import (
    BridgeInput,
    BridgeState,
    bridge_parameters,
    heading_step,
    needed_inputs,
    path_step,
)


class Bridge:
    """A controller, stepped once a control interval in double precision."""

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
        known = BridgeInput(**numbers), self.state, self.parameters
        law = lambda seen, memory, _: self.pilot.steer(seen, memory)  # noqa: E731
        if isinstance(self.agent, Guided):
            guide = lambda seen, memory, _: self.agent.course(seen, memory)  # noqa: E731
            order, self.state = path_step(*known, guide, law)
        else:
            order, self.state = heading_step(*known, law)
        return float(order[0])


def no_memory(agent):
    """Memory of an autopilot that is switched on."""
    columns = iter(np.zeros((agent.memory_size, 1)))
    return from_columns(agent.memory_record, columns)
