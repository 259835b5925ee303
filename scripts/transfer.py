"""Learn and tune on identified models, fly on the ships behind their trials.

`python scripts/transfer.py [TASK ...] --out transfer/`: 5 training runs each, resumed where they were left.
The measurements of KVLCC2 lie beside the checkout; without them she is not flown as measured.
"""

from __future__ import annotations

import argparse
from functools import cache, partial
from pathlib import Path

import numpy as np
from real_ships.data import Data
from real_ships.recipe import fitted

from agents.benchmarking.transfer import CASES, N_RUNS, Transfer, save_transfer, transfer, transfer_case
from agents.cli.terminal import progress_bars
from shipgym import InputError, ShipModel, load_model
from shipgym.ships.scaling import scale_model

ROOT = Path(__file__).parents[1]


@cache
def measured(data: Path) -> dict[str, ShipModel]:
    """KVLCC2 as identified from HSVA's measured zigzags, at full scale; nothing without the measurements."""
    try:
        ship = Data(ROOT / "tests" / "ships", data).ship("kvlcc2_hsva", 20)
    except InputError:
        return {}
    model = fitted(ship, tuple(sorted(ship.runs)))
    return {"measured": scale_model(model, load_model("kvlcc2").particulars["length"])}


def table(result: Transfer) -> str:
    """Costs of one case as Markdown: contestants down, ships across."""
    ships = list(result.case.ships)
    head = [
        "learned or tuned in",
        *(f"cost, {ship}" for ship in ships),
        "gain, identified",
        "gain, reference",
        "kept",
    ]
    rows = [head, ["---"] * len(head)]
    for who in result.costs:
        costs = [result.cost(who, ship) for ship in ships]
        gains = [result.gain(who, ship) for ship in ("identified", "reference")]
        cells = [f"{cost.value:.1f} ({cost.low:.1f} to {cost.high:.1f})" for cost in costs]
        cells += [f"{100 * gain.value:.1f} %" for gain in gains]
        kept = result.gain_kept(who)
        rows.append([who, *cells, f"{100 * kept:.0f} %" if np.isfinite(kept) else ""])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def main() -> None:
    """Run the cases asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tasks", nargs="*", help=f"some of {', '.join(CASES)}; by default all")
    parser.add_argument("--out", type=Path, default=ROOT / "transfer")
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--runs", type=int, default=N_RUNS)
    parser.add_argument("--total-steps", type=int, default=400_000, help="of each training run")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    for task in options.tasks or CASES:
        with progress_bars(True) as bars:
            tell = None if bars is None else partial(bars, task)
            case = transfer_case(task, measured(options.data) if task.startswith("kvlcc2") else {})
            result = transfer(
                case, options.out, n_runs=options.runs, settings={"total_steps": options.total_steps},
                workers=options.workers, progress=tell,
            )  # fmt: skip
        save_transfer(result, options.out / f"{task}.json")
        print(f"## {task}\n\n{table(result)}\n", flush=True)


if __name__ == "__main__":
    main()
