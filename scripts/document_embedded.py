"""Write the tables of `docs/embedded.md`: ROM, RAM, stack, deviations from MISRA C.

`python scripts/document_embedded.py`; needs gcc-arm-none-eabi, libnewlib-arm-none-eabi
and cppcheck (Debian's packages). Tables stand between `<!-- table: NAME -->` and
`<!-- end of table -->`. A rule that is broken and has no reason here is an error.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from agents import LQ, LQG, PID, AdaptiveLineOfSight, TurnRate, WheelOver, load_agent
from agents.export.autopilot_c99 import autopilot_source
from agents.export.c99 import Source
from agents.export.ship_c99 import ship_source
from shipgym.models import load_model

PAGE = Path(__file__).parents[1] / "docs" / "embedded.md"
TARGET = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
COMPILER = "arm-none-eabi-gcc"
FLAGS = ["-std=c99", "-Os", *TARGET, "-Wall", "-Wextra", "-Werror", "-fstack-usage"]

#: Rules of MISRA C:2012 that exported C breaks: category, where, and why.
DEVIATIONS = {
    "2.5": (
        "advisory",
        "macros of the header",
        "They are for the program that calls: interval, limits, hash, status.",
    ),
    "8.7": (
        "advisory",
        "`NAME_step_with`",
        "It is called by the program that tunes, and in its own file by `NAME_step`.",
    ),
    "12.1": (
        "advisory",
        "operands of `?:`",
        "All stand in brackets; cppcheck 2.10 counts some that do.",
    ),
    "17.8": (
        "advisory",
        "translated functions",
        "A parameter is assigned where the function in Python does so; it is a copy.",
    ),
    "21.15": (
        "required",
        "`power_of_bits`, in ships with an exponential",
        "The bits of a double are read as those of an integer, by memcpy.",
    ),
}


def sources(real: str) -> Iterator[tuple[str, Source]]:
    """Exported autopilots and ships by the names they have on the page."""
    mariner = load_model("mariner")
    pilots: dict[str, Any] = {
        "PID": PID.from_model(mariner),
        "LQ": LQ.from_model(mariner),
        "LQG": LQG.from_model(mariner),
        "rate of turn": TurnRate.from_model(mariner),
        "adaptive line of sight over LQ": AdaptiveLineOfSight.from_model(mariner),
        "wheel-over over LQ": WheelOver.from_model(mariner),
        "policy (`sharp-turns-ppo-s0`)": load_agent("sharp-turns-ppo-s0"),
    }
    for name, agent in pilots.items():
        yield name, autopilot_source(agent, "it", real)
    for name in ("mariner", "container", "kvlcc2-rm-svm"):
        yield f"ship `{name}`", ship_source(load_model(name), "it", real=real)


def written(source: Source, folder: Path) -> None:
    """Write the files of a source."""
    (folder / "it.h").write_text(source.header, encoding="utf-8")
    (folder / "it.c").write_text(source.source, encoding="utf-8")


def deviations(source: Source) -> Counter[str]:
    """Rules of MISRA C:2012 that cppcheck finds broken, and how often."""
    command = [
        "cppcheck",
        "--addon=misra",
        "--std=c99",
        "--enable=style",
        "--quiet",
        "-U__cplusplus",
        "-U__FINITE_MATH_ONLY__",
        "--suppress=missingIncludeSystem",
        "it.c",
    ]
    with tempfile.TemporaryDirectory() as folder:
        written(source, Path(folder))
        done = subprocess.run(
            command,
            cwd=folder,
            check=True,
            capture_output=True,
            text=True,
        )
    return Counter(re.findall(r"misra-c2012-([\d.]+\d)", done.stderr))


def misra_table() -> str:
    """Table of the rules that any of the sources breaks."""
    found: dict[str, set[str]] = {}
    for name, source in sources("double"):
        for rule in deviations(source):
            found.setdefault(rule, set()).add(name)

    rows = ["| rule | category | where | why |", "| --- | --- | --- | --- |"]
    for rule in sorted(found, key=lambda rule: [int(part) for part in rule.split(".")]):
        if rule not in DEVIATIONS:
            raise SystemExit(f"rule {rule}: no reason for {sorted(found[rule])}")
        category, where, why = DEVIATIONS[rule]
        rows.append(f"| {rule} | {category} | {where} | {why} |")
    return "\n".join(rows)


def sizes(source: Source) -> dict[str, int]:
    """Bytes of a source on the target."""
    measured = (
        '#include "it.h"\n'
        "char state[sizeof(it_state)];\n"
        "char input[sizeof(it_input)];\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        written(source, path)
        (path / "sizes.c").write_text(measured, encoding="utf-8")
        for file in ("it.c", "sizes.c"):
            command = [COMPILER, *FLAGS, "-c", file]
            subprocess.run(command, cwd=folder, check=True)
        size = output(["arm-none-eabi-size", "it.o"], path).splitlines()[1].split()
        symbols = output(["arm-none-eabi-nm", "-S", "sizes.o"], path)
        frames = re.findall(r"\t(\d+)\t", (path / "it.su").read_text("utf-8"))
    bytes_of = re.findall(r"^\w+ (\w+) \w (\w+)$", symbols, re.MULTILINE)
    memory = {name: int(number, 16) for number, name in bytes_of}
    text, data, bss = (int(number) for number in size[:3])
    return {
        "ROM": text + data,
        "static": data + bss,
        "state": memory["state"],
        "input": memory["input"],
        "stack": sum(int(frame) for frame in frames),
    }


def output(command: list[str], folder: Path) -> str:
    """Standard output of a command."""
    done = subprocess.run(
        command,
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout


def size_table() -> str:
    """Table of the bytes that the sources need in both precisions."""
    rows = [
        "| | numbers | ROM | static RAM | state | input | stack, at most |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    of_floats = dict(sources("float"))
    for name, source in sources("double"):
        for real, one in (("double", source), ("float", of_floats[name])):
            cells = " | ".join(f"{number:,}" for number in sizes(one).values())
            rows.append(f"| {name} | {real} | {cells} |")
    return "\n".join(rows)


def main() -> None:
    """Write the tables."""
    for tool in ("cppcheck", COMPILER):
        if shutil.which(tool) is None:
            raise SystemExit(f"{tool}: is not installed; apt-get install it")
    text = PAGE.read_text(encoding="utf-8")
    for name, table in (("sizes", size_table()), ("misra", misra_table())):
        mark = rf"<!-- table: {name} -->\n.*?<!-- end of table -->"
        whole = f"<!-- table: {name} -->\n{table}\n<!-- end of table -->"
        text, n = re.subn(mark, lambda _, whole=whole: whole, text, flags=re.DOTALL)
        if n != 1:
            raise SystemExit(f"{PAGE}: expected one table {name}, got {n}")
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
