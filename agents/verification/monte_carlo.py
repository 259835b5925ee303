"""Monte Carlo: manoeuvres and episodes of models drawn from the estimated covariance of one ship.

Draws are shared out in jobs of 25, always the same ones: the results do not depend on where they are done.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller
from agents.controllers.controller_file import read_controller
from agents.engines.jobs import HERE, JobEngine
from agents.rollouts.course_keeping import Episodes, sail
from agents.verification.index_uncertainty import (
    ManoeuvreUncertainty,
    nominal_runs,
    sail_draws,
    uncertainty_of,
)
from shipgym.checks import check_whole
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.ships.linear import is_course_stable

DRAWS_A_JOB = 25


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """What became of the models drawn."""

    draws: tuple[ShipModel, ...]  # the models drawn
    manoeuvres: ManoeuvreUncertainty  # standard manoeuvres and IMO criteria over the draws
    #: draws that do not keep a straight course with the rudder fixed, shape (n_draws,)
    course_unstable: NDArray[np.bool_]
    episodes: tuple[Episodes, ...]  # of each controller, one episode on each draw


def monte_carlo(
    controllers: Sequence[Controller],
    model: ShipModel,
    draws: int = 200,
    seed: int = 0,
    *,
    where: JobEngine = HERE,
    progress: Callable[[int], None] | None = None,
) -> MonteCarlo:
    """Sail the standard manoeuvres and an episode of course keeping with models drawn from the covariance.

    Parameters
    ----------
    controllers : sequence of Controller
        Each steers every draw; draw i with seed + i, the same episodes for all.
    model : ShipModel
        With a covariance.
    draws : int
        Models drawn, at least 2.
    seed : int
        Of the draws and of the episodes.
    where : JobEngine
        In this process, in several, or on a ray cluster; the results are the same, bit for bit.
    progress : callable, optional
        Told the number of draws done.

    Raises
    ------
    InputError
        If the model has no covariance, or a controller is for another ship.
    UnstableModelError
        If the model itself runs away.
    """
    check_whole(draws, "draws", at_least=2)
    check_whole(seed, "seed", at_least=0)
    for controller in controllers:
        controller.check_fits_model(model)
    nominal = nominal_runs(model)
    drawn = model.sample(draws, seed)
    tell = progress or (lambda done: None)
    jobs = draw_jobs(controllers, model, drawn, seed)
    found = where.run(do_draws, jobs, lambda done, _: tell(min(done * DRAWS_A_JOB, draws)))
    episodes = zip(*(part["episodes"] for part in found), strict=True) if controllers else ()
    return MonteCarlo(
        draws=tuple(drawn),
        manoeuvres=uncertainty_of(model, nominal, [part["sailed"] for part in found]),
        course_unstable=np.concatenate([part["course_unstable"] for part in found]),
        episodes=tuple(
            Episodes(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})
            for parts in episodes
        ),
    )


def draw_jobs(
    controllers: Sequence[Controller], model: ShipModel, drawn: Sequence[ShipModel], seed: int
) -> list[dict[str, Any]]:
    """The jobs: coefficients as drawn here, since another computer may draw others in the last digit."""
    common = {
        "model": replace(model, covariance=None).to_dict(),
        "controllers": [controller.to_dict() for controller in controllers],
    }
    jobs = []
    for first in range(0, len(drawn), DRAWS_A_JOB):
        some = drawn[first : first + DRAWS_A_JOB]
        coefficients = [list(draw.coefficients.values()) for draw in some]
        names = [draw.name for draw in some]
        jobs.append({**common, "coefficients": coefficients, "names": names, "first_seed": seed + first})
    return jobs


def do_draws(job: dict[str, Any]) -> dict[str, Any]:
    """Manoeuvres, course stability and episodes of some draws."""
    model = ShipModel.from_dict(job["model"])
    draws = [
        replace(model, name=name, coefficients=dict(zip(model.coefficients, values, strict=True)))
        for name, values in zip(job["names"], job["coefficients"], strict=True)
    ]
    seeds = job["first_seed"] + np.arange(len(draws))
    controllers = [read_controller(content, "controller") for content in job["controllers"]]
    return {
        "sailed": sail_draws(model, draws),
        "course_unstable": np.array([not keeps_course(draw) for draw in draws]),
        "episodes": [asdict(sail(controller, draws, seeds=seeds)) for controller in controllers],
    }


def keeps_course(model: ShipModel) -> bool:
    """Whether the ship keeps a straight course with the rudder fixed; not if there is none at all."""
    try:
        return is_course_stable(model)
    except InputError:
        return False
