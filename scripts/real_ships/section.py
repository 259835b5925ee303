"""A section of the document: text, tables and figures, put in their old place."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from shipgym import Trial

WIDTH = 112  # of a line of prose


@dataclass(frozen=True)
class Section:
    """What a case found.

    Attributes
    ----------
    title : str
    text : str
        Markdown; `{figure}` names stand for images.
    figures : dict of str to callable
        File name in `docs/images` and what draws it on a matplotlib figure.
    """

    title: str
    text: str
    figures: dict[str, Callable[[Any], None]] = field(default_factory=dict)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def number(value: float | None, digits: int = 3) -> str:
    """A number for a table; a dash where there is none."""
    return "-" if value is None or value != value else f"{value:.{digits}f}"


def headings(
    axis: Any, trial: Trial, predictions: Mapping[str, Trial | None], title: str
) -> None:
    """A trial's heading and predictions of it by label, on a matplotlib axis."""
    axis.plot(trial.t, np.degrees(trial["psi"]), "k", lw=1.2, label="measured")
    for label, predicted in predictions.items():
        if predicted is not None:
            axis.plot(predicted.t, np.degrees(predicted["psi"]), lw=0.8, label=label)
    axis.set(title=title, xlabel="t, s", ylabel="heading, deg")


def wrapped(text: str) -> str:
    """Markdown with paragraphs wrapped to one width; tables and images stay."""
    blocks = text.strip().split("\n\n")
    prose = [
        (
            block
            if block.lstrip().startswith(("|", "!", "#"))
            else fill(
                " ".join(block.split()),
                WIDTH,
                break_long_words=False,
                break_on_hyphens=False,
            )
        )
        for block in blocks
    ]
    return "\n\n".join(prose)


def marks(case: str) -> tuple[str, str]:
    """The comments between which the section of a case stands."""
    return f"<!-- case {case} -->", f"<!-- end of case {case} -->"


def put(document: str, case: str, section: Section) -> str:
    """The document with the section of a case put in its place.

    Raises
    ------
    ValueError
        Where the document has no such place.
    """
    first, last = marks(case)
    before, rest = document.split(first)
    _, after = rest.split(last)
    command = f"`python scripts/predict_real_ships.py {case}`"
    body = (
        f"{first}\n## ({case}) {section.title}\n\nCommand:"
        f" {command}\n\n{wrapped(section.text)}\n{last}"
    )
    return before + body + after


def draw(section: Section, folder: Path) -> None:
    """Write the figures of a section as SVG, the same bytes for the same numbers."""
    import matplotlib

    matplotlib.use("svg")
    from matplotlib import pyplot as plt

    settings = {"svg.hashsalt": "shipgym", "font.size": 8.0, "path.simplify": True}
    with plt.rc_context(settings):  # type: ignore[arg-type]
        for name, paint in section.figures.items():
            figure = plt.figure(figsize=(7.0, 3.4), layout="constrained")
            paint(figure)
            figure.savefig(folder / name, metadata={"Date": None})
            plt.close(figure)
