r"""A log of all sentences in and out, as `shipgym new-ship` reads it.

Each line is a sentence behind a TAG block (NMEA 0183 4.x) with where it came from or
went to and the time, ms since 1970: ``\s:in-127.0.0.1:10110,c:1620035990123*hh\``.
"""

import os
import re
import time
from collections import deque
from pathlib import Path
from threading import Event, Thread

from shipgym import InputError
from shipgym.trials.nmea import checksum


class SentenceLog:
    """File to which a thread of its own writes: a slow disk does not hold up the helm.

    What was taken is written four times a second. If that fails, `problem` says why
    and nothing more is written. Raises InputError for a file that exists.

    Parameters
    ----------
    path : Path
        New file.
    now : float
        Time, s, on the clock of the times that are given with sentences.
    """

    most_waiting = 100_000  # sentences, while the disk is busy

    def __init__(self, path: Path, now: float) -> None:
        self.path = path
        self.problem = ""
        self._epoch = time.time() - now
        self._waiting: deque[str] = deque()
        self._ended = Event()
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        flags |= getattr(os, "O_NOFOLLOW", 0)
        try:
            self._file = os.open(path, flags, 0o644)
        except FileExistsError:
            raise InputError(
                f"{path}: expected a new file, got one that exists; choose another"
            ) from None
        except OSError as error:
            self._fail(error)
            return
        self._thread = Thread(target=self._write, daemon=True)
        self._thread.start()

    def take(self, text: str, source: str, now: float) -> None:
        """Log lines that came from or went to a source at a time, s."""
        block = _tag_block(source, self._epoch + now)
        for line in text.splitlines():
            sentence = _sentence(line)
            if not self.problem:
                self._waiting.append(f"{block}{sentence}\r\n")
        if len(self._waiting) > self.most_waiting:
            self.problem = f"{self.path}: too slow to keep up with the sentences"

    def close(self) -> None:
        """Write the rest; a disk that takes nothing is waited for 5 s."""
        self._ended.set()
        if hasattr(self, "_thread"):
            self._thread.join(timeout=5.0)

    def _write(self) -> None:
        pause_s = 0.25
        ended = False
        while not ended and not self.problem:
            ended = self._ended.wait(pause_s)
            lines = [self._waiting.popleft() for _ in range(len(self._waiting))]
            data = "".join(lines).encode("ascii")
            try:
                while data:
                    data = data[os.write(self._file, data) :]
            except OSError as error:
                self._fail(error)
        self._waiting.clear()
        os.close(self._file)

    def _fail(self, error: OSError) -> None:
        self.problem = f"{self.path}: cannot be written ({error.strerror or error})"


def _tag_block(source: str, seconds: float) -> str:
    """TAG block with a source and a time, s since 1970."""
    place = re.sub(r"[^\w.:@/-]", "_", source, flags=re.ASCII)
    milliseconds = round(1000.0 * seconds)
    tags = f"s:{place},c:{milliseconds}"
    return f"\\{tags}*{checksum(tags)}\\"


def _sentence(line: str) -> str:
    """A line without a TAG block of its own and characters that no sentence has."""
    begin, block, rest = line.rpartition("\\")
    if begin.startswith("\\") and block:
        line = rest
    return re.sub(r"[^ -~]", "?", line)
