"""How soon a thread runs when it wakes, on a computer that is busy."""

import ctypes
import os
import platform
import struct
from collections.abc import Iterator
from contextlib import contextmanager

SET_ATTRIBUTES = {
    "x86_64": 314,
    "aarch64": 274,
}  # number of the system call sched_setattr
# struct sched_attr: size, policy, flags, nice, priority, runtime, deadline, period
ATTRIBUTES = "IIQiIQQQ"
SLICE_NS = 100_000  # the shortest that Linux gives


@contextmanager
def short_slice() -> Iterator[None]:
    """Ask Linux, 6.12 or newer, for the shortest time slice of this thread while the block lasts.

    Among threads of ordinary priority the one with the shorter slice runs first when it
    wakes, and nobody needs a permission for it. Threads of real-time priority, and
    other systems, are left as they are.
    """
    asked = platform.system() == "Linux" and os.sched_getscheduler(0) == os.SCHED_OTHER
    if asked:
        _ask(SLICE_NS)
    try:
        yield
    finally:
        if asked:
            _ask(0)  # the default


def _ask(nanoseconds: int) -> None:
    if call := SET_ATTRIBUTES.get(platform.machine()):
        nice, size = os.getpriority(os.PRIO_PROCESS, 0), struct.calcsize(ATTRIBUTES)
        wanted = struct.pack(
            ATTRIBUTES, size, os.SCHED_OTHER, 0, nice, 0, nanoseconds, 0, 0
        )
        ctypes.CDLL(None).syscall(call, 0, wanted, 0)  # a refusal changes nothing
