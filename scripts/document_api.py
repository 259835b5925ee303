"""Write `docs/api`: a page for each public package, with the names of its `__init__.pyi`.

`python scripts/document_api.py`; a test compares the pages with what this writes. mkdocstrings puts the
docstrings in.
"""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "api"
#: Packages, in the order of the site, with what each is for.
PACKAGES = {
    "shipgym": "Trials, ships, manoeuvres, weather and environments.",
    "shipgym.ships": "Ship models, structures and their terms.",
    "shipgym.manoeuvres": "Standard manoeuvres, their indices and criteria.",
    "shipgym.sea": "Current, wind and waves.",
    "shipgym.tasks": "What an environment asks of an autopilot.",
    "shipgym.plots": "Figures, made with plotly.",
    "identification": "From trials to a ship model.",
    "agents": "Autopilots, and how they are run and compared.",
}


def names(package: str) -> list[str]:
    """The public names of a package, submodules and constants left out, in the order of its file."""
    stub = ROOT / package.replace(".", "/") / "__init__.pyi"
    imports = [
        node for node in ast.parse(stub.read_text(encoding="utf-8")).body if isinstance(node, ast.ImportFrom)
    ]
    found = [alias.name for node in imports if node.module for alias in node.names]
    modules = {path.stem for path in stub.parent.iterdir()}
    return [name for name in found if name not in modules and not name.isupper()]


def pages() -> dict[str, str]:
    """Each page by its file name. A name that several packages have is described once, on the first page."""
    said: dict[str, str] = {}
    written = {}
    for package, purpose in PACKAGES.items():
        blocks = [f"# {package}", purpose]
        again = [f"[`{name}`]({said[name]}.md)" for name in sorted(set(names(package)) & set(said))]
        if again:
            blocks.append(f"Also here: {', '.join(again)}.")
        for name in names(package):
            if name not in said:
                said[name] = package
                blocks.append(f"::: {package}.{name}")
        written[f"{package}.md"] = "\n\n".join(blocks) + "\n"
    return written


if __name__ == "__main__":
    for file, text in pages().items():
        (PAGES / file).write_text(text, encoding="utf-8")
