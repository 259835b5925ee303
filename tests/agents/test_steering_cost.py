"""Neither design costs more than 1.15 times the best gains of a direct search."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, PID, sail
from agents.rollouts.rollout import episode_costs
from shipgym.envs.engine import Engine
from shipgym.models import load_model
from shipgym.tasks.task import course_keeping_task

SEEDS = np.arange(64)
ROUNDS, TRIED, KEPT = 16, 24, 6
MARINER = load_model("mariner")
TANKER = load_model("tanker")  # unstable on its course


def best_cost(controller, model, task):
    """Least mean cost over the same gains, drawn about the best of those before."""
    random = np.random.default_rng(0)
    names, n_gains = list(controller.gains), len(controller.gains)
    seeds, engine = np.tile(SEEDS, TRIED), Engine(model, TRIED * len(SEEDS), task)
    mean, covariance = np.zeros(n_gains), 0.4**2 * np.eye(n_gains)
    least = np.inf
    for _ in range(ROUNDS):
        logarithms = random.multivariate_normal(mean, covariance, TRIED)
        # a law takes arrays too: gains of each ship
        of_ships = np.repeat(np.exp(logarithms), len(SEEDS), axis=0)
        gains = {
            name: controller.gains[name] * of_ships[:, k]
            for k, name in enumerate(names)
        }
        costs = episode_costs(replace(controller, gains=gains), engine, seeds)
        by_gains = costs.reshape(TRIED, -1).mean(axis=1)

        best = logarithms[np.argsort(by_gains)[:KEPT]]
        step, mean = best.mean(axis=0) - mean, best.mean(axis=0)
        covariance = np.cov(best.T) + np.outer(step, step)
        least = min(least, by_gains.min())
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
