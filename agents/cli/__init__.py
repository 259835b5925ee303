"""The command `shipgym`: each subcommand imports what it needs when it is called.

Exit codes: 0 done; 1 the work ran and failed its check; 2 wrong input or usage, with
one message on standard error and nothing written; 130 interrupted.
"""

from __future__ import annotations

import os
import sys
import tomllib
import warnings
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from agents.cli import command
from agents.cli.benchmark import benchmark_command
from agents.cli.command import FAILED, answered, fail
from agents.cli.export import export_command
from agents.cli.identification import advise_command, identify_command, reduce_command
from agents.cli.identify_options import with_identify_options
from agents.cli.logs import look_command, new_ship_command
from agents.cli.reproduction import reproduce_command
from agents.cli.steer import simulate_command, steer_command
from agents.cli.training import train_command, tune_command
from agents.cli.warm import warm_command

if TYPE_CHECKING:
    from agents.cli.standard_trials import StandardTrials
    from agents.verification.result import AutopilotResult

app = typer.Typer(
    cls=command.Commands,
    epilog=(
        "Example: shipgym new-ship zigzag.csv, then shipgym autopilot ship.toml --out"
        " report/"
    ),
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        import shipgym

        typer.echo(f"shipgym {shipgym.__version__}")
        raise typer.Exit


@app.callback()
def shipgym_command(
    version: Annotated[
        bool,
        Option(
            "--version",
            callback=_version,
            is_eager=True,
            help="Print the version and exit.",
        ),
    ] = False,
) -> None:
    """From recorded ship trials to an identified model, its uncertainty and verified autopilots."""


@answered
def trials_command(
    model: Annotated[
        str,
        Argument(metavar="MODEL", help="A model file, or the name of a shipped model."),
    ],
    out: Annotated[
        Path | None, Option(metavar="PLOTS.HTML", help="Write figures to this file.")
    ] = None,
    draws: Annotated[
        int, Option(min=0, help="Models drawn from an identified model's covariance.")
    ] = 100,
    seed: Annotated[int, Option(min=0, help="Random seed of the draws.")] = 0,
    depth: Annotated[
        float | None, Option(metavar="M", help="Water depth, m; default: deep.")
    ] = None,
) -> None:
    """Simulate the standard manoeuvres of a model. Assesses them by the IMO criteria.

    Zigzags, turning circles, spirals, pull-outs, and, with a shaft, stops and an
    acceleration. The indices of an identified model come with their 95 % intervals.
    """
    from agents.cli.standard_trials import standard_trials
    from agents.cli.terminal import answer, progress_bars
    from agents.cli.trials_page import write_page
    from agents.output import check_page
    from shipgym.ships import load_model

    ship = load_model(model)
    water_depth = float("inf") if depth is None else depth
    ship.check_depth(water_depth)
    if out is not None:
        check_page(out, plots=True)
    with progress_bars() as progress:
        tell = (
            None
            if progress is None
            else (lambda done: progress("models drawn", done, draws))
        )
        found = standard_trials(ship, draws, seed, tell, water_depth)
    if out is not None:
        write_page(ship, found, out)
    answer({"model": ship.name, "seed": seed, **found.to_dict()})
    _print_trials(found, out)


def _print_trials(found: StandardTrials, page: Path | None) -> None:
    """Print tables of the standard manoeuvres, and where the page was written."""
    from agents.cli.terminal import (
        console,
        criteria_notes,
        criteria_table,
        manoeuvre_table,
        say,
        warn,
    )

    console.print(manoeuvre_table(found.indices, found.water))
    console.print()
    if found.criteria:
        console.print(criteria_table(found.criteria))
    else:
        console.print(
            "The IMO criteria are made for deep water: leave --depth out to assess"
            " them."
        )
    say(*criteria_notes(found.criteria))
    for name, reason in found.refused.items():
        warn(f"no {name}: {reason}")
    if page is not None:
        say(f"\nwritten: {page}")


@answered
@with_identify_options
def autopilot_command(
    ship: command.ShipFileArgument,
    out: Annotated[
        Path,
        Option(metavar="FOLDER", help="Folder for the report, model and autopilots."),
    ],
    draws: Annotated[
        int, Option(min=2, help="Models drawn from the coefficient covariance.")
    ] = 200,
    seed: Annotated[int, Option(min=0, help="Random seed of draws and episodes.")] = 0,
    *,
    options: dict[str, Any],
    agents: Annotated[
        list[str] | None,
        Option(
            "--agent",
            metavar="AGENT",
            help="Also run this autopilot, a file or a name; repeatable.",
        ),
    ] = None,
    autopilots: Annotated[
        str | None,
        Option(
            metavar="NAMES",
            help=(
                "Autopilots to design; default:"
                " pid,lq,lq-scheduled,turn-rate,wheel-over. "
                "Others: preview-mpc, lqg."
            ),
        ),
    ] = None,
    standards: Annotated[
        bool,
        Option(
            "--standards",
            help="Simulate topics of ISO 11674 and IEC 62065, with our own limits.",
        ),
    ] = False,
    engine: command.EngineName = "local",
    workers: command.Workers = 1,
    address: command.Address = None,
) -> None:
    """Go from trials to a report on autopilots. Identifies, predicts, designs, runs them on drawn models.

    Options not given here are taken from the ship file's table [identify]. Exits with 1
    if the identified model is unstable, or no autopilot designed on it can be trusted;
    the report then says why.
    """
    from agents.cli.terminal import progress_bars
    from agents.engines.jobs import JobEngine
    from agents.verification.chain import DESIGNS, build_autopilot

    designs = (
        DESIGNS
        if autopilots is None
        else [name.strip() for name in autopilots.split(",")]
    )
    with progress_bars() as progress:
        result = build_autopilot(
            ship,
            out,
            draws=draws,
            seed=seed,
            options=options,
            agents=agents or (),
            designs=designs,
            standards=standards,
            progress=progress,
            where=JobEngine(engine, workers, address),
        )
    _print_result(result, out / "report.html", draws)


def _print_result(result: AutopilotResult, report: Path, draws: int) -> None:
    """Print the result of the chain; fail for an unstable model, and where every design is refused."""
    from agents.cli import terminal
    from agents.cli.terminal import answer, console, say, warn
    from identification.validation.warnings import held_out_error, model_warnings

    answer({**result.metrics, "report": str(report)})
    if result.verification is not None:
        found = result.verification.manoeuvres
        say(held_out_error(result.identification))
        console.print(terminal.prediction_table(result.identification))
        console.print()
        console.print(terminal.criteria_table(found.criteria))
        say(*terminal.criteria_notes(found.criteria))
        console.print(f"\nunstable draws: {int(found.unstable.sum())} of {draws}\n")
        console.print(terminal.ranking_table(result))
        console.print()
        for row in result.verification.standards:
            if not row.passed:
                warn(
                    f"{row.standard}, {row.topic.lower()}: {row.value} {row.unit},"
                    f" limit {row.limit:g}"
                )
        for name, track in result.metrics["tracks"].items():
            console.print(
                f"{name.upper()} on the track: largest cross-track error"
                f" {track['cross_track_largest_m']:.1f} m, rms"
                f" {track['cross_track_rmse_m']:.1f} m\n"
            )
    if not result.stable:
        fail(
            f"the identified model is unstable: {result.instability}; see {report}",
            FAILED,
        )
    if result.refusal is not None:
        fail(f"no autopilot is given: {result.refusal}; see {report}", FAILED)
    for warning in model_warnings(result.identification):
        warn(warning)
    for name, reason in (
        result.verification.refused if result.verification else {}
    ).items():
        warn(f"no {name.upper()} autopilot: {reason}")
    say(f"report: {report}")


@answered
def replay_command(
    episodes: Annotated[
        list[Path],
        Argument(metavar="EPISODE.JSON", help="Episodes that RecordEpisode wrote."),
    ],
    out: Annotated[Path, Option(metavar="REPLAY.HTML", help="The page to write.")],
) -> None:
    """Replay recorded episodes in one HTML page. Chart, time slider, time histories; several overlaid."""
    from agents.cli.terminal import answer, say
    from agents.rollouts.replay_page import write_replay

    write_replay(episodes, out)
    answer({"written": str(out)})
    say(f"written: {out}")


@answered
def doctor_command() -> None:
    """Check the installation. Versions, cache, optional packages, the import name agents.

    Exits with 1 if something does not work.
    """
    from agents.cli.doctor import examine_installation
    from agents.cli.terminal import answer, say

    findings = examine_installation()
    answer({"findings": [vars(finding) for finding in findings]})
    say(*(finding.line() for finding in findings))
    if any(finding.state == "wrong" for finding in findings):
        raise typer.Exit(FAILED)


#: An example of each command, which stands below its help.
EXAMPLES = tomllib.loads(Path(__file__).with_name("examples.toml").read_text("utf-8"))
COMMANDS = (
    new_ship_command,
    look_command,
    identify_command,
    advise_command,
    reduce_command,
    trials_command,
    autopilot_command,
    export_command,
    steer_command,
    simulate_command,
    train_command,
    tune_command,
    benchmark_command,
    reproduce_command,
    warm_command,
    replay_command,
    doctor_command,
)

for name, function in zip(EXAMPLES, COMMANDS, strict=True):
    app.command(name, epilog=f"Example: shipgym {name} {EXAMPLES[name]}")(function)


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    from agents.cli.terminal import warn

    warn(str(message))


def main() -> None:
    """Run the command line."""
    if sys.stdout is None:
        sys.exit("error: standard output is closed")
    sys.stderr = sys.stderr or Path(os.devnull).open("w")  # noqa: SIM115 - until the end
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(
                errors="backslashreplace"
            )  # names of files may have any bytes
    warnings.showwarning = _show_warning  # names in it come from files
    try:
        app(prog_name="shipgym")
    except OSError as error:  # of the help, which no command answers for
        sys.exit(command.told_failure(error))
