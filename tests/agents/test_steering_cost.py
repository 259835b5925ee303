"""Neither design costs more than 1.15 times the best gains that a direct search finds for it."""

from dataclasses import replace

import numpy as np
import pytest
from fleet import Pilots

from agents import LQ, PID, sail
from agents.rollouts.rollout import episode_costs
from shipgym.envs.engine import Engine
from shipgym.ships import load_model
from shipgym.tasks.task import course_keeping_task

SEEDS = np.arange(64)
ROUNDS, TRIED, KEPT = 16, 24, 6
MARINER = load_model("mariner")
TANKER = load_model("tanker")  # unstable on its course


def best_cost(controller, model, task):
    """Least mean cost over the same gains: drawn about the best of those before, all sailed side by side."""
    random = np.random.default_rng(0)
    seeds, engine = np.tile(SEEDS, TRIED), Engine(model, TRIED * len(SEEDS), task)
    mean, covariance = (
        np.zeros(len(controller.gains)),
        0.4**2 * np.eye(len(controller.gains)),
    )
    least = np.inf
    for _ in range(ROUNDS):
        factors = np.exp(random.multivariate_normal(mean, covariance, TRIED))
        pilots = [
            replace(
                controller,
                gains={
                    k: v * f
                    for (k, v), f in zip(controller.gains.items(), row, strict=True)
                },
            )
            for row in factors
        ]
        lanes = Pilots([pilot for pilot in pilots for _ in SEEDS])
        costs = episode_costs(lanes, engine, seeds).reshape(TRIED, -1).mean(axis=1)
        best = np.log(factors[np.argsort(costs)[:KEPT]])
        step, mean = best.mean(axis=0) - mean, best.mean(axis=0)
        covariance = np.cov(best.T) + np.outer(step, step)
        least = min(least, costs.min())
    return least


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
