"""Files are read within limits, and each refusal is one message."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shipgym import ShipModel, files
from shipgym.errors import InputError
from shipgym.files import (
    named_values,
    parse_json,
    parse_toml,
    read_bytes,
    read_json,
    read_toml,
    toml_value,
)


def refusal(read, *arguments):
    with pytest.raises(InputError) as caught:
        read(*arguments)
    return str(caught.value)


values = st.recursive(
    st.none() | st.booleans() | st.floats(-1e100, 1e100) | st.text("aä😀\n"),
    lambda inner: st.lists(inner) | st.dictionaries(st.text("xyz"), inner),
    max_leaves=20,
)


@given(values)
def test_json_within_the_limits_is_read(value):
    assert parse_json(json.dumps(value), "a.json:", "x") == value


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"a": {"b": [1, NaN]}}', "a.b[1]: expected a number of magnitude 1e+100"),
        ('{"a": 1e999}', "a: expected a number of magnitude 1e+100 at most, got inf"),
        ('{"a": -1.01e100}', "a: expected a number of magnitude 1e+100 at most"),
        ("1.01e100", "expected a number of magnitude 1e+100 at most"),
        (f'{{"a": {2**64}}}', "a: expected an integer of at most 64 bits"),
        (f'{{"a": {-(2**64)}}}', "a: expected an integer of at most 64 bits"),
        (f'{{"seed": {2**128}}}', "seed: expected an integer of at most 128 bits"),
        ('{"a": %s}' % ("9" * 5000), "expected integers of at most 64 bits"),
        ('{"a": "\\ud800"}', "a: expected a string without null bytes and halves"),
        ('{"a": "\\u0000"}', "a: expected a string without null bytes"),
        ('{"a\\u0000": 1}', "expected keys of at most 4096 characters"),
        (f'{{"{"k" * 4097}": 1}}', "expected keys of at most 4096 characters"),
        ("[" * 21 + "]" * 21, "expected at most 20 levels of lists and tables"),
        ("[" * 100_000, "expected at most 20 levels of lists and tables"),
        ("[" + "1," * 1_000_000 + "1]", "expected at most 1000000 values"),
        ('{"a": ', "broken JSON (Expecting value: line 1 column 7 (char 6)); the"),
    ],
)
def test_json_beyond_the_limits_is_refused(text, message):
    said = refusal(parse_json, text, "a.json:", "x")
    assert said.startswith("a.json:")
    assert message in said


def test_json_at_the_limits_is_read():
    for text in (
        "[" * 20 + "]" * 20,
        f'{{"{"k" * 4096}": 1}}',
        f'{{"a": {2**64 - 1}, "b": {1 - 2**64}, "seed": {2**128 - 1}}}',
        '{"a": 1e100, "b": -1e100}',
    ):
        assert parse_json(text, "a.json:", "x") == json.loads(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (".".join("a" * 20_000) + " = 1", "expected dotted keys of at most 20 parts"),
        (
            'a = { "b" . ' + " . ".join(["'c'"] * 20) + " = 1 }",
            "expected dotted keys of at most 20 parts",
        ),
        ("a = [1, nan]", "a[1]: expected a number"),
        ("[a.b]\nc = [[nan]]", "a.b.c[0][0]: expected a number"),
        ("a = 1.01e100", "a: expected a number of magnitude 1e+100 at most"),
        ("a = 1979-05-27", "a: expected a string, a number or a boolean, got datetime"),
        ("a = " + "[" * 5000, "expected at most 20 levels of lists and tables"),
        ("a = " + "9" * 5000, "expected integers of at most 64 bits"),
        ("a = 1\na = 2", "not valid TOML: Cannot overwrite a value"),
    ],
)
def test_toml_beyond_the_limits_is_refused(text, message):
    assert refusal(parse_toml, text, "a.toml:").startswith(f"a.toml: {message}")


def test_toml_within_the_limits_is_read():
    comment = "# a.b.c " + "a." * 19
    text = f"C = inf\n{comment}\nx = [{'1.5, ' * 40}]\ny = -inf"
    assert parse_toml(text, "a.toml:") == {
        "C": math.inf,
        "x": [1.5] * 40,
        "y": -math.inf,
    }
    texts = ("3", "[1, 2]", "slow", "nan")
    assert [toml_value(text) for text in texts] == [3, [1, 2], "slow", "nan"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("/dev/zero", "model file (JSON), got no regular file (a device, a pipe or a"),
        (".", ": expected a model file (JSON), got a folder"),
        ("x" * 5000, "expected a model file (JSON), got a file that cannot be read ("),
        ("a\0b", "embedded null byte"),
        ("\udc80", "there is no such model"),
        ("none/none", "there is no such model"),
        ("/proc/self/mem", "got a file that cannot be read"),
    ],
)
def test_only_regular_files_are_opened(tmp_path, name, message):
    assert message in refusal(read_json, tmp_path / name, "model file", "x")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "a folder; give {}/ship.toml to shipgym look, identify or autopilot"),
        ("a.csv", "a log; give it to shipgym new-ship or look"),
        ("a.safetensors", "a file of weights; give it to shipgym export or benchmark"),
    ],
)
def test_a_file_of_another_kind_is_named_with_the_command_for_it(
    tmp_path, name, message
):
    for file in ("a.csv", "ship.toml", "a.safetensors"):
        (tmp_path / file).write_text("")
    message = f"expected a model file, got {message.format(tmp_path)}"
    assert message in refusal(ShipModel.load, tmp_path / name)


def test_a_file_larger_than_its_kind_may_be_is_not_read(tmp_path):
    path = Path(tmp_path / "a.toml")
    path.write_bytes(b"#" * (2**18 + 1))
    expected = "expected a ship file (TOML) of at most 262144 bytes, got 262145 bytes"
    assert expected in refusal(read_toml, path, "ship file")
    assert read_bytes(path, "file", 2**18 + 1) == path.read_bytes()


def test_values_given_by_name_are_read_as_toml_has_them():
    texts = ["a = 1e-3", "b=[2, 3]", "c=word", "d=.5", "e=inf", "f='.5'"]
    assert named_values(texts, "--set", "a=1") == {
        "a": 1e-3,
        "b": [2, 3],
        "c": "word",
        "d": 0.5,
        "e": math.inf,
        "f": ".5",
    }
    for wrong in ("a", "=1", " = "):
        expected = "--set: expected name=value, such as --set a=1, got "
        assert refusal(named_values, [wrong], "--set", "a=1").startswith(expected)
    for wrong in ("nan", "-nan", "1e200"):
        expected = "--set a: expected a number of magnitude 1e+100 at most"
        assert refusal(named_values, [f"a={wrong}"], "--set", "a=1").startswith(
            expected
        )


PAGE = Path(__file__).parents[2] / "docs" / "ship_file.md"


@pytest.mark.parametrize(
    "row",
    [
        f"| ship file and other TOML | {files.LARGEST_TOML // 1024} KiB",
        f"| trial (CSV, NMEA 0183) | {files.LARGEST_CSV // files.MIB} MiB",
        "| model, episode, controller, results and other JSON |"
        f" {files.LARGEST_JSON // files.MIB} MiB, {files.MOST_VALUES:,} values |",
        f"| weights (safetensors) | {files.LARGEST_TENSORS // files.MIB} MiB",
        f"| tables and lists within each other | {files.DEEPEST} levels |",
        f"| other numbers | magnitude 1e{math.log10(files.LARGEST_NUMBER):.0f}, finite",
        f"| texts, such as names and paths | {files.LONGEST_KEY:,} characters",
    ],
)
def test_limits_are_those_of_their_page(row):
    assert row in PAGE.read_text(encoding="utf-8")
