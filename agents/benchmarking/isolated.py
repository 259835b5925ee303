"""Contestants in processes of their own.

The code of an entry `module:function` is never imported where the true ship is: a
process of its own (`agents.benchmarking.contestant`) is handed the design task and the
observations, and hands back commands. What comes back is read as JSON and numbers, not
as Python objects.
"""

import os
import queue
import subprocess
import sys
import threading
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.frames import Frame, read_frame, write_frame
from agents.suites.suite import BenchmarkTask
from shipgym.errors import InputError


class ContestantError(Exception):
    """A contestant that died, hung, or did what none may."""


class Made(NamedTuple):
    """What a contestant says of itself when it is made."""

    name: str
    sha256: str | None  # of its file
    design_sha256: tuple[str, ...]  # of the models that it was made for


class IsolatedPolicy:
    """A contestant that steers from a process of its own.

    Raises InputError if it refuses the task, and ContestantError if it fails.

    Parameters
    ----------
    source : str
        `module:function`.
    task : BenchmarkTask
        Its design task is handed over.
    forbidden : sequence of str
        SHA-256 of models that no contestant may hold: the true ship.
    making_s, command_s : float
        How long it may take, s of clock time.
    """

    def __init__(
        self,
        source: str,
        task: BenchmarkTask,
        forbidden: Sequence[str] = (),
        *,
        making_s: float = 300.0,  # it may compile, or train
        command_s: float = 60.0,
    ) -> None:
        self.source = source
        self.command_s = command_s
        #: Processor time of the contestant for its last command.
        self.last_seconds = 0.0
        self._failure = ""
        self._process = _start()
        self._answers: queue.Queue[Frame | None] = queue.Queue()
        self._close = weakref.finalize(self, _stop, self._process)
        threading.Thread(
            target=_listen, args=(self._process.stdout, self._answers), daemon=True
        ).start()

        job = {
            "source": source,
            "task": _handed_over(task),
            "forbidden": list(forbidden),
        }
        answer = self._ask(Frame(job), making_s, "being made")
        self.made = Made(
            name=str(answer.header["name"]),
            sha256=answer.header["sha256"],
            design_sha256=tuple(answer.header["design_sha256"]),
        )

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """See `Policy.predict`; what it remembers stays in its own process."""
        seen = np.asarray(observation, dtype=np.float32)
        header: dict[str, Any] = {"begins": state is None}
        if episode_start is not None:
            header["starts"] = np.asarray(episode_start, dtype=np.bool_).tolist()
        answer = self._ask(Frame(header, seen), self.command_s, "steering")
        self.last_seconds = float(answer.header["seconds"])
        return answer.numbers, True

    def close(self) -> None:
        """End its process."""
        self._close()

    def _ask(self, frame: Frame, patience_s: float, doing: str) -> Frame:
        """Send a frame and wait for its answer; what failed once stays failed."""
        if self._failure:
            raise ContestantError(self._failure)
        answer = self._answer(frame, patience_s)
        if answer is None:
            code = self._process.wait()
            self._fail(f"its process ended with code {code} while {doing}")
        if "hung" in answer.header:
            self._fail(f"no answer within {patience_s:g} s while {doing}")
        if "failure" in answer.header:
            self._fail(str(answer.header["failure"]))
        if "refusal" in answer.header:
            self.close()
            raise InputError(str(answer.header["refusal"]))
        if "error" in answer.header:
            raise ContestantError(str(answer.header["error"]))
        return answer

    def _answer(self, frame: Frame, patience_s: float) -> Frame | None:
        """Answer to a frame; None from a process that has ended."""
        try:
            write_frame(self._process.stdin, frame)
            return self._answers.get(timeout=patience_s)
        except queue.Empty:
            return Frame({"hung": True})
        except OSError:
            return None

    def _fail(self, failure: str) -> NoReturn:
        self._failure = f"'{self.source}': {failure}"
        self.close()
        raise ContestantError(self._failure)


class LostContestant:
    """A contestant that failed before it steered: it loses every episode."""

    def __init__(self, failure: ContestantError) -> None:
        self.failure = failure

    def predict(self, *_: Any, **__: Any) -> tuple[Any, Any]:
        """Raise what it failed with."""
        raise self.failure


def _handed_over(task: BenchmarkTask) -> Mapping[str, Any]:
    """Design task of a contestant, without the suite, whose file names the ship."""
    content = task.design_task.to_dict()
    content["suite"] = ""
    return content


def _start() -> subprocess.Popen[bytes]:
    """Start the process of a contestant, with the paths of this one."""
    folders = [str(Path.cwd()), *sys.path]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
    return subprocess.Popen(
        [sys.executable, "-m", "agents.benchmarking.contestant"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=environment,
    )


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    if process.stdin is not None:
        with suppress(OSError):  # what nobody has read
            process.stdin.close()


def _listen(stream: Any, answers: "queue.Queue[Frame | None]") -> None:
    """Hand on the frames of a process; None when it has ended or says nonsense."""
    with stream:
        try:
            while True:
                answers.put(read_frame(stream))
        except (EOFError, OSError, ValueError):
            answers.put(None)
