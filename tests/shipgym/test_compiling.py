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
from shipgym.engine import mathematics, specialise
from shipgym.engine.compiling import explanation
from shipgym.engine.loops import LOOPS, ship_loop
from shipgym.engine.parts import Part
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
from shipgym.engine.specialise import fingerprint
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


def test_records_are_stored_in_plain_python_where_their_rows_are():
    rows, given = Layout(before=Fix, found=Anchor)["found"], Anchor(2.0, Fix(3.0, -4.0))
    scale, bounds = Anchor(10.0, Fix(0.5, 1.0)), {"chain": (0.0, 15.0), "place.north": (0.0, 9.0)}
    stored = {  # the rows are 2, 3 and 4, the lane is 5
        storer(rows): (given,),
        bounded_storer(rows, bounds | {"place.east": (-1.0, 1.0)}): (given, scale),
        number_storer(3): (7.0,),
    }
    found = []
    for part, numbers in stored.items():
        tile = np.zeros(5 * 64)
        part.function(tile, 5, *numbers)
        found.append({int(k): float(tile[k]) for k in np.flatnonzero(tile)})
    assert found[0] == {2 * 64 + 5: 2.0, 3 * 64 + 5: 3.0, 4 * 64 + 5: -4.0}
    assert found[1] == {2 * 64 + 5: 15.0, 3 * 64 + 5: 1.5, 4 * 64 + 5: -1.0}
    assert found[2] == {3 * 64 + 5: 7.0}
    vector = np.zeros(5)
    storer(rows, 1).function(vector, 5, given)
    assert vector.tolist() == [0.0, 0.0, 2.0, 3.0, -4.0]
    assert loader(rows, 1).function(vector, 5) == given
    assert (summer(Anchor).function(given), zero(Anchor).function()) == (1.0, Anchor(0.0, Fix(0.0, 0.0)))
    assert [chooser(Anchor).function(yes, given, scale) for yes in (True, False)] == [given, scale]
    assert row_reader().function(vector[2:], 1) == 3.0
