"""Which autopilots are given, and which of them steer, on ships of other equations.

    python scripts/given_autopilots.py [--rows given.jsonl] [--ships kcs,ferry]

prints the table of "Designs in closed loop" in docs/certainty.md. Each ship of
tests/ships is put through zigzags 10/10 and 20/20 to both sides with the noise of
sensors, identified by a structure, and given the autopilots of `shipgym autopilot`,
judged on 60 models drawn. What was designed, given or not, then steers the ship
herself: one that keeps a heading steers if it keeps control in 8 episodes of course
keeping in calm water, one that keeps a track if it leads her to its end.

A second kind of trials is poor on purpose: one zigzag 10/10 of fifteen ship lengths
with five times the noise, from which not every design steers.

Rows are kept in a file; a second call does what is left.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from certainty import sea_trials, ship_names, ship_of
from kept_rows import KeptRows
from opened_once import steered
from verdicts import SHIPS as OF_VERDICTS

from agents.verification.chain import examined
from agents.verification.verify import DESIGNS, design_autopilots, verify
from identification import IdentificationResult, identify
from identification.judging.selection import RESPONSES, whole_trials
from shipgym import ShipModel, Trial
from shipgym.errors import InputError

SHIPS = (*OF_VERDICTS, "tanker")
STRUCTURES = ("nomoto", "abkowitz", "cubic", "mmg", "auto")
KINDS = ("zigzags", "one poor zigzag")
DRAWS = 60


def poor_zigzag(ship: ShipModel, seed: int) -> list[Trial]:
    """A short zigzag with five times the noise of sensors."""
    trial, *_ = sea_trials(ship, "zigzags", seed)
    rng = np.random.default_rng(seed)
    noise = {
        "psi": np.radians(0.5),
        "r": np.radians(0.1),
        "u": 0.15,
        "v": 0.1,
    }
    kept = trial.t <= trial.t[0] + 15.0 * ship.travel_time
    channels = {}
    for name, values in trial.channels.items():
        size = noise.get(name, 0.0)
        channels[name] = (values + size * rng.standard_normal(len(trial)))[kept]
    return [Trial(trial.t[kept], channels, name=trial.name, kind=trial.kind)]


def identified(
    ship: ShipModel, structure: str, kind: str, seed: int
) -> IdentificationResult:
    """A ship identified from noisy zigzags, as `shipgym autopilot` does it."""
    trials = (
        sea_trials(ship, kind, seed) if kind == KINDS[0] else poor_zigzag(ship, seed)
    )
    settings: dict[str, Any] = {"structure": structure}
    if structure in RESPONSES:
        settings["method"] = whole_trials()
    return identify(
        trials,
        particulars=ship.particulars,
        steering=ship.steering,
        **settings,
    )


def examined_case(name: str, structure: str, kind: str, seed: int) -> dict[str, Any]:
    """Which designs are given for one ship, and which of all steer her."""
    ship = ship_of(name)
    row: dict[str, Any] = {"ship": name, "structure": structure}
    row |= {"trials": kind, "seed": seed}
    try:
        fit = identified(ship, structure, kind, seed)
    except InputError as error:
        return row | {"failed": str(error)}
    began = time.process_time()
    result = examined(
        None, fit, [], lambda: verify(fit.model, DRAWS, 0, trials=fit.trials)
    )
    row["seconds"] = time.process_time() - began
    row["chosen"] = fit.model.structure
    row["why"] = result.refusal or result.instability

    found = result.verification
    if found is not None:
        designs = [pilot.controller for pilot in found.pilots]
        designs += [track.controller for track in found.tracks]
        row["refused"] = found.refused
        row["retuned"] = getattr(found, "retuned", {})
    else:
        designs = designed(fit.model)
        row["refused"] = {design.kind: row["why"] for design in designs}
    return row | {"fates": steered(designs, ship)}


def designed(model: ShipModel) -> list[Any]:
    """Designs on a model that is refused as a whole."""
    try:
        found = design_autopilots(model, DESIGNS)
    except InputError:
        return []
    return [*found.controllers, *found.guides]


def counted(rows: Sequence[Mapping[str, Any]]) -> Counter[str]:
    """Designs by whether they steer and whether they are given."""
    counts: Counter[str] = Counter()
    for row in rows:
        counts["ships"] += 1
        given = 0
        for kind, fate in row.get("fates", {}).items():
            does = "lost" if fate == "LOST" else "steer"
            is_refused = kind in row["refused"]
            counts[f"{does} {'refused' if is_refused else 'given'}"] += 1
            given += not is_refused
        counts["retuned"] += len(row.get("retuned", {}))
        counts["ships with one"] += given > 0
    return counts


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Counts by structure and of all, in Markdown."""
    lines = [
        (
            "| structure, trials | ships with an autopilot | given: steer, lost |"
            " refused: would steer, would not | retuned |"
        ),
        "| --- | --- | --- | --- | --- |",
    ]
    groups = {}
    for kind in KINDS:
        for structure in STRUCTURES:
            groups[f"`{structure}`, {kind}"] = [
                row
                for row in rows
                if (row["structure"], row["trials"]) == (structure, kind)
            ]
    for name, group in {**groups, "**all**": rows}.items():
        n = counted(group)
        if not group:
            continue
        lines.append(
            f"| {name} | {n['ships with one']} of {n['ships']} |"
            f" {n['steer given']}, {n['lost given']} |"
            f" {n['steer refused']}, {n['lost refused']} | {n['retuned']} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Do the cases that are left, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--rows", type=Path, default=Path("given_autopilots.jsonl"))
    parser.add_argument("--seeds", type=int, default=1, help="of the noise")
    parser.add_argument("--ships", type=ship_names, default=",".join(SHIPS))
    parser.add_argument("--trials", default=",".join(KINDS))
    parser.add_argument("--structures", default=",".join(STRUCTURES))
    given = parser.parse_args()
    warnings.simplefilter("ignore")

    kept = KeptRows(given.rows, ("ship", "structure", "trials", "seed"))
    cases = itertools.product(
        given.trials.split(","),
        given.structures.split(","),
        given.ships,
        range(given.seeds),
    )
    for kind, structure, name, seed in cases:
        if (name, structure, kind, seed) in kept:
            continue
        row = examined_case(name, structure, kind, seed)
        kept.add(row)
        print(row, file=sys.stderr, flush=True)
    print(table(kept.rows))


if __name__ == "__main__":
    main()
