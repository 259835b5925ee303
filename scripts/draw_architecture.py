"""Draw the pictures of `docs/architecture.md` from the code.

They are the rooms with their imports, and a step.

`python scripts/draw_architecture.py`; a test compares the pictures with what this
draws.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
PACKAGES = ("agents", "identification", "shipgym")

#: Column, row and contents of each room, package by package: a room is expected to
#: import those named behind it, and not those before it.
ROOMS: dict[str, tuple[float, int, str]] = {
    "agents.cli": (2, 0, "the command shipgym"),
    "agents.benchmarking": (2, 1, "suites run, statistics, page"),
    "agents.training": (0.5, 1, "reinforcement learning, tuning"),
    "agents.verification": (3.5, 1, "the chain of shipgym autopilot"),
    "agents.rollouts": (1.25, 2, "one loop, metrics, replays"),
    "agents.jobs": (3.5, 2, "processes, Ray"),
    "agents.export": (2.37, 2, "C99, FMU"),
    "agents.policies": (0.5, 3, "learned policies, ONNX"),
    "agents.controllers": (2, 3, "PID, LQ, LQG, wheel-over, MPC"),
    "agents.suites": (3.5, 3, "tasks and seeds of benchmarks"),
    "identification.design": (0.5, 0, "which terms, which trial next"),
    "identification.pipeline": (2, 0, "identify and its routes"),
    "identification.models": (4, 0, "refinement, priors"),
    "identification.judging": (3, 1, "prediction, choice, certainty"),
    "identification.pipeline.result": (1.6, 1, "what identify returns"),
    "identification.report": (0.2, 1, "pages, figures, summary"),
    "identification.estimators": (1.33, 2, "LS-SVM, recursive, others"),
    "identification.samples": (4, 2, "samples, preprocessing"),
    "shipgym.envs": (0.7, 0, "Gymnasium, single and vector"),
    "shipgym.pages": (4, 0, "HTML from templates"),
    "shipgym.plots": (2.8, 0, "figures"),
    "shipgym.episodes": (0.7, 1, "episodes of many ships"),
    "shipgym.manoeuvres": (2.8, 1, "zigzag, turning, IMO"),
    "shipgym.instruments": (0.2, 2, "what sensors show"),
    "shipgym.tasks": (1.3, 2, "aims, rewards, observations"),
    "shipgym.sea": (2, 3, "current, wind, waves"),
    "shipgym.models": (3, 2, "ship models, simulated"),
    "shipgym.ships": (3, 3, "equations, reference ships"),
    "shipgym.trials": (4, 3, "recorded manoeuvres"),
    "shipgym.engine": (2.5, 4, "records, integrator, compiler"),
}
#: Files that are drawn apart from the room they lie in.
APART = {
    "identification.judging.fit": "identification.pipeline.result",
    "identification.pipeline.options": "identification.pipeline.result",
    "identification.text": "identification.pipeline.result",
    "shipgym.engine.episodes": "shipgym.episodes",
    "shipgym.engine.episode_program": "shipgym.episodes",
    "shipgym.engine.hooks": "shipgym.episodes",
    "shipgym.engine.judging": "shipgym.episodes",
    "shipgym.engine.sailing": "shipgym.episodes",
    "agents.job_results": "agents.jobs",
}
TITLES = {
    "identification.pipeline.result": "result.py, fit.py",
    "shipgym.episodes": "engine/episodes.py",
    "agents.jobs": "jobs.py, job_results.py",
}
BACK_GROUND = {"agents": "#f6efe4", "identification": "#e9f1ea", "shipgym": "#e8eef6"}

Edges = set[tuple[str, str]]


def modules() -> dict[str, Path]:
    """Files of the three packages by the names of their modules."""
    found = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports() -> Edges:
    """Imports between files, those in functions and for type checking included."""
    files = modules()
    return {
        (name, other)
        for name, path in files.items()
        for other in _imported(name, path, files)
    }


def _imported(name: str, path: Path, files: Mapping[str, Path]) -> set[str]:
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = (
                package.split(".")[: len(package.split(".")) - node.level + 1]
                if node.level
                else []
            )
            base = ".".join([*above, *([node.module] if node.module else [])])
            inner = {f"{base}.{alias.name}" for alias in node.names}
            found |= {one if one in files else base for one in inner}
    return (found & files.keys()) - {name}


def room(module: str) -> str:
    """The room that a file is drawn in; its own name where it is in none."""
    if module in APART:
        return APART[module]
    return ".".join(module.split(".")[:2])


def room_imports(edges: Iterable[tuple[str, str]]) -> Edges:
    """Which room imports which, also by way of a file that is in no room."""
    between = {(room(a), room(b)) for a, b in edges if room(a) != room(b)}
    drawn: Edges = set()
    for start in ROOMS:
        ahead = [b for a, b in between if a == start]
        seen = set(ahead)
        while ahead:
            name = ahead.pop()
            if name in ROOMS:
                drawn.add((start, name))
            elif "." in name:
                new = {b for a, b in between if a == name} - seen
                seen |= new
                ahead += new
    return {(a, b) for a, b in drawn if a != b}


def reached(edges: Edges, start: str) -> set[str]:
    """All that can be reached along arrows."""
    found: set[str] = set()
    ahead = [start]
    while ahead:
        here = ahead.pop()
        new = {b for a, b in edges if a == here} - found
        found |= new
        ahead += new
    return found


def arrows(edges: Iterable[tuple[str, str]]) -> tuple[Edges, Edges]:
    """Arrows within packages: down, less those that follow from others, and up."""
    order = {name: i for i, name in enumerate(ROOMS)}
    inside = {
        (a, b)
        for a, b in room_imports(edges)
        if a.partition(".")[0] == b.partition(".")[0]
    }
    down = {(a, b) for a, b in inside if order[a] < order[b]}
    short = {(a, b) for a, b in down if b not in reached(down - {(a, b)}, a)}
    return short, inside - down


WIDE, HIGH, PITCH, STEP, LEFT = 182, 46, 200, 88, 120


def draw_rooms() -> str:
    """The rooms of the three packages and which imports which."""
    tops, y = {}, 20
    for package in PACKAGES:
        tops[package] = y
        rows = 1 + max(
            row for name, (_, row, _) in ROOMS.items() if name.startswith(package)
        )
        y += rows * STEP + 26
    places = {
        name: (LEFT + column * PITCH, tops[name.partition(".")[0]] + 24 + row * STEP)
        for name, (column, row, _) in ROOMS.items()
    }
    short, back = arrows(imports())
    both = {(a, b) for a, b in short if (b, a) in back}
    lines = [line for package in PACKAGES for line in _band(package, tops)]
    lines += _arrows_down(short, both, places)
    lines += [_arrow_up(a, b, places) for a, b in sorted(back) if (b, a) not in both]
    lines += [line for name in ROOMS for line in _box(name, places[name])]
    lines += _legend(y)
    return picture(
        LEFT + 5 * PITCH + 4,
        y + 34,
        "Rooms of the three packages and their imports",
        lines,
    )


def _band(package: str, tops: Mapping[str, int]) -> Iterator[str]:
    rows = 1 + max(
        row for name, (_, row, _) in ROOMS.items() if name.startswith(package)
    )
    height, top = rows * STEP + 4, tops[package]
    colour = BACK_GROUND[package]
    yield (
        f'<rect x="8" y="{top}" width="{LEFT + 5 * PITCH - 12}" height="{height}"'
        f' rx="8" fill="{colour}"/>'
    )
    yield text(20, top + 24, package, size=15, weight="bold")
    if package != PACKAGES[0]:
        yield line_to(f"M64 {top - 60} L64 {top + 4}", width=2.5)


def _box(name: str, place: tuple[float, float]) -> Iterator[str]:
    x, y = place
    title = TITLES.get(name, name.partition(".")[2])
    yield (
        f'<rect x="{x:g}" y="{y:g}" width="{WIDE}" height="{HIGH}" rx="5" fill="white"'
        ' stroke="#456"/>'
    )
    yield text(x + WIDE / 2, y + 19, title, anchor="middle", weight="bold")
    yield text(x + WIDE / 2, y + 36, ROOMS[name][2], size=11, anchor="middle")


def _arrows_down(
    short: Edges, both: Edges, places: Mapping[str, tuple[float, float]]
) -> Iterator[str]:
    """Arrows from a box's lower side to another's upper side, spread over the sides."""

    def by_place(name: str) -> tuple[float, str]:
        x, _ = places[name]
        return x, name

    for a, b in sorted(short):
        xa, ya = places[a]
        xb, yb = places[b]
        if ya == yb:
            begin, end = (xa + WIDE, xb) if xb > xa else (xa, xb + WIDE)
            level = ya + HIGH / 2
            path = f"M{begin:g} {level:g} L{end:g} {level:g}"
        else:
            below = [d for c, d in short if c == a and places[d][1] > ya]
            above = [c for c, d in short if d == b and places[c][1] < yb]
            begin = xa + WIDE * _share(sorted(below, key=by_place), b)
            end = xb + WIDE * _share(sorted(above, key=by_place), a)
            bottom = ya + HIGH
            path = _curve(begin, bottom, end, yb, bend=(bottom + yb) / 2)
        yield line_to(path, both=(a, b) in both)


def _share(names: list[str], name: str) -> float:
    """Part of a side at which the arrow of one of several names stands."""
    return (1 + names.index(name)) / (1 + len(names))


def _arrow_up(a: str, b: str, places: Mapping[str, tuple[float, float]]) -> str:
    """An import against the order, dashed."""
    xa, ya = places[a]
    xb, yb = places[b]
    if ya == yb:
        begin = xa + WIDE * 0.5
        end = xb + WIDE * 0.2
        bend = ya - 22
        bottom = yb
    else:
        begin_side = 0.85 if xb >= xa else 0.15
        end_side = 0.9 if xb <= xa else 0.1
        begin = xa + WIDE * begin_side
        end = xb + WIDE * end_side
        bend = (ya + yb + HIGH) / 2
        bottom = yb + HIGH
    return line_to(_curve(begin, ya, end, bottom, bend), dashed=True)


def _curve(x1: float, y1: float, x2: float, y2: float, bend: float) -> str:
    """Path of a curve that leaves and arrives upright, by way of the height `bend`."""
    return f"M{x1:g} {y1:g} C{x1:g} {bend:g} {x2:g} {bend:g} {x2:g} {y2:g}"


def _legend(y: float) -> Iterator[str]:
    level = y + 8
    meanings: list[tuple[int, str, dict[str, bool]]] = [
        (0, "imports; left out where it follows from others", {}),
        (340, "both ways, without a circle of files", {"both": True}),
        (640, "against the order, without a circle", {"dashed": True}),
    ]
    for offset, meaning, style in meanings:
        begin = LEFT + offset
        end = begin + 40
        yield line_to(f"M{begin} {level} L{end} {level}", **style)
        yield text(end + 8, level + 4, meaning, size=11)


GIVERS = {
    "the ship": "#cfe0f5",
    "the sea": "#cdeae4",
    "the sensor set": "#e3d8f2",
    "the task": "#f8e3b8",
}
FILES = {
    "the ship": "a file of shipgym/ships, or yours",
    "the sea": "shipgym/sea/open_sea.py",
    "the sensor set": "shipgym/instruments, or yours",
    "the task": "a file of shipgym/tasks, or yours",
}
SHIP_FUNCTIONS = (
    "accelerations",
    "shaft_acceleration",
)  # hooks in `shipgym.engine.motion`
SELDOM = ("take_events", "begin_lanes")
HOUSEKEEPING = ("are_finite", "choose_ended", "outputs_in", "tile_of")
OFTEN = {"sail_lanes": ", in each substep"}
ENGINE = ROOT / "shipgym" / "engine"
STEP_FILES = ("episodes.py", "sailing.py", "judging.py", "tiles.py")
#: Givers by the constants that hooks raise errors with.
RAISED = {
    "SHIP": "the ship",
    "SEA": "the sea",
    "SENSORS": "the sensor set",
    "TASK": "the task",
}


def stages() -> dict[str, tuple[str, list[tuple[str, str]]]]:
    """A step in order: docstring and calls of each function, with the givers."""
    functions = {}
    for name in STEP_FILES:
        functions |= _functions(ENGINE / name)
    functions["sail_lanes"] = functions["sail_in_one_loop"]  # the hook of most ships
    found = {}
    for name in sorted(_called(functions["run"]), key=SELDOM.__contains__):
        if name in functions and name not in HOUSEKEEPING:
            about = (ast.get_docstring(functions[name]) or "").partition("\n")[0]
            found[name] = about, list(_given(name, functions))
    return found


def _functions(path: Path) -> dict[str, ast.FunctionDef]:
    """Functions of a file by name."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    return {node.name: node for node in body if isinstance(node, ast.FunctionDef)}


def givers() -> dict[str, str]:
    """Who gives each hook, as the error says that it raises until then."""
    found = {}
    for name, function in _functions(ENGINE / "hooks.py").items():
        for constant in ast.walk(function):
            if isinstance(constant, ast.Name) and constant.id in RAISED:
                found[name] = RAISED[constant.id]
    return found


def _called(function: ast.FunctionDef) -> list[str]:
    """Names of the functions that a function calls, in the order of its lines."""
    names = []
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            names.append(node.func)
    names.sort(key=lambda name: (name.lineno, name.col_offset))
    distinct = dict.fromkeys(name.id for name in names)
    return list(distinct)


def _given(
    name: str, functions: Mapping[str, ast.FunctionDef]
) -> Iterator[tuple[str, str]]:
    for called in _called(functions[name]):
        if called == "sail":
            yield from (("the ship", one) for one in SHIP_FUNCTIONS)
        if giver := givers().get(called):
            yield giver, called.removeprefix("task_")
        if called in functions:
            yield from _given(called, functions)


TALL = 46


def draw_step() -> str:
    """What a step of the engine calls, in order, and where it comes from."""
    rows = stages()
    top = 212
    bottom = top + 44 + len(rows) * (TALL + 16)
    lines = [
        line
        for i, giver in enumerate(GIVERS)
        for line in _source(giver, 20 + i * 236, rows)
    ]
    lines += _compiler()
    lines.append(
        f'<rect x="20" y="{top}" width="920" height="{bottom - top}" rx="8"'
        ' fill="#f4f5f7" stroke="#456"/>'
    )
    lines.append(
        text(
            34,
            top + 24,
            "step: for each tile of 64 ships (engine/episodes.py)",
            weight="bold",
        )
    )
    for i, (name, (about, given)) in enumerate(rows.items()):
        lines += _stage(
            name, about, given, top + 40 + i * (TALL + 16), last=i == len(rows) - 1
        )
    lines.append(line_to(f"M140 {bottom} L140 {bottom + 30}"))
    answer = "observations, rewards, terminated, truncated, infos"
    lines.append(text(154, bottom + 24, answer, size=12))
    return picture(960, bottom + 44, "A step of the engine", lines)


def _source(
    giver: str, x: float, rows: Mapping[str, tuple[str, list[tuple[str, str]]]]
) -> Iterator[str]:
    names = dict.fromkeys(
        one for _, given in rows.values() for who, one in given if who == giver
    )
    yield (
        f'<rect x="{x}" y="16" width="212" height="96" rx="5" fill="{GIVERS[giver]}"'
        ' stroke="#456"/>'
    )
    yield text(x + 106, 36, giver, anchor="middle", weight="bold")
    yield text(x + 106, 53, FILES[giver], size=11, anchor="middle")
    for i, line in enumerate(_lines(list(names), 30)):
        yield text(
            x + 106, 74 + 15 * i, line, size=11, anchor="middle", family="monospace"
        )
    yield line_to(f"M{x + 106} 112 L{x + 106} 138")


def _lines(words: Iterable[str], width: int) -> list[str]:
    lines = [""]
    for word in words:
        if lines[-1] and len(lines[-1]) + len(word) + 2 > width:
            lines.append("")
        lines[-1] += (", " if lines[-1] else "") + word
    return lines


def _compiler() -> Iterator[str]:
    yield (
        '<rect x="20" y="138" width="920" height="44" rx="5" fill="white"'
        ' stroke="#456"/>'
    )
    told = "specialise.py puts these plain functions in the places that the loop names"
    yield text(480, 157, told, anchor="middle", weight="bold", size=12)
    kept = "compiling.py makes machine code of the whole, or reads it from the cache"
    yield text(480, 173, kept, anchor="middle", size=11)
    yield line_to("M480 182 L480 212")


def _stage(
    name: str, about: str, given: list[tuple[str, str]], y: float, last: bool
) -> Iterator[str]:
    seldom = name in SELDOM
    dash = ' stroke-dasharray="5 3"' if seldom else ""
    yield (
        f'<rect x="34" y="{y}" width="212" height="{TALL}" rx="5" fill="white"'
        f' stroke="#456"{dash}/>'
    )
    yield text(
        140, y + 19, name, anchor="middle", weight="bold", family="monospace", size=12
    )
    how = "ship by ship, seldom" if seldom else "64 ships at once" + OFTEN.get(name, "")
    yield text(140, y + 35, how, anchor="middle", size=11)
    yield text(262, y + 15, about.replace("`", ""), size=12)
    x = 262.0
    for giver, one in dict.fromkeys(given):
        width = 7.0 * len(one) + 18
        size = f'width="{width - 6:g}" height="20" rx="9"'
        yield f'<rect x="{x:g}" y="{y + 23}" {size} fill="{GIVERS[giver]}"/>'
        yield text(
            x + width / 2 - 3, y + 37, one, size=11, anchor="middle", family="monospace"
        )
        x += width
    if not last:
        yield line_to(f"M140 {y + TALL} L140 {y + TALL + 16}")


def text(
    x: float,
    y: float,
    words: str,
    size: int = 13,
    anchor: str = "start",
    weight: str = "normal",
    family: str = "sans-serif",
) -> str:
    """Words at a place."""
    return (
        f'<text x="{x:g}" y="{y:g}" font-family="{family}" font-size="{size}"'
        f' font-weight="{weight}" text-anchor="{anchor}"'
        f' fill="#123">{escape(words)}</text>'
    )


def line_to(
    path: str, width: float = 1.3, both: bool = False, dashed: bool = False
) -> str:
    """An arrow along a path."""
    colour, mark = ("#b4541a", "back") if dashed else ("#456", "ahead")
    more = ' stroke-dasharray="4 3"' if dashed else ""
    more += ' marker-start="url(#start)"' if both else ""
    return (
        f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width:g}" '
        f'marker-end="url(#{mark})"{more}/>'
    )


def picture(width: float, height: float, title: str, lines: Iterable[str]) -> str:
    """An SVG file."""
    marks = "".join(
        f'<marker id="{name}" viewBox="0 0 8 8" refX="{at}" refY="4" markerWidth="8"'
        f' markerHeight="8" markerUnits="userSpaceOnUse" orient="auto"><path d="{path}"'
        f' fill="{colour}"/></marker>'
        for name, at, path, colour in (
            ("ahead", 8, "M0 0 L8 4 L0 8 z", "#456"),
            ("back", 8, "M0 0 L8 4 L0 8 z", "#b4541a"),
            ("start", 0, "M8 0 L0 4 L8 8 z", "#b4541a"),
        )
    )
    return "\n".join(
        [
            (
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g}'
                f' {height:g}" role="img">'
            ),
            f"<title>{escape(title)}</title>",
            f"<defs>{marks}</defs>",
            f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
            *lines,
            "</svg>\n",
        ]
    )


PICTURES = {"rooms.svg": draw_rooms, "step.svg": draw_step}


def main() -> None:
    """Write the pictures."""
    for name, draw in PICTURES.items():
        (IMAGES / name).write_text(draw(), encoding="utf-8")


if __name__ == "__main__":
    main()
