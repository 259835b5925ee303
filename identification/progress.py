"""Progress of a long identification, for a command that shows it."""

from collections.abc import Callable, Iterator, Sequence
from contextvars import ContextVar
from typing import TypeVar

from shipgym.engine.compiling import tell_who_waits

T = TypeVar("T")
#: Called with the stage of the work, the units of it done and their total.
Progress = Callable[[str, int, int], None]


def _ignored(stage: str, done: int, total: int) -> None:
    """Default: progress is not reported."""


PROGRESS: ContextVar[Progress] = ContextVar("progress", default=_ignored)


def counted(stage: str, items: Sequence[T]) -> Iterator[T]:
    """The items; `PROGRESS` is called with how many are done.

    What is counted while one is worked on is not reported.
    """
    report = PROGRESS.get()
    for done, item in enumerate(items):
        report(
            stage,
            done,
            len(items),
        )
        token = PROGRESS.set(_ignored)
        try:
            yield item
        finally:
            PROGRESS.reset(token)
    report(stage, len(items), len(items))


def announce(words: str) -> None:
    """Tell a person who waits what is begun, where no command shows its progress."""
    if PROGRESS.get() is _ignored:
        tell_who_waits(f"shipgym: {words}")
