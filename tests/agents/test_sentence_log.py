"""The log of sentences: its form, what reads it, and what happens when it fails."""

import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import PID
from agents.cli import app
from agents.export.helm import Helm
from agents.export.panel import HelmPanel
from agents.export.sensors import Limits
from agents.export.sentence_log import SentenceLog
from agents.export.simulated import SimulatedShip
from shipgym.errors import InputError
from shipgym.trials.nmea import checksum
from tests.agents.policies import MARINER
from tests.agents.steering import free_port, sentence

ORDER = sentence("AGROR", 10.0, "A", "", "V", "B")


def test_a_line_is_a_sentence_behind_where_it_came_from_and_when(tmp_path):
    path = tmp_path / "log.nmea"
    begin = time.time()
    log = SentenceLog(path, 100.0)
    heading = sentence("HEHDT", 90.0, "T").strip()
    log.take(heading, "in-127.0.0.1:10110", 100.0)
    log.take("\\s:GP,c:1*00\\" + heading, "in-/dev/ttyUSB0", 102.5)
    log.take(ORDER + ORDER, "out", 102.5)
    log.take("\x1b[2J\ufffd*,", "in-evil,\\*host", 103.0)
    log.close()
    lines = path.read_bytes().decode("ascii").split("\r\n")
    assert lines.pop() == ""
    tags = [line.split("\\")[1] for line in lines]
    for tag in tags:
        text, _, digits = tag.partition("*")
        assert digits == checksum(text)
    sources, times = zip(*(tag.split("*")[0].split(",c:") for tag in tags), strict=True)
    assert sources == (
        "s:in-127.0.0.1:10110",
        "s:in-/dev/ttyUSB0",
        "s:out",
        "s:out",
        "s:in-evil___host",
    )
    seconds = np.array(times, dtype=float) / 1000.0 - begin
    assert seconds == pytest.approx([0.0, 2.5, 2.5, 2.5, 3.0], abs=0.5)
    assert np.diff(seconds) == pytest.approx([2.5, 0.0, 0.0, 0.5], abs=1e-6)
    assert [line.split("\\")[2] for line in lines[:2]] == [heading, heading]
    assert lines[-1].endswith("\\?[2J?*,")


def test_what_is_logged_is_read_as_the_ship_sailed_and_orders_disturb_nothing(tmp_path):
    ship = SimulatedShip(MARINER, leg=0.3)
    helm = Helm(PID.from_model(MARINER), 0.5, Limits())
    log = SentenceLog(tmp_path / "log.nmea", 0.0)
    panel = HelmPanel(log)
    for step in range(600):
        now = 0.1 * step
        for line in ship.sentences().splitlines():
            helm.hear(line, "10.0.0.1:10110", now)
            panel.heard(line, "10.0.0.1:10110", now)
        if step % 10 == 0:
            helm.watch(1.0, now)
            helm.steer(now)
            panel.sent(helm.sentences(), now)
            panel.update(helm, now)
            ship.order = helm.order
        ship.advance()
    log.close()
    command = ["new-ship", str(tmp_path / "log.nmea"), "--length", "160.9"]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "ship.toml")])
    assert result.exit_code == 0
    assert "channels: x, y, psi, u, v, r, delta" in result.stdout
    assert "a positive rudder steers to starboard" in result.stdout
    assert "damaged" not in result.stderr


def test_a_file_that_exists_is_never_written(tmp_path):
    path = tmp_path / "log.nmea"
    path.write_text("precious")
    link = tmp_path / "link.nmea"
    link.symlink_to(tmp_path / "elsewhere.nmea")
    PID.from_model(MARINER).save(tmp_path / "pid.json")
    for taken in (path, link):
        with pytest.raises(InputError, match="expected a new file, got one that exi"):
            SentenceLog(taken, 0.0)
        command = ["steer", str(tmp_path / "pid.json"), "--nmea", "udp:127.0.0.1:1"]
        result = CliRunner().invoke(app, [*command, "--log", str(taken)])
        assert result.exit_code == 2
        assert len(result.stderr.splitlines()) == 1
    assert path.read_text() == "precious"
    assert not (tmp_path / "elsewhere.nmea").exists()


def steered(panel):
    """A helm that steers on, watched by a panel, and its last sentences."""
    helm = Helm(PID.from_model(MARINER), 0.5, Limits())
    for now in range(5):
        for fields in (("HEHDT", 20.0, "T"), ("TIROT", 0.0, "A"), ("IIRSA", 0.0, "A")):
            line = sentence(*fields).strip()
            helm.hear(line, "a:1", float(now))
            panel.heard(line, "a:1", float(now))
        helm.watch(1.0, float(now))
        panel.sent(helm.sentences(), float(now))
        panel.update(helm, float(now))
        time.sleep(0.15)
    assert helm.state == "steering"
    return helm.status, helm.sentences()


def check_failed(log, said, *parts):
    status, text = steered(HelmPanel(log, said.append))
    log.close()
    (message,) = said
    for part in parts:
        assert part in message
    assert status.endswith("log cannot be written")
    assert "AGALR,,006,A,V,LOG CANNOT BE WRITTEN" in text


def test_without_its_folder_it_steers_on_with_one_message_and_an_alarm_line(tmp_path):
    path = tmp_path / "absent" / "log.nmea"
    log = SentenceLog(path, 0.0)
    check_failed(log, [], str(path), "No such file or directory")


def test_on_a_full_disk_it_steers_on_with_one_message_and_an_alarm_line(tmp_path):
    log = SentenceLog(tmp_path / "log.nmea", 0.0)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, hard))
    try:
        check_failed(log, [], "log.nmea: cannot be written (File too large)")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert (tmp_path / "log.nmea").stat().st_size == 200


def test_a_kill_loses_at_most_a_second(tmp_path):
    path = tmp_path / "log.nmea"
    script = f"""
import time
from pathlib import Path
from agents.export.sentence_log import SentenceLog
log = SentenceLog(Path({str(path)!r}), time.time())
while True:
    log.take("$HEHDT,90.0,T*16", "in-a:1", time.time())
    time.sleep(0.01)
"""
    process = subprocess.Popen([sys.executable, "-c", script])
    while not path.exists() or path.stat().st_size < 2000:
        time.sleep(0.05)
    time.sleep(0.5)
    process.kill()
    killed_at = time.time()
    process.wait()
    *_, last, _ = path.read_bytes().decode("ascii").split("\r\n")
    _, tags, text = last.split("\\")
    milliseconds = float(tags.partition(",c:")[2].partition("*")[0])
    assert killed_at - milliseconds / 1000.0 < 1.0
    assert text == "$HEHDT,90.0,T*16"


def test_a_slow_disk_fills_no_memory(tmp_path):
    log = SentenceLog(tmp_path / "log.nmea", 0.0)
    log.most_waiting = 100
    for _ in range(1000):
        log.take(ORDER, "out", 0.0)
    assert "too slow to keep up" in log.problem
    log.close()


@pytest.mark.parametrize("seconds", [2.0])
def test_the_command_logs_what_it_sends(seconds, tmp_path):
    PID.from_model(MARINER).save(tmp_path / "pid.json")
    path = tmp_path / "log.nmea"
    port = free_port()
    command = ["steer", str(tmp_path / "pid.json"), "--nmea", f"udp:127.0.0.1:{port}"]
    more = ["--gear", f"udp:127.0.0.1:{free_port()}", "--duration", str(seconds)]
    result = CliRunner().invoke(app, [*command, *more, "--log", str(path)])
    assert result.exit_code == 0
    assert Path(path).read_text("ascii").count("AGROR,0.0,V") == 3
