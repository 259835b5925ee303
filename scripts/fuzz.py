"""Read mutated files of every kind; each has to be read or refused in one message.

    python scripts/fuzz.py                              20,000 of each fast kind
    python scripts/fuzz.py --inputs 1000000             a million of each fast kind
    python scripts/fuzz.py --kind model --kind policy   some kinds
    python scripts/fuzz.py --keep found                 keep faulty files

Each input is a sound file of `tests/corpus` with one to five changes to its structure
or its bytes, which follow from `--seed`, the kind and the input's number alone. It is
read, and what was read is used. A fault is any exception but `InputError`, a warning, a
refusal that cannot be printed, more than 2 s of processor time, more than 1 GiB of
memory, or the death of the process. Each is told once by its place; the
exit code is 1 if there is any.

A new kind of file is a line in `KINDS` of `scripts/fuzzing/kinds.py` and a small file
in `tests/corpus/NAME`.
"""

from __future__ import annotations

import os

os.environ["NUMBA_DISABLE_JIT"] = (
    "1"  # equations of ships as plain Python: each structure would be compiled
)

from pathlib import Path
from typing import Annotated

import typer
from fuzzing.kinds import KINDS
from fuzzing.reading import Report, run_kind
from joblib import Parallel, delayed


def main(
    kind: Annotated[
        list[str] | None, typer.Option(help="Kinds of files; by default all.")
    ] = None,
    inputs: Annotated[
        int, typer.Option(min=1, help="Of each kind; of slow kinds fewer.")
    ] = 20_000,
    seed: Annotated[int, typer.Option(help="What the changes follow from.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = 2,
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
    chosen = [one for one in KINDS if not kind or one.name in kind]
    reports = Parallel(workers, backend="threading", return_as="generator")(
        delayed(run_kind)(one, max(1, inputs // one.slow), seed) for one in chosen
    )
    failed = False
    for one, report in zip(chosen, reports, strict=True):
        typer.echo(
            f"{one.name}: {report.inputs} inputs, {report.read} read,"
            f" {report.refused} refused, {len(report.faults)} faults"
        )
        tell(one.name, report, keep)
        failed |= bool(report.faults)
    raise typer.Exit(1 if failed else 0)


def tell(kind: str, report: Report, keep: Path | None) -> None:
    """Faults by place, and their files."""
    for k, (what, fault) in enumerate(report.faults.items()):
        typer.echo(f"  {what}, {fault.count} times, first input {fault.index}")
        typer.echo(f"    {fault.message}")
        if keep is None:
            continue
        folder = keep / f"{kind}-{k}"
        for name, content in fault.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "TRACE").write_text(fault.trace)


if __name__ == "__main__":
    typer.run(main)
