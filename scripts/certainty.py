"""Coverage of the intervals of everything that `auto` can choose, on foreign ships.

    python scripts/certainty.py [--out FILE] [--quick]
    python scripts/certainty.py --out FILE --table

prints the tables of docs/certainty.md. Each ship of tests/ships/foreign.py is
identified by each structure of `auto`, and by `auto` itself, from what a user records:
zigzags 10/10 and 20/20 to both sides, with the noise of sensors. The 95 % intervals of
models drawn are compared with the ship herself:

* in the data's range: overshoots of zigzags 10/10, 15/15 and 20/20 to both sides, and
  the motion in a zigzag 15/15, open loop from her rudder;
* beyond: advance and tactical diameter of 35 degree turns, where a structure predicts a
  track, and the motion in them.

An index counts once; a motion counts by the share of its samples, over the channels
that the structure predicts. Half-widths are by the true index, or by the largest value
of the channel. Heading errors of the turns stand beside those of Norrbin's equation by
output error. FILE has a row of JSON a case, written as it goes; cases that it has are
not done again.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from foreign_ships import KeptRows, Row, identified, sea_trials, ship_names, with_shaft

from identification.pipeline.choice import STRUCTURES
from identification.samples.prediction import (
    predict,
    predicted_channels,
    predicts_track,
)
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats
from shipgym.manoeuvres import (
    Manoeuvre,
    ZigzagIndices,
    turning_circle,
    zigzag,
    zigzag_indices,
)
from shipgym.manoeuvres.imo_rules import imo_manoeuvres
from shipgym.manoeuvres.intervals import (
    IndexInterval,
    attempt,
    intervals_of,
    own_indices,
)
from shipgym.manoeuvres.registry import standard_time
from tests.ships.foreign import FOREIGN

AUTO = "auto"
NORRBIN = "norrbin"
IN_RANGE, BEYOND = "in range", "beyond"
PARTS = (IN_RANGE, BEYOND)
KINDS = ("indices", "motion")
QUICK = ("naval-vessel", "bulk-carrier", "kcs")
Key = tuple[str, str]  # a manoeuvre and the name of an index


def compared(ship: ShipModel) -> dict[str, Manoeuvre]:
    """Manoeuvres whose indices are compared: IMO's and zigzags 15/15."""
    duration, dt = standard_time(ship)
    found = {
        name: one for name, one in imo_manoeuvres(ship).items() if "stop" not in name
    }
    for side, port in (("starboard", False), ("port", True)):
        weave = partial(
            zigzag,
            duration=duration,
            dt=dt,
            rudder_deg=15.0,
            heading_deg=15.0,
            port_first=port,
            must_reverse=False,
        )
        found[f"zigzag 15/15, {side} first"] = Manoeuvre(
            weave, zigzag_indices, ZigzagIndices
        )
    return found


def part_of(key: Key) -> str | None:
    """Where an index belongs; None for those that are not compared."""
    manoeuvre, index = key
    if "zigzag" in manoeuvre and "overshoot" in index:
        return IN_RANGE
    is_track = index in ("advance_lengths", "tactical_diameter_lengths")
    return BEYOND if manoeuvre.startswith("turning") and is_track else None


def true_indices(ship: ShipModel) -> dict[Key, float]:
    """Indices of a ship, by manoeuvre and name."""
    found = {run: attempt(one.evaluate, ship)[0] for run, one in compared(ship).items()}
    return {
        (run, name): value
        for run, indices in found.items()
        for name, value in indices.items()
    }


def index_intervals(model: ShipModel, draws: int) -> dict[Key, IndexInterval]:
    """Indices of a model, with intervals over draws from its covariance."""
    tests = compared(model)
    found = intervals_of(
        own_indices(model, tests),
        model.sample(draws, 1),
        {run: one.evaluate for run, one in tests.items()},
    )
    return {
        (run, name): one
        for run, indices in found.items()
        for name, one in indices.items()
        if part_of((run, name))
    }


def runs_of(ship: ShipModel) -> dict[str, list[Trial]]:
    """Her own motion in manoeuvres that are not among the trials."""
    duration, dt = standard_time(ship)
    weave = partial(zigzag, ship, 15.0, 15.0, duration=duration / 2.0, dt=dt)
    turn = partial(turning_circle, ship, duration=duration / 2.0, dt=dt)
    return {
        IN_RANGE: [with_shaft(weave(port_first=port)) for port in (False, True)],
        BEYOND: [with_shaft(turn(rudder_deg=side * 35.0)) for side in (1.0, -1.0)],
    }


def motion(model: ShipModel, drawn: Sequence[ShipModel], run: Trial) -> Row:
    """Shares of a run's samples within the intervals, half-widths, lost draws."""
    sailed = [predict(draw, run) for draw in drawn]
    kept = [trial for trial in sailed if trial is not None]
    found: Row = {"ran away": 1.0 - len(kept) / len(drawn), "held": [], "width": []}
    names = predicted_channels(model) if len(kept) > 1 else ()
    samples = slice(5, None, 5)
    for name in names:
        values = np.array([trial[name][samples] for trial in kept])
        low, high = np.quantile(values, (0.025, 0.975), axis=0)
        truth = run[name][samples]
        held = (low <= truth) & (truth <= high)
        found["held"].append(float(held.mean()))
        half = np.median(high - low) / 2.0
        found["width"].append(float(half / np.abs(truth).max()))
    return found


def heading_error(model: ShipModel, run: Trial) -> float | None:
    """Root mean square error of the heading in a run, degrees; None if it runs away."""
    sailed = predict(model, run)
    if sailed is None:
        return None
    error: Floats = sailed["psi"] - run["psi"]
    return float(np.degrees(np.sqrt(np.mean(error**2))))


def indices(model: ShipModel, ship: ShipModel, draws: int) -> dict[str, Row]:
    """Indices within their intervals, and half-widths, in range and beyond."""
    truth = true_indices(ship)
    found: dict[str, Row] = {part: {"held": [], "width": []} for part in PARTS}
    for key, one in index_intervals(model, draws).items():
        part = part_of(key)
        if part is None or (part == BEYOND and not predicts_track(model)):
            continue
        row = found[part]
        if one.interval is None:
            row["held"].append(False)
            continue
        low, high = one.interval
        if high is None:  # too many draws run away for an upper bound
            high = np.inf
        held = low <= truth[key] <= high
        row["held"].append(held)
        if np.isfinite(high):
            row["width"].append((high - low) / 2.0 / truth[key])
    return found


def case(name: str, structure: str, seed: int, draws: int, uncertainty: str) -> Row:
    """One ship, structure and seed of the noise."""
    warnings.simplefilter("ignore")
    ship = FOREIGN[name]()
    trials = sea_trials(ship, seed)
    row: Row = {"ship": name, "structure": structure, "seed": seed}
    began = time.process_time()
    try:
        result = identified(ship, structure, trials, uncertainty=uncertainty)
    except InputError as error:
        return row | {"refused": str(error)}
    model = result.model
    row |= {
        "seconds": time.process_time() - began,
        "chosen": model.structure,
        "stable": result.stable,
    }
    if not result.stable:
        return row
    runs = runs_of(ship)
    row["turns"] = [heading_error(model, run) for run in runs[BEYOND]]
    row["indices"] = indices(model, ship, draws)
    drawn = model.sample(draws, 1)
    row["motion"] = {
        part: [motion(model, drawn, run) for run in some] for part, some in runs.items()
    }
    return row


def told(rows: Iterable[Row], kind: str, part: str, what: str) -> list[float]:
    """Flags, shares or half-widths of some cases, in a list."""
    found: list[float] = []
    for row in rows:
        if kind not in row:
            continue
        some = row[kind][part]
        for one in some if kind == "motion" else [some]:
            found += one[what]
    return found


def percent(values: Sequence[float], take: Callable[[Sequence[float]], Any]) -> str:
    """A figure of some values in per cent."""
    return f"{100.0 * float(take(values)):.0f}" if values else "-"


def worst(rows: Sequence[Row], part: str) -> str:
    """The case that holds the fewest indices, of ship and structure."""
    least, who = 2.0, "-"
    pairs = dict.fromkeys((row["ship"], row["structure"]) for row in rows)
    for pair in pairs:
        own = [row for row in rows if (row["ship"], row["structure"]) == pair]
        held = told(own, "indices", part, "held")
        if held and np.mean(held) < least:
            least, who = float(np.mean(held)), pair[0]
    return f"{who} {100.0 * least:.0f}" if who != "-" else who


def line(name: str, rows: Sequence[Row]) -> str:
    """A row of the table of coverage."""
    cells = []
    for kind in KINDS:
        for part in PARTS:
            held = percent(told(rows, kind, part, "held"), np.mean)
            width = percent(told(rows, kind, part, "width"), np.median)
            cells.append(f"{held} ({width})")
    lost = [
        one["ran away"]
        for row in rows
        if "motion" in row
        for one in row["motion"][BEYOND]
    ]
    usable = sum("indices" in row for row in rows)
    cells += [percent(lost, np.mean), worst(rows, IN_RANGE), worst(rows, BEYOND)]
    return f"| {name} | {usable} of {len(rows)} | {' | '.join(cells)} |"


def table(rows: Sequence[Row], by: str) -> str:
    """The table of coverage, by structure or by ship."""
    lines = [
        f"| {by} | stable | indices in range | indices beyond | motion in range |"
        " motion beyond | draws that run away | worst in range | worst beyond |",
        "| --- " * 9 + "|",
    ]
    for name in dict.fromkeys(row[by] for row in rows):
        lines.append(line(name, [row for row in rows if row[by] == name]))
    lines.append(line("**all**", rows))
    return "\n".join(lines)


def turns(rows: Sequence[Row]) -> str:
    """Heading errors of the unseen turns by `auto` and by Norrbin's equation."""
    lines = [
        "| ship | `auto` took | its error, deg | Norrbin's, deg | within the aim |",
        "| --- " * 5 + "|",
    ]
    by_case = {(row["ship"], row["seed"], row["structure"]): row for row in rows}
    good = counted = 0
    for (ship, seed, structure), row in by_case.items():
        if structure != AUTO:
            continue
        plain = by_case.get((ship, seed, NORRBIN), {})
        own, other = error_of(row), error_of(plain)
        within = own < 5.0 or own <= 1.3 * other
        counted += 1
        good += within
        answer = "yes" if within else "no"
        chosen = row.get("chosen", "-")
        lines.append(f"| {ship} | `{chosen}` | {own:.1f} | {other:.1f} | {answer} |")
    lines.append(f"| **all** | | | | {good} of {counted} |")
    return "\n".join(lines)


def error_of(row: Row) -> float:
    """Mean error over both turns; infinite where there is none."""
    errors = row.get("turns")
    if not errors or None in errors:
        return np.inf
    return float(np.mean(errors))


def main() -> None:
    """Run the cases that are missing and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("certainty.jsonl"))
    parser.add_argument("--seeds", type=int, default=1, help="of the noise")
    parser.add_argument("--draws", type=int, default=60, help="models drawn")
    parser.add_argument("--ships", type=ship_names, default=list(FOREIGN))
    parser.add_argument("--structures", default=",".join((*STRUCTURES, AUTO)))
    parser.add_argument("--uncertainty", default="analytic", help="or posterior")
    parser.add_argument("--quick", action="store_true", help="three ships, 30 draws")
    parser.add_argument("--table", action="store_true", help="of FILE, nothing is run")
    given = parser.parse_args()
    ships = given.ships
    draws = given.draws
    if given.quick:
        ships, draws = list(QUICK), 30
    kept = KeptRows(given.out, ("ship", "structure", "seed"))
    cases = [
        (ship, structure, seed)
        for ship in ships
        for structure in given.structures.split(",")
        for seed in range(given.seeds)
        if (ship, structure, seed) not in kept
    ]
    for k, (ship, structure, seed) in enumerate([] if given.table else cases):
        print(f"{k + 1} of {len(cases)}: {ship}, {structure}", file=sys.stderr)
        kept.add(case(ship, structure, seed, draws, given.uncertainty))
    rows = kept.rows
    print(table(rows, "structure"), table(rows, "ship"), turns(rows), sep="\n\n")


if __name__ == "__main__":
    main()
