"""Read mutated files in processes of their own: refusals, readings and faults."""

from __future__ import annotations

import hashlib
import multiprocessing
import resource
import shutil
import signal
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import Any

from fuzzing.mutations import mutate
from shipgym.errors import InputError

CORPUS = Path(__file__).parents[2] / "tests" / "corpus"
PACKAGES = ("shipgym", "identification", "agents")
LONGEST_S = 2.0  # processor time of one input
LONGEST_WAIT_S = 60.0  # by the clock: a pipe that nobody writes to
MOST_MEMORY = 2**30  # bytes more than the process had before
CHANGES = (1, 1, 1, 1, 1, 2, 2, 2, 3, 5)  # of an input
KEPT_HASH = 0.8  # share of inputs whose hash is put right: what is behind it is read


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes
    ----------
    name : str
        Of the kind and of its folder in the corpus. A file there is a seed, and so is a
        folder with `main`.
    read : callable
        The reader; it takes the path.
    use : callable, optional
        What is done with what was read, briefly.
    main : str
        File of a folder whose path is given to the reader.
    slow : int
        An input costs so many times what others do: so many fewer of them are read.
    """

    name: str
    read: Callable[[Path], Any]
    use: Callable[[Any], object] | None = None
    main: str = ""
    slow: int = 1


class HangError(BaseException):
    """Reading takes too long; no Exception, so that no reader catches it."""


@dataclass
class Fault:
    """What went wrong at one place of the code, and the first input that did it."""

    message: str
    index: int
    trace: str
    files: dict[str, bytes]
    count: int = 1


@dataclass
class Report:
    """What came of a number of inputs of one kind."""

    inputs: int = 0
    read: int = 0
    refused: int = 0
    faults: dict[str, Fault] = field(default_factory=dict)


@dataclass(frozen=True)
class Seed:
    """Sound files by name, one of which is given to the reader."""

    main: str
    files: dict[str, bytes]


def run_kind(kind: Kind, inputs: int, seed: int) -> Report:
    """Read inputs of a kind in a process; after its death another one goes on."""
    report, first = Report(), 0
    while first < inputs:
        ours, theirs = multiprocessing.Pipe(duplex=False)
        arguments = (kind, first, inputs, seed, theirs)
        child = multiprocessing.get_context("fork").Process(
            target=_read_all, args=arguments
        )
        child.start()
        theirs.close()
        done = first
        try:
            while True:
                if not ours.poll(2.0 * LONGEST_WAIT_S):  # within a compiled loop
                    child.kill()
                done, outcome = ours.recv()
                _count(report, outcome)
                done += 1
        except EOFError:
            child.join()
        if child.exitcode:
            what = f"process died with {child.exitcode}"
            _count(report, (what, Fault(what, done, "", {})))
            done += 1
        first = done
    return report


def _count(report: Report, outcome: str | tuple[str, Fault]) -> None:
    report.inputs += 1
    if outcome == "read":
        report.read += 1
    elif outcome == "refused":
        report.refused += 1
    elif not isinstance(outcome, str):
        what, fault = outcome
        known = report.faults.setdefault(what, fault)
        known.count += known is not fault


def _read_all(kind: Kind, first: int, last: int, seed: int, told: Connection) -> None:
    """Read inputs by number and tell what came of each."""
    with tempfile.TemporaryDirectory() as name:
        signal.signal(signal.SIGPROF, _stop)
        signal.signal(signal.SIGALRM, _stop)
        folder = Path(name)
        seeds = list(_seeds(kind))
        for one in seeds:  # must do as it is; what is imported then is not counted
            if error := _outcome(kind, _written(one, {}, folder / "first")):
                raise error
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limit = pages * resource.getpagesize() + MOST_MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
        for index in range(first, last):
            random = Random(f"{seed} {kind.name} {index}")
            one = random.choice(seeds)
            changed = _changed(random, one)
            path = _written(one, changed, folder / "input")
            try:
                with _limited():
                    error = _outcome(kind, path)
            except HangError as hang:  # of the second clock, at this moment
                error = hang
            told.send((index, _judged(error, index, one.files | changed)))


def _outcome(kind: Kind, path: Path) -> BaseException | None:
    """Read and use; the exception, if one is raised."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", category=ImportWarning)
            warnings.filterwarnings("ignore", category=DeprecationWarning)
            found = kind.read(path)
            if kind.use is not None:
                kind.use(found)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever it is, it is what is looked for
        return error
    return None


def _judged(
    error: BaseException | None, index: int, files: dict[str, bytes]
) -> str | tuple[str, Fault]:
    """Outcome of an input: read, refused, or a fault by its place."""
    if error is None:
        return "read"
    what = _site(error)
    if isinstance(error, InputError):
        if any("\ud800" <= letter <= "\udfff" for letter in str(error)):
            what = f"message that cannot be printed: {what}"
        else:
            return "refused"
    trace = "".join(traceback.format_exception(error)[-12:])
    return what, Fault(ascii(error)[:300], index, ascii(trace), files)


def _site(error: BaseException) -> str:
    """Type of an exception and the place in the project that it came from."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [one for one in frames if set(PACKAGES) & set(Path(one.filename).parts)]
    frame = (own or frames)[-1]
    return f"{type(error).__name__} in {frame.filename}:{frame.lineno} {frame.name}"


def _seeds(kind: Kind) -> Iterator[Seed]:
    """The seeds of a kind: files, and folders of files."""
    for entry in sorted((CORPUS / kind.name).iterdir()):
        if entry.is_file():
            yield Seed(entry.name, {entry.name: entry.read_bytes()})
            continue
        paths = sorted(path for path in entry.rglob("*") if path.is_file())
        files = {str(path.relative_to(entry)): path.read_bytes() for path in paths}
        yield Seed(kind.main, files)


def _changed(random: Random, one: Seed) -> dict[str, bytes]:
    """Files of a seed that some changes leave different."""
    changed: dict[str, bytes] = {}
    for _ in range(random.choice(CHANGES)):
        name = random.choice((one.main, *one.files))
        before = changed.get(name, one.files[name])
        after = changed[name] = mutate(random, name, before)
        if name != one.main and random.random() < KEPT_HASH:
            old, new = (
                hashlib.sha256(text).hexdigest().encode() for text in (before, after)
            )
            main = changed.get(one.main, one.files[one.main])
            changed[one.main] = main.replace(old, new)
    return changed


def _written(one: Seed, changed: dict[str, bytes], folder: Path) -> Path:
    """Write the files of an input to an empty folder; the path for the reader."""
    shutil.rmtree(folder, ignore_errors=True)
    for name, content in (one.files | changed).items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return folder / one.main


def _stop(number: int, frame: Any) -> None:
    raise HangError(
        f"more than {LONGEST_S} s of processor, or waits for {LONGEST_WAIT_S} s"
    )


@contextmanager
def _limited() -> Iterator[None]:
    """Both clocks are set within the block and raise `HangError`."""
    signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
    signal.setitimer(signal.ITIMER_REAL, LONGEST_WAIT_S)
    try:
        yield
    finally:
        for clock in (signal.ITIMER_PROF, signal.ITIMER_REAL, signal.ITIMER_PROF):
            with suppress(HangError):  # of the other clock, at this moment
                signal.setitimer(clock, 0.0)
