"""Compiled loops: the same numbers as plain Python, one file a loop and ship, any number of processes."""

import inspect
import os
import re
import subprocess
import sys
import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_features

import shipgym
from shipgym.engine import compiling, mathematics, specialise
from shipgym.engine.compiling import explanation
from shipgym.engine.loops import LOOPS, ship_loop
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
from shipgym.sea.open_sea import sea_parts
from shipgym.ships.catalogue import kvlcc2, kvlcc2_l7
from shipgym.ships.term_functions import Sum, accelerations_source
from shipgym.ships.terms import Term
from tests.shipgym.outer import outer

sin_cos, wrap = outer(mathematics.sin_cos), outer(mathematics.wrap)
small_sin_cos, small_cosine = outer(mathematics.small_sin_cos), outer(mathematics.small_cosine)

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
    features = get_host_cpu_features()
    assert eight == str(features.get("avx512f", False))


def test_another_ship_or_an_edited_function_has_a_file_of_its_own(monkeypatch):
    loop = LOOPS["simulate"].function
    ships = [shipgym.load_model(name).vessel for name in ("mariner", "container")]
    parts, other = ({**sea_parts(False, lanes=1), **vessel.parts(1)} for vessel in ships)

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
    accelerations = shipgym.load_model("mariner").vessel.functions["accelerations"].function
    source = inspect.getsource(accelerations)
    for row in range(40):
        assert len(re.findall(rf"c\.c{row}\b", source)) == 1
    sums = "".join(line for line in source.splitlines() if "dot =" in line)
    assert sums.count(" * ") < 80  # of 40 terms with 93 factors and as many coefficients


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
    heavy = ("numba", "scipy", "control", "torch", "stable_baselines3", "plotly", "sklearn")
    code = f"import shipgym, sys; print([name for name in {heavy!r} if name in sys.modules])"
    assert run(code) == "[]"


def test_no_warnings_when_loops_are_loaded():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ship_loop(shipgym.load_model("mariner").vessel, "simulate") is not None


def test_small_angles_have_the_sine_and_cosine_of_the_library():
    x = np.linspace(-np.pi / 2, np.pi / 2, 2001)
    found = np.array([small_sin_cos(angle) for angle in x])
    np.testing.assert_allclose(found, np.stack([np.sin(x), np.cos(x)], axis=1), rtol=0.0, atol=4e-16)
    np.testing.assert_allclose([small_cosine(angle) for angle in x], np.cos(x), rtol=0.0, atol=4e-16)
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
    source = accelerations_source({"r": Sum((Term("import os", (("r", 1),)),), (0,), 2)})
    assert "import" not in source


def test_a_reason_that_numba_colours_is_the_same_reason():
    plain = 'Failed in step\nUnknown attribute "_replace"\n\nFile "own.py", line 25:\ndef f(\nat own.py (25)'
    coloured = plain.replace("Unknown", "\x1b[1m\x1b[31mUnknown").replace("Failed", "\x1b[1mFailed")
    said = explanation(ValueError(plain), "own")
    assert said == explanation(ValueError(coloured), "own")
    assert said == 'own: cannot be compiled in f (own.py, line 25): Unknown attribute "_replace"'


class Sounding(NamedTuple):
    depth: float
    shares: table_of(3)


def test_a_table_in_a_record_is_the_lane_s_column_of_its_tile():
    layout = Layout(before=Sounding, found=Sounding)
    rows, tile = layout["found"], np.arange(64.0 * layout.n_rows)
    depth, shares = loader(rows).function(tile, 5)
    assert depth == 64 * 4 + 5
    assert shares[:3].tolist() == [64 * 5 + 5, 64 * 6 + 5, 64 * 7 + 5]
    assert loader(rows, 1).function(np.arange(8.0), 5).shares.tolist() == [5.0, 6.0, 7.0]


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
    bounds = {"chain": (-9.0, 9.0), "place.north": (-9.0, 15.0), "place.east": (-6.0, 9.0)}
    parts = {
        "load": loader(rows), "load_one": loader(single, 1), "store": storer(rows),
        "store_one": storer(single, 1), "store_bounded": bounded_storer(rows, bounds),
        "store_number": number_storer(3), "choose": chooser(Anchor), "none": zero(Anchor),
        "total": summer(Anchor), "row_of": row_reader(), "load_table": loader(table),
    }  # fmt: skip
    monkeypatch.setattr(compiling, "plain_python", lambda: not jit)
    given, out = np.zeros(5 * 64), np.full(5 * 64, np.nan)
    given[[2 * 64 + 5, 3 * 64 + 5, 4 * 64 + 5]] = 2.0, 3.0, -4.0
    given[[0, 1]] = 10.0, 2.0  # north and east in the vector
    compiling.compiled(moved, "void(float64[::1], float64[::1])", parts, "records")(given, out)
    found = {int(k): float(out[k]) for k in np.flatnonzero(np.isfinite(out))}
    tile = {2: 2.0, 3: 3.0, 4: -4.0}
    expected = {64 * row + 7: value for row, value in tile.items()}
    expected |= {0: 10.0, 1: 2.0}  # as the vector had it
    expected |= {2 * 64 + 11: 0.0, 3 * 64 + 11: 15.0, 4 * 64 + 11: -6.0}  # products within their bounds
    expected |= {3 * 64 + 13: 1.0, 2 * 64 + 15: 0.0, 3 * 64 + 15: 0.0, 4 * 64 + 15: 0.0}
    assert found == expected | {3 * 64 + 17: 2.0}  # of a table in rows 1 to 3 the second
