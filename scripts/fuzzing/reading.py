"""Read mutated files in this process: refusals, readings and faults."""

from __future__ import annotations

import hashlib
import os
import resource
import shutil
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from fuzzing.mutations import mutate
from shipgym.errors import InputError

CORPUS = Path(__file__).parents[2] / "tests" / "corpus"
PACKAGES = ("shipgym", "identification", "agents")
SCRATCH = Path("/dev/shm") if Path("/dev/shm").is_dir() else None  # files in memory

LONGEST_S = 2.0  # processor time of one input
LONGEST_WAIT_S = (
    300.0  # by the clock, on whatever busy machine: a pipe that nobody writes to
)
MOST_MEMORY = 2**30  # bytes more than the process had before
LONGEST_MESSAGE = 5_000  # characters of a refusal
EDITS = (1, 1, 1, 1, 1, 2, 2, 2, 3, 5)  # changes of an input
SPECIAL_SHARE = 0.002  # of changes: what stands there is no file
KEPT_HASH = (
    0.8  # share of inputs whose hash is put right, so that what is behind it is read
)


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
    prepare : callable, optional
        Writes the seeds to a folder instead, where the corpus cannot hold them.
    slow : int
        An input costs so many times what others do: so many fewer of them are read.
    """

    name: str
    read: Callable[[Path], Any]
    use: Callable[[Any], object] | None = None
    main: str = ""
    prepare: Callable[[Path], None] | None = None
    slow: int = 1


class HangError(BaseException):
    """Reading takes too long; no Exception, so that no reader catches it."""


@dataclass
class Finding:
    """Something that went wrong at one place of the code."""

    kind: str
    what: str  # type of the exception, and the place
    message: str
    index: int  # of the input
    edits: tuple[str, ...]  # that suffice
    files: dict[str, bytes]  # of that input, by name
    trace: str
    count: int = 1


@dataclass
class Report:
    """What came of a number of inputs of one kind."""

    kind: str
    inputs: int = 0
    read: int = 0
    refused: int = 0
    slowest_s: float = 0.0
    peak_mib: float = 0.0
    seconds: float = 0.0
    findings: dict[str, Finding] = field(default_factory=dict)

    def add(self, other: Report) -> None:
        """Put another report to this one."""
        self.inputs += other.inputs
        self.read += other.read
        self.refused += other.refused
        self.seconds += other.seconds
        self.slowest_s = max(self.slowest_s, other.slowest_s)
        self.peak_mib = max(self.peak_mib, other.peak_mib)
        for what, finding in other.findings.items():
            if what in self.findings:
                self.findings[what].count += finding.count
            else:
                self.findings[what] = finding

    @property
    def faults(self) -> int:
        """Inputs with which something went wrong."""
        return sum(finding.count for finding in self.findings.values())


@dataclass
class Seed:
    """Sound files from which inputs are made, in a folder of their own."""

    folder: Path
    main: str
    files: Mapping[str, bytes]
    spoilt: set[str] = field(
        default_factory=set
    )  # that are not as they should be on disk
    odd: set[str] = field(default_factory=set)  # where something else than a file is

    def put(self, files: Mapping[str, bytes | str]) -> None:
        """Write the difference from the seed; a text in place of bytes names them."""
        for name in self.spoilt - files.keys():
            self._write(name, self.files[name])
        self.spoilt = set(files)
        for name, content in files.items():
            self._write(name, content)

    def _write(self, name: str, content: bytes | str) -> None:
        path = self.folder / name
        if name in self.odd:
            self.odd.discard(name)
            _remove(path)
        if isinstance(content, bytes):
            with path.open("wb", buffering=0) as file:
                file.write(content)
            return
        _remove(path)
        self.odd.add(name)
        if content == "folder":
            path.mkdir()
        elif content == "pipe":
            os.mkfifo(path)
        elif content != "nothing":
            path.symlink_to(content)


SPECIAL = (
    "folder",
    "pipe",
    "nothing",
    "/dev/zero",
    "/dev/null",
    "/proc/self/mem",
    "nowhere",
    ".",
)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


class Reader:
    """One kind of file and its seeds, read in this process."""

    def __init__(self, kind: Kind, scratch: Path, seed: int) -> None:
        self.kind, self.seed = kind, seed
        self.seeds = list(_seeds(kind, scratch / kind.name))
        for one in self.seeds:
            self._warm(one)
        limit = _status("VmSize") + MOST_MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))

    def _warm(self, one: Seed) -> None:
        """Read a seed as it is, which must do; what is imported then is not counted."""
        with _quiet():
            found = self.kind.read(one.folder / one.main)
            if self.kind.use is not None:
                self.kind.use(found)

    def run(
        self, first: int, last: int, skip: frozenset[int], tell: Callable[[int], None]
    ) -> Report:
        """Read inputs by number; `tell` is called with each before it is read."""
        report = Report(self.kind.name)
        _forget_peak()
        before, begun = _status("VmRSS"), time.monotonic()
        with _quiet(), _guarded():
            for index in range(first, last):
                if index not in skip:
                    tell(index)
                    self._read(index, report)
        report.peak_mib = max(0.0, (_status("VmHWM") - before) / 2**20)
        report.seconds = time.monotonic() - begun
        return report

    def _read(self, index: int, report: Report) -> None:
        one, edits = self._input(index)
        files, _ = _edited(one, edits)
        report.inputs += 1
        before = time.process_time()
        error = self._try(one, files)
        spent = time.process_time() - before
        report.slowest_s = max(report.slowest_s, spent)
        if error is None:
            report.read += 1
        elif isinstance(error, InputError) and (what := _unfit(error)) is None:
            report.refused += 1
        else:
            what = _unfit(error) if isinstance(error, InputError) else _site(error)
            assert what is not None
            if what in report.findings:
                report.findings[what].count += 1
            else:
                report.findings[what] = self._minimal(index, one, edits, error, what)

    def _input(self, index: int) -> tuple[Seed, list[int]]:
        """The seed of an input and what its changes are drawn from."""
        random = Random(f"{self.seed} {self.kind.name} {index}")
        one = random.choice(self.seeds)
        return one, [random.getrandbits(48) for _ in range(random.choice(EDITS))]

    def _try(self, one: Seed, files: Mapping[str, bytes | str]) -> BaseException | None:
        """Read and use; the exception, if one is raised."""
        one.put(files)
        try:
            with _limited():
                found = self.kind.read(one.folder / one.main)
                if self.kind.use is not None:
                    self.kind.use(found)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # whatever it is, it is what is looked for
            return error
        return None

    def _minimal(
        self, index: int, one: Seed, edits: list[int], error: BaseException, what: str
    ) -> Finding:
        """The fault with as few changes as bring it about."""
        for edit in list(edits):
            fewer = [other for other in edits if other != edit]
            again = self._try(one, _edited(one, fewer)[0]) if fewer else None
            if again is not None and (_unfit(again) or _site(again)) == what:
                edits, error = fewer, again
        files, said = _edited(one, edits)
        whole = {name: files.get(name, content) for name, content in one.files.items()}
        kept = {
            name: content if isinstance(content, bytes) else content.encode()
            for name, content in whole.items()
        }
        trace = "".join(traceback.format_exception(error)[-12:])
        told = tuple(
            f"{name}: {one if isinstance(one, str) else one()}" for name, one in said
        )
        return Finding(self.kind.name, what, str(error)[:300], index, told, kept, trace)


def _seeds(kind: Kind, scratch: Path) -> Iterator[Seed]:
    """The seeds of a kind, each in a folder of its own."""
    source = CORPUS / kind.name
    if kind.prepare is not None:
        source = scratch / "prepared"
        source.mkdir(parents=True)
        kind.prepare(source)
    for entry in sorted(source.iterdir()):
        paths = (
            sorted(path for path in entry.rglob("*") if path.is_file())
            if entry.is_dir()
            else [entry]
        )
        base = entry if entry.is_dir() else entry.parent
        files = {str(path.relative_to(base)): path.read_bytes() for path in paths}
        folder = scratch / entry.stem
        for name, content in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        yield Seed(folder, kind.main if entry.is_dir() else entry.name, files)


def _edited(one: Seed, edits: list[int]) -> tuple[dict[str, bytes | str], list[Any]]:
    """The files that differ from the seed's after some changes, and what these are."""
    files: dict[str, bytes | str] = {}
    said: list[Any] = []
    names = [name for name in one.files if name != one.main]
    for edit in edits:
        random = Random(edit)
        name = random.choice(names) if names and random.random() < 0.45 else one.main
        content = files.get(name, one.files[name])
        if random.random() < SPECIAL_SHARE or isinstance(content, str):
            files[name] = special = random.choice(SPECIAL)
            said.append((name, f"{special} in its place"))
            continue
        changed, what = mutate(random, name, content)
        files[name] = changed
        said.append((name, what))
        if name != one.main and random.random() < KEPT_HASH:
            _mend(one, files, name, content, changed)
    return files, said


def _mend(
    one: Seed, files: dict[str, bytes | str], name: str, before: bytes, after: bytes
) -> None:
    """Put the hash of a changed file where that of the file before stands."""
    old, new = (
        hashlib.sha256(content).hexdigest().encode() for content in (before, after)
    )
    for other in one.files:
        text = files.get(other, one.files[other])
        if other != name and isinstance(text, bytes) and old in text:
            files[other] = text.replace(old, new)


def _site(error: BaseException) -> str:
    """Type of an exception and the place in the project that it came from."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [
        frame
        for frame in frames
        if any(f"/{package}/" in frame.filename for package in PACKAGES)
    ]
    frame = own[-1] if own else frames[-1]
    path = Path(frame.filename)
    name = next(
        (
            str(Path(*path.parts[k:]))
            for k, part in enumerate(path.parts)
            if part in PACKAGES
        ),
        path.name,
    )
    return f"{type(error).__name__} in {name}:{frame.lineno} {frame.name}"


def _unfit(error: BaseException) -> str | None:
    """Fault of a refusal: too long to be read, or not printable."""
    message = str(error)
    if not isinstance(error, InputError):
        return None
    if len(message) > LONGEST_MESSAGE:
        return f"message of more than {LONGEST_MESSAGE} characters: {_site(error)}"
    try:
        message.encode()
    except UnicodeEncodeError:
        return f"message that cannot be printed: {_site(error)}"
    return None


@contextmanager
def _quiet() -> Iterator[None]:
    """Warnings are errors: a reader refuses, or it reads."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", category=ImportWarning)
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        yield


@contextmanager
def _guarded() -> Iterator[None]:
    """Signals of both clocks raise `HangError`."""

    def stop(number: int, frame: Any) -> None:
        raise HangError(
            f"more than {LONGEST_S} s"
            if number == signal.SIGPROF
            else f"waits for {LONGEST_WAIT_S} s"
        )

    before = [
        (number, signal.signal(number, stop))
        for number in (signal.SIGPROF, signal.SIGALRM)
    ]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)


@contextmanager
def _limited() -> Iterator[None]:
    """Both clocks are set within the block."""
    signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
    signal.setitimer(signal.ITIMER_REAL, LONGEST_WAIT_S)
    try:
        yield
    finally:
        for clock in (signal.ITIMER_PROF, signal.ITIMER_REAL, signal.ITIMER_PROF):
            with suppress(HangError):  # of the other clock, at this moment
                signal.setitimer(clock, 0.0)


def _status(name: str) -> int:
    """A size of this process, bytes."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{name}:"):
            return 1024 * int(line.split()[1])
    return 0


def _forget_peak() -> None:
    """Let the peak of resident memory begin anew."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return
