"""Keys of a terminal, read while an event loop runs."""

import asyncio
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from agents.export.display import KEYS


def commands_of(typed: str) -> list[str]:
    """Commands of what a terminal sent at once; none of a text that was pasted."""
    longest_repeat = 16  # characters
    if len(typed) > longest_repeat:
        return []
    by_key = {
        "\x1b[D": "port-1",
        "\x1b[C": "starboard-1",
        "\x1bOD": "port-1",
        "\x1bOC": "starboard-1",
        "_": "port-1",
        "=": "starboard-1",
        ",": "port-10",
        ".": "starboard-10",
        "\x1b": "cancel",
    }
    for command, (key, _) in KEYS.items():
        by_key[" " if key == "space" else key] = command

    commands = []
    rest = typed
    while rest:
        key = _first_key(rest)
        rest = rest[len(key) :]
        if key.lower() in by_key:
            commands.append(by_key[key.lower()])
        elif key in by_key:
            commands.append(by_key[key])
    return commands


def _first_key(typed: str) -> str:
    """First key of what was typed: a character, or a sequence of an escape."""
    if not typed.startswith(("\x1b[", "\x1bO")):
        return typed[0]
    for end, character in enumerate(typed[2:], start=3):
        if character.isalpha() or character == "~":
            return typed[:end]
    return typed


def is_foreground() -> bool:
    """True if standard input is a terminal that this process may change."""
    if not sys.stdin.isatty():
        return False
    with suppress(OSError, AttributeError):
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    return False


@contextmanager
def keyboard(press: Callable[[str], None]) -> Iterator[None]:
    """Call a function with each command that is typed, while the block lasts.

    The terminal is restored at the end. Until then it neither echoes nor can be
    stopped (Ctrl-S, Ctrl-Z): who stops it would stop the autopilot.
    """
    try:
        import termios
    except ImportError:  # Windows
        yield
        return
    loop = asyncio.get_running_loop()
    terminal = sys.stdin.fileno()

    def read() -> None:
        try:
            typed = os.read(terminal, 1024)
        except OSError:
            typed = b""
        if not typed:  # the terminal is gone
            loop.remove_reader(terminal)
        for command in commands_of(typed.decode("ascii", "replace")):
            press(command)

    before = termios.tcgetattr(terminal)
    changed = termios.tcgetattr(terminal)
    changed[0] &= ~(termios.IXON | termios.IXOFF)
    changed[3] &= ~(termios.ECHO | termios.ICANON)
    for control in (termios.VSUSP, termios.VQUIT):
        changed[6][control] = b"\0"
    try:
        termios.tcsetattr(terminal, termios.TCSANOW, changed)
        loop.add_reader(terminal, read)
        yield
    finally:
        loop.remove_reader(terminal)
        with suppress(termios.error):
            termios.tcsetattr(terminal, termios.TCSAFLUSH, before)
