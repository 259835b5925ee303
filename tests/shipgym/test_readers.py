"""Logs of every kind of file become the same table; faults have their place."""

import math
import os
from functools import reduce
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from shipgym.errors import InputError
from shipgym.trials.angle_texts import read_angles
from shipgym.trials.clock_texts import clock_text, read_clock, zone_seconds
from shipgym.trials.nmea import (
    NMEA_QUANTITIES,
    NMEA_SENTENCES,
    logged_numbers,
    parse_sentence,
    steering_numbers,
)
from shipgym.trials.readers.damage import check_unpacked, damage_reported
from shipgym.trials.readers.frames import read_frame
from shipgym.trials.readers.kinds import READERS, read_log, recognise_kind
from shipgym.trials.units import QUANTITIES

DEGREE, KNOT = math.pi / 180.0, 1852.0 / 3600.0


def refusal(path, read=read_log):
    with pytest.raises(InputError) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


# --- times and angles in texts


@pytest.mark.parametrize(
    ("texts", "seconds", "dated"),
    [
        (["2024-05-31T23:59:59Z", "2024-06-01T00:00:01.5Z"], [0.0, 2.5], True),
        (["31.05.2024 23:59:59", "01.06.2024 00:00:01,5"], [0.0, 2.5], True),
        (["05/31/2024 11:59:59 PM", "06/01/2024 12:00:01 AM"], [0.0, 2.0], True),
        (["2024-05-03T09:00:00", "2024-05-03T09:00:01"], [0.0, 1.0], True),
        (["23:59:59", "", "0:00:01.5"], [0.0, math.nan, 2.5], False),
    ],
)
def test_clocks_are_read_as_instruments_write_them(texts, seconds, dated):
    clock = read_clock(texts)
    np.testing.assert_allclose(clock.seconds - clock.seconds[0], seconds, atol=1e-6)
    assert clock.dated is dated
    if "2024-05-03" in texts[0]:
        assert clock.seconds[0] == 1714726800.0


def test_a_clock_is_ahead_of_utc_by_what_its_text_says():
    found = [zone_seconds(text, "log") for text in ("UTC", "Z", "+02:00", "-03:30")]
    assert found == [0, 0, 7200, -12600]
    for text in ("+2", "CET", "25:00"):
        with pytest.raises(InputError, match="log: expected how far the clock is"):
            zone_seconds(text, "log")


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (34200.0, "09:30:00"),
        (1717148999.96, "2024-05-31 09:50:00"),
        (2 * 86400.0 - 1.0, "23:59:59"),  # before the third day it is a time of the day
        (2 * 86400.0, "1970-01-03 00:00:00"),
    ],
)
def test_a_time_is_written_with_its_date_where_it_has_one(seconds, text):
    assert clock_text(seconds) == text


def test_latitudes_are_read_in_degrees_and_minutes():
    texts = [
        "57.68723333",
        "57°41.234'N",
        "N 57 41.234",
        "57° 41' 14.04\" N",
        "-57,68723333",
        "57°41.234\u2032S",
        "",
    ]
    expected = [57.68723333] * 4 + [-57.68723333] * 2 + [math.nan]
    np.testing.assert_allclose(read_angles(texts), expected, atol=1e-7)
    nmea = read_angles(["5741.234N", "5741.234"])
    np.testing.assert_allclose(nmea, 57.68723333, atol=1e-7)
    minutes = read_angles(["0044.3", "00044.3W"], minutes=True)
    np.testing.assert_allclose(minutes, [44.3 / 60, -44.3 / 60])
    for wrong in ("57°61'N", "57 north", "57°10'60\""):
        with pytest.raises(ValueError, match=wrong):
            read_angles(["57.5", wrong])


# --- CSV


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_semicolons_tabs_quotes_blank_lines_and_byte_order_marks_are_read(
    tmp_path, delimiter
):
    lines = ['"t","u"', "0,1.5", "", "1,2.5", '"2",3.5', " , "]
    text = "\ufeff" + "\r\n".join(line.replace(",", delimiter) for line in lines)
    (tmp_path / "run.csv").write_text(text, encoding="utf-8", newline="")
    table = read_log(tmp_path / "run.csv")
    assert (table.header, list(table.rows)) == (("t", "u"), [2, 4, 5])
    assert table.place(1) == "line 4 (data row 2)"
    assert table.numbers("u").tolist() == [1.5, 2.5, 3.5]


def test_decimal_commas_are_read_where_the_delimiter_leaves_no_doubt(tmp_path):
    (tmp_path / "run.csv").write_text("t;u\n0;1,5\n0,5;2,5\n1; NA \n")
    table = read_log(tmp_path / "run.csv")
    np.testing.assert_array_equal(table.numbers("u"), [1.5, 2.5, math.nan])
    assert table.texts("u") == ["1,5", "2,5", ""]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "got an empty file"),
        (b"\n \n", "got an empty file"),
        (b"PK\x03\x04\x14\x00\x06\x00", "got a zip archive; unpack it"),
        (b"\x89PNG\r\n\x1a\n", "expected a log, got a picture (PNG)"),
        (b"t,u\n0,1\n1,\xff\n", "line 3: expected a CSV file in UTF-8, got byte 0xff"),
        ("t,u\n0,1\n".encode("utf-16")[:-1], "line 2: expected a CSV file in UTF-8"),
        (b"\x01\x02\x03\n", "line 1: expected column names, got"),
        (b"t,u,u\n0,1,1\n", "line 1: expected each column once, got 'u' 2 times"),
        (b"0,1,2\n1,1,1\n", "got only numbers"),
        (b"t," + b'"' + b"x" * 200_000 + b"\n0,1\n", "got 200003 characters"),
        (b",".join(b"c%d" % i for i in range(1001)), "got 1001; leave out those"),
        (b"t,u\n" + b"\n" * 1_000_000, "expected at most 1000000 lines, got 1000002"),
        (b"t,u\n0,1\n1,2,3\n", "line 3 (data row 2): expected 2 cells as in the"),
        (b't\tu\tv\n0\t"1\t2\nx\t1\t2\n', "line 2 (data row 1): expected 3 cells"),
    ],
)
def test_what_is_no_table_is_refused_with_its_line(tmp_path, content, message):
    (tmp_path / "run.csv").write_bytes(content)
    assert message in refusal(tmp_path / "run.csv")


def test_a_table_has_a_million_lines_at_most(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("t,u" + 999_998 * "\n" + "0,1\n")
    assert list(read_log(path).rows) == [999_999]


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    (tmp_path / "run_1.csv").write_text("t,u\n")
    assert "Did you mean 'run_1.csv'?" in refusal(tmp_path / "run1.csv")
    assert "no such CSV file" in refusal(tmp_path / "nowhere" / "run.csv")
    assert "got a folder" in refusal(tmp_path)


# --- frames, Excel, Parquet and MATLAB


def test_a_frame_has_columns_and_values():
    frame = pd.DataFrame({" u ": [1.0, 2.0], "v": ["3", None]})
    table = read_frame(frame, "mine", 5)
    assert (table.header, table.place(1)) == (("u", "v"), "row 6")
    assert table.numbers("u").tolist() == [1.0, 2.0]
    np.testing.assert_array_equal(table.numbers("v"), [3.0, math.nan])
    indexed = read_frame(frame.set_index(pd.Index([0.0, 0.5], name="t")))
    assert indexed.header == ("t", "u", "v")
    assert read_frame(pd.DataFrame({"n": [1, 2]})).numbers("n").dtype == float
    assert "expected a pandas DataFrame, got a dict" in refusal({}, read_frame)
    assert "got 2 columns of 0 rows" in refusal(frame[:0], read_frame)


def workbook(path, *rows, merged=None):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    if merged:
        book.active.merge_cells(merged)
    book.save(path)
    return path


def test_a_sheet_begins_with_names_where_it_is_not_empty(tmp_path):
    path = tmp_path / "log.xlsx"
    below = [None, 0, 1], [], [None, 1, 2]
    table = read_log(workbook(path, [], [None, "t", "u"], *below))
    assert (table.header, list(table.rows)) == (("t", "u"), [3, 5])
    for names in (["t", "t"], [0, 1]):
        workbook(path, [], [None, *names], *below)
        assert "log.xlsx: row 2: expected names of columns, each once" in refusal(path)
    workbook(path, ["t", "u"], [0, 1], [1, 1], [2, 1], merged="A3:A4")
    assert "sheet 'Sheet': expected a cell for each value, got merged cells A3:A4" in (
        refusal(path)
    )


def test_of_a_matlab_file_numeric_vectors_of_the_commonest_length_are_read(tmp_path):
    others = {
        "name": "abc",
        "ship": {"length": 7.0},
        "turn": np.eye(3),
        "dt": 0.1,
        "long": np.arange(9.0),
    }
    shaft = np.array([[1], [2], [3]], np.int16)
    path = tmp_path / "log.mat"
    for compressed in (False, True):
        savemat(
            path,
            {**others, "u": np.array([0.5, 1.0, 1.5]), "n": shaft},
            oned_as="row",
            do_compression=compressed,
        )
        table = read_log(path)
        assert (table.header, list(table.rows)) == (("u", "n"), [1, 2, 3])
        assert table.numbers("u").tolist() == [0.5, 1.0, 1.5]
        assert table.numbers("n").tolist() == [1.0, 2.0, 3.0]
    for kind in "bBhHiIqQfd":
        savemat(path, {"u": np.array([1, 2, 100], kind)})
        assert read_log(path).numbers("u").tolist() == [1.0, 2.0, 100.0]


def test_what_is_no_vector_of_a_matlab_file_is_refused(tmp_path):
    path = tmp_path / "log.mat"
    savemat(path, {"u": np.arange(3.0), "psi": np.exp(1j * np.arange(3.0))})
    assert "variable 'psi': expected real numbers, got complex ones" in refusal(path)
    for head in (b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n\x1a\n"):
        path.write_bytes(head + bytes(200))
        assert "got MATLAB 7.3 (HDF5)" in refusal(path)
    # eight zeros are an empty variable: a file of zeros would be read for half a minute
    header = b"MATLAB 5.0".ljust(124) + b"\x00\x01IM"
    path.write_bytes(header + bytes(8 * 10_000))
    assert "expected a numeric vector for each channel, got none" in refusal(path)
    path.write_bytes(header + bytes(8_000_000))
    assert "expected at most 10000 variables, got more" in refusal(path)


@pytest.mark.parametrize("ending", ["xlsx", "parquet", "mat"])
def test_a_damaged_file_is_one_message(tmp_path, ending):
    path = tmp_path / f"log.{ending}"
    path.write_bytes(b"PK\x03\x04" + bytes(300))
    assert f"log.{ending}: expected" in refusal(path)


def test_what_a_library_says_of_damage_is_one_line_of_200_characters():
    expected = f"ValueError: a b {300 * 'c'}"[:200]
    with (
        pytest.raises(InputError) as refused,
        damage_reported(Path("log"), "Excel", "save it"),
    ):
        raise ValueError("a\n\tb " + 300 * "c")
    assert str(refused.value) == f"log: expected Excel, got {expected}; save it"
    with (
        pytest.raises(InputError, match="x, which reads Excel, is not installed"),
        damage_reported(Path("log"), "Excel", ""),
    ):
        raise ModuleNotFoundError("none", name="x")


def test_the_limits_of_a_log_are_those_of_the_page(tmp_path):
    """docs/ship_file.md: 32 MiB, Parquet 64 MiB; unpacked 256 MiB, 5,000,000 values."""
    for ending, most in (("xlsx", 32), ("mat", 32), ("parquet", 64)):
        path = tmp_path / f"log.{ending}"
        path.write_text("MATLAB 7.3")
        os.truncate(path, most * 2**20)
        assert f"log.{ending}: expected" in refusal(path)
        os.truncate(path, most * 2**20 + 1)
        assert f"{most * 2**20 + 1} bytes" in refusal(path)
    check_unpacked(path, 256 * 2**20)
    with pytest.raises(InputError, match="at most 268435456 bytes unpacked"):
        check_unpacked(path, 256 * 2**20 + 1)
    values = np.zeros(5_000_001)
    assert len(read_frame(pd.DataFrame({"u": values[1:]})).rows) == 5_000_000
    assert "at most 5000000 values" in refusal(pd.DataFrame({"u": values}), read_frame)


# --- NMEA 0183


def sentence(text):
    return f"${text}*{reduce(lambda a, b: a ^ b, map(ord, text)):02X}"


def nmea_log(path, *texts):
    path.write_text("\n".join(map(sentence, texts)))
    return path


def fix(clock):
    """Position and time, of no date."""
    return f"GPGGA,{clock},5741.0000,N,01144.0000,E,1,08,1.0,20.0,M,,M,,"


def values(table, channel):
    """Those that a channel has."""
    numbers = table.numbers(channel)
    return numbers[np.isfinite(numbers)]


def test_the_table_of_sentences_names_quantities_units_and_channels_that_are_known():
    for kind in NMEA_SENTENCES.values():
        assert kind.fields.keys() <= NMEA_QUANTITIES.keys()
    for quantity in NMEA_QUANTITIES.values():
        assert quantity.channel is None or quantity.channel in QUANTITIES
        assert quantity.largest > (quantity.tolerance or 0.0)


@pytest.mark.parametrize(
    ("text", "steered_by", "logged"),
    [
        ("HEHDT,180.0,T", {"heading": math.pi}, None),
        ("HEHDT,999.0,T", {}, {"heading": 999.0 * DEGREE}),  # no compass shows that
        ("HEHDT,180.0,", {}, {"heading": math.pi}),
        ("HETHS,90.0,E", {}, {"heading": math.pi / 2}),  # estimated
        ("HETHS,90.0,V", {}, {}),
        (
            "GPGLL,5400.0,N,00700.0,W,,A",
            {"latitude": 54.0 * DEGREE, "longitude": -7.0 * DEGREE},
            {"latitude": 54.0 * DEGREE, "longitude": -7.0 * DEGREE},
        ),
        ("ECXTE,A,A,0.5,R,N,A", {"cross_track": -926.0}, None),
        ("HEXYZ,1.0", {}, {}),
    ],
)
def test_a_helm_is_told_less_than_a_log(text, steered_by, logged):
    found = parse_sentence(sentence(text))
    assert steering_numbers(found) == pytest.approx(steered_by)
    if found.kind in NMEA_SENTENCES:
        expected = steered_by if logged is None else logged
        assert logged_numbers(found) == pytest.approx(expected)


@pytest.mark.parametrize(
    "line", ["$HEHDT,180.0,T*27", "$HEHDT,180.0,T", "garbage", "", "$HEHDT*55"]
)
def test_a_line_without_a_right_checksum_is_no_sentence(line):
    with pytest.raises(ValueError, match="expected"):
        parse_sentence(line)


@pytest.mark.parametrize(
    ("texts", "kind"),
    [
        (["$GPRMC,1\n"], "csv"),
        (["$GPRMC,1\n", "$HEHDT,"], "messages"),
        (["x" * 200 + "$GPRMC,1\n"] * 2, "messages"),  # what a logger writes before
        (["x" * 201 + "$GPRMC,1\n"] * 2, "csv"),
        (["$GPRMC,1\n", 2040 * "x\n", "$HEHDT,"], "messages"),  # within 4096 bytes
        (["$GPRMC,1\n", 2041 * "x\n", "$HEHDT,"], "csv"),
        (["$GPRMC,1\n", "!AIVDM,"], "messages"),
        (["t,psi\n0,1\n"], "csv"),
    ],
)
def test_a_text_is_a_log_of_nmea_by_two_sentences_at_its_beginning(
    texts, kind, tmp_path
):
    (tmp_path / "log.txt").write_text("".join(texts))
    assert recognise_kind(tmp_path / "log.txt") == kind
    assert kind in READERS


def test_a_log_without_dates_goes_on_at_midnight(tmp_path):
    clocks = ("235958", "235959", "000000", "000001", "000002")
    texts = [text for clock in clocks for text in (fix(clock), "HEHDT,30.0,T")]
    table = read_log(nmea_log(tmp_path / "log.nmea", *texts))
    assert np.ptp(table.numbers("t")) == 4.0
    assert (table.units, table.place(0)) == ({"t": "unix"}, "line 1")


@pytest.mark.parametrize(
    ("fields", "true_deg"),
    [
        ("10.0,2.0,E,3.0,E", 15.0),
        ("10.0,2.0,W,3.5,W", 4.5),
        ("10.0,2.0,W,3.0,E", 11.0),
        ("10.0,,,3.0,E", 13.0),
        ("10.0,2.0,,3.0,E", 13.0),  # to which side is not said
        ("10.0,,W,3.0,E", 13.0),
    ],
)
def test_deviation_and_variation_to_the_east_are_added_to_a_compass(
    fields, true_deg, tmp_path
):
    texts = [text for k in range(3) for text in (fix(f"00000{k}"), f"HCHDG,{fields}")]
    table = read_log(nmea_log(tmp_path / "log.nmea", *texts))
    assert np.degrees(values(table, "psi")) == pytest.approx(true_deg)


def rmc(k, sog="10.0", cog="20.0"):
    clock = f"00{k // 60:02d}{k % 60:02d}.00"
    return f"GPRMC,{clock},A,5741.0000,N,01144.0000,E,{sog},{cog},310524,,,A"


@pytest.mark.parametrize(
    ("texts", "speed", "from_deg"),
    [
        (["WIMWV,030.0,T,10.0,M,A"], 10.0, 50.0),
        (["WIMWV,030.0,T,10.0,N,A"], 10.0 * KNOT, 50.0),
        (["WIMWV,030.0,T,10.0,K,A"], 10.0 / 3.6, 50.0),
        (["WIMWV,030.0,T,10.0,M,A", "WIMWV,040.0,T,9.0,X,A"], 10.0, 50.0),  # no unit
        (["WIMWV,000.0,R,15.0,N,A"], 5.0 * KNOT, 20.0),  # less the ship's own 10 kn
        (["WIMWV,000.0,R,15.0,N,A", "WIMWV,030.0,T,10.0,M,A"], 10.0, 50.0),
    ],
)
def test_a_wind_from_the_bow_is_turned_by_the_heading(texts, speed, from_deg, tmp_path):
    """The true wind (T) is preferred to the apparent one (R), which needs velocity."""
    heading = "HEHDT,20.0,T"
    every = [text for k in range(3) for text in (rmc(k), heading, *texts)]
    table = read_log(nmea_log(tmp_path / "log.nmea", *every))
    assert values(table, "wind_speed") == pytest.approx(speed, abs=1e-9)
    assert np.degrees(values(table, "wind_from")) == pytest.approx(from_deg)
    without = [text for k in range(3) for text in (rmc(k), "TIROT,3.0,A", *texts)]
    table = read_log(nmea_log(tmp_path / "log.nmea", *without))
    assert "wind_from" not in table.header


@pytest.mark.parametrize(
    ("channel", "sources", "best"),
    [
        ("psi", {"HEHDT,20.0,T": 6, "HETHS,20.0,A": 9}, "HEHDT"),
        ("psi", {"HEHDT,20.0,T": 3, "HETHS,20.0,A": 9}, "HETHS"),  # with the data
        ("psi", {"HETHS,20.0,A": 6, "VDVHW,20.0,T,,M,,N,,K": 9}, "HETHS"),
        ("psi", {"VDVHW,20.0,T,,M,,N,,K": 6, "HCHDG,20.0,,,,": 9}, "VDVHW"),
        ("psi", {"HEHDT,20.0,T": 6, "GPHDT,20.0,T": 9}, "GPHDT"),
        ("psi", {"IIHDT,20.0,T": 9, "HEHDT,20.0,T": 6}, "HEHDT"),  # a display
        ("stw", {"VDVBW,9.0,0.1,A,,,V": 6, "VDVHW,,T,,M,9.0,N,,K": 9}, "VDVBW"),
    ],
)
def test_of_several_sources_the_better_one_is_read(channel, sources, best, tmp_path):
    """True headings and two-axis logs first, then own sources, then the busiest."""
    texts = [
        text
        for k in range(9)
        for text in (fix(f"00000{k}"), *(one for one, n in sources.items() if k < n))
    ]
    table = read_log(nmea_log(tmp_path / "log.nmea", *texts))
    (other,) = {text[:5] for text in sources} - {best}
    words = [note.split() for note in table.notes if note.startswith(channel)]
    assert [(one[3], one[6]) for one in words] == [(best, other)]
    count = next(n for text, n in sources.items() if text.startswith(best))
    assert values(table, channel).size == count


def test_times_with_dates_go_before_many_without(tmp_path):
    texts = [rmc(k) for k in range(6)] + [fix(f"00000{k}") for k in range(9)]
    table = read_log(nmea_log(tmp_path / "log.nmea", *texts))
    left_out = "lat is from GPRMC (6 values); GPGGA (9 values) left out"
    assert left_out in table.notes
    assert table.numbers("t")[0] == 1717113600.0


def test_a_tenth_of_the_sentences_may_be_damaged(tmp_path):
    lines = [sentence(text) for k in range(100) for text in (rmc(k), "HEHDT,1.0,T")]
    path = tmp_path / "log.nmea"
    for count in (20, 21):
        whole = len(lines) - count
        damaged = [line[:-2] + "ZZ" for line in lines[whole:]]
        path.write_text("\n".join([*lines[:whole], *damaged]))
        if count == 20:
            assert (
                "20 of 200 sentences with a wrong checksum" in read_log(path).notes[0]
            )
    assert "line 180: expected hardly any damaged sentences, got 21 of 200" in (
        refusal(path)
    )


def test_a_number_that_is_infinite_is_damage(tmp_path):
    texts = [rmc(k) for k in range(27)]
    table = read_log(nmea_log(tmp_path / "log.nmea", "GPVTG,inf,T,,M,5.0,N,,K", *texts))
    assert table.notes[0].startswith("1 of 28 sentences")


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (
            ["HEHDT,30.0,T"],
            "expected sentences with a time (RMC, GGA, GLL or ZDA) or a time",
        ),
        (["GPZDA,093000,31,05,2024,00,00"], "expected sentences of a ship's motion"),
        (["GPGLL,,,,,093000.00,A,A"], "expected sentences of a ship's motion"),
    ],
)
def test_a_log_without_time_or_motion_is_refused(texts, message, tmp_path):
    assert message in refusal(nmea_log(tmp_path / "log.nmea", *texts * 3))
