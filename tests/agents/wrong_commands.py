"""Wrong command lines, made from the commands' parameters: each gets one message.

Unknown, missing, empty, repeated and wrongly typed arguments, numbers out of any range,
names that do not exist, folders for files, files for folders, devices, paths that are
too long. A fault is one that is accepted, exits with another code than 1 or 2, shows a
traceback, says nothing or several things, or leaves a file.
"""

from __future__ import annotations

import os
import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_type_hints

import typer
from typer.testing import CliRunner

from agents.cli import app

ROOT = Path(__file__).resolve().parents[2]
SHIP = str(ROOT / "examples" / "mariner" / "ship.toml")
AGENT = str(ROOT / "agents" / "pretrained" / "path-following-ppo.json")
LONGEST_S = 60  # that a wrong command may take

#: The shortest right command line of each command; the folder that it is in is new.
RIGHT: dict[str, list[str]] = {
    "new-ship": [
        str(ROOT / "examples" / "mariner" / "zigzag_10_10.csv"),
        "--out",
        "out",
    ],
    "look": [SHIP, "--out", "out.html"],
    "identify": [SHIP, "--out", "out"],
    "advise": [SHIP],
    "reduce": [SHIP, "--out", "out"],
    "autopilot": [SHIP, "--out", "out"],
    "export": [AGENT, "--onnx", "out"],
    "train": ["ppo", "--out", "out"],
    "tune": ["ppo", "--out", "out"],
    "benchmark": ["--controllers", "pid", "--out", "out"],
    "trials": ["mariner"],
    "replay": ["episode.json", "--out", "out.html"],
    "doctor": [],
}

NO_NUMBER = ("x", "", "1,5", "0x1", "--", "1e")
WRONG: dict[str, tuple[str, ...]] = {
    "int": (*NO_NUMBER, "1.5", "-1", "nan", "1e3", "9" * 5000, "-" + "9" * 30),
    "float": (*NO_NUMBER, "nan", "-inf", "-1", "-1e999", "-1e-9"),
    "str": (
        "",
        "no-such-thing",
        "-1",
        "nan",
        "[red]x",
        "\x1b[31mx",
        "x" * 5000,
        "a=b=c",
        "../..",
        "\0",
    ),
    "Path": (
        "",
        "no/such/thing",
        "/",
        ".",
        "/proc/self/mem",
        "/dev/null",
        "x" * 5000,
        "binary",
        "\0",
    ),
    "out": (
        "",
        "file",
        "file/out",
        "full",
        "/proc/self/mem",
        "/dev/full",
        "x" * 5000,
        "/proc/x",
        "\0",
    ),
}
WRITTEN = (
    "out",
    "onnx",
    "markdown",
    "c",
    "fmu",
)  # parameters that name what is written


def commands() -> dict[str, Any]:
    """Commands with all their parameters; `reproduce` leaves them to a script."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="shipgym")
    return {
        name: (
            command.make_context(
                name, [], resilient_parsing=True, parent=context
            ).command
        )
        for name, command in group.commands.items()  # type: ignore[attr-defined]
        if name != "reproduce"
    }


def lines() -> Iterator[list[str]]:
    """Every wrong command line; of an option given twice the last counts."""
    yield from (
        ["no-such-command"],
        ["--no-such-option"],
        [""],
        ["\0"],
        ["-x"],
        ["--version=3"],
    )
    for name, command in commands().items():
        right = RIGHT[name]
        yield [name, *right, "--no-such-option"]
        yield [name, *right, "--no-such-option=3", "3"]
        yield [name, *right, ""]
        needed = right[: 1 + right.index("--out")] if "--out" in right else right
        yield from ([name, *right[:k]] for k in range(len(needed)) if name != "doctor")
        for parameter in command.params:
            kind = str(get_type_hints(command.callback).get(parameter.name))
            yield from ([name, *words] for words in _wrong(parameter, kind, right))


def _wrong(parameter: Any, kind: str, right: list[str]) -> Iterator[list[str]]:
    """What is wrong of one parameter, beside what is right of the others."""
    if parameter.name == "allow_code":  # what a suite does not name does not matter
        return
    values = next(
        (values for name, values in WRONG.items() if name in kind), WRONG["str"]
    )
    if parameter.name in WRITTEN:
        values = tuple(
            one for one in WRONG["out"] if (parameter.name, one) != ("onnx", "file")
        )  # is replaced
    if parameter.param_type_name == "argument":
        yield from ([value, *right[1:]] for value in values)
        return
    option = parameter.opts[0]
    if parameter.is_flag:
        yield [*right, f"{option}=yes"]
        return
    yield [*right, option]
    yield from ([*right, option, value] for value in values)
    yield from ([*right, f"{option}={value}"] for value in values[:1])


class _TooLongError(BaseException):
    """Ends a command that should have been refused."""


def fault(line: list[str]) -> str:
    """What is wrong about the answer to a wrong command line; empty if nothing is."""

    def late(*_: Any) -> None:
        raise _TooLongError

    Path("file").write_text("mine")
    Path("binary").write_bytes(bytes(range(256)))
    Path("full").mkdir()
    Path("full/thesis.tex").write_text("years of work")
    before = sorted(Path().rglob("*"))
    signal.signal(signal.SIGALRM, late)
    signal.alarm(LONGEST_S)
    try:
        answer = CliRunner().invoke(app, line)
    except _TooLongError:
        return f"not refused within {LONGEST_S} s"
    finally:
        signal.alarm(0)
    told = answer.stderr.splitlines()
    if answer.exit_code not in (1, 2) or not isinstance(answer.exception, SystemExit):
        return f"exit code {answer.exit_code}, {answer.exception!r}"
    if (
        sum(text.lower().startswith("error:") for text in told) != 1
        or "Traceback" in answer.output
    ):
        return f"{len(told)} lines: {answer.stderr[:300]!r}"
    left = sorted(set(Path().rglob("*")) - set(before))
    return f"left {', '.join(map(str, left))}" if left else ""


def faults(chosen: list[list[str]]) -> dict[str, str]:
    """Faults by command line, each tried in an empty folder."""
    found, home = {}, Path.cwd()
    for line in chosen:
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                wrong = fault(line)
            finally:
                os.chdir(home)
        if wrong:
            found[" ".join(text[:60] if text else "''" for text in line)] = wrong
    return found
