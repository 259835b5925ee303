"""Logs of every kind of file become the same trial; faults have their place."""

from functools import reduce

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from shipgym import InputError, Trial

CSV = b"t,u\n0,1.5\n1,2.5\n2,3.5\n"


def refusal(path, **settings):
    with pytest.raises(InputError) as caught:
        Trial.from_csv(path, **settings)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def trial_of(path, content, **settings):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return Trial.from_csv(path, **settings)


# --- CSV


@pytest.mark.parametrize(
    ("content", "settings"),
    [
        (CSV.replace(b",", b";"), {}),
        (CSV.replace(b",", b"\t"), {}),
        (CSV.replace(b",", b" "), {}),
        (b"\xef\xbb\xbf" + CSV.replace(b"\n", b"\r\n\r\n") + b" , ", {}),
        (b'"t","u"\n0,"1.5"\n"1",2.5\n2,3.5', {}),
        (b"t;u\n0;1,5\n1;2,5\n2;3,5\n", {}),
        (CSV.decode().encode("utf-16"), {}),
        (b"made by a logger\n\n" + CSV, {}),
        (CSV.replace(b"1.5", b'"1.5'), {}),
        (b"t,u\n[s],[m/s]\n" + CSV.removeprefix(b"t,u\n"), {}),
        (CSV + b"t,u\nend of file\n", {}),
        (CSV.replace(b"t,u", b"\xb0,\xe9"), {"columns": {"t": "°", "u": "é"}}),
    ],
)
def test_a_table_is_read_however_it_is_written(tmp_path, content, settings):
    trial = trial_of(tmp_path / "run.csv", content, **settings)
    assert trial.t.tolist() == [0.0, 1.0, 2.0]
    np.testing.assert_allclose(trial["u"], [1.5, 2.5, 3.5])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\n \n", "got an empty file"),
        (b"PK\x03\x04\x14\x00\x06\x00", "got an archive (zip"),
        (b"\x89PNG\r\n\x1a\n", "line 1: expected a text in UTF-8, got byte 0x89"),
        (b"t,u\n0,1\n1,\xff\n", "line 3: expected a text in UTF-8, got byte 0xff"),
        ("t,u\n0,1\n".encode("utf-16")[:-1], "line 2: expected a text in UTF-8"),
        (b"\x01\x02\x03\n", "line 1: expected column names, got"),
        (b"t,u,u\n0,1,1\n", "line 1: expected each column once, got 'u' 2 times"),
        (b"0,1,2\n1,1,1\n", "got only numbers"),
        (b"t," + b'"' + b"x" * 200_000 + b"\n0,1\n", "got 200003 characters"),
        (b",".join(b"c%d" % i for i in range(1001)), "got 1001; leave out those"),
        (b"t,u\n" + b"\n" * 1_000_000, "expected at most 1000000 lines, got 1000002"),
        (b"t,u\n0,1\n1,2,3\n", "line 3 (data row 2): expected 2 cells as in the"),
        (b't\tu\tv\n0\t"1\t2\nx\t1\t2\n', "line 2 (data row 1): expected 3 cells"),
        (b"t,u\n0,1\n1,x\n2,1\n", "line 3 (data row 2), column 'u': expected a number"),
        (b"\x1f\x8b\x08", "got an archive (zip, gzip"),
        (b"a,b\n0,1\n", "no column is named like a channel"),
        (b"t,u\n09:30:02,1\nnoon,2\n", "line 3 (data row 2), column 't': expected a"),
    ],
)
def test_what_is_no_table_is_refused_with_its_line(tmp_path, content, message):
    (tmp_path / "run.csv").write_bytes(content)
    assert message in refusal(tmp_path / "run.csv")


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    (tmp_path / "run_1.csv").write_text("t,u\n")
    assert "Did you mean 'run_1.csv'?" in refusal(tmp_path / "run1.csv")
    assert "got a folder" in refusal(tmp_path)


@pytest.mark.parametrize(
    "form",
    [
        "57°{0:02d}.5'N",
        "N 57 {0}.5",
        "57° {0}' 30\" N",
        "57{0:02d}.5N",
        "57{0:02d}.5",
        "-57°{0}.5\u2032S",
    ],
)
def test_latitudes_are_read_in_degrees_and_minutes(tmp_path, form):
    rows = [f"{60 * k};{form.format(k)};7°44.0'W;0" for k in range(5)]
    trial = trial_of(tmp_path / "run.csv", "\n".join(["t;lat;lon;psi", *rows]))
    np.testing.assert_allclose(np.diff(trial["x"]), 1855.9, atol=1.0)
    wrong = "\n".join(["t;lat;lon;psi", *rows, "300;57°61'N;7°44.0'W;0"])
    (tmp_path / "run.csv").write_text(wrong)
    message = "line 7 (data row 6), column 'lat': expected degrees (57.6872), degrees"
    assert message in refusal(tmp_path / "run.csv")


# --- frames, Excel, Parquet and MATLAB


def test_a_frame_has_columns_and_values():
    frame = pd.DataFrame({" u ": [1.0, 2.0, 4.0]}, pd.Index([0.0, 0.5, 1.0], name="t"))
    assert Trial.from_frame(frame)["u"].tolist() == [1.0, 2.0, 4.0]
    for wrong, message in (
        ({}, "expected a pandas DataFrame, got a dict"),
        (frame[:0], "got 2 columns of 0 rows"),
    ):
        with pytest.raises(InputError, match=message):
            Trial.from_frame(wrong)


@pytest.mark.parametrize("compressed", [False, True])
def test_of_a_matlab_file_numeric_vectors_of_the_commonest_length_are_read(
    tmp_path, compressed
):
    path = tmp_path / "log.mat"
    others = {"name": "abc", "ship": {"length": 7.0}, "dt": 0.1, "long": np.arange(9.0)}
    for kind in "bBhHiIqQfd":
        vectors = {"t": np.arange(4.0), "n": np.array([[1], [2], [3], [100]], kind)}
        savemat(path, {**others, **vectors}, do_compression=compressed)
        assert Trial.from_csv(path)["n"].tolist() == [1.0, 2.0, 3.0, 100.0]


def test_what_is_no_vector_of_a_matlab_file_is_refused(tmp_path):
    path = tmp_path / "log.mat"
    savemat(path, {"u": np.arange(3.0), "psi": np.exp(1j * np.arange(3.0))})
    assert "column 't' not found. Columns present: 'u'" in refusal(path)
    header = b"MATLAB 5.0".ljust(124) + b"\x00\x01IM"
    for content, message in (
        (b"MATLAB 7.3 MAT-file" + bytes(200), "got MATLAB 7.3 (HDF5)"),
        (b"\x89HDF\r\n\x1a\n" + bytes(200), "got MATLAB 7.3 (HDF5)"),
        # eight zeros are an empty variable: it would be read for half a minute
        (header + bytes(8_000_000), "expected a numeric vector for each channel"),
    ):
        path.write_bytes(content)
        assert message in refusal(path)


@pytest.mark.parametrize("ending", ["xlsx", "parquet", "mat"])
def test_a_damaged_or_large_file_is_one_message(tmp_path, ending):
    path = tmp_path / f"log.{ending}"
    path.write_bytes(b"PK\x03\x04" + bytes(300))
    assert f"log.{ending}: expected" in refusal(path)
    with path.open("wb") as file:
        file.truncate(64 * 2**20 + 1)
    assert "expected a log of at most 67108864 bytes" in refusal(path)


# --- NMEA 0183


def sentence(text):
    return f"${text}*{reduce(lambda a, b: a ^ b, map(ord, text)):02X}"


def nmea_log(path, *texts):
    path.write_text("\n".join(map(sentence, texts)))
    return path


def rmc(k, speed="10.0"):
    clock = f"00{k // 60:02d}{k % 60:02d}.00"
    return f"GPRMC,{clock},A,5741.{k:04d},N,01144.0000,E,{speed},000.0,310524,,,A"


def each_second(*texts, count=6):
    return [text for k in range(count) for text in (rmc(k), *texts)]


def test_a_log_of_few_sentences_is_refused(tmp_path):
    path = nmea_log(tmp_path / "log.nmea", *each_second(count=2))
    assert "got too few" in refusal(path)
