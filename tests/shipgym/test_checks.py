"""Checks of what a user gives: what passes, what is refused, and in which words; files written whole."""

import json
import math

import numpy as np
import pytest

from shipgym import InputError
from shipgym.arrays import integral
from shipgym.checks import (
    check_array,
    check_choice,
    check_fields,
    check_finite,
    check_flag,
    check_keys,
    check_number,
    check_shape,
    check_table,
    check_text,
    check_whole,
    did_you_mean,
    placed,
    quoted,
)
from shipgym.files import atomic_path, read_json, write_json, write_text


def test_numbers_pass_within_open_and_closed_bounds():
    bounds = {"above": 0.0, "at_most": 2.0}
    given = (1e-9, 1, 2, np.float32(0.5))
    assert [check_number(value, "x", **bounds) for value in given] == [1e-9, 1.0, 2.0, 0.5]
    assert type(check_number(1, "x")) is float
    assert check_number(3.0, "x", at_least=3.0, below=4.0) == 3.0


@pytest.mark.parametrize(
    ("value", "bounds", "said"),
    [
        (0.0, {"above": 0.0}, "x: 0 found, expected a number > 0"),
        (1.0, {"below": 1.0}, "x: 1 found, expected a number < 1"),
        (2.5, {"at_least": 0.0, "at_most": 2.0}, "x: 2.5 found, expected a number >= 0 and <= 2"),
        (-1.0, {"at_least": 0.0, "hint": "in m"}, "x: -1 found, expected a number >= 0; in m"),
        (math.nan, {}, "x: nan found, expected a number"),
        (math.inf, {}, "x: inf found, expected a number"),
        (10**400, {}, "x: inf found, expected a number"),
        (True, {}, "x: True found, expected a number"),
        ("3", {}, "x: '3' (a text; write the number without quotes) found, expected a number"),
        (None, {}, "x: None found, expected a number"),
        (1j, {}, "x: 1j found, expected a number"),
    ],
)
def test_numbers_are_refused_with_what_is_expected(value, bounds, said):
    with pytest.raises(InputError) as caught:
        check_number(value, "x", **bounds)
    assert str(caught.value) == said


def test_whole_numbers_flags_and_texts():
    assert check_whole(np.int32(3), "n", at_least=3) == 3
    assert type(check_whole(np.int32(3), "n", at_least=3)) is int
    for wrong in (2, 3.0, True, "3", None):
        with pytest.raises(InputError, match=r"n: .* found, expected a whole number of at least 3, or None"):
            check_whole(wrong, "n", at_least=3, hint="or None")
    with pytest.raises(InputError, match="expected a whole number of at least 3 and at most 5, even"):
        check_whole(6, "n", at_least=3, at_most=5, hint="even")
    assert check_flag(False, "flag") is False
    for wrong in (0, "true", None):
        with pytest.raises(InputError, match=r"flag: .* found, expected true or false"):
            check_flag(wrong, "flag")
    assert check_text(" a ", "name") == " a "
    for wrong in ("", "  ", 3, None):
        with pytest.raises(InputError, match=r"name: .* found, expected a text that is not empty"):
            check_text(wrong, "name")


def test_tables_keys_and_choices():
    table = {"beam": 1}
    assert check_table(table, "[ship]") is table
    with pytest.raises(InputError, match=r"\[ship\]: 3 found, expected a table of keys and values"):
        check_table(3, "[ship]")
    check_keys(table, ("beam", "length"), "[ship]")
    said = r"\[ship\]: unknown key 'baem'\. Did you mean 'beam'\? Known keys: 'beam', 'length'"
    with pytest.raises(InputError, match=said):
        check_keys({"baem": 1}, ("beam", "length"), "[ship]")
    check_fields({"a": 1, "b": None}, ("a", "b"), "run.json", "train again")
    with pytest.raises(InputError, match=r"^run\.json: field 'b' is missing; train again$"):
        check_fields({"a": 1}, ("a", "b"), "run.json", "train again")
    with pytest.raises(InputError, match=r"^run\.json: unknown key 'c'\."):
        check_fields({"a": 1, "b": 2, "c": 3}, ("a", "b"), "run.json", "train again")
    assert check_choice("pso", ("abc", "pso"), "optimiser") == "pso"
    for wrong, hint in (("abd", r" Did you mean 'abc'\?"), (3, "$")):
        with pytest.raises(InputError, match=rf"optimiser: .* found, expected one of 'abc', 'pso'\.{hint}"):
            check_choice(wrong, ("abc", "pso"), "optimiser")
    assert (quoted(["x", "y"]), quoted([])) == ("'x', 'y'", "none")
    assert did_you_mean("turn", ["turning circle", "zigzag"]) == " Did you mean 'turning circle'?"
    assert did_you_mean("tu", ["turning circle", "zigzag"]) == ""


def test_a_place_is_named_once():
    with pytest.raises(InputError, match=r"^here: there: wrong$"), placed("here"):
        raise InputError("there: wrong")
    with pytest.raises(InputError, match=r"^here: wrong$"), placed("here"):
        raise InputError("here: wrong")


def test_finite_numbers_are_a_copy_that_cannot_be_written():
    given = np.arange(3.0)
    found = check_finite(given, "x")
    given[0] = 9.0
    assert found.tolist() == [0.0, 1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        found[0] = 1.0
    with pytest.raises(InputError, match=r"x: nan found at sample 1, expected finite numbers; repair it"):
        check_finite([0.0, np.nan], "x", "repair it")
    with pytest.raises(InputError, match=r"x: inf found at sample \(1, 0\), expected finite numbers$"):
        check_finite([[0.0], [np.inf]], "x")
    for wrong in ("north", [[1.0], [1.0, 2.0]], {}):
        with pytest.raises(InputError, match="x: expected an array of numbers"):
            check_finite(wrong, "x")


def test_the_integral_is_the_trapezoid_rule():
    t = np.array([0.0, 1.0, 3.0])
    np.testing.assert_allclose(integral(t, np.array([0.0, 2.0, 4.0])), [0.0, 1.0, 7.0])


def test_files_are_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / "a.json"
    write_json({"a": 1.5, "b": [1, 2]}, path)
    assert read_json(path, "table", "write it again") == {"a": 1.5, "b": [1, 2]}
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json({"a": math.nan}, path)
    with pytest.raises(ZeroDivisionError), atomic_path(path) as draft:
        draft.write_text(str(1 / 0))
    assert json.loads(path.read_text()) == {"a": 1.5, "b": [1, 2]}
    assert [one.name for one in tmp_path.iterdir()] == ["a.json"]
    write_text("ä\n", path)
    assert path.read_bytes() == "ä\n".encode()
    with pytest.raises(InputError, match=r"cannot be written .*; choose a folder that exists"):
        write_text("", tmp_path / "none" / "a.json")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match=r"folder: is not a file; choose another name$"):
        write_text("", tmp_path / "folder")


def test_rows_of_an_array_are_equally_long_and_one_row_is_enough():
    assert check_array([[1, 2.5]], (None, None), "x").tolist() == [[1.0, 2.5]]
    with pytest.raises(InputError, match=r"x\[1\]: 1 entries found, expected a list of 2 numbers"):
        check_array([[1.0, 2.0], [3.0]], (None, None), "x")


def test_a_list_of_one_kind_has_any_length_and_one_of_several_kinds_theirs():
    check_shape([1, 2, 3], [(int,)], "x")
    check_shape([], [(int,)], "x")
    check_shape([1, "a"], [(int,), (str,)], "x")
    with pytest.raises(InputError, match=r"x: .* found, expected a list of 2"):
        check_shape([1], [(int,), (str,)], "x")
    with pytest.raises(InputError, match=r"x\[1\]: 2 found, expected a text"):
        check_shape([1, 2], [(int,), (str,)], "x")
