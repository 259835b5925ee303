"""Measure the figures of docs/deployment.md: C here and on ARM, an FMU, the live loop.

`python scripts/deployment_speed.py [--seconds 60]`; needs gcc and the extras fmu and
nmea.
"""

from __future__ import annotations

import argparse
import asyncio
import multiprocessing
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from agents import LQ, load_agent
from agents.export.autopilot_c99 import autopilot_source
from agents.export.c99 import Source
from agents.export.fmu import write_fmu
from agents.export.ship_c99 import ship_source
from agents.export.simulated import SimulatedShip, simulate_ship
from agents.export.steering import steer
from shipgym.models import load_model

CROSS = ("arm-linux-gnueabihf-gcc", "aarch64-linux-gnu-gcc")
QEMU = {"arm-linux-gnueabihf-gcc": "qemu-arm", "aarch64-linux-gnu-gcc": "qemu-aarch64"}
STEPS = 2_000_000
MAIN = """
#include "{name}.h"
#include <stdio.h>
#include <time.h>
int main(void) {{
    {name}_state state;
    {name}_input input = {{0}};
    double sum = 0.0;
    clock_t begin;
    {name}_init(&state);
    begin = clock();
    for (int k = 0; k < {steps}; ++k) {{
        input.{first} = 0.1 * (k % 7);
        sum += {call};
    }}
    double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    printf("%.4f us a step (%.17g)\\n", seconds / {steps} * 1e6, sum);
    return 0;
}}
"""


def timed(source: Source, compiler: str, steps: int, runner: str | None = None) -> str:
    """What a program that steps it prints."""
    call = f"{source.name}_step(&state, &input" + (
        f", 0.5 * {source.name.upper()}_LONGEST_STEP)" if source.ship else ")"
    )
    text = MAIN.format(
        name=source.name, steps=steps, first=next(iter(source.inputs)), call=call
    )
    with tempfile.TemporaryDirectory() as folder:
        for file, content in {
            f"{source.name}.h": source.header,
            f"{source.name}.c": source.source,
            "main.c": text,
        }.items():
            (Path(folder) / file).write_text(content, encoding="utf-8")
        flags = [
            "-std=c99",
            "-O2",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-pedantic",
            "-static",
        ]
        subprocess.run(
            [compiler, *flags, "main.c", f"{source.name}.c", "-o", "main", "-lm"],
            cwd=folder,
            check=True,
        )
        command = [*([runner] if runner else []), "./main"]
        return subprocess.run(
            command, cwd=folder, check=True, capture_output=True, text=True
        ).stdout.strip()


def real_time_factor(source: Source, version: str) -> float:
    """Seconds simulated in one by FMPy, at communication steps of the longest step."""
    import fmpy

    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/it.fmu"
        write_fmu(source, path, version)
        unzipped = fmpy.extract(path)
        options = {
            "step_size": source.step,
            "output_interval": source.step,
            "stop_time": 20_000 * source.step,
        }
        begin = time.perf_counter()
        fmpy.simulate_fmu(
            unzipped, validate=False, start_values={"rudder": 0.1}, **options
        )
        elapsed = time.perf_counter() - begin
        shutil.rmtree(unzipped)
    return options["stop_time"] / elapsed


def burn() -> None:
    """Keep a processor busy."""
    while True:
        sum(range(10_000))


def sail(address: str, seconds: float) -> None:
    """Simulate the ship, in a process of her own."""
    ship = SimulatedShip(load_model("mariner"))
    asyncio.run(simulate_ship(ship, address, duration=seconds))


class TimedLQ(LQ):
    """LQ that keeps the times at which it steers."""

    beats: ClassVar[list[float]] = []

    def steer(self, *arguments: Any) -> Any:
        """Steer as LQ does."""
        self.beats.append(time.perf_counter())
        return super().steer(*arguments)


def periods(seconds: float) -> np.ndarray:
    """Periods of the live loop at 10 Hz, s, with the ship in another process."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp:127.0.0.1:{server.getsockname()[1]}"
    ship = multiprocessing.Process(target=sail, args=(address, seconds + 60.0))
    ship.start()
    time.sleep(20.0)  # until she is there
    agent = TimedLQ.from_model(load_model("mariner"), dt=0.1)
    agent.beats.clear()
    asyncio.run(steer(agent, address, heading=0.1, duration=seconds))
    ship.terminate()
    return np.diff(agent.beats)


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seconds", type=float, default=60.0, help="of the live loop, each time"
    )
    parser.add_argument(
        "--loop", action="store_true", help="measure the live loop alone"
    )
    given = parser.parse_args()
    if not given.loop:
        measure_exports()
    measure_loop(given.seconds)


def measure_exports() -> None:
    """Print how fast C and FMUs are."""
    mariner = load_model("mariner")
    exported = {
        "lq": autopilot_source(LQ.from_model(mariner), "lq"),
        "ppo": autopilot_source(load_agent("sharp-turns-ppo-s0"), "ppo"),
        "ship": ship_source(mariner, "ship"),
    }
    for name, source in exported.items():
        print(f"{name}: gcc: {timed(source, 'gcc', STEPS)}")
        for compiler in CROSS:
            if shutil.which(compiler) is None:
                print(f"{name}: {compiler} is not installed", file=sys.stderr)
            else:
                runner = shutil.which(QEMU[compiler])
                found = (
                    timed(source, compiler, STEPS // 100, runner)
                    if runner
                    else "no emulator (qemu-user)"
                )
                print(f"{name}: {compiler}, emulated: {found}")
    for version in ("2.0", "3.0"):
        print(
            f"ship.fmu, FMI {version}:"
            f" {real_time_factor(exported['ship'], version):.0f} times real time"
        )


def measure_loop(seconds: float) -> None:
    """Print the period of the live loop, alone and beside busy processes."""
    for load in (0, 4):
        busy = [multiprocessing.Process(target=burn) for _ in range(load)]
        for process in busy:
            process.start()
        off_ms = 1e3 * np.abs(periods(seconds) - 0.1)
        median, most_of_them, largest = np.quantile(off_ms, [0.5, 0.99, 1.0])
        load_average, *_ = os.getloadavg()
        print(
            f"live loop, {load} busy processes on {os.cpu_count()} cores, load average"
            f" {load_average:.0f}: {len(off_ms)} periods, off 100 ms by {median:.1f} ms"
            f" at the median, {most_of_them:.1f} ms at the 99th percentile,"
            f" {largest:.1f} ms at most",
            flush=True,
        )
        for process in busy:
            process.terminate()


if __name__ == "__main__":
    main()
