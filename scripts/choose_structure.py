"""Choices of `structure = "auto"`, and their predictions of unseen manoeuvres.

    python scripts/choose_structure.py [--ships kcs,seiun-maru] [--seeds 1]

prints the table of docs/identification.md: each ship of `scripts/certainty.py` is put
through zigzags 10/10 and 20/20 to both sides with the noise of sensors and identified
by `auto` and by `abkowitz`. Compared are the heading of a 30/30 zigzag, simulated from
the true rudder, and advance and tactical diameter at 35 degrees, the worse side.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from certainty import TRIALS, sea_trials, ship_of

from identification import IdentificationResult, identify
from identification.judging.prediction import predict
from shipgym import ShipFile, ShipModel
from shipgym.manoeuvres import turning_circle, turning_indices, zigzag

TURNS = ("advance_lengths", "tactical_diameter_lengths")


def unseen(model: ShipModel, ship: ShipModel) -> list[str]:
    """Heading of the zigzag, deg rms; advance and tactical diameter, per cent off."""
    travel = ship.particulars["length"] / ship.particulars["speed"]
    run = zigzag(ship, 30.0, 30.0, False, 35.0 * travel, travel / 80.0)
    found = predict(model, run)
    heading = (
        "ran away"
        if found is None
        else f"{np.degrees(np.std(found['psi'] - run['psi'])):.1f}"
    )
    errors: dict[str, list[float]] = {name: [] for name in TURNS}
    for side in (35.0, -35.0):
        pair = [
            turning_indices(
                turning_circle(one, side, 30.0 * travel, travel / 80.0),
                ship.particulars["length"],
            )
            for one in (model, ship)
        ]
        for name in TURNS:
            mine, truth = (getattr(indices, name) for indices in pair)
            errors[name].append(
                100.0 * abs(mine / truth - 1.0) if mine is not None else np.inf
            )
    return [heading, *(f"{max(errors[name]):.1f}" for name in TURNS)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ships", default="kcs,seiun-maru")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument(
        "--demo", action="store_true", help="only the time that five zigzags take"
    )
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    if given.demo:
        ship = ShipFile.load(
            Path(__file__).parents[1] / "examples" / "mariner" / "ship.toml"
        )
        trials = [
            trial.with_(use="fit") for trial in ship.trials() if trial.kind == "zigzag"
        ]
        start = time.process_time()
        identify(trials, "auto", particulars=ship.particulars, steering=ship.steering)
        print(
            f"{len(trials)} zigzags of the demo: {time.process_time() - start:.0f} s of"
            " processor time"
        )
        return
    print(
        "| ship, seed | structure | error held out | heading 30/30, deg | advance, % |"
        " diameter, % | s |"
    )
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    for name in given.ships.split(","):
        ship = ship_of(name)
        for seed in range(given.seeds):
            trials = sea_trials(ship, TRIALS[0], seed)
            for structure in ("auto", "abkowitz"):
                start = time.process_time()
                result: IdentificationResult = identify(
                    trials,
                    structure,
                    particulars=ship.particulars,
                    steering=ship.steering,
                )
                spent = time.process_time() - start
                ranking = result.metrics.get("selection", {}).get("ranking", [])
                chosen = (
                    f"auto: {ranking[0]['structure']} by {ranking[0]['method']}"
                    if ranking
                    else structure
                )
                error = f"{ranking[0]['error']:.3f}" if ranking else ""
                cells = [
                    f"{name}, {seed}",
                    chosen,
                    error,
                    *unseen(result.model, ship),
                    f"{spent:.0f}",
                ]
                print(f"| {' | '.join(cells)} |", flush=True)
                for one in ranking[1:5]:
                    print(
                        f"  {one['structure']} {one['method']} {one['error']}",
                        file=sys.stderr,
                    )


if __name__ == "__main__":
    main()
