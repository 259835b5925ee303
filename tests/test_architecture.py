"""The order of the house: what `docs/architecture.md` says and draws is what the code
does."""

import ast
import re
import tomllib
import xml.etree.ElementTree as ElementTree
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


@pytest.fixture(scope="module")
def imports():
    """Pairs of modules, the first of which imports the second; lazy and TYPE_CHECKING
    imports counted."""
    return draw_architecture.imports()


def test_imports_run_from_agents_to_identification_to_shipgym(imports):
    rank = {name: i for i, name in enumerate(PACKAGES)}
    upward = [
        (a, b)
        for a, b in imports
        if rank[a.partition(".")[0]] < rank[b.partition(".")[0]]
    ]
    assert not upward


def test_no_file_imports_itself_by_way_of_others(imports):
    graph = {}
    for a, b in imports:
        graph.setdefault(a, set()).add(b)
    circle = []
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        circle = error.args[1]
    assert not circle


def test_training_and_benchmarking_do_not_know_each_other(imports):
    rooms = draw_architecture.room_imports(imports)
    assert ("agents.training", "agents.benchmarking") not in rooms
    assert ("agents.benchmarking", "agents.training") not in rooms


def test_every_room_is_drawn():
    rooms = {
        f"{package}.{path.name}"
        for package in PACKAGES
        for path in (ROOT / package).iterdir()
        if (path / "__init__.py").is_file()
    }
    assert rooms - draw_architecture.ROOMS.keys() <= {"shipgym.examples"}
    known = draw_architecture.modules()
    drawn = draw_architecture.ROOMS.keys() - set(draw_architecture.APART.values())
    assert drawn <= known.keys()
    assert draw_architecture.APART.keys() <= known.keys()


def test_what_follows_from_the_arrows_is_what_the_rooms_import(imports):
    rooms = draw_architecture.room_imports(imports)
    inside = {(a, b) for a, b in rooms if a.partition(".")[0] == b.partition(".")[0]}
    down, back = draw_architecture.arrows(imports)
    assert down | back <= inside
    for a, b in inside - back:
        assert b in draw_architecture.reached(down, a)


@pytest.mark.parametrize("name", draw_architecture.PICTURES)
def test_the_pictures_are_those_of_the_code(name):
    drawn = draw_architecture.PICTURES[name]()
    ElementTree.fromstring(drawn)
    committed = (draw_architecture.IMAGES / name).read_text(encoding="utf-8")
    assert committed == drawn, "run python scripts/draw_architecture.py"


def test_the_picture_of_a_step_names_functions_that_the_parts_have():
    from shipgym.instruments import bridge, perfect
    from shipgym.sea import open_sea
    from shipgym.tasks import course_keeping, path_following

    named = {
        (giver, one)
        for _, given in draw_architecture.stages().values()
        for giver, one in given
    }
    for giver, one in named:
        if giver == "the task":
            assert hasattr(course_keeping, one), one
            assert hasattr(path_following, one), one
        if giver == "the sensor set":
            assert hasattr(bridge, one), one
            assert hasattr(perfect, one), one
        if giver == "the sea":
            assert hasattr(open_sea, one), one


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
