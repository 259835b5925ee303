"""Put small faults into modules, one at a time, and see whether the tests beside the module notice.

`make mutate MODULES="shipgym/sea identification/estimators/l_curve.py"` draws 40 faults
of these modules, by default of all. `tests/beside.toml` says which tests stand beside a
module.

The faults: a sign or factor turned over, a constant 10 % larger, a condition or
comparison turned round, a statement dropped, a value not returned. Where they fit, they
are cosmic-ray's. Its own loop changes the files in place and runs the same tests for
all modules; here a copy of the tree is changed, and each module has its tests. (mutmut
puts a dispatcher around every function, which Numba does not compile.)

The tests that reach the line with the fault run first, quick ones before slow ones, in
a process that has the libraries loaded (`covered_tests.py`); what they do not notice,
all tests beside the module are asked for.

A fault that makes tests run into the time limit counts as noticed. Annotations,
imports, docstrings and what stands under TYPE_CHECKING have no faults.
"""

from __future__ import annotations

import argparse
import ast
import fnmatch
import itertools
import json
import multiprocessing
import os
import random
import shutil
import subprocess
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from queue import SimpleQueue

import parso
from cosmic_ray.ast import ast_nodes, get_ast, is_number
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators import (
    binary_operator_replacement,
    boolean_replacer,
    comparison_operator_replacement,
    unary_operator_replacement,
)
from cosmic_ray.operators.operator import Operator
from covered_tests import MISSED, PACKAGES, PRELOADED, Maps, noticed
from parso.tree import search_ancestor
from scipy.stats import binomtest

ROOT = Path(__file__).parents[1]
#: Kinds of statements that are not dropped.
KEPT = {"import_name", "import_from", "return_stmt", "global_stmt", "nonlocal_stmt"}
KEPT |= {"string", "strings", "keyword", "operator"}  # docstrings, pass, ...
#: Seconds by which modules with faults are younger, each by others.
LATER = itertools.count(1)


class OwnOperator(Operator):
    """An operator of our own; the examples are for cosmic-ray's own tests."""

    @classmethod
    def examples(cls):
        """Return none."""
        return ()


class LargerConstant(OwnOperator):
    """A number 10 % larger, an integer by at least one."""

    def mutation_positions(self, node):
        """Numbers but imaginary ones."""
        if is_number(node) and "j" not in node.value.lower():
            yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        """Return the larger number."""
        value = ast.literal_eval(node.value)
        larger = (
            value + max(1, value // 10)
            if isinstance(value, int)
            else 1.1 * value or 0.1
        )
        return parso.python.tree.Number(repr(larger), node.start_pos, node.prefix)


class DroppedStatement(OwnOperator):
    """A statement within a function that is left out."""

    def mutation_positions(self, node):
        """Simple statements but for those that do nothing, and those that return, which `LostReturn` has."""
        if (
            node.type == "simple_stmt"
            and node.children[0].type not in KEPT
            and search_ancestor(node, "funcdef")
        ):
            yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        """Return `pass` with the end of the line."""
        prefix = node.get_first_leaf().prefix
        return parso.python.tree.Name(
            f"pass{node.get_last_leaf().value}", node.start_pos, prefix
        )


class LostReturn(OwnOperator):
    """A function that returns None."""

    def mutation_positions(self, node):
        """Statements that return something else."""
        if node.type == "return_stmt" and node.children[1].get_code().strip() != "None":
            yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        """Return the statement without its value."""
        node.children[1] = parso.python.tree.Name(
            "None", node.children[1].start_pos, " "
        )
        return node


def _named(module, prefix: str, pairs: str) -> list[Operator]:
    """Cosmic-ray's operators of one kind: `Add_Sub` is written `+` to `-`."""
    return [getattr(module, f"{prefix}_{pair}")() for pair in pairs.split()]


COMPARED = "Lt_GtE LtE_Gt Gt_LtE GtE_Lt Eq_NotEq NotEq_Eq Is_IsNot IsNot_Is"
KINDS: dict[str, list[Operator]] = {
    "sign": [
        *_named(
            binary_operator_replacement,
            "ReplaceBinaryOperator",
            "Add_Sub Sub_Add Mul_Div Div_Mul",
        ),
        *_named(unary_operator_replacement, "ReplaceUnaryOperator", "Delete_USub"),
    ],
    "constant": [LargerConstant()],
    "condition": [
        boolean_replacer.AddNot(),
        boolean_replacer.ReplaceAndWithOr(),
        boolean_replacer.ReplaceOrWithAnd(),
        *_named(unary_operator_replacement, "ReplaceUnaryOperator", "Delete_Not"),
    ],
    "comparison": _named(
        comparison_operator_replacement, "ReplaceComparisonOperator", COMPARED
    ),
    "dropped": [DroppedStatement()],
    "return": [LostReturn()],
}


@dataclass(frozen=True)
class Fault:
    """One fault: the occurrence-th place of an operator in a module."""

    module: str
    line: int
    kind: str
    operator: int
    occurrence: int

    def applied(self, source: str) -> str:
        """Return the source with the fault in it."""
        return mutate_code(source, KINDS[self.kind][self.operator], self.occurrence)


def without_faults(source: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Return the stretches of a module that only type checkers read."""
    nodes: list[ast.AST | None] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.arg | ast.AnnAssign):
            nodes.append(node.annotation)
        elif isinstance(node, ast.FunctionDef):
            nodes.append(node.returns)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            nodes.append(node)
    return [
        ((n.lineno, n.col_offset), (n.end_lineno, n.end_col_offset)) for n in nodes if n
    ]


@cache
def parsed(
    module: str,
) -> tuple[list[tuple[tuple[int, int], tuple[int, int]]], list[parso.tree.NodeOrLeaf]]:
    """Return the stretches `without_faults`, and the nodes in the order in which cosmic-ray counts them."""
    source = (ROOT / module).read_text("utf-8")
    return without_faults(source), list(ast_nodes(get_ast(source)))


@cache
def faults(module: str, kind: str) -> list[Fault]:
    """Return all faults of one kind that a module may have."""
    passed, nodes = parsed(module)
    found = []
    for number, operator in enumerate(KINDS[kind]):
        places = [
            (place, node)
            for node in nodes
            for place in operator.mutation_positions(node)
        ]
        for occurrence, ((start, _), node) in enumerate(places):
            # * and ** before arguments are no products
            signature = node.type == "operator" and node.parent.type not in (
                "arith_expr",
                "term",
            )
            if not signature and not any(
                first <= start <= last for first, last in passed
            ):
                found.append(Fault(module, start[0], kind, number, occurrence))
    return found


def drawn(modules: list[str], count: int, seed: int) -> Iterator[Fault]:
    """Draw faults: modules by their length, then kinds alike, then places alike, none twice."""
    random_ = random.Random(seed)
    lengths = [
        len((ROOT / module).read_text("utf-8").splitlines()) for module in modules
    ]
    seen: set[Fault] = set()
    for _ in range(100 * count):
        module = random_.choices(modules, lengths)[0]
        places = faults(module, random_.choice(list(KINDS)))
        if places and (fault := random_.choice(places)) not in seen:
            seen.add(fault)
            yield fault
        if len(seen) == count:
            return


def beside(module: str) -> list[str]:
    """Return the files of the tests that stand beside a module."""
    table = tomllib.loads((ROOT / "tests" / "beside.toml").read_text("utf-8"))
    package, _, rest = module.removesuffix(".py").partition("/")
    names = next(
        (v for k, v in table[package].items() if fnmatch.fnmatch(rest, k)),
        Path(rest).name,
    )
    paths = (name if "/" in name else f"{package}/{name}" for name in names.split())
    return ["tests/{}/test_{}.py".format(*path.split("/")) for path in paths]


def statement(source: str, line: int) -> range:
    """Return the lines of the innermost simple statement, or head of a compound one, that holds a line."""
    lines = range(line, line + 1)
    for node in ast.walk(ast.parse(source)):  # from the outermost inwards
        if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or 0):
            body = getattr(node, "body", None)
            last = body[0].lineno - 1 if body else node.end_lineno or 0
            if line <= max(last, node.lineno):
                lines = range(node.lineno, max(last, node.lineno) + 1)
    return lines


def copied(folder: Path) -> Path:
    """Copy the tree as it is, without what git ignores."""
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    for name in subprocess.run(
        listed, cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split("\n"):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


def written_at(path: Path, source: str, when: int) -> None:
    """Write a module with a time of its own: by its whole seconds Python tells whether bytecode is of it."""
    path.write_text(source, "utf-8")
    os.utime(path, (when, when))


def tried(
    fault: Fault, folders: SimpleQueue[Path], maps: Maps, limit_s: float
) -> dict[str, object]:
    """Put one fault into a copy of the tree, run the tests beside it, and take it out again."""
    folder = folders.get()
    path = folder / fault.module
    source = path.read_text("utf-8")
    changed, written = fault.applied(source), int(path.stat().st_mtime)
    try:
        lines = statement(source, fault.line)
        result = noticed(
            maps, folder, beside(fault.module), fault.module, lines, limit_s
        )
        begun = time.monotonic()
        written_at(path, changed, written + next(LATER))
        found = result()
    finally:
        written_at(path, source, written)
        folders.put(folder)
    pairs = zip(source.splitlines(), changed.splitlines(), strict=False)
    before, after = next(((a.strip(), b.strip()) for a, b in pairs if a != b), ("", ""))
    seconds = round(time.monotonic() - begun, 1)
    return asdict(fault) | {
        "result": found.outcome,
        "before": before,
        "after": after,
        "test": found.report,
        "seconds": seconds,
    }


def chosen(names: list[str]) -> list[str]:
    """Return the modules of files and folders."""
    paths = [
        p
        for name in names
        for p in (
            [ROOT / name] if name.endswith(".py") else (ROOT / name).rglob("*.py")
        )
    ]
    return sorted({str(p.relative_to(ROOT)) for p in paths})


def main() -> None:
    """Draw faults, try them, and print those that nobody noticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "modules", nargs="*", default=PACKAGES, help="files and folders; by default all"
    )
    parser.add_argument(
        "--count", type=int, default=40, help="how many faults are drawn"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--limit", type=float, default=1800.0, help="seconds for the tests of one fault"
    )
    parser.add_argument(
        "--maps",
        type=Path,
        default=ROOT / "build" / "mutate",
        help="where maps are kept",
    )
    parser.add_argument(
        "--log",
        type=Path,
        help="JSON lines, a fault each; those in it already are not tried again",
    )
    parser.add_argument(
        "--trust",
        action="store_true",
        help="make no maps: do not run the tests without a fault first",
    )
    asked = parser.parse_args()
    multiprocessing.get_context("forkserver").set_forkserver_preload(PRELOADED)
    log = (
        asked.log.read_text("utf-8").splitlines()
        if asked.log and asked.log.exists()
        else []
    )
    results = [json.loads(line) for line in log]
    done = {tuple(result[name] for name in Fault.__annotations__) for result in results}
    wanted = [
        f
        for f in drawn(chosen(asked.modules), asked.count, asked.seed)
        if tuple(asdict(f).values()) not in done
    ]
    with tempfile.TemporaryDirectory() as temporary:
        folders: SimpleQueue[Path] = SimpleQueue()
        for job in range(asked.jobs):
            folders.put(copied(Path(temporary) / str(job)))
        maps = Maps(asked.maps.resolve(), not asked.trust)
        with ThreadPoolExecutor(asked.jobs) as pool:
            tasks = [
                pool.submit(tried, fault, folders, maps, asked.limit)
                for fault in wanted
            ]
            for task in as_completed(tasks):
                result = task.result()
                results.append(result)
                if asked.log:
                    with asked.log.open("a", encoding="utf-8") as stream:
                        stream.write(json.dumps(result) + "\n")
                if result["result"] == MISSED:
                    print(
                        "{module}:{line} {kind}: {before}  ->  {after}".format(
                            **result
                        ),
                        flush=True,
                    )
    count = sum(result["result"] != MISSED for result in results)
    low, high = binomtest(count, len(results)).proportion_ci(method="wilson")
    share = f"{count / len(results):.0%} (95 %: {low:.0%} to {high:.0%})"
    print(f"{count} of {len(results)} faults noticed, {share}")


if __name__ == "__main__":
    main()
