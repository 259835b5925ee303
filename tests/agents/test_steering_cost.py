"""Neither design costs more than 1.15 times the best gains that a direct search finds for it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from agents import LQ, PID, sail
from shipgym.ships import load_model
from shipgym.tasks.task import course_keeping_task

SEEDS = np.arange(64)
MARINER = load_model("mariner")
TANKER = load_model("tanker")  # unstable on its course


def best_cost(controller, model, task):
    """Least mean cost that Nelder-Mead finds over the same gains."""
    names = list(controller.gains)
    design = np.array([controller.gains[name] for name in names])

    def cost(factors):
        other = replace(controller, gains=dict(zip(names, design * factors, strict=True)))
        return sail(other, model, task, seeds=SEEDS).cost.mean()

    spread = np.diag(np.full(len(names), -0.4)) + 1.0  # the design, and each gain lowered
    simplex = np.vstack([np.ones(len(names)), spread])
    options = {"maxfev": 70, "initial_simplex": simplex}
    return minimize(cost, simplex[0], method="Nelder-Mead", options=options).fun


@pytest.mark.parametrize("design", [PID, LQ])
@pytest.mark.parametrize(
    ("model", "change_deg"),
    [(MARINER, 30.0), (MARINER, 10.0), (MARINER, 0.0), (TANKER, 30.0)],
    ids=["mariner", "mariner small changes", "mariner one course", "tanker"],
)
def test_designs_are_near_the_best_of_their_kind(design, model, change_deg):
    task = course_keeping_task(course_change_deg=change_deg)
    controller = design.from_model(model)
    cost = sail(controller, model, task, seeds=SEEDS).cost.mean()
    best = best_cost(controller, model, task)
    assert best <= cost <= 1.15 * best
