"""Designs whose settings are searched on the models drawn, by CMA-ES."""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

from agents.controllers.controller import Controller
from agents.controllers.designs import design
from agents.controllers.registry import controller_class
from agents.suites.benchmark_task import BenchmarkTask, Scenario
from agents.training.controller_search import (
    FoundSettings,
    SearchBudget,
    tune_controller,
    unseen_episodes,
)
from agents.verification.closed_loop import Held
from agents.verification.tracks import track_task
from identification.progress import Progress
from shipgym import Current, ShipModel, Weather
from shipgym.envs.randomisation import Randomisation
from shipgym.tasks.task import Task, course_keeping_task, path_following_task


class Tuned(NamedTuple):
    """A design with settings that were found, and what they cost."""

    controller: Controller
    found: FoundSettings
    on_draws: bool  # whether they were searched on models drawn

    @property
    def leads(self) -> bool:
        """True for a path autopilot."""
        return self.controller.has_autopilot


def no_worse(designed: Held, tuned: Held, search: Tuned) -> tuple[Held, str]:
    """What a search found if it is no worse over the models drawn, else the design.

    Returns it with a sentence for the report.
    """
    before, after = designed.judged, tuned.judged
    is_no_worse = all(new <= old for new, old in zip(after, before, strict=True))
    unit = " m off track" if search.leads else ""
    taken = "taken" if is_no_worse else "not taken, the design is kept"
    found = search.found
    words = (
        f"{found.evaluations} candidates in {found.seconds:.0f} s of processor,"
        f" {taken}: over the models drawn mean {after[1]:.3g}{unit} and"
        f" {after[0]} lost, as designed {before[1]:.3g}{unit} and {before[0]} lost"
    )
    return tuned if is_no_worse else designed, words


def tuned_design(kind: str, model: ShipModel, seconds: float, tell: Progress) -> Tuned:
    """Design of a kind with settings searched on models drawn from the covariance.

    A heading autopilot is tried in course keeping, a path autopilot on drawn paths in a
    current of a tenth of the ship's speed; on the model alone where models drawn are
    lost that no settings hold (`holds_draws`). Raises InputError if there is no design
    with enough margin.
    """
    follows_path = controller_class(kind).has_autopilot
    task = path_task(model) if follows_path else course_keeping_task()
    environment = "path-following" if follows_path else "course-keeping"
    drawn = model_task(environment, model, task)
    alone = model_task(environment, replace(model, covariance=None), task)
    on_draws = holds_draws(kind, drawn, alone)
    found = tune_controller(
        kind,
        drawn if on_draws else alone,
        SearchBudget(seconds=seconds),
        on_progress=partial(_told, tell, kind),
    )
    given_task = track_task(model) if follows_path else task
    given = model_task(environment, model, given_task)
    return Tuned(design(kind, given, found.settings), found, on_draws)


def holds_draws(kind: str, drawn: BenchmarkTask, alone: BenchmarkTask) -> bool:
    """True if a design costs about as much on models drawn as on the model alone.

    Ships that are lost are charged so much that a search on them gives up steering for
    what few of them it may yet hold, and costs many times more on the ship herself.
    """
    most = 3.0  # times the cost on the model
    episodes = SearchBudget().episodes
    on_drawn, on_model = (
        float(unseen_episodes(kind, task, episodes).costs([{}])[0])
        for task in (drawn, alone)
    )
    return on_drawn <= most * on_model


def _told(tell: Progress, kind: str, spent: float, seconds: float, _: float) -> None:
    tell(f"tuning {kind}", min(round(spent), round(seconds)), round(seconds))


def model_task(environment: str, model: ShipModel, task: Task) -> BenchmarkTask:
    """Task of models drawn from the covariance of one, where it has one."""
    drawn = None if model.covariance is None else "covariance"
    scenario = Scenario(model, task, Randomisation(model_uncertainty=drawn))
    return BenchmarkTask(environment, environment, model.name, given=scenario)


def path_task(model: ShipModel) -> Task:
    """Drawn paths in a current of a tenth of the ship's speed."""
    current = Current(0.1 * model.particulars["speed"], towards_deg=90.0)
    return path_following_task(sea=Weather(current=current))
