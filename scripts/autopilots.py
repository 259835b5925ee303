"""Which autopilots are given, and what they do on ships of other equations.

    python scripts/autopilots.py [--rows autopilots.jsonl] [--ships kcs,bulk-carrier]

prints the tables of "On ships that nobody designed for" in docs/controllers.md. Each
ship of tests/ships is put through zigzags 10/10 and 20/20 to both sides with the noise
of sensors, identified, and given the autopilots of `shipgym autopilot`, judged on 60
models drawn. What was designed, given or not, then steers the ship herself: a course
autopilot steers if it keeps control in 8 episodes of course keeping in calm water, a
path autopilot if it leads her along 50 drawn paths, half of them in a current of a
tenth of her speed. The costs on paths stand beside those of wheel-over.

Rows are kept in a file; a second call does what is left.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from foreign_ships import KeptRows, Row, identified, sea_trials, ship_names, ship_of

from agents import rollout, sail
from agents.controllers.controller import Controller
from agents.rollouts.metrics import metrics, recorded_for_metrics
from agents.verification.chain import examined
from agents.verification.verify import DESIGNS, design_autopilots, verify
from shipgym import Current, InputError, ShipModel, Weather
from shipgym.envs.engine import Engine
from shipgym.tasks import course_keeping_task, path_following_task
from tests.ships.foreign import FOREIGN

STRUCTURES = ("nomoto", "abkowitz", "mmg", "auto")
COMPARED = (*DESIGNS, "wheel-over")
DRAWS = 60
FIRST_SEED = 2_000_000  # of the paths; a search's begin at 500,000
PATHS = 25  # in each of the currents
CURRENTS = (0.0, 0.1)  # of the ship's speed
HEADINGS = np.arange(8)  # seeds of course keeping


def case(name: str, structure: str, seed: int) -> Row:
    """Which designs are given for one ship, and what each does on the ship herself."""
    ship = ship_of(name)
    row: Row = {"ship": name, "structure": structure, "seed": seed}
    try:
        fit = identified(ship, structure, sea_trials(ship, seed))
    except InputError as error:
        return row | {"failed": str(error)}
    verified = partial(verify, fit.model, DRAWS, 0, designs=COMPARED, trials=fit.trials)
    result = examined(None, fit, verified)
    row["chosen"] = fit.model.structure

    found = result.verification
    if found is None:
        designs = designed(fit.model)
        why = result.refusal or result.instability
        row["refused"] = {design.kind: why for design in designs}
    else:
        designs = [pilot.controller for pilot in [*found.pilots, *found.tracks]]
        row["refused"] = found.refused
    row["steered"] = {design.kind: steered(design, ship) for design in designs}
    return row


def designed(model: ShipModel) -> list[Controller]:
    """Designs on a model that is refused as a whole."""
    try:
        found = design_autopilots(model, COMPARED)
    except InputError:
        return []
    return [*found.controllers, *found.guides]


def steered(design: Controller, ship: ShipModel) -> Row:
    """Whether a design loses the ship, and its cost on paths."""
    if not design.has_autopilot:
        task = course_keeping_task(sea="calm")
        episodes = sail(design, ship, task, seeds=HEADINGS)
        return {"lost": int(episodes.terminated.sum())}
    costs: list[float] = []
    lost = 0
    for share in CURRENTS:
        current = Current(share * ship.particulars["speed"], towards_deg=90.0)
        task = path_following_task(sea=Weather(current=current))
        engine = Engine(ship, PATHS, task)
        seeds = FIRST_SEED + np.arange(PATHS)
        figures = metrics(
            rollout(design, engine, seeds, record=recorded_for_metrics(task))
        )
        costs.extend(figures["cost"])
        lost += int(figures["terminated"].sum())
    return {"lost": lost, "cost": float(np.mean(costs))}


def fates(rows: Sequence[Row]) -> pd.DataFrame:
    """A row for each design: what it was given for, whether it steers, and its cost."""
    found = []
    for row in rows:
        for kind, fate in row.get("steered", {}).items():
            found.append(
                {
                    **{name: row[name] for name in ("ship", "structure")},
                    "design": kind,
                    "given": kind not in row["refused"],
                    "steers": fate["lost"] == 0,
                    **fate,
                }
            )
    return pd.DataFrame(found)


def main() -> None:
    """Do the cases that are left, and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--rows", type=Path, default=Path("autopilots.jsonl"))
    parser.add_argument("--seeds", type=int, default=1, help="of the noise")
    parser.add_argument("--ships", type=ship_names, default=list(FOREIGN))
    parser.add_argument("--structures", default=",".join(STRUCTURES))
    given = parser.parse_args()
    warnings.simplefilter("ignore")

    kept = KeptRows(given.rows, ("ship", "structure", "seed"))
    structures = given.structures.split(",")
    for structure, name, seed in itertools.product(
        structures, given.ships, range(given.seeds)
    ):
        if (name, structure, seed) not in kept:
            kept.add(case(name, structure, seed))
            print(structure, name, file=sys.stderr, flush=True)
    found = fates(kept.rows)
    print(pd.crosstab(found["structure"], [found["given"], found["steers"]]))
    print(found.pivot_table("cost", ["ship", "structure"], "design").round(1))


if __name__ == "__main__":
    main()
