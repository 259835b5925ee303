"""The helm on a terminal's screen, drawn by a thread of its own.

A terminal that does not take what is written to it, as over a slow line, must not hold
up the autopilot.
"""

from contextlib import suppress
from threading import Event, Thread

from rich.console import Console
from rich.live import Live

from agents.export.display import HelmView, rendered
from agents.export.helm_commands import MANUAL


class Screen:
    """Screen of a terminal that always shows the newest view.

    Parameters
    ----------
    console : rich.console.Console
        The terminal.
    title : str
        First line.
    """

    patience_s = 2.0  # with a terminal that takes nothing

    def __init__(self, console: Console, title: str) -> None:
        self.console = console
        self.title = title
        self._view: HelmView | None = None
        self._has_news = Event()
        self._ended = Event()
        self._thread = Thread(target=self._draw, daemon=True)
        self._thread.start()

    def show(self, view: HelmView) -> None:
        """Draw a view soon."""
        self._view = view
        self._has_news.set()

    def close(self) -> None:
        """Restore the screen."""
        self._ended.set()
        self._has_news.set()
        self._thread.join(timeout=self.patience_s)

    def _draw(self) -> None:
        """Draw the newest view, again and again."""
        live = Live(
            console=self.console,
            screen=True,
            auto_refresh=False,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        with suppress(OSError), live:
            state = ""
            while not self._ended.is_set():
                self._has_news.wait()
                self._has_news.clear()
                view = self._view
                if view is None:
                    continue
                if view.state == MANUAL != state:
                    self.console.bell()
                state = view.state
                lines = self.console.size.height
                live.update(rendered(view, self.title, lines), refresh=True)
                self._ended.wait(0.1)
