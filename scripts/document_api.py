"""Write `docs/api`: a page for each public package, with its names.

`python scripts/document_api.py`; a test compares the pages with what this writes.
mkdocstrings puts the docstrings in. One page more has what the other pages, the README
and the examples import from modules.
"""

from __future__ import annotations

import ast
import re
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "api"
#: Packages, in the order of the site, with what each is for.
PACKAGES = {
    "shipgym": "Trials, ships, manoeuvres, weather and environments.",
    "shipgym.models": "Ship models by name, from files and from other ships.",
    "shipgym.ships": "Structures, their terms and equations of ships.",
    "shipgym.manoeuvres": "Standard manoeuvres, their indices and criteria.",
    "shipgym.sea": "Current, wind and waves.",
    "shipgym.tasks": "Tasks: what an autopilot has to do in an environment.",
    "shipgym.plots": "Figures, made with plotly.",
    "identification": "From trials to a ship model.",
    "agents": "Autopilots, and how they are run and compared.",
}
MODULES = "modules.md"
#: `from MODULE import NAMES`, in brackets or on one line.
IMPORT = re.compile(
    r"^\s*from ((?:shipgym|identification|agents)[\w.]*) import"
    r" (?:\(([^)]*)\)|([^\n#(]+))",
    re.MULTILINE,
)


def names(package: str) -> list[str]:
    """Public names of a package without submodules and constants, in file order."""
    if (ROOT / package.replace(".", "/")).with_suffix(".py").is_file():
        return list(import_module(package).__all__)
    stub = ROOT / package.replace(".", "/") / "__init__.pyi"
    imports = [
        node
        for node in ast.parse(stub.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ImportFrom)
    ]
    found = [alias.name for node in imports if node.module for alias in node.names]
    modules = {path.stem for path in stub.parent.iterdir()}
    return [name for name in found if name not in modules and not name.isupper()]


def pages() -> dict[str, str]:
    """Pages by file name.

    A name that several packages have is described once, on the first page.
    """
    said: dict[str, str] = {}
    written = {}
    for package, purpose in PACKAGES.items():
        blocks = [f"# {package}", purpose]
        again = [
            f"[`{name}`]({said[name]}.md)"
            for name in sorted(set(names(package)) & set(said))
        ]
        if again:
            blocks.append(f"Also here: {', '.join(again)}.")
        for name in names(package):
            if name not in said:
                said[name] = package
                blocks.append(f"::: {package}.{name}")
        written[f"{package}.md"] = "\n\n".join(blocks) + "\n"
    further = [
        f"::: {module}.{name}" for module, name in imported() if module not in PACKAGES
    ]
    purpose = (
        "What pages and examples import from modules, in addition to the names in the"
        " packages."
    )
    written[MODULES] = "\n\n".join(["# Modules", purpose, *further]) + "\n"
    return written


def imported() -> list[tuple[str, str]]:
    """Names imported in pages, README and examples, with their modules."""
    pages = [path for path in (ROOT / "docs").rglob("*.md") if path.parent != PAGES]
    found = set[tuple[str, str]]()
    for path in (ROOT / "README.md", *pages, *(ROOT / "examples").rglob("*.py")):
        for module, inside, line in IMPORT.findall(path.read_text(encoding="utf-8")):
            given = [
                one.split(" as ")[0].strip()
                for one in re.split(r"[,\n]", inside or line)
            ]
            found |= {(module, name) for name in given if name}
    return sorted(
        (module, name)
        for module, name in found
        if not name.isupper() and callable(getattr(import_module(module), name))
    )


if __name__ == "__main__":
    for file, text in pages().items():
        (PAGES / file).write_text(text, encoding="utf-8")
