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
from agents.verification.index_uncertainty import (
    ManoeuvreUncertainty,
    SailedDraws,
    nominal_runs,
    sail_draws,
    uncertainty_of,
)
from agents.verification.tracks import judged_task
from shipgym.arrays import Flags
from shipgym.checks import check_whole
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.models.linear import is_course_stable

DRAWS_A_JOB = 25


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Results of the models drawn."""

    draws: tuple[ShipModel, ...]  # the models drawn
    #: standard manoeuvres and IMO criteria over the draws
    manoeuvres: ManoeuvreUncertainty
    #: draws that do not keep a straight course with the rudder fixed, shape (n_draws,)
    course_unstable: Flags
    episodes: tuple[Episodes, ...]  # of each controller, one episode on each draw

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
    nominal = nominal_runs(model)
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
        manoeuvres=uncertainty_of(model, nominal, SailedDraws(**whole["sailed"])),
        course_unstable=whole["course_unstable"],
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
        "sailed": sail_draws(model, draws)._asdict(),
        "course_unstable": np.array(course_unstable),
        "episodes": episodes,
    }


def keeps_course(model: ShipModel) -> bool:
    """Return True if a ship keeps a straight course with the rudder fixed."""
    try:
        return is_course_stable(model)
    except InputError:
        return False
