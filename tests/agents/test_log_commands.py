"""From a log to a ship file and a page, in commands that say what they guessed."""

import numpy as np
import pytest

from agents.cli import main
from shipgym.trials.ship_file import ShipFile
from tests.golden.texts import same_page, same_text


@pytest.fixture
def log(tmp_path, monkeypatch):
    """Heading and rudder of a first-order ship, the rudder positive to port, in degrees, with clock times."""
    t = np.arange(300.0)
    delta, r = 10.0 * np.sign(np.sin(0.07 * t)), np.zeros(t.size)
    for k in range(1, t.size):
        r[k] = r[k - 1] + (0.08 * delta[k - 1] - r[k - 1]) / 12.0
    lines = ["time;Gyro [deg];Rudder"]
    for k, psi in enumerate(30.0 + np.cumsum(r)):
        lines.append(f"2024-05-31 09:{30 + k // 60}:{k % 60:02d};{psi:.2f};{-delta[k]:.1f}".replace(".", ","))
    (tmp_path / "log.csv").write_text("\n".join(lines))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command(monkeypatch, capsys, *words):
    monkeypatch.setattr("sys.argv", ["shipgym", *words])
    with pytest.raises(SystemExit) as left:
        main()
    shown = capsys.readouterr()
    return left.value.code or 0, shown.out + shown.err


def test_a_ship_file_is_written_from_a_log_and_says_what_was_guessed(log, monkeypatch, capsys):
    code, said = command(monkeypatch, capsys, "new-ship", "log.csv", "--length", "150")
    assert code == 0
    assert "psi: column 'Gyro [deg]' in deg, unit from its name" in said
    assert "delta: column 'Rudder' in deg, unit from its size, up to 10" in said
    assert "a positive rudder steers to port, by the yaw that follows" in said
    assert same_text("new ship", said + (log / "ship.toml").read_text())
    (trial,) = ShipFile.load(log / "ship.toml").trials()
    assert trial["delta"][20] == pytest.approx(np.radians(10.0))
    code, said = command(monkeypatch, capsys, "new-ship", "log.csv")
    assert (code, "ship.toml: exists already" in said) == (2, True)


def test_the_record_is_drawn_on_a_page(log, monkeypatch, capsys):
    code, said = command(monkeypatch, capsys, "look", "log.csv")
    assert (code, "log.csv: 300 samples over 299 s: psi, r, delta" in said) == (0, True)
    page = (log / "look.html").read_text()
    assert same_text("look", said)
    assert same_page("look page", page)
    assert page.count("Plotly.newPlot(") == 1
    assert "The channels over time." in page


def test_service_speed_is_what_the_fastest_log_shows(log, monkeypatch, capsys):
    rows = (log / "log.csv").read_text().splitlines()
    for name, low, high in (("slow", 6.0, 7.0), ("fast", 8.0, 12.0)):
        speeds = np.linspace(low, high, len(rows) - 1)  # kn
        more = [f"{row};{speed:.3f}".replace(".", ",") for row, speed in zip(rows[1:], speeds, strict=True)]
        (log / f"{name}.csv").write_text("\n".join([f"{rows[0]};STW [kn]", *more]))
    code, said = command(monkeypatch, capsys, "new-ship", "fast.csv", "slow.csv", "--length", "150")
    assert code == 0, said
    written = ShipFile.load(log / "ship.toml").particulars["speed"]
    assert written == pytest.approx(11.6 * 1852.0 / 3600.0, rel=5e-3)


def test_a_log_that_is_none_is_one_message(log, monkeypatch, capsys):
    (log / "bad.csv").write_text("a;b\n1;2\n")
    code, said = command(monkeypatch, capsys, "look", "bad.csv")
    assert (code, "no column is named like a channel" in said) == (2, True)


def test_a_log_beside_others_that_cannot_be_read_is_told(log, monkeypatch, capsys):
    code, said = command(monkeypatch, capsys, "new-ship", "log.csv", "lag.csv", "--length", "150")
    assert code == 0
    assert "warning: lag.csv: there is no such CSV file. Did you mean 'log.csv'?\n" in said


def test_a_length_is_a_number_of_metres(log, monkeypatch, capsys):
    code, said = command(monkeypatch, capsys, "new-ship", "log.csv", "--length", "inf")
    assert (code, "'--length': Input should be less than or equal to 10000" in said) == (2, True)
    assert not (log / "ship.toml").exists()


def test_a_log_that_does_not_tell_the_rudders_sign_leaves_it_to_the_others(log, monkeypatch, capsys):
    rows = (log / "log.csv").read_text().splitlines()
    straight = [rows[0], *(f"{row.rsplit(';', 1)[0]};0,0" for row in rows[1:60])]
    (log / "straight.csv").write_text("\n".join(straight))
    code, said = command(monkeypatch, capsys, "new-ship", "straight.csv", "log.csv", "--length", "150")
    assert (code, "a positive rudder steers to port" in said) == (0, True)
