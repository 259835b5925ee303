"""Where orders go: over sockets between programs, and over a serial line."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
from contextlib import suppress

import pytest
from typer.testing import CliRunner

from agents import PID
from agents.cli import app
from agents.export.nmea import Line
from agents.export.simulated import SimulatedShip, simulate_ship
from agents.export.steering import HelmObserver, steer
from tests.agents.policies import MARINER
from tests.agents.steering import free_port, no_waiting, sentence

PID_MARINER = PID.from_model(MARINER)


@pytest.fixture(scope="module")
def pilot(tmp_path_factory):
    path = tmp_path_factory.mktemp("pilot") / "pid.json"
    PID_MARINER.save(path)
    return str(path)


def ports(count):
    """Free UDP ports."""
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    found = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return found


def rest_of(receiving):
    """Datagrams that have come by now."""
    receiving.settimeout(0.0)
    with suppress(BlockingIOError):
        while True:
            yield receiving.recv(65536)


def program(*words):
    """`shipgym` in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "agents.cli", *map(str, words), "--speed-up", "10"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def test_orders_reach_only_the_gear_and_the_last_one_is_invalid(pilot):
    """A plotter speaks from another port, last of all; nobody answers it."""
    data, gear, ship = ports(3)
    names = [f"udp:127.0.0.1:{port}" for port in (data, gear, ship)]
    simulate = program("simulate", "mariner", "--nmea", names[0], "--gear", names[2])
    helm = program(
        *("steer", pilot, "--nmea", names[0], "--gear", names[1], "--heading", 5),
        *("--limit", "late_s=60", "--limit", "silence_s=30"),
    )
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hears,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plotter,
    ):
        hears.bind(("127.0.0.1", gear))
        hears.settimeout(60.0)
        plotter.bind(("127.0.0.1", 0))
        valid = 0
        while valid < 20:
            text = hears.recv(65536)
            hears.sendto(text, ("127.0.0.1", ship))
            plotter.sendto(sentence("ECRMB", "A").encode(), ("127.0.0.1", data))
            valid += b",A,,V,B" in text
        helm.terminate()
        told, _ = helm.communicate(timeout=60)
        heard = list(rest_of(hears))
        for text in heard:
            hears.sendto(text, ("127.0.0.1", ship))
        assert list(rest_of(plotter)) == []
    assert ": the rudder follows orders" in simulate.stdout.readline()
    assert ": no valid rudder orders: rudder amidships" in simulate.stdout.readline()
    simulate.terminate()
    simulate.communicate(timeout=60)
    assert helm.returncode == 143
    assert "ended by SIGTERM: the last order is marked invalid" in told
    assert b"$AGROR,0.0,V,,V,B*" in heard[-1]
    assert b",M,N," in heard[-1]
    assert simulate.returncode == 143


def test_a_rudder_goes_amidships_when_orders_stop():
    ship = SimulatedShip(MARINER)
    ship.hear(sentence("AGROR", 10.0, "A", "", "V", "B"))
    orders = []
    for _ in range(80):
        ship.advance()
        orders.append(ship.order)
    assert orders[45] > 0.17
    assert orders[-1] == 0.0
    ship.hear(sentence("AGROR", 10.0, "A", "", "V", "B"))
    ship.hear(sentence("AGROR", 10.0, "V", "", "V", "B"))
    assert ship.order == 0.0


def test_ctrl_c_ends_the_watch_and_nothing_else():
    data, gear = (f"udp:127.0.0.1:{port}" for port in ports(2))

    async def interrupted():
        asyncio.get_running_loop().call_later(0.1, os.kill, os.getpid(), signal.SIGINT)
        return await steer(PID_MARINER, data, gear=gear, heading=0.0)

    helm = asyncio.run(interrupted())
    assert (helm.ended_by, helm.state) == ("SIGINT", "standby")


class Failing(HelmObserver):
    """A display that breaks after some time."""

    def update(self, helm, now):
        if helm.order:
            raise RuntimeError("the display is broken")


def test_the_last_order_is_invalid_after_an_exception_too():
    """Data and gear each over a TCP connection of their own."""
    address, gear = (f"tcp:127.0.0.1:{free_port()}" for _ in range(2))
    ship = SimulatedShip(MARINER)
    heard = []

    async def keep(reader, writer):
        while text := await reader.readline():
            heard.append(text.decode())
        writer.close()

    async def both():
        place = gear.rpartition(":")[2]
        server = await asyncio.start_server(keep, "127.0.0.1", int(place))
        other = asyncio.create_task(simulate_ship(ship, address, duration=90.0))
        await asyncio.sleep(0.05)
        more = {"gear": gear, "heading": 0.3, "observers": [Failing()]}
        with pytest.raises(RuntimeError, match="display is broken"):
            await steer(PID_MARINER, address, log=heard.append, **more)
        await asyncio.sleep(0.2)
        other.cancel()
        server.close()

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        runner.run(both())
    orders = [line for line in heard if "ROR" in line]
    assert ",A,,V,B" in orders[-2]
    assert orders[-1].startswith("$AGROR,0.0,V,,V,B")
    assert ship.order == 0.0  # where data come from hears no orders


def test_a_gear_that_goes_away_ends_in_an_alarm():
    address, gear = (f"tcp:127.0.0.1:{free_port()}" for _ in range(2))

    async def both():
        async def leave(reader, writer):
            await asyncio.sleep(20.0)
            writer.close()
            server.close()

        place = gear.rpartition(":")[2]
        server = await asyncio.start_server(leave, "127.0.0.1", int(place))
        ship = SimulatedShip(MARINER)
        other = asyncio.create_task(simulate_ship(ship, address, duration=90.0))
        await asyncio.sleep(0.05)
        more = {"gear": gear, "heading": 0.0, "duration": 40.0}
        helm = await steer(PID_MARINER, address, log=told.append, **more)
        other.cancel()
        return helm

    told = []
    with asyncio.Runner(loop_factory=no_waiting) as runner:
        helm = runner.run(both())
    assert helm.alarm == "the connection to the steering gear was closed"
    assert any(f"{gear}: closed" in line for line in told)


def steered(pilot, *words):
    words = [str(word) for word in ("steer", pilot, "--heading", 3, *words)]
    found = CliRunner().invoke(app, [*words, "--speed-up", "20"])
    return found.exit_code, " ".join(found.output.split())


def test_an_address_that_cannot_be_the_gears_is_refused(pilot):
    data, other = ports(2)
    here = f"udp:127.0.0.1:{data}"
    everywhere = f"udp:0.0.0.0:{data}"
    nothing = ["--duration", 1]
    for words, message in (
        (["--nmea", here], "--gear: expected the address that receives rudder orders"),
        (["--nmea", here, "--gear", here], "--gear: expected another address"),
        (["--nmea", everywhere, "--gear", here], "--gear: expected another address"),
        (["--nmea", here, "--gear", "usb:1"], "address: expected tcp:HOST:PORT"),
    ):
        code, told = steered(pilot, *words, *nothing)
        assert (code, told.count("error:")) == (2, 1)
        assert message in told
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", data))
        gear = f"udp:127.0.0.1:{other}"
        code, told = steered(pilot, "--nmea", here, "--gear", gear, *nothing)
        assert code == 2
        assert "another program uses this port; end it or take another port" in told


def test_a_serial_line_that_vanishes_is_named_once():
    ours, theirs = os.openpty()
    device = os.ttyname(theirs)
    os.close(theirs)
    told = []

    async def sails():
        asyncio.get_running_loop().call_later(1.5, os.close, ours)
        words = {"gear": f"serial:{device}", "heading": 0.0, "duration": 2.5}
        address = f"udp:127.0.0.1:{ports(1)[0]}"
        await steer(PID_MARINER, address, log=told.append, **words)

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        runner.run(sails())
    vanished = f"serial:{device}: closed (it has vanished)"
    assert [vanished in line for line in told] == [False, True]


def test_a_gear_that_reads_nothing_is_not_sent_to_for_ever():
    """Orders do not pile up; the connection is closed instead."""
    line_closed = []

    class Full:
        sent = 0

        def write(self, data):
            self.sent += len(data)

        def get_write_buffer_size(self):
            return self.sent

        def abort(self):
            line_closed.append(self.sent)

    line = Line(lambda *_: None, set())
    line.transport = Full()
    while not line_closed:
        line.send(b"$AGROR,0.0,A,,V,B*00\r\n")
    assert line_closed[0] < 5000
