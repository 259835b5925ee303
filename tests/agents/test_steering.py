"""The live loop: a simulated ship steered over NMEA 0183, and the two commands."""

import asyncio
import json
import math
import re
import socket
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import LQ, PID, IntegralLineOfSight, WheelOver
from agents.cli import app
from agents.export.connection import Connection
from agents.export.helm import MANUAL, STEERING
from agents.export.nmea import readings
from agents.export.route import Route
from agents.export.sensors import Limits
from agents.export.simulated import SimulatedShip, simulate_ship
from agents.export.steering import steer
from shipgym.engine.trajectories import SEA_CHANNELS
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.tasks.task import Task
from tests.agents.policies import MARINER
from tests.agents.steering import free_port, no_waiting

PID_MARINER, LQ_MARINER = PID.from_model(MARINER), LQ.from_model(MARINER)
WHEEL_OVER = WheelOver.from_model(MARINER, task=Task.of("PathFollowing"))
ROUTE = "latitude,longitude\n54.0,7.5\n54.02,7.5\n54.03,7.52\n"


class HearingShip(SimulatedShip):
    """She keeps what she hears."""

    def hear(self, line, source=""):
        self.heard = [*getattr(self, "heard", []), line]
        super().hear(line)


class NoisyShip(SimulatedShip):
    """Her line carries what no sentence is, and a compass whose checksums are wrong."""

    def sentences(self):
        return (
            super().sentences()
            + "\x00"
            + "x" * 600
            + "\r\n$HEHDT,270.0,T*00\r\n$HEHDT,\r\n"
        )


def sailed(agent, kind=SimulatedShip, seconds=120.0, drop=None, **more):
    """Helm and ship after a passage over TCP, in which the ship is sent garbage too."""
    ship, address, told = kind(MARINER, leg=0.3), f"tcp:127.0.0.1:{free_port()}", []

    async def both():
        other = asyncio.create_task(
            simulate_ship(ship, address, duration=seconds + 60.0, drop=drop)
        )
        await asyncio.sleep(0.05)
        _, writer = await asyncio.open_connection(
            "127.0.0.1", int(address.rpartition(":")[2])
        )
        writer.write(b"\xff\x00$AGROR,35,A,,V,B*00\r\n" + b"x" * 5000)
        await writer.drain()
        writer.close()
        found = await steer(agent, address, duration=seconds, log=told.append, **more)
        other.cancel()
        return found

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        return runner.run(both()), ship, told


def test_instruments_show_where_the_ship_is_and_sentences_tell_it():
    """6 miles north and half a mile east of 54 N, 7.5 E, in waves and a current."""
    ship = SimulatedShip(MARINER, leg=0.3, weather="moderate", step=0.5)
    state = {
        "x": 6 * 1852.0,
        "y": 926.0,
        "psi": 0.5,
        "u": 7.0,
        "v": -0.4,
        "r": 0.003,
        "delta": -0.1,
    }
    ship.states[0, : len(state)] = [state[name] for name in MARINER.state_names]
    ship.states[0, -len(SEA_CHANNELS) :] = 0.02, 0.004, 0.0, 0.0, -0.3, 0.5, 0.0, 0.0
    over_ground = (7.0 - 0.4j) * np.exp(0.5j) - 0.3 + 0.5j
    left = 18520.0 * np.exp(0.3j) - (6 * 1852.0 + 926.0j)
    shown = {
        "heading": 0.52,
        "yaw_rate": 0.007,
        "rudder": -0.1,
        "surge": 7.0,
        "sway": -0.4,
        "leg": 0.3,
        "course": np.angle(over_ground),
        "speed": abs(over_ground),
        "latitude": np.radians(54.1),
        "longitude": np.radians(7.5 + 0.5 / 60.0 / np.cos(np.radians(54.1))),
        "cross_track": 926.0 * np.cos(0.3) - 6 * 1852.0 * np.sin(0.3),
        "waypoint_bearing": np.angle(left),
        "waypoint_distance": abs(left),
    }
    assert ship.measured() == pytest.approx(shown)
    ship.steps = 2 * (27 * 3600 + 15 * 60 + 5)
    lines = ship.sentences().splitlines()
    told = {one.quantity: one.value for line in lines for one in readings(line)}
    assert told == pytest.approx({**shown, "to_steer": 0.3}, rel=1e-5, abs=3e-5)
    for name in ("latitude", "longitude"):
        assert told[name] == pytest.approx(shown[name], rel=0.0, abs=2e-8)
    assert any(",031505.00," in line for line in lines)


def test_what_a_heeled_ship_makes_sideways_over_ground_is_level():
    ship = SimulatedShip(load_model("container"))
    for name, value in (("u", 0.0), ("v", 2.0), ("phi", np.pi / 3)):
        ship.states[0, ship.model.state_names.index(name)] = value
    shown = ship.measured()
    assert (shown["sway"], shown["speed"], shown["course"]) == pytest.approx(
        (2.0, 1.0, np.pi / 2)
    )


def test_a_ship_is_steered_over_tcp_though_garbage_is_sent():
    found, ship, told = sailed(LQ_MARINER, NoisyShip, heading=0.3)
    assert (found.state, found.alarm, found.counts["damaged"] > 1000) == (
        STEERING,
        "",
        True,
    )
    assert ship.now["psi"] == pytest.approx(0.3, abs=0.02)
    assert told[0].startswith(
        "0.0 s: standby, waits for heading, yaw rate, sway, rudder"
    )
    assert told[-1].endswith(" s: steering")


def test_a_ship_is_led_along_the_leg_of_the_plotter():
    found, ship, _ = sailed(IntegralLineOfSight.from_model(MARINER), seconds=300.0)
    assert (found.state, found.alarm) == (STEERING, "")
    assert ship.now["psi"] == pytest.approx(0.3, abs=0.1)


def test_a_route_is_kept_to_over_tcp_and_ends_in_the_helmsmans_hands(tmp_path):
    (tmp_path / "route.csv").write_text(ROUTE)
    route = Route.from_csv(tmp_path / "route.csv", WHEEL_OVER.gains["path_radius"])
    found, _, told = sailed(
        WHEEL_OVER, seconds=600.0, limits=Limits(off_track_m=60.0), route=route
    )
    assert found.alarm == "the end of the route is reached"
    states = [line.partition(" s: ")[2] for line in told[1:-1]]
    assert states == ["steering", "steering, course change ahead", "steering"]
    assert 450.0 < float(told[-1].partition(" s")[0]) < 560.0


def test_a_sensor_that_is_dropped_ends_in_an_alarm_and_a_rudder_amidships():
    found, ship, told = sailed(PID_MARINER, drop={"ROT": 30.0}, heading=0.3)
    assert (found.state, found.alarm) == (MANUAL, "no yaw rate for 3 s")
    assert told[-1].endswith("manual: ALARM, no yaw rate for 3 s: take the wheel")
    assert ship.order == 0.0


def test_it_waits_for_a_ship_connects_again_when_she_is_lost_and_steers_no_more():
    ships, address, told = (
        [HearingShip(MARINER) for _ in range(2)],
        f"tcp:127.0.0.1:{free_port()}",
        [],
    )

    async def both():
        found = asyncio.create_task(
            steer(PID_MARINER, address, heading=0.3, duration=90.0, log=told.append)
        )
        for ship in ships:
            await asyncio.sleep(10.0)
            await simulate_ship(ship, address, duration=20.0)
        return await found

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        found = runner.run(both())
    assert (found.state, found.alarm) == (MANUAL, "the connection was closed")
    assert "cannot be opened" in told[0]
    assert ships[0].order != 0.0
    assert ships[1].order == 0.0
    assert any("ALR" in line for line in ships[1].heard)


@pytest.mark.parametrize(
    ("delay_s", "alarm"), [(1.4, ""), (1.6, "a step came 1.1 s late")]
)
def test_it_hands_over_when_a_step_comes_a_second_late_and_not_sooner(delay_s, alarm):
    """Twice as fast as time goes; half a second of the delay is that to the step."""
    ship, address, told = SimulatedShip(MARINER), f"tcp:127.0.0.1:{free_port()}", []

    async def both():
        loop = asyncio.get_running_loop()

        def tell(line):
            told.append(line)
            if line.endswith("s: steering") and len(told) == 2:
                loop._selector.now += delay_s

        other = asyncio.create_task(
            simulate_ship(ship, address, duration=90.0, speed_up=2.0)
        )
        await asyncio.sleep(0.05)
        more = {
            "heading": 0.0,
            "duration": 20.0,
            "speed_up": 2.0,
            "limits": Limits(silence_s=20.0),
        }
        found = await steer(PID_MARINER, address, log=tell, **more)
        other.cancel()
        return found, loop.time()

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        found, ended = runner.run(both())
    assert told[1].endswith("s: steering")
    assert found.alarm == alarm
    assert ended < 20.0


class AbsentLink:
    """A link at which nobody answers, or that is refused."""

    ends = ()

    def __init__(self, refusal=None):
        self.refusal = refusal

    error = ""

    async def open(self, address, *, sends=False):
        if self.refusal is None:
            await asyncio.sleep(100.0)
        raise InputError(f"{address}: cannot be opened") from self.refusal


@pytest.mark.parametrize(
    ("error", "problem", "seconds"),
    [
        (None, "tcp:ship:1: no answer", 5.0),
        (ConnectionRefusedError(), "tcp:ship:1: cannot be opened", 0.0),
    ],
)
def test_who_does_not_answer_within_five_seconds_is_waited_for(error, problem, seconds):
    async def waits():
        loop = asyncio.get_running_loop()
        begin = loop.time()
        connection = Connection(AbsentLink(error), "tcp:ship:1")
        await connection.open(first=True)
        return connection.problem, loop.time() - begin, connection.retry_at - begin

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        expected = (problem, pytest.approx(seconds), pytest.approx(seconds + 1.0))
        assert runner.run(waits()) == expected


def test_an_address_that_never_works_is_refused_at_once():
    with (
        asyncio.Runner(loop_factory=no_waiting) as runner,
        pytest.raises(InputError, match="cannot be opened"),
    ):
        runner.run(Connection(AbsentLink(OSError()), "tcp:ship:1").open(first=True))


@pytest.mark.parametrize("name", ["speed_up", "heading", "rate"])
def test_what_is_no_number_is_refused_before_anything_is_opened(name):
    given = {"heading": 0.1, "rate": 0.001} | {name: math.nan}
    with pytest.raises(InputError, match=f"{name}: expected a number, got nan"):
        asyncio.run(steer(PID_MARINER, "usb:1", **given))


def test_a_simulated_ship_keeps_time_and_runs_so_many_times_as_fast():
    """A minute of hers in six seconds, a step of a tenth of a second at a time."""
    ship, steps = SimulatedShip(MARINER), []

    async def sails():
        begin = asyncio.get_running_loop().time()
        await simulate_ship(
            ship, f"udp:127.0.0.1:{free_port()}", duration=60.0, speed_up=10.0
        )
        steps.append(asyncio.get_running_loop().time() - begin)

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        runner.run(sails())
        with pytest.raises(InputError, match="speed_up: expected a number > 0, got 0"):
            runner.run(simulate_ship(ship, "udp:127.0.0.1:9", speed_up=0.0))
    assert ship.steps == 600
    assert steps[0] == pytest.approx(59.9 / 10.0)


def test_a_ship_that_runs_away_says_when():
    ship = SimulatedShip(MARINER, step=0.5)
    ship.steps, ship.states[0, 3] = 7, np.nan
    with pytest.raises(InputError, match=r"model 'mariner' ran away after 3\.5 s"):
        ship.advance()


def test_the_command_steers_with_what_it_is_told_and_fails_after_an_alarm(
    tmp_path, monkeypatch
):
    given = []
    ends = [
        ("off", "", ""),
        ("manual", "no heading for 3 s", ""),
        ("off", "", "SIGINT"),
    ]

    async def stand_in(pilot, nmea, **more):
        given.append((pilot.kind, nmea, more))
        more["log"]("0.0 s: standby")
        state, alarm, ended_by = ends[len(given) - 1]
        return SimpleNamespace(
            state=state, alarm=alarm, counts={"damaged": 2}, ended_by=ended_by
        )

    monkeypatch.setattr("agents.export.panel.steer", stand_in)
    PID_MARINER.save(tmp_path / "pid.json")
    WHEEL_OVER.save(tmp_path / "guide.json")
    (tmp_path / "route.csv").write_text(ROUTE)
    words = [
        "steer",
        str(tmp_path / "pid.json"),
        "--nmea",
        "udp:ship:1",
        "--heading",
        "45",
    ]
    words += [
        "--limit",
        "silence_s=4",
        "--duration",
        "12",
        "--rate-of-turn",
        "15",
        "--speed-up",
        "2",
    ]
    calm = CliRunner().invoke(app, [*words, "--json"])
    assert (calm.exit_code, json.loads(calm.stdout)) == (
        0,
        {"state": "off", "alarm": "", "damaged": 2},
    )
    kind, address, more = given[0]
    assert (kind, address, more["limits"], more["route"]) == (
        "pid",
        "udp:ship:1",
        Limits(silence_s=4),
        None,
    )
    assert (more["heading"], more["rate"]) == pytest.approx(
        (np.pi / 4.0, np.pi / 12.0 / 60.0)
    )
    assert (more["duration"], more["speed_up"]) == (12.0, 2.0)
    route = ["--route", str(tmp_path / "route.csv")]
    lost = CliRunner().invoke(
        app, ["steer", str(tmp_path / "guide.json"), "--nmea", "udp:ship:1", *route]
    )
    assert lost.exit_code == 1
    assert "0.0 s: standby" in lost.output
    assert "handed over: no heading for 3 s" in lost.output
    _, _, more = given[1]
    assert (more["heading"], more["rate"], more["duration"], more["speed_up"]) == (
        None,
        None,
        math.inf,
        1.0,
    )
    assert more["limits"] == Limits()
    turn = more["route"].given(np.radians(54.0), np.radians(7.5))
    expected = Route.from_csv(tmp_path / "route.csv", WHEEL_OVER.gains["path_radius"])
    assert turn == expected.given(np.radians(54.0), np.radians(7.5))
    more_words = ["--gear", "udp:gear:2", "--variation=-3", "--no-rudder-feedback"]
    ended = CliRunner().invoke(app, [*words, *more_words])
    assert ended.exit_code == 130
    assert "ended by SIGINT: the last order is marked invalid" in ended.output
    _, _, more = given[2]
    assert (more["gear"], more["rudder_feedback"]) == ("udp:gear:2", False)
    assert more["variation"] == pytest.approx(np.radians(-3.0))
    wrong = CliRunner().invoke(app, [*words, "--limit", "silense_s=4"])
    assert (wrong.exit_code, "--limit: unknown key 'silense_s'" in wrong.output) == (
        2,
        True,
    )


def test_the_command_simulates_the_ship_that_is_asked_for_and_drops_sentences():
    """Ten steps of 0.1 s; from 0.45 s on no HDT is heard."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hears:
        hears.bind(("127.0.0.1", 0))
        asked = [
            "simulate",
            "mariner",
            "--nmea",
            f"udp:127.0.0.1:{hears.getsockname()[1]}",
            "--leg",
            "30",
        ]
        asked += ["--drop", "hdt=0.45", "--duration", "1", "--speed-up", "40", "--json"]
        told = json.loads(CliRunner().invoke(app, asked).stdout)
        hears.settimeout(0.0)
        heard = "".join(hears.recv(65536).decode() for _ in range(10))
    assert [heard.count(f"{kind},") for kind in ("HDT", "ROT", "RSA")] == [5, 10, 10]
    (steered,) = {
        one.value
        for line in heard.splitlines()
        for one in readings(line)
        if one.quantity == "leg"
    }
    assert steered == pytest.approx(np.radians(30.0))
    assert (told["model"], told["duration_s"]) == ("mariner", 1.0)
    assert told["state"]["x"] == pytest.approx(MARINER.particulars["speed"], rel=1e-3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--drop", "HDT"], "--drop: expected name=value, such as --drop HDT=60"),
        (["--drop", "hdt='late'"], "--drop hdt: expected a number >= 0, got 'late'"),
        (
            ["--drop", "XYZ=3"],
            "drop: unknown key 'XYZ'. Known keys: 'APB', 'BWC', 'HDT', 'RMC', 'ROT'",
        ),
        (["--leg", "360.5"], "'--leg': Input should be less than or equal to 360"),
        (["--sea", "ruff"], "weather: expected one of 'calm'"),
    ],
)
def test_what_no_ship_can_be_asked_for_is_refused(words, message):
    found = CliRunner().invoke(
        app, ["simulate", "mariner", "--nmea", "udp:127.0.0.1:9", *words]
    )
    assert found.exit_code == 2, found.output
    assert re.search(message, " ".join(found.output.split()))


@pytest.mark.parametrize("heading", ["400", "-1", "nan"])
def test_a_heading_is_one_of_the_compass(heading, tmp_path):
    PID_MARINER.save(tmp_path / "pid.json")
    words = [
        "steer",
        str(tmp_path / "pid.json"),
        "--nmea",
        "tcp:127.0.0.1:1",
        "--heading",
        heading,
    ]
    found = CliRunner().invoke(app, words)
    assert (found.exit_code, found.stdout) == (2, "")
    assert "Invalid value for '--heading': Input should be " in found.stderr


def test_where_nobody_answers_until_the_end_the_command_fails(tmp_path):
    PID_MARINER.save(tmp_path / "pid.json")
    address = f"tcp:127.0.0.1:{free_port()}"
    words = [
        "steer",
        str(tmp_path / "pid.json"),
        "--nmea",
        address,
        "--duration",
        "2",
        "--speed-up",
        "20",
    ]
    found = CliRunner().invoke(app, words)
    assert found.exit_code == 2
    assert found.stderr.startswith(
        f"error: {address}: cannot be opened (Connect call failed"
    )
    assert found.stderr.endswith(
        "; no data received for 2 s; is the other end running?\n"
    )
    assert found.stderr.count("\n") == 1
