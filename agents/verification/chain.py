"""From recorded trials to a model, its certainty, verified autopilots and a report."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from agents.controllers.registry import controller_class, controller_kinds
from agents.identifying import identification_settings, identify_ship
from agents.output import present, whole_folder
from agents.verification.refusal import refused_designs, why_refused
from agents.verification.result import AutopilotResult, Pilot, Verification
from agents.verification.tracks import Track
from agents.verification.verify import DESIGNS, verify
from identification import IdentificationResult
from identification.judging.warnings import why_unstable
from identification.progress import PROGRESS
from shipgym.checks import check_number
from shipgym.errors import InputError, UnstableModelError
from shipgym.files import write_json
from shipgym.manoeuvres.criteria import trials_to_run, with_measured
from shipgym.manoeuvres.measured import measured_by
from shipgym.manoeuvres.quantiles import DRAWS
from shipgym.plots import graph_objects
from shipgym.trials.ship_file import ShipFile

FILES = ("report.html", "metrics.json", "model.json")  # beside those of the autopilots


def build_autopilot(
    ship_file: str | Path,
    out: str | Path,
    *,
    draws: int = DRAWS,
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    designs: Sequence[str] = DESIGNS,
) -> AutopilotResult:
    """Identify a ship from trials, design and verify autopilots, write the report.

    The folder holds `report.html`, `metrics.json`, `model.json` and a file of each
    autopilot, such as `lq.json`; where the model is unstable or refused only the first
    two, and no file of an autopilot that is refused. It is written whole or not at all;
    only the model is left in an empty folder by an interruption. `ship_file`: the ship
    file (TOML) with its trials; `out`: folder of the results; an earlier report there
    is replaced, anything else is refused; `draws`: number of models drawn from the
    coefficient covariance, at least 2; `seed`: of the draws and of the episodes;
    `options`: of `identify`, by name, trials by file; those not given are the ship
    file's; `designs`: kinds of controller to design, of which those that lead another
    one keep to a track. Raises InputError for anything wrong with the files or
    arguments; nothing is written then.
    """
    check_number(draws, "draws", at_least=2)
    check_number(seed, "seed", at_least=0, at_most=2**32)
    for kind in designs:
        controller_class(kind, "autopilots")
    graph_objects()  # a missing extra is reported now, not after the work
    files = (*FILES, *(f"{kind}.json" for kind in controller_kinds()))
    folder = Path(out)
    with whole_folder(folder, files) as draft:
        with stage("identifying"):
            ship = ShipFile.load(ship_file)
            settings = identification_settings(ship, options or {})
            fit = identify_ship(ship, settings)

        def verified() -> Verification:
            if not present(folder):  # an interruption leaves the model there
                fit.model.save(folder / "model.json")
            return verify(fit.model, int(draws), int(seed), designs, fit.trials)

        result = examined(ship, fit, verified)
        with stage("writing the report"):
            write_agents(result, draft)
            write_findings(result, draft)
    return result


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Work of one unit; `PROGRESS` hears of its beginning and its end."""
    tell = PROGRESS.get()
    tell(name, 0, 1)
    yield
    tell(name, 1, 1)


def examined(
    ship: ShipFile,
    fit: IdentificationResult,
    verified: Callable[[], Verification],
) -> AutopilotResult:
    """Result on an identified model: its verification, or why there is none."""
    instability = why_unstable(fit)
    if instability is not None:
        return AutopilotResult(ship, fit, instability)
    refusal = why_refused(fit)
    if refusal is not None:
        return AutopilotResult(ship, fit, refusal=refusal)
    try:
        found = verified()
    except (UnstableModelError, InputError) as error:
        # the user's input was right, the model is not
        return AutopilotResult(ship, fit, str(error))

    measured = measured_by(fit.model, fit.trials, fit.predictions)
    refusals = refused_designs(found, fit)
    found = replace(
        found,
        criteria=with_measured(found.criteria, measured),
        refused=found.refused | refusals.by_design,
    )
    if not refusals.of_all:
        run_next = refusals.run_next or trials_to_run(found.criteria)
        found = replace(found, run_next=run_next)
    return AutopilotResult(ship, fit, None, found, refusals.of_all)


def write_agents(result: AutopilotResult, folder: Path) -> None:
    """Write the model, and the autopilots that are not refused."""
    found = result.verification
    if found is None:
        return
    result.model.save(folder / "model.json")
    autopilots: list[Pilot | Track] = [
        *found.pilots,
        *found.tracks,
    ]
    for autopilot in autopilots:
        key = autopilot.key
        if key not in found.refused:
            autopilot.controller.save(folder / f"{key}.json")


def write_findings(result: AutopilotResult, folder: Path) -> None:
    """Write figures and report."""
    from agents.verification.page import write_report

    write_json(result.metrics, folder / "metrics.json")
    write_report(result, folder / "report.html")
