"""Run tests in processes forked from one that has the libraries loaded, those that reach given lines first.

A map tells which tests of a file reach which lines, and how long each takes. It is made
once for each file of tests and kept until that file changes. It says what comes first;
what these do not notice, all are asked for.

Coverage does not see compiled functions. Lines of theirs are found by a second map,
made with `NUMBA_DISABLE_JIT=1`, in which slow tests are given up.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import json
import multiprocessing
import os
import resource
import signal
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import coverage
import pytest

PRELOADED = [
    "numpy",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
    "sklearn.svm",
    "sklearn.model_selection",
    "numba.core.registry",
    "gymnasium",
    "pydantic",
    "jinja2",
    "plotly.graph_objects",
    "pyarrow.parquet",
    "rich.console",
    "typer.testing",
    "control",
    "torch._dynamo",
    "stable_baselines3",
    "optuna.storages",
    "hypothesis.core",
    "hypothesis.strategies",
    "hypothesis.internal.conjecture.providers",
    "sklearn.utils.estimator_checks",
    "xdist.plugin",
]
PACKAGES = ("shipgym", "identification", "agents")
#: processor seconds: of a test in plain Python, of a file in plain Python; what a test
#: may take with a fault, beside ten times what it takes without, which compiles loops
#: anew
SLOW_S, SLOW_FILE_S, ALLOWED_S = 5.0, 60.0, 60.0
NOTICED, MISSED, TIME_LIMIT = "noticed", "missed", "time limit"


def processor_s() -> float:
    """Return the processor seconds of this process and of those that it has waited for."""
    used = (
        resource.getrusage(who)
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return sum(one.ru_utime + one.ru_stime for one in used)


@dataclass(eq=False)
class Recorder:
    """Plugin of pytest: the lines that each test reaches, its seconds, and the tests that fail."""

    folder: str
    limited: bool
    seconds: dict[str, float] = field(default_factory=dict)
    failed: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        source = [str(Path(self.folder) / package) for package in PACKAGES]
        self.coverage = coverage.Coverage(
            data_file=None, config_file=False, source=source, messages=False
        )
        self.coverage.set_option(
            "run:disable_warnings", ["module-not-imported", "no-data-collected"]
        )
        self.coverage.start()

    @pytest.hookimpl(hookwrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item):
        """Measure a test with its fixtures; give up one that is slow in plain Python."""
        began = processor_s()
        self.coverage.switch_context(item.nodeid)
        if self.limited:
            if began > SLOW_FILE_S:
                pytest.exit("slow", 0)
            signal.signal(
                signal.SIGPROF, lambda *_: pytest.fail("slow in plain Python")
            )
            signal.setitimer(signal.ITIMER_PROF, SLOW_S)
        yield
        signal.setitimer(signal.ITIMER_PROF, 0)
        self.coverage.switch_context("")
        self.seconds[item.nodeid] = round(processor_s() - began, 3)

    def pytest_runtest_logreport(self, report):
        """Remember what fails."""
        if report.failed:
            self.failed.append(report.nodeid)

    def written(self, path: Path) -> None:
        """Write the map, without tests that fail."""
        self.coverage.stop()
        data, tests = (
            self.coverage.get_data(),
            [t for t in self.seconds if t not in self.failed],
        )
        number = {test: k for k, test in enumerate(tests)}
        lines = {
            Path(file).relative_to(self.folder).as_posix(): {
                line: found
                for line, names in data.contexts_by_lineno(file).items()
                if (found := sorted(number[name] for name in names if name in number))
            }
            for file in data.measured_files()
        }
        kept = {
            "tests": {t: self.seconds[t] for t in tests},
            "failed": self.failed,
            "lines": lines,
        }
        draft = path.with_suffix(f".{os.getpid()}")
        draft.write_text(json.dumps(kept), "utf-8")
        draft.replace(path)


@dataclass(eq=False)  # pytest keeps plugins in sets
class Order:
    """Plugin of pytest: the tests that come first, or the only ones; ends tests that run on and on."""

    first: dict[str, float]  # and their seconds
    only: bool
    seconds: dict[str, float]  # of all that are known
    plain: bool = False  # whether in plain Python, where slow tests are given up

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        """Sort."""
        rank = {test: k for k, test in enumerate(self.first)}
        if self.only:
            items[:] = [item for item in items if item.nodeid in rank]
        items.sort(key=lambda item: rank.get(item.nodeid, len(rank)))

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self, nodeid):
        """End the process where a test runs on and on, in compiled code too."""
        if self.plain:
            if processor_s() > SLOW_FILE_S:
                pytest.exit("slow", 0)
            signal.signal(
                signal.SIGPROF, lambda *_: pytest.skip("slow in plain Python")
            )
            signal.setitimer(signal.ITIMER_PROF, SLOW_S)
            return
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(
            signal.ITIMER_PROF, ALLOWED_S + 10 * self.seconds.get(nodeid, 0.0)
        )


def _run(
    folder: str, tests: list[str], log: str, plain: bool, plugin: Order | str
) -> None:
    """Run tests in a copy of the tree, in a process of its own; its exit code is pytest's."""
    os.setsid()
    os.chdir(folder)
    sys.path[:0] = [folder]
    os.environ["PYTHONPATH"] = folder
    sys.dont_write_bytecode = False  # a module with a fault has a time of its own
    gc.freeze()  # pytest collects what tests leave, not what the libraries are
    with Path(log).open("w") as stream:
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
    if plain:
        import numba

        os.environ["NUMBA_DISABLE_JIT"] = "1"
        numba.config.DISABLE_JIT = True
    asked = ["-q", "-p", "no:cacheprovider", "--tb=line", "-rfE", *tests]
    asked += [
        "-W",
        "ignore::pytest.PytestAssertRewriteWarning",
    ]  # plugins that are preloaded
    if isinstance(plugin, Order):
        os._exit(int(pytest.main(["-x", *asked], plugins=[plugin])))
    recorder = Recorder(folder, plain)
    code = int(pytest.main(asked, plugins=[recorder]))
    recorder.written(Path(plugin))
    os._exit(code)


@dataclass(frozen=True)
class Result:
    """Whether tests noticed a fault, and the report of the first that did."""

    outcome: str
    report: str = ""

    @property
    def test(self) -> str:
        """The test that noticed."""
        return self.report.partition(" ")[2].partition(" - ")[0]


def run(
    folder: Path,
    tests: list[str],
    limit_s: float,
    plugin: Order | str,
    plain: bool = False,
) -> Result:
    """Run files of tests in a copy of the tree."""
    log = folder.parent / f"{folder.name}.log"
    process = multiprocessing.get_context("forkserver").Process(
        target=_run, args=(str(folder), tests, str(log), plain, plugin)
    )
    process.start()
    process.join(limit_s)
    late = process.is_alive()
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid or 0, signal.SIGKILL)
    process.join()
    if late or process.exitcode == -signal.SIGPROF:
        return Result(TIME_LIMIT)
    lines = log.read_text("utf-8", "replace").splitlines()
    report = next(
        (line for line in lines if line.startswith(("FAILED", "ERROR", "ImportError"))),
        "",
    )
    if (
        process.exitcode not in (0, pytest.ExitCode.NO_TESTS_COLLECTED)
        and not report
        and process.exitcode > 0
    ):
        raise RuntimeError("\n".join(["pytest itself failed:", *lines[-20:]]))
    return Result(
        (
            MISSED
            if process.exitcode in (0, pytest.ExitCode.NO_TESTS_COLLECTED)
            else NOTICED
        ),
        report[:160],
    )


@dataclass
class Maps:
    """The maps of the files of tests, made where they are missing if they are to be."""

    kept: Path
    made: bool = True
    limit_s: float = 3600.0

    def read(self, folder: Path, test: str, plain: bool) -> dict[str, Any]:
        """Return the map of one file; ends where tests fail without any fault, for they would notice each."""
        digest = hashlib.sha256((folder / test).read_bytes()).hexdigest()[:12]
        path = (
            self.kept
            / f"{Path(test).parent.name}-{Path(test).stem}-{digest}{'-plain' * plain}.json"
        )
        if not path.is_file():
            if not self.made:
                return {"tests": {}, "failed": [], "lines": {}}
            self.kept.mkdir(parents=True, exist_ok=True)
            run(folder, [test], self.limit_s, str(path), plain)
        found = json.loads(path.read_text("utf-8"))
        if found["failed"] and not plain:
            raise SystemExit(
                f"without any fault these fail: {', '.join(found['failed'])}"
            )
        return dict(found)

    def ordered(
        self, folder: Path, tests: list[str], module: str, lines: range, plain: bool
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Return the tests that reach lines of a module with their seconds, in order, and the seconds of all.

        The tests of a file stay together, for they share fixtures; files with the least
        to run come first.
        """
        groups, seconds = [], {}
        for test in tests:
            found = self.read(folder, test, plain)
            names = list(found["tests"])
            seconds.update(found["tests"])
            of_module = found["lines"].get(module, {})
            reaching = {k for line in lines for k in of_module.get(str(line), ())}
            groups.append(sorted((seconds[names[k]], names[k]) for k in reaching))
        groups.sort(key=lambda group: sum(took for took, _ in group))
        return {test: took for group in groups for took, test in group}, seconds


def noticed(
    maps: Maps,
    folder: Path,
    tests: list[str],
    module: str,
    lines: range,
    limit_s: float,
) -> Any:
    """Prepare in a copy without a fault, and return the function that runs the tests once the fault is in it.

    Where no test reaches the fault, compiled code may have it: then the tests that
    reach it (or all, without a map) run in plain Python first, and the one that notices
    runs compiled, as it does without `mutate.py`. If it notices still, that is it; if
    not, all run.
    """
    first, seconds = maps.ordered(folder, tests, module, lines, plain=False)
    plain: dict[str, float] = {}
    if not first:
        plain, _ = maps.ordered(folder, tests, module, lines, plain=True)

    def result() -> Result:
        if not first and (plain or not maps.made):
            order = Order(plain, bool(plain), seconds, plain=True)
            quick = run(folder, tests, limit_s, order, plain=True)
            if quick.outcome == NOTICED and "::" in quick.test:
                again = run(
                    folder,
                    [quick.test],
                    limit_s,
                    Order({quick.test: 0.0}, True, seconds),
                )
                if (
                    again.outcome != MISSED and "not found" not in again.report
                ):  # its name was cut
                    return again
        return run(folder, tests, limit_s, Order(first or plain, False, seconds))

    return result
