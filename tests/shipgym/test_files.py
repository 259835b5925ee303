"""Files are read within limits, and each refusal is one message."""

import json
import math
import os
from pathlib import Path

import pytest

from shipgym import files
from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
from shipgym.files import (
    named_values,
    parse_json,
    parse_toml,
    read_bytes,
    read_json,
    read_text,
    read_toml,
    toml_value,
)


def said(read, *arguments):
    with pytest.raises(InputError) as caught:
        read(*arguments)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            '{"a": {"b": [1, NaN]}}',
            "a.json: a.b[1]: nan found, expected a number of magnitude",
        ),
        (
            '{"a": 1e999}',
            "a.json: a: inf found, expected a number of magnitude 1e+100 at most",
        ),
        (
            '{"a": -1e101}',
            "a.json: a: -1e+101 found, expected a number of magnitude 1e+100 at most",
        ),
        (
            '{"a": 99999999999999999999}',
            "99 found, expected a whole number of at most 64 bits",
        ),
        (
            '{"a": %s}' % ("9" * 5000),
            "a.json: a whole number of more than 64 bits found",
        ),
        (
            '{"a": 1, "b": 2, "a": 3}',
            "a.json: key 'a' appears twice, expected each once",
        ),
        (
            '{"a": "\\ud800"}',
            "found, expected a text without null bytes and halves of characters",
        ),
        ('{"a\\u0000": 1}', "expected a text of at most 4096 characters"),
        ("[" * 21 + "]" * 21, "lists or tables nest deeper than 20"),
        ("[" * 100_000, "a.json: lists or tables nest deeper than 20"),
        ("[" + "1," * 1_000_000 + "1]", "a.json: more than 1000000 values found"),
        (
            '{"a": ',
            (
                "a.json: broken JSON (Expecting value: line 1 column 7 (char 6)); the"
                " file may"
            ),
        ),
    ],
)
def test_json_beyond_the_limits_is_refused(text, message):
    assert message in said(parse_json, text, "a.json:", "x")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            ".".join("a" * 20_000) + " = 1",
            "a.toml: a dotted key of over 20 parts found",
        ),
        (
            'a = { "b" . ' + " . ".join(["'c'"] * 20) + " = 1 }",
            "a.toml: a dotted key of over 20 parts found",
        ),
        ("a = [1, nan]", "a.toml: a[1]: nan found"),
        (
            "a = 1979-05-27",
            "a.toml: a: datetime.date(1979, 5, 27) found, expected a text, a number",
        ),
        ("a = " + "[" * 5000, "a.toml: lists or tables nest deeper than 20"),
        ("a = " + "9" * 5000, "a.toml: a whole number of more than 64 bits found"),
        ("a = 1\na = 2", "a.toml: not valid TOML: Cannot overwrite a value"),
    ],
)
def test_toml_beyond_the_limits_is_refused(text, message):
    assert message in said(parse_toml, text, "a.toml:")


def test_what_is_within_the_limits_is_read():
    assert parse_json("[" * 20 + "]" * 20, "a.json:", "x")
    seed = 2**128 - 1
    assert parse_json(f'{{"seed": {seed}, "a": "\\ud83d\\ude00"}}', "a.json:", "x") == {
        "seed": seed,
        "a": "😀",
    }
    assert parse_toml(
        "C = inf\n# a.b.c " + "a." * 19 + "\nx = [" + "1.5, " * 40 + "]", "a.toml:"
    )["C"] == float("inf")
    assert [toml_value(text) for text in ("3", "[1, 2]", "slow", "nan")] == [
        3,
        [1, 2],
        "slow",
        "nan",
    ]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "/dev/zero",
            (
                "this is no regular file (a device, a pipe or a socket), expected a"
                " model file"
            ),
        ),
        (".", ": this is a folder, expected a model file"),
        ("x" * 5000, "File name too long"),
        ("a\0b", "embedded null byte"),
        ("\udc80", "there is no such model"),
        ("none/none", "there is no such model"),
        ("/proc/self/mem", "/proc/self/mem: broken JSON"),
    ],
)
def test_only_regular_files_are_opened(tmp_path, name, message):
    assert message in said(read_json, tmp_path / name, "model file", "x")


def test_a_pipe_is_refused_without_waiting_for_its_writer(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "pipe: this is no regular file" in said(
        read_toml, tmp_path / "pipe", "ship file"
    )


def test_a_file_larger_than_its_kind_may_be_is_not_read(tmp_path):
    path = Path(tmp_path / "a.toml")
    path.write_bytes(b"#" * (2**18 + 1))
    assert (
        "262145 bytes found, expected a ship file (TOML) of at most 262144 bytes"
        in said(read_toml, path, "ship file")
    )
    assert read_bytes(path, "file", 2**18 + 1) == path.read_bytes()


def test_a_sign_of_degrees_is_read_in_either_encoding_and_memory_as_none(tmp_path):
    path = tmp_path / "log.csv"
    for content in ("rudder (°)\n", "\ufeffrudder (°)\n"):
        path.write_text(content, encoding="utf-8")
        assert read_text(path, "x", 100) == "rudder (°)\n"
    path.write_bytes(b"t\nrudder (\xb0)\n")
    assert read_text(path, "x", 100, latin=True) == "t\nrudder (°)\n"
    assert "line 2 holds byte 0xb0, which is not UTF-8 text" in said(
        read_text, path, "x", 100
    )
    path.write_bytes(b"t\nrudder (\xb0)\n\xff\xff")
    assert "line 2 holds byte 0xb0" in said(
        lambda: read_text(path, "x", 100, latin=True)
    )


def test_the_middle_of_an_endless_message_is_left_out():
    text = str(InputError("a.json: " + "x" * 100_000 + ": take another copy"))
    assert text.startswith("a.json: xxx")
    assert text.endswith("xxx: take another copy")
    assert len(text) < 2100


def test_values_given_by_name_are_read_as_toml_has_them():
    assert named_values(["a = 1e-3", "b=[2, 3]", "c=word"], "--set", "a=1") == {
        "a": 1e-3,
        "b": [2, 3],
        "c": "word",
    }
    for wrong in ("a", "=1", " = "):
        assert said(named_values, [wrong], "--set", "a=1").endswith(
            "name=value, such as --set a=1"
        )
    assert named_values(["a=.5", "b=inf", "c='.5'"], "--set", "a=1") == {
        "a": 0.5,
        "b": math.inf,
        "c": ".5",
    }
    for wrong in ("nan", "-nan", "1e200"):
        assert (
            said(named_values, [f"a={wrong}"], "--set", "a=1")
            == f"--set a: {float(wrong)} found, expected a number of magnitude 1e+100"
            " at most"
        )


LIMITS = (Path(__file__).parents[2] / "docs" / "ship_file.md").read_text(
    encoding="utf-8"
)


@pytest.mark.parametrize(
    ("row", "most"),
    [
        ("ship file and other TOML | 256 KiB", files.LARGEST_TOML),
        ("trial (CSV, NMEA 0183) | 64 MiB", files.LARGEST_CSV),
        (
            "model, episode, controller, results and other JSON | 32 MiB",
            files.LARGEST_JSON,
        ),
        ("weights (safetensors) | 256 MiB", files.LARGEST_TENSORS),
    ],
)
def test_files_are_as_large_as_their_page_says(row, most):
    assert f"| {row}" in LIMITS
    number, unit = row.split(" | ")[1].split()
    assert most == int(number) * {"KiB": 1024, "MiB": 1024**2}[unit]


def test_limits_of_values_are_those_of_their_page():
    assert f"32 MiB, {files.MOST_VALUES:,} values |" in LIMITS
    assert f"| tables and lists within each other | {files.DEEPEST} levels |" in LIMITS
    assert (
        f"| other numbers | magnitude 1e{math.log10(files.LARGEST_NUMBER):.0f}, finite"
        in LIMITS
    )
    assert (
        f"| texts, such as names and paths | {files.LONGEST_KEY:,} characters" in LIMITS
    )


@pytest.mark.parametrize(
    ("fine", "beyond", "expected"),
    [
        (
            f'{{"{"k" * 4096}": 1}}',
            f'{{"{"k" * 4097}": 1}}',
            "expected a text of at most 4096 characters",
        ),
        (
            f'{{"a": {2**64 - 1}}}',
            f'{{"a": {2**64}}}',
            "expected a whole number of at most 64 bits",
        ),
        (
            f'{{"a": {1 - 2**64}}}',
            f'{{"a": {-(2**64)}}}',
            "expected a whole number of at most 64 bits",
        ),
        (
            f'{{"seed": {2**128 - 1}}}',
            f'{{"seed": {2**128}}}',
            "expected a whole number of at most 128 bits",
        ),
        (
            '{"a": 1e100}',
            '{"a": 1.01e100}',
            "expected a number of magnitude 1e+100 at most",
        ),
        ("-1e100", "-1.01e100", "expected a number of magnitude 1e+100 at most"),
        (
            '{"a": [null, true, "text"]}',
            '{"a": "\\u0000"}',
            "expected a text without null bytes",
        ),
    ],
)
def test_values_are_read_up_to_their_limits(fine, beyond, expected):
    assert parse_json(fine, "a.json:", "x") == json.loads(fine)
    assert expected in said(parse_json, beyond, "a.json:", "x")


def test_an_infinite_number_of_toml_is_no_large_one():
    assert parse_toml("a = [inf, -inf]", "a.toml:") == {"a": [math.inf, -math.inf]}
    assert (
        said(parse_toml, "a = 1.01e100", "a.toml:")
        == "a.toml: a: 1.01e+100 found, expected a number of magnitude 1e+100 at most"
    )
    assert said(parse_toml, "[a.b]\nc = [[nan]]", "a.toml:").startswith(
        "a.toml: a.b.c[0][0]: nan found"
    )


def test_a_json_file_holds_one_object(tmp_path):
    path = tmp_path / "model.json"
    path.write_text('{"a": [1, 2]}')
    assert read_json(path, "model file", "x") == {"a": [1, 2]}
    path.write_text("[1, 2]")
    assert (
        said(read_json, path, "model file", "x")
        == f"{path}: [1, 2] found, expected a table of keys and values"
    )


def test_a_file_in_utf_16_is_told_so(tmp_path):
    for encoding in ("utf-16-le", "utf-16-be"):
        (tmp_path / "a.toml").write_bytes("\ufeff[ship]\n".encode(encoding))
        for latin in (False, True):
            message = said(read_text, tmp_path / "a.toml", "ship file", 100, latin)
            assert message.endswith(
                "a.toml: the file is in UTF-16, expected a ship file; save it as text"
                " in UTF-8"
            )


def test_the_line_of_a_byte_that_is_no_text_is_counted_from_one(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xb0")
    assert "a.toml: line 1 holds byte 0xb0, which" in said(
        read_text, tmp_path / "a.toml", "x", 100
    )


def test_of_a_missing_file_the_nearest_name_beside_is_asked_for(tmp_path):
    (tmp_path / "mariner.json").write_text("{}")
    assert said(read_bytes, tmp_path / "marinr.json", "model file", 9).endswith(
        "marinr.json: there is no such model file. Did you mean 'mariner.json'?"
    )
    assert said(read_bytes, tmp_path / "x", "model file", 9).endswith(
        "x: there is no such model file."
    )


def test_whether_a_file_can_be_read_is_seen_without_reading_it(tmp_path):
    (tmp_path / "large.csv").write_bytes(b"0" * 1000)
    files.check_readable(tmp_path / "large.csv", "CSV file")
    assert read_bytes(tmp_path / "large.csv", "CSV file", 0) == b""
    assert "this is a folder, expected a CSV file" in said(
        files.check_readable, tmp_path, "CSV file"
    )


def test_the_reason_of_the_system_is_given_in_words(tmp_path):
    long = tmp_path / ("x" * 300)
    assert (
        said(read_bytes, long, "file", 9)
        == f"{long}: cannot be read (File name too long), expected a file"
    )


def test_the_middle_of_a_message_is_left_out_beyond_two_thousand_characters():
    text = "a" * 1000 + "b" * 1000
    assert str(InputError(text)) == text
    assert (
        str(InputError("a" * 1000 + "middle" + "b" * 1000))
        == "a" * 1000 + " ... " + "b" * 1000
    )


def test_errors_of_a_simulation_carry_what_was_there():
    error = UnstableModelError("runs away", 12.5, {"u": 9.0})
    assert (str(error), error.time_s, error.state) == ("runs away", 12.5, {"u": 9.0})
    error = ManoeuvreError("never turned", "the trial so far")
    assert (str(error), error.trial) == ("never turned", "the trial so far")
