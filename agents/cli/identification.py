"""Commands that identify: `identify`, `advise` and `reduce`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from agents.cli.command import FAILED, Out, ShipFileArgument, fail
from agents.cli.identify_options import with_identify_options
from agents.cli.terminal import answer, console, progress_bars, say, warn

if TYPE_CHECKING:
    from identification import IdentificationResult
    from shipgym.trials.ship_file import ShipFile

Report = Annotated[
    bool, Option("--report", help="Write report.html too, a page with the figures.")
]


@with_identify_options
def identify_command(
    ship: ShipFileArgument,
    out: Out,
    *,
    options: dict[str, Any],
    report: Report = False,
) -> None:
    """Identify a manoeuvring model from recorded trials.

    Writes the model, its metrics and the settings.

    Options not given here are taken from the ship file's table [identify]; if neither
    names a structure, the structure and method that best predict held-out trials are
    chosen.

    Exits with 1 if the identified model is unstable, or predicts nothing.
    """
    from agents.cli.tables import prediction_table, selection_table
    from agents.identifying import identify_ship
    from agents.output import whole_folder
    from identification.judging.warnings import (
        held_out_error,
        why_unstable,
        without_indices,
    )
    from identification.pipeline.result import FILES

    read, settings = _chosen(ship, options)
    with whole_folder(out, FILES) as draft, progress_bars("identifying"):
        result = identify_ship(read, settings)
        result.save(draft)
        if report:
            from identification.report.view import write_report

            write_report(result, draft)
        written = [name for name in FILES if (draft / name).exists()]
    instability = why_unstable(result)
    answer(
        {
            **result.metrics,
            "stable": instability is None,
            "model": str(out / "model.json"),
        }
    )
    if "selection" in result.metrics:
        console.print(selection_table(result.metrics["selection"]))
        for name, reason in result.metrics["selection"]["refused"].items():
            say(f"{name} was not fitted: {reason}")
        for name, share in result.metrics["selection"]["passed_over"].items():
            say(
                f"{name} was passed over: {share:.0%} of the ships drawn from it run"
                " away in a hard turn"
            )
    if instability is None:
        say(result.summary())
        console.print(prediction_table(result))
        say(*without_indices(result), held_out_error(result))
    say(f"\nwritten to {out}: {', '.join(written)}")
    _check_stable(result)


def _chosen(
    ship: Path, options: dict[str, Any], *unnamed: str
) -> tuple[ShipFile, dict[str, Any]]:
    """Read the ship file and the options, those of the command line first.

    `unnamed` is the structure if none is named.
    """
    from agents.identifying import identification_settings
    from shipgym.trials.ship_file import ShipFile

    read = ShipFile.load(ship)
    settings = identification_settings(read, options, *unnamed)
    return read, settings


def _check_stable(result: IdentificationResult) -> None:
    """Fail for an unstable model, else warn of what has to be known."""
    from identification.judging.warnings import (
        model_warnings,
        why_unstable,
        why_useless,
    )

    if (instability := why_unstable(result)) is not None:
        fail(
            f"the identified model is unstable: {instability}; it must not be used",
            FAILED,
        )
    if (fault := why_useless(result)) is not None:
        fail(f"no structure predicts this ship: {fault}", FAILED)
    notes = [f"{trial.name}: {note}" for trial in result.trials for note in trial.notes]
    for warning in [*notes, *model_warnings(result)]:
        warn(warning)


@with_identify_options
def advise_command(
    ship: ShipFileArgument,
    coefficient: Annotated[
        str | None,
        Option(help="To make certain; default: what matters most in a hard turn."),
    ] = None,
    number: Annotated[int, Option(min=1, help="Number of manoeuvres.")] = 3,
    *,
    options: dict[str, Any],
) -> None:
    """Show what the trials determine and what to run next.

    Prints by how much zigzags and turning circles, simulated
    on the model identified so far, would each reduce the error of a coefficient.
    """
    from agents.identifying import identify_ship
    from identification.design.experiment import advise

    read, settings = _chosen(ship, options, "abkowitz")
    with progress_bars("identifying"):
        result = identify_ship(read, settings)
        used = [trial for trial in result.trials if trial.use == "fit"]
        advice = advise(result.model, used, None, coefficient, number)
    answer(advice.to_dict())
    run_next = f"run next: {', then '.join(advice.chosen)}"
    say(
        str(advice),
        f"{run_next}; it makes {advice.coefficient} certain, and `shipgym trials` names"
        " the trials that decide criteria",
    )


@with_identify_options
def reduce_command(
    ship: ShipFileArgument,
    out: Out,
    tolerance: Annotated[
        float, Option(min=0.0, help="How far R2 on held-out stretches may fall.")
    ] = 1e-3,
    *,
    options: dict[str, Any],
) -> None:
    """Drop the terms that the trials do not support.

    Identifies the model with the remaining ones.

    Writes the reduced model's files and reduction.json, with all steps. Exits with 1 if
    the reduced model is unstable.
    """
    from agents.cli.tables import prediction_table
    from agents.identifying import reduce_ship
    from agents.output import whole_folder
    from identification.pipeline.result import FILES
    from shipgym.files import write_json

    read, settings = _chosen(ship, options, "abkowitz")
    with (
        whole_folder(out, (*FILES, "reduction.json")) as draft,
        progress_bars("reducing"),
    ):
        found = reduce_ship(read, settings, tolerance)
        fields = found.to_dict()
        found.reduced.save(draft)
        write_json(fields, draft / "reduction.json")
    answer(fields)
    for q, reduction in found.reductions.items():
        say(f"equation of {q}", str(reduction))
    console.print(prediction_table(found.full, "with all terms"))
    console.print(prediction_table(found.reduced, "with the terms left"))
    count = fields["terms"]
    console.print(
        f"\n{count['reduced']} of {count['full']} coefficients left; written to {out}"
    )
    _check_stable(found.reduced)
