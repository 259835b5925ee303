"""Output of the commands: results to standard output, all else to standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.segment import Segment
from rich.text import Text

from shipgym.engine.compiling import TELL

if TYPE_CHECKING:
    from rich.progress import Progress as Bars
    from rich.progress import Task

    from agents.training.evaluation import TrainingProgress

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
FIRST_LINE = 10.0  # s, after which the first line of progress is printed
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
        speed_estimate_period=3600.0,
    )


@contextmanager
def progress_bars(stage: str = "") -> Iterator[None]:
    """Show on standard error what `PROGRESS` is told while the block lasts.

    Bars, one for each stage, with the remaining time, the first perhaps of a `stage`
    without a total; nothing with `--json` and `--quiet`. Off a terminal a line a minute
    says how far the work is, and others what is compiled.
    """
    from identification.progress import PROGRESS

    bars = _bars()
    tasks: dict[str, Any] = {}

    def on_progress(name: str, done: int, total: int) -> None:
        if name not in tasks:
            tasks[name] = bars.add_task(name, total=None)
        bars.update(tasks[name], completed=done, total=total or None)

    shown = bars if err.is_terminal else _lines(bars)
    token = PROGRESS.set(on_progress)
    try:
        with nullcontext() if console.quiet else shown:
            if stage:
                on_progress(stage, 0, 0)
            yield
    finally:
        PROGRESS.reset(token)


@contextmanager
def _lines(bars: Bars) -> Iterator[None]:
    """Print once a minute how far the last of the stages is."""
    over = Event()

    def tell() -> None:
        wait = FIRST_LINE
        while not over.wait(wait):
            wait = MINUTE
            for stage in bars.tasks[-1:]:
                err.print(_how_far(stage), soft_wrap=True)

    teller = Thread(target=tell, daemon=True)
    teller.start()
    os.environ[TELL] = "1"
    try:
        yield
    finally:
        del os.environ[TELL]
        over.set()
        teller.join()


def _how_far(stage: Task) -> str:
    """Units done, the time that they took, and the remaining time where it is known."""
    parts = [stage.description]
    if stage.total:
        parts.append(f"{stage.completed:,.0f} of {stage.total:,.0f}")
    parts.append(f"{stage.elapsed:.0f} s so far")
    if stage.time_remaining:
        parts.append(f"about {stage.time_remaining:.0f} s left")
    return ", ".join(parts)


@contextmanager
def training_bar() -> Iterator[Callable[[TrainingProgress], None]]:
    """Progress of a training: a bar, and a line for each evaluation.

    Yields a function that is called with the progress.
    """
    from identification.progress import PROGRESS

    with progress_bars():
        tell = PROGRESS.get()

        def on_progress(now: TrainingProgress) -> None:
            tell("training", now.steps, now.total)
            if now.evaluated and not console.quiet:
                name, best = min(now.yardsticks.items(), key=lambda one: one[1])
                err.print(
                    f"step {now.steps:,} of {now.total:,}, {now.seconds:.0f} s: cost"
                    f" {now.cost:.6g}, best {now.best_cost:.6g}, {name} {best:.6g}",
                    soft_wrap=True,
                )

        yield on_progress
