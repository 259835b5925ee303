"""Write `docs/api`: a page for each package, with its public names.

`python scripts/document_api.py`; a test compares the pages with what this writes.
mkdocstrings puts the docstrings in. Names that pages, the README and the examples
import from modules stand at the end of a page.
"""

from __future__ import annotations

import ast
import re
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "api"
#: Public packages of each page, with what each is for.
PACKAGES = {
    "shipgym": {
        "shipgym": "Trials, ships, manoeuvres, weather and environments.",
        "shipgym.models": "Ship models by name, from files and from other ships.",
        "shipgym.ships": "Structures, their terms and equations of ships.",
        "shipgym.manoeuvres": "Standard manoeuvres, their indices and criteria.",
        "shipgym.sea": "Current, wind and waves.",
        "shipgym.tasks": "Tasks: what an autopilot has to do in an environment.",
        "shipgym.plots": "Figures, made with plotly.",
    },
    "identification": {"identification": "From trials to a ship model."},
    "agents": {"agents": "Autopilots, and how they are run and compared."},
}
#: `from MODULE import NAMES`, in brackets or on one line.
IMPORT = re.compile(
    r"^\s*from ((?:shipgym|identification|agents)[\w.]*) import"
    r" (?:\(([^)]*)\)|([^\n#(]+))",
    re.MULTILINE,
)


def names(package: str) -> list[str]:
    """Public classes and functions of a package, in the order of its stub."""
    stub = ROOT / package.replace(".", "/") / "__init__.pyi"
    imports = [
        node
        for node in ast.parse(stub.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ImportFrom)
    ]
    found = [alias.name for node in imports for alias in node.names]
    module = import_module(package)
    return [name for name in found if callable(getattr(module, name))]


def pages() -> dict[str, str]:
    """Pages by file name; a name that several packages have is described once."""
    used = imported()
    return {f"{page}.md": _page(page, used) for page in PACKAGES}


def _page(page: str, used: list[tuple[str, str]]) -> str:
    blocks = [f"# {page}"]
    said: set[str] = set()
    for package, purpose in PACKAGES[page].items():
        if package != page:
            blocks.append(f"## {package}")
        blocks.append(purpose)
        new = [name for name in names(package) if name not in said]
        blocks += [f"::: {package}.{name}" for name in new]
        said |= {*new}
    further = [
        f"::: {module}.{name}"
        for module, name in used
        if module.partition(".")[0] == page and module not in PACKAGES[page]
    ]
    if further:
        blocks += ["## From modules", "What pages and examples import besides."]
    return "\n\n".join([*blocks, *further]) + "\n"


def imported() -> list[tuple[str, str]]:
    """Classes and functions imported in pages, README and examples, with modules."""
    pages = [path for path in (ROOT / "docs").rglob("*.md") if path.parent != PAGES]
    found = set[tuple[str, str]]()
    tasks = (ROOT / "shipgym" / "examples").glob("[a-z]*.py")
    for path in (ROOT / "README.md", *pages, *tasks):
        for module, inside, line in IMPORT.findall(path.read_text(encoding="utf-8")):
            given = re.split(r"[,\n]", inside or line)
            used = {one.split(" as ")[0].strip() for one in given}
            found |= {(module, name) for name in used - {""}}
    return sorted(
        (module, name)
        for module, name in found
        if callable(getattr(import_module(module), name))
    )


if __name__ == "__main__":
    for file, text in pages().items():
        (PAGES / file).write_text(text, encoding="utf-8")
