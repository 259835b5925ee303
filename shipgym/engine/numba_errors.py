"""One-sentence summary of Numba's explanation why a function does not compile."""

import re
from pathlib import Path

from shipgym.python_files import LIBRARIES

COLOUR = r"\x1b\[[\d;]*m"
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
    r"Detected uninitialized variable (\w+)": (
        r"expected variables that are set in every case, got '\1', which is not; give"
        " it a value before the if or the loop that sets it"
    ),
}


def explanation(error: Exception, what: str) -> str:
    """Say in one sentence why `what` does not compile.

    It names the function and the line of the innermost call, where Numba does.
    """
    text = re.sub(COLOUR, "", str(error))
    reason = _reason(text)
    for found, meant in PLAINLY.items():
        reason = re.sub(found, meant, reason)
    reason, _, _ = reason.partition(" Raised from ")
    written = re.search(r"^def (\w+)\(", text, re.MULTILINE)
    where = f" in {written[1]}" if written else ""
    return f"{what}: cannot be compiled{where}{_place(text)}: {reason}"


def _reason(text: str) -> str:
    """Line of the reason; of a function without an implementation, for which types."""
    stripped = [line.strip() for line in text.splitlines()]
    lines = [line for line in stripped if line and not line.startswith("Failed in")]
    reason = lines[0] if lines else "no reason given"
    missing, found, _ = reason.partition(" found for signature:")
    signature = next((line for line in lines if line.startswith(">>> ")), "")
    return f"{missing}: {signature.removeprefix('>>> ')}" if found else reason


def _place(text: str) -> str:
    """First user's file and line that a text names, or the first of all."""
    place = r'(?:at|from) (\S+) \((\d+)\)|File "([^"]+)", line (\d+)'
    places = []
    for at, at_line, within, within_line in re.findall(place, text):
        file = at or within
        if file.startswith("<"):  # code that is written by the package
            continue
        shown = f" ({file}, line {at_line or within_line})"
        if not str(Path(file).resolve()).startswith(LIBRARIES):
            return shown
        places.append(shown)
    return places[0] if places else ""
