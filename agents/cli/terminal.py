"""Output of the commands: results to standard output, all else to standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from time import monotonic
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.segment import Segment
from rich.text import Text

if TYPE_CHECKING:
    from rich.progress import Progress as Bars

    from agents.training.evaluation import TrainingProgress
    from identification.progress import Progress

#: Control characters but tab and newline, and those that turn the direction of writing.
CONTROL_CODES = (
    *range(9),
    *range(11, 32),
    *range(127, 160),
    *range(0x202A, 0x202F),
    *range(0x2066, 0x206A),
)


class PlainConsole(Console):
    """A console without mark-up: brackets, colons and control characters mean nothing.

    Names that it prints come from files.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **settings)

    def render(self, *what: Any, **more: Any) -> Iterable[Segment]:
        """Segments to print, without control characters in their texts."""
        controls = dict.fromkeys(CONTROL_CODES)
        for segment in super().render(*what, **more):
            if segment.control:
                yield segment
            else:
                yield segment._replace(text=segment.text.translate(controls))


MINUTE = 60.0  # s
AS_JSON: ContextVar[bool] = ContextVar("as_json", default=False)
console = PlainConsole(width=None if sys.stdout.isatty() else 160)
err = PlainConsole(stderr=True)


@contextmanager
def printing(as_json: bool, quiet: bool) -> Iterator[None]:
    """Print JSON in place of tables, or nothing but errors, while the block lasts."""
    token = AS_JSON.set(as_json)
    quiet_before = console.quiet, err.quiet
    console.quiet = as_json or quiet
    err.quiet = quiet
    try:
        yield
    finally:
        AS_JSON.reset(token)
        console.quiet, err.quiet = quiet_before


def answer(fields: Mapping[str, Any]) -> None:
    """Print the result of a command as one JSON object, if `--json` asks for it."""
    if AS_JSON.get():
        from shipgym.files import json_text

        print(json_text(fields))


def say(*lines: str | Text) -> None:
    """Print lines of text without wrapping them."""
    for line in lines:
        console.print(line, soft_wrap=True)


def warn(message: str) -> None:
    """Print a warning to standard error."""
    err.print(Text.assemble(("warning: ", "bold yellow"), message), soft_wrap=True)


def print_error(message: str) -> None:
    """Print the one message of an error to standard error, with `--quiet` too."""
    err.quiet = False
    err.print(Text.assemble(("error: ", "bold red"), message), soft_wrap=True)


def _bars() -> Bars:
    """Bars on standard error: what is done, a bar, its share and remaining time."""
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    return Progress(
        TextColumn("{task.description:<30}", markup=False),
        BarColumn(bar_width=32),
        TaskProgressColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
        console=err,
    )


@contextmanager
def progress_bars() -> Iterator[Progress]:
    """Bars on standard error, one for each stage, with the remaining time.

    Yields a function that is called with the stage, the units done and their total, 0
    where that is unknown; with `--json` and `--quiet` it shows nothing. Off a terminal
    a line a minute says how far the work is.
    """
    if console.quiet:
        yield lambda *_: None
        return
    if not err.is_terminal:
        yield _line_a_minute()
        return
    with _bars() as bars:
        tasks: dict[str, Any] = {}

        def on_progress(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=None)
            bars.update(tasks[stage], completed=done, total=total or None)

        yield on_progress


def _line_a_minute() -> Progress:
    """Progress in lines, the first after a minute."""
    told = monotonic()

    def on_progress(stage: str, done: int, total: int) -> None:
        nonlocal told
        if monotonic() - told >= MINUTE:
            told = monotonic()
            share = f": {done} of {total}" if total else ""
            err.print(f"{stage}{share}", soft_wrap=True)

    return on_progress


@contextmanager
def identifying(stage: str) -> Iterator[None]:
    """Bars of an identification: one without a total, one for each part with one."""
    from identification.progress import PROGRESS

    with progress_bars() as on_progress:
        token = PROGRESS.set(on_progress)
        on_progress(stage, 0, 0)
        try:
            yield
        finally:
            PROGRESS.reset(token)


@contextmanager
def training_bar() -> Iterator[Callable[[TrainingProgress], None]]:
    """Progress of a training: a bar, and a line for each evaluation.

    Yields a function that is called with the progress.
    """
    with progress_bars() as bars:

        def on_progress(now: TrainingProgress) -> None:
            bars("training", now.steps, now.total)
            if now.evaluated and not console.quiet:
                name, best = min(now.yardsticks.items(), key=lambda one: one[1])
                err.print(
                    f"step {now.steps:,} of {now.total:,}, {now.seconds:.0f} s: cost"
                    f" {now.cost:.6g}, best {now.best_cost:.6g}, {name} {best:.6g}",
                    soft_wrap=True,
                )

        yield on_progress
