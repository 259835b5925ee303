"""What controllers remember: one observation that is not a number passes."""

import numpy as np
import pytest

from agents import LQ, LQG, PID, IntegralLineOfSight, PreviewLQ
from tests.agents.mariners import MARINER

REMEMBERING = [
    LQG.from_model(MARINER),
    LQ.from_model(MARINER, rudder_time=0.1),
    IntegralLineOfSight.from_model(MARINER, autopilot=PID.from_model(MARINER)),
    PreviewLQ.from_model(MARINER, yaw_time=0.1),
]


@pytest.mark.parametrize("controller", REMEMBERING, ids=lambda one: one.kind)
def test_orders_are_numbers_again_after_an_observation_that_is_not(controller):
    seen = np.zeros((2, len(controller.observation_names)))
    seen[:, [1, 4]] = 1.0  # on course at service speed
    broken = seen.copy()
    broken[0] = np.nan
    _, state = controller.predict(seen)
    _, state = controller.predict(broken, state)
    for _ in range(3):
        orders, state = controller.predict(seen, state)
    assert np.isfinite(orders).all()
