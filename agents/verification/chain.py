"""The whole chain: recorded trials in; a model, its certainty, verified autopilots and a report out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.agent_file import load_agent
from agents.controllers.controller import Controller
from agents.controllers.registry import controller_class, controller_kinds
from agents.identifying import identification_settings, trials_of
from agents.jobs import HERE, EngineError, JobEngine
from agents.output import whole_folder
from agents.rollouts.course_keeping import sail, step_response
from agents.rollouts.rollout import check_fits
from agents.verification.monte_carlo import monte_carlo
from agents.verification.refusal import (
    helpful_trial,
    lost_control,
    simpler_structures,
    why_refused,
)
from agents.verification.result import STEP_DEG, AutopilotResult, Pilot, Verification
from agents.verification.tracks import Track, keep_track, track_task
from identification import IdentificationResult, identify
from identification.progress import PROGRESS, Progress
from identification.validation.warnings import why_unstable
from shipgym.checks import check_number, placed, quoted
from shipgym.errors import InputError, UnstableModelError
from shipgym.files import write_json
from shipgym.manoeuvres.imo import with_measured
from shipgym.plots import graph_objects
from shipgym.ships import ShipModel
from shipgym.ships.linear import nomoto
from shipgym.tasks.task import course_keeping_task
from shipgym.trials.ship_file import ShipFile

if TYPE_CHECKING:
    from agents.agent_file import Agent


FILES = ("report.html", "metrics.json", "model.json")  # beside those of the autopilots
DESIGNS = ("pid", "lq", "turn-rate", "wheel-over")
LARGEST_SEED = 2**32


def build_autopilot(
    ship_file: str | Path,
    out: str | Path,
    *,
    draws: int = 200,
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    agents: Sequence[str | Path] = (),
    designs: Sequence[str] = DESIGNS,
    standards: bool = False,
    progress: Progress | None = None,
    where: JobEngine = HERE,
) -> AutopilotResult:
    """Identify a ship from its trials, design autopilots, verify them, write the report.

    The folder holds `report.html`, `metrics.json`, `model.json` and a file of each
    autopilot, such as `lq.json`; where the model is unstable or refused only the first
    two, and no file of an autopilot that is refused. It is written whole or not at all.
    `ship_file`: the ship file (TOML) with its trials; `out`: folder of the results; an
    earlier report there is replaced, anything else is refused; `draws`: number of
    models drawn from the coefficient covariance, at least 2; `seed`: of the draws and
    of the episodes; `options`: of `identify`, by name, trials by file; those not given
    are the ship file's; `agents`: files of autopilots to verify beside those designed,
    or names of pretrained ones (`load_agent`); `designs`: kinds of controller to
    design, of which those that lead another one keep to a track; `standards`: whether
    to simulate what the standards of heading and track control ask for; `progress`:
    called as the work goes on; `where`: where the models drawn are worked on; the
    results are the same. Raises InputError for anything wrong with the files or
    arguments; nothing is written then.
    """
    check_number(draws, "draws", at_least=2)
    check_number(seed, "seed", at_least=0, at_most=LARGEST_SEED)
    for kind in designs:
        controller_class(kind, "autopilots")
    graph_objects()  # a missing extra is reported now, not after the work
    tell = progress or (lambda *_: None)
    with whole_folder(
        Path(out), (*FILES, *(f"{kind}.json" for kind in controller_kinds()))
    ) as draft:
        with _stage(tell, "reading trials"):
            ship = ShipFile.load(ship_file)
            guests = [(f"agent '{agent}'", load_agent(agent)) for agent in agents]
            trials, arguments = trials_of(
                ship, identification_settings(ship, options or {})
            )
        with _stage(tell, "identifying"), placed(str(ship.path)):
            fit = identify(trials, **arguments)
        others = [one for _, one in guests]
        verified = partial(
            verify, fit.model, int(draws), int(seed), tell, where, others, designs
        )
        result = examined(ship, fit, guests, verified)
        found = result.verification
        if standards and found is not None and result.refusal is None:
            with _stage(tell, "standards"):
                result = replace(result, verification=_to_standards(found, fit.model))
        with _stage(tell, "writing the report"):
            _write(result, draft)
    return result


@contextmanager
def _stage(tell: Progress, name: str) -> Iterator[None]:
    """Work of one unit, told when it begins and when it is done, and so are its parts."""
    tell(name, 0, 1)
    before = PROGRESS.set(tell)
    try:
        yield
    finally:
        PROGRESS.reset(before)
    tell(name, 1, 1)


def _write(result: AutopilotResult, folder: Path) -> None:
    from agents.verification.page import write_report

    write_json(result.metrics, folder / "metrics.json")
    if (found := result.verification) is not None:
        result.model.save(folder / "model.json")
        designed = {
            one.key: one.controller for one in found.pilots if one.design is not None
        }
        for key, controller in (
            designed | {one.key: one.controller for one in found.tracks}
        ).items():
            if isinstance(controller, Controller) and key not in found.refused:
                controller.save(folder / f"{key}.json")
    write_report(result, folder / "report.html")


def examined(
    ship: ShipFile,
    fit: IdentificationResult,
    guests: list[tuple[str, Agent]],
    verified: Callable[[], Verification],
) -> AutopilotResult:
    """What is found on an identified model: its verification, or why there is none."""
    instability = why_unstable(fit)
    refusal = why_refused(fit) if instability is None else None
    if instability is not None or refusal is not None:
        return AutopilotResult(ship, fit.trials, fit, instability, None, refusal)
    for where, guest in guests:
        _check_fits(guest, fit.model, where)
    try:
        found = verified()
    except EngineError:
        raise
    except (
        UnstableModelError,
        InputError,
    ) as error:  # the user's input was right, the model is not
        return AutopilotResult(ship, fit.trials, fit, str(error), None)
    return AutopilotResult(ship, fit.trials, fit, None, *_decided(found, fit))


def _decided(
    found: Verification, fit: IdentificationResult
) -> tuple[Verification, str | None]:
    """A verification with what the trials measured, and why no design is given, if none is."""
    criteria = with_measured(found.manoeuvres.criteria, fit.model, fit.trials)
    found = replace(found, manoeuvres=replace(found.manoeuvres, criteria=criteria))
    designed = [pilot for pilot in found.pilots if pilot.design is not None]
    lost = {
        pilot.key: why
        for pilot in designed
        if (why := lost_control(pilot.episodes.terminated))
    }
    if not lost:
        return found, None
    ranking = fit.metrics.get("selection", {}).get("ranking", ())
    simpler = simpler_structures(
        ranking, (fit.model.provenance or {}).get("structure", "")
    )
    remedy = helpful_trial(fit) + (
        f", or try --structure {' or '.join(simpler)}" if simpler else ""
    )
    refused = {
        **found.refused,
        **{key: f"{why}; run {remedy}" for key, why in lost.items()},
    }
    refusal = None
    if len(lost) == len(designed):
        refusal = (
            f"{', '.join(key.upper() for key in lost)}: {lost[designed[0].key]}; run"
            f" {remedy}"
        )
        refused |= {
            track.key: "what steers on its course loses control"
            for track in found.tracks
        }
    return replace(found, refused=refused), refusal


def _to_standards(found: Verification, model: ShipModel) -> Verification:
    """A verification with what the standards ask of its best heading and its first path autopilot."""
    from agents.verification.standards import standards

    best = next(
        one.design
        for one in found.pilots
        if one.design is not None and one.key not in found.refused
    )
    tracks = [track for track in found.tracks if track.key not in found.refused]
    return replace(found, standards=tuple(standards(model, best, tracks)))


def verify(
    model: ShipModel,
    draws: int,
    seed: int,
    tell: Progress = lambda *_: None,
    where: JobEngine = HERE,
    guests: Sequence[Agent] = (),
    designs: Sequence[str] = DESIGNS,
) -> Verification:
    """Design autopilots on a model and run them, and guests, over models drawn from its covariance.

    `model`: with a covariance; `draws`, `seed`, `where`, `designs`: see
    `build_autopilot`; `tell`: told the progress; `guests`: further autopilots. Raises
    UnstableModelError if the model itself runs away; InputError if no autopilot can be
    designed on it.
    """
    tell("models drawn", 0, draws)
    controllers, guides, refused = _designed(model, designs)
    found = monte_carlo(
        controllers,
        model,
        draws,
        seed,
        where=where,
        progress=lambda done: tell("models drawn", done, draws),
    )
    seeds = seed + np.arange(draws)
    episodes = [
        *found.episodes,
        *(sail(guest, found.draws, seeds=seeds) for guest in guests),
    ]
    stable = [
        draw
        for draw, lost in zip(found.draws, found.manoeuvres.unstable, strict=True)
        if not lost
    ]
    pilots, autopilots = [], [*controllers, *guests]
    keys = _unique_keys([str(one.name) for one in autopilots])
    for k, controller in enumerate(autopilots):
        tell("step responses", k, len(autopilots))
        step = step_response(controller, [model, *stable], STEP_DEG)
        pilots.append(Pilot(keys[k], controller, episodes[k], step))
    tell("step responses", len(autopilots), len(autopilots))
    tracks = _tracks(guides, [model, *stable], refused)
    ranked = tuple(
        sorted(pilots, key=lambda pilot: float(np.mean(pilot.episodes.cost)))
    )
    linear, unstable = nomoto(model), found.course_unstable
    return Verification(
        draws, seed, found.manoeuvres, unstable, linear, ranked, refused, tracks
    )


def _tracks(
    guides: list[Controller], models: list[ShipModel], refused: dict[str, str]
) -> tuple[Track, ...]:
    """The track of each path autopilot; one that does not arrive on the identified model is refused."""
    tracks = tuple(keep_track(guide, models) for guide in guides)
    late = "it does not reach the end of the track on the identified model"
    refused |= {track.key: late for track in tracks if not track.arrived[0]}
    return tracks


def _check_fits(guest: Agent, model: ShipModel, where: str) -> None:
    """Refuse a guest that was not made for keeping this ship's course."""
    task = course_keeping_task()
    names = [one.name for one in task.observed(model)]
    if more := [name for name in guest.observation_names if name not in names]:
        raise InputError(
            f"{where}: it observes {quoted(more)}, which course keeping does not show;"
            " expected an agent for course keeping; for paths there is shipgym"
            " benchmark"
        )
    check_fits(guest, task, model, where)


def _unique_keys(names: Sequence[str]) -> list[str]:
    """Names, those that were there before with a number."""
    earlier = [names[:k].count(name) for k, name in enumerate(names)]
    return [
        f"{name}-{k + 1}" if k else name for name, k in zip(names, earlier, strict=True)
    ]


def _designed(
    model: ShipModel, designs: Sequence[str]
) -> tuple[list[Controller], list[Controller], dict[str, str]]:
    """Autopilots that keep a heading, those that keep a track, and why others could not be designed.

    Raises InputError if none that keeps a heading could.
    """
    controllers: list[Controller] = []
    guides: list[Controller] = []
    refused: dict[str, str] = {}
    for kind in dict.fromkeys(designs):
        made: Any = controller_class(kind)
        try:
            if made.has_autopilot:
                guides.append(made.from_model(model, task=track_task(model)))
            else:
                controllers.append(made.from_model(model))
        except InputError as error:  # this design does not suit the ship; another may
            refused[kind] = str(error)
    if not controllers:
        raise InputError(
            "no autopilot that keeps a heading could be designed on it: "
            + (
                "; ".join(refused.values())
                or f"{quoted(designs)} found, expected one such as 'lq'"
            )
        )
    return controllers, guides, refused
