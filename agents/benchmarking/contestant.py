"""Process of a contestant: makes a controller from a user's function, and steers.

    python -m agents.benchmarking.contestant

It reads frames from standard input and answers each. The user's code finds an empty
standard input, and what it writes to standard output is kept from the answers.
"""

import gc
import os
import sys
import tempfile
import time
from collections.abc import Collection
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from agents.benchmarking.entries import design_hashes
from agents.benchmarking.frames import Frame, read_frame, write_frame
from agents.benchmarking.sources import import_code, make_policy, policy_hash
from agents.controllers.interface import check_fits, model_hash
from agents.suites.suite import BenchmarkTask
from shipgym import InputError, ShipModel
from shipgym.python_files import working_folder


class Channel(NamedTuple):
    """Streams to the benchmark, and what the user's code prints."""

    requests: BinaryIO
    answers: BinaryIO
    printed: Any  # file

    def printed_text(self) -> str:
        """Beginning of what was written to standard output."""
        sys.stdout.flush()
        self.printed.seek(0)
        text: bytes = self.printed.read(200)
        return text.decode(errors="replace").strip()


class Contestant:
    """A user's controller, and what it remembers."""

    def __init__(self, job: Any) -> None:
        self.source = job["source"]
        self.forbidden = set(job["forbidden"])
        task = BenchmarkTask.from_dict(job["task"])
        with working_folder():
            self.policy = make_policy(import_code(self.source), task)
        check_fits(self.policy, task.task, task.ship, f"'{self.source}'")
        self.memory: Any = None
        self.commands = 0

    def introduction(self) -> Frame:
        """Answer of a contestant that was made."""
        name = getattr(self.policy, "name", None) or type(self.policy).__name__
        header = {
            "name": str(name),
            "sha256": policy_hash(self.policy),
            "design_sha256": sorted(design_hashes(self.policy)),
        }
        return Frame(header)

    def steer(self, frame: Frame) -> Frame:
        """Commands for observations."""
        header = frame.header
        if header["begins"]:
            self.memory = None
        starts = header.get("starts")
        if starts is not None:
            starts = np.array(starts)

        began = time.process_time()
        actions, self.memory = self.policy.predict(
            frame.numbers, self.memory, starts, True
        )
        seconds = time.process_time() - began
        self.commands += 1
        commands = np.asarray(actions, dtype=np.float32)
        return Frame({"seconds": seconds}, commands)

    def holds_the_ship(self) -> bool:
        """True if any model in this process is the true ship."""
        return holds_model(self.forbidden)

    def is_due(self) -> bool:
        """True at the commands at which models are looked for: 1, 10, 100, ..."""
        digits = str(self.commands)
        return digits.strip("0") == "1"


def holds_model(sha256: Collection[str]) -> bool:
    """True if this process has a model with one of some hashes."""
    if not sha256:
        return False
    for thing in gc.get_objects():
        if isinstance(thing, ShipModel) and model_hash(thing) in sha256:
            return True
    return False


def main() -> None:
    """Make the contestant of the first frame, then answer each of the others."""
    channel = take_streams()
    try:
        job = read_frame(channel.requests)
        contestant = made(job, channel)
        while contestant is not None:
            request = read_frame(channel.requests)
            write_frame(channel.answers, answer(contestant, request, channel))
    except (EOFError, BrokenPipeError):
        return


def take_streams() -> Channel:
    """Keep the streams of the process, and give the user's code others."""
    requests = os.fdopen(os.dup(0), "rb")
    answers = os.fdopen(os.dup(1), "wb")
    printed = tempfile.TemporaryFile()  # noqa: SIM115 - for the life of the process
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(printed.fileno(), 1)
    return Channel(requests, answers, printed)


def made(job: Frame, channel: Channel) -> Contestant | None:
    """Make the contestant, and tell of it; None if that failed."""
    try:
        contestant = Contestant(job.header)
        introduction = contestant.introduction()
    except InputError as error:
        write_frame(channel.answers, Frame({"refusal": str(error)}))
        return None
    except Exception as error:  # whatever a user's code raises
        why = f"{type(error).__name__}: {error}"
        write_frame(channel.answers, Frame({"refusal": why}))
        return None
    fault = misconduct(contestant, channel, is_due=True)
    if fault:
        write_frame(channel.answers, Frame({"failure": fault}))
        return None
    write_frame(channel.answers, introduction)
    return contestant


def answer(contestant: Contestant, request: Frame, channel: Channel) -> Frame:
    """Commands, an error of the controller, or what it did that none may."""
    try:
        commands = contestant.steer(request)
    except Exception as error:  # whatever a user's policy raises
        commands = Frame({"error": f"{type(error).__name__}: {error}"})
    fault = misconduct(contestant, channel, is_due=contestant.is_due())
    return Frame({"failure": fault}) if fault else commands


def misconduct(contestant: Contestant, channel: Channel, is_due: bool) -> str:
    """Why a contestant is out; empty if it is not."""
    if is_due and contestant.holds_the_ship():
        return "it asked for the true ship; it is to steer by the model it is given"
    text = channel.printed_text()
    if text:
        return f"it wrote to standard output: {text!r}; write to standard error"
    return ""


if __name__ == "__main__":
    main()
