"""Checks of what a user gives: what passes, what is refused, and in which words."""

import math
from types import NoneType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shipgym import InputError
from shipgym.checks import (
    ANY_KEY,
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
    shown,
    unexpected,
)
from shipgym.findings import Findings
from shipgym.sea import Weather, Wind


@given(st.floats(allow_nan=False), st.floats(-1e6, 1e6), st.floats(0.0, 1e6))
def test_a_number_passes_within_its_bounds_and_is_refused_beyond(number, low, width):
    closed = {"at_least": low, "at_most": low + width}
    open_ends = {"above": low, "below": low + width}
    for bounds, fine in (
        (closed, low <= number <= low + width),
        (open_ends, low < number < low + width),
    ):
        if fine:
            assert check_number(number, "x", **bounds) == number
        else:
            with pytest.raises(InputError, match=r"^x: expected a number >"):
                check_number(number, "x", **bounds)


@pytest.mark.parametrize(
    ("check", "message"),
    [
        (lambda: check_number(0.0, "x", above=0.0), "a number > 0, got 0"),
        (lambda: check_number(-1.0, "x", below=-1.0), "a number < -1, got -1"),
        (
            lambda: check_number(2.5, "x", at_least=0.0, at_most=2.0, hint="in m"),
            "a number >= 0 and <= 2 (in m), got 2.5",
        ),
        (lambda: check_number(math.nan, "x"), "a number, got nan"),
        (lambda: check_number(10**400, "x"), "a number, got inf"),
        (lambda: check_number(True, "x"), "a number, got True"),
        (
            lambda: check_number("3", "x"),
            "a number, got '3'; write the number without quotes",
        ),
        (lambda: check_number(1j, "x"), "a number, got 1j"),
        (
            lambda: check_whole(2, "x", at_least=3),
            "an integer of at least 3, got 2",
        ),
        (
            lambda: check_whole(6, "x", at_least=3, at_most=5, hint="odd"),
            "an integer of at least 3 and at most 5 (odd), got 6",
        ),
        (
            lambda: check_whole(3.0, "x", at_least=3),
            "an integer of at least 3, got 3.0",
        ),
        (
            lambda: check_whole(True, "x", at_least=0),
            "an integer of at least 0, got True",
        ),
        (lambda: check_flag(0, "x"), "a boolean, got 0"),
        (lambda: check_text("  ", "x"), "a non-empty string, got '  '"),
        (lambda: check_text(3, "x"), "a non-empty string, got 3"),
        (
            lambda: check_text("m" * 4097, "x"),
            "at most 4096 characters, got 4097",
        ),
        (lambda: check_table(3, "x"), "a table of keys and values, got 3"),
        (
            lambda: check_choice("abd", ("abc", "pso"), "x"),
            "one of 'abc', 'pso', got 'abd'. Did you mean 'abc'?",
        ),
        (
            lambda: check_choice(3, ("abc",), "x", ", or a file"),
            "one of 'abc', or a file, got 3.",
        ),
        (
            lambda: check_format({"format": "2"}, 2, "x"),
            "format 2, which this version of shipgym reads, got '2'",
        ),
        (
            lambda: check_finite([0.0, math.nan], "x", "repair it"),
            "finite numbers, got nan at sample 1; repair it",
        ),
        (
            lambda: check_finite([[0.0], [math.inf]], "x"),
            "finite numbers, got inf at sample (1, 0)",
        ),
        (lambda: check_finite("north", "x"), "an array of numbers, got 'north'"),
        (lambda: check_finite([[1.0], [1.0, 2.0]], "x"), "an array of numbers, got"),
        (lambda: check_array(3, (None,), "x"), "a list of numbers, got 3"),
        (
            lambda: check_array([1, 2], (3,), "x"),
            "a list of 3 numbers, got 2 entries",
        ),
        (
            lambda: check_array([1, 2], (3, 2), "x"),
            "a list of 3 lists, got 2 entries",
        ),
        (lambda: check_shape(3, [(int,)], "x"), "a list, got 3"),
        (lambda: check_shape([1], [(int,), (str,)], "x"), "a list of 2, got [1]"),
        (lambda: check_shape(1, (bool,), "x"), "a boolean, got 1"),
        (
            lambda: check_shape("1", (int, NoneType), "x"),
            "an integer or null, got '1'",
        ),
    ],
)
def test_a_refusal_says_what_was_expected_and_what_was_found(check, message):
    with pytest.raises(InputError) as caught:
        check()
    assert str(caught.value).startswith(f"x: expected {message}")


@pytest.mark.parametrize(
    ("check", "place"),
    [
        (lambda: check_array([3], (None, None), "x"), "x[0]"),
        (lambda: check_array([[1], [True]], (None, 1), "x"), "x[1][0]"),
        (lambda: check_array([["1"]], (1, 1), "x"), "x[0][0]"),
        # rows of an array are equally long
        (lambda: check_array([[1.0, 2.0], [3.0]], (None, None), "x"), "x[1]"),
        (lambda: check_array([[[1, 2]], [[3]]], (None, 1, 2), "x"), "x[1][0]"),
        (lambda: check_shape({"a": True}, {"a": (int,)}, "x"), "x.a"),
        (
            lambda: check_shape({"a": {"d": "2"}}, {"a": {ANY_KEY: (int,)}}, "x"),
            "x.a.d",
        ),
        (lambda: check_shape([{"a": 1}, {"a": None}], [{"a": (int,)}], "x"), "x[1].a"),
        (lambda: check_shape([1, 2], [(int,), (str,)], "x"), "x[1]"),
    ],
)
def test_a_refusal_begins_with_the_place(check, place):
    with pytest.raises(InputError) as caught:
        check()
    assert str(caught.value).startswith(f"{place}: expected ")


def test_keys_that_are_unknown_or_missing_are_named():
    with pytest.raises(InputError) as caught:
        check_keys({"baem": 1}, ("beam", "length"), "[ship]")
    assert str(caught.value) == (
        "[ship]: unknown key 'baem'. Did you mean 'beam'? Known keys: 'beam', 'length'"
    )
    with pytest.raises(InputError, match=r"^x: field 'a' is missing; give 'a', 'b'"):
        check_table({"b": 1}, "x", ("a", "b"), ("a", "b"))
    with pytest.raises(InputError, match=r"^a: field 'b' is missing; train again$"):
        check_fields({"a": 1}, ("a", "b"), "a", "train again")
    with pytest.raises(InputError, match=r"^x: 'b' is missing; give 'a', 'b'"):
        check_shape({"a": 1}, {"a": (int,), "b": (str,)}, "x")


def test_a_place_is_named_once():
    with pytest.raises(InputError, match=r"^here: there: wrong$"), placed("here"):
        raise InputError("there: wrong")
    with pytest.raises(InputError, match=r"^here: wrong$"), placed("here"):
        raise InputError("here: wrong")


def test_finite_numbers_are_a_copy_that_cannot_be_written():
    numbers = np.arange(3.0)
    found = check_finite(numbers, "x")
    numbers[0] = 9.0
    assert found.tolist() == [0.0, 1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        found[0] = 1.0


def test_of_a_long_value_only_beginning_and_end_are_shown():
    assert shown("a" * 198) == repr("a" * 198)
    assert len(shown("a" * 300)) == 200
    assert shown("a" * 300).endswith("aaa'")
    assert len(shown(Weather(wind=Wind(9.0)))) <= 200
    assert shown(10**5000) == "a int"
    error = unexpected("x", "fewer", "a" * 300, "cut it")
    assert str(error) == f"x: expected fewer, got {shown('a' * 300)}; cut it"


def test_findings_are_told_line_by_line():
    sound = Findings("mariner", ())
    unfit = Findings("own", ("no rudder", "no thrust"), ("a small beam",))
    assert (sound.ok, str(sound)) == (True, "mariner: sound")
    assert (unfit.ok, str(unfit).splitlines()) == (
        False,
        [
            "own: 2 problem(s)",
            "  problem: no rudder",
            "  problem: no thrust",
            "  remark: a small beam",
        ],
    )


@pytest.mark.parametrize(
    ("word", "nearest"),
    [
        ("Beam", "beam"),
        (" draght ", "Draught"),
        ("beam_in_m", "beam"),  # alike in eight of thirteen letters
        ("beamabcdefg", None),  # in eight of fifteen
        ("ail", "trailing edge"),  # within a longer one, from three letters on
        ("ai", None),
        ("", None),
    ],
)
def test_a_word_is_guessed_where_it_is_much_alike_or_part_of_one(word, nearest):
    hint = f" Did you mean '{nearest}'?" if nearest else ""
    assert did_you_mean(word, ["beam", "Draught", "trailing edge"]) == hint


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
    with pytest.raises(InputError, match=rf"^{where}: expected data, got '.*code"):
        data_only(value, "x")
    data_only(value, "x", value)
    with pytest.raises(InputError, match="which is code"):
        data_only(value, "x", "another")
