"""One-sentence summary of Numba's explanation why a function does not compile."""

import dis
import re
from collections.abc import Iterable
from pathlib import Path
from traceback import walk_tb
from types import CodeType
from typing import Any

from shipgym.python_files import LIBRARIES

#: Plain words for reasons of Numba that are hard to understand.
PLAINLY = {
    r"Unknown attribute '(\w+)' of type Module\(<module '((?!numpy|math)[\w.]+)'.*": (
        r"expected \1 to be imported by name, got \2.\1; write from \2 import \1"
    ),
    r"Unknown attribute '_replace' of type \w+.*": (
        "expected a record that is made anew, got _replace, which cannot be compiled;"
        " write Motion(...), or under_way(...) for a starting state"
    ),
    r".*: setitem\(readonly array.*": (
        "expected global arrays to be only read, got one that is written"
    ),
}
# a function that loops call, as `shipgym.engine.compiling` names it
CALLEE = re.compile(r"<function \w+_[0-9a-f]{32} at 0x[0-9a-f]+>")


def explanation(error: Exception, what: str, functions: Iterable[Any] = ()) -> str:
    """Say in one sentence why `what` does not compile.

    It names the function and the line of the innermost call. `functions` are those that
    were compiled, of which Numba's text may name one.
    """
    colour = r"\x1b\[[\d;]*m"
    text = re.sub(colour, "", str(error))
    reason = _reason(text)
    own = text
    code = None
    callee = CALLEE.search(text)
    if callee:
        own = text[: callee.start()]  # the text behind it is about the caller
        code = _code_of(callee[0], functions)

    file, line = _place(own)
    if code is not None:
        file = code.co_filename
        line = line or _line_of(code, reason)
    elif not file:
        file, line = _looked_at(error)
    name = _name(own, code)

    where = f" in {name}" if name else ""
    if file:
        where += f" ({file}, line {line})"
    for found, meant in PLAINLY.items():
        reason = re.sub(found, meant, reason)
    reason, _, _ = reason.partition(" Raised from ")
    return f"{what}: cannot be compiled{where}: {reason}"


def _code_of(text: str, functions: Iterable[Any]) -> CodeType | None:
    """Code of the function that a text names; None if it is not among them."""
    code = None
    for function in functions:
        if repr(function) == text:
            code = function.__code__
    return code


def _name(text: str, code: CodeType | None) -> str:
    """Name of the function that a text shows, or of the code; empty if neither."""
    written = re.search(r"^def (\w+)\(", text, re.MULTILINE)
    if written:
        return written[1]
    return code.co_name if code else ""


def _reason(text: str) -> str:
    """Line of the reason; of a function without an implementation, for which types."""
    stripped = [line.strip() for line in text.splitlines()]
    lines = [line for line in stripped if line]
    reason = "no reason given"
    for line in lines:
        if not line.startswith("Failed in"):
            reason = line
            break

    missing, found, _ = reason.partition(" found for signature:")
    if not found:
        return reason
    for line in lines:
        if line.startswith(">>> "):
            signature = line.removeprefix(">>> ")
            return f"{missing}: {signature}"
    return missing


def _place(text: str) -> tuple[str, int]:
    """First user's file and line that a text names, or the first of all."""
    place = r'(?:at|from) (\S+) \((\d+)\)|File "([^"]+)", line (\d+)'
    places = []
    for at, at_line, within, within_line in re.findall(place, text):
        file = at or within
        line = int(at_line or within_line)
        places.append((file, line))
    for file, line in places:
        resolved = str(Path(file).resolve())
        if not resolved.startswith(LIBRARIES):
            return file, line
    return places[0] if places else ("", 0)


def _line_of(code: CodeType, reason: str) -> int:
    """Line in which a function names what a reason quotes, or its first."""
    for instruction in dis.get_instructions(code):
        positions = instruction.positions
        line = positions.lineno if positions else None
        if line and f"'{instruction.argval}'" in reason:
            return line
    return code.co_firstlineno


def _looked_at(error: Exception) -> tuple[str, int]:
    """File and line that Numba was looking at when it failed, as far as known."""
    frames = [frame for frame, _ in walk_tb(error.__traceback__)]
    for frame in reversed(frames):
        for name in ("inst", "self"):
            looked_at = frame.f_locals.get(name)
            place: Any = getattr(looked_at, "loc", None)
            if hasattr(place, "filename"):
                return place.filename, place.line
    return "", 0
