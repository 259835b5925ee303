"""From a log to a ship file and a page, in commands that say what they guessed."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from agents.cli import main
from shipgym import ShipFile
from shipgym.trials.guesses import guess_columns
from shipgym.trials.readers.log_table import LogTable


@pytest.fixture
def log(tmp_path, monkeypatch):
    """Heading and rudder of a first-order ship, the rudder positive to port, in
    degrees, with clock times."""
    t = np.arange(300.0)
    delta, r = 10.0 * np.sign(np.sin(0.07 * t)), np.zeros(t.size)
    for k in range(1, t.size):
        r[k] = r[k - 1] + (0.08 * delta[k - 1] - r[k - 1]) / 12.0
    lines = ["time;Gyro [deg];Rudder"]
    for k, psi in enumerate(30.0 + np.cumsum(r)):
        clock = f"2024-05-31 09:{30 + k // 60}:{k % 60:02d}"
        lines.append(f"{clock};{psi:.2f};{-delta[k]:.1f}".replace(".", ","))
    (tmp_path / "log.csv").write_text("\n".join(lines))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command(monkeypatch, capsys, *words):
    monkeypatch.setattr("sys.argv", ["shipgym", *words])
    with pytest.raises(SystemExit) as left:
        main()
    shown = capsys.readouterr()
    return left.value.code or 0, shown.out + shown.err


def test_a_ship_file_is_written_from_a_log_and_says_what_was_guessed(
    log, monkeypatch, capsys
):
    code, said = command(monkeypatch, capsys, "new-ship", "log.csv", "--length", "150")
    assert code == 0
    assert "psi: column 'Gyro [deg]' in deg, unit from its name" in said
    assert "delta: column 'Rudder' in deg, unit from its size, up to 10" in said
    assert "a positive rudder steers to port, by the turning that follows" in said
    written = ShipFile.load(log / "ship.toml")
    assert written.particulars["length"] == 150.0
    assert written.identify["structure"] == "auto"
    (trial,) = written.trials()
    assert trial["delta"][20] == pytest.approx(np.radians(10.0))
    code, said = command(monkeypatch, capsys, "new-ship", "log.csv")
    assert (code, "ship.toml: exists already" in said) == (2, True)


def test_columns_that_all_logs_have_alike_are_declared_once(log, monkeypatch, capsys):
    larger = (log / "log.csv").read_text().replace("10,0", "12,0")
    (log / "other.csv").write_text(larger)
    code, said = command(monkeypatch, capsys, "new-ship", "log.csv", "other.csv")
    assert (code, "other.csv:" in said) == (0, False)
    assert "[trials.columns]" not in (log / "ship.toml").read_text()


def test_the_record_is_drawn_on_a_page(log, monkeypatch, capsys):
    code, said = command(monkeypatch, capsys, "look", "log.csv")
    assert (code, "log.csv: 300 samples over 299 s: psi, r, delta" in said) == (0, True)
    assert "1 trial to identify a model from, with 1 warning." in said
    page = (log / "look-log.html").read_text()
    assert page.count("Plotly.newPlot(") == 1
    assert "The channels over time." in page


def test_service_speed_is_what_the_fastest_log_shows(log, monkeypatch, capsys):
    rows = (log / "log.csv").read_text().splitlines()
    for name, low, high in (("slow", 6.0, 7.0), ("fast", 8.0, 12.0)):
        speeds = np.linspace(low, high, len(rows) - 1)  # kn
        more = [
            f"{row};{speed:.3f}".replace(".", ",")
            for row, speed in zip(rows[1:], speeds, strict=True)
        ]
        (log / f"{name}.csv").write_text("\n".join([f"{rows[0]};STW [kn]", *more]))
    code, said = command(
        monkeypatch, capsys, "new-ship", "fast.csv", "slow.csv", "--length", "150"
    )
    assert code == 0, said
    written = ShipFile.load(log / "ship.toml").particulars["speed"]
    assert written == pytest.approx(11.6 * 1852.0 / 3600.0, rel=5e-3)


def test_a_log_that_is_none_is_one_message(log, monkeypatch, capsys):
    (log / "bad.csv").write_text("a;b\n1;2\n")
    code, said = command(monkeypatch, capsys, "look", "bad.csv")
    assert (
        code,
        "psi: expected the column of the heading, one of 'a', 'b'" in said,
    ) == (2, True)


def test_a_log_beside_others_that_cannot_be_read_is_told(log, monkeypatch, capsys):
    code, said = command(
        monkeypatch, capsys, "new-ship", "log.csv", "lag.csv", "--length", "150"
    )
    assert code == 0
    assert "warning: lag.csv: there is no such log. Did you mean 'log.csv'?" in said


EXAMPLE = Path(__file__).parents[2] / "examples" / "mariner" / "zigzag_10_10.csv"


def test_every_column_of_the_examples_log_is_recognised_in_its_unit(
    log, monkeypatch, capsys
):
    shutil.copy(EXAMPLE, log)
    code, said = command(
        monkeypatch, capsys, "new-ship", EXAMPLE.name, "--length", "160.9"
    )
    assert (code, "not used" in said) == (0, False), said
    assert "r: column 'gyro_deg_s' in deg/s, unit from its name" in said
    assert "psi: column 'compass_deg' in deg, unit from its name" in said
    (trial,) = ShipFile.load(log / "ship.toml").trials()
    all_given = ShipFile.load(EXAMPLE.parent / "ship.toml").trials()
    given = next(one for one in all_given if one.name == EXAMPLE.name)
    for name in given.channels:
        assert np.array_equal(trial[name], given[name])


@pytest.mark.parametrize(
    ("name", "channel", "unit"),
    [
        ("gyro_deg_s", "r", "deg/s"),
        ("Gyro [°/s]", "r", "deg/s"),
        ("yaw rad per s", "r", "rad/s"),
        ("heading_deg", "psi", "deg"),
        ("compass", "psi", "rad"),
        ("yaw_rate_deg_min", "r", "deg/min"),
        ("t_ms", "t", "ms"),
        ("u_m_s", "u", "m/s"),
        ("log_ahead_kn", "u", "knots"),
        ("gnss_north_m", "x", "m"),
        ("Lat [deg min]", "lat", "ddmm.mm"),
        ("Rudder S", "delta", "rad"),  # of starboard, no unit
        ("rudder_deg_s", None, None),
        ("gnss_north_m_s", None, None),
    ],
)
def test_a_name_is_a_channels_where_its_unit_is_one_of_it(name, channel, unit):
    found = guess_columns(
        LogTable(Path("log"), {name: np.array([0.0, 0.1, 0.2])}, range(3))
    )
    assert [(one.channel, one.unit) for one in found] == (
        [(channel, unit)] if channel else []
    )


def test_a_log_without_known_names_gives_a_ship_file_to_complete(
    log, monkeypatch, capsys
):
    text = (log / "log.csv").read_text().replace("time;Gyro [deg];Rudder", "a;b;c")
    (log / "bad.csv").write_text(text)
    code, said = command(monkeypatch, capsys, "new-ship", "bad.csv", "--length", "150")
    assert (code, "complete the lines marked DECIDE" in said) == (0, True)
    written = (log / "ship.toml").read_text()
    assert (
        "psi = \"decide\"   # DECIDE: the column of the heading, one of 'a', 'b'"
        in written
    )
    code, said = command(monkeypatch, capsys, "identify", "ship.toml", "--out", "out")
    assert (code, "ship.toml: line 18: t: expected a decision" in said) == (2, True), (
        said
    )
    for channel, name in {"t": "a", "psi": "b", "delta": "c"}.items():
        written = written.replace(
            f'{channel} = "decide"',
            f'{channel} = {{ column = "{name}", unit = "UNIT" }}',
        )
    written = written.replace("UNIT", "s", 1).replace("UNIT", "deg")
    (log / "ship.toml").write_text(
        written.replace('# rudder_positive = "starboard"', 'rudder_positive = "port"')
    )
    assert ShipFile.load(log / "ship.toml").trials()[0].duration == 299.0


@pytest.mark.parametrize("length", ["1e9", "2001", "0.009", "inf", "nan", "-5"])
def test_a_length_that_no_ship_has_is_refused_before_a_log_is_read(
    log, monkeypatch, capsys, length
):
    code, said = command(monkeypatch, capsys, "new-ship", "log.csv", "--length", length)
    assert code == 2
    assert "'--length'" in said
    assert not (log / "ship.toml").exists()


@pytest.mark.parametrize("idle", [0, 600])
def test_cuts_are_proposed_for_a_log_with_idle_parts(log, monkeypatch, capsys, idle):
    first, *rows = (log / "log.csv").read_text().splitlines()
    quiet = [f"{30.0 + 0.01 * np.sin(0.1 * k):.3f};0.0" for k in range(idle)]
    moved = [";".join(row.split(";")[1:]).replace(",", ".") for row in rows]
    lines = [f"{k};{cells}" for k, cells in enumerate([*quiet, *moved, *quiet])]
    (log / "idle.csv").write_text("\n".join([first, *lines]))
    command(monkeypatch, capsys, "new-ship", "idle.csv", "--length", "150")
    written = (log / "ship.toml").read_text()
    assert ('\ncut = "rudder"' in written) == bool(idle)
    if idle:
        (trial,) = ShipFile.load(log / "ship.toml").trials()
        assert 300.0 <= trial.duration <= 400.0


def test_a_yaw_rate_alone_needs_the_service_speed(log, monkeypatch, capsys):
    rates = [
        f"{k};{2.0 * np.sin(0.05 * k):.3f};{9.0 * np.sin(0.05 * k + 1.0):.2f}"
        for k in range(200)
    ]
    (log / "rate.csv").write_text("\n".join(["t;ROT [deg/s];Rudder [deg]", *rates]))
    _, said = command(monkeypatch, capsys, "new-ship", "rate.csv", "--length", "9")
    assert "to decide: speed: the service speed" in said
    assert 'speed = "decide"' in (log / "ship.toml").read_text()


def test_runs_in_one_file_are_cut_and_checked_again(log, monkeypatch, capsys):
    rows = [
        f"{k % 200};{30.0 + 0.1 * (k % 200)};{9.0 * (-1) ** (k // 20)}"
        for k in range(400)
    ]
    (log / "two.csv").write_text("\n".join(["t [s];Heading [deg];Rudder [deg]", *rows]))
    _, said = command(monkeypatch, capsys, "new-ship", "two.csv", "--length", "9")
    assert "time goes back by 199 s: another run begins" in said
    text = (log / "ship.toml").read_text()
    assert "cut = [[0.0, 199.0], [799.0, 998.0]]" in text
    text = text.replace('"decide"', '"starboard"').replace(
        "# speed = 7.7", "speed = 7.7"
    )
    (log / "ship.toml").write_text(text)
    assert len(ShipFile.load(log / "ship.toml").trials()) == 2
    again = "new-ship", "--update", "ship.toml"
    assert command(monkeypatch, capsys, *again)[0] == 0
    (log / "ship.toml").write_text(text.replace("Rudder [deg]", "Ruder"))
    code, said = command(monkeypatch, capsys, *again)
    assert (code, "to correct: ship.toml: [[trials]] 1" in said) == (1, True)


def test_what_nobody_gave_is_told_as_assumed_and_what_is_missing_as_a_fault(
    log, monkeypatch, capsys
):
    rows = [f"{k};{30 + k % 9};{5 + k % 2}kn" for k in range(60)]
    text = "\n".join(["t [s];Heading [deg];STW", *rows])
    (log / "log.csv").write_text(text)
    command(monkeypatch, capsys, "new-ship", "log.csv", "--length", "9")
    ship = ShipFile.load(log / "ship.toml")
    assert (ship.particulars.estimated, ship.steering) == ({"speed"}, None)
    assert np.ptp(ship.trials()[0]["u"]) == pytest.approx(1852.0 / 3600.0)
    code, said = command(monkeypatch, capsys, "new-ship", "--update", "ship.toml")
    assert (code, "ship.toml: [[trials]] 1: no rudder angle" in said) == (1, True)
