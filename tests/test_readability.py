"""How densely the packages are written: figures that may only improve, and their aims.

Nodes are expressions, names distinct names and attributes; lines do not count docstring
and blank ones. Cognitive complexity is nearly that of Campbell (SonarSource) 2017.
"""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("shipgym", "identification", "agents")
EQUATIONS = re.compile(r"ships/(container|kvlcc2|mmg|tanker)\.accelerations")
#: Figure of functions: its aim, and today's figures in the order of the packages.
FIGURES = {
    "nodes a line, p50": (4.5, (4.8, 4.7, 4.7)),
    "nodes a line, p90": (7.0, (7.0, 7.0, 7.0)),
    "names, p90": (32, (33, 32, 35)),
    "names, largest": (60, (60, 63, 60)),
    "cognitive, p99": (20, (20, 20, 20)),
    "cognitive, largest": (25, (33, 25, 25)),
    "lines, largest": (60, (60, 60, 76)),
}
#: Figure of the project as a whole: its aim, and today's.
TOTALS = {
    "exceptions from the formatter": (0, 0),
    "exceptions from sorted imports": (0, 0),
    "private names in tests": (0, 0),
    "lines of tests, % of the code's": (80, 80),
}
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
BRANCHES = (ast.If, ast.For, ast.While, ast.Try, ast.IfExp, ast.Match)


def cognitive(node, depth=0):
    total = 0
    for child in ast.iter_child_nodes(node):
        branch = isinstance(child, BRANCHES)
        deeper = branch or isinstance(child, (*FUNCTIONS, ast.Lambda))
        total += branch * (1 + depth) + isinstance(child, ast.BoolOp)
        total += cognitive(child, depth + deeper)
    return total


def measure(node, text, place):
    inside, pending = [], list(ast.iter_child_nodes(node))
    while pending:
        child = pending.pop()
        inside.append(child)
        if not isinstance(child, (*FUNCTIONS, ast.ClassDef)):
            pending += ast.iter_child_nodes(child)
    names = {child.id for child in inside if isinstance(child, ast.Name)}
    names |= {f".{child.attr}" for child in inside if isinstance(child, ast.Attribute)}
    span = text[node.lineno - 1 : node.end_lineno]
    lines = len(span) - sum(not line.strip() for line in span)
    if ast.get_docstring(node):
        lines -= node.body[0].end_lineno - node.body[0].lineno + 1
    nodes = sum(isinstance(child, ast.expr) for child in inside) / max(lines, 1)
    figures = {"lines": lines, "nodes": nodes, "names": len(names)}
    return figures | {"cognitive": cognitive(node), "place": place}


@cache
def functions(package):
    found = []
    for path in sorted((ROOT / package).rglob("*.py")):
        if "examples" in path.parts:  # files as users write them
            continue
        text = path.read_text("utf-8")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, FUNCTIONS):
                place = f"{path.parent.relative_to(ROOT)}/{path.stem}.{node.name}"
                found.append(measure(node, text.splitlines(), place))
    return found


@pytest.mark.parametrize("package", PACKAGES)
@pytest.mark.parametrize("figure", FIGURES)
def test_functions_are_no_denser_than_they_were(figure, package):
    key, share = figure.replace(" a line", "").split(", ")
    chosen = functions(package)
    if key in ("nodes", "names"):
        chosen = [one for one in chosen if one["lines"] >= 5]
    if share == "largest":
        chosen = [one for one in chosen if not EQUATIONS.search(one["place"])]
    ranked = sorted(chosen, key=lambda one: one[key])
    place = -1 if share == "largest" else len(ranked) * int(share[1:]) // 100
    value = round(ranked[place][key], 1)
    densest = [f"{one[key]:6.1f}  {one['place']}" for one in ranked[:-11:-1]]
    aim, today = FIGURES[figure]
    message = "\n".join([f"{figure} of {package}, aim {aim}", *densest])
    assert value <= max(aim, today[PACKAGES.index(package)]), message


def private_names(text):
    # of named tuples, of os, of asyncio's loops and of notebooks
    public = {
        "_replace",
        "_asdict",
        "_fields",
        "_make",
        "_exit",
        "_selector",
        "_repr_html_",
    }
    names = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.alias):
            names.append(node.name)
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value) != "self":
            names.append(node.attr)
    return [one for one in names if re.match("_[^_]", one) and one not in public]


@pytest.mark.parametrize("figure", TOTALS)
def test_the_project_as_a_whole_is_no_denser_than_it_was(figure):
    files = [one for name in PACKAGES for one in (ROOT / name).rglob("*.py")]
    code = "".join(one.read_text("utf-8") for one in files)
    tests = [one.read_text("utf-8") for one in (ROOT / "tests").rglob("*.py")]
    lines = "".join(tests).count("\n")
    settings = (ROOT / "pyproject.toml").read_text("utf-8")
    values = {
        "exceptions from the formatter": len(re.findall("fmt: (?:skip|off)", code)),
        "exceptions from sorted imports": settings.count("I001"),
        "private names in tests": sum(len(private_names(text)) for text in tests),
        "lines of tests, % of the code's": round(100 * lines / code.count("\n")),
    }
    aim, today = TOTALS[figure]
    assert values[figure] <= max(aim, today), f"{figure}: {values[figure]}, aim {aim}"
