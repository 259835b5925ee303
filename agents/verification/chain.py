"""From recorded trials to a model, its certainty, verified autopilots and a report."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.agent_file import load_agent
from agents.controllers.controller import Controller
from agents.controllers.interface import check_fits
from agents.controllers.registry import controller_class, controller_kinds
from agents.identifying import identification_settings, trials_of
from agents.output import whole_folder
from agents.verification.refusal import (
    refused_designs,
    simpler_structures,
    why_refused,
)
from agents.verification.result import AutopilotResult, Pilot, Verification
from agents.verification.tracks import Track
from agents.verification.verify import DESIGNS, verify
from identification import IdentificationResult, identify
from identification.judging.warnings import why_unstable
from identification.progress import PROGRESS, Progress
from shipgym.checks import check_number, placed, quoted
from shipgym.errors import InputError, UnstableModelError
from shipgym.files import write_json
from shipgym.manoeuvres.criteria import with_measured
from shipgym.manoeuvres.measured import measured_by
from shipgym.manoeuvres.quantiles import DRAWS
from shipgym.models import ShipModel
from shipgym.plots import graph_objects
from shipgym.tasks.task import course_keeping_task
from shipgym.trials.ship_file import ShipFile

if TYPE_CHECKING:
    from agents.agent_file import Agent


FILES = ("report.html", "metrics.json", "model.json")  # beside those of the autopilots


def build_autopilot(
    ship_file: str | Path,
    out: str | Path,
    *,
    draws: int = DRAWS,
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    agents: Sequence[str | Path] = (),
    designs: Sequence[str] = DESIGNS,
    progress: Progress | None = None,
) -> AutopilotResult:
    """Identify a ship from trials, design and verify autopilots, write the report.

    The folder holds `report.html`, `metrics.json`, `model.json` and a file of each
    autopilot, such as `lq.json`; where the model is unstable or refused only the first
    two, and no file of an autopilot that is refused. It is written whole or not at all.
    `ship_file`: the ship file (TOML) with its trials; `out`: folder of the results; an
    earlier report there is replaced, anything else is refused; `draws`: number of
    models drawn from the coefficient covariance, at least 2; `seed`: of the draws and
    of the episodes; `options`: of `identify`, by name, trials by file; those not given
    are the ship file's; `agents`: files of autopilots to verify beside those designed,
    or names of pretrained ones (`load_agent`); `designs`: kinds of controller to
    design, of which those that lead another one keep to a track; `progress`: called as
    the work goes on. Raises InputError for anything wrong with the files or
    arguments; nothing is written then.
    """
    check_number(draws, "draws", at_least=2)
    check_number(seed, "seed", at_least=0, at_most=2**32)
    for kind in designs:
        controller_class(kind, "autopilots")
    graph_objects()  # a missing extra is reported now, not after the work
    tell = progress or (lambda *_: None)
    files = (*FILES, *(f"{kind}.json" for kind in controller_kinds()))
    with whole_folder(Path(out), files) as draft:
        with stage(tell, "reading trials"):
            ship = ShipFile.load(ship_file)
            guests = [(str(agent), load_agent(agent)) for agent in agents]
            settings = identification_settings(ship, options or {})
            trials, arguments = trials_of(ship, settings)
        with stage(tell, "identifying"), placed(str(ship.path)):
            fit = identify(trials, **arguments)
        result = examined(
            ship,
            fit,
            guests,
            partial(
                verify,
                fit.model,
                int(draws),
                int(seed),
                tell,
                [guest for _, guest in guests],
                designs,
                fit.trials,
            ),
        )
        with stage(tell, "writing the report"):
            write_agents(result, draft)
            write_findings(result, draft)
    return result


@contextmanager
def stage(tell: Progress, name: str) -> Iterator[None]:
    """Work of one unit; `tell` hears of its beginning, its parts and its end."""
    tell(name, 0, 1)
    before = PROGRESS.set(tell)
    try:
        yield
    finally:
        PROGRESS.reset(before)
    tell(name, 1, 1)


def examined(
    ship: ShipFile,
    fit: IdentificationResult,
    guests: Sequence[tuple[str, Agent]],
    verified: Callable[[], Verification],
) -> AutopilotResult:
    """Result on an identified model: its verification, or why there is none.

    `guests`: further autopilots, each after its name.
    """

    def result(
        instability: str | None = None,
        found: Verification | None = None,
        refusal: str | None = None,
    ) -> AutopilotResult:
        return AutopilotResult(ship, fit.trials, fit, instability, found, refusal)

    instability = why_unstable(fit)
    if instability is not None:
        return result(instability)
    refusal = why_refused(fit)
    if refusal is not None:
        return result(refusal=refusal)
    check_guests(guests, fit.model)
    try:
        found = verified()
    except (UnstableModelError, InputError) as error:
        # the user's input was right, the model is not
        return result(str(error))

    found = _measured(found, fit)
    refusals = refused_designs(found, fit)
    refused = {**found.refused, **refusals.by_design}
    of_all = refusals.of_all
    ranking = fit.metrics.get("selection", {}).get("ranking", ())
    simpler = simpler_structures(ranking, fit.model.structure)
    if of_all is not None and simpler:
        of_all += f"; or choose a simpler structure, {quoted(simpler)}"
    return result(None, replace(found, refused=refused), of_all)


def _measured(found: Verification, fit: IdentificationResult) -> Verification:
    """A verification with what the trials measured."""
    measured = measured_by(fit.model, fit.trials, fit.predictions)
    return replace(found, criteria=with_measured(found.criteria, measured))


def check_guests(guests: Sequence[tuple[str, Agent]], model: ShipModel) -> None:
    """Refuse guests, each after its name, that do not keep this ship's course."""
    for name, guest in guests:
        check_guest(guest, model, f"agent '{name}'")


def check_guest(guest: Agent, model: ShipModel, where: str) -> None:
    """Refuse a guest that was not made for keeping this ship's course."""
    task = course_keeping_task()
    shown = [one.name for one in task.observed(model)]
    unknown = [name for name in guest.observation_names if name not in shown]
    if unknown:
        raise InputError(
            f"{where}: expected an agent for course keeping, as shipgym train ppo"
            f" makes, got one that observes {quoted(unknown)}; for paths there is"
            " shipgym benchmark"
        )
    check_fits(guest, task, model, where)


def write_agents(result: AutopilotResult, folder: Path) -> None:
    """Write the model, and the autopilots that are not refused."""
    found = result.verification
    if found is None:
        return
    result.model.save(folder / "model.json")
    autopilots: list[Pilot | Track] = [*found.pilots, *found.tracks]
    for autopilot in autopilots:
        key = autopilot.key
        agent = autopilot.controller
        if isinstance(agent, Controller) and key not in found.refused:
            agent.save(folder / f"{key}.json")


def write_findings(result: AutopilotResult, folder: Path) -> None:
    """Write figures and report."""
    from agents.verification.page import write_report

    write_json(result.metrics, folder / "metrics.json")
    write_report(result, folder / "report.html")
