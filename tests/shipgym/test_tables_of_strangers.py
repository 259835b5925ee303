"""Tables as recorders of many kinds write them, each read as what it is."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from scipy.io import savemat

from shipgym import Trial
from shipgym.errors import InputError
from shipgym.trials.guesses import guess_trial
from shipgym.trials.units import KNOT
from tests.shipgym.one_zigzag import sailed

N = 240
BEGIN = datetime(2021, 5, 3, 9, 59, 50)
EPOCH = 1_620_035_990
NAMES = ["Time", "Lat", "Lon", "SOG", "COG", "Heading", "Rudder"]


#: The columns of `NAMES` but the time, degrees and knots.
SAILED = np.array(
    [
        [one.lat, one.lon, one.speed / KNOT, one.course, one.psi, one.rudder]
        for one in sailed(N)
    ]
)
CELLS = [
    [
        (BEGIN + timedelta(seconds=k)).isoformat(sep=" "),
        f"{row[0]:.7f}",
        f"{row[1]:.7f}",
        *(f"{value:.2f}" for value in row[2:]),
    ]
    for k, row in enumerate(SAILED)
]


def as_is(k, row):
    return row


def clock(layout):
    return lambda k, row: [(BEGIN + timedelta(seconds=k)).strftime(layout), *row[1:]]


def number(value):
    return lambda k, row: [value(k), *row[1:]]


def speed(factor):
    return lambda k, row: [*row[:3], f"{float(row[3]) * factor:.3f}", *row[4:]]


def rudder(text):
    return lambda k, row: [*row[:6], text(float(row[6]))]


def missing(word):
    def edit(k, row):
        heading = word if k % 40 == 5 else row[5]
        return [*row[:5], heading, row[6]]

    return edit


def written(path, edit=as_is, names=NAMES, *, above=(), below=(), delimiter=","):
    """Write the sailed log to a file, its rows changed; the text too."""
    rows = [delimiter.join(edit(k, list(row))) for k, row in enumerate(CELLS)]
    text = "\n".join([*above, delimiter.join(names), *below, *rows]) + "\n"
    path.write_text(text, encoding="utf-8")
    return text


def assert_as_sailed(guess, *, positive="starboard", speeds=True):
    """The log is the one that was sailed."""
    trial = guess.trial
    assert (len(trial), trial.duration) == (N, pytest.approx(N - 1.0, abs=0.5))
    heading = np.degrees(trial["psi"])
    assert np.abs(heading - SAILED[:, 4]).max() < 0.5
    assert np.abs(np.degrees(trial["delta"]) - SAILED[:, 5]).max() < 0.6
    assert guess.side.side == positive
    if speeds:
        assert np.median(np.hypot(trial["u"], trial["v"])) == pytest.approx(
            7.0, abs=0.2
        )


READ = {
    "knots": (as_is, {}, "sog: in knots"),
    "13.6 kn": (
        lambda k, row: [*row[:3], f"{row[3]} kn", *row[4:]],
        {},
        "sog: in knots",
    ),
    "km/h": (speed(1.852), {}, "sog: in km/h"),
    "titles": (as_is, {"above": ["Trial, of A, B, C, D, E, F", "", "x", "# y"]}, ""),
    "units": (
        speed(1852 / 3600),
        {"below": ["[-],[deg],[deg],[m/s],[deg],[deg],[deg]", "-,N,E,,T,T,(S+)"]},
        "sog: in m/s, unit from the row of units",
    ),
    "---": (missing("---"), {}, "filled 6"),
    "9999": (missing("9999"), {}, 'filled 6; 6 values of 9999 stand for "no value"'),
    "S10.0": (rudder(lambda x: f"{'SP'[x < 0]}{abs(x):.1f}"), {}, "letters"),
    "10 PORT": (
        rudder(lambda x: f"{abs(x):.1f} {'STBD' if x >= 0 else 'PORT'}"),
        {},
        "",
    ),
    "to port": (rudder(lambda x: f"{-x:.2f}"), {}, "side port"),
    "ns": (number(lambda k: f"{EPOCH + k}000000000"), {}, "t: in unix ns"),
    "ms": (number(lambda k: f"{1000 * k}"), {}, "t: in ms"),
    "elapsed": (number(str), {"names": ["Elapsed", *NAMES[1:]]}, "'Elapsed' in s"),
    "days": (
        number(lambda k: f"{44319.416551 + k / 86400:.9f}"),
        {},
        "t: in excel days",
    ),
    "datenum": (number(lambda k: f"{738279.4166 + k / 86400:.9f}"), {}, "t: in matlab"),
    "hhmmss": (clock("%H%M%S"), {}, "without colons"),
    "compact": (clock("%Y%m%d%H%M%S"), {}, "without colons"),
    "dmy": (clock("%d.%m.%Y %H:%M:%S"), {}, ""),
    "repeated": (
        lambda k, row: clock("%H:%M:%S")(k - k % 2, row),
        {},
        "120 of 240 times again",
    ),
    "date": (
        lambda k, row: ["03.05.2021", clock("%I:%M:%S %p")(k, row)[0], *row[1:]],
        {"names": ["Date", *NAMES]},
        "date Date",
    ),
}


@pytest.mark.parametrize("kind", READ)
def test_a_table_is_read_as_what_it_is_and_says_why(tmp_path, kind):
    edit, layout, words = READ[kind]
    written(tmp_path / "log.csv", edit, **layout)
    guess = guess_trial(tmp_path / "log.csv")
    assert_as_sailed(guess, positive="port" if words == "side port" else "starboard")
    reading = [
        f"{key}: in {text.partition(' in ')[2]}" for key, text in guess.reading.items()
    ]
    filled = f"filled {guess.trial.repaired.get('psi')}"
    said = " ".join([*reading, *guess.reading.values(), filled, *guess.trial.notes])
    said += f"side {guess.side.side}"
    for part in words.split("; "):
        assert part in said


@pytest.mark.parametrize(
    ("encoding", "names"),
    [
        ("utf-16", NAMES),
        ("utf-8-sig", NAMES),
        ("latin-1", ["Zeit", "Breite", "Länge", "FüG", "KüG", "Steuerkurs", "Ruder"]),
        ("utf-8", ["时间", "纬度", "经度", "航速", "航向", "艏向", "舵角"]),
    ],
)
def test_encodings(tmp_path, encoding, names):
    text = written(tmp_path / "log.csv", names=names, delimiter=";").replace(".", ",")
    (tmp_path / "log.csv").write_bytes(text.encode(encoding))
    assert_as_sailed(guess_trial(tmp_path / "log.csv"))


@pytest.mark.parametrize(
    ("names", "edit"),
    [
        (["left_nps", "right_nps"], lambda x: [f"{60 + x:.2f}", f"{60 - x:.2f}"]),
        (["throttleLeft", "throttleRight"], lambda x: [f"{1 + x}", f"{1 - x}"]),
        (["RCOU.C1", "RCOU.C3"], lambda x: [f"{1500 + 10 * x:.0f}", "1700"]),
    ],
)
def test_a_steering_command_stands_for_the_rudder(tmp_path, names, edit):
    written(
        tmp_path / "log.csv",
        lambda k, row: [*row[:6], *edit(float(row[6]))],
        [*NAMES[:6], *names],
    )
    guess = guess_trial(tmp_path / "log.csv")
    assert np.corrcoef(guess.trial["delta"], SAILED[:, 5])[0, 1] > 0.999
    assert "steering command" in guess.reading["delta"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"#ROSBAG V2.0\n", "a bag of ROS 1; write its topic as CSV: rostopic echo"),
        (b"\x89MCAP0\r\n", "an MCAP file"),
        (b"\xa3\x95\x80\x80", "of ArduPilot or PX4; write its messages as CSV"),
        (
            b"INFO\n2021-05-03-09:59:50.1 2 35 255 127245 Rudder:  Position = 1.2 deg",
            "text of canboat's analyzer; write JSON: analyzer -json",
        ),
        (b"<?xml version='1.0'?><gpx>", "a track (GPX or KML) without rudder"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "(.xls); save it as .xlsx"),
        (b"<!DOCTYPE html>", "a web page, a PDF or a ship file; name a log"),
        (b"%PDF-1.7\n\xe2", "a web page, a PDF or a ship file; name a log"),
        (b"# A\n\n| a | b |\n| - | - |\n| c | d |\n", "a text without a table of"),
        (b'{\n "u": {"nrmse": 0.1}\n}\n', "a JSON file without messages; give a model"),
        (b"# by new-ship\n\n[ship]\n", "a web page, a PDF or a ship file; name a log"),
    ],
)
def test_a_foreign_file_is_named_with_what_reads_it(tmp_path, content, words):
    (tmp_path / "log.dat").write_bytes(content)
    with pytest.raises(InputError, match="expected a log, got") as refused:
        guess_trial(tmp_path / "log.dat")
    assert words in str(refused.value)


def test_a_matrix_of_matlab_asks_for_the_names_of_its_columns(tmp_path):
    matrix = np.column_stack([np.arange(float(N)), SAILED[:, 4:]])
    savemat(tmp_path / "simdata.mat", {"simdata": matrix})
    time, heading, rudder = guess_trial(tmp_path / "simdata.mat").decisions
    assert (time.key, heading.key, rudder.key) == ("t", "psi", "delta")
    assert "the column of the time, one of 'simdata(:,1)', 'simda" in time.choices
    assert "the column of the heading, one of 'simdata(:,1)'" in heading.choices
    columns = {"t": "simdata(:,1)"}
    for number, channel in enumerate(("psi", "delta"), start=2):
        columns[channel] = {"column": f"simdata(:,{number})", "unit": "deg"}
    assert len(Trial.from_csv(tmp_path / "simdata.mat", columns)) == N


def test_a_sheet_may_have_titles_and_a_row_of_units(tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("openpyxl")
    units = ["-", "deg", "deg", "kn", "deg", "deg", "deg"]
    rows = [[row[0], *map(float, row[1:])] for row in CELLS]
    frame = pandas.DataFrame([["Trial"] + 6 * [None], NAMES, units, *rows])
    with pandas.ExcelWriter(tmp_path / "log.xlsx") as book:
        frame.to_excel(book, sheet_name="Log", index=False, header=False)
        frame.to_excel(book, sheet_name="Rudder")
    guess = guess_trial(tmp_path / "log.xlsx")
    assert_as_sailed(guess)
    assert "only sheet 'Log' is read, not 'Rudder'" in " ".join(guess.trial.notes)
    assert "unit from the row of units" in guess.reading["sog"]
