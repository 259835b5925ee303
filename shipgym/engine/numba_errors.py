"""Why a function does not compile: what Numba says on a page, in one sentence."""

import dis
import re
from pathlib import Path
from traceback import walk_tb
from types import CodeType
from typing import Any

from shipgym.engine.specialise import CALLED, SHARED
from shipgym.python_files import LIBRARIES

#: What Numba's reasons mean that do not say it.
PLAINLY = {
    r"Unsupported constraint encountered: raise .*": (
        "the text of an error is put together, expected a constant one"
    ),
    r"Unknown attribute '(\w+)' of type Module\(<module '((?!numpy|math)[\w.]+)'.*": (
        r"\2.\1 is looked up in "
        r"its module, expected it to be imported by name: from \2 import \1"
    ),
    r".*: setitem\(readonly array.*": (
        "a global array is written, expected one that is only read"
    ),
}


def explanation(error: Exception, what: str) -> str:
    """Numba's reason in one sentence, with the function and the line of the innermost call."""
    text = re.sub(
        r"\x1b\[[\d;]*m", "", str(error)
    )  # in colour where colorama is installed
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    reason = next(
        (line for line in lines if not line.startswith("Failed in")), "no reason given"
    )
    if reason.endswith("signature:"):
        reason = reason[: -len(" found for signature:")] + next(
            (f": {line[4:]}" for line in lines if line.startswith(">>> ")), ""
        )
    callee = re.search(rf"<function ((\w+)_[0-9a-f]{{24}}(?:{CALLED})?) at", text)
    own = text[: callee.start()] if callee else text  # behind it stands who calls it
    written = re.search(r"^def (\w+)\(", own, re.MULTILINE)
    function = written[1] if written else callee[2] if callee else ""
    places = re.findall(r"(?:at|from) (\S+) \((\d+)\)", own) + re.findall(
        r'File "([^"]+)", line (\d+)', own
    )
    users = (
        one for one in places if not str(Path(one[0]).resolve()).startswith(LIBRARIES)
    )
    place = next(users, places[0] if places else None)
    functions = (
        one.py_func for one in SHARED.values() if callee and hasattr(one, "py_func")
    )
    code = next(
        (one.__code__ for one in functions if one.__qualname__ == callee[1]), None
    )  # type: ignore[index]
    if code is not None:
        file, line = code.co_filename, place[1] if place else _line_of(code, reason)
    elif place:
        file, line = place
    else:
        file, line = _looked_at(error)
    where = f" in {function}" * bool(function) + f" ({file}, line {line})" * bool(file)
    for found, meant in PLAINLY.items():
        reason = re.sub(found, meant, reason)
    return f"{what}: cannot be compiled{where}: {reason.partition(' Raised from ')[0]}"


def _line_of(code: CodeType, reason: str) -> int:
    """The line in which a function names what a reason quotes, or its first."""
    lines = (
        (i.positions and i.positions.lineno)
        for i in dis.get_instructions(code)
        if f"'{i.argval}'" in reason
    )
    return next(filter(None, lines), code.co_firstlineno)


def _looked_at(error: Exception) -> tuple[str, int]:
    """File and line that Numba was looking at when it failed, as far as that is known."""
    for frame, _ in reversed([*walk_tb(error.__traceback__)]):
        for name in ("inst", "self"):
            place: Any = getattr(frame.f_locals.get(name), "loc", None)
            if hasattr(place, "filename"):
                return place.filename, place.line
    return "", 0
