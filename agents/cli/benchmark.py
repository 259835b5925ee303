"""The command `shipgym benchmark`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from agents.cli.command import (
    FAILED,
    INTERRUPTED,
    WRONG_INPUT,
    Address,
    EngineName,
    fail,
)

if TYPE_CHECKING:
    from agents.benchmarking.results import BenchmarkResult

Controllers = Annotated[
    str | None,
    Option(
        help=(
            "Who takes part, separated by commas: classical controllers (pid, lq, mpc,"
            " ...), tuned-pid, pretrained agents (ppo, sac), files of agents,"
            " module:function, name=...; default: all classical ones."
        )
    ),
]
Out = Annotated[
    Path | None,
    Option(
        metavar="FOLDER",
        help="Folder for results.json, episodes.parquet and index.html.",
    ),
]
Workers = Annotated[
    int | None, Option(min=1, help="Number of processes; default: one per core.")
]
Episodes = Annotated[
    int,
    Option(min=1, max=100, help="Number of episodes of each task, for a quick look."),
]
Resume = Annotated[
    bool, Option("--resume", help="Continue in a folder with results or parts of them.")
]
Page = Annotated[
    bool,
    Option(
        "--page/--no-page", help="Write index.html, with the worst episodes to replay."
    ),
]
Results = Annotated[
    Path | None,
    Option(
        metavar="RESULTS",
        help=(
            "Instead, repeat a sample of these results, or of a submission, and"
            " compare."
        ),
    ),
]
Submit = Annotated[
    Path | None,
    Option(
        metavar="FILE",
        help="Also write the last contestant's costs as a submission, one JSON file.",
    ),
]
Tolerance = Annotated[
    float | None,
    Option(
        min=0.0,
        help="Relative difference in cost that --verify allows; default: see docs.",
    ),
]
AllowCode = Annotated[
    list[str] | None,
    Option(
        metavar="MODULE:FUNCTION",
        help="Code named in results that --verify may run; repeatable.",
    ),
]


def benchmark_command(
    controllers: Controllers = None,
    out: Out = None,
    suite: Annotated[str, Option(help="Name of the suite of tasks.")] = "shipgym-v1",
    tasks: Annotated[
        str | None, Option(help="Only these tasks, separated by commas.")
    ] = None,
    workers: Workers = None,
    engine: EngineName = "local",
    address: Address = None,
    resume: Resume = False,
    episodes: Episodes = 100,
    page: Page = True,
    submit: Submit = None,
    verify: Results = None,
    sample: Annotated[
        int | None, Option(min=1, help="Pairs that --verify runs; default: 8.")
    ] = None,
    tolerance: Tolerance = None,
    allow_code: AllowCode = None,
) -> None:
    """Rank controllers on the tasks of a suite. All run the same episodes.

    With --verify, exits with 1 if the repeated results differ from the file.
    """
    if verify is not None:
        _refuse(
            "--verify",
            {
                "--controllers": controllers,
                "--out": out,
                "--tasks": tasks,
                "--submit": submit,
            },
        )
        _verify(verify, sample, tolerance, workers, allow_code or [])
        return
    if allow_code or tolerance is not None or sample is not None:
        fail(
            "--allow-code, --sample and --tolerance are for --verify alone, leave"
            " them out",
            WRONG_INPUT,
        )
    from agents.benchmarking.page import PAGE, write_page
    from agents.benchmarking.run import benchmark
    from agents.benchmarking.submission import submit as write_submission
    from agents.cli.terminal import progress_bars, warn
    from agents.controllers.designs import CLASSICAL
    from agents.output import check_file
    from shipgym.errors import InputError

    if submit is not None:  # which is of all episodes of all tasks
        _refuse("--submit", {"--tasks": tasks, "--episodes": episodes < 100})
        check_file(submit)
    if out is None:
        fail(
            "--out: no folder found, expected one for the results: --out results/",
            WRONG_INPUT,
        )
    try:
        with progress_bars() as progress:
            result = benchmark(
                controllers if controllers is not None else CLASSICAL,
                suite,
                None if tasks is None else tasks.split(","),
                out,
                workers,
                engine,
                progress,
                address=address,
                resume=resume,
                episodes=episodes,
            )
            if submit is not None:
                write_submission(
                    result, list(result.summary["contestants"])[-1], submit
                )
            (out / PAGE).unlink(
                missing_ok=True
            )  # of other results, where these were gone on with
            if page:
                try:
                    write_page(result, out / PAGE, workers=workers, progress=progress)
                except InputError as error:  # the results are there even without plotly
                    warn(f"there is no {PAGE}: {error}")
    except KeyboardInterrupt:
        fail(
            f"interrupted; what was done is kept in {out}: continue with --resume",
            INTERRUPTED,
        )
    _print_result(result, out)


def _refuse(beside: str, options: dict[str, Any]) -> None:
    """Refuse options, by name, that are of no use beside another one."""
    if given := [name for name, value in options.items() if value]:
        fail(
            f"{given[0]}: found together with {beside}, which has no use for it; leave"
            " one out",
            WRONG_INPUT,
        )


def _print_result(result: BenchmarkResult, out: Path) -> None:
    """Print the ranking, or all of the summary."""
    from agents.cli.benchmark_tables import costs_table, ranking_table
    from agents.cli.terminal import answer, console, say, warn

    answer(result.summary)
    console.print(ranking_table(result))
    console.print()
    console.print(costs_table(result))
    say(f"\nwritten: {out}")
    for failure in result.failures:
        warn(failure)
    if (count := result.summary["seeds"]["count"]) < 100:
        warn(f"{count} of 100 episodes: for a quick look, not for a ranking")


def _verify(
    path: Path,
    sample: int | None,
    tolerance: float | None,
    workers: int | None,
    allow_code: list[str],
) -> None:
    """Print what was compared; fail where it differs."""
    from agents.benchmarking.verification import N_SAMPLED, verify
    from agents.cli.benchmark_tables import verification_table
    from agents.cli.terminal import answer, console, err

    with err.status("running a sample again"):
        count = sample or N_SAMPLED
        checks = verify(
            path,
            sample=count,
            tolerance=tolerance,
            workers=workers,
            allow_code=allow_code,
        )
    answer({"checks": [check.to_dict() for check in checks]})
    console.print(verification_table(checks))
    wrong = [
        f"{check.contestant} on {check.task}" for check in checks if not check.passed
    ]
    if wrong:
        fail(
            f"{path}: {len(wrong)} of {len(checks)} differ: {'; '.join(wrong)}", FAILED
        )
