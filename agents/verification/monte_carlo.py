"""Monte Carlo: manoeuvres and episodes of models drawn from a ship's covariance.

Draws are shared out in jobs of 25, always the same ones: the results do not depend on
where they are done.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.controller_file import read_controller
from agents.jobs import HERE, JobEngine, run_jobs
from agents.rollouts.course_keeping import Episodes, sail
from agents.verification.tracks import judged_task
from shipgym.arrays import Flags
from shipgym.checks import check_whole
from shipgym.errors import InputError
from shipgym.manoeuvres import Criterion
from shipgym.manoeuvres.imo import imo_criteria
from shipgym.manoeuvres.imo_rules import imo_manoeuvres
from shipgym.manoeuvres.intervals import (
    IndexInterval,
    intervals_of,
    is_size,
    own_indices,
)
from shipgym.models import ShipModel
from shipgym.models.linear import is_course_stable

DRAWS_A_JOB = 25


@dataclass(frozen=True)
class ManoeuvreUncertainty:
    """Standard manoeuvres of a model and of its draws."""

    #: by the names of `imo_assessment`, each with its interval over the draws; those
    #: that her equations allow
    criteria: dict[str, Criterion]
    #: draws that run away in one of the manoeuvres, shape (n_draws,)
    unstable: Flags


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Results of the models drawn."""

    draws: tuple[ShipModel, ...]  # the models drawn
    #: standard manoeuvres and IMO criteria over the draws
    manoeuvres: ManoeuvreUncertainty
    #: draws that do not keep a straight course with the rudder fixed, shape (n_draws,)
    course_unstable: Flags
    controllers: tuple[Controller, ...]
    episodes: tuple[Episodes, ...]  # of each controller, one episode on each draw

    def episodes_of(self, controller: Controller) -> Episodes:
        """Episodes of one of the controllers."""
        places = [one is controller for one in self.controllers]
        return self.episodes[places.index(True)]

    @property
    def stable_draws(self) -> list[ShipModel]:
        """Models drawn that run away in no manoeuvre."""
        stable = np.flatnonzero(~self.manoeuvres.unstable)
        return [self.draws[number] for number in stable.tolist()]


def monte_carlo(
    controllers: Sequence[Controller],
    model: ShipModel,
    draws: int = 200,
    seed: int = 0,
    *,
    where: JobEngine = HERE,
    progress: Callable[[int], None] | None = None,
) -> MonteCarlo:
    """Sail standard manoeuvres and episodes with models drawn from the covariance.

    `controllers`: each steers every draw, draw i with seed + i, the same episodes for
    all; `model`: with a covariance; `draws`: models drawn, at least 2; `seed`: of the
    draws and of the episodes; `where`: in this process, in several, or on a ray
    cluster: the results are the same, bit for bit; `progress`: called with the number
    of draws done. Raises InputError if the model has no covariance, or a controller is
    for another ship; UnstableModelError if the model itself runs away.
    """
    check_whole(draws, "draws", at_least=2)
    check_whole(seed, "seed", at_least=0)
    for controller in controllers:
        controller.check_fits_model(model)
    drawn = model.sample(draws, seed)

    def on_progress(done: int, _: int) -> None:
        if progress is not None:
            progress(min(done * DRAWS_A_JOB, draws))

    jobs = draw_jobs(controllers, model, drawn, seed)
    parts = run_jobs(do_draws, jobs, where, on_progress)
    whole = joined(parts)
    by_controller = whole["episodes"].values()
    return MonteCarlo(
        draws=tuple(drawn),
        manoeuvres=uncertainty_of(model, whole["sailed"]),
        course_unstable=whole["course_unstable"],
        controllers=tuple(controllers),
        episodes=tuple(Episodes(**columns) for columns in by_controller),
    )


def joined(parts: Sequence[Any]) -> Any:
    """Results of all draws, from parts in their order: arrays and lists by name."""
    first = parts[0]
    if isinstance(first, dict):
        return {name: joined([part[name] for part in parts]) for name in first}
    if isinstance(first, list):
        return [one for part in parts for one in part]
    return np.concatenate(parts)


def draw_jobs(
    controllers: Sequence[Controller],
    model: ShipModel,
    drawn: Sequence[ShipModel],
    seed: int,
) -> list[dict[str, Any]]:
    """Jobs of some draws each, with their coefficients.

    These are drawn here: another computer may draw others in the last digit.
    """
    own = replace(model, covariance=None, draws=None).to_dict()
    pilots = [controller.to_dict() for controller in controllers]
    jobs = []
    for first in range(0, len(drawn), DRAWS_A_JOB):
        draws = drawn[first : first + DRAWS_A_JOB]
        job = {
            "model": own,
            "controllers": pilots,
            "names": [draw.name for draw in draws],
            "coefficients": [list(draw.coefficients.values()) for draw in draws],
            "first_seed": seed + first,
        }
        jobs.append(job)
    return jobs


def do_draws(job: dict[str, Any]) -> dict[str, Any]:
    """Manoeuvres, course stability and episodes of some draws."""
    model = ShipModel.from_dict(job["model"])
    draws = []
    for name, values in zip(job["names"], job["coefficients"], strict=True):
        coefficients = dict(zip(model.coefficients, values, strict=True))
        draws.append(replace(model, name=name, coefficients=coefficients))

    seeds = job["first_seed"] + np.arange(len(draws))
    episodes = {}
    for number, content in enumerate(job["controllers"]):
        controller = read_controller(content, "controller")
        sailed = sail(controller, draws, judged_task(), seeds)
        episodes[str(number)] = asdict(sailed)
    course_unstable = [not keeps_course(draw) for draw in draws]
    return {
        "sailed": sail_draws(model, draws),
        "course_unstable": np.array(course_unstable),
        "episodes": episodes,
    }


def keeps_course(model: ShipModel) -> bool:
    """Return True if a ship keeps a straight course with the rudder fixed."""
    try:
        return is_course_stable(model)
    except InputError:
        return False


def sail_draws(model: ShipModel, draws: Sequence[ShipModel]) -> dict[str, Any]:
    """Put models drawn from one through the standard manoeuvres.

    `values`: indices by manoeuvre and name, NaN where there is none, and `ran_away` by
    manoeuvre, each of shape (n_draws,).
    """
    needed = imo_manoeuvres(model)
    sailed = intervals_of(
        {name: one.no_indices for name, one in needed.items()},
        draws,
        {name: one.evaluate for name, one in needed.items()},
    )
    values = {}
    ran_away = {}
    for name, indices in sailed.items():
        values[name] = {index: one.values for index, one in indices.items()}
        first = next(iter(indices.values()))
        ran_away[name] = first.ran_away
    return {"values": values, "ran_away": ran_away}


def uncertainty_of(model: ShipModel, sailed: dict[str, Any]) -> ManoeuvreUncertainty:
    """Intervals and criteria from the runs of a model and of its draws.

    `sailed`: of `sail_draws`. Raises UnstableModelError if the model itself runs away.
    """
    intervals: dict[str, dict[str, IndexInterval]] = {}
    for name, indices in own_indices(model, imo_manoeuvres(model)).items():
        intervals[name] = {}
        for index, value in indices.items():
            intervals[name][index] = IndexInterval(
                value=value,
                values=sailed["values"][name][index],
                ran_away=sailed["ran_away"][name],
                is_size=is_size(index),
            )

    criteria = {}
    unstable = np.any(list(sailed["ran_away"].values()), axis=0)
    for name, criterion in imo_criteria(model, intervals).items():
        if criterion.drawn is not None:
            criteria[name] = criterion
            unstable |= criterion.drawn.ran_away
    return ManoeuvreUncertainty(criteria, unstable)
