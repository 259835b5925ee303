"""Logs of recorders of many kinds: what is odd is counted, what is unknown is asked."""

import csv
import io

import numpy as np
import pytest

from shipgym.errors import InputError
from shipgym.trials.guesses import guess_trial
from tests.shipgym.one_zigzag import sailed

SHIP = list(sailed(240))
PSI = np.radians([one.psi for one in SHIP])
T = np.arange(len(SHIP))
RATE = np.gradient(np.unwrap(PSI))


def table(names, *columns):
    """Text of a table, its cells written by Python."""
    text = io.StringIO()
    rows = zip(*columns, strict=True)
    csv.writer(text, lineterminator="\n").writerows([names, *rows])
    return text.getvalue()


def plain(**changed):
    """Columns of time, heading, rudder and speed in degrees and knots."""
    columns = {
        "Time": T,
        "Heading": [f"{one.psi:.2f}" for one in SHIP],
        "Rudder": [f"{one.rudder:.2f}" for one in SHIP],
    }
    columns |= changed
    return columns


def guessed(tmp_path, text, name="log.csv"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return guess_trial(tmp_path / name)


def turned(trial):
    """Largest difference of a heading from the ship's, deg."""
    psi = np.interp(trial.t, T, np.unwrap(PSI))
    apart = trial["psi"] - psi
    apart -= 2.0 * np.pi * np.round(apart[0] / (2.0 * np.pi))
    return np.degrees(np.abs(apart).max())


QUATERNION = [np.cos(PSI / 2), 0.0 * PSI, 0.0 * PSI, np.sin(PSI / 2)]
ENU = np.pi / 2 - PSI
EAST = [0.0 * PSI, 0.0 * PSI, np.sin(ENU / 2), np.cos(ENU / 2)]


@pytest.mark.parametrize(
    ("names", "columns", "frame"),
    [
        ([f"q[{k}]" for k in range(4)], QUATERNION, None),
        (["q1", "q2", "q3", "q4"], QUATERNION, None),
        ([f"pose.orientation.{k}" for k in "xyzw"], EAST, "enu"),
        (["qw", "qx", "qy", "qz"], QUATERNION, None),
    ],
)
def test_a_quaternion_is_a_heading(tmp_path, names, columns, frame):
    rudder = [one.rudder for one in SHIP]
    text = table(["t", *names, "Rudder"], T, *columns, rudder)
    guess = guessed(tmp_path, text)
    assert turned(guess.trial) < 0.3
    assert guess.side.side == "starboard"
    assert {one.name: one.value for one in guess.conventions}.get("frame") == frame


@pytest.mark.parametrize("name", ["yaw", "orientation.yaw"])
def test_positions_decide_from_where_a_heading_counts(tmp_path, name):
    columns = [[one.lat for one in SHIP], [one.lon for one in SHIP]]
    text = table(["t", "lat", "lon", name], T, *columns, ENU)
    guess = guessed(tmp_path, text)
    assert turned(guess.trial) < 0.3
    text = table(["t", "lat", "lon", name], T, *columns, PSI)
    assert turned(guessed(tmp_path, text).trial) < 0.3


ODD = {
    "a footer": (plain(), "Mean,40.0,0.0\n", "'Mean' is no time"),
    "an odd cell": (
        plain(Heading=[f"{one.psi}" if one.t != 9 else "4O.2" for one in SHIP]),
        "",
        "'4O.2' is no number",
    ),
    "bearings": (plain(Heading=[f"{one.psi:.1f} T" for one in SHIP]), "", ""),
    "commas": (
        plain(
            Heading=[f"{one.psi:.2f}".replace(".", ",") for one in SHIP],
            Rudder=[f"{one.rudder:.2f}".replace(".", ",") for one in SHIP],
        ),
        "",
        "",
    ),
    "a ragged row": (plain(), "240,40.0,0.0,7\n", "1 of 241 rows, from line 242 on"),
    "a cut row": (plain(), "240,40.0", "line 242 is no whole row"),
}


@pytest.mark.parametrize("kind", ODD)
def test_what_is_odd_is_counted_and_left_out(tmp_path, kind):
    columns, footer, note = ODD[kind]
    guess = guessed(tmp_path, table(columns, *columns.values()) + footer)
    assert len(guess.trial) == len(SHIP)
    assert turned(guess.trial) < 0.5
    assert note in " ".join(guess.trial.notes)


def test_rows_without_their_last_cells_are_completed(tmp_path):
    text = "Time,Heading,Rudder,Depth,Note\n"
    for one in SHIP:
        text += f"{one.t},{one.psi:.2f},{one.rudder:.2f}{',12' * (one.t % 5 == 0)}\n"
    guess = guessed(tmp_path, text)
    assert turned(guess.trial) < 0.3
    assert "lack cells at their end" in " ".join(guess.trial.notes)


@pytest.mark.parametrize(
    ("name", "key", "words"),
    [
        ("Rudder [%]", "delta", "full = 100 }"),
        ("Rudder [gon]", "delta", "'gon' is not known"),
        ("Rudder (counts)", "delta", "'counts' is not known"),
    ],
)
def test_a_unit_that_is_not_known_is_a_question(tmp_path, name, key, words):
    columns = plain()
    columns = {"Time": T, "Heading": columns["Heading"], name: columns["Rudder"]}
    (decision,) = guessed(tmp_path, table(columns, *columns.values())).decisions
    assert decision.key == key
    assert words in decision.choices


@pytest.mark.parametrize(
    ("column", "channel"),
    [
        ("LatAcc", "lat"),
        ("delta_q_reset", "delta"),
        ("orientation.x", "x"),
        ("wind_dir_relative", "wind_from"),
        ("desired_heading", "psi"),
        ("v [km/h]", "v"),
    ],
)
def test_a_name_alone_makes_no_channel(tmp_path, column, channel):
    columns = plain() | {column: 1.0 + 0.01 * T}
    guess = guessed(tmp_path, table(columns, *columns.values()))
    assert channel not in {one.channel for one in guess.columns if one.name == column}


def test_a_heading_that_is_stuck_is_noted(tmp_path):
    stuck = [f"{SHIP[60 if 60 < one.t < 90 else int(one.t)].psi:.1f}" for one in SHIP]
    columns = plain(Heading=stuck, Rudder=[20.0 if one.t > 50 else 0.0 for one in SHIP])
    guess = guessed(tmp_path, table(columns, *columns.values()))
    assert "the heading stands still from" in " ".join(guess.trial.notes)


def test_the_course_tells_the_unit_of_a_heading_that_goes_on_after_a_turn(tmp_path):
    columns = plain(Heading=PSI + 4.0 * np.pi, **PLACES)
    guess = guessed(tmp_path, table(columns, *columns.values()))
    assert guess.reading["psi"].startswith("column 'Heading' in rad, unit fits where")
    assert turned(guess.trial) < 0.1


def test_a_rudder_that_never_moves_is_said_to_stay(tmp_path):
    columns = plain(Rudder=0 * T)
    notes = guessed(tmp_path, table(columns, *columns.values())).trial.notes
    assert any(one.startswith("the rudder stays where it is") for one in notes)


PLACES = {name: [getattr(one, name.lower()) for one in SHIP] for name in ("Lat", "Lon")}
EXCHANGES = {
    ("Lat", "Lon"): "a track that goes elsewhere; name the right columns of lat",
    ("COG", "Heading"): "a track that follows the heading; name the right",
}


@pytest.mark.parametrize("pair", EXCHANGES)
def test_exchanged_columns_are_told_by_the_track(tmp_path, pair):
    ground = {"COG": [one.course for one in SHIP], "SOG": [one.speed for one in SHIP]}
    columns = plain(**PLACES, **ground)
    exchanged = dict([pair, pair[::-1]])
    names = [exchanged.get(name, name) for name in columns]
    (decision,) = guessed(tmp_path, table(names, *columns.values())).decisions
    assert EXCHANGES[pair] in decision.choices


def test_units_that_a_name_or_recorder_defines_are_known(tmp_path):
    yaw = np.unwrap(PSI) - PSI[0]
    names = ["TIMESTAMPms", "M1ATTITUDEyaw", "M1ATTITUDEyawspeed", "rudcmd"]
    rudder = np.radians([one.rudder for one in SHIP])
    guess = guessed(tmp_path, table(names, 1000 * T, yaw, RATE, rudder))
    units = {one.channel: one.unit for one in guess.columns}
    assert units == {"t": "ms", "psi": "rad", "r": "rad/s", "delta_command": "rad"}


def test_a_parquet_file_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    texts = arrow.DictionaryArray.from_arrays([0] * 20, ["x" * 100_000])
    parquet.write_table(arrow.table({"t": texts}), tmp_path / "log.parquet")
    monkeypatch.setattr("shipgym.trials.readers.text_files.LARGEST_UNPACKED", 2**20)
    with pytest.raises(InputError, match="at most 1048576 bytes unpacked"):
        guess_trial(tmp_path / "log.parquet")


@pytest.mark.parametrize("sign", [1, -1])
def test_a_column_that_moves_before_the_heading_is_asked_about(tmp_path, sign):
    columns = plain()
    rudder = sign * np.array(columns["Rudder"], dtype=float)
    text = table(["Time", "Heading", "XQ7"], T, columns["Heading"], rudder)
    (decision,) = guessed(tmp_path, text).decisions
    assert decision.key == "delta"
    assert 'column = "XQ7", unit = "deg"' in decision.choices
