"""Layers of rooms: what may import what, and the picture of it for the documentation.

`python scripts/draw_architecture.py` draws `docs/images/rooms.svg`; a test holds the
layers against the imports in the code, and the picture against what this draws.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "images" / "rooms.svg"

Layer = Mapping[str, str]
#: Rooms (folders, or files at the top of a package) with what is in them, layer by
#: layer from the bottom: a room imports rooms of lower layers of its package, and
#: packages below. Files at the top that are not named are the package's base.
LAYERS: dict[str, list[Layer]] = {
    "shipgym": [
        {"engine": "records, mathematics, compiled loops"},
        {"ships": "equations, structures, particulars"},
        {"sea": "current, wind, waves", "trials": "logs, ship file, Trial"},
        {"models": "ShipModel, its file, simulation"},
        {"instruments": "what sensors show", "manoeuvres": "zigzag, turning, IMO"},
        {"tasks": "aims, rewards, observations", "plots": "figures"},
        {"envs": "Gymnasium, single and vector", "pages": "HTML from templates"},
    ],
    "identification": [
        {"samples": "from trials to regressions"},
        {"estimators": "LS-SVM, recursive methods, searches"},
        {"models": "structures fitted, output error, priors"},
        {"judging": "prediction, choice, certainty"},
        {"pipeline": "identify and its routes"},
        {"design": "which terms, which trial next"},
        {"report": "page, figures, summary"},
    ],
    "agents": [
        {"suites": "tasks and seeds of the benchmark"},
        {"controllers": "PID, LQ, LQG, wheel-over, MPC"},
        {"policies": "learned policies, ONNX"},
        {"agent_file": "the file of any agent", "jobs": "processes, Ray"},
        {"rollouts": "one loop, metrics, replays", "export": "C99, FMU"},
        {"benchmarking": "runs, statistics, page", "training": "learning, tuning"},
        {"verification": "the chain of shipgym autopilot"},
        {"cli": "the command shipgym"},
    ],
}
COLOURS = {"agents": "#f6efe4", "identification": "#e9f1ea", "shipgym": "#e8eef6"}
WIDTH, HEIGHT, GAP, MARGIN, TITLE = 250, 46, 12, 16, 28


def modules() -> dict[str, Path]:
    """Files of the three packages by the names of their modules."""
    found = {}
    for package in LAYERS:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports() -> set[tuple[str, str]]:
    """Imports between files, those in functions and for type checking included."""
    files = modules()
    return {
        (name, other)
        for name, path in files.items()
        for other in _imported(name, path, files)
    }


def _imported(name: str, path: Path, files: Mapping[str, Path]) -> set[str]:
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            kept = len(package.split(".")) - node.level + 1
            above = package.split(".")[:kept] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            inner = {f"{base}.{alias.name}" for alias in node.names}
            found |= {one if one in files else base for one in inner}
    return (found & files.keys()) - {name}


def level(module: str) -> tuple[int, int, str]:
    """Rank of a module's package and of its room, 0 for the base, and the room."""
    package, _, rest = module.partition(".")
    room = rest.partition(".")[0]
    rank = list(LAYERS).index(package)
    if module == package:  # its __init__: public names, from every room
        return rank, len(LAYERS[package]) + 1, package
    if room == "examples":  # users' files, above the public names
        return rank, len(LAYERS[package]) + 2, package
    for k, layer in enumerate(LAYERS[package], 1):
        if room in layer:
            return rank, k, f"{package}.{room}"
    return rank, 0, package


def upward(edges: set[tuple[str, str]]) -> list[str]:
    """Imports that do not run down: to a higher layer, or to another room of one."""
    found = []
    for importer, imported in sorted(edges):
        *below, own = level(importer)
        *above, other = level(imported)
        if own != other and below <= above:
            found.append(f"{importer} -> {imported}")
    return found


def picture() -> str:
    """The layers as boxes, packages side by side, the lowest layer at the bottom."""
    rows = max(len(layers) for layers in LAYERS.values())
    height = TITLE + rows * (HEIGHT + GAP) + 2 * MARGIN
    boxes = []
    left = MARGIN
    for package, layers in LAYERS.items():
        columns = max(len(layer) for layer in layers)
        width = columns * (WIDTH + GAP) + GAP
        boxes.append(_rectangle(left, MARGIN, width, height - 2 * MARGIN, package))
        boxes.append(_text(left + GAP, MARGIN + 20, package, "title"))
        for k, layer in enumerate(layers):
            y = height - MARGIN - (k + 1) * (HEIGHT + GAP)
            for column, (room, content) in enumerate(layer.items()):
                x = left + GAP + column * (WIDTH + GAP)
                boxes.append(_rectangle(x, y, WIDTH, HEIGHT, None))
                boxes.append(_text(x + 10, y + 19, room, "room"))
                boxes.append(_text(x + 10, y + 36, content, "content"))
        left += width + MARGIN
    style = (
        "text{font-family:sans-serif;fill:#222}.title{font-size:16px;font-weight:bold}"
        ".room{font-size:14px;font-weight:bold}.content{font-size:12px}"
    )
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left} {height}"'
        f' width="{left}" height="{height}" role="img"'
        ' aria-label="Rooms of the packages in layers; imports run down and to the'
        ' left">'
    )
    return "\n".join([head, f"<style>{style}</style>", *boxes, "</svg>", ""])


def _rectangle(x: int, y: int, width: int, height: int, package: str | None) -> str:
    fill = COLOURS[package] if package else "#ffffff"
    return (
        f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="6"'
        f' fill="{fill}" stroke="#8a8a8a"/>'
    )


def _text(x: int, y: int, text: str, kind: str) -> str:
    return f'<text x="{x}" y="{y}" class="{kind}">{escape(text)}</text>'


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
    print("\n".join(upward(imports())))
