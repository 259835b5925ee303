"""`shipgym autopilot`: the whole chain, from trials to tested autopilots."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from agents.cli.command import (
    FAILED,
    ShipFileArgument,
    fail,
    interrupted,
)
from agents.cli.identify_options import with_identify_options
from agents.cli.terminal import answer, console, progress_bars, say, warn
from shipgym.manoeuvres.quantiles import DRAWS

if TYPE_CHECKING:
    from agents.verification.result import AutopilotResult, Verification
    from identification import IdentificationResult


@with_identify_options
def autopilot_command(
    ship: ShipFileArgument,
    out: Annotated[
        Path,
        Option(metavar="FOLDER", help="Folder for the report, model and autopilots."),
    ],
    draws: Annotated[
        int, Option(min=2, help="Models drawn from the coefficient covariance.")
    ] = DRAWS,
    seed: Annotated[int, Option(min=0, help="Random seed of draws and episodes.")] = 0,
    *,
    options: dict[str, Any],
    autopilots: Annotated[
        str,
        Option(
            metavar="NAMES",
            help="Autopilots to design. Others: lqg, wheel-over, mpc.",
        ),
    ] = "pid,lq,preview-lq",
) -> None:
    """Go from trials to a report on autopilots.

    Identifies a model, predicts manoeuvres, designs autopilots, and runs them on models
    drawn from it.

    Options not given here are taken from the ship file's table [identify]. Exits with 1
    if the identified model is unstable, or no autopilot designed on it can be trusted;
    the report then says why.
    """
    from agents.output import present
    from agents.verification.chain import build_autopilot

    designs = [name.strip() for name in autopilots.split(",")]
    try:
        with progress_bars():
            result = build_autopilot(
                ship,
                out,
                draws=draws,
                seed=seed,
                options=options,
                designs=designs,
            )
    except KeyboardInterrupt:
        if not out.is_dir() or present(out) != ["model.json"]:
            raise
        interrupted(f"the model is identified, and kept in {out}; begin again with")
    print_autopilot(result, out / "report.html", draws)


def _simpler_structures(found: IdentificationResult) -> str:
    """Hint at the next two structures of fewer coefficients, where `auto` chose."""
    if "selection" not in found.metrics:
        return ""
    chosen, *others = found.metrics["selection"]["ranking"]
    fewer = [
        one["structure"]
        for one in others
        if one["stable"] and one["coefficients"] < chosen["coefficients"]
    ]
    return f", or give --structure {' or '.join(fewer[:2])}" if fewer else ""


def print_autopilot(result: AutopilotResult, report: Path, draws: int) -> None:
    """Print the result; fail for an unstable model or if all designs are refused."""
    from identification.judging.warnings import model_warnings

    answer({**result.metrics, "report": str(report)})
    if result.verification is not None:
        _print_verification(result, result.verification, draws)
    if not result.stable:
        fail(
            f"the identified model is unstable: {result.instability}; see {report}",
            FAILED,
        )
    if result.refusal is not None:
        reason = result.refusal + _simpler_structures(result.identification)
        fail(
            f"no autopilot is given: {reason}; see {report}",
            FAILED,
        )

    for warning in model_warnings(result.identification):
        warn(warning)
    found = result.verification
    if found is not None:
        for name, reason in found.refused.items():
            warn(f"no {name.upper()} autopilot: {reason}")
        if found.run_next:
            say(f"run next: {found.run_next}")
    say(f"report: {report}")


def _print_verification(
    result: AutopilotResult, verification: Verification, draws: int
) -> None:
    """Print predictions, criteria, ranking and tracks."""
    from agents.cli import tables
    from identification.judging.warnings import held_out_error

    identification = result.identification
    criteria = verification.criteria
    say(held_out_error(identification))
    console.print(tables.prediction_table(identification))
    console.print()
    console.print(tables.criteria_table(criteria))
    say(*tables.criteria_notes(criteria))
    console.print(f"\nunstable draws: {int(verification.unstable.sum())} of {draws}\n")
    console.print(tables.ranking_table(result))
    say(f"indices and margins are {identification.model.steering.remark}", "")
    for name, track in result.metrics["tracks"].items():
        if name in verification.refused:
            continue
        console.print(
            f"{name.upper()} on the track: largest cross-track error"
            f" {track['cross_track_largest_m']:.1f} m, rms"
            f" {track['cross_track_rmse_m']:.1f} m\n"
        )
