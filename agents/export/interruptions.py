"""Signals that end a live loop, which then still says its last words."""

import asyncio
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def interruptions() -> Iterator[list[str]]:
    """Let SIGINT, SIGTERM, SIGHUP and a cancellation end what stands inside.

    Yields the list of the signals that came. Outside the main thread only a
    cancellation is heard.
    """
    task = asyncio.current_task()
    loop = asyncio.get_running_loop()
    came: list[str] = []

    def end(name: str) -> None:
        came.append(name)
        if task is not None:
            task.cancel()

    handled = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        with suppress(NotImplementedError, RuntimeError, ValueError):
            loop.add_signal_handler(number, end, number.name)
            handled.append(number)
    try:
        with suppress(asyncio.CancelledError):
            yield came
    finally:
        for number in handled:
            loop.remove_signal_handler(number)
