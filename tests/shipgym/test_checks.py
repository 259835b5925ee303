"""Checks of what a user gives: what passes, what is refused, and in which words; files written whole."""

import json
import math
from types import NoneType

import numpy as np
import pytest

from shipgym import InputError
from shipgym.arrays import integral
from shipgym.checks import (
    ANY_KEY,
    Findings,
    check_array,
    check_choice,
    check_fields,
    check_finite,
    check_flag,
    check_format,
    check_keys,
    check_number,
    check_shape,
    check_table,
    check_text,
    check_whole,
    data_only,
    did_you_mean,
    placed,
    quoted,
    shown,
)
from shipgym.files import atomic_path, read_json, write_json, write_text
from shipgym.sea import Weather, Wind


def test_numbers_pass_within_open_and_closed_bounds():
    bounds = {"above": 0.0, "at_most": 2.0}
    given = (1e-9, 1, 2, np.float32(0.5))
    assert [check_number(value, "x", **bounds) for value in given] == [
        1e-9,
        1.0,
        2.0,
        0.5,
    ]
    assert type(check_number(1, "x")) is float
    assert check_number(3.0, "x", at_least=3.0, below=4.0) == 3.0


@pytest.mark.parametrize(
    ("value", "bounds", "said"),
    [
        (0.0, {"above": 0.0}, "x: 0 found, expected a number > 0"),
        (1.0, {"below": 1.0}, "x: 1 found, expected a number < 1"),
        (
            2.5,
            {"at_least": 0.0, "at_most": 2.0},
            "x: 2.5 found, expected a number >= 0 and <= 2",
        ),
        (
            -1.0,
            {"at_least": 0.0, "hint": "in m"},
            "x: -1 found, expected a number >= 0; in m",
        ),
        (math.nan, {}, "x: nan found, expected a number"),
        (math.inf, {}, "x: inf found, expected a number"),
        (10**400, {}, "x: inf found, expected a number"),
        (True, {}, "x: True found, expected a number"),
        (
            "3",
            {},
            "x: '3' (a text; write the number without quotes) found, expected a number",
        ),
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
        with pytest.raises(
            InputError,
            match=r"n: .* found, expected a whole number of at least 3, or None",
        ):
            check_whole(wrong, "n", at_least=3, hint="or None")
    with pytest.raises(
        InputError, match="expected a whole number of at least 3 and at most 5, even"
    ):
        check_whole(6, "n", at_least=3, at_most=5, hint="even")
    assert check_flag(False, "flag") is False
    for wrong in (0, "true", None):
        with pytest.raises(InputError, match=r"flag: .* found, expected true or false"):
            check_flag(wrong, "flag")
    assert check_text(" a ", "name") == " a "
    for wrong in ("", "  ", 3, None):
        with pytest.raises(
            InputError, match=r"name: .* found, expected a text that is not empty"
        ):
            check_text(wrong, "name")


def test_tables_keys_and_choices():
    table = {"beam": 1}
    assert check_table(table, "[ship]") is table
    with pytest.raises(
        InputError, match=r"\[ship\]: 3 found, expected a table of keys and values"
    ):
        check_table(3, "[ship]")
    check_keys(table, ("beam", "length"), "[ship]")
    said = (
        r"\[ship\]: unknown key 'baem'\. Did you mean 'beam'\? Known keys: 'beam',"
        r" 'length'"
    )
    with pytest.raises(InputError, match=said):
        check_keys({"baem": 1}, ("beam", "length"), "[ship]")
    check_fields({"a": 1, "b": None}, ("a", "b"), "run.json", "train again")
    with pytest.raises(
        InputError, match=r"^run\.json: field 'b' is missing; train again$"
    ):
        check_fields({"a": 1}, ("a", "b"), "run.json", "train again")
    with pytest.raises(InputError, match=r"^run\.json: unknown key 'c'\."):
        check_fields({"a": 1, "b": 2, "c": 3}, ("a", "b"), "run.json", "train again")
    assert check_choice("pso", ("abc", "pso"), "optimiser") == "pso"
    for wrong, hint in (("abd", r" Did you mean 'abc'\?"), (3, "$")):
        with pytest.raises(
            InputError,
            match=rf"optimiser: .* found, expected one of 'abc', 'pso'\.{hint}",
        ):
            check_choice(wrong, ("abc", "pso"), "optimiser")
    assert (quoted(["x", "y"]), quoted([])) == ("'x', 'y'", "none")
    assert (
        did_you_mean("turn", ["turning circle", "zigzag"])
        == " Did you mean 'turning circle'?"
    )
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
    with pytest.raises(
        InputError,
        match=r"x: nan found at sample 1, expected finite numbers; repair it",
    ):
        check_finite([0.0, np.nan], "x", "repair it")
    with pytest.raises(
        InputError, match=r"x: inf found at sample \(1, 0\), expected finite numbers$"
    ):
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
    with pytest.raises(
        InputError, match=r"cannot be written .*; choose a folder that exists"
    ):
        write_text("", tmp_path / "none" / "a.json")
    (tmp_path / "folder").mkdir()
    with pytest.raises(
        InputError, match=r"folder: is not a file; choose another name$"
    ):
        write_text("", tmp_path / "folder")


def test_rows_of_an_array_are_equally_long_and_one_row_is_enough():
    assert check_array([[1, 2.5]], (None, None), "x").tolist() == [[1.0, 2.5]]
    with pytest.raises(
        InputError, match=r"x\[1\]: 1 entries found, expected a list of 2 numbers"
    ):
        check_array([[1.0, 2.0], [3.0]], (None, None), "x")


def test_a_list_of_one_kind_has_any_length_and_one_of_several_kinds_theirs():
    check_shape([1, 2, 3], [(int,)], "x")
    check_shape([], [(int,)], "x")
    check_shape([1, "a"], [(int,), (str,)], "x")
    with pytest.raises(InputError, match=r"x: .* found, expected a list of 2"):
        check_shape([1], [(int,), (str,)], "x")
    with pytest.raises(InputError, match=r"x\[1\]: 2 found, expected a text"):
        check_shape([1, 2], [(int,), (str,)], "x")


def test_a_text_has_at_most_4096_characters():
    assert check_text("m" * 4096, "name") == "m" * 4096
    with pytest.raises(
        InputError, match=r"^name: 4097 characters found, expected at most 4096$"
    ):
        check_text("m" * 4097, "name")


def test_of_a_long_value_only_beginning_and_end_are_shown():
    assert shown("a" * 198) == repr("a" * 198)
    assert len(shown("a" * 300)) == 200
    assert shown("a" * 300).startswith("'aaa")
    assert shown("a" * 300).endswith("aaa'")
    assert len(shown(Weather(wind=Wind(9.0)))) <= 200
    assert shown(10**5000) == "a int"


def test_findings_are_told_line_by_line():
    sound, unfit = (
        Findings("mariner", ()),
        Findings("own", ("no rudder", "no thrust"), ("a small beam",)),
    )
    assert (sound.ok, sound.verdict, str(sound)) == (True, "sound", "mariner: sound")
    assert (unfit.ok, unfit.verdict) == (False, "2 problem(s)")
    assert (
        str(unfit)
        == "own: 2 problem(s)\n  problem: no rudder\n  problem: no thrust\n  remark: a"
        " small beam"
    )


@pytest.mark.parametrize(
    ("word", "found"),
    [
        ("Beam", " Did you mean 'beam'?"),
        (" draght ", " Did you mean 'Draught'?"),
        ("beam_max", " Did you mean 'beam'?"),  # alike in two thirds of their letters
        ("beam_in_m", " Did you mean 'beam'?"),  # in eight of thirteen
        ("beamabcdefg", ""),  # in eight of fifteen
        (
            "ail",
            " Did you mean 'trailing edge'?",
        ),  # within a longer one, from three letters on
        ("ai", ""),
        ("", ""),
    ],
)
def test_a_word_is_guessed_where_it_is_much_alike_or_part_of_one(word, found):
    assert did_you_mean(word, ["beam", "Draught", "trailing edge"]) == found


def test_what_a_table_needs_and_may_have():
    assert check_table({"a": 1}, "x", ("a", "b"), ["a"]) == {"a": 1}
    with pytest.raises(
        InputError, match=r"^x: unknown key 'c'\. Known keys: 'a', 'b'$"
    ):
        check_table({"c": 1}, "x", ("a", "b"))
    with pytest.raises(
        InputError, match=r"^x: field 'a' is missing, expected 'a', 'b'$"
    ):
        check_table({"b": 1}, "x", ("a", "b"), ("a", "b"))
    assert check_table({"c": 1}, "x") == {"c": 1}


def test_another_format_is_refused_and_none_is_the_known_one():
    check_format({"format": 2}, 2, "a.json")
    check_format({}, 2, "a.json")
    for wrong in (1, 3, "2", None):
        with pytest.raises(
            InputError,
            match=(
                rf"^a\.json: format {wrong!r} found, this version of shipgym reads"
                r" format 2$"
            ),
        ):
            check_format({"format": wrong}, 2, "a.json")


@pytest.mark.parametrize(
    ("value", "where"),
    [
        ("own.py", "x"),
        ({"a": {"b": "own.py"}}, r"x\.a\.b"),
        (["fine", ["own.py"]], "x"),
        ({"a": ({"b": "own.py"},)}, r"x\.a\.b"),
        ({"task": "MyTask"}, r"x\.task"),
        ({"reward": ["anything"]}, r"x\.reward"),
        ({"a": {"sensors": "own"}}, r"x\.a\.sensors"),
    ],
)
def test_code_that_a_file_names_is_refused_unless_the_user_named_it_there(value, where):
    with pytest.raises(
        InputError,
        match=rf"^{where}: '.*' found, which is code: no file makes shipgym run",
    ):
        data_only(value, "x")
    data_only(value, "x", value)
    with pytest.raises(InputError, match="which is code"):
        data_only(value, "x", "another")


def test_data_that_names_no_code_is_let_pass():
    data_only(
        {
            "model": "mariner",
            "sea": ["calm", 3.0, None],
            "text": "own.pyc",
            "task": None,
        },
        "x",
    )
    given = {"options": {"task": "own.py"}}
    data_only({"options": {"task": "own.py", "noise": 1.0}, "format": 1}, "x", given)
    with pytest.raises(InputError, match=r"^x\.options\.reward: 'own\.py' found"):
        data_only({"options": {"task": "own.py", "reward": "own.py"}}, "x", given)


@pytest.mark.parametrize(
    ("value", "shape", "message"),
    [
        (3, (None,), "x: 3 found, expected a list of numbers"),
        ([1, 2], (3,), "x: 2 entries found, expected a list of 3 numbers"),
        ([1, 2], (3, 2), "x: 2 entries found, expected a list of 3 lists"),
        ([3], (None, None), r"x\[0\]: 3 found, expected a list of numbers"),
        ([[1], [True]], (None, 1), r"x\[1\]\[0\]: True found, expected a number"),
        ([["1"]], (1, 1), r"x\[0\]\[0\]: '1' found, expected a number"),
        (
            [[[1, 2]], [[3]]],
            (None, 1, 2),
            r"x\[1\]\[0\]: 1 entries found, expected a list of 2 numbers",
        ),
        ([1.0, math.nan], (2,), "x: nan found at sample 1, expected finite numbers"),
    ],
)
def test_an_array_of_another_shape_is_refused(value, shape, message):
    with pytest.raises(InputError, match=f"^{message}$"):
        check_array(value, shape, "x")


def test_arrays_of_a_shape_are_given_as_they_are():
    assert check_array([], (None, None), "x").tolist() == []
    assert check_array([[[1, 2]], [[3, 4]]], (2, 1, 2), "x").tolist() == [
        [[1.0, 2.0]],
        [[3.0, 4.0]],
    ]


@pytest.mark.parametrize(
    ("value", "shape", "message"),
    [
        ({"a": 1}, {"a": (int,), "b": (str,)}, "x: 'b' is missing, expected 'a', 'b'"),
        (
            {"a": "1"},
            {"a": (int, NoneType)},
            "x.a: '1' found, expected a whole number or null",
        ),
        ({"a": True}, {"a": (int,)}, "x.a: True found, expected a whole number"),
        (
            {"a": {"c": 1, "d": "2"}},
            {"a": {ANY_KEY: (int,)}},
            "x.a.d: '2' found, expected a whole number",
        ),
        (
            [{"a": 1}, {"a": None}],
            [{"a": (int,)}],
            "x[1].a: None found, expected a whole number",
        ),
        ({"a": 3}, {"a": [(int,)]}, "x.a: 3 found, expected a list"),
        ([1, 2, 3], [(int,), (int,)], "x: [1, 2, 3] found, expected a list of 2"),
        (3, {"a": (int,)}, "x: 3 found, expected a table of keys and values"),
        (1, (bool,), "x: 1 found, expected true or false"),
    ],
)
def test_values_of_another_shape_are_refused_with_their_place(value, shape, message):
    with pytest.raises(InputError) as caught:
        check_shape(value, shape, "x")
    assert str(caught.value) == message


def test_further_keys_of_a_table_may_be_there():
    check_shape({"a": 1, "more": object()}, {"a": (int,)}, "x")
    check_shape(
        {"a": {"one": 1, "two": 2}, "b": 1.5},
        {"a": {ANY_KEY: (int,)}, "b": (float,)},
        "x",
    )
    check_shape({}, {ANY_KEY: (int,)}, "x")
