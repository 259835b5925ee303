"""Compiled loops: the same numbers as plain Python, hooks filled, records where their
rows are."""

import os
import subprocess
import sys
from dataclasses import replace
from enum import IntEnum
from types import FunctionType, ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from numba import config, njit, vectorize

import shipgym
from shipgym.engine.compiling import compiled
from shipgym.engine.fingerprint import fingerprint
from shipgym.engine.loops import ship_loop
from shipgym.engine.record_code import clipped_storer, loader, storer, summed, zeros
from shipgym.engine.records import Layout, row_of, table_of
from shipgym.engine.specialise import Specialisation, called, named_globals
from shipgym.errors import InputError

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


class Sounding(NamedTuple):
    depth: float
    shares: table_of(3)


def moved(given, out):
    """A loop: what lane 5 of a tile holds is stored elsewhere; what it calls are its
    hooks."""
    record = load(given, 5)  # noqa: F821
    one = load_one(given, 5)  # noqa: F821
    store(out, 7, record)  # noqa: F821
    store_one(out, 9, one)  # noqa: F821
    store_clipped(out, 11, record, one)  # noqa: F821
    store(out, 13, none())  # noqa: F821
    out[0] = total(record)  # noqa: F821
    out[1] = row_of(load_table(given, 5).shares, 1)  # noqa: F821


moved.__module__ = "shipgym"  # in a user's function names are the user's


@pytest.mark.parametrize("jit", ["0", "1"])
def test_records_are_read_and_stored_where_their_rows_are(jit, monkeypatch):
    """The rows of the tile are 2, 3 and 4, those of the vector 2 and 3: it has no
    chain, which is 0 then."""
    rows = Layout(before=Fix, found=Anchor)["found"]
    places = (Anchor, ("place.north", "place.east"))
    single = Layout(before=Fix, found=places)["found"]
    bounds = {
        "chain": (-9.0, 9.0),
        "place.north": (-9.0, 15.0),
        "place.east": (-6.0, 9.0),
    }
    filled = {
        "load": loader(rows),
        "load_one": loader(single, 1),
        "store": storer(rows),
        "store_one": storer(single, 1),
        "store_clipped": clipped_storer(rows, bounds),
        "none": zeros(Anchor),
        "total": summed(Anchor),
        "row_of": row_of,
        "load_table": loader(Layout(table=Sounding)["table"]),
    }
    given, out = np.zeros(5 * 64), np.full(5 * 64, np.nan)
    given[[2 * 64 + 5, 3 * 64 + 5, 4 * 64 + 5]] = 2.0, 3.0, -4.0
    given[[2, 3]] = 10.0, 2.0  # north and east in the vector
    monkeypatch.setattr(config, "DISABLE_JIT", int(jit))
    loop = compiled(moved, "void(float64[::1], float64[::1])", filled, "records")
    loop(given, out)
    found = {int(k): float(out[k]) for k in np.flatnonzero(np.isfinite(out))}
    expected = {0: 1.0, 1: 2.0}  # the sum; of a table in rows 1 to 3 the second
    expected |= {2: 10.0, 3: 2.0}  # as the vector had it
    expected |= {2 * 64 + 7: 2.0, 3 * 64 + 7: 3.0, 4 * 64 + 7: -4.0}
    expected |= {2 * 64 + 11: 0.0, 3 * 64 + 11: 15.0, 4 * 64 + 11: -6.0}  # clipped
    expected |= {2 * 64 + 13: 0.0, 3 * 64 + 13: 0.0, 4 * 64 + 13: 0.0}
    assert found == expected


def asks():
    return GROUP, PART  # noqa: F821


def test_names_of_a_user_s_function_are_the_user_s():
    filled = {"GROUP": 16, "PART": 3}
    shipped = FunctionType(asks.__code__, {"__name__": "shipgym.engine"}, "asks")
    assert Specialisation(filled).copy(shipped)() == (16, 3)
    assert dict(named_globals(asks, filled)) == {}


def test_a_function_within_another_is_refused_with_what_it_uses_of_it():
    def around(inner):
        def within():
            return inner

        return within

    with pytest.raises(
        InputError, match=r"in within: expected a function at the top .* \(inner\)"
    ):
        fingerprint(around(3), {})


def with_default(value, where="__defaults__"):
    function = FunctionType(double.__code__, {"__name__": "my_ship"}, "double")
    setattr(function, where, (value,) if where == "__defaults__" else {"k": value})
    return function


def times(factor):
    def multiplied(k):
        return factor * k

    return multiplied


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
        ("TABLE", Fix(np.zeros(2000), 1.0), Fix(table(2000, 1000), 1.0)),
        ("TABLE", IntEnum("Berth", {"OUTER": 2}), IntEnum("Berth", {"OUTER": 3})),
        ("TABLE", Fix, Anchor),
        ("helper", double, triple),
        ("helper", double, called(FunctionType(double.__code__, {"__name__": "own"}))),
        ("helper", njit(double), njit(triple)),
        ("helper", njit(double), njit(double, fastmath=True)),
        ("helper", vectorize(double), vectorize(triple)),
        ("helper", njit(times(2.0)), njit(times(3.0))),
        ("helper", with_default(np.zeros(2000)), with_default(table(2000, 1000))),
        (
            "helper",
            with_default(2.0, "__kwdefaults__"),
            with_default(3.0, "__kwdefaults__"),
        ),
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


def test_what_a_module_within_a_module_holds_is_in_the_fingerprint():
    def reads(k):
        return harbour.tide.HEIGHT * k  # noqa: F821

    def tag(height):
        harbour, tide = ModuleType("harbour"), ModuleType("harbour.tide")
        harbour.tide, harbour.self, tide.HEIGHT = tide, harbour, height
        names = {"__name__": "my_ship", "harbour": harbour}
        return fingerprint(FunctionType(reads.__code__, names), {})

    assert tag(1.0) == tag(1.0) != tag(2.0)


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

orders = sys.argv[1:]
if orders[0] == "fork":  # the first loop is compiled by a child of this process
    _, first, *orders = orders
    answer("near", "near_enough")(0.0)
    child = os.fork()
    if child == 0:
        answer(*first.split("-"))(0.0)
        os._exit(0)
    os.waitpid(child, 0)
print(*(answer(*names.split("-"))(0.0) for names in orders))
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


def test_loops_of_a_forked_process_and_its_parent_call_their_own_functions(tmp_path):
    def answers(*orders):
        return run(SAME_NAMES, *orders, SHIPGYM_CACHE=str(tmp_path)).split()

    assert answers("fork", "near-far", "far-near") == ["2.0"]
    assert answers("near-far", "far-near") == ["1.0", "2.0"]


def test_a_loop_refuses_arguments_of_other_types(tmp_path):
    loop = ship_loop(shipgym.load_model("mariner").compiled, "derivatives")
    single = np.zeros((3, 7), np.float32)
    with pytest.raises(TypeError, match="No matching definition"):
        loop(single, single, single[0], single[0], single)
