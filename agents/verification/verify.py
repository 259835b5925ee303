"""Autopilots designed on a model, and run over models drawn from its covariance."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.registry import controller_class
from agents.rollouts.course_keeping import step_response
from agents.training.controller_space import searched_kinds
from agents.verification.closed_loop import ClosedLoop, Held, lost_tracks
from agents.verification.result import STEP_DEG, Pilot, Verification
from agents.verification.tracks import track_task
from agents.verification.tuned import Tuned, no_worse, tuned_design
from identification.progress import Progress
from shipgym.arrays import Flags
from shipgym.checks import quoted
from shipgym.errors import InputError
from shipgym.manoeuvres.imo import assess_draws
from shipgym.manoeuvres.quantiles import upper_95
from shipgym.models import ShipModel
from shipgym.models.linear import is_course_stable, nomoto
from shipgym.trials.trial import Trial

if TYPE_CHECKING:
    from agents.agent_file import Agent

DESIGNS = ("pid", "lq", "preview-lq")


def verify(
    model: ShipModel,
    draws: int,
    seed: int,
    tell: Progress = lambda *_: None,
    guests: Sequence[Agent] = (),
    designs: Sequence[str] = DESIGNS,
    trials: Sequence[Trial] = (),
    tune_seconds: float = 0.0,
) -> Verification:
    """Design autopilots on a model and run them over models drawn from its covariance.

    `model`: with a covariance;
    `draws`, `seed`, `designs`: see `build_autopilot`; `tell`: called with the
    progress; `guests`: further autopilots; `trials`: that the ship was put through: a
    model drawn that runs away in one of them does not count; `tune_seconds`: of
    processor for the settings of each design, 0 for none. Raises InputError if no
    autopilot can be designed on it.
    """
    tell("models drawn", 0, draws)
    designed = design_autopilots(model, designs, tune_seconds, tell)
    loop = ClosedLoop(
        model=model,
        draws=model.sample(draws, seed),
        seeds=seed + np.arange(draws),
        trials=trials,
    )
    criteria = assess_draws(
        model, loop.draws, lambda done: tell("models drawn", done, draws)
    )
    drawn = {name: one.drawn for name, one in criteria.items() if one.drawn is not None}
    unstable = np.any([one.ran_away for one in drawn.values()], axis=0)
    stable = [loop.draws[number] for number in np.flatnonzero(~unstable).tolist()]

    told: dict[str, str] = {}
    courses = [
        chosen(one, loop.sail, designed.tuned, told) for one in designed.controllers
    ]
    guides = [chosen(one, loop.led, designed.tuned, told) for one in designed.guides]
    for held in courses:
        loop.look_at(held.outcome.terminated)
    for held in guides:
        loop.look_at(lost_tracks(held.outcome))
    steered = [*courses, *[Held(guest, loop.sail(guest)) for guest in guests]]
    pilots = run_pilots(steered, [model, *stable], tell)
    return Verification(
        draws=draws,
        seed=seed,
        criteria={name: criteria[name] for name in drawn},
        unstable=unstable,
        course_unstable=np.array([not keeps_course(draw) for draw in loop.draws]),
        nomoto=nomoto(model),
        pilots=tuple(sorted(pilots, key=partial(_rank, counted=loop.counted))),
        refused=designed.refused,
        tracks=tuple(loop.of_counted(held.outcome) for held in guides),
        counted=loop.counted,
        tuned=told,
    )


def keeps_course(model: ShipModel) -> bool:
    """Return True if a ship keeps a straight course with the rudder fixed."""
    try:
        return is_course_stable(model)
    except InputError:
        return False


def chosen(
    controller: Controller,
    outcome_of: Callable[[Controller], Any],
    tuned: Mapping[str, Tuned],
    told: dict[str, str],
) -> Held:
    """A design with its outcome on the models drawn, or what a search found.

    `outcome_of`: episodes or track of a controller; `tuned`: what searches found, by
    kind; `told`: receives a sentence on each search.
    """
    designed = Held(controller, outcome_of(controller))
    search = tuned.get(controller.kind)
    if search is None:
        return designed
    other = Held(search.controller, outcome_of(search.controller))
    held, told[controller.kind] = no_worse(designed, other, search)
    return held


def run_pilots(
    steered: Sequence[Held],
    ships: Sequence[ShipModel],
    tell: Progress,
) -> list[Pilot]:
    """Autopilots with the episodes of each and its step responses on ships."""
    n = len(steered)
    keys = unique_keys([str(autopilot.name) for autopilot, _ in steered])
    pilots = []
    for i, (autopilot, episodes) in enumerate(steered):
        tell("step responses", i, n)
        step = step_response(autopilot, ships, STEP_DEG)
        pilots.append(Pilot(keys[i], autopilot, episodes, step))
    tell("step responses", n, n)
    return pilots


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
    #: what a search of settings found, by their kind
    tuned: dict[str, Tuned] = field(default_factory=dict)


def design_autopilots(
    model: ShipModel,
    designs: Sequence[str],
    tune_seconds: float = 0.0,
    tell: Progress = lambda *_: None,
) -> Designed:
    """Autopilots of some kinds; InputError if none of them keeps a heading.

    `tune_seconds`: of processor for the settings of each, 0 for none.
    """
    found = Designed()
    for kind in dict.fromkeys(designs):
        made: Any = controller_class(kind)
        try:
            task = {"task": track_task(model)} if made.has_autopilot else {}
            controller = made.from_model(model, **task)
            if tune_seconds > 0.0 and kind in searched_kinds():
                found.tuned[kind] = tuned_design(kind, model, tune_seconds, tell)
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


def unique_keys(names: Sequence[str]) -> list[str]:
    """Names, those that were there before with a number."""
    times: Counter[str] = Counter()
    keys = []
    for name in names:
        times[name] += 1
        number = times[name]
        keys.append(name if number == 1 else f"{name}-{number}")
    return keys
