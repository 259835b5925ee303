"""One TOML file says what ship it is, how to read its data and what trials are for."""

import re
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from shipgym import ShipFile, SteeringGear
from shipgym.errors import InputError

SHIPS = Path(__file__).parents[1] / "ships"
DATA = Path(__file__).parents[2].parent / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(),
    reason="the measured trials lie beside the checkout and are absent here",
)

T = np.arange(0.0, 30.0, 0.25)

SHIP = """
[ship]
name = "Model"
length = 7.0
beam = 1.2688
draught = 0.455
mass = 3272.0
xg = 0.25
propeller_diameter = 0.204

[ship.added_mass]
Y_vdot = -0.0145

[steering]
rudder_limit_deg = 35.0
rudder_rate_deg_s = 15.8

[columns]
t = "time"
psi = { column = "yaw", unit = "deg" }
u = "u"
v = "v"
r = { column = "yaw rate", unit = "deg/s" }
delta = { column = "rudder", unit = "deg" }
n = { column = "shaft", unit = "rpm" }

[conventions]
rudder_positive = "port"

[identify]
structure = "abkowitz"
method = "tls-svm"

[[trials]]
file = "a.csv"
kind = "zigzag"

[[trials]]
file = "runs/b.csv"
use = "validate"
rudder_positive = "starboard"
origin = "cg"
columns = { psi = { column = "yaw", unit = "rad" }, n = "shaft" }

[[trials]]
file = "c.csv"
use = "skip"
"""


def columns(psi_factor=1.0, sign=1.0, shaft=600.0):
    psi = 20.0 * np.sin(0.2 * T)
    return {
        "time": T,
        "yaw": psi * psi_factor,
        "u": 1.1 + 0.0 * T,
        "v": 0.1 * np.sin(0.2 * T),
        "yaw rate": 4.0 * np.cos(0.2 * T),
        "rudder": sign * 10.0 * np.cos(0.2 * T),
        "shaft": shaft + 0.0 * T,
    }


def write_csv(path, table):
    rows = zip(*(values.tolist() for values in table.values()), strict=True)
    path.write_text(
        "\n".join([",".join(table), *(",".join(map(repr, row)) for row in rows)]) + "\n"
    )


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "runs").mkdir()
    write_csv(tmp_path / "a.csv", columns(sign=-1.0))
    write_csv(
        tmp_path / "runs" / "b.csv", columns(psi_factor=np.pi / 180.0, shaft=10.0)
    )
    (tmp_path / "ship.toml").write_text(SHIP)
    return tmp_path


def refusal(folder, old="", new="", read=False, text=None):
    """The message for the ship file with one change."""
    assert old in SHIP
    (folder / "ship.toml").write_text(
        SHIP.replace(old, new, 1) if text is None else text
    )
    answer = (
        ShipFile.load(folder / "ship.toml").trials
        if read
        else partial(ShipFile.load, folder / "ship.toml")
    )
    with pytest.raises(InputError) as caught:
        answer()
    message = str(caught.value)
    assert message.startswith(str(folder / "ship.toml"))
    assert "\n" not in message
    return message.removeprefix(str(folder / "ship.toml"))


def test_a_ship_file_gives_particulars_steering_gear_and_defaults(folder):
    ship = ShipFile.load(str(folder / "ship.toml"))
    assert ship.path == folder / "ship.toml"
    assert (
        ship.particulars.name,
        ship.particulars.length,
        ship.particulars.Y_vdot,
    ) == (
        "Model",
        7.0,
        -0.0145,
    )
    assert ship.particulars.estimated == frozenset()
    assert ship.steering == SteeringGear(35.0, 15.8)
    assert ship.identify == {"structure": "abkowitz", "method": "tls-svm"}


def test_trials_are_read_with_the_file_s_conventions_or_their_own(folder):
    a, b = ShipFile.load(folder / "ship.toml").trials()
    assert (a.name, a.kind, a.use) == ("a.csv", "zigzag", "fit")
    assert (a.length, b.length) == (7.0, 7.0)
    assert (b.name, b.kind, b.use) == ("runs/b.csv", None, "validate")
    for channel in ("psi", "u", "r", "delta", "n"):
        np.testing.assert_allclose(b[channel], a[channel], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(b["v"], a["v"] - 0.25 * a["r"], rtol=1e-12)
    assert a["delta"][0] == pytest.approx(np.radians(10.0))
    assert a["n"][0] == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "length = 7.0",
            "length = -7.0",
            ": [ship] length: ",
        ),
        ("length = 7.0", "", ": [ship]: field 'length' is missing"),
        ("beam =", "beem =", ": [ship]: unknown key 'beem'. Did you mean 'beam'?"),
        (
            "rudder_limit_deg = 35.0",
            "rudder_limit_deg = -3.0",
            ": [steering] rudder_limit_deg: ",
        ),
        (
            'unit = "deg/s"',
            'unit = "degs"',
            ": [columns] r: expected a unit of angular rate",
        ),
        ('v = "v"', 'sway = "v"', ": [columns]: unknown channel 'sway'"),
        (
            'rudder_positive = "port"',
            'rudder_positive = "left"',
            ": [conventions] rudder_positive: ",
        ),
        (
            'rudder_positive = "starboard"',
            'rudder_positive = "right"',
            ": [[trials]] 2 rudder_positive: expected one of",
        ),
        (
            'structure = "abkowitz"',
            'reference_model = "ship.py"',
            ": [identify].reference_model: expected data, got 'ship.py', which is code",
        ),
        ('kind = "zigzag"', 'kind = "zig zag"', ": [[trials]] 1 kind: "),
        (
            'use = "validate"',
            'used = "validate"',
            ": [[trials]] 2: unknown key 'used'. Did you mean 'use'?",
        ),
        ('file = "a.csv"', "", ": [[trials]] 1: expected file = "),
        (
            "[[trials]]",
            "[sensors]\ngnss_antenna = { forward = -42.0 }\n[[trials]]",
            ": [[trials]] 1 gnss_antenna.forward: expected a place on the ship",
        ),
        (
            'file = "a.csv"',
            'file = ["a.csv"]',
            " file: expected one file, got a list",
        ),
        (
            'file = "runs/b.csv"',
            'file = "./a.csv"',
            ": [[trials]] 2 file: expected each file once, got './a.csv'",
        ),
        ("xg = 0.25", "", ": [[trials]] 2 origin: expected xg"),
        ("[ship]", "[ship", ": not valid TOML"),
        (
            'v = "v"',
            'v = "u"',
            ": [columns]: expected each column once, got 'u' for u and v; name the",
        ),
        ("[ship]", "[ship]\nestimated = []", "unknown key 'estimated'"),
    ],
)
def test_what_is_wrong_in_a_ship_file_is_named_by_field(folder, old, new, message):
    assert message in refusal(folder, old, new)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected a table [ship] with"),
        ("[ship]\nlength = 7.0\n", "expected tables that begin with [[trials]]"),
        (
            '[ship]\nlength = 7.0\n[[trials]]\nfile = "a.csv"\nuse = "skip"\n',
            'got use = "skip" for all',
        ),
    ],
)
def test_a_ship_file_without_ship_or_trials_is_refused(folder, text, message):
    assert message in refusal(folder, text=text)


def test_a_missing_ship_file_a_folder_and_binary_content_are_refused(tmp_path):
    with pytest.raises(InputError, match="there is no such ship file"):
        ShipFile.load(tmp_path / "ship.toml")
    with pytest.raises(InputError, match="got a folder"):
        ShipFile.load(tmp_path)
    (tmp_path / "ship.toml").write_bytes(b"[ship]\nname = \xff\x00")
    with pytest.raises(
        InputError,
        match=r"line 2: expected a ship file \(TOML\) in UTF-8, got byte 0xff",
    ):
        ShipFile.load(tmp_path / "ship.toml")


@pytest.mark.parametrize("file", ["b.csv", "x" * 300, "runs", "/dev/zero"])
def test_a_missing_trial_is_refused_on_loading(folder, file):
    assert refusal(folder, '"a.csv"', f'"{file}"').startswith(": [[trials]] 1 file: ")
    (folder / "a.csv").rename(folder / "a_.csv")
    assert "a.csv: there is no such CSV file. Did you mean 'a_.csv'?" in refusal(folder)


def test_what_is_wrong_in_a_trial_names_ship_file_and_csv_file(folder):
    message = refusal(folder, 'u = "u"', 'u = "U"', read=True)
    assert message.startswith(": [[trials]] 1: ")
    assert (
        "a.csv: column 'U' not found. Did you mean 'u'? Columns present: 'time', 'yaw'"
        in message
    )


# --- real input


@pytest.mark.parametrize(
    "path", sorted(SHIPS.glob("*.toml")), ids=lambda path: path.stem
)
@needs_data
def test_every_measured_trial_is_imported(path):
    ship = ShipFile.load(path)
    trials = ship.trials()
    assert [trial.name for trial in trials] == [
        t["file"] for t in tomllib.loads(path.read_text())["trials"]
    ]
    for trial in trials:
        speed = np.quantile(trial["u"], 0.95)
        assert trial.duration > 60.0
        assert {"psi", "u", "v", "r", "delta", "n"} <= set(trial.channels)
        assert 0.3 < speed / ship.particulars.speed < 1.2
        assert trial.derived == frozenset()
        # the rudder turns the ship to the side it is laid to: regress the yaw
        # acceleration of a turning ship
        steps = np.arange(0, len(trial), max(1, len(trial) // 200))
        yaw_rate, rudder = trial["r"][steps], trial["delta"][steps]
        change, level = np.diff(yaw_rate), np.column_stack([yaw_rate[:-1], rudder[:-1]])
        assert np.linalg.lstsq(level, change, rcond=None)[0][1] > 0.0


@needs_data
def test_a_part_without_kind_has_that_which_rudder_and_heading_show(tmp_path):
    text = re.sub(
        "kind = .*", "cut = [[0, 1e9]]", (SHIPS / "esso_osaka_3m.toml").read_text()
    )
    path = tmp_path / "ship.toml"
    path.write_text(text.replace("../../../shared/data", str(DATA)))
    kinds = [trial.kind for trial in ShipFile.load(path).trials()]
    assert kinds[:5:2] == [None, "turning-circle", "zigzag"]
