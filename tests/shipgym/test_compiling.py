"""Compiled loops: the same numbers as plain Python, one file a loop and ship, any number of processes."""

import gc
import inspect
import os
import re
import subprocess
import sys
import warnings
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import IntEnum
from types import FunctionType, ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_features
from numba import config, njit, types, vectorize
from numba.experimental import jitclass
from numba.extending import intrinsic

import shipgym
from shipgym.engine import (
    addresses,
    compiling,
    lean_numba,
    mathematics,
    places,
    specialise,
)
from shipgym.engine.loops import LOOPS, ship_loop
from shipgym.engine.numba_errors import explanation
from shipgym.engine.record_code import (
    bounded_storer,
    chooser,
    loader,
    number_storer,
    row_reader,
    storer,
    summer,
    zero,
)
from shipgym.engine.records import Layout, table_of
from shipgym.engine.specialise import Part, fingerprint
from shipgym.engine.voyages import Voyages
from shipgym.errors import InputError
from shipgym.instruments.sensor_set import shipped_sensors
from shipgym.sea.open_sea import sea_parts
from shipgym.ships.catalogue import kvlcc2, kvlcc2_l7
from shipgym.ships.term_functions import accelerations_source
from shipgym.ships.terms import Term
from shipgym.tasks.definition import read_definition
from tests.shipgym.outer import outer

sin_cos, wrap = outer(mathematics.sin_cos), outer(mathematics.wrap)
small_sin_cos, small_cosine = (
    outer(mathematics.small_sin_cos),
    outer(mathematics.small_cosine),
)

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


def run(code: str, **environment: str) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return result.stdout.strip()


def test_without_compiling_the_numbers_are_the_same():
    compiled_run, plain_run = eval(run(SAIL)), eval(run(SAIL, NUMBA_DISABLE_JIT="1"))
    np.testing.assert_allclose(plain_run, compiled_run, rtol=1e-9, atol=1e-12)


def test_loops_ask_for_the_longest_vectors(tmp_path):
    code = """
import shipgym
from shipgym.engine.loops import ship_loop
loop = ship_loop(shipgym.load_model("mariner").vessel, "alike")
(text,) = loop.inspect_llvm().values()
print('"prefer-vector-width"="512"' in text, "<8 x double>" in text)
"""
    long, eight = run(code, SHIPGYM_CACHE=str(tmp_path)).split()
    assert long == "True"
    features = get_host_cpu_features()  # vectors of 512 bits, or two of 256 at once
    assert eight == str(features.get("avx512f", False) or features.get("avx2", False))


def test_another_ship_or_an_edited_function_has_a_file_of_its_own(monkeypatch):
    loop = LOOPS["simulate"].function
    ships = [shipgym.load_model(name).vessel for name in ("mariner", "container")]
    parts, other = (
        {**sea_parts(False, lanes=1), **vessel.parts(1)} for vessel in ships
    )

    def twice(motion, coefficients, ship):
        return 0.0, 0.0, 0.0, 0.0, 2.0

    tags = {
        fingerprint(loop, parts),
        fingerprint(loop, other),
        fingerprint(loop, {**parts, "accelerations": Part(twice)}),
        fingerprint(loop, {**parts, "HAS_LAG": False}),
    }
    assert len(tags) == 4
    assert fingerprint(loop, dict(parts)) in tags
    monkeypatch.setattr(specialise, "GENERATORS", specialise.GENERATORS[1:])
    specialise._machine.cache_clear()
    assert fingerprint(loop, parts) not in tags  # nor what another generator wrote
    specialise._machine.cache_clear()


def test_each_coefficient_is_read_once_and_what_terms_share_is_taken_out():
    accelerations = (
        shipgym.load_model("mariner").vessel.functions["accelerations"].function
    )
    source = inspect.getsource(accelerations)
    for row in range(40):
        assert len(re.findall(rf"c\.c{row}\b", source)) == 1
    sums = "".join(line for line in source.splitlines() if "dot =" in line)
    assert (
        sums.count(" * ") < 80
    )  # of 40 terms with 93 factors and as many coefficients


def test_sine_and_cosine_to_the_last_digits():
    angles = np.linspace(-500.0, 500.0, 20001)
    ours = np.array([sin_cos(angle) for angle in angles])
    np.testing.assert_allclose(ours[:, 0], np.sin(angles), rtol=0.0, atol=5e-15)
    np.testing.assert_allclose(ours[:, 1], np.cos(angles), rtol=0.0, atol=5e-15)


def test_wrapped_angles_are_the_same_direction():
    angles = np.linspace(-30.0, 30.0, 997)
    wrapped = np.array([wrap(angle) for angle in angles])
    assert np.all((wrapped >= -np.pi) & (wrapped < np.pi))
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)


def test_importing_shipgym_leaves_the_heavy_libraries_alone():
    heavy = (
        "numba",
        "scipy",
        "control",
        "torch",
        "stable_baselines3",
        "plotly",
        "sklearn",
    )
    code = (
        f"import shipgym, sys; print([name for name in {heavy!r} if name in"
        " sys.modules])"
    )
    assert run(code) == "[]"


def test_no_warnings_when_loops_are_loaded():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ship_loop(shipgym.load_model("mariner").vessel, "simulate") is not None


def test_small_angles_have_the_sine_and_cosine_of_the_library():
    x = np.linspace(-np.pi / 2, np.pi / 2, 2001)
    found = np.array([small_sin_cos(angle) for angle in x])
    np.testing.assert_allclose(
        found, np.stack([np.sin(x), np.cos(x)], axis=1), rtol=0.0, atol=4e-16
    )
    np.testing.assert_allclose(
        [small_cosine(angle) for angle in x], np.cos(x), rtol=0.0, atol=4e-16
    )
    assert small_sin_cos(np.pi) == pytest.approx((0.0, -1.0), abs=3e-9)


def test_models_of_one_structure_share_what_is_compiled():
    model = shipgym.load_model("mariner-tls-svm")
    assert {id(draw.vessel) for draw in model.sample(5, 0)} == {id(model.vessel)}
    container = shipgym.load_model("container")
    changed = replace(container, coefficients={**container.coefficients, "m": 0.008})
    assert changed.vessel is container.vessel


def test_the_form_of_a_ship_is_compiled_and_may_be_chosen():
    published, package = kvlcc2(), kvlcc2("shipmmg")
    assert published.vessel is not package.vessel
    assert package.vessel is kvlcc2_l7("shipmmg").vessel


def test_no_text_of_a_file_becomes_part_of_a_program():
    term = Term("import os", (("r", 1),))
    source = accelerations_source({"r": (term,)}, prime=False)
    assert "import" not in source


def test_a_reason_that_numba_colours_is_the_same_reason():
    plain = (
        'Failed in step\nUnknown attribute "_replace"\n\nFile "own.py", line 25:\ndef'
        " f(\nat own.py (25)"
    )
    coloured = plain.replace("Unknown", "\x1b[1m\x1b[31mUnknown").replace(
        "Failed", "\x1b[1mFailed"
    )
    said = explanation(ValueError(plain), "own")
    assert said == explanation(ValueError(coloured), "own")
    assert (
        said == "own: cannot be compiled in f (own.py, line 25): Unknown attribute"
        ' "_replace"'
    )


class Sounding(NamedTuple):
    depth: float
    shares: table_of(3)


def test_a_table_in_a_record_is_the_lane_s_column_of_its_tile():
    layout = Layout(before=Sounding, found=Sounding)
    rows, tile = layout["found"], np.arange(64.0 * layout.n_rows)
    depth, shares = loader(rows).function(tile, 5)
    assert depth == 64 * 4 + 5
    assert shares[:3].tolist() == [64 * 5 + 5, 64 * 6 + 5, 64 * 7 + 5]
    assert loader(rows, 1).function(np.arange(8.0), 5).shares.tolist() == [
        5.0,
        6.0,
        7.0,
    ]


class Fix(NamedTuple):
    north: float
    east: float


class Anchor(NamedTuple):
    chain: float
    place: Fix


def moved(given, out):
    """A loop: what lane 5 of a tile holds is stored elsewhere in several ways; the parts are its globals."""
    record = load(given, 5)  # noqa: F821
    one = load_one(given, 5)  # noqa: F821
    store(out, 7, record)  # noqa: F821
    store_one(out, 9, choose(record.chain > 1.0, one, record))  # noqa: F821
    store_bounded(out, 11, record, one)  # noqa: F821
    store_number(out, 13, total(choose(record.chain > 9.0, one, record)))  # noqa: F821
    store(out, 15, none())  # noqa: F821
    store_number(out, 17, row_of(load_table(given, 5).shares, 1))  # noqa: F821


moved.__module__ = "shipgym"  # in a user's function names are the user's


@pytest.mark.parametrize("jit", [True, False], ids=["compiled", "plain"])
def test_records_are_read_and_stored_where_their_rows_are(jit, monkeypatch):
    """The rows of the tile are 2, 3 and 4, those of the vector 0 and 1: it has no chain, which is 0 then."""
    rows = Layout(before=Fix, found=Anchor)["found"]
    single = Layout(found=(Anchor, ("place.north", "place.east")))["found"]
    table = Layout(found=Sounding)["found"]
    bounds = {
        "chain": (-9.0, 9.0),
        "place.north": (-9.0, 15.0),
        "place.east": (-6.0, 9.0),
    }
    parts = {
        "load": loader(rows),
        "load_one": loader(single, 1),
        "store": storer(rows),
        "store_one": storer(single, 1),
        "store_bounded": bounded_storer(rows, bounds),
        "store_number": number_storer(3),
        "choose": chooser(Anchor),
        "none": zero(Anchor),
        "total": summer(Anchor),
        "row_of": row_reader(),
        "load_table": loader(table),
    }
    monkeypatch.setattr(compiling, "plain_python", lambda: not jit)
    given, out = np.zeros(5 * 64), np.full(5 * 64, np.nan)
    given[[2 * 64 + 5, 3 * 64 + 5, 4 * 64 + 5]] = 2.0, 3.0, -4.0
    given[[0, 1]] = 10.0, 2.0  # north and east in the vector
    compiling.compiled(moved, "void(float64[::1], float64[::1])", parts, "records")(
        given, out
    )
    found = {int(k): float(out[k]) for k in np.flatnonzero(np.isfinite(out))}
    tile = {2: 2.0, 3: 3.0, 4: -4.0}
    expected = {64 * row + 7: value for row, value in tile.items()}
    expected |= {0: 10.0, 1: 2.0}  # as the vector had it
    expected |= {
        2 * 64 + 11: 0.0,
        3 * 64 + 11: 15.0,
        4 * 64 + 11: -6.0,
    }  # products within their bounds
    expected |= {3 * 64 + 13: 1.0, 2 * 64 + 15: 0.0, 3 * 64 + 15: 0.0, 4 * 64 + 15: 0.0}
    assert found == expected | {
        3 * 64 + 17: 2.0
    }  # of a table in rows 1 to 3 the second


NO_MATCH = """Failed in step (step: nopython frontend)
No implementation of function Function(<built-in function sub>) found for signature:

 >>> sub(float64, none)

There are 18 candidate implementations:
During: typing of intrinsic-call at own.py (7)

File "own.py", line 7:
def drift(u, v):
    return u - None
    ^
"""


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            NO_MATCH,
            (
                " in drift (own.py, line 7): No implementation of function"
                " Function(<built-in function sub>): sub(float64, none)"
            ),
        ),
        (
            "Failed in step\nUntyped name 'w'\nat own.py (25)",
            " (own.py, line 25): Untyped name 'w'",
        ),
        (
            f"Cannot unify\n<function drift_{'0a' * 12} at 0x7f>\nat own.py (25)",
            " in drift: Cannot unify",  # the line is that of who calls
        ),
        ("Failed in step", ": no reason given"),
        ("", ": no reason given"),
    ],
)
def test_a_reason_of_numba_s_is_told_in_one_sentence(text, reason):
    assert explanation(ValueError(text), "own") == f"own: cannot be compiled{reason}"


@pytest.mark.parametrize("collected", [True, False])
def test_garbage_is_collected_again_after_a_compilation_if_it_was_before(collected):
    before = gc.isenabled()
    try:
        (gc.enable if collected else gc.disable)()
        with suppress(ZeroDivisionError), compiling._uncollected():
            assert not gc.isenabled()
            raise ZeroDivisionError
        assert gc.isenabled() == collected
    finally:
        (gc.enable if before else gc.disable)()


def asked():
    return GROUP, PART  # noqa: F821


asked.__module__ = "shipgym.engine"


def test_in_plain_python_no_lane_is_sailed_that_holds_no_ship():
    assert compiling.plain(asked, {"GROUP": 16, "PART": 3})() == (1, 3)


def test_a_function_within_another_is_refused_with_what_it_uses_of_it():
    def around(inner):
        def within():
            return inner

        return within

    within = around(3)
    with pytest.raises(InputError) as caught:
        fingerprint(within, {})
    assert (
        str(caught.value)
        == f"{__file__}, line {within.__code__.co_firstlineno}, in within: "
        "expected a function at the top of a file, got one that uses variables of the "
        "function around it (inner)"
    )


def user_asks():
    return GROUP  # noqa: F821


def test_names_of_a_user_s_function_are_the_user_s():
    assert list(specialise.named_globals(asked, {"GROUP": 16})) == [("GROUP", 16)]
    assert list(specialise.named_globals(user_asks, {"GROUP": 16})) == []
    assert [
        specialise.is_shipped(one) for one in (asked, user_asks, compiling.plain)
    ] == [True, False, True]


def measured(k):
    """What is measured."""
    return 2.0 * k + SHARE  # noqa: F821


def test_all_that_machine_code_depends_on_is_in_its_name():
    def named(change, **parts):
        copy = FunctionType(
            measured.__code__, measured.__globals__, "measured", measured.__defaults__
        )
        copy.__doc__, copy.__module__ = measured.__doc__, "shipgym"
        change(copy)
        return fingerprint(copy, {"SHARE": 0.5, **parts})

    def set_code(**changes):
        def change(function):
            function.__code__ = function.__code__.replace(**changes)

        return change

    def as_it_is(function):
        pass

    own = named(as_it_is)
    assert own == named(as_it_is)
    assert len(own) == 24
    other = {
        "a global": named(as_it_is, SHARE=0.6),
        "a constant": named(set_code(co_consts=(measured.__doc__, 2.1))),
        "a default": named(lambda function: setattr(function, "__defaults__", (1.0,))),
        "a function for a number": named(as_it_is, SHARE=Part(asked)),
        "whether it is called": named(as_it_is, SHARE=Part(asked, inline=False)),
        "a record": named(as_it_is, SHARE=Fix),
        "another record": named(as_it_is, SHARE=Anchor),
        "a library": named(as_it_is, SHARE=np),
    }
    assert len({own, *other.values()}) == 1 + len(other)
    text = "Told otherwise."

    def tell(function):
        function.__doc__ = text
        set_code(co_consts=(text, 2.0))(function)

    assert named(tell) == own


def with_default(value, where="__defaults__"):
    function = FunctionType(double.__code__, {"__name__": "my_ship"}, "double")
    setattr(function, where, (value,) if where == "__defaults__" else {"k": value})
    return function


def times(factor):
    def multiplied(k):
        return factor * k

    return multiplied


def typed_double(context, k):
    return k(k), lambda context, builder, signature, values: builder.fadd(
        values[0], values[0]
    )


def typed_triple(context, k):
    return k(k), lambda context, builder, signature, values: builder.fmul(
        values[0], values[0]
    )


class Doubler:
    def __init__(self, k):
        self.k = 2 * k


class Tripler:
    def __init__(self, k):
        self.k = 3 * k


def uses_both(k):
    return one(k) - other(k)  # noqa: F821


def uses_all(k):
    return one(k) + other(k) + inner(k)  # noqa: F821


def looks_up(k):
    return TABLE[k] * helper(k) + tools.share(k)  # noqa: F821


def double(k):
    return 2.0 * k


def triple(k):
    return 3.0 * k


def test_tables_compiled_helpers_and_modules_of_a_user_are_in_the_name_too():
    doubles = njit(double)

    def named(helper=doubles, shared=doubles, row=1000, **more):
        table, tools = np.zeros(2000), ModuleType("tools")
        table[row], tools.share = 1.0, shared
        names = {
            "__name__": "my_ship",
            "TABLE": table,
            "helper": helper,
            "tools": tools,
            **more,
        }
        return fingerprint(FunctionType(looks_up.__code__, names), {})

    assert named() == named()
    others = {
        "the middle of a table": named(row=1001),
        "the kind of a table": named(TABLE=np.zeros(2000, dtype=np.float32)),
        "the shape of a table": named(TABLE=np.zeros((2, 1000))),
        "a helper": named(njit(triple)),
        "how a helper is compiled": named(njit(double, fastmath=True)),
        "a helper that is not compiled yet": named(double),
        "a helper for arrays": named(vectorize(double)),
        "another helper for arrays": named(vectorize(triple)),
        "a helper in a module": named(shared=njit(triple)),
        "an array in a tuple": named(TABLE=(np.zeros(2000), 1.0)),
        "another array in a tuple": named(TABLE=(np.eye(2000)[1000], 1.0)),
        "an array in a record": named(TABLE=Fix(np.zeros(2000), 1.0)),
        "another array in a record": named(TABLE=Fix(np.eye(2000)[1000], 1.0)),
        "an array as a default": named(with_default(np.zeros(2000))),
        "another array as a default": named(with_default(np.eye(2000)[1000])),
        "a default by its name": named(with_default(2.0, "__kwdefaults__")),
        "another default by its name": named(with_default(3.0, "__kwdefaults__")),
        "an enumeration": named(TABLE=IntEnum("Berth", {"OUTER": 2})),
        "an enumeration of other values": named(TABLE=IntEnum("Berth", {"OUTER": 3})),
        "an intrinsic": named(intrinsic(typed_double)),
        "another intrinsic": named(intrinsic(typed_triple)),
        "a class that Numba compiles": named(jitclass([("k", types.int64)])(Doubler)),
        "another class that Numba compiles": named(
            jitclass([("k", types.int64)])(Tripler)
        ),
        "what a compiled helper has from around it": named(njit(times(2.0))),
        "what another has from around it": named(njit(times(3.0))),
    }
    assert len({named(), *others.values()}) == 1 + len(others)


def test_which_of_two_functions_a_name_means_is_in_the_name():
    def named(first, second):
        inner = FunctionType(
            uses_both.__code__, {"__name__": "my_ship", "one": first, "other": second}
        )
        names = {"__name__": "my_ship", "one": double, "other": triple, "inner": inner}
        return fingerprint(FunctionType(uses_all.__code__, names), {})

    assert named(double, triple) == named(double, triple) != named(triple, double)


def test_what_a_module_within_a_module_holds_is_in_the_name():
    def reads(k):
        return harbour.tide.HEIGHT * k  # noqa: F821

    def named(height):
        harbour, tide = ModuleType("harbour"), ModuleType("harbour.tide")
        harbour.tide, harbour.self, tide.HEIGHT = tide, harbour, height
        return fingerprint(
            FunctionType(reads.__code__, {"__name__": "my_ship", "harbour": harbour}),
            {},
        )

    assert named(1.0) == named(1.0) != named(2.0)


def test_what_comprehensions_name_is_in_the_name_and_compiled():
    def summed(numbers):
        for _ in range(1):
            numbers[0] = sum([WEIGHT * k for k in numbers])  # noqa: F821

    def copied(weight):
        return FunctionType(
            summed.__code__,
            {"__name__": "my_ship", "WEIGHT": weight, "sum": sum},
            "summed",
        )

    assert fingerprint(copied(2.0), {}) != fingerprint(copied(3.0), {})
    numbers = np.array([1.0, 2.0])
    compiling.compiled(copied(3.0), "void(float64[::1])", {}, "summed")(numbers)
    assert numbers.tolist() == [9.0, 2.0]


def test_for_whom_numba_was_told_to_write_is_in_the_name(monkeypatch):
    names = set()
    for setting, value in (("OPT", config.OPT), ("OPT", 1), ("CPU_NAME", "generic")):
        monkeypatch.setattr(config, setting, value)
        specialise._machine.cache_clear()
        names.add(fingerprint(double, {}))
    specialise._machine.cache_clear()
    assert len(names) == 3


def test_places_that_nobody_filled_say_who_does():
    with pytest.raises(
        RuntimeError,
        match=r"^push is a place that the sea fill when a loop is compiled$",
    ):
        places.push(1, 2, 3)
    assert places.measure.__name__ == "measure"
    with pytest.raises(AttributeError, match="has no attribute 'pull'"):
        places.pull  # noqa: B018


def test_arrays_are_found_again_by_address_and_shape():
    words, table, flags = (
        np.arange(24, dtype=np.uint64).reshape(2, 3, 4),
        np.arange(6.0).reshape(3, 2),
        np.array([True, False]),
    )
    empty = np.zeros((0, 5))
    world = np.array(
        [99, *addresses.addresses([words, table, empty, flags])], dtype=np.int64
    )
    assert world[[2, 3, 4, 6, 7, 9, 10, 12]].tolist() == [2, 3, 4, 3, 2, 0, 5, 2]
    found = [
        addresses.words_at.function(world, 1),
        addresses.table_at.function(world, 5),
    ]
    found += [
        addresses.table_at.function(world, 8),
        addresses.flags_at.function(world, 11),
    ]
    for one, other in zip(found, (words, table, empty, flags), strict=True):
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other, strict=True)
    table[1, 1] = -7.0
    assert found[1][1, 1] == -7.0


def test_the_plan_of_a_lane_stands_behind_its_rows_and_is_written_in_place():
    tile = np.arange(5 * 64.0)
    plan = addresses.plan_at(3).function(tile, 7)
    assert plan.tolist() == [3 * 64.0 + 7, 4 * 64.0 + 7]
    plan[1] = -1.0
    assert tile[4 * 64 + 7] == -1.0


def mixed(numbers):
    for k in range(1, len(numbers)):
        numbers[0] += min(numbers[k] * k, 2) / (k + 1) - (k // 2) ** 2 * (
            numbers[k] < k
        )


def test_operators_that_are_looked_up_once_make_the_same_machine_code(monkeypatch):
    def code():
        dispatcher = compiling._lean_jit()(**specialise.SEMANTICS)(mixed)
        compiling._compile(dispatcher, "void(float64[::1])", "mixed")
        (text,) = dispatcher.inspect_llvm().values()
        numbers = np.linspace(0.0, 3.0, 7)
        dispatcher(numbers)
        return re.sub(r"B\d+v\d+", "", text), numbers[0]

    monkeypatch.setattr(lean_numba, "OPERATORS", {})
    first, known = code(), set(lean_numba.OPERATORS)
    assert any("mul" in str(asked) for asked in known)
    assert not any(
        "min" in str(asked) for asked in known
    )  # Numba writes it in Python, and compiles it
    assert code() == first
    assert set(lean_numba.OPERATORS) == known
    monkeypatch.setattr(lean_numba, "_look_up_operators", lambda replace: None)
    assert code() == first
    expected = np.linspace(0.0, 3.0, 7)
    mixed(expected)
    assert first[1] == pytest.approx(expected[0], rel=1e-14)


def test_what_is_replaced_in_numba_is_put_back_even_after_an_error():
    owner = type("Owner", (), {"one": 1, "two": 2})
    with suppress(ZeroDivisionError), lean_numba._replaced() as replace:
        replace(owner, "one", 3)
        replace(owner, "one", 5)
        replace(owner, "two", 4)
        assert (owner.one, owner.two) == (5, 4)
        raise ZeroDivisionError
    assert (owner.one, owner.two) == (1, 2)


@dataclass(eq=False)
class Library:
    name: str
    _linking_libraries: list["Library"] = field(default_factory=list)


def test_libraries_beneath_a_loop_are_linked_once_each_after_what_it_calls():
    leaf, other = (
        Library(f"leaf{specialise.CALLED}"),
        Library("was_called", [Library("far")]),
    )
    first = Library(f"first{specialise.CALLED}", [leaf, other])
    loop = Library(
        "loop", [Library(f"second{specialise.CALLED}", [first, leaf]), first, other]
    )
    found = list(lean_numba._beneath(loop, {}))
    assert found == [leaf, other, first, loop._linking_libraries[0]]


ALIKE = """
import sys
from pathlib import Path
from typing import Any, NamedTuple
from shipgym.engine.compiling import compiled
from shipgym.engine.specialise import Part

def asked(one, other):
    Settings = NamedTuple("Settings", [(one, float), (other, float)])
    space = {"Settings": Settings, "__name__": "own"}
    long = "    x = x * 0.5 + x * x * 0.25 - x / (x * x + 3.0)\\n" * 60  # too much to be inlined
    exec(f"def near_of(settings, x):\\n{long}    return settings.near + x\\n"
         "def loop(x): return begin(Settings(1.0, 2.0), x) + begin(Settings(0.0, 0.0), x)\\n", space)
    begin = Part(space["near_of"], inline=False)
    space["loop"].__module__ = "shipgym.tests"
    return compiled(space["loop"], "float64(float64)", {"begin": begin}, "a loop")

print(*(asked(*names.split("-"))(0.0) for names in sys.argv[1:]))
"""


def test_loops_from_files_call_their_own_functions_whose_names_and_types_are_alike(
    tmp_path,
):
    """Records of one name that differ in the order of fields only, compiled in processes of their own."""

    def answers(*orders):
        environment = {**os.environ, "SHIPGYM_CACHE": str(tmp_path)}
        command = [sys.executable, "-c", ALIKE, *orders]
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout.split()

    assert answers("near-far") == ["1.0"]
    assert answers("far-near") == ["2.0"]
    assert answers("near-far", "far-near") == ["1.0", "2.0"]
    assert answers("far-near", "near-far") == ["2.0", "1.0"]


def test_loops_of_two_tasks_share_the_step_of_a_ship_but_not_that_of_another_ship():
    def sailing(task, model):
        vessel = shipgym.load_model(model).vessel
        made = Voyages(
            vessel,
            read_definition(task),
            shipped_sensors(False, False, False),
            False,
            True,
        )
        loop = specialise.Specialisation(made.parts, "tag", compiling._lean_jit())
        return loop.inner(made.parts["sail_lanes"])

    mariner = sailing("CourseKeeping", "mariner-tls-svm")
    assert sailing("PathFollowing", "mariner-tls-svm") is mariner
    assert sailing("CourseKeeping", "kvlcc2-mmg") is not mariner
