"""Why a function does not compile: what Numba says on a page, in one sentence."""

import dis
import re
from collections.abc import Iterable
from pathlib import Path
from traceback import walk_tb
from types import CodeType
from typing import Any

from shipgym.python_files import LIBRARIES

#: What Numba's reasons mean that do not say it.
PLAINLY = {
    r"Unknown attribute '(\w+)' of type Module\(<module '((?!numpy|math)[\w.]+)'.*": (
        r"\2.\1 is looked up in its module, expected it to be imported by name: from \2"
        r" import \1"
    ),
    r".*: setitem\(readonly array.*": (
        "a global array is written, expected one that is only read"
    ),
}
COLOUR = re.compile(r"\x1b\[[\d;]*m")
# a function that loops call, as `shipgym.engine.compiling` names it
CALLEE = re.compile(r"<function \w+_[0-9a-f]{32} at 0x[0-9a-f]+>")
PLACE = re.compile(r'(?:at|from) (\S+) \((\d+)\)|File "([^"]+)", line (\d+)')


def explanation(error: Exception, what: str, functions: Iterable[Any] = ()) -> str:
    """Say in one sentence why `what` does not compile.

    It names the function and the line of the innermost call. `functions` are those that
    were compiled, of which Numba's text may name one.
    """
    text = COLOUR.sub("", str(error))
    reason = _reason(text)
    callee = CALLEE.search(text)  # what stands behind it is about who calls it
    own = text[: callee.start()] if callee else text
    code = None
    for function in functions:
        if callee and repr(function) == callee[0]:
            code = function.__code__

    file, line = _place(own)
    if code is not None:
        file = code.co_filename
        line = line or _line_of(code, reason)
    elif not file:
        file, line = _looked_at(error)
    written = re.search(r"^def (\w+)\(", own, re.MULTILINE)
    name = written[1] if written else code.co_name if code else ""

    where = f" in {name}" if name else ""
    if file:
        where += f" ({file}, line {line})"
    for found, meant in PLAINLY.items():
        reason = re.sub(found, meant, reason)
    return f"{what}: cannot be compiled{where}: {reason.partition(' Raised from ')[0]}"


def _reason(text: str) -> str:
    """Line of the reason; of a function without an implementation, for which types."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    reasons = [line for line in lines if not line.startswith("Failed in")]
    reason = reasons[0] if reasons else "no reason given"
    if reason.endswith(" found for signature:"):
        asked = [line.removeprefix(">>> ") for line in lines if line[:4] == ">>> "]
        reason = ": ".join([reason.removesuffix(" found for signature:"), *asked[:1]])
    return reason


def _place(text: str) -> tuple[str, int]:
    """First file and line of a user's that a text names, or of anybody's."""
    places = []
    for at, at_line, within, within_line in PLACE.findall(text):
        places.append((at or within, int(at_line or within_line)))
    for file, line in places:
        if not str(Path(file).resolve()).startswith(LIBRARIES):
            return file, line
    return places[0] if places else ("", 0)


def _line_of(code: CodeType, reason: str) -> int:
    """Line in which a function names what a reason quotes, or its first."""
    for instruction in dis.get_instructions(code):
        positions = instruction.positions
        if f"'{instruction.argval}'" in reason and positions and positions.lineno:
            return positions.lineno
    return code.co_firstlineno


def _looked_at(error: Exception) -> tuple[str, int]:
    """File and line that Numba was looking at when it failed, as far as known."""
    for frame, _ in reversed([*walk_tb(error.__traceback__)]):
        for name in ("inst", "self"):
            place: Any = getattr(frame.f_locals.get(name), "loc", None)
            if hasattr(place, "filename"):
                return place.filename, place.line
    return "", 0
