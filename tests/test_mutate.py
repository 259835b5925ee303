"""Faults are put where a module has them, and every module has tests that stand beside it."""

import ast
import subprocess
import sys
from pathlib import Path

import covered_tests
import mutate
import pytest

SOURCE = '''"""A docstring -1."""
from typing import NamedTuple

LIMIT: "float | None" = 2.5


def half(x: "int | None", *, go: bool = True) -> float | None:
    """Half of x + 1."""
    if x is None or not go:
        raise ValueError("none")
    y = x / 2 - 1
    return y if y < LIMIT else -LIMIT
'''
EXPECTED = {
    "sign": {"y = x * 2 - 1", "y = x / 2 + 1", "return y if y < LIMIT else LIMIT"},
    "constant": {'LIMIT: "float | None" = 2.75', "y = x / 3 - 1", "y = x / 2 - 2"},
    "condition": {
        "if not x is None or not go:",
        "if x is None and not go:",
        "if x is None or  go:",
        "return y if not y < LIMIT else -LIMIT",
    },
    "comparison": {"if x is not None or not go:", "return y if y >= LIMIT else -LIMIT"},
    "dropped": {"pass"},
    "return": {"return None"},
}


@pytest.mark.parametrize("kind", EXPECTED)
def test_faults_of_a_kind_are_where_the_module_has_them(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(mutate, "ROOT", tmp_path)
    (tmp_path / f"{kind}.py").write_text(SOURCE)
    found = set()
    for fault in mutate.faults(f"{kind}.py", kind):
        changed = fault.applied(SOURCE)
        ast.parse(changed)
        pairs = zip(SOURCE.splitlines(), changed.splitlines(), strict=True)
        (after,) = (b.strip() for a, b in pairs if a != b)
        found.add(after)
        assert SOURCE.splitlines()[fault.line - 1] not in changed.splitlines()
    assert found == EXPECTED[kind]


def test_every_module_has_tests_that_stand_beside_it():
    modules = mutate.chosen(list(mutate.PACKAGES))
    assert len(modules) > 200
    missing = {
        test
        for module in modules
        for test in mutate.beside(module)
        if not (mutate.ROOT / test).is_file()
    }
    assert not missing
    assert mutate.beside("shipgym/envs/sb3.py") == ["tests/shipgym/test_sb3.py"]
    assert "tests/golden/test_seas.py" in mutate.beside("shipgym/sea/wind.py")


def test_what_is_drawn_follows_from_the_seed():
    modules = mutate.chosen(["shipgym/sea", "identification/estimators/l_curve.py"])
    first, again, other = (list(mutate.drawn(modules, 5, seed)) for seed in (1, 1, 2))
    assert first == again != other
    assert len(set(first)) == 5


def test_a_copy_of_the_tree_is_what_is_changed(tmp_path):
    copy = mutate.copied(tmp_path)
    name = "shipgym/sea/wind.py"
    assert (copy / name).read_bytes() == (mutate.ROOT / name).read_bytes()
    assert Path(copy / "pyproject.toml").is_file()
    assert not (copy / ".git").exists()


def test_a_fault_is_gone_when_it_is_taken_out(tmp_path):
    """Bytecode of a module with a fault, made within the same second, is not that of the module without."""
    path = tmp_path / "module_with_a_fault.py"
    command = [sys.executable, "-c", "import module_with_a_fault as m; print(m.X)"]
    found = []
    for text, later in (
        ("X = 1\n", 0),
        ("X = 2\n", next(mutate.LATER)),
        ("X = 1\n", 0),
    ):
        mutate.written_at(path, text, 1_700_000_000 + later)
        asked = subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, check=True
        )
        found.append(asked.stdout.strip())
    assert found == ["1", "2", "1"]


def test_tests_that_reach_a_line_come_first_and_the_cheapest_file_before_others(
    monkeypatch,
):
    known = {
        "slow.py": {
            "tests": {"s1": 3.0, "s2": 1.0, "s3": 0.1},
            "lines": {"m.py": {"7": [0, 1], "9": [2]}},
        },
        "fast.py": {
            "tests": {"f1": 0.5, "f2": 0.2},
            "lines": {"m.py": {"8": [0]}, "n.py": {"7": [1]}},
        },
    }
    monkeypatch.setattr(
        covered_tests.Maps, "read", lambda maps, folder, test, plain: known[test]
    )
    maps = covered_tests.Maps(Path("nowhere"))
    first, seconds = maps.ordered(Path(), list(known), "m.py", range(7, 9), plain=False)
    assert list(first.items()) == [("f1", 0.5), ("s2", 1.0), ("s1", 3.0)]
    assert seconds == known["slow.py"]["tests"] | known["fast.py"]["tests"]


def test_a_statement_is_all_its_lines_and_a_compound_one_its_head():
    source = "def f(\n    x,\n):\n    y = g(\n        x,\n    )\n    return y\n"
    found = [list(mutate.statement(source, line)) for line in (2, 5, 7)]
    assert found == [[1, 2, 3], [4, 5, 6], [7]]
