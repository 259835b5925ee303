"""Golden texts: what commands print, messages say and pages show, kept in results/texts.

`SHIPGYM_GOLDEN=write python -m pytest TESTS` writes them anew. Words and whole numbers
are compared exactly, others to a thousandth or one unit of their last printed decimal;
spaces and ends of lines too, where all numbers are as long as they were and nothing was
taken out.
"""

from __future__ import annotations

import base64
import difflib
import gzip
import json
import os
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

import shipgym

TEXTS = Path(__file__).parent / "results" / "texts"
VARIABLE = "SHIPGYM_GOLDEN"
WRITTEN: set[str] = (
    set()
)  # names, each once: a second text of one name has to be the same

RELATIVE = 1e-3
NUMBER = re.compile(
    r"(?<![A-Za-z_\d.])[-−]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![A-Za-z_\d])"  # noqa: RUF001
)
CUT = "<...>"
PATH = r"(?<![\w.)\]<])(?:/[\w.~+-]+)+/([\w.~+-]+)"  # of which the last part stays
#: What differs from run to run or from computer to computer, and what is put in its
#: place.
MASKS = {
    rf"\b{re.escape(shipgym.__version__)}\b": "VERSION",
    r"\b\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d)?(?:\.\d+)?(?:Z|[+-]\d\d:?\d\d)?)?": (
        "DATE"
    ),
    r"\b(?=[a-f]*\d)(?=\d*[a-f])[0-9a-f]{12,64}\b": "HASH",
}

THINNED = (
    5  # of the numbers of a row that a page draws, the first and the last among them
)
DIGITS = 5  # of the largest of a row
LONGEST = 200  # characters of a text among data
BLOCKS = {
    "button",
    "caption",
    "div",
    "figcaption",
    "figure",
    "h1",
    "h2",
    "h3",
    "h4",
    "header",
    "li",
    "option",
    "p",
    "section",
    "title",
    "tr",
}
CODE = {"script", "style"}


def same_text(name: str, text: str, *masks: str) -> bool:
    """True where a text is the golden one of this name; an AssertionError tells the lines that differ.

    `masks` are regular expressions of what differs from run to run, such as durations.
    """
    path, found = (
        TEXTS / f"{re.sub('[^A-Za-z0-9/]+', '-', name)}.txt",
        masked(text, *masks),
    )
    if os.environ.get(VARIABLE) == "write" and name not in WRITTEN:
        WRITTEN.add(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(found, encoding="utf-8")
    golden = path.read_text(encoding="utf-8")
    if not alike(golden, found):
        lines = difflib.unified_diff(
            golden.splitlines(), found.splitlines(), path.name, "found", "", "", 0, ""
        )
        raise AssertionError("\n".join(list(lines)[:40]))
    return True


def same_page(name: str, page: str, *masks: str) -> bool:
    """`same_text` of what a page shows and draws."""
    return same_text(name, page_text(page), *masks)


def masked(text: str, *masks: str) -> str:
    """A text without what differs from run to run, and without spaces at the ends of lines."""
    text = re.sub(PATH, rf"{CUT}/\1", text)
    for mask, instead in [*MASKS.items(), *((mask, CUT) for mask in masks)]:
        text = re.sub(mask, instead, text)
    return "".join(f"{line.rstrip()}\n" for line in text.rstrip().splitlines())


def alike(golden: str, found: str) -> bool:
    """Whether two texts say the same."""
    words, numbers = parted(golden)
    other_words, other_numbers = parted(found)
    if len(numbers) != len(other_numbers) or not all(
        map(close, numbers, other_numbers)
    ):
        return False
    if CUT not in golden and [len(one) for one in numbers] == [
        len(one) for one in other_numbers
    ]:
        return words == other_words
    return [one.split() for one in words] == [one.split() for one in other_words]


def parted(text: str) -> tuple[list[str], list[str]]:
    """What stands between the numbers of a text, and the numbers."""
    return NUMBER.split(text), NUMBER.findall(text)


def close(golden: str, found: str) -> bool:
    """Whether two printed numbers are the same but for rounding; whole ones have to be the same."""
    a, b = (float(one.replace("\N{MINUS SIGN}", "-")) for one in (golden, found))
    mantissa, _, exponent = golden.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    if not decimals and not exponent:
        return a == b
    return abs(a - b) <= max(
        RELATIVE * abs(a), 1.001 * 10.0 ** (int(exponent or 0) - decimals)
    )


def page_text(page: str) -> str:
    """What a page shows, a line for each row or paragraph, with classes, and what its figures draw."""
    return "\n".join(_Shown(page).lines)


class _Shown(HTMLParser):
    """Collects the lines of `page_text`."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.lines: list[str] = []
        self.line: list[str] = []
        self.code = ""
        self.feed(page)
        self._end_line()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in BLOCKS:
            self._end_line()
        if tag in CODE:
            self.code = tag
        told = [
            f"{key}={value}"
            for key, value in attrs
            if key in ("class", "style", "title", "href")
        ]
        self.line += [f"<{' '.join(told)}>"] if told else []
        if tag in ("td", "th"):
            self.line.append("|")

    def handle_endtag(self, tag: str) -> None:
        if tag in BLOCKS:
            self._end_line()
        if tag in CODE:
            self.code = ""

    def handle_data(self, data: str) -> None:
        if not self.code:
            self.line += data.split()
        elif self.code == "script":
            self._end_line()
            for line in drawn(data):
                if (
                    "layout" not in line or line not in self.lines
                ):  # most of it all figures share
                    self.lines.append(line)

    def _end_line(self) -> None:
        if self.line:
            self.lines.append(" ".join(self.line))
        self.line = []


def drawn(script: str) -> Iterator[str]:
    """Data within a script, thinned: of a figure, in JSON, or packed."""
    script = script.strip()
    if script.startswith("Plotly.newPlot("):
        place, decoder = len("Plotly.newPlot("), json.JSONDecoder()
        for what in ("figure", "data", "layout"):
            content, end = decoder.raw_decode(script, place)
            yield from flat(content, what)
            place = end + 1
    elif script[:1] in "[{":
        yield from flat(json.loads(script), "data")
    elif re.fullmatch(r"[\w+/=]{40,}", script):
        text = gzip.decompress(base64.b64decode(script)).decode()
        yield from flat(json.loads(text), "packed") if text[:1] in "[{" else ()


def flat(content: Any, path: str) -> Iterator[str]:
    """Lines of nested data: words and single numbers of a table in one, rows of numbers in one each."""
    if isinstance(content, dict) and "bdata" in content:
        content = np.frombuffer(
            base64.b64decode(content["bdata"]), content["dtype"]
        ).tolist()
    if isinstance(content, dict):
        single = {
            key: _word(value)
            for key, value in content.items()
            if not isinstance(value, dict | list)
        }
        if single:
            yield (
                f"{path}:"
                f" {', '.join(f'{key} {value}' for key, value in single.items())}"
            )
        for key, value in content.items():
            if key not in single:
                yield from flat(value, f"{path}.{key}" if path else str(key))
    elif (
        isinstance(content, list)
        and content
        and all(isinstance(one, int | float | None) for one in content)
    ):
        yield f"{path}: {_row(content)}"
    elif isinstance(content, list):
        for k, value in enumerate(content):
            yield from flat(value, f"{path}[{k}]")
    else:
        yield f"{path}: {_word(content)}"


def _row(numbers: list[float | None]) -> str:
    """How many numbers a row has and how many are known, some of them, and the mean."""
    row = np.array([np.nan if one is None else one for one in numbers], dtype=float)
    known = row[np.isfinite(row)]
    places = np.linspace(0, len(row) - 1, min(len(row), THINNED)).astype(int)
    largest = float(np.abs(known).max(initial=0.0))
    whole = all(isinstance(one, int) for one in numbers)
    shown = [
        str(numbers[place]) if whole else _rounded(row[place], largest)
        for place in places
    ]
    mean = _rounded(known.mean() if len(known) else np.nan, largest)
    return f"{len(row)} of {len(known)}, {' '.join(shown)}, mean {mean}"


def _word(value: Any) -> str:
    return (
        _rounded(value, abs(value))
        if isinstance(value, float)
        else str(value)[:LONGEST]
    )


def _rounded(value: float, largest: float) -> str:
    """A number as one of a row has it whose largest has so many digits."""
    if not np.isfinite(value):
        return str(value)
    decimals = (
        DIGITS - 1 - int(np.floor(np.log10(largest))) if 0.0 < largest < np.inf else 0
    )
    return f"{round(value, decimals) + 0.0:.{max(decimals, 1)}f}"
