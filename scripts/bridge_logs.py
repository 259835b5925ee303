"""Currents, models and autopilots from logs as ships make them, in current and wind.

    python scripts/bridge_logs.py [--seeds 8] [--models 2] [--ships kcs,tanker]

prints the tables of docs/logs.md.

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
from typing import Any

import numpy as np
from foreign_ships import ship_names, ship_of, with_shaft
from real_ships.section import table
from sensors import GNSS, Sensor, Sensors

from agents.controllers.lq import LQ
from agents.controllers.pid import PID
from agents.rollouts.course_keeping import sail
from agents.verification.closed_loop import ClosedLoop
from agents.verification.refusal import why_refused
from agents.verification.tracks import judged_task
from identification import IdentificationResult, identify
from identification.judging.warnings import why_unstable
from identification.samples.still_water import in_still_water
from shipgym import ShipModel, Trial
from shipgym.errors import InputError
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.sea import Current, Weather, Wind
from shipgym.tasks.task import course_keeping_task
from shipgym.trials.conventions import Conventions
from shipgym.trials.midship import to_project_conventions
from shipgym.trials.resampling import Log
from tests.ships.mmg import MMG_SHIPS

SHIPS = ("mariner", "container", "tanker", "kvlcc2", *MMG_SHIPS)
FIRST_SEED = 100  # below 10 the recipes were chosen
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
        logs.append(with_shaft(logged(run, 1000 * seed + k)))
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


def model_table(names: Sequence[str], seeds: range) -> str:
    """Heading of the unseen turn, and autopilots on the ship."""
    rows = []
    for name in names:
        ship = ship_of(name)
        for title in RECIPES:
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


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=8, help="for the current")
    parser.add_argument("--models", type=int, default=2, help="seeds of models")
    parser.add_argument("--ships", type=ship_names, default=list(SHIPS))
    given = parser.parse_args()
    warnings.simplefilter("ignore")

    print(current_table(given.ships, range(FIRST_SEED, FIRST_SEED + given.seeds)))
    print()
    print(model_table(given.ships, range(FIRST_SEED, FIRST_SEED + given.models)))


if __name__ == "__main__":
    main()
