"""Intervals, verdicts and autopilots on ships that no part of the project was made on.

    python scripts/opened_once.py [--seeds 3] [--draws 40] [--workers 2]
    python scripts/opened_once.py --chain FOLDER

prints the tables of "Ships opened once" in docs/certainty.md; the second puts CSV files
of the trials through the command line. The ships are those of
tests/ships/opened_once.py. How they count was written down before any of them was
identified:

* Intervals: the trials, noise, seeds, structures, draws and indices of
  scripts/certainty.py.
* Verdicts on the criteria of IMO MSC.137(76): those by 100 models drawn, and those of
  reports, where a trial that is the manoeuvre goes first. One is wrong if the ship
  herself, without noise, is on the other side.
* Autopilots: the five of `shipgym autopilot`, refused as that command refuses them,
  with 60 models drawn. One that keeps a heading steers if it keeps control of the ship
  herself in all of 8 episodes of course keeping in calm water, one that keeps a track
  if it leads her to its end. Episodes in a moderate sea are told beside them. A model
  that is unstable, or refused, has none. (How many of those refused would steer was
  added later.)
* The command line is told main dimensions, mass and centre of gravity, but no added
  mass and no gyradius, and no structure; its 200 models drawn and its files count like
  the rest.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from certainty import STRUCTURES, TRIALS, coverage, fitted, sea_trials, share, table
from joblib import Parallel, delayed

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from agents.agent_file import (  # noqa: E402
    load_agent,
)
from agents.controllers.controller import Controller  # noqa: E402
from agents.rollouts.course_keeping import sail  # noqa: E402
from agents.verification.chain import examined  # noqa: E402
from agents.verification.tracks import keep_track  # noqa: E402
from agents.verification.verify import DESIGNS, verify  # noqa: E402
from shipgym import ShipModel, load_model  # noqa: E402
from shipgym.errors import InputError  # noqa: E402
from shipgym.manoeuvres.imo import imo_assessment  # noqa: E402
from shipgym.tasks.task import course_keeping_task  # noqa: E402
from tests.ships.opened_once import OPENED_ONCE  # noqa: E402

EPISODES, DRAWS = np.arange(8), 60
SHIP_FILE = """\
[ship]
name = "{name}"
length = {length}
beam = {beam}
draught = {draught}
mass = {mass}
xg = {xg}
speed = {speed}
rudder_area = {rudder_area}
propeller_diameter = {propeller_diameter}

[steering]
rudder_limit_deg = {rudder_limit_deg}
rudder_rate_deg_s = {rudder_rate_deg_s}
time_constant = {time_constant}

[columns]
{columns}
"""


def verdicts(
    criteria: Mapping[str, Mapping[str, Any]], ship: ShipModel
) -> Counter[str]:
    """Counts of criteria decided, of wrong decisions, and names of the wrong ones."""
    found: Counter[str] = Counter()
    truth = imo_assessment(ship, 0)
    for name, one in criteria.items():
        if one["decided"] and truth[name].passed is not None:
            found["decided"] += 1
            if one["passed"] != truth[name].passed:
                found["wrong"] += 1
                found[
                    f"{name}: {truth[name].value:.2f}, limit {truth[name].limit:.2f}"
                ] += 1
    return found


def steered(pilots: Iterable[Controller], ship: ShipModel) -> dict[str, str]:
    """What becomes of the ship herself under each autopilot."""
    found = {}
    for pilot in pilots:
        if pilot.has_autopilot:
            found[pilot.kind] = (
                "steers" if keep_track(pilot, [ship]).arrived[0] else "LOST"
            )
            continue
        calm, sea = (
            sail(
                pilot, ship, course_keeping_task(sea=sea), seeds=EPISODES
            ).terminated.any()
            for sea in ("calm", "moderate")
        )
        found[pilot.kind] = (
            "LOST" if calm else "lost in a moderate sea" if sea else "steers"
        )
    return found


def case(name: str, structure: str, kind: str, seed: int, draws: int) -> dict[str, Any]:
    """One ship, structure, set of trials and seed of the noise."""
    warnings.simplefilter("ignore")
    ship = OPENED_ONCE[name]()
    result = fitted(ship, structure, sea_trials(ship, kind, seed))
    row: dict[str, Any] = {
        "ship": name,
        "structure": structure,
        "trials": kind,
        "seed": seed,
    }
    row["pilots"] = dict.fromkeys(DESIGNS, "refused")
    if not result.stable:
        return row | {"unstable": True}
    row |= coverage(ship, result.model, draws)
    drawn = {
        key: one.to_dict() for key, one in imo_assessment(result.model, 100).items()
    }
    chain = examined(
        None,
        result,
        [],
        lambda: verify(result.model, DRAWS, 0, trials=result.trials),
    )
    found = chain.verification
    row |= {
        "by models": verdicts(drawn, ship),
        "reported": Counter(),
        "why": chain.refusal or chain.instability,
    }
    if found is not None:
        reported = {
            key: one.to_dict() for key, one in found.manoeuvres.criteria.items()
        }
        row["reported"] = verdicts(reported, ship)
        designed = [p.controller for p in found.pilots] + [
            track.controller for track in found.tracks
        ]
        tried = steered(designed, ship)
        row["needless"] = sum(
            tried[kind] != "LOST" for kind in tried.keys() & found.refused
        )
        row["pilots"] |= {
            kind: what for kind, what in tried.items() if kind not in found.refused
        }
    return row


def counts(rows: Sequence[Mapping[str, Any]]) -> str:
    """Verdicts and autopilots of each ship, in Markdown."""
    lines = [
        (
            "| ship, trials | verdicts by models: decided, wrong | in reports: decided,"
            " wrong | autopilots: steer, lost, refused (of which would steer) | lost in"
            " a moderate sea |"
        ),
        "| --- | --- | --- | --- | --- |",
    ]
    every = {
        f"{ship}, {kind}": [r for r in rows if (r["ship"], r["trials"]) == (ship, kind)]
        for ship in OPENED_ONCE
        for kind in TRIALS
    } | {"**all**": list(rows)}
    for name, group in every.items():
        cells = []
        for label in ("by models", "reported"):
            total: Counter[str] = sum(
                (row.get(label, Counter()) for row in group), Counter()
            )
            cells.append(f"{total['decided']}, {total['wrong']}")
            for told in total.keys() - {"decided", "wrong"}:
                print(f"wrong {label}: {name}: {told}", file=sys.stderr)
        pilots = Counter(one for row in group for one in row["pilots"].values())
        rough = pilots["lost in a moderate sea"]
        needless = sum(row.get("needless", 0) for row in group)
        cells.append(
            f"{pilots['steers'] + rough}, {pilots['LOST']}, {pilots['refused']}"
            f" ({needless})"
        )
        lines.append(f"| {name} | {' | '.join(cells)} | {rough} |")
    return "\n".join(lines)


def write_trials(ship: ShipModel, kind: str, seed: int, folder: Path) -> Path:
    """CSV files of her trials, and a ship file with what an owner knows."""
    folder.mkdir(parents=True, exist_ok=True)
    trials = sea_trials(ship, kind, seed)
    channels = ("t", *(c for c in trials[0].channels if "command" not in c))
    entries = ""
    for trial in trials:
        file = trial.name.replace(" ", "_") + ".csv"
        trial.to_csv(folder / file)
        entries += f'\n[[trials]]\nfile = "{file}"\nkind = "{trial.kind}"\n'
    steering = {
        name: getattr(ship.steering, name)
        for name in ship.steering.__dataclass_fields__
    }
    columns = "\n".join(f'{name} = "{name}"' for name in channels)
    text = SHIP_FILE.format(**ship.particulars, **steering, columns=columns) + entries
    (folder / "ship.toml").write_text(text, encoding="utf-8")
    return folder / "ship.toml"


def chained(name: str, kind: str, folder: Path) -> dict[str, Any]:
    """One ship through the command line, seed 0."""
    warnings.simplefilter("ignore")
    ship = OPENED_ONCE[name]()
    place = folder / f"{name}-{kind}".replace(" ", "-")
    toml = write_trials(ship, kind, 0, place)
    row: dict[str, Any] = {
        "ship": name,
        "trials": kind,
        "pilots": dict.fromkeys(DESIGNS, "refused"),
    }
    for command in ("identify", "autopilot"):
        done = subprocess.run(
            ["shipgym", command, toml, "--out", place / command],
            text=True,
            capture_output=True,
            check=False,
        )
        (place / f"{command}.txt").write_text(
            done.stdout + done.stderr, encoding="utf-8"
        )
        row[command] = done.returncode
    try:
        model = load_model(place / "identify" / "model.json")
        row |= coverage(ship, model, 40) | {"structure": model.structure}
    except InputError as error:
        row |= {"structure": str(error)}
    told = place / "autopilot" / "metrics.json"
    metrics = (
        json.loads(told.read_text(encoding="utf-8")) if told.exists() else {}
    )  # none for refused input
    row["reported"] = verdicts(metrics.get("imo", {}), ship)
    files = [place / "autopilot" / f"{kind}.json" for kind in DESIGNS]
    row["pilots"] |= steered(
        (load_agent(file) for file in files if file.exists()), ship
    )
    return row


def main() -> None:
    """Run all cases and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=3, help="of the noise")
    parser.add_argument(
        "--draws", type=int, default=40, help="models drawn for the intervals"
    )
    parser.add_argument(
        "--ships", default=",".join(OPENED_ONCE), help="with commas between"
    )
    parser.add_argument(
        "--chain", type=Path, metavar="FOLDER", help="the command line, files put there"
    )
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    names = given.ships.split(",")
    if given.chain:
        for name in names:
            for kind in TRIALS:
                row = chained(name, kind, given.chain)
                covered = (
                    f"{share([row], 'noise')}, {share([row], 'all')}"
                    if "all" in row
                    else "-"
                )
                reported = f"{row['reported']['decided']}, {row['reported']['wrong']}"
                pilots = ", ".join(
                    f"{one} {what}" for one, what in row["pilots"].items()
                )
                print(
                    f"| {name}, {kind} | {row['structure']} | {covered} | {reported} |"
                    f" {pilots} |",
                    flush=True,
                )
        return
    rows = Parallel(n_jobs=given.workers, verbose=5)(
        delayed(case)(name, structure, kind, seed, given.draws)
        for name in names
        for structure in STRUCTURES
        for kind in TRIALS
        for seed in range(given.seeds)
    )
    for row in rows:
        if "unstable" in row or row["why"] or "LOST" in row["pilots"].values():
            told = "unstable" if "unstable" in row else f"{row['why']} {row['pilots']}"
            print(
                row["ship"],
                row["structure"],
                row["trials"],
                row["seed"],
                told,
                file=sys.stderr,
            )
    print(table(rows), counts(rows), sep="\n\n")


if __name__ == "__main__":
    main()
