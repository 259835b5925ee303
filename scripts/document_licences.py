"""Write docs/licences.md: the licence of each declared dependency and of what is shipped in the package.

python scripts/document_licences.py            needs all extras installed, as `make
lint` does python scripts/document_licences.py --check    exits with 1 if the page is
not what would be written
"""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "licences.md"
LONGEST = 60  # characters of a licence that is a name and not its text
HEAD = """# Licences

shipgym is under the MIT licence (`LICENSE`). Its wheel also contains plotly.js, the bundle of Cartesian
charts, under the MIT licence (`shipgym/pages/plotly/LICENSE`). Its dependencies are installed separately,
under these licences, as declared by the packages themselves. This page is written by
`scripts/document_licences.py`.

| package | needed for | licence |
| --- | --- | --- |
"""


def licence(name: str) -> str:
    """As its metadata declare it; empty if it is not installed."""
    try:
        about = metadata(name)
    except PackageNotFoundError:
        return ""
    if expression := about.get("License-Expression"):
        return expression
    classes = [
        one.rpartition(" :: ")[2]
        for one in about.get_all("Classifier", [])
        if "License ::" in one
    ]
    own = (about.get("License") or "").strip()
    if classes or not own:
        return ", ".join(classes) or "see its files"
    return (
        own
        if len(own) <= LONGEST and "\n" not in own
        else own.splitlines()[0][:LONGEST]
    )


def page() -> str:
    """The page; exits with a message if a package is not installed."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
        "project"
    ]
    groups = {"the core": project["dependencies"]} | {
        f"`[{extra}]`": names
        for extra, names in project["optional-dependencies"].items()
        if extra != "docs"
    }
    wanted: dict[str, list[str]] = {}
    for group, requirements in groups.items():
        for requirement in requirements:
            name = re.split(r"[\[<>=!~; ]", requirement)[0]
            if name != "shipgym":
                wanted.setdefault(name, []).append(group)
    found = {name: licence(name) for name in sorted(wanted, key=str.lower)}
    if absent := [name for name, text in found.items() if not text]:
        sys.exit(
            f"not installed: {', '.join(absent)}; run make lint, which installs all"
            " extras"
        )
    return HEAD + "".join(
        f"| {name} | {', '.join(wanted[name])} | {text} |\n"
        for name, text in found.items()
    )


def main() -> None:
    """Write the page, or check it."""
    text = page()
    if "--check" in sys.argv[1:]:
        same = PAGE.is_file() and PAGE.read_text(encoding="utf-8") == text
        sys.exit(
            0 if same else f"{PAGE} is not up to date: run scripts/document_licences.py"
        )
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
