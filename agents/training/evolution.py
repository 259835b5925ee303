"""Learning without gradients: the weights of a small network searched by CMA-ES.

All networks of a generation steer side by side in one batch of ships, on the same
episodes, which are others in each generation; what is learned is the mean of the
distribution that they are drawn from. The search begins with an output of 0, so at the
cost of the base. Above 100 weights only the diagonal of the covariance is
adapted.

Sources: Hansen 2016, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772 (the
package cma); Ros & Hansen 2008, A simple modification in CMA-ES achieving linear time
and space complexity, PPSN X.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.interface import model_hash
from agents.policies.candidate_networks import CandidateNetworks, NetworkShape
from agents.policies.policy import OUTPUTS, LearnedPolicy
from agents.policies.weights_file import as_json
from agents.rollouts.rollout import rollout
from agents.training.likeness import check_like
from agents.training.plan import TrainingPlan, training_options
from agents.training.settings import CMASettings
from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.extras import library


class EvolutionLearner:
    """A search of weights by CMA-ES, as `Learner` has it.

    Its state is the costs of all generations so far: the search draws and learns from
    them again, without any ship.
    """

    def __init__(self, plan: TrainingPlan, base: Controller | None) -> None:
        self.plan = plan
        self.settings = cast(CMASettings, plan.settings)
        self.shape = network_shape(plan, base)
        self.search = WeightSearch(
            self.shape,
            population=self.settings.population,
            sigma=self.settings.sigma,
            seed=plan.training_seed,
        )
        self.steers = policy_of(plan, base, self.shape, self.search.mean)
        self.steps = 0

        n_lanes = self.settings.population * self.settings.episodes
        options = training_options(plan)
        options.pop("task", None)
        sailed = replace(plan.task, options=options)
        self.engine = sailed.engine(n_lanes, threads=plan.threads)
        first, last = self.training_seeds
        seeds = np.arange(first, last + 1)
        self.seeds = np.tile(seeds, self.settings.population)

    @property
    def training_seeds(self) -> tuple[int, int]:
        """First and last seed of the ships that it learns from."""
        first = self.plan.training_seed
        return first, first + self.settings.episodes - 1

    def learn(self, total_steps: int, at_boundary: Callable[[], None]) -> None:
        """Learn up to the total; `at_boundary` is called before each generation."""
        while self.steps < total_steps:
            at_boundary()
            weights = self.search.ask()
            self.search.tell(self._costs(weights))

    def _costs(self, weights: Sequence[Floats]) -> Floats:
        """Mean cost of each network of a generation; count the steps."""
        networks = CandidateNetworks.of(self.shape, weights)
        found = rollout(
            replace(self.steers, network=networks),
            self.engine,
            self.seeds,
            number=len(self.search.costs),
            tolerant=True,
        )
        decisions = np.ceil(found.steps / self.settings.action_repeat)
        self.steps += int(decisions.sum())
        cost_of_failure = 1e12  # no finite command
        failed = found.failed | ~np.isfinite(found.costs)
        costs = np.where(failed, cost_of_failure, found.costs)
        means = costs.reshape(self.settings.population, -1).mean(axis=1)
        return np.asarray(means)

    def policy(self) -> LearnedPolicy:
        """Return the policy so far; raises InputError if it is not finite."""
        mean = self.search.mean
        largest = float(np.finfo(np.float32).max)
        if not np.all(np.abs(mean) < largest):
            raise InputError(
                f"training diverged after {self.steps} steps: the network's weights are"
                " not finite; lower sigma"
            )
        return replace(self.steers, network=self.shape.network(mean))

    def mean_return(self) -> float | None:
        """Mean return of the last generation; None before the first."""
        costs = self.search.costs
        return -float(costs[-1].mean()) if costs else None

    def note_cost(self, cost: float) -> None:
        """Write nothing: there is no log."""

    def state(self) -> dict[str, Any]:
        """Return all that later steps depend on."""
        none = np.zeros((0, self.settings.population))
        return {
            "steps": self.steps,
            "costs": np.array(self.search.costs) if self.search.costs else none,
        }

    def restore(self, state: Any) -> None:
        """Go on from a state; raises ValueError for one that does not fit."""
        population = self.settings.population

        def as_many(found: Any) -> Floats:
            generations = len(found) if getattr(found, "ndim", 0) else 0
            return np.zeros((generations, population))

        check_like(state, {"steps": 0, "costs": as_many}, "agent")
        for costs in state["costs"]:
            self.search.ask()
            self.search.tell(costs)
        self.steps = state["steps"]

    def close(self) -> None:
        """Do nothing: there is no log."""


class WeightSearch:
    """CMA-ES over the weights of networks, in units of their usual sizes.

    Raises InputError if the package cma is not installed.
    """

    def __init__(
        self, shape: NetworkShape, population: int, sigma: float, seed: int
    ) -> None:
        cma: Any = library("cma", "tune", "cma-es needs it")
        numbers = np.random.default_rng(seed)

        def draw(rows: int, columns: int) -> Floats:
            return numbers.standard_normal((rows, columns))

        self.units = shape.scales()
        start = shape.start(numbers)
        largest_matrix = 100  # weights
        options = {
            "popsize": population,
            "randn": draw,
            "seed": np.nan,  # the global random numbers of NumPy stay as they are
            "verbose": -9,
            "CMA_diagonal": shape.n_weights > largest_matrix,
        }
        self.strategy = cma.CMAEvolutionStrategy(start, sigma, options)
        #: Costs of each generation, shape (population,).
        self.costs: list[Floats] = []

    @property
    def mean(self) -> Floats:
        """Mean of the weights that are drawn."""
        return np.asarray(self.units * self.strategy.mean)

    def ask(self) -> list[Floats]:
        """Draw the weights of a generation."""
        self.points = self.strategy.ask()
        return [self.units * point for point in self.points]

    def tell(self, costs: Floats) -> None:
        """Learn from the costs of the generation that was drawn."""
        self.strategy.tell(self.points, costs.tolist())
        self.costs.append(costs)


def network_shape(plan: TrainingPlan, base: Controller | None) -> NetworkShape:
    """Shape of the network that a plan learns."""
    settings = plan.settings
    observed = plan.task.design.observed()
    n_inputs = settings.frame_stack * len(observed)
    if base is not None:
        n_inputs += 1  # its command
    n_outputs = OUTPUTS[plan.task.task.action]
    sizes = (n_inputs, *settings.net_arch, n_outputs)
    return NetworkShape(sizes, settings.activation)


def policy_of(
    plan: TrainingPlan, base: Controller | None, shape: NetworkShape, weights: Floats
) -> LearnedPolicy:
    """Policy of a plan with these weights."""
    settings = plan.settings
    observed = plan.task.design.observed()
    ship = plan.task.ship
    return LearnedPolicy(
        network=shape.network(weights),
        observation_names=tuple(one.name for one in observed),
        observation_scales=tuple(float(one.scale) for one in observed),
        action=plan.task.task.action,
        frame_stack=settings.frame_stack,
        base=base,
        authority=settings.authority,
        action_repeat=settings.action_repeat,
        rate_limit=settings.rate_limit,
        env_id=plan.task.env_id,
        env_options=as_json(training_options(plan)),
        model_name=ship.name,
        model_sha256=model_hash(ship),
    )
