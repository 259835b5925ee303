"""What stands around a helm: a screen with keys, a page, and a log of sentences."""

import asyncio
import signal
import sys
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import (
    AbstractAsyncContextManager,
    AsyncExitStack,
    asynccontextmanager,
)
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

from rich.console import Console

from agents.export.display import HelmView
from agents.export.heard import HeardSentences
from agents.export.helm import Helm
from agents.export.helm_commands import STEERING
from agents.export.keys import is_foreground, keyboard
from agents.export.screen import Screen
from agents.export.sentence_log import SentenceLog
from agents.export.steering import HelmObserver, steer
from agents.export.web_page import HelmPage
from shipgym import InputError


class HelmPanel(HelmObserver):
    """Shows a helm on displays, logs its sentences, and passes commands on.

    Attributes
    ----------
    displays : list of callable
        Called with each new `HelmView`.
    log : SentenceLog or None
        Where sentences are written.
    warn : callable
        Called once with a message if they cannot be written any more.
    """

    longest_question_s = 15.0  # that a question stays open, and a note is shown

    def __init__(
        self, log: SentenceLog | None = None, warn: Callable[[str], None] = print
    ) -> None:
        self.displays: list[Callable[[HelmView], None]] = []
        self.log = log
        self.warn = warn
        self.sentences = HeardSentences()
        self.helm: Helm | None = None
        self.now = 0.0
        self.note = ""
        self.noted_at = 0.0  # s
        self.noted_state = ""  # of the helm
        self.quits = False  # asked to, and not yet confirmed

    def heard(self, line: str, source: str, time: float) -> None:
        """Log a line, and keep it in case that a number is missing."""
        if self.log is not None:
            self.log.take(line, f"in-{source}", time)
        if self.displays:
            self.sentences.take(line, source, time)

    def sent(self, text: str, time: float) -> None:
        """Log sentences that were sent."""
        if self.log is not None:
            self.log.take(text, "out", time)

    def update(self, helm: Helm, now: float) -> None:
        """Show the helm."""
        self.helm = helm
        self.now = now
        helm.plotted.attended = bool(self.displays)
        if self.log is not None and self.log.problem and not helm.notices:
            helm.notices = ["log cannot be written"]
            self.warn(self.log.problem)
        is_old = now - self.noted_at > self.longest_question_s
        if is_old or helm.state != self.noted_state:
            self.note = ""
            self.quits = False
        self._show(helm)

    def _show(self, helm: Helm) -> None:
        if not self.displays:
            return
        view = HelmView.of(helm, self.sentences, self.now, self.note)
        if self.quits:
            view = replace(view, question="quit, and take the wheel?")
        for show in self.displays:
            show(view)

    def press(self, command: str) -> None:
        """Do what a key or a button asks for, one of `KEYS`, and say what came of it.

        It changes the helm at once, its next order follows within a second.
        """
        helm = self.helm
        if helm is None:
            if command == "quit":
                signal.raise_signal(signal.SIGINT)
            return
        try:
            self.note = self._do(command, helm)
        except InputError as error:
            self.note = str(error)
        self.noted_at = self.now
        self.noted_state = helm.state
        self._show(helm)

    def _do(self, command: str, helm: Helm) -> str:
        """Do what a command asks for; the answer to the helmsman."""
        quits = self.quits
        self.quits = False
        side, _, size = command.partition("-")
        if side in ("port", "starboard"):
            angle = radians(float(size))
            helm.change_heading(angle if side == "starboard" else -angle)
            return f"{size}° to {side}"
        if command == "stand-by":
            helm.stand_by()
            return "the wheel is yours"
        if command == "steer":
            helm.engage()
            return "steering"
        if command == "next-leg":
            helm.next_leg()
            return ""
        if command == "confirm" and not quits:
            helm.next_leg(confirm=True)
            return "next leg taken"
        if command == "confirm" or (command == "quit" and helm.state != STEERING):
            helm.ended_by = "the helmsman"
            return "ends"
        self.quits = command == "quit"
        helm.question = None
        return ""


@asynccontextmanager
async def helm_panel(
    title: str,
    say: Callable[[str], None],
    warn: Callable[[str], None],
    *,
    console: Console | None = None,
    page: int | None = None,
    log: Path | None = None,
    speed_up: float = 1.0,
) -> AsyncIterator[tuple[HelmPanel, Callable[[str], None]]]:
    """Panel of a helm, and the function that takes its lines of text.

    Raises InputError for a port that is in use and a log that exists.

    Parameters
    ----------
    title : str
        What is steered by what.
    say, warn : callable
        Print a line and a warning; while a screen is shown they wait for its end.
    console : Console, optional
        The terminal of a screen with keys.
    page : int, optional
        Port of a page, on this computer only.
    log : Path, optional
        New file for all sentences.
    speed_up : float
        As of `steer`.
    """
    async with AsyncExitStack() as stack:
        sentences = None
        if log is not None:
            now = asyncio.get_running_loop().time() * speed_up
            sentences = SentenceLog(log, now)
            stack.callback(sentences.close)
        panel = HelmPanel(sentences, warn)

        if page is not None:
            served = HelmPage(panel.press, title)
            await served.open(page)
            stack.callback(served.close)
            panel.displays.append(served.show)
            title = f"{title}  {served.url}"
            print(f"page: {served.url}", file=sys.stderr, flush=True)

        if console is None:
            yield panel, say
            return
        lines: deque[str] = deque(maxlen=200)
        warnings: list[str] = []
        panel.warn = warnings.append
        stack.callback(_print_all, warnings, warn)
        stack.callback(_print_all, lines, say)
        stack.enter_context(keyboard(panel.press))
        screen = Screen(console, title)
        stack.callback(screen.close)
        panel.displays.append(screen.show)
        yield panel, lines.append


async def steer_with(
    panel: AbstractAsyncContextManager[tuple[HelmPanel, Callable[[str], None]]],
    *arguments: Any,
    **options: Any,
) -> Helm:
    """Steer as `steer` does, watched by a panel."""
    async with panel as (observer, log):
        return await steer(*arguments, log=log, observers=[observer], **options)


def _print_all(lines: Iterable[str], write: Callable[[str], None]) -> None:
    for line in lines:
        write(line)


def has_screen(console: Console) -> bool:
    """True if a console is a terminal on which a screen can be shown."""
    is_shown = console.is_terminal and not console.is_dumb_terminal
    return is_shown and not console.quiet and is_foreground()
