"""Write the tables of `docs/identification.md` that name the options of `identify`.

`python scripts/document_options.py`; a test compares the page with what this writes.
"""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

from shipgym.trials.identify_table import (
    OPTIONS,
    TEXT,
    TEXT_OR_TABLE,
    WHOLE_OR_TEXT,
    Options,
)

PAGE = Path(__file__).parents[1] / "docs" / "identification.md"
MARKS = re.compile(r"<!-- options: (\S+) -->\n.*?<!-- end of options -->", re.DOTALL)
SIGNS = {"above": "above", "at_least": "at least", "at_most": "at most"}


def table(section: str) -> str:
    """The options of one section as Markdown."""
    lines = ["| option | value | default | what it sets |", "| --- | --- | --- | --- |"]
    for item in fields(Options):
        option = OPTIONS[item.name]
        if option.section != section:
            continue
        meaning = option.meaning
        meaning += "".join(
            f"<br>`{word}`: {told}" for word, told in option.choices.items()
        )
        lines.append(
            f"| `{item.name}` | {_value(item.name)} | {_default(item.default)} |"
            f" {meaning} |"
        )
    return "\n".join(lines)


def _value(name: str) -> str:
    option = OPTIONS[name]
    words = [f"`{word}`" for word in option.choices]
    if option.kind in (WHOLE_OR_TEXT, TEXT_OR_TABLE):
        words = [*words, "a number" if option.kind == WHOLE_OR_TEXT else "a table"]
    bounds = [f"{SIGNS[sign]} {bound:g}" for sign, bound in option.bounds.items()]
    kind = "a name" if option.kind == TEXT else option.kind
    return ", ".join(words or [kind, *bounds])


def _default(value: object) -> str:
    if value is None or value == ():
        return ""
    return str(value).lower() if isinstance(value, bool) else f"`{value}`"


def page(text: str) -> str:
    """The page with its tables made anew."""

    def written(found: re.Match[str]) -> str:
        section = found.group(1)
        return f"<!-- options: {section} -->\n{table(section)}\n<!-- end of options -->"

    return MARKS.sub(written, text)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
