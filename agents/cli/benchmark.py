"""The command `shipgym benchmark`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from agents.cli.command import (
    Address,
    AllowCode,
    EngineName,
    Out,
    interrupted,
)
from agents.cli.terminal import answer, console, progress_bars, say, warn

if TYPE_CHECKING:
    from agents.benchmarking.results import BenchmarkResult

#: What is compared where nothing is named.
BASELINES = "pid,lq,ilos,wheel-over,preview-lq"
Controllers = Annotated[
    str,
    Option(
        help=(
            "What is compared, separated by commas: classical controllers (pid, lq,"
            " mpc, ...), tuned-pid, the shipped agent (ppo), files of agents,"
            " my_file.py:function, module:function, name=..."
        )
    ),
]
Suite = Annotated[
    str, Option(help="Name of a suite of tasks, or the TOML file of your own.")
]
Tasks = Annotated[str | None, Option(help="Only these tasks, separated by commas.")]
Workers = Annotated[
    int | None, Option(min=1, help="Number of processes; default: one per core.")
]
Episodes = Annotated[
    int,
    Option(min=1, max=100, help="Number of episodes of each set, for a quick look."),
]
Seed = Annotated[int, Option(min=0, help="Which episodes are judged: others for each.")]
Runs = Annotated[
    int, Option(min=1, help="How often an entry that searches or learns is made.")
]
Resume = Annotated[
    bool, Option("--resume", help="Continue in a folder with results or parts of them.")
]


def benchmark_command(
    out: Out,
    controllers: Controllers = BASELINES,
    suite: Suite = "shipgym-v1",
    tasks: Tasks = None,
    workers: Workers = None,
    engine: EngineName = "local",
    address: Address = None,
    resume: Resume = False,
    episodes: Episodes = 100,
    seed: Seed = 0,
    runs: Runs = 1,
    allow_code: AllowCode = False,
) -> None:
    """Rank controllers on the tasks of a suite. All run the same episodes."""
    from agents.benchmarking.entries import names_code, read_entries
    from agents.benchmarking.page import write_page
    from agents.benchmarking.results import PARTS
    from agents.benchmarking.run import benchmark

    for given in controllers.split(","):
        source = given.rpartition("=")[2].strip()
        if names_code(source):
            warn(
                f"'{source}' runs as part of this command. This is not a sandbox: the"
                " code can read your files."
            )
    entries = read_entries(controllers)
    try:
        with progress_bars():
            result = benchmark(
                entries,
                suite,
                tasks,
                out,
                workers,
                engine,
                address=address,
                resume=resume,
                episodes=episodes,
                seed=seed,
                runs=runs,
                allow_code=allow_code,
            )
        write_page(result, out / "index.html")
    except KeyboardInterrupt:
        done = len(list((out / PARTS).glob("*.json")))
        if not done:
            raise
        interrupted(f"finished jobs kept in {out}: {done}; go on with", "--resume")
    _print_result(result, out)


def _print_result(result: BenchmarkResult, out: Path) -> None:
    """Print the ranking, or all of the summary."""
    from agents.cli.benchmark_tables import ranking_tables

    answer(result.summary)
    for table in ranking_tables(result):
        console.print(table)
        console.print()
    say(f"written: {out}")
    for failure in result.failures:
        warn(failure)
    count = result.summary["options"]["episodes"]
    if count < 100:
        warn(f"{count} of 100 episodes: for a quick look, not for a ranking")
