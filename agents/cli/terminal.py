"""What the commands print: results to standard output, progress and messages to standard error."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from agents.training.training import Progress as Training
    from agents.verification.result import AutopilotResult
    from identification import IdentificationResult
    from identification.progress import Progress
    from shipgym.manoeuvres import Criterion, IndexInterval

WIDTH_WITHOUT_TERMINAL = 110

#: Control characters but tab and newline, and those that turn the direction of writing.
CONTROLS = dict.fromkeys(
    [
        *range(9),
        *range(11, 32),
        *range(127, 160),
        *range(0x202A, 0x202F),
        *range(0x2066, 0x206A),
    ]
)


class _Plain(Console):
    """A console to which brackets, colons and control characters mean nothing: names come from files."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **settings)

    def render(self, *what: Any, **more: Any) -> Iterable[Segment]:
        """What is printed, without the control characters of its texts, which must not steer a terminal."""
        for segment in super().render(*what, **more):
            yield (
                segment
                if segment.control
                else segment._replace(text=segment.text.translate(CONTROLS))
            )


AS_JSON: ContextVar[bool] = ContextVar("as_json", default=False)
out = _Plain(width=None if sys.stdout.isatty() else WIDTH_WITHOUT_TERMINAL)
console, err = out, _Plain(stderr=True)


def plain_table(title: str, *headings: str) -> Table:
    """A table without lines, its title to the left; a heading that begins with > is aligned right."""
    table = Table(
        title=title,
        title_style="bold",
        title_justify="left",
        header_style="dim",
        box=None,
        pad_edge=False,
        padding=(0, 2, 0, 0),
    )
    for k, heading in enumerate(headings):
        right = heading.startswith(">")
        table.add_column(
            heading.removeprefix(">"),
            justify="right" if right else "left",
            no_wrap=k == 0,
        )
    return table


@contextmanager
def printing(as_json: bool, quiet: bool) -> Iterator[None]:
    """What is printed within: JSON in place of tables, nothing but errors and JSON, or all."""
    before = AS_JSON.set(as_json), out.quiet, err.quiet
    out.quiet, err.quiet = as_json or quiet, quiet
    try:
        yield
    finally:
        AS_JSON.reset(before[0])
        out.quiet, err.quiet = before[1:]


def answer(fields: Mapping[str, Any]) -> None:
    """The result of a command, printed where `--json` asks for it: one JSON object, for programs to read."""
    if AS_JSON.get():
        print(json.dumps(fields, indent=1, allow_nan=False))


def say(*lines: str | Text) -> None:
    """Lines of text, however long they are."""
    for line in lines:
        out.print(line, soft_wrap=True)


def warn(message: str) -> None:
    """A warning on standard error."""
    err.print(Text.assemble(("warning: ", "bold yellow"), message), soft_wrap=True)


def fail(message: str) -> None:
    """The one message of an error on standard error, as it is."""
    err.quiet = False
    err.print(Text.assemble(("error: ", "bold red"), message), soft_wrap=True)


@contextmanager
def progress_bars() -> Iterator[Progress | None]:
    """Bars on standard error, one for each stage, with the time that remains, in the end that it took.

    Yields a function to be told the stage, units done and their total, 0 where that is
    not known; None where nothing is shown, as with `--json` and `--quiet`.
    """
    if out.quiet or not err.is_terminal:
        yield None
        return
    from rich.progress import (
        BarColumn,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bars

    described = TextColumn("{task.description:<30}", markup=False)
    left = TimeRemainingColumn(elapsed_when_finished=True)
    with Bars(
        described, BarColumn(bar_width=32), TaskProgressColumn(), left, console=err
    ) as bars:
        tasks: dict[str, Any] = {}

        def tell(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=None)
            bars.update(tasks[stage], completed=done, total=total or None)

        yield tell


@contextmanager
def identifying(stage: str) -> Iterator[None]:
    """A bar of an identification, and one with the remaining time for each part whose total is known."""
    from identification.progress import PROGRESS

    with progress_bars() as tell:
        before = PROGRESS.set(tell or PROGRESS.get())
        PROGRESS.get()(stage, 0, 0)
        try:
            yield
        finally:
            PROGRESS.reset(before)


@contextmanager
def training_bar() -> Iterator[Callable[[Training], None] | None]:
    """A bar of a training on standard error, or a line for each evaluation where that is no terminal.

    Yields a function to be told the progress; None where nothing is shown.
    """
    if out.quiet:
        yield None
        return
    if not err.is_terminal:

        def line(now: Training) -> None:
            if now.evaluated:
                told = (
                    f"step {now.steps:,} of {now.total:,}, {now.seconds:.0f} s:"
                    f" {_costs(now)}"
                )
                err.print(told, soft_wrap=True)

        yield line
        return
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    told = TextColumn("{task.fields[costs]}", markup=False)
    with Progress(
        TextColumn("training"),
        BarColumn(bar_width=32),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        told,
        console=err,
    ) as bars:
        task = bars.add_task("training", total=None, costs="")
        yield lambda now: bars.update(
            task, completed=now.steps, total=now.total, costs=_costs(now)
        )


def _costs(now: Training) -> str:
    """Costs of a training so far, beside LQ's."""
    lq = "" if now.lq_cost is None else f", LQ {now.lq_cost:.2f}"
    return (
        "" if now.cost is None else f"cost {now.cost:.2f}, best {now.best_cost:.2f}{lq}"
    )


def prediction_table(result: IdentificationResult, what: str = "") -> Table:
    """Errors of the open-loop simulation of each trial, and its indices."""
    title = "Open-loop simulation of the trials: root mean square errors"
    table = plain_table(f"{title}, {what}" if what else title)
    table.add_column("trial", overflow="fold")
    table.add_column("use")
    for heading in ("heading\ndeg", "yaw rate\ndeg/s", "surge\nm/s", "sway\nm/s"):
        table.add_column(heading, justify="right")
    table.add_column(
        "measured -> predicted\n(rudder reversed at headings)", no_wrap=True
    )
    for name, metrics in result.metrics["trials"].items():
        rmse = metrics["rmse"]
        angles = (
            None if rmse[c] is None else np.degrees(rmse[c]) for c in ("psi", "r")
        )
        errors = [number(value, 3) for value in (*angles, rmse["u"], rmse["v"])]
        found = (
            Text("ran away", "bold red") if metrics["diverged"] else _indices(metrics)
        )
        table.add_row(PurePath(name).name, metrics["use"], *errors, found)
    return table


def selection_table(ranking: Mapping[str, Any]) -> Table:
    """Structures and methods by how well they predict the held-out trials, the best first."""
    headings = (
        "method",
        "structure",
        ">coeffi-\ncients",
        "model",
        ">error by\nstd. dev.",
        ">heading\ndeg",
        ">yaw rate\ndeg/s",
        ">ran away\ntrials",
    )
    table = plain_table(
        f"Structures and methods by how they predict {ranking['held_out']}", *headings
    )
    for one in ranking["ranking"]:
        state = "stable" if one["stable"] else Text("unstable", "bold red")
        figures = (
            ("error", 4),
            ("heading_deg", 2),
            ("yaw_rate_deg_s", 4),
            ("ran_away", 0),
        )
        numbers = (number(one[name], digits) for name, digits in figures)
        table.add_row(
            one["method"], one["structure"], str(one["coefficients"]), state, *numbers
        )
    return table


def _indices(metrics: Mapping[str, Any]) -> str:
    names = {"overshoot_1_deg": "1st", "overshoot_2_deg": "2nd"}
    names |= {"advance_lengths": "advance", "tactical_diameter_lengths": "diameter"}
    return "\n".join(
        f"{text} {number(found['measured'], 2)} -> {number(found['predicted'], 2)}"
        + (f" ({number(found['closed_loop'], 2)})" if "closed_loop" in found else "")
        for name, text in names.items()
        if (found := metrics.get(name)) is not None
    )


def manoeuvre_table(
    rows: Mapping[str, Mapping[str, IndexInterval]], water: str = "deep water"
) -> Table:
    """Indices of manoeuvres, one line each, with their intervals where there are models drawn."""
    drawn = any(
        len(index.values) for indices in rows.values() for index in indices.values()
    )
    more = (">95 % interval", ">draws without value") if drawn else ()
    table = plain_table(
        f"Manoeuvres from service speed in {water}",
        "manoeuvre",
        "index",
        ">value",
        *more,
    )
    for manoeuvre, indices in rows.items():
        for k, (name, index) in enumerate(indices.items()):
            cells = [manoeuvre if k == 0 else "", name, number(index.value, 2)]
            if drawn:
                cells += [
                    between(index.interval, 2),
                    str(index.n_ran_away + index.n_never_reached),
                ]
            table.add_row(*cells)
    return table


def criteria_table(criteria: Mapping[str, Criterion]) -> Table:
    """IMO criteria, with interval and probability of passing where there are models drawn."""
    drawn = any(criterion.share_passed is not None for criterion in criteria.values())
    measured = any(criterion.measured is not None for criterion in criteria.values())
    headings = {
        "criterion": True,
        ">measured": measured,
        ">value": True,
        ">95 % interval": drawn,
        ">limit": True,
        "unit": True,
        "verdict": True,
        ">probability": drawn,
        "manoeuvre": True,
        "paragraph": True,
    }
    there = [heading for heading, shown in headings.items() if shown]
    table = plain_table("IMO criteria, resolution MSC.137(76)", *there)
    for name, criterion in criteria.items():
        probability = criterion.probability
        cells = [
            name,
            number(criterion.measured, 2),
            number(criterion.value, 2),
            between(criterion.interval, 2),
            number(criterion.limit, 2),
            criterion.unit,
            _verdict(criterion),
            "-" if probability is None else f"{100.0 * probability:.1f} %",
            criterion.manoeuvre,
            criterion.source.rpartition(" ")[2],
        ]
        table.add_row(
            *(
                cell
                for cell, shown in zip(cells, headings.values(), strict=True)
                if shown
            )
        )
    return table


def criteria_notes(criteria: Mapping[str, Criterion]) -> list[str]:
    """What is to be said of criteria below their table: why one is not decided, and draws without a value."""
    notes = [f"{name}: {one.note}" for name, one in criteria.items() if one.note]
    lost = {
        name: "" if one.drawn is None else one.drawn.lost_in_words
        for name, one in criteria.items()
    }
    return notes + [
        f"{name}: {who}, which are not in its interval"
        for name, who in lost.items()
        if who
    ]


def _verdict(criterion: Criterion) -> str | Text:
    if criterion.passed is None:
        return (
            Text("not decided", "yellow") if criterion.manoeuvre else "not assessable"
        )
    return Text("passes", "green") if criterion.passed else Text("fails", "red")


def ranking_table(result: AutopilotResult) -> Table:
    """Autopilots over the models drawn, the best first."""
    metrics = result.metrics
    table = plain_table(
        f"Autopilots over {metrics['draws']['count']} models drawn, best first",
        "autopilot",
        ">cost, mean",
        ">cost, 95 %",
        ">heading rmse, deg",
        ">rudder, deg/min",
        ">gain margin",
        ">phase margin, deg",
        ">lost control",
    )
    for name in metrics["ranking"]:
        found = metrics["controllers"][name]
        margins = found["margins"] or {}
        table.add_row(
            name.upper(),
            number(found["cost_mean"], 2),
            number(found["cost_quantile_95"], 2),
            number(found["heading_rmse_deg_mean"], 2),
            number(found["rudder_travel_deg_min_mean"], 1),
            _margin(margins, "gain_margin", 2),
            _margin(margins, "phase_margin_deg", 1),
            str(found["lost_control"]),
        )
    return table


def _margin(margins: Mapping[str, Any], name: str, decimals: int) -> str:
    """A margin of an autopilot: without bound where null, and none where it is learned."""
    if name not in margins:
        return "-"
    return "inf" if margins[name] is None else number(margins[name], decimals)


def number(value: float | None, decimals: int) -> str:
    """A number, a dash where there is none."""
    return "-" if value is None else f"{value:.{decimals}f}"


def between(ends: tuple[float | None, float | None] | None, decimals: int) -> str:
    """An interval, a dash where there is none."""
    low, high = ends or (None, None)
    return (
        "-"
        if low is None or high is None
        else f"{low:.{decimals}f} to {high:.{decimals}f}"
    )
