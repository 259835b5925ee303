"""Gap between rudder orders at the gear while others send (docs/deployment.md).

    python scripts/helm_gap.py              all disturbances, 20 s each
    python scripts/helm_gap.py --seconds 60
    python scripts/helm_gap.py --memory     a million sentences of many sources

`shipgym simulate` and `shipgym steer` run as programs of their own over UDP; this one
stands between the autopilot and the gear, measures and passes orders on.
"""

import argparse
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

from agents import PID
from agents.export.helm import Helm
from agents.export.nmea import sentences
from agents.export.sensors import Limits
from shipgym.models import load_model

HOST = "127.0.0.1"


def free_port() -> int:
    """A UDP port that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind((HOST, 0))
        return int(found.getsockname()[1])


def every(seconds: float, message: Callable[[int], bytes]) -> Callable[..., None]:
    """A disturbance that sends a message each so many seconds."""

    def disturb(port: int, end: threading.Event) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sends:
            number = 0
            while not end.is_set():
                sends.sendto(message(number), (HOST, port))
                number += 1
                if seconds:
                    time.sleep(seconds)

    return disturb


def talkers(number: int) -> bytes:
    """A depth from one of many talkers."""
    letters = chr(65 + number % 26) + chr(65 + number // 26 % 26)
    return sentences(f"{letters}DPT,{number % 50},0").encode()


def many_ports(port: int, end: threading.Event) -> None:
    """Speeds from one port after the other."""
    while not end.is_set():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sends:
            sends.sendto(sentences("GPVTG,0,T,,M,15,N,27.8,K,A").encode(), (HOST, port))
        time.sleep(0.001)


DISTURBANCES: dict[str, Callable[..., None]] = {
    "nobody else": every(1.0, lambda _: b""),
    "a plotter at 2 Hz": every(0.5, lambda _: sentences("ECRMB,A").encode()),
    "one byte each 0.2 s": every(0.2, lambda _: b"x"),
    "a flood of bytes": every(0.0, lambda _: b"\xff" * 1000),
    "a flood of sentences": every(0.0, talkers),
    "a thousand ports a second": many_ports,
}


def measured(disturb: Callable[..., None], seconds: float, folder: Path) -> str:
    """The largest gap, the state and the memory after so many seconds."""
    data, gear, ship = free_port(), free_port(), free_port()
    program = [sys.executable, "-m", "agents.cli"]
    simulate = subprocess.Popen(
        [
            *program,
            "simulate",
            "mariner",
            "--nmea",
            f"udp:{HOST}:{data}",
            "--gear",
            f"udp:{HOST}:{ship}",
        ],
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    steer = subprocess.Popen(
        [
            *program,
            "steer",
            str(folder / "pid.json"),
            "--nmea",
            f"udp:{HOST}:{data}",
            "--gear",
            f"udp:{HOST}:{gear}",
            "--heading",
            "5",
        ],
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    times = []
    last = b""
    end = threading.Event()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hears:
        hears.bind((HOST, gear))
        hears.settimeout(30.0)
        while b",A,,V,B" not in last:
            last = hears.recv(65536)
        thread = threading.Thread(target=disturb, args=(data, end))
        thread.start()
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            last = hears.recv(65536)
            times.append(time.monotonic())
            hears.sendto(last, (HOST, ship))
    megabytes = memory(steer.pid)
    end.set()
    thread.join()
    steer.terminate()
    steer.communicate()
    simulate.terminate()
    simulate.wait()
    gap = max(after - before for before, after in pairwise(times))
    state = "steering" if b",A,,V,B" in last else "not steering"
    return f"largest gap {gap:.2f} s, {megabytes:.0f} MB, {state}"


def hear_a_million() -> None:
    """Print the memory of a helm that hears a million sentences of many sources."""
    helm = Helm(PID.from_model(load_model("mariner")), 0.0, Limits())
    kinds = ("HDT,1,T", "HDM,1,M", "VTG,90,T,,M,9,N", "ROT,1,A", "RSA,1,A", "XYZ,1")
    for number in range(1_000_001):
        talker = chr(65 + number % 26) + chr(65 + number // 26 % 26)
        line = sentences(talker + kinds[number % len(kinds)])
        address = f"10.0.{number // 60_000}.1:{number % 60_000}"
        now = number / 1000.0
        helm.hear(line, address, now)
        if number % 1000 == 0:
            helm.watch(1.0, now)
            helm.sentences()
        if number % 250_000 == 0:
            megabytes = memory("self")
            print(f"{number} sentences: {megabytes:.0f} MB", flush=True)


def memory(process: int | str) -> float:
    """Memory of a process, MB."""
    status = Path(f"/proc/{process}/status").read_text(encoding="utf-8")
    kilobytes = status.partition("VmRSS:")[2].split()[0]
    return int(kilobytes) / 1024.0


def main() -> None:
    """Measure all disturbances, or the memory."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--memory", action="store_true")
    arguments = parser.parse_args()
    if arguments.memory:
        hear_a_million()
        return
    seconds = arguments.seconds
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        PID.from_model(load_model("mariner")).save(folder / "pid.json")
        for what, disturb in DISTURBANCES.items():
            print(f"{what}: {measured(disturb, seconds, folder)}", flush=True)


if __name__ == "__main__":
    main()
