"""Write the tables of `docs/identification.md` that list the options of `identify`.

`python scripts/document_options.py`; a test compares the page with what this writes. A
table stands between `<!-- options: STAGE NAMES -->` and `<!-- end of options -->`:
STAGE is `identify`, a stage such as `samples`, or a method such as `ls-svm`, and NAMES
are some of its options, by default all. Meanings are those of the docstrings.
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

from griffe import Docstring, DocstringSectionKind

from identification.models.methods import METHODS, make_method, method_options
from identification.pipeline.options import (
    ARGUMENTS,
    STAGES,
    WORDS,
    Options,
    option_names,
)

PAGE = Path(__file__).parents[1] / "docs" / "identification.md"
MARKS = re.compile(r"<!-- options: (.+?) -->\n.*?<!-- end of options -->", re.DOTALL)
HEAD = "| option | value | default | what it sets |\n| --- | --- | --- | --- |"


def page(text: str) -> str:
    """The page with its tables written anew."""

    def written(found: re.Match[str]) -> str:
        stage, *names = found.group(1).split()
        table = "\n".join([HEAD, *rows(stage, names)])
        return f"<!-- options: {found.group(1)} -->\n{table}\n<!-- end of options -->"

    return MARKS.sub(written, text)


def rows(stage: str, names: list[str]) -> list[str]:
    """Rows of the table of a stage, of some options or of all."""
    default = default_of(stage)
    documented = parameters_of(type(default))
    if stage in METHODS:
        names = names or list(method_options(stage))
    elif stage in STAGES:
        names = names or list(documented)
    found = []
    for name in names or ARGUMENTS:
        value, meaning = documented[name]
        shown = shown_name(stage, name)
        usual = shown_default(getattr(default, name))
        found.append(f"| `{shown}` | {value} | {usual} | {meaning} |")
    return found


def default_of(stage: str) -> Any:
    """The object of a stage with its default settings."""
    if stage in STAGES:
        return STAGES[stage]()
    return make_method(stage, {}) if stage in METHODS else Options()


def parameters_of(kind: type) -> dict[str, tuple[str, str]]:
    """Values and meaning of the parameters of a class, by name, from its docstring."""
    found = {}
    for parent in reversed(kind.__mro__):
        text = Docstring(inspect.cleandoc(parent.__doc__ or ""))
        for section in text.parse("numpy"):
            if section.kind is not DocstringSectionKind.parameters:
                continue
            for parameter in section.value:
                if parameter.annotation is None:  # as of a parent
                    continue
                meaning = " ".join(parameter.description.split())
                values = str(parameter.annotation).replace("|", "\\|")
                found[parameter.name] = (values, meaning)
    return found


def shown_name(stage: str, name: str) -> str:
    """Name by which an option is given: alone where that is enough."""
    if stage in METHODS or stage not in STAGES:
        return name
    if name == WORDS[stage]:
        return stage
    full = f"{stage}.{name}"
    is_enough = option_names()[name] == full
    return name if is_enough else full


def shown_default(value: Any) -> str:
    """A default as a ship file has it; nothing for none."""
    if value is None or value == ():
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"`{value:g}`"
    if isinstance(value, tuple):
        numbers = ", ".join(f"{one:g}" for one in value)
        return f"`[{numbers}]`"
    return f"`{value}`"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
