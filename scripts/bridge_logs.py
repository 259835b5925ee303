"""Currents, models and autopilots from logs as ships make them, in current and wind.

    python scripts/bridge_logs.py [--seeds 8] [--models 2] [--ships kcs,tanker]
    python scripts/bridge_logs.py --wind
    python scripts/bridge_logs.py --parts [--seeds 8]
    python scripts/bridge_logs.py --structures auto,nomoto,cubic [--ships kcs]

prints the tables of docs/logs.md; the second needs the data of docs/real_ships.md, the
third has logs of single trials, with a current and with none, and the fourth the turn
not seen by structures with their usual methods.

Every reference ship, and two ships by the MMG standard method (tests/ships/mmg.py),
sails zigzags 10/10 and 20/20, a 35 degree turn to starboard and a 25 degree turn to
port, each begun on another heading, in a current of 0.5 m/s and a gusty wind of 9 m/s
of random directions. The log holds GNSS positions at 1 Hz with noise of 0.3 m and drift
of 0.8 m, the antenna 25 m forward of midship, heading at 2 Hz with noise of 0.1
degrees, the rudder in half degrees, the shaft speed, and wind with noise of 0.5 m/s and
5 degrees: no velocity and no yaw rate. The turn to port has no part in the fit. The
ship is identified by structures that are not hers.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from certainty import (  # noqa: E402
    SHIPS,
    ship_of,
)
from real_ships.section import table  # noqa: E402

from agents.controllers.lq import LQ  # noqa: E402
from agents.controllers.pid import PID  # noqa: E402
from agents.rollouts.course_keeping import sail  # noqa: E402
from agents.verification.closed_loop import ClosedLoop  # noqa: E402
from agents.verification.refusal import why_refused  # noqa: E402
from agents.verification.tracks import judged_task  # noqa: E402
from identification import IdentificationResult, Preprocessing, identify  # noqa: E402
from identification.judging.warnings import why_unstable  # noqa: E402
from identification.samples.still_water import in_still_water  # noqa: E402
from shipgym import ShipModel, Trial  # noqa: E402
from shipgym.errors import InputError  # noqa: E402
from shipgym.manoeuvres import turning_circle, zigzag  # noqa: E402
from shipgym.sea import Current, Weather, Wind  # noqa: E402
from shipgym.tasks.task import course_keeping_task  # noqa: E402
from shipgym.trials.conventions import Conventions  # noqa: E402
from shipgym.trials.midship import to_project_conventions  # noqa: E402
from shipgym.trials.resampling import Log  # noqa: E402
from shipgym.trials.sensors import GNSS, Sensor, Sensors  # noqa: E402
from shipgym.trials.ship_file import ShipFile  # noqa: E402

CURRENT, WIND = 0.5, 9.0  # m/s
UNSEEN = "turn 25 port"
RECIPES: dict[str, dict[str, Any]] = {
    "cubic, output-error": {"structure": "cubic", "method": "output-error"},
    "mmg": {"structure": "mmg"},
}
LEFT_IN: dict[str, Any] = {"current": "none", "wind": "none"}
ANTENNA = 25.0  # m forward of midship
DEGREE = np.pi / 180.0
LOG = Sensors(
    {
        "x": GNSS,
        "y": GNSS,
        "psi": Sensor(noise=0.1 * DEGREE),
        "delta": Sensor(resolution=0.5 * DEGREE),
        "n": Sensor(resolution=0.1 / 60.0),
    },
)


def turned(run: Trial, angle: float) -> Trial:
    """A run as it would have been with north `angle` further to port, rad."""
    c, s = np.cos(angle), np.sin(angle)
    channels = dict(run.channels)
    channels["x"], channels["y"] = (
        c * run["x"] - s * run["y"],
        s * run["x"] + c * run["y"],
    )
    for name in {"psi", "wind_from"} & channels.keys():
        channels[name] = run[name] + angle
    if "current_north" in run:
        north, east = run["current_north"], run["current_east"]
        channels |= {
            "current_north": c * north - s * east,
            "current_east": s * north + c * east,
        }
    return Trial(
        run.t, channels, name=run.name, kind=run.kind, use=run.use, length=run.length
    )


def sailed(
    ship: ShipModel,
    current: float,
    towards: float,
    wind: float,
    wind_from: float,
    seed: int,
) -> list[Trial]:
    """Zigzags and a turn, each on another heading, and a turn to the other side."""
    travel = ship.particulars["length"] / ship.particulars["speed"]
    rng = np.random.default_rng(seed)
    runs = []
    for k, (kind, angle, side) in enumerate(
        [
            ("zigzag", 10.0, 1.0),
            ("zigzag", 20.0, -1.0),
            ("turn", 35.0, 1.0),
            ("turn", 25.0, -1.0),
        ]
    ):
        heading = rng.uniform(0.0, 360.0)
        weather = Weather(
            Current(current, (towards - heading) % 360.0),
            Wind(wind, (wind_from - heading) % 360.0) if wind else None,
        )
        if kind == "zigzag":
            run = zigzag(
                ship,
                angle,
                angle,
                side < 0,
                35.0 * travel,
                0.5,
                weather=weather,
                seed=seed + k,
            )
        else:
            run = turning_circle(
                ship, side * angle, 25.0 * travel, 0.5, weather=weather, seed=seed + k
            )
        name = f"{kind} {angle:.0f} {'starboard' if side > 0 else 'port'}"
        use = "validate" if k == 3 else "fit"
        runs.append(turned(run.with_(name=name, use=use), heading * DEGREE))
    return runs


def logged(run: Trial, seed: int) -> Trial:
    """Bridge log of a run: GNSS at 1 Hz, gyro at 2 Hz, rudder in half degrees."""
    antenna = run.with_channels(
        {
            "x": run["x"] + ANTENNA * np.cos(run["psi"]),
            "y": run["y"] + ANTENNA * np.sin(run["psi"]),
        }
    )
    read = LOG.measure(antenna, seed)
    rng = np.random.default_rng([seed, 7])
    channels = {
        name: read[name] for name in ("x", "y", "psi", "delta", "n") if name in read
    }
    if "wind_speed" in run and np.ptp(run["wind_speed"]) > 0.0:
        channels["wind_speed"] = np.maximum(
            run["wind_speed"] + rng.normal(0.0, 0.5, len(run)), 0.0
        )
        channels["wind_from"] = run["wind_from"] + rng.normal(
            0.0, 5.0 * DEGREE, len(run)
        )
    for name in ("x", "y"):  # at 1 Hz, between which the reader interpolates
        channels[name] = np.interp(read.t, read.t[::2], channels[name][::2])
    channels["x"] = channels["x"] - ANTENNA * np.cos(channels["psi"])
    channels["y"] = channels["y"] - ANTENNA * np.sin(channels["psi"])
    every = slice(None, None, 2)
    channels = {name: values[every] for name, values in channels.items()}
    log = Log(read.t[every], channels, run.name, [])
    to_project_conventions(log, Conventions())
    facts: dict[str, Any] = {
        "kind": run.kind,
        "use": run.use,
        "derived": log.derived,
        "length": run.length,
    }
    return Trial(log.t, log.channels, name=run.name, **facts)


def logs_of(ship: ShipModel, seed: int) -> tuple[list[Trial], Weather]:
    """Logs of a ship and the weather that they were made in.

    A ship without a shaft logs a steady shaft speed.
    """
    rng = np.random.default_rng(seed)
    towards, wind_from = rng.uniform(0.0, 360.0, 2)
    weather = Weather(Current(CURRENT, towards), Wind(WIND, wind_from))
    runs = sailed(ship, CURRENT, towards, WIND, wind_from, 100 * seed)
    logs = []
    for k, run in enumerate(runs):
        log = logged(run, 1000 * seed + k)
        if "n" not in log:
            log = log.with_channels({"n": np.ones(len(log))})
        logs.append(log)
    return logs, weather


def current_case(ship: ShipModel, seed: int) -> tuple[np.ndarray, np.ndarray, bool]:
    """Error of the current, its standard errors, and whether it was found.

    North and east.
    """
    logs, weather = logs_of(ship, seed)
    towards = np.radians(weather.current.towards_deg)
    truth = CURRENT * np.array([np.cos(towards), np.sin(towards)])
    _, found = in_still_water(logs, ship.particulars)
    first = logs[0]
    row = found["currents"][first.name]
    estimate = np.array([row["north"], row["east"]])
    standard_errors = np.array(row["standard_errors"])
    return estimate - truth, standard_errors, row["taken_out"]


def heading_error(result: IdentificationResult) -> float:
    """Error of the turn held out, open loop, deg rms; infinite if it runs away."""
    error = result.metrics["trials"][UNSEEN]["rmse"]["psi"]
    return float("inf") if error is None else float(np.degrees(error))


def autopilots(
    result: IdentificationResult, ship: ShipModel, weather: Weather
) -> dict[str, float | str]:
    """Heading error, deg rms, of autopilots on the ship herself in the same weather."""
    refused = why_unstable(result) or why_refused(result)
    if refused:
        return {"PID": "refused", "LQ": "refused"}
    found: dict[str, float | str] = {}
    draws = result.model.sample(40, 0)
    for design in (PID, LQ):
        try:
            pilot = design.from_model(result.model)
        except InputError:
            found[design.__name__] = "refused"
            continue
        seeds = np.arange(40)
        loop = ClosedLoop(result.model, draws, seeds, result.trials)
        drawn = sail(pilot, draws, judged_task(), seeds, allow_unstable=True)
        if loop.loses_too_many(drawn.terminated):
            found[design.__name__] = "refused"
            continue
        episodes = sail(
            pilot, ship, course_keeping_task(sea=weather), seeds=np.arange(4)
        )
        found[design.__name__] = (
            "LOST"
            if episodes.terminated.any()
            else float(episodes.heading_rmse_deg.mean())
        )
    return found


def current_table(names: Sequence[str], seeds: range) -> str:
    """How well the current is found."""
    rows, every = [], []
    for name in names:
        found = [current_case(ship_of(name), seed) for seed in seeds]
        errors, deviations = (np.array([case[k] for case in found]) for k in (0, 1))
        every.append((errors, deviations))
        rows.append(
            [
                name,
                *_current_cells(errors, deviations),
                f"{sum(case[2] for case in found)} of {len(found)}",
            ]
        )
    together = [np.concatenate(part) for part in zip(*every, strict=True)]
    rows.append(["all", *_current_cells(*together), ""])
    head = [
        "ship",
        "error, m/s rms",
        "largest",
        "below 0.05 m/s",
        "inside the 95 % interval",
        "removed",
    ]
    return table(head, rows)


def _current_cells(errors: np.ndarray, deviations: np.ndarray) -> list[str]:
    sizes = np.hypot(*errors.T)
    inside = np.mean(np.abs(errors) < 1.96 * deviations)
    return [
        f"{np.sqrt(np.mean(sizes**2)):.3f}",
        f"{sizes.max():.3f}",
        f"{100.0 * np.mean(sizes < 0.05):.0f} %",
        f"{100.0 * inside:.0f} %",
    ]


def model_table(names: Sequence[str], seeds: range, recipes: Sequence[str]) -> str:
    """Heading of the unseen turn, and autopilots on the ship."""
    rows = []
    for name in names:
        ship = ship_of(name)
        for title in recipes:
            for seed in seeds:
                logs, weather = logs_of(ship, seed)
                known = {
                    "particulars": ship.particulars,
                    "steering": ship.steering,
                    **RECIPES[title],
                }
                result = identify(logs, **known)
                with_both = heading_error(identify(logs, **known, **LEFT_IN))
                pilots = autopilots(result, ship, weather)
                cells = [
                    one if isinstance(one, str) else f"{one:.1f}"
                    for one in pilots.values()
                ]
                rows.append(
                    [
                        name,
                        title,
                        str(seed),
                        f"{heading_error(result):.1f}",
                        f"{with_both:.1f}",
                        *cells,
                    ]
                )
                print("|", " | ".join(rows[-1]), "|", file=sys.stderr, flush=True)
    head = [
        "ship",
        "recipe",
        "seed",
        "heading, deg rms",
        "current and wind left in",
        "PID, deg rms",
        "LQ, deg rms",
    ]
    return table(head, rows)


def structures_table(
    names: Sequence[str], seeds: range, structures: Sequence[str]
) -> str:
    """Heading error of the unseen turn by structures with their usual methods."""
    rows = []
    for name in names:
        ship = ship_of(name)
        for seed in seeds:
            logs, _ = logs_of(ship, seed)
            row = [name, str(seed)]
            for structure in structures:
                result = identify(
                    logs,
                    structure=structure,
                    particulars=ship.particulars,
                    steering=ship.steering,
                )
                chosen = result.model.structure if structure == "auto" else ""
                row.append(f"{heading_error(result):.1f} {chosen}".strip())
                print(row, file=sys.stderr, flush=True)
            rows.append(row)
    return table(["ship", "seed", *structures], rows)


#: Trials of a log, by their places in `sailed`.
PARTS = {
    "zigzag 10/10": [0],
    "zigzag 20/20": [1],
    "both zigzags": [0, 1],
    "35 deg turn": [2],
    "all three": [0, 1, 2],
}


def parts_table(names: Sequence[str], seeds: range) -> str:
    """How often a current is removed from logs of few trials, in calm weather."""
    rows = []
    for speed in (0.0, 0.6):
        cases: dict[str, list[tuple[float, bool]]] = {name: [] for name in PARTS}
        n_logs = 0
        for name in names:
            ship = ship_of(name)
            for seed in seeds:
                n_logs += 1
                logs, truth = calm_logs(ship, speed, seed)
                for part, places in PARTS.items():
                    chosen = [logs[place] for place in places]
                    cases[part] += removed_current(chosen, ship, truth)
        for part, found in cases.items():
            errors = [error for error, _ in found]
            inside = sum(is_inside for _, is_inside in found)
            rows.append(
                [
                    f"{speed:g} m/s",
                    part,
                    f"{len(found)} of {n_logs}",
                    f"{max(errors):.3f}" if errors else "-",
                    f"{inside} of {len(found)}" if found else "-",
                ]
            )
    head = ["current", "log", "removed", "largest error, m/s", "inside 95 %"]
    return table(head, rows)


def calm_logs(
    ship: ShipModel, speed: float, seed: int
) -> tuple[list[Trial], np.ndarray]:
    """Logs without wind, and the current to north and east, m/s."""
    towards = np.random.default_rng(seed).uniform(0.0, 360.0)
    logs = []
    for k, run in enumerate(sailed(ship, speed, towards, 0.0, 0.0, 100 * seed)):
        log = logged(run, 1000 * seed + k)
        if "n" not in log:
            log = log.with_channels({"n": np.ones(len(log))})
        logs.append(log)
    angle = np.radians(towards)
    return logs, speed * np.array([np.cos(angle), np.sin(angle)])


def removed_current(
    logs: list[Trial], ship: ShipModel, truth: np.ndarray
) -> list[tuple[float, bool]]:
    """Error of a removed current, m/s, and whether its 95 % intervals hold the truth.

    Nothing if none is removed.
    """
    _, found = in_still_water(logs, ship.particulars)
    row = found.get("currents", {}).get(logs[0].name)
    if row is None or not row["taken_out"]:
        return []
    error = np.array([row["north"], row["east"]]) - truth
    is_inside = np.abs(error) < 1.96 * np.array(row["standard_errors"])
    return [(float(np.hypot(*error)), bool(is_inside.all()))]


def wind_table(recipes: Sequence[str]) -> str:
    """Esso Osaka's zigzags, each predicted from the five others, with wind or not."""
    ship = ShipFile.load(ROOT / "tests/ships/esso_osaka_3m.toml")
    particulars = replace(ship.particulars, frontal_area=0.135, lateral_area=0.520)
    names = ("t", "u", "v", "r", "psi", "n", "delta")
    columns = dict(zip(names, names, strict=True)) | {
        "x": "x0",
        "y": "y0",
        "wind_speed": "wind_true_speed",
        "wind_from": "wind_true_dir",
    }
    paths = [
        path for entry in ship.entries for path in entry.paths if "zigzag" in path.name
    ]
    runs = [
        under_way(Trial.from_csv(path, columns, name=path.stem, kind="zigzag"))
        for path in paths
    ]
    known = {"particulars": particulars, "steering": ship.steering}
    rows = []
    for title in recipes:
        for wind in ("none", "auto", "constant")[: 2 if title == "mmg" else 3]:
            errors = []
            for held in runs:
                trials = [
                    run.with_(use="validate" if run is held else "fit") for run in runs
                ]
                result = identify(
                    trials,
                    wind=wind,
                    preprocessing=Preprocessing(repair=True),
                    **known,
                    **ESSO_OSAKA[title],
                )
                error = result.metrics["trials"][held.name]["rmse"]["psi"]
                errors.append(
                    float("nan") if error is None else float(np.degrees(error))
                )
            told = {"none": "left in", "auto": "from columns", "constant": "constant"}[
                wind
            ]
            rows.append(
                [title, told, *(f"{e:.1f}" for e in errors), f"{np.mean(errors):.1f}"]
            )
    return table(["recipe", "wind", *(run.name[-8:] for run in runs), "mean"], rows)


def under_way(trial: Trial) -> Trial:
    """Every other sample of a trial from where the ship has way on her."""
    first = int(np.argmax(np.hypot(trial["u"], trial["v"]) > 0.1))
    rows = slice(first, None, 2)
    return Trial(
        trial.t[rows],
        {name: v[rows] for name, v in trial.channels.items()},
        name=trial.name,
        kind=trial.kind,
    )


ESSO_OSAKA: dict[str, dict[str, Any]] = {
    "mmg": {"structure": "mmg"},
    "cubic": {"structure": "cubic"},
    "cubic, pulled to the tanker": {"structure": "cubic", "prior": "tanker"},
}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=8, help="for the current")
    parser.add_argument(
        "--models", type=int, default=2, help="seeds of models and autopilots"
    )
    parser.add_argument(
        "--first",
        type=int,
        default=100,
        help="first seed; below 10 the recipes were chosen",
    )
    parser.add_argument("--ships", default=",".join(SHIPS))
    parser.add_argument("--recipes", help="with semicolons between; by default all")
    parser.add_argument("--wind", action="store_true", help="Esso Osaka only")
    parser.add_argument("--parts", action="store_true", help="logs of few trials")
    parser.add_argument("--structures", help="names with commas between")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    every = ESSO_OSAKA if given.wind else RECIPES
    recipes = given.recipes.split(";") if given.recipes else list(every)
    if given.wind:
        print(wind_table(recipes))
        return
    names = given.ships.split(",")
    if given.structures:
        seeds = range(given.first, given.first + given.models)
        print(structures_table(names, seeds, given.structures.split(",")))
        return
    if given.parts:
        print(parts_table(names, range(given.first, given.first + given.seeds)))
        return
    if given.seeds:
        print(
            current_table(names, range(given.first, given.first + given.seeds)),
            end="\n\n",
            flush=True,
        )
    print(model_table(names, range(given.first, given.first + given.models), recipes))


if __name__ == "__main__":
    main()
