"""Golden results: numbers recorded once, compared after each change of the code.

    python tests/golden/record.py             # write tests/golden/results/SECTION.npz
    python tests/golden/record.py --compare   # exit code 1 beyond the tolerance
    python tests/golden/record.py --compare --only environments --only demo --worst 20

Only public names are used, so that it runs whatever modules are called inside.
Deviations are differences over the largest number of the same quantity. What each
section holds is told in its module.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from tests.golden import (  # noqa: E402 - the folder above has to be found first
    chains,
    environments,
    ships,
    voyages,
)
from tests.golden.store import (  # noqa: E402
    Deviation,
    Floats,
    Values,
    compare,
    load,
    save,
)

RESULTS = Path(__file__).parent / "results"


@dataclass(frozen=True)
class Section:
    """One part of the golden results.

    Attributes
    ----------
    cases : callable
        A mapping whose keys are the names of its cases.
    record : callable
        From a case's name, and the number of steps where a case has one, to its values.
    tolerances : mapping of str to float
        See `store.compare`.
    """

    cases: Callable[[], Iterable[str]]
    record: Callable[..., dict[str, Floats]]
    tolerances: Mapping[str, float]


SECTIONS = {
    "environments": Section(
        environments.cases, environments.record, environments.TOLERANCES
    ),
    "voyages": Section(voyages.cases, voyages.record, environments.TOLERANCES),
    "derivatives": Section(ships.all_ships, ships.record_derivatives, {"": 1e-9}),
    "manoeuvres": Section(ships.shipped, ships.record_manoeuvres, {"": 1e-9}),
    "identification": Section(
        lambda: chains.METHODS, chains.record_identification, chains.TOLERANCES
    ),
    "demo": Section(lambda: ["mariner"], chains.record_demo, {"": 1e-6}),
}


def recorded(
    section: str, case: str, stored: Mapping[str, Floats] | None
) -> dict[str, Floats]:
    """The values of a case, over as many steps as stored ones have."""
    record = SECTIONS[section].record
    if stored is not None and "steps" in stored:
        return record(case, int(stored["steps"][0]))
    return record(case)


def run_section(
    section: str, stored: Values | None, pool: ProcessPoolExecutor | None = None
) -> Values:
    """The values of all cases of a section, each in one of the pool's processes."""
    cases = list(SECTIONS[section].cases())
    if stored is not None:
        cases = [case for case in cases if case in stored]
    work = [[section] * len(cases), cases, [(stored or {}).get(case) for case in cases]]
    found = map(recorded, *work) if pool is None else pool.map(recorded, *work)
    return dict(zip(cases, found, strict=True))


def compared(section: str, stored: Values, found: Values) -> list[Deviation]:
    """Deviations of a section, the worst first."""
    return compare(stored, found, SECTIONS[section].tolerances)


def beyond_tolerance(section: str, case: str) -> list[Deviation]:
    """Compute one case anew; the quantities that are not what they were."""
    stored = {case: load(RESULTS / f"{section}.npz")[case]}
    deviations = compared(
        section, stored, {case: recorded(section, case, stored[case])}
    )
    return [one for one in deviations if one.excess > 1.0]


def main(words: list[str] | None = None) -> int:
    """Record or compare; the exit code."""
    given = _arguments(words)
    failed = False
    with ProcessPoolExecutor(given.workers, mp_context=get_context("spawn")) as pool:
        for section in given.only or SECTIONS:
            started, path = time.monotonic(), given.out / f"{section}.npz"
            stored = load(path) if given.compare else None
            found = run_section(section, stored, pool)
            seconds = time.monotonic() - started
            if stored is None:
                given.out.mkdir(parents=True, exist_ok=True)
                save(found, path)
                print(
                    f"{section:15} {len(found):3} cases,"
                    f" {path.stat().st_size / 1000:.0f} kB, {seconds:.0f} s"
                )
            else:
                failed |= _report(
                    section, compared(section, stored, found), seconds, given.worst
                )
            sys.stdout.flush()
    return int(failed)


def _report(
    section: str, deviations: list[Deviation], seconds: float, worst: int
) -> bool:
    """Print what was found; whether anything is beyond its tolerance."""
    beyond = [one for one in deviations if one.excess > 1.0]
    largest = max(one.size for one in deviations)
    verdict = (
        f"{len(beyond)} of {len(deviations)} beyond the tolerance"
        if beyond
        else "passed"
    )
    print(f"{section:15} largest deviation {largest:.1e}, {verdict}, {seconds:.0f} s")
    for one in deviations[: worst if beyond or worst > 5 else 1]:
        print(f"    {one.size:.1e} of {one.tolerance:.0e} allowed   {one.where}")
    return bool(beyond)


def _arguments(words: list[str] | None) -> Any:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument(
        "--compare",
        action="store_true",
        help="compare with what is stored, write nothing",
    )
    parser.add_argument(
        "--only",
        action="append",
        choices=list(SECTIONS),
        metavar="SECTION",
        help="one section",
    )
    parser.add_argument(
        "--out", type=Path, default=RESULTS, help="folder of the stored results"
    )
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--worst", type=int, default=5, help="deviations that are told")
    return parser.parse_args(words)


if __name__ == "__main__":
    sys.exit(main())
