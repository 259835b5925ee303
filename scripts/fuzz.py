"""Read mutated files of every kind; each has to be read or refused in one message.

    python scripts/fuzz.py                              150,000 of each fast kind
    python scripts/fuzz.py --inputs 1000000             a million of each fast kind
    python scripts/fuzz.py --kind model --kind policy   some kinds
    python scripts/fuzz.py --time 600 --keep found      ten minutes; keep faulty files

Each input is a sound file of `tests/corpus` with one to five changes to its structure
or its bytes, which follow from `--seed`, the kind and the input's number alone. It is
read, and what was read is used. A fault is any exception but `InputError`, a warning, a
refusal that cannot be printed or fills pages, more than 2 s of processor time, more
than 1 GiB of memory, or the death of the process. Each is told once by its place, with
the fewest changes that bring it about; the exit code is 1 if there is any.

A new kind of file is a line in `KINDS` of `scripts/fuzzing/kinds.py` and a small file
in `tests/corpus/NAME`.
"""

from __future__ import annotations

import os

os.environ["NUMBA_DISABLE_JIT"] = (
    "1"  # equations of ships as plain Python: each structure would be compiled
)

import math
import sys
import time
from pathlib import Path
from typing import Annotated

import typer
from fuzzing.kinds import KINDS
from fuzzing.processes import chunks, run
from fuzzing.reading import Report
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

HEADINGS = (
    "kind",
    "inputs",
    "read",
    "refused",
    "faults",
    "slowest, ms",
    "peak, MiB",
    "inputs/s",
)


def main(
    kind: Annotated[
        list[str] | None, typer.Option(help="Kinds of files; by default all.")
    ] = None,
    inputs: Annotated[
        int, typer.Option(min=1, help="Of each kind; of slow kinds fewer.")
    ] = 150_000,
    seed: Annotated[int, typer.Option(help="What the changes follow from.")] = 0,
    minutes: Annotated[
        float, typer.Option("--time", help="Seconds after which no more are begun.")
    ] = math.inf,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = os.cpu_count()
    or 1,
    keep: Annotated[
        Path | None, typer.Option(help="Folder for the files at fault.")
    ] = None,
) -> None:
    """Read mutated files of every kind."""
    known = {one.name: one for one in KINDS}
    if unknown := [name for name in kind or () if name not in known]:
        raise typer.BadParameter(
            f"kinds: expected one of {', '.join(known)}, got {unknown[0]!r}"
        )
    chosen = {name: one for name, one in known.items() if not kind or name in kind}
    work = chunks(chosen.values(), inputs)
    total, console = (
        sum(chunk.last - chunk.first for chunk in work),
        Console(width=None if sys.stdout.isatty() else 110),
    )
    with Progress(console=console, disable=not console.is_terminal) as progress:
        bar = progress.add_task("inputs", total=total)
        reports = run(
            chosen,
            work,
            seed,
            workers,
            time.monotonic() + minutes,
            lambda one: progress.advance(bar, one.inputs),
        )
    console.print(_table(reports))
    for report in reports.values():
        _tell(report, console, keep)
    raise typer.Exit(1 if any(report.findings for report in reports.values()) else 0)


def _table(reports: dict[str, Report]) -> Table:
    """A line for each kind, and one for all."""
    table = Table()
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading == "kind" else "right")
    whole = Report("all")
    for report in reports.values():
        table.add_row(*_cells(report), end_section=report is list(reports.values())[-1])
        whole.add(report)
    table.add_row(*_cells(whole))
    return table


def _cells(report: Report) -> tuple[str, ...]:
    rate = report.inputs / report.seconds if report.seconds else 0.0
    counts = (report.inputs, report.read, report.refused, report.faults)
    return (
        report.kind,
        *(f"{count:,}" for count in counts),
        f"{1e3 * report.slowest_s:.0f}",
        f"{report.peak_mib:.0f}",
        f"{rate:,.0f}",
    )


def _tell(report: Report, console: Console, keep: Path | None) -> None:
    """Findings by place, the most frequent first."""
    for k, finding in enumerate(
        sorted(report.findings.values(), key=lambda one: -one.count)
    ):
        console.print(
            f"\n{finding.kind}: {finding.what}, {finding.count} times",
            markup=False,
            style="bold",
        )
        console.print(f"  {finding.message!r}", markup=False, highlight=False)
        for edit in finding.edits:
            console.print(
                f"  input {finding.index}: {edit!r}", markup=False, highlight=False
            )
        if keep is None:
            continue
        folder = keep / f"{finding.kind}-{k}"
        for name, content in finding.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "TRACE").write_text(finding.trace, errors="backslashreplace")


if __name__ == "__main__":
    typer.run(main)
