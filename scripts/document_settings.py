"""Write the tables of the pages that name settings of tasks and controllers.

`python scripts/document_settings.py`; a test compares the pages with what this writes.
"""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from agents.controllers.registry import CLASSICAL, controller_class
from shipgym.engine.source import keywords
from shipgym.tasks.definition import read_definition

FOLDER = Path(__file__).parents[1] / "docs"
NAMES = (
    "environments/course_keeping",
    "environments/path_following",
    "controllers",
)
PAGES = tuple(FOLDER / f"{name}.md" for name in NAMES)
FIRST = "CourseKeeping"  # whose page comes first
MARKS = re.compile(
    r"<!-- settings: ([\w-]+) -->\n.*?<!-- end of settings -->", re.DOTALL
)
SIGNS = {"above": "above", "at_least": "at least", "at_most": "at most"}


def table(task: str) -> str:
    """The settings of a task as Markdown, without those that course keeping has too."""
    lines = ["| argument | default | bounds | meaning |", "| --- | --- | --- | --- |"]
    usual = [] if task == FIRST else keywords(read_definition(FIRST).Settings)
    known = {name: default for name, _, _, default in usual}
    for name, _, setting, default in keywords(read_definition(task).Settings):
        if name in known and known[name] == default:
            continue
        bounds = [
            f"{sign} {getattr(setting, key):g}"
            for key, sign in SIGNS.items()
            if getattr(setting, key) is not None
        ]
        lines.append(
            f"| `{name}` | {_shown(default)} | {', '.join(bounds)} | {setting.about} |"
        )
    return "\n".join(lines)


def controller_table(kind: str) -> str:
    """The settings of a controller as Markdown, without those of the LQ."""
    lines = ["| setting | default | bounds | meaning |", "| --- | --- | --- | --- |"]
    usual = controller_class("lq").settings_type
    settings = controller_class(kind).settings_type
    assert usual is not None
    assert settings is not None
    known = [] if kind == "lq" else [(one.name, one.metadata) for one in fields(usual)]
    for one in fields(settings):
        about = one.metadata
        if (one.name, about) in known:
            continue
        bounds = [f"{SIGNS[key]} {value:g}" for key, value in about["bounds"].items()]
        default = "" if one.default is None else f"{one.default:g}"
        bounded = ", ".join(bounds)
        lines.append(f"| `{one.name}` | {default} | {bounded} | {about['meaning']} |")
    return "\n".join(lines)


def _shown(default: Any) -> str:
    if isinstance(default, np.ndarray):
        return "`None`"
    return f"`{tuple(default)}`" if isinstance(default, tuple) else f"{default:g}"


def page(text: str) -> str:
    """A page with its tables made anew."""

    def written(found: re.Match[str]) -> str:
        name = found[1]
        rows = controller_table(name) if name in CLASSICAL else table(name)
        return f"<!-- settings: {name} -->\n{rows}\n<!-- end of settings -->"

    return MARKS.sub(written, text)


if __name__ == "__main__":
    for path in PAGES:
        path.write_text(page(path.read_text(encoding="utf-8")), encoding="utf-8")
