"""Which path autopilot keeps ships of other equations to drawn paths.

    python scripts/path_autopilots.py [--rows path_autopilots.jsonl] [--ships kcs,ferry]
    python scripts/path_autopilots.py --half chosen --settings weight_1=0.8

prints the table of "On ships that nobody designed for" in docs/preview_lq.md. Each ship
of tests/ships is put through zigzags 10/10 and 20/20 to both sides with the noise of
sensors and identified by `abkowitz`. On that model wheel-over and LQ with preview are
designed, as they are and with settings searched as `shipgym autopilot --tune` does it.
Each then leads the ship herself along 50 drawn paths, half of them in a current of a
tenth of her speed, whose seeds no search has seen.

Numbers of LQ with preview are tried with `--settings`, on the half of the ships that
defaults are chosen on; the other half judges. Rows are kept in a file; a second call
does what is left.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from certainty import ship_names, ship_of
from given_autopilots import identified
from kept_rows import KeptRows

from agents import PreviewLQ
from agents.controllers.controller import Controller
from agents.controllers.registry import controller_class
from agents.rollouts.metrics import metrics, recorded_for_metrics
from agents.rollouts.rollout import rollout
from agents.verification.tracks import track_task
from agents.verification.tuned import tuned_design
from identification import IdentificationResult
from shipgym import Current, ShipModel, Weather
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.tasks.task import path_following_task
from tests.ships.foreign import SECOND_FIVE

#: Ships that defaults are chosen on, and those that judge.
HALVES = {
    "chosen": ("kcs", "ferry", "naval-vessel", "supply-vessel", "lively-light"),
    "judging": tuple(SECOND_FIVE),
}
DESIGNED = ("wheel-over", "preview-lq")
TUNED = ("tuned wheel-over", "tuned preview-lq")
FIRST_SEED = 2_000_000  # of the paths; a search's begin at 500,000
PATHS = 25  # in each of the currents
CURRENTS = (0.0, 0.1)  # of the ship's speed


@lru_cache(maxsize=1)
def identified_ship(name: str) -> IdentificationResult:
    """A ship identified from her zigzags."""
    return identified(ship_of(name), "abkowitz", "zigzags", 0)


def made(autopilot: str, model: ShipModel, seconds: float) -> Controller:
    """Autopilot of a name: a kind, a kind after "tuned", or settings."""
    task = track_task(model)
    if autopilot in TUNED:
        kind = autopilot.removeprefix("tuned ")
        return tuned_design(kind, model, seconds, lambda *_: None).controller
    if autopilot in DESIGNED:
        kind_made: Any = controller_class(autopilot)
        guide: Controller = kind_made.from_model(model, task=task)
        return guide
    settings = {}
    for pair in autopilot.split(","):
        name, _, value = pair.partition("=")
        settings[name] = float(value)
    return PreviewLQ.from_model(model, task=task, **settings)


def led(guide: Controller, ship: ShipModel) -> dict[str, Any]:
    """Costs, ships lost and cross-track error of an autopilot on drawn paths."""
    seeds = FIRST_SEED + np.arange(PATHS)
    costs: list[float] = []
    errors: list[float] = []
    lost = 0
    for share in CURRENTS:
        current = Current(share * ship.particulars["speed"], towards_deg=90.0)
        task = path_following_task(sea=Weather(current=current))
        engine = Engine(ship, PATHS, task)
        run = rollout(guide, engine, seeds, record=recorded_for_metrics(task))
        figures = metrics(run)
        costs.extend(figures["cost"])
        errors.extend(figures["cross_track_rmse_m"] / ship.particulars["length"])
        lost += int(figures["terminated"].sum())
    return {
        "cost": np.mean(costs),
        "costs": np.round(costs, 3),
        "lost": lost,
        "cross_track": np.mean(errors),
    }


def case(name: str, autopilot: str, seconds: float) -> dict[str, Any]:
    """Row of a ship and an autopilot."""
    row: dict[str, Any] = {"ship": name, "autopilot": autopilot}
    began = time.process_time()
    try:
        fit = identified_ship(name)
        row["unaccepted"] = fit.metrics.get("unaccepted")
        fitted = time.process_time()
        guide = made(autopilot, fit.model, seconds)
    except InputError as error:
        return row | {"failed": str(error)}
    designed = time.process_time()
    row |= led(guide, ship_of(name))
    ended = time.process_time()
    return row | {"seconds": [fitted - began, designed - fitted, ended - designed]}


def table(rows: Sequence[Mapping[str, Any]], autopilots: Sequence[str]) -> str:
    """Cost, ships lost and cross-track error by ship and autopilot, in Markdown."""
    found = {(row["ship"], row["autopilot"]): row for row in rows if "cost" in row}
    lines = ["| ship | " + " | ".join(autopilots) + " |"]
    lines.append("| --- |" + " --- |" * len(autopilots))
    ships = list(dict.fromkeys(row["ship"] for row in rows))
    for ship in ships:
        cells = [cell(found.get((ship, autopilot))) for autopilot in autopilots]
        lines.append(f"| {ship} | " + " | ".join(cells) + " |")
    for half, names in HALVES.items():
        cells = [against_wheel_over(found, names, one) for one in autopilots]
        lines.append(f"| **{half}** | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def cell(row: Mapping[str, Any] | None) -> str:
    """Cost, ships lost and cross-track error of a row."""
    if row is None or "cost" not in row:
        return "-"
    return f"{row['cost']:.1f}, {row['lost']}, {row['cross_track']:.3f}"


def against_wheel_over(
    found: Mapping[tuple[str, str], Mapping[str, Any]],
    ships: Sequence[str],
    autopilot: str,
) -> str:
    """Change of the cost from that of wheel-over as designed, and where it is lower."""
    changes = []
    for ship in ships:
        row = found.get((ship, autopilot))
        base = found.get((ship, "wheel-over"))
        if row is not None and base is not None:
            changes.append(row["cost"] / base["cost"] - 1.0)
    if not changes:
        return "-"
    better = sum(change < 0.0 for change in changes)
    return f"{100.0 * np.mean(changes):+.1f} %, lower on {better} of {len(changes)}"


def main() -> None:
    """Do the cases that are left, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--rows", type=Path, default=Path("path_autopilots.jsonl"))
    parser.add_argument(
        "--ships",
        type=ship_names,
        help="with commas between; by default of both halves",
    )
    parser.add_argument("--half", choices=HALVES, help="ships of one half alone")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each search")
    parser.add_argument(
        "--settings",
        action="append",
        default=[],
        metavar="NAME=VALUE,...",
        help="numbers of preview-lq in place of the searches; repeatable",
    )
    given = parser.parse_args()
    warnings.simplefilter("ignore")

    ships = HALVES[given.half] if given.half else sum(HALVES.values(), ())
    if given.ships:
        ships = tuple(given.ships)
    tried = tuple(given.settings)
    kept = KeptRows(given.rows, ("ship", "autopilot"))
    for group in ((*DESIGNED, *tried), () if tried else TUNED):
        for name in ships:
            for autopilot in group:
                if (name, autopilot) in kept:
                    continue
                row = case(name, autopilot, given.seconds)
                kept.add(row)
                print(name, autopilot, cell(row), file=sys.stderr, flush=True)
    print(table(kept.rows, (*DESIGNED, *(tried or TUNED))))


if __name__ == "__main__":
    main()
