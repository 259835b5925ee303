"""Checks of what a user gives: what passes, what is refused, and in which words."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shipgym import InputError
from shipgym.checks import (
    check_array,
    check_choice,
    check_finite,
    check_flag,
    check_format,
    check_keys,
    check_number,
    check_table,
    check_text,
    check_whole,
    data_only,
    did_you_mean,
    placed,
    shown,
    unexpected,
)
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
    ("check", "given", "limits", "message"),
    [
        (check_number, 2.5, {"at_most": 2.0, "hint": "in m"}, "a number <= 2 (in m),"),
        (check_number, math.nan, {}, "a number, got nan"),
        (check_number, 10**400, {}, "a number, got 1000"),
        (check_number, True, {}, "a number, got True"),
        (check_number, "3", {}, "a number, got '3'; write the number without quotes"),
        (check_whole, 2, {"at_least": 3}, "an integer of at least 3, got 2"),
        (
            check_whole,
            3.0,
            {"at_least": 3, "at_most": 5, "hint": "odd"},
            "an integer of at least 3 and at most 5 (odd), got 3.0",
        ),
        (check_flag, 0, {}, "a boolean, got 0"),
        (check_text, "  ", {}, "a non-empty string, got '  '"),
        (check_text, "m" * 4097, {}, "at most 4096 characters, got 4097"),
        (check_table, 3, {}, "a table of keys and values, got 3"),
        (check_finite, [[0.0], [math.inf]], {}, "finite numbers, got inf at sample"),
        (check_finite, "north", {}, "an array of numbers, got 'north'"),
    ],
)
def test_a_refusal_says_what_was_expected_and_what_was_found(
    check, given, limits, message
):
    with pytest.raises(InputError) as caught:
        check(given, where="x", **limits)
    assert str(caught.value).startswith(f"x: expected {message}")


def test_a_choice_is_refused_with_the_nearest():
    with pytest.raises(InputError, match=r"'pso', got 'abd'. Did you mean 'abc'\?"):
        check_choice("abd", ("abc", "pso"), "x")
    with pytest.raises(InputError, match="format 2, which this version"):
        check_format({"format": "2"}, 2, "x")


@pytest.mark.parametrize(
    ("given", "shape"),
    [
        (3, (None,)),
        ([1, 2], (3,)),
        ([3], (None, None)),
        ([["1"]], (1, 1)),
        ([[1.0, 2.0], [3.0]], (None, None)),
        ([[[1, 2]], [[3]]], (None, 1, 2)),
        ([1.0, None], (2,)),
        ([10**30], (1,)),
    ],
)
def test_an_array_of_another_shape_or_of_no_numbers_is_refused(given, shape):
    with pytest.raises(InputError, match=r"^x: expected a list of numbers, "):
        check_array(given, shape, "x")
    assert check_array([], (None, 2), "x").shape == (0, 2)


def test_keys_that_are_unknown_or_missing_are_named():
    with pytest.raises(InputError) as caught:
        check_keys({"baem": 1}, ("beam", "length"), "[ship]")
    assert str(caught.value) == "[ship]: unknown key 'baem'. Did you mean 'beam'?"
    with pytest.raises(InputError, match=r"key 'colour'. Known keys: 'beam', 'length'"):
        check_keys({"colour": 1}, ("beam", "length"), "[ship]")
    with pytest.raises(InputError, match=r"^x: field 'a' is missing; give 'a', 'b'"):
        check_table({"b": 1}, "x", ("a", "b"), ("a", "b"))


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
