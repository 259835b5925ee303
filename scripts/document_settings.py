"""Write the tables of the environments' pages that name the settings of their tasks.

`python scripts/document_settings.py`; a test compares the pages with what this writes.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.engine.source import keywords
from shipgym.tasks.definition import TASKS, read_definition

FOLDER = Path(__file__).parents[1] / "docs" / "environments"
PAGES = tuple(FOLDER / f"{name}.md" for name in ("course_keeping", "path_following"))
MARKS = re.compile(
    r"<!-- settings: ([\w-]+) -->\n.*?<!-- end of settings -->", re.DOTALL
)
SIGNS = {"above": "above", "at_least": "at least", "at_most": "at most"}


def table(task: str) -> str:
    """The settings of a task as Markdown."""
    lines = ["| argument | default | bounds | meaning |", "| --- | --- | --- | --- |"]
    for name, _, setting, default in keywords(read_definition(task).Settings):
        bounds = [
            f"{sign} {getattr(setting, key):g}"
            for key, sign in SIGNS.items()
            if getattr(setting, key) is not None
        ]
        lines.append(
            f"| `{name}` | {_shown(default)} | {', '.join(bounds)} | {setting.about} |"
        )
    return "\n".join(lines)


def _shown(default: Any) -> str:
    if isinstance(default, np.ndarray):
        return "`None`"
    return f"`{tuple(default)}`" if isinstance(default, tuple) else f"{default:g}"


def page(text: str) -> str:
    """A page with its tables made anew."""

    def written(found: re.Match[str]) -> str:
        return (
            f"<!-- settings: {found[1]} -->\n{table(found[1])}\n<!-- end of"
            " settings -->"
        )

    return MARKS.sub(written, text)


if __name__ == "__main__":
    assert len(PAGES) == len(TASKS)
    for path in PAGES:
        path.write_text(page(path.read_text(encoding="utf-8")), encoding="utf-8")
