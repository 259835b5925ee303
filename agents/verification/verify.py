"""Autopilots designed on a model, and run over models drawn from its covariance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.registry import controller_class
from agents.rollouts.course_keeping import Episodes, step_response
from agents.verification.closed_loop import ClosedLoop, lost_tracks
from agents.verification.result import STEP_DEG, Pilot, Verification
from agents.verification.tracks import track_task
from identification.progress import counted
from shipgym.arrays import Flags
from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.manoeuvres.criteria import Criterion
from shipgym.manoeuvres.imo import assess_draws
from shipgym.manoeuvres.quantiles import upper_95
from shipgym.models import ShipModel
from shipgym.models.linear import is_course_stable, nomoto
from shipgym.trials.trial import Trial

DESIGNS = ("pid", "lq", "preview-lq")


def verify(
    model: ShipModel,
    draws: int,
    seed: int,
    designs: Sequence[str] = DESIGNS,
    trials: Sequence[Trial] = (),
) -> Verification:
    """Design autopilots on a model and run them over models drawn from its covariance.

    `model`: with a covariance;
    `draws`, `seed`, `designs`: see `build_autopilot`; `trials`: that the ship was put
    through: a model drawn that runs away in one of them does not count. Raises
    InputError if no autopilot can be designed on it.
    """
    designed = design_autopilots(model, designs)
    loop = ClosedLoop(
        model=model,
        draws=model.sample(draws, seed),
        seeds=seed + np.arange(draws),
        trials=trials,
    )
    criteria = _assessed(loop)
    unstable = ran_away(criteria)
    stable = [loop.draws[number] for number in np.flatnonzero(~unstable).tolist()]

    tracks = [loop.led(guide) for guide in designed.guides]
    for track in tracks:
        loop.look_at(lost_tracks(track))
    steered = sailed(loop, designed.controllers)
    pilots = []
    for autopilot, episodes in counted("step responses", steered):
        step = step_response(autopilot, [model, *stable], STEP_DEG)
        pilots.append(Pilot(autopilot.kind, autopilot, episodes, step))
    return Verification(
        draws=draws,
        seed=seed,
        criteria=criteria,
        unstable=unstable,
        course_unstable=np.array([not keeps_course(draw) for draw in loop.draws]),
        nomoto=nomoto(model),
        pilots=tuple(sorted(pilots, key=partial(_rank, counted=loop.counted))),
        refused=designed.refused,
        tracks=tuple(loop.of_counted(track) for track in tracks),
        counted=loop.counted,
    )


def _assessed(loop: ClosedLoop) -> dict[str, Criterion]:
    """Criteria that the models can be held against."""
    found = assess_draws(loop.model, counted("models drawn", loop.draws))
    return {name: one for name, one in found.items() if one.drawn is not None}


def ran_away(criteria: Mapping[str, Criterion]) -> Flags:
    """Draws that run away in a manoeuvre of the criteria."""
    drawn = [one.drawn.ran_away for one in criteria.values() if one.drawn is not None]
    return np.asarray(np.any(drawn, axis=0))


def sailed(
    loop: ClosedLoop, designed: Sequence[Controller]
) -> list[tuple[Controller, Episodes]]:
    """Autopilots with their episodes, by which draws count or do not."""
    found = []
    for pilot in designed:
        episodes = loop.sail(pilot)
        loop.look_at(episodes.terminated)
        found.append((pilot, episodes))
    return found


def keeps_course(model: ShipModel) -> bool:
    """Return True if a ship keeps a straight course with the rudder fixed."""
    try:
        return is_course_stable(model)
    except InputError:
        return False


def _rank(pilot: Pilot, counted: Flags) -> tuple[float, ...]:
    """Models lost, then the median and the 95 % quantile of the cost.

    A mean would be decided by one model that is lost.
    """
    episodes = pilot.episodes
    lost = float(np.sum(episodes.terminated[counted]))
    return lost, float(np.median(episodes.cost)), upper_95(episodes.cost)


@dataclass(frozen=True, eq=False)
class Designed:
    """Autopilots designed on a model."""

    controllers: list[Controller] = field(default_factory=list)  # keep a heading
    guides: list[Controller] = field(default_factory=list)  # keep a track
    #: why others could not be designed, by their kind
    refused: dict[str, str] = field(default_factory=dict)


def design_autopilots(model: ShipModel, designs: Sequence[str]) -> Designed:
    """Autopilots of some kinds; InputError if none of them keeps a heading."""
    found = Designed()
    for kind in dict.fromkeys(designs):
        made: Any = controller_class(kind)
        try:
            task = {"task": track_task(model)} if made.has_autopilot else {}
            controller = made.from_model(model, **task)
            group = found.guides if made.has_autopilot else found.controllers
            group.append(controller)
        except InputError as error:  # this design does not suit the ship; another may
            found.refused[kind] = str(error)
    if not found.controllers:
        why = "; ".join(found.refused.values())
        if not why:
            why = f"expected a design such as 'lq', got {quoted(designs)}"
        raise InputError(
            f"no autopilot that keeps a heading could be designed on it: {why}"
        )
    return found
