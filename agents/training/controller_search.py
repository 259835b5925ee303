"""Search of a controller's settings on a task, by CMA-ES on the design model.

Every controller has the same budget of processor time and episodes, whose seeds are
never scored; every few generations they are exchanged for others, so that settings do
not fit a few. The search begins with the design's own settings; a generation of
candidates steers side by side in one batch of ships. What is returned is the best, on
episodes that the search has not seen, of the design, the best candidate on the last
episodes and the mean of the search, with settings that do no good put back to the
design: so it is no worse there than the design. Settings whose loop is unstable or has
too little margin are refused untried.

Source: Hansen 2016, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772 (the
package cma).
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.designs import design
from agents.rollouts.rollout import episode_costs
from agents.suites.benchmark_task import BenchmarkTask
from agents.training.controller_space import Setting, search_space
from shipgym.arrays import Floats, Integers
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.extras import library

FIRST_SEED = 500_000  # of the episodes of a search; scored ones begin at 1,000,000
REFUSED = 1e12  # cost of settings with which no controller can be designed


@dataclass(frozen=True)
class SearchBudget:
    """What a search may use; it ends when either is spent.

    Attributes
    ----------
    seconds : float
        Processor time.
    evaluations : int
        Candidates. With enough time they alone decide, and the result is the same on
        every machine.
    episodes : int
        Episodes that each candidate is tried on; others after six generations, of four
        sets in turn.
    """

    n_sets: ClassVar[int] = 4
    generations: ClassVar[int] = 6  # on each of the sets

    seconds: float = 35.0
    evaluations: int = 100_000
    episodes: int = 16


@dataclass(frozen=True)
class FoundSettings:
    """Settings that a search found.

    Attributes
    ----------
    settings : dict of str to float
        Keywords of `from_model`, and of the LQ that is led after `lq_`.
    cost, start_cost : float
        Mean over episodes that the search has not seen, of these settings and of the
        design's own.
    evaluations, episodes : int
        Candidates that were tried, and on how many episodes each.
    seconds : float
        Processor time of the search.
    """

    settings: dict[str, float]
    cost: float
    start_cost: float
    evaluations: int
    episodes: int
    seconds: float


class SearchResult(NamedTuple):
    """Where a search ended, as settings."""

    best: dict[str, float]  # the candidate of least cost on the last episodes
    mean: dict[str, float]  # of the distribution of the last generation
    evaluations: int


def tune_controller(
    kind: str,
    task: BenchmarkTask,
    budget: SearchBudget | None = None,
    *,
    seed: int = 0,
) -> FoundSettings:
    """Search the settings of a controller on the model of a task.

    Raises InputError for an unknown kind, guidance without a path, and if no design
    with enough margin is found.

    Parameters
    ----------
    kind : str
        As registered, with settings to search (`search_space`).
    task : BenchmarkTask
        Its design task is what is sailed.
    budget : SearchBudget, optional
    seed : int
        Of the search.
    """
    spent = time.process_time()
    budget = budget or SearchBudget()
    space = search_space(kind, task)
    episodes = CandidateEpisodes(
        kind, task.design_task, episodes_of(budget.episodes, 0)
    )
    found = search(
        episodes.costs,
        space,
        budget,
        seed=seed,
        renew=episodes.renew,
    )

    start = {setting.name: setting.start for setting in space}
    finalists = [start, found.best, found.mean]
    # twice the episodes of the search, which it has not seen
    first = FIRST_SEED + SearchBudget.n_sets * budget.episodes
    seeds = first + np.arange(2 * budget.episodes)
    unseen = CandidateEpisodes(kind, task.design_task, seeds)
    costs = unseen.costs(finalists)
    winner = int(np.argmin(costs))
    if costs[winner] >= REFUSED:
        raise InputError(
            f"controller: expected a design of '{kind}' with enough margin for the"
            f" model of task '{task.name}', found none"
        )
    settings, cost = simplified(finalists[winner], float(costs[winner]), start, unseen)
    return FoundSettings(
        settings=settings,
        cost=cost,
        start_cost=float(costs[0]),
        evaluations=found.evaluations,
        episodes=budget.episodes,
        seconds=time.process_time() - spent,
    )


def episodes_of(number: int, which_set: int) -> Integers:
    """Seeds of a set of so many episodes; after the last comes the first again."""
    first = FIRST_SEED + number * (which_set % SearchBudget.n_sets)
    return first + np.arange(number)


def simplified(
    settings: Mapping[str, float],
    cost: float,
    start: Mapping[str, float],
    episodes: "CandidateEpisodes",
) -> tuple[dict[str, float], float]:
    """Settings with those put back to the design that do no good, and their cost.

    What a model says nothing of, sway in Nomoto's for one, a search leaves anywhere. So
    settings are put back one after the other, that of the least effect first, while all
    together cost no more than a thousandth more.
    """
    harmless = 1.001 * cost
    alone = episodes.costs([{**settings, name: start[name]} for name in start])
    names = [name for _, name in sorted(zip(alone, start, strict=True))]
    candidates = [dict(settings)]
    for name in names:
        candidates.append({**candidates[-1], name: start[name]})
    costs = episodes.costs(candidates)
    last = int(np.flatnonzero(costs <= harmless).max(initial=0))
    return candidates[last], float(costs[last])


def search(
    costs: Callable[[Sequence[Mapping[str, float]]], Floats],
    space: Sequence[Setting],
    budget: SearchBudget,
    *,
    seed: int = 0,
    renew: Callable[[int], None] | None = None,
) -> SearchResult:
    """Search for the least cost by CMA-ES, within a budget.

    The same arguments give the same result where the number of evaluations ends it.

    Parameters
    ----------
    costs : callable
        Mean cost of each of some settings, shape (n,); `REFUSED` of those without a
        design.
    space : sequence of Setting
    budget : SearchBudget
    seed : int
    renew : callable, optional
        Exchanges the episodes that costs are of; called with the number of a set, from
        0, before the first of every six generations.
    """
    cma: Any = library("cma", "tune", "searching settings needs it")
    began = time.process_time()
    options = {
        "seed": 1 + seed,
        "verbose": -9,
        # half more than the rule of Hansen 2016, eq. 48
        "popsize": int(1.5 * (4 + 3.0 * np.log(len(space)))),
        "signals_filename": "",  # no settings from files in the working folder
    }
    # half of the steps of the settings at first
    strategy = cma.CMAEvolutionStrategy(
        np.zeros(len(space)),
        0.5,
        options,
    )
    best = {setting.name: setting.start for setting in space}
    least = np.inf
    evaluations = 0

    while not strategy.stop():
        spent = time.process_time() - began
        left = budget.evaluations - evaluations
        if spent >= budget.seconds or left < strategy.popsize:
            break
        generation = evaluations // strategy.popsize
        which_set, since = divmod(generation, budget.generations)
        if renew is not None and since == 0:
            renew(which_set)
            least = np.inf
        points = strategy.ask()
        candidates = [settings_at(point, space) for point in points]
        found = costs(candidates)
        strategy.tell(points, found.tolist())

        evaluations += len(points)
        first = int(np.argmin(found))
        if found[first] < least:
            least = float(found[first])
            best = candidates[first]
    mean = settings_at(strategy.result.xfavorite, space)
    return SearchResult(best, mean, evaluations)


def settings_at(point: Floats, space: Sequence[Setting]) -> dict[str, float]:
    """Settings at a point of the search, whose origin is the design."""
    pairs = zip(space, point, strict=True)
    return {setting.name: setting.at(float(z)) for setting, z in pairs}


class CandidateEpisodes:
    """Episodes of a task that candidates are tried on, with a design for its model."""

    def __init__(self, kind: str, task: BenchmarkTask, seeds: Integers) -> None:
        self.kind = kind
        self.task = task
        self.seeds = seeds
        self._engines: dict[int, Engine] = {}

    def renew(self, which_set: int) -> None:
        """Exchange the episodes for a set of as many."""
        self.seeds = episodes_of(len(self.seeds), which_set)

    def costs(self, candidates: Sequence[Mapping[str, float]]) -> Floats:
        """Mean cost of each candidate, shape (n,)."""
        designs = [self.designed(settings) for settings in candidates]
        known = [number for number, made in enumerate(designs) if made is not None]
        found = np.full(len(candidates), REFUSED)
        if known:
            steering = [designs[number] for number in known]
            found[known] = self._steered(steering, len(candidates))
        return np.where(np.isfinite(found), found, REFUSED)

    def designed(self, settings: Mapping[str, float]) -> Controller | None:
        """Controller with these settings; None without enough margin."""
        try:
            made = design(self.kind, self.task, settings)
        except InputError:
            return None
        return made if has_margin(made) else None

    def _steered(self, controllers: Sequence[Any], places: int) -> Floats:
        """Mean costs of controllers, side by side where their kind can be.

        `places`: of the engine; all of them sail, since a new engine takes longer.
        """
        n_episodes = len(self.seeds)
        if type(controllers[0]).is_closed_form():
            fillers = [controllers[0]] * (places - len(controllers))
            batch = side_by_side([*controllers, *fillers], n_episodes)
            seeds = np.tile(self.seeds, places)
            costs = episode_costs(batch, self._engine(places * n_episodes), seeds)
            means = costs.reshape(places, n_episodes).mean(axis=1)
            return np.asarray(means[: len(controllers)])

        engine = self._engine(n_episodes)
        alone = [episode_costs(one, engine, self.seeds) for one in controllers]
        return np.asarray(np.mean(alone, axis=1))

    def _engine(self, n_ships: int) -> Engine:
        if n_ships not in self._engines:
            self._engines[n_ships] = self.task.engine(n_ships)
        return self._engines[n_ships]


def has_margin(controller: Controller) -> bool:
    """True if a loop has a gain margin of 1.5 and a phase margin of 20 degrees."""
    margins = controller.margins
    return margins.gain_margin >= 1.5 and margins.phase_margin_deg >= 20.0


def side_by_side(controllers: Sequence[Controller], ships_each: int) -> Controller:
    """One controller that steers the ships of many, some for each, in their order.

    They are of one kind that steers by its law alone. The numbers of a law are floats
    or arrays with an entry for each ship (`agents.controllers.law`), and so are its
    gains: many settings are tried at the cost of few.
    """
    first = controllers[0]
    gains = {}
    for name in first.gains:
        values = [controller.gains[name] for controller in controllers]
        gains[name] = np.repeat(values, ships_each)
    parts: dict[str, Any] = {"gains": gains}
    if first.has_autopilot:
        led: list[Any] = [vars(guide)["autopilot"] for guide in controllers]
        parts["autopilot"] = side_by_side(led, ships_each)
    return replace(first, **parts)
