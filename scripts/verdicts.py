"""How often verdicts on criteria are wrong, and whether the trial named decides.

    python scripts/verdicts.py [--rows verdicts.jsonl] [--ships kcs,ferry]

prints the table of "Verdicts on ships of other equations" in docs/certainty.md. Ships
of tests/ships are put through some zigzags and turns with the noise of sensors, to one
side or to both, and identified by a structure that is not theirs. Every criterion of
IMO MSC.137(76) is judged against limits at 85 to 115 % of the ship's own index on her
worse side, so that most verdicts are close. One is wrong if it is given with more than
95 % certainty and the ship, without noise, is on the other side. Where nothing is
decided and one trial is named, the ship is put through that trial, and what it measures
is added.

Rows are kept in a file; a second call does what is left.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from certainty import fitted, ship_names, ship_of
from kept_rows import KeptRows

from shipgym import ShipModel, Trial
from shipgym.manoeuvres import Criterion, turning_circle, zigzag
from shipgym.manoeuvres.imo import imo_assessment
from shipgym.manoeuvres.turning import full_rudder_deg
from shipgym.manoeuvres.verdicts import judged, with_measured
from shipgym.trials.sensors import Sensors
from tests.ships.opened_once import OPENED_ONCE

SHIPS = (
    "kcs",
    "seiun-maru",
    "ferry",
    "product-tanker",
    "training-vessel",
    "stable-heavy",
    "lively-light",
    *OPENED_ONCE,
)
#: Trials by name: zigzags of an angle and turns, each with the side.
SETS = {
    "zigzags 20/20": ("20 starboard", "20 port"),
    "zigzags to starboard": ("10 starboard", "20 starboard"),
    "zigzags and turn": ("10 port", "20 starboard", "20 port", "turn starboard"),
    "zigzags and turns": (
        "10 starboard",
        "10 port",
        "20 starboard",
        "20 port",
        "turn starboard",
        "turn port",
    ),
}
LIMITS = (0.85, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.15)
STRUCTURE = "cubic"
DRAWS = 60


def run_of(ship: ShipModel, name: str, seed: int) -> Trial:
    """A trial of a ship as sensors log it."""
    travel = ship.travel_time
    dt = min(0.25, travel / 80.0)
    what, side = name.split()
    to_port = side == "port"
    if what == "turn":
        angle = full_rudder_deg(ship)
        rudder_deg = -angle if to_port else angle
        run = turning_circle(ship, rudder_deg, 25.0 * travel, dt)
    else:
        angle = float(what)
        run = zigzag(ship, angle, angle, to_port, 35.0 * travel, dt)
    if "n" not in run:
        run = run.with_channels({"n": np.ones(len(run))})
    sensors = Sensors(sampling_s=max(min(1.0, travel / 20.0), dt))
    return sensors.measure(run.with_(name=name), seed)


def named(criterion: Criterion) -> str | None:
    """The one trial that would decide, as `run_of` knows it; None for none or two."""
    if len(criterion.deciding_trials) != 1:
        return None
    (trial,) = criterion.deciding_trials
    side = "port" if "port" in trial else "starboard"
    if "turn" in trial:
        return f"turn {side}"
    angle, _, _ = trial.partition("/")
    return f"{angle} {side}"


def case(name: str, kind: str, seed: int) -> dict[str, Any]:
    """Verdicts on one ship from one set of trials."""
    ship = ship_of(name)
    row: dict[str, Any] = {"ship": name, "trials": kind, "seed": seed}
    trials = [run_of(ship, trial, 100 * seed + k) for k, trial in enumerate(SETS[kind])]
    result = fitted(ship, STRUCTURE, trials)
    if not result.stable:
        return row | {"unstable": True, "verdicts": []}
    truth = imo_assessment(ship, 0)
    by_model = imo_assessment(result.model, DRAWS)
    found = with_measured(by_model, result.model, trials)

    extra: dict[str, Trial] = {}
    verdicts = []
    for key, criterion in found.items():
        own = truth[key].value
        if key == "stopping" or own is None:
            continue
        for share in LIMITS:
            one = judged(replace(criterion, limit=share * own))
            about = {"index": key, "limit": share, "certainty": one.certainty}
            about |= {"passed": one.passed, "by": one.decided_by}
            about["named"] = len(one.deciding_trials)
            trial = named(one)
            if trial is not None:
                if trial not in extra:
                    extra[trial] = run_of(ship, trial, 100 * seed + 50)
                after = with_measured({key: one}, result.model, [extra[trial]])
                about["decides"] = after[key].decided
                about["then"] = after[key].passed
            verdicts.append(about)
    return row | {"verdicts": verdicts}


def counted(rows: Sequence[Mapping[str, Any]]) -> Counter[str]:
    """Counts of verdicts, wrong ones, and of the trials that are named."""
    counts: Counter[str] = Counter()
    for row in rows:
        for one in row["verdicts"]:
            counts["all"] += 1
            meets = one["limit"] >= 1.0
            certainty = one["certainty"]
            if certainty is not None:
                counts["decided"] += 1
                is_wrong = certainty > 0.95 and one["passed"] != meets
                counts["wrong"] += is_wrong
                if is_wrong:
                    print(row["ship"], row["trials"], one, file=sys.stderr)
                continue
            counts[f"named {min(one['named'], 2)}"] += 1
            if "decides" in one:
                counts["decides"] += one["decides"]
                counts["wrong then"] += one["decides"] and one["then"] != meets
    return counts


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Counts by set of trials and of all, in Markdown."""
    lines = [
        (
            "| trials | verdicts | decided | wrong | not decided: one trial named, a"
            " pair, none | the named trial decides, % | wrong then |"
        ),
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    groups = {kind: [row for row in rows if row["trials"] == kind] for kind in SETS}
    for name, group in {**groups, "**all**": list(rows)}.items():
        n = counted(group)
        share = "-"
        if n["named 1"]:
            share = f"{100.0 * n['decides'] / n['named 1']:.0f}"
        lines.append(
            f"| {name} | {n['all']} | {n['decided']} | {n['wrong']} |"
            f" {n['named 1']}, {n['named 2']}, {n['named 0']} | {share} |"
            f" {n['wrong then']} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Do the cases that are left, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--rows", type=Path, default=Path("verdicts.jsonl"))
    parser.add_argument("--seeds", type=int, default=1, help="of the noise")
    parser.add_argument("--ships", type=ship_names, default=",".join(SHIPS))
    given = parser.parse_args()
    warnings.simplefilter("ignore")

    kept = KeptRows(given.rows, ("ship", "trials", "seed"))
    cases = itertools.product(range(given.seeds), given.ships, SETS)
    for seed, name, kind in cases:
        if (name, kind, seed) not in kept:
            kept.add(case(name, kind, seed))
    print(table(kept.rows))


if __name__ == "__main__":
    main()
