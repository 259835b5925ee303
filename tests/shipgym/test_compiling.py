"""Compiled loops: the same numbers as plain Python, hooks filled, records where their
rows are."""

import os
import subprocess
import sys
from dataclasses import replace
from types import FunctionType, ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit

import shipgym
from shipgym.engine.compiling import compiled
from shipgym.engine.fingerprint import fingerprint
from shipgym.engine.loops import ship_loop

SAIL = """
import numpy as np, shipgym
found = []
for name in ("mariner", "container", "tanker", "kvlcc2"):
    model = shipgym.load_model(name)
    commands = np.tile(model.service_command, (50, 1))
    commands[:, 0] = 0.2
    for weather in (None, "rough"):
        trial = model.simulate(commands, 0.5, weather=weather, seed=1)
        found += [float(trial[channel][-1]) for channel in ("x", "psi", "v", "r")]
print(repr(found))
"""


def run(code: str, *arguments: str, **environment: str) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return result.stdout.strip()


def test_without_compiling_the_numbers_are_the_same():
    compiled_run, plain_run = eval(run(SAIL)), eval(run(SAIL, NUMBA_DISABLE_JIT="1"))
    np.testing.assert_allclose(plain_run, compiled_run, rtol=1e-9, atol=1e-12)


def test_importing_shipgym_leaves_the_heavy_libraries_alone():
    heavy = [
        "numba",
        "scipy",
        "control",
        "torch",
        "stable_baselines3",
        "plotly",
        "sklearn",
    ]
    code = f"import shipgym, sys; print([n for n in {heavy!r} if n in sys.modules])"
    assert run(code) == "[]"


def test_models_of_one_structure_share_what_is_compiled():
    model = shipgym.load_model("mariner-tls-svm")
    assert {id(draw.compiled) for draw in model.sample(5, 0)} == {id(model.compiled)}
    container = shipgym.load_model("container")
    changed = replace(container, coefficients={**container.coefficients, "m": 0.008})
    assert changed.compiled is container.compiled
    assert ship_loop(container.compiled, "simulate") is ship_loop(
        changed.compiled, "simulate"
    )


class Fix(NamedTuple):
    north: float
    east: float


class Anchor(NamedTuple):
    chain: float
    place: Fix


def looks_up(k):
    return TABLE[k] * helper(k) + tools.share(k)  # noqa: F821


def double(k):
    return 2.0 * k


def triple(k):
    return 3.0 * k


def table(shape, at, value=1.0, dtype=float):
    numbers = np.zeros(shape, dtype)
    numbers.flat[at] = value
    return numbers


@pytest.mark.parametrize(
    ("name", "one", "other"),
    [
        ("TABLE", table(2000, 1000), table(2000, 1001)),
        ("TABLE", np.zeros(2000), np.zeros(2000, np.float32)),
        ("TABLE", Fix, Anchor),
        ("helper", double, triple),
        ("helper", njit(double), njit(triple)),
    ],
)
def test_all_that_machine_code_depends_on_is_in_its_fingerprint(name, one, other):
    def tag(value, share):
        tools = ModuleType("tools")
        tools.share = share
        names = {"__name__": "my_ship", "TABLE": np.zeros(3), "helper": double}
        return fingerprint(
            FunctionType(looks_up.__code__, names | {"tools": tools, name: value}), {}
        )

    assert tag(one, double) == tag(one, double)
    assert len({tag(one, double), tag(other, double), tag(one, triple)}) == 3


def test_settings_and_processor_are_in_the_fingerprint():
    code = "def f(k): return k\nfrom shipgym.engine.fingerprint import fingerprint"
    code += "\nprint(fingerprint(f, {}))"
    settings = ({}, {"NUMBA_OPT": "1"}, {"NUMBA_CPU_NAME": "generic"})
    assert len({run(code, **setting) for setting in settings}) == 3


def test_what_comprehensions_name_is_in_the_fingerprint_and_compiled():
    def summed_up(numbers):
        for _ in range(1):
            numbers[0] = sum([WEIGHT * k for k in numbers])  # noqa: F821

    def copied(weight):
        names = {"__name__": "my_ship", "WEIGHT": weight, "sum": sum}
        return FunctionType(summed_up.__code__, names, "summed_up")

    assert fingerprint(copied(2.0), {}) != fingerprint(copied(3.0), {})
    numbers = np.array([1.0, 2.0])
    compiled(copied(3.0), "void(float64[::1])", {}, "summed")(numbers)
    assert numbers.tolist() == [9.0, 2.0]


SAME_NAMES = """
import os
import sys
from typing import NamedTuple
from shipgym.engine.compiling import compiled
from shipgym.engine.specialise import called

def answer(one, other):
    Settings = NamedTuple("Settings", [(one, float), (other, float)])
    space = {"Settings": Settings, "__name__": "own"}
    # too much to be inlined
    long = "    x = x * 0.5 + x * x * 0.25 - x / (x * x + 3.0)\\n" * 60
    exec(f"def near_of(settings, x):\\n{long}    return settings.near + x\\n"
         "def loop(x):\\n"
         "    one = begin(Settings(1.0, 2.0), x)\\n"
         "    return one + begin(Settings(0.0, 0.0), x)\\n", space)
    space["loop"].__module__ = "shipgym.tests"
    hooks = {"begin": called(space["near_of"])}
    return compiled(space["loop"], "float64(float64)", hooks, "a loop")

print(*(answer(*names.split("-"))(0.0) for names in sys.argv[1:]))
"""


def test_loops_from_files_call_their_own_functions_whose_names_and_types_are_alike(
    tmp_path,
):
    """Records of one name that differ in the order of fields only, compiled in
    processes of their own."""

    def answers(*orders):
        return run(SAME_NAMES, *orders, SHIPGYM_CACHE=str(tmp_path)).split()

    assert answers("near-far") == ["1.0"]
    assert answers("far-near") == ["2.0"]
    assert answers("near-far", "far-near") == ["1.0", "2.0"]
    assert answers("far-near", "near-far") == ["2.0", "1.0"]


FILES = """
import gymnasium
import shipgym
from shipgym.engine import compiling

def tell(loop, path):
    print(path.name)
    raise LookupError

compiling.load = tell  # reads a file; the test compiles nothing
for name in gymnasium.registry:
    if name.startswith("shipgym/"):
        try:
            gymnasium.make(name)
        except LookupError:
            pass
"""


def test_a_later_process_finds_the_compiled_environments(tmp_path):
    first, second = (
        run(FILES, SHIPGYM_CACHE=str(tmp_path), PYTHONHASHSEED=seed).split()
        for seed in "12"
    )
    assert len(first) > 5
    assert first == second
