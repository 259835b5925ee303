"""Controllers of one kind side by side: each steers ships of its own in one call.

The numbers of a law are floats or arrays with an entry for each ship
(`agents.controllers.law`); so are its gains, and many settings are tried at the cost of
few.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from agents.controllers.controller import Controller
from shipgym import InputError
from shipgym.arrays import Floats


def side_by_side(controllers: Sequence[Controller], ships_each: int) -> Controller:
    """One controller that steers the ships of many, some for each, in their order.

    Raises InputError if they are of several kinds, or do not steer by their law alone.
    """
    first = controllers[0]
    kinds = {type(controller) for controller in controllers}
    if len(kinds) > 1 or not first.is_closed_form():
        names = sorted(kind.__name__ for kind in kinds)
        raise InputError(
            "controllers: expected those of one kind that steers by its law, got"
            f" {', '.join(names)}"
        )

    gains = gathered([controller.gains for controller in controllers], ships_each)
    parts: dict[str, Any] = {"gains": gains}
    if first.has_autopilot:
        autopilots = [_autopilot(controller) for controller in controllers]
        parts["autopilot"] = side_by_side(autopilots, ships_each)
    return replace(first, **parts)


def _autopilot(controller: Any) -> Controller:
    autopilot: Controller = controller.heading_autopilot("a search")
    return autopilot


def gathered(
    gains: Sequence[Mapping[str, float]], ships_each: int
) -> dict[str, Floats]:
    """Gains of many controllers by name, each an entry for each ship."""
    columns = {}
    for name in gains[0]:
        values = [one[name] for one in gains]
        columns[name] = np.repeat(values, ships_each)
    return columns
