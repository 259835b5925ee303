"""The order of the house: imports run down, and pages say what the code does."""

import ast
import re
import tomllib
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import draw_architecture
import gymnasium
import pytest

import shipgym  # noqa: F401 - registers its environments

ROOT = Path(__file__).parents[1]
PACKAGES = ("shipgym", "identification", "agents")  # each imports those before it
PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]


def test_imports_run_down_the_layers():
    """Rooms import rooms of lower layers, and packages the packages below."""
    assert draw_architecture.upward(draw_architecture.imports()) == []


def test_every_room_has_its_layer():
    rooms = {
        (package, path.name)
        for package in draw_architecture.LAYERS
        for path in (ROOT / package).iterdir()
        if (path / "__init__.py").is_file()
    }
    drawn = {
        (package, room)
        for package, layers in draw_architecture.LAYERS.items()
        for layer in layers
        for room in layer
    }
    assert rooms - drawn <= {("shipgym", "examples")}
    modules = draw_architecture.modules()
    assert all(f"{package}.{room}" in modules for package, room in drawn)


def test_no_file_imports_itself_by_way_of_others():
    graph = {}
    for importer, imported in draw_architecture.imports():
        graph.setdefault(importer, set()).add(imported)
    circle = []
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        circle = error.args[1]
    assert circle == []


def test_the_picture_is_that_of_the_layers():
    committed = draw_architecture.PICTURE.read_text(encoding="utf-8")
    drawn = draw_architecture.picture()
    assert committed == drawn, "run python scripts/draw_architecture.py"


NAMED = re.compile(r"`((?:shipgym|identification|agents)/[\w/]+\.py)`: `(\w+)`")


def test_the_walks_name_what_stands_in_the_files():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = NAMED.findall(re.sub(r"\s+", " ", page))
    assert len(named) > 20
    for file, name in named:
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        defined = [
            node.name
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
        ]
        assert name in defined, f"{file}: {name}"


def test_every_script_is_the_way_to_something_that_is_published():
    """A page, the Makefile, a ship file or a test names it, or another script imports
    it."""
    pages = [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "Makefile", ROOT / "mkdocs.yml"]
    pages += [*(ROOT / "tests").rglob("*.py"), *(ROOT / "examples").rglob("*.toml")]
    text = "".join(path.read_text(encoding="utf-8") for path in pages)
    scripts = sorted((ROOT / "scripts").glob("*.py"))
    code = "".join(path.read_text(encoding="utf-8") for path in scripts)
    orphaned = [
        path.name
        for path in scripts
        if f"scripts/{path.name}" not in text and f"from {path.stem} import" not in code
    ]
    assert orphaned == []


def test_identification_has_few_files_at_its_top():
    assert len(list((ROOT / "identification").glob("*.py"))) <= 10


def test_the_wheel_has_every_file_that_is_no_code():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    named = project["tool"]["setuptools"]["package-data"]
    for package in PACKAGES:
        folder = ROOT / package
        files = {
            path
            for path in folder.rglob("*")
            if path.is_file() and "__pycache__" not in path.parts
        }
        files -= {path for path in files if path.suffix in (".py", ".pyi")}
        assert not files.difference(
            *(folder.glob(pattern) for pattern in named[package])
        )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_of_a_page_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        if anchor:
            headings = re.findall(
                r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE
            )
            anchors = [
                re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-")
                for one in headings
            ]
            assert anchor in anchors, link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_environments_of_a_page_are_registered(page):
    named = re.findall(r"shipgym/[A-Z]\w+-v\d", page.read_text(encoding="utf-8"))
    assert not {*named} - {*gymnasium.registry}


def test_the_site_has_every_page():
    named = re.findall(
        r": (\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE
    )
    pages = {
        path.relative_to(ROOT / "docs").as_posix()
        for path in (ROOT / "docs").rglob("*.md")
    }
    pages |= {
        f"notebooks/{path.stem}.md" for path in (ROOT / "notebooks").glob("*.ipynb")
    }
    assert set(named) == pages
    assert len(named) == len(pages)
