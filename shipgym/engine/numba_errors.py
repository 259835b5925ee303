"""One-sentence summary of Numba's explanation why a function does not compile."""

import re
from pathlib import Path
from traceback import walk_tb
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


def explanation(error: Exception, what: str) -> str:
    """Say in one sentence why `what` does not compile.

    It names the function and the line of the innermost call.
    """
    colour = r"\x1b\[[\d;]*m"
    text = re.sub(colour, "", str(error))
    file, line = _place(text)
    if not file:
        file, line = _looked_at(error)
    written = re.search(r"^def (\w+)\(", text, re.MULTILINE)
    where = f" in {written[1]}" if written else ""
    if file:
        where += f" ({file}, line {line})"
    reason = _reason(text)
    for found, meant in PLAINLY.items():
        reason = re.sub(found, meant, reason)
    reason, _, _ = reason.partition(" Raised from ")
    return f"{what}: cannot be compiled{where}: {reason}"


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
        file = str(Path(at or within).resolve())
        places.append((file, int(at_line or within_line)))
    for file, line in places:
        if not file.startswith(LIBRARIES):
            return file, line
    return places[0] if places else ("", 0)


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
