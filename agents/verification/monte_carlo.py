"""Monte Carlo: manoeuvres and episodes of models drawn from the estimated covariance of one ship.

Draws are shared out in jobs of 25, always the same ones: the results do not depend on
where they are done.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller
from agents.controllers.controller_file import read_controller
from agents.jobs import HERE, JobEngine, run_jobs
from agents.rollouts.course_keeping import Episodes, sail
from agents.verification import index_uncertainty
from agents.verification.index_uncertainty import ManoeuvreUncertainty
from shipgym.checks import check_whole
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.ships.linear import is_course_stable

DRAWS_A_JOB = 25


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """What became of the models drawn."""

    draws: tuple[ShipModel, ...]  # the models drawn
    manoeuvres: (
        ManoeuvreUncertainty  # standard manoeuvres and IMO criteria over the draws
    )
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

    `controllers`: each steers every draw, draw i with seed + i, the same episodes for
    all; `model`: with a covariance; `draws`: models drawn, at least 2; `seed`: of the
    draws and of the episodes; `where`: in this process, in several, or on a ray
    cluster: the results are the same, bit for bit; `progress`: told the number of draws
    done. Raises InputError if the model has no covariance, or a controller is for
    another ship; UnstableModelError if the model itself runs away.
    """
    check_whole(draws, "draws", at_least=2)
    check_whole(seed, "seed", at_least=0)
    for controller in controllers:
        controller.check_fits_model(model)
    nominal = index_uncertainty.nominal_runs(model)
    drawn = model.sample(draws, seed)
    tell = progress or (lambda done: None)
    jobs = draw_jobs(controllers, model, drawn, seed)
    found = run_jobs(
        do_draws, jobs, where, lambda done, _: tell(min(done * DRAWS_A_JOB, draws))
    )
    sailed = index_uncertainty.uncertainty_of(
        model, nominal, [part["sailed"] for part in found]
    )
    unstable = np.concatenate([part["course_unstable"] for part in found])
    episodes = tuple(
        Episodes(
            **{
                name: np.concatenate([part[name] for part in parts])
                for name in parts[0]
            }
        )
        for parts in zip(*(part["episodes"] for part in found), strict=True)
    )
    return MonteCarlo(tuple(drawn), sailed, unstable, episodes)


def draw_jobs(
    controllers: Sequence[Controller],
    model: ShipModel,
    drawn: Sequence[ShipModel],
    seed: int,
) -> list[dict[str, Any]]:
    """The jobs: coefficients as drawn here, since another computer may draw others in the last digit."""
    own, pilots = (
        replace(model, covariance=None).to_dict(),
        [one.to_dict() for one in controllers],
    )
    parts = [
        (first, drawn[first : first + DRAWS_A_JOB])
        for first in range(0, len(drawn), DRAWS_A_JOB)
    ]
    return [
        {
            "model": own,
            "controllers": pilots,
            "names": [draw.name for draw in some],
            "coefficients": [[*draw.coefficients.values()] for draw in some],
            "first_seed": seed + first,
        }
        for first, some in parts
    ]


def do_draws(job: dict[str, Any]) -> dict[str, Any]:
    """Manoeuvres, course stability and episodes of some draws."""
    model = ShipModel.from_dict(job["model"])
    draws = [
        replace(
            model,
            name=name,
            coefficients=dict(zip(model.coefficients, values, strict=True)),
        )
        for name, values in zip(job["names"], job["coefficients"], strict=True)
    ]
    seeds = job["first_seed"] + np.arange(len(draws))
    controllers = [
        read_controller(content, "controller") for content in job["controllers"]
    ]
    return {
        "sailed": index_uncertainty.sail_draws(model, draws),
        "course_unstable": np.array([not keeps_course(draw) for draw in draws]),
        "episodes": [
            asdict(sail(controller, draws, seeds=seeds)) for controller in controllers
        ],
    }


def keeps_course(model: ShipModel) -> bool:
    """Whether the ship keeps a straight course with the rudder fixed; not if there is none at all."""
    try:
        return is_course_stable(model)
    except InputError:
        return False
