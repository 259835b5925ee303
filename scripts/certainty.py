"""Coverage of the 95 % intervals of standard indices, on ships of other equations.

    python scripts/certainty.py [--seeds 3] [--draws 40] [--ships kcs,tanker]

prints the tables of docs/certainty.md. Ships that it knows besides: `--ships
stable-light,stable-heavy, lively-light,lively-heavy` (tests/ships/square_drag.py) and
`--ships ferry,product-tanker,training-vessel` (tests/ships/inoue.py).

Every reference ship, and two ships by the MMG standard method (tests/ships/mmg.py), is
put through sea trials with the noise of sensors: zigzags 10/10 and 20/20 to both sides,
without turns, with a 35 degree turn to starboard, and with one to each side. She is
identified by structures that are not hers. The indices of models drawn are compared
with her own: advance and tactical diameter to both sides, overshoots and initial
turning of the zigzags; and those of manoeuvres that are not among the trials, turns
with 20 degrees and zigzags 15/15 besides.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from joblib import Parallel, delayed

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

import shipgym  # noqa: E402 - the folder above has to be found first
from identification import IdentificationResult, identify  # noqa: E402
from identification.judging.model_error import DEFAULT  # noqa: E402
from shipgym import ShipModel, Trial  # noqa: E402
from shipgym.errors import InputError  # noqa: E402
from shipgym.manoeuvres import (  # noqa: E402
    Manoeuvre,
    TurningIndices,
    ZigzagIndices,
    turning_circle,
    turning_indices,
    zigzag,
    zigzag_indices,
)
from shipgym.manoeuvres.imo_rules import imo_manoeuvres  # noqa: E402
from shipgym.manoeuvres.intervals import (  # noqa: E402
    IndexInterval,
    attempt,
    intervals_of,
    own_indices,
)
from shipgym.manoeuvres.registry import standard_time  # noqa: E402
from shipgym.trials.sensors import Sensors  # noqa: E402
from tests.ships.foreign import FOREIGN  # noqa: E402
from tests.ships.mmg import MMG_SHIPS  # noqa: E402

Value = TypeVar("Value")
Key = dict[tuple[str, str], Value]  # by manoeuvre and name of the index

SHIPS = ("mariner", "container", "tanker", "kvlcc2", *MMG_SHIPS)
STRUCTURES = ("abkowitz", "cubic")
OTHER = "other "  # begins the names of manoeuvres that are not among the standard ones
OWN = {"mariner": "abkowitz"}  # the structure that a ship is made of
TRIALS = ("zigzags", "zigzags and turn", "zigzags and turns")
TURNS = (
    ("starboard", 35.0),
    ("port", -35.0),
)  # none, the first or both of them are sailed
INDICES = (
    "advance_lengths",
    "tactical_diameter_lengths",
    "overshoot_1_deg",
    "overshoot_2_deg",
    "initial_turning_lengths",
)


def ship_of(name: str) -> ShipModel:
    """A ship by name, the truth behind the trials."""
    return FOREIGN[name]() if name in FOREIGN else shipgym.load_model(name)


def ship_names(text: str) -> list[str]:
    """Names of ships, separated by commas, as an argument; exit code 2 for unknown."""
    names = text.split(",")
    for name in names:
        try:
            ship_of(name)
        except InputError as error:
            foreign = ", ".join(FOREIGN)
            raise argparse.ArgumentTypeError(f"{error}; or of {foreign}") from None
    return names


def sea_trials(ship: ShipModel, kind: str, seed: int) -> list[Trial]:
    """Her trials as sensors log them; a ship without a shaft logs a steady one."""
    travel = ship.particulars["length"] / ship.particulars["speed"]
    dt = min(0.25, travel / 80.0)
    runs = [
        zigzag(ship, angle, angle, port, 35.0 * travel, dt).with_(
            name=f"{angle:.0f} {'port' if port else 'starboard'}"
        )
        for angle in (10.0, 20.0)
        for port in (False, True)
    ]
    for side, angle in TURNS[: TRIALS.index(kind)]:
        runs.append(
            turning_circle(ship, angle, 25.0 * travel, dt).with_(name=f"turn to {side}")
        )
    sensors = Sensors(sampling_s=max(min(1.0, travel / 20.0), dt))
    steady = np.full(len(runs[0].t), 1.0)
    return [
        sensors.measure(
            (
                run
                if "n" in run
                else Trial(
                    run.t,
                    {**run.channels, "n": np.resize(steady, len(run.t))},
                    name=run.name,
                    kind=run.kind,
                )
            ),
            100 * seed + k,
        )
        for k, run in enumerate(runs)
    ]


def compared(ship: ShipModel) -> dict[str, Manoeuvre]:
    """Manoeuvres of the comparison: the standard ones and others of the envelope."""
    duration, dt = standard_time(ship)
    turn, weave = (
        partial(turning_circle, duration=duration, dt=dt),
        partial(zigzag, duration=duration, dt=dt),
    )
    others = {
        f"{OTHER}turning circle to {side}": Manoeuvre(
            partial(turn, rudder_deg=np.sign(angle) * 20.0),
            turning_indices,
            TurningIndices,
        )
        for side, angle in TURNS
    } | {
        f"{OTHER}zigzag, {side} first": Manoeuvre(
            partial(
                weave,
                rudder_deg=15.0,
                heading_deg=15.0,
                port_first=angle < 0.0,
                must_reverse=False,
            ),
            zigzag_indices,
            ZigzagIndices,
        )
        for side, angle in TURNS
    }
    return {
        name: one for name, one in imo_manoeuvres(ship).items() if "stop" not in name
    } | others


def was_sailed(manoeuvre: str, kind: str) -> bool:
    """Whether a manoeuvre is one of the trials of a kind."""
    turns = tuple(f"to {side}" for side, _ in TURNS[: TRIALS.index(kind)])
    return not manoeuvre.startswith(OTHER) and (
        manoeuvre.startswith("zigzag") or manoeuvre.endswith(turns)
    )


def true_indices(ship: ShipModel) -> Key[float]:
    """Indices of a ship, by manoeuvre and name."""
    found = {run: attempt(one.evaluate, ship)[0] for run, one in compared(ship).items()}
    return {
        (run, name): indices[name]
        for run, indices in found.items()
        for name in INDICES
        if name in indices
    }


def index_intervals(model: ShipModel, draws: int, seed: int = 1) -> Key[IndexInterval]:
    """The same indices of a model, with intervals over draws from its covariance."""
    tests = compared(model)
    found = intervals_of(
        own_indices(model, tests),
        model.sample(draws, seed),
        {run: one.evaluate for run, one in tests.items()},
    )
    return {
        (run, name): one
        for run, indices in found.items()
        for name, one in indices.items()
        if name in INDICES
    }


def holds(found: Key[IndexInterval], truth: Key[float]) -> Key[bool]:
    """Whether each interval holds the truth."""
    return {
        key: (
            one.interval is not None
            and one.interval[0] <= truth[key]
            and (one.interval[1] is None or truth[key] <= one.interval[1])
        )
        for key, one in found.items()
    }


def fitted(
    ship: ShipModel, structure: str, trials: list[Trial]
) -> IdentificationResult:
    """A ship identified by a structure, or `grey-box:SHIP`: RM-SVM on that ship."""
    table, _, reference = structure.partition(":")
    grey = {"reference_model": reference, "method": "rm-svm"} if reference else {}
    return identify(
        trials, table, particulars=ship.particulars, steering=ship.steering, **grey
    )


def without_fitted(error: dict[str, object]) -> float:
    """The factor of a model if errors on the fitted trials did not count."""
    if "fitted" not in error:
        return float(error["factor"])
    sizes = [error[name] for name in ("motion", "indices") if name in error]
    return (
        max(1.0, error["for_few_trials"] * np.sqrt(np.mean(np.square(sizes))))
        if sizes
        else DEFAULT
    )


def coverage(ship: ShipModel, model: ShipModel, draws: int) -> dict[str, object]:
    """Flags of intervals that hold a ship's indices.

    By noise, by trials left out, and by all.
    """
    error = model.provenance["model_error"]
    row: dict[str, object] = {"factor": (factor := error["factor"])}
    truth = true_indices(ship)
    for label, size in (
        ("noise", factor**-2),
        ("left out", (without_fitted(error) / factor) ** 2),
        ("all", 1.0),
    ):
        found = index_intervals(
            replace(model, covariance=size * model.covariance), draws
        )
        row[label] = holds(found, truth)
        row[f"{label} ran away"] = float(
            np.mean([one.ran_away.mean() for one in found.values()])
        )
        widths = [
            np.ptp(one.interval) / 2.0 / truth[key]
            for key, one in found.items()
            if one.interval and one.interval[1] is not None
        ]
        row[f"{label} width"] = float(np.median(widths))
    return row


def case(
    name: str, structure: str, kind: str, seed: int, draws: int
) -> dict[str, object]:
    """Coverage of one case without and with model error, as lists of flags."""
    warnings.simplefilter("ignore")
    ship = ship_of(name)
    result = fitted(ship, structure, sea_trials(ship, kind, seed))
    row: dict[str, object] = {
        "ship": name,
        "structure": structure,
        "trials": kind,
        "seed": seed,
    }
    return row | (
        coverage(ship, result.model, draws) if result.stable else {"unstable": True}
    )


def share(rows: Sequence[dict[str, object]], label: str, part: str = "") -> str:
    """Per cent of the intervals that hold the truth, of manoeuvres with such a name."""
    held = [
        one
        for row in rows
        for (run, _), one in row[label].items()
        if run.startswith(part) and not run.startswith(OTHER)
    ]
    return f"{100.0 * np.mean(held):.0f}" if held else "-"


def share_not_sailed(rows: Sequence[dict[str, object]], label: str) -> str:
    """Per cent likewise, of the manoeuvres that are not among the trials."""
    held = [
        one
        for row in rows
        for (run, _), one in row[label].items()
        if not was_sailed(run, row["trials"])
    ]
    return f"{100.0 * np.mean(held):.0f}"


def table(rows: Sequence[dict[str, object]]) -> str:
    """The table, in Markdown: a row for each ship and trials, and one for all."""
    groups = {
        f"{ship}, {kind}": [r for r in rows if (r["ship"], r["trials"]) == (ship, kind)]
        for ship in dict.fromkeys(row["ship"] for row in rows)
        for kind in TRIALS
    }
    for kind in TRIALS:
        groups[f"**all, {kind}**"] = [row for row in rows if row["trials"] == kind]
    groups["**all**"] = list(rows)
    lines = [
        (
            "| ship, trials | factor | noise only, % | with model error, % | of which"
            " zigzags, turns, % | not sailed (by trials left out alone), % |"
            " half-width, % | draws that run away, % |"
        ),
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, group in groups.items():
        known = [row for row in group if "factor" in row]
        if not known:
            continue
        factors = [float(row["factor"]) for row in known]
        width, lost = (
            100.0 * np.mean([row[f"all {one}"] for row in known])
            for one in ("width", "ran away")
        )
        unstable = (
            f" ({len(group) - len(known)} of {len(group)} unstable)"
            if len(known) < len(group)
            else ""
        )
        lines.append(
            f"| {name}{unstable} | {min(factors):.1f} to {max(factors):.1f} |"
            f" {share(known, 'noise')} | {share(known, 'all')} |"
            f" {share(known, 'all', 'zigzag')}, {share(known, 'all', 'turning')} |"
            f" {share_not_sailed(known, 'all')} ({share_not_sailed(known, 'left out')})"
            f" | {width:.0f} | {lost:.0f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run all cases and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=3, help="of the noise")
    parser.add_argument("--draws", type=int, default=40, help="models drawn")
    parser.add_argument("--ships", default=",".join(SHIPS), help="with commas between")
    parser.add_argument(
        "--structures",
        default=",".join(STRUCTURES),
        help="grey-box:SHIP is RM-SVM on a reference ship",
    )
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    cases = [
        (ship, structure, kind, seed, given.draws)
        for ship in given.ships.split(",")
        for structure in given.structures.split(",")
        if OWN.get(ship) != structure
        for kind in TRIALS
        for seed in range(given.seeds)
    ]
    rows = Parallel(n_jobs=given.workers, verbose=5)(
        delayed(case)(*one) for one in cases
    )
    print(table(rows))


if __name__ == "__main__":
    main()
