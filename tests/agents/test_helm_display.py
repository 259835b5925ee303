"""The display of the helm in a terminal, its keys, and what becomes of the terminal."""

import asyncio
import fcntl
import io
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from agents import PID
from agents.export.display import (
    KEYS,
    HelmView,
    Missing,
    SourceView,
    bearing,
    rendered,
    sided,
)
from agents.export.heard import HeardSentences
from agents.export.helm import Helm
from agents.export.helm_commands import MANUAL, STANDBY, STEERING
from agents.export.keys import commands_of, keyboard
from agents.export.panel import HelmPanel
from agents.export.screen import Screen
from agents.export.sensors import Limits
from tests.agents.policies import MARINER
from tests.agents.steering import free_port, sentence

COMPASS = sentence("HEHDT", 45.0, "T").strip()
OTHERS = [
    sentence("TIROT", -6.0, "A").strip(),
    sentence("IIRSA", 3.0, "A", "", "V").strip(),
]
SOURCE = "127.0.0.1:10110"


class Watched:
    """A helm with a panel, and the newest view of it."""

    def __init__(self, heading=0.9):
        self.helm = Helm(PID.from_model(MARINER), heading, Limits())
        self.panel = HelmPanel()
        self.panel.displays.append(self.keep)
        self.now = 0.0
        self.view = None

    def keep(self, view):
        self.view = view

    def tick(self, *lines, seconds=1.0):
        self.now += seconds
        for line in lines:
            self.helm.hear(line, SOURCE, self.now)
            self.panel.heard(line, SOURCE, self.now)
        self.helm.watch(seconds, self.now)
        self.helm.steer(self.now)
        self.panel.update(self.helm, self.now)
        return self.view

    def press(self, *commands):
        for command in commands:
            self.panel.press(command)
        return self.view


def text_of(view, width=80, lines=24):
    console = Console(width=width, height=lines, file=io.StringIO(), color_system=None)
    console.print(rendered(view, "shipgym steer pid on tcp:127.0.0.1:10110", lines))
    return console.file.getvalue()


def test_a_helmsman_sees_what_is_steered_by_what():
    text = text_of(Watched().tick(COMPASS, *OTHERS))
    for part in ("STEERING", "045.0°", "051.6°", "-6.0°/min", "3.0° stbd", "0.0 s"):
        assert part in text
    for sender in ("HEHDT", "TIROT", "IIRSA"):
        assert f"{sender} from {SOURCE}" in text
    for key, label in KEYS.values():
        assert f"{key}  {label}" in text


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (sentence("HCHDG", 45.0, "", "", "", ""), "HCHDG: only magnetic headings"),
        (sentence("HCHDM", 45.0, "M"), "HCHDM: only magnetic headings"),
        (sentence("HETHS", 45.0, "V"), "HETHS: status V"),
        (sentence("HEHDT", "", "T"), "HEHDT: an empty field"),
        ("$HEHDT,45.0,T*00", "HEHDT: damaged"),
        (sentence("VWVHW", 45.0, "T", "", "M", 7.0, "N"), "VWVHW: of a kind"),
        (sentence("SDDBT", 45.0, "f"), "nothing heard"),
        ("$\x1b[HDT,45.0,T*00", "nothing heard"),
    ],
)
def test_what_is_missing_is_shown_with_what_was_heard_instead(line, reason):
    view = Watched().tick(line.strip(), *OTHERS)
    assert (view.headline, view.heading) == ("STAND-BY", None)
    (missing,) = view.missing
    assert missing.quantity == "heading"
    assert missing.text.startswith(reason)
    assert "MISSING" in text_of(view)


def test_a_plotter_with_only_magnetic_bearings_is_named():
    leg = ("A", "A", 0.1, "R", "N", "V", "V", 10.0, "M", "1", 10.0, "M", 10.0, "M", "A")
    view = Watched(heading=None).tick(sentence("ECAPB", *leg).strip(), COMPASS, *OTHERS)
    assert view.missing == (Missing("set point", ("ECAPB: only magnetic bearings",)),)


def test_an_alarm_stands_first_and_says_what_has_fallen_silent():
    watched = Watched()
    watched.tick(COMPASS, *OTHERS)
    for _ in range(4):
        view = watched.tick(*OTHERS)
    assert view.headline == "ALARM: TAKE THE WHEEL"
    assert view.missing == (Missing("heading", ("HEHDT: silent for 4 s",)),)
    lines = text_of(view).splitlines()
    assert "ALARM: TAKE THE WHEEL" in lines[2]
    assert "no heading for 3 s" in lines[3]
    for _ in range(11):
        view = watched.tick(COMPASS, *OTHERS)
    assert "all is well: s steers the heading of now" in view.details
    assert watched.press("steer").headline == "STEERING"


def test_keys_do_what_they_say_at_once_and_answer():
    watched = Watched()
    watched.press("stand-by")  # nothing is there yet
    watched.tick(COMPASS, *OTHERS)
    set_point = watched.press("starboard-10", "starboard-1").set_point
    assert bearing(set_point) == "062.6°"
    assert bearing(watched.press("port-1", "port-10").set_point) == "051.6°"
    assert watched.press("next-leg").note == "no next leg: none is known"
    assert watched.press("stand-by").headline == "STAND-BY"
    assert "not steering" in watched.press("starboard-1").note
    assert watched.press("steer").note == "steering"
    for _ in range(17):
        watched.tick(COMPASS, *OTHERS)
    assert watched.view.note == ""


def test_to_quit_while_it_steers_has_to_be_confirmed():
    watched = Watched()
    watched.tick(COMPASS, *OTHERS)
    assert watched.press("quit").question == "quit, and take the wheel?"
    assert watched.press("cancel").question == ""
    watched.press("quit", "starboard-1", "confirm")
    assert watched.helm.ended_by == ""
    watched.press("quit", "confirm")
    assert watched.helm.ended_by == "the helmsman"


angles = st.none() | st.floats(-10.0, 10.0)
words = st.text(max_size=90)
source_views = st.builds(
    SourceView, words, words, words, st.floats(0.0, 1e6), st.booleans(), st.booleans()
)
missing_views = st.builds(Missing, words, st.tuples(words, words))
views = st.builds(
    HelmView,
    state=st.sampled_from([STANDBY, STEERING, MANUAL]),
    alarm=words,
    warnings=st.tuples(words),
    obstacle=words,
    heading=angles,
    set_point=angles,
    yaw_rate=angles,
    rudder=angles,
    order=angles,
    cross_track=st.none() | st.floats(-1e6, 1e6),
    leads=st.sampled_from(["own", "plotter", "route", "rate"]),
    sources=st.lists(source_views, max_size=40).map(tuple),
    missing=st.lists(missing_views, max_size=10).map(tuple),
    question=words,
    note=words,
)


@given(views)
def test_every_view_fits_in_a_plain_terminal(view):
    lines = text_of(view).rstrip("\n").split("\n")
    assert len(lines) <= 24
    assert "quit" in lines[-1]


def test_angles_are_as_on_a_bridge():
    assert [bearing(angle) for angle in (-1e-4, 6.2831, 0.1)] == [
        "000.0°",
        "000.0°",
        "005.7°",
    ]
    assert [sided(angle) for angle in (1e-4, 0.1, -0.1)] == [
        "0.0°",
        "5.7° stbd",
        "5.7° port",
    ]


def test_memory_of_what_was_heard_is_bounded():
    heard = HeardSentences()
    for port in range(1000):
        heard.take(COMPASS, f"10.0.0.1:{port}", 0.0)
    assert len(heard.newest) == heard.most


@pytest.mark.parametrize(
    ("typed", "commands"),
    [
        (" ", ["stand-by"]),
        ("s", ["steer"]),
        ("S", ["steer"]),
        ("+", ["starboard-1"]),
        ("--", ["port-1", "port-1"]),
        ("<>", ["port-10", "starboard-10"]),
        ("\x1b[C\x1b[D", ["starboard-1", "port-1"]),
        ("\x1b[1;5C", []),
        ("\x1b[5~s", ["steer"]),
        ("\x1b", ["cancel"]),
        ("ny", ["next-leg", "confirm"]),
        ("xé\x00", []),
        ("s" * 17, []),  # that was pasted
    ],
)
def test_keys_are_understood(typed, commands):
    assert commands_of(typed) == commands


def test_a_terminal_is_as_it_was_whatever_happens(monkeypatch):
    master, slave = pty.openpty()
    pressed = []
    with open(slave, "rb", buffering=0, closefd=False) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        before = termios.tcgetattr(slave)

        async def types():
            with keyboard(pressed.append):
                during = termios.tcgetattr(slave)
                os.write(master, b"\x1a\x13s+")  # Ctrl-Z and Ctrl-S are keys too
                while len(pressed) < 2:
                    await asyncio.sleep(0.01)
                assert not during[3] & (termios.ECHO | termios.ICANON)
                assert during[3] & termios.ISIG  # Ctrl-C ends it
                raise ArithmeticError

        with pytest.raises(ArithmeticError):
            asyncio.run(types())
        assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)
    assert pressed == ["steer", "starboard-1"]


class StalledTerminal(io.StringIO):
    """It takes nothing until it is released."""

    def __init__(self):
        super().__init__()
        self.released = threading.Event()

    def write(self, text):
        self.released.wait()
        return super().write(text)


def test_a_terminal_that_takes_nothing_holds_nobody_up():
    stalled = StalledTerminal()
    console = Console(file=stalled, force_terminal=True, width=80, height=24)
    begin = time.monotonic()
    screen = Screen(console, "shipgym steer")
    screen.patience_s = 0.1
    view = Watched().tick(COMPASS, *OTHERS)
    for _ in range(100):
        screen.show(view)
    screen.close()
    assert time.monotonic() - begin < 2.0
    stalled.released.set()


@pytest.mark.parametrize(
    ("end", "code", "word"),
    [(b"q", 0, b"by the helmsman"), (signal.SIGTERM, 143, b"by SIGTERM")],
)
def test_the_command_shows_the_helm_and_restores_the_terminal(
    end, code, word, tmp_path
):
    PID.from_model(MARINER).save(tmp_path / "pid.json")
    master, slave = pty.openpty()
    termios.tcsetwinsize(slave, (24, 80))
    before = termios.tcgetattr(slave)
    command = [sys.executable, "-m", "agents.cli", "steer", str(tmp_path / "pid.json")]
    process = subprocess.Popen(
        [*command, "--nmea", f"tcp:127.0.0.1:{free_port()}", "--heading", "45"],
        stdin=slave,
        stdout=slave,
        stderr=slave,
        start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        env=os.environ | {"TERM": "xterm"},
    )
    shown = b""
    deadline = time.monotonic() + 60.0
    has_ended = False
    while time.monotonic() < deadline:
        if select.select([master], [], [], 0.1)[0]:
            shown += os.read(master, 65536)
        elif process.poll() is not None:
            break
        if b"STAND-BY" in shown and not has_ended:
            has_ended = True
            os.write(master, end) if end == b"q" else process.send_signal(end)
    process.kill()
    assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)
    _, last_screen, rest = shown.rpartition(b"STAND-BY")
    assert b"\x1b[?1049h" in shown
    assert last_screen
    assert b"\x1b[?1049l" in rest
    assert word in rest
    assert b"Traceback" not in shown
    assert process.wait() == code
