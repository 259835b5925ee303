"""Logs as ships make them: models and currents identified from them, in current and wind."""

from __future__ import annotations

import argparse
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

import shipgym  # noqa: E402 - the folder above has to be found first
from shipgym import ShipModel, Trial  # noqa: E402
from shipgym.manoeuvres import turning_circle, zigzag  # noqa: E402
from shipgym.sea.conditions import Current, Weather, Wind  # noqa: E402
from shipgym.trials.sensors import GNSS, Sensor, Sensors  # noqa: E402
from shipgym.trials.trial_import import Conventions, to_project_conventions  # noqa: E402
from tests.ships.mmg import MMG_SHIPS, mmg_ship  # noqa: E402

SHIPS = ("mariner", "container", "tanker", "kvlcc2", *MMG_SHIPS)
ANTENNA = 25.0  # m forward of midship
DEGREE = np.pi / 180.0
LOG = Sensors(
    {"x": GNSS, "y": GNSS, "psi": Sensor(noise=0.1 * DEGREE), "delta": Sensor(resolution=0.5 * DEGREE),
     "n": Sensor(resolution=0.1 / 60.0)},
)  # fmt: skip


def ship_of(name: str) -> ShipModel:
    """A ship by name, the truth behind the logs."""
    return mmg_ship(name) if name in MMG_SHIPS else shipgym.load_model(name)


def turned(run: Trial, angle: float) -> Trial:
    """A run as it would have been with north `angle` further to port, rad."""
    c, s = np.cos(angle), np.sin(angle)
    channels = dict(run.channels)
    channels["x"], channels["y"] = c * run["x"] - s * run["y"], s * run["x"] + c * run["y"]
    for name in {"psi", "wind_from"} & channels.keys():
        channels[name] = run[name] + angle
    if "current_north" in run:
        north, east = run["current_north"], run["current_east"]
        channels |= {"current_north": c * north - s * east, "current_east": s * north + c * east}
    return Trial(run.t, channels, name=run.name, kind=run.kind, use=run.use, length=run.length)


def sailed(
    ship: ShipModel, current: float, towards: float, wind: float, wind_from: float, seed: int
) -> list[Trial]:
    """Zigzags and a turn of a ship, each begun on another heading, and a turn to the other side."""
    travel = ship.particulars["length"] / ship.particulars["speed"]
    rng = np.random.default_rng(seed)
    runs = []
    for k, (kind, angle, side) in enumerate(
        [("zigzag", 10.0, 1.0), ("zigzag", 20.0, -1.0), ("turn", 35.0, 1.0), ("turn", 25.0, -1.0)]
    ):
        heading = rng.uniform(0.0, 360.0)
        weather = Weather(
            Current(current, (towards - heading) % 360.0),
            Wind(wind, (wind_from - heading) % 360.0) if wind else None,
        )
        if kind == "zigzag":
            run = zigzag(ship, angle, angle, side < 0, 35.0 * travel, 0.5, weather=weather, seed=seed + k)
        else:
            run = turning_circle(ship, side * angle, 25.0 * travel, 0.5, weather=weather, seed=seed + k)
        name = f"{kind} {angle:.0f} {'starboard' if side > 0 else 'port'}"
        use = "validate" if k == 3 else "fit"
        runs.append(turned(run.with_(name=name, use=use), heading * DEGREE))
    return runs


def logged(run: Trial, seed: int) -> Trial:
    """What a bridge log holds of a run: GNSS positions at 1 Hz, gyro at 2 Hz, rudder in half degrees."""
    antenna = run.with_channels(
        {"x": run["x"] + ANTENNA * np.cos(run["psi"]), "y": run["y"] + ANTENNA * np.sin(run["psi"])}
    )
    read = LOG.measure(antenna, seed)
    rng = np.random.default_rng([seed, 7])
    channels = {name: read[name] for name in ("x", "y", "psi", "delta", "n") if name in read}
    if "wind_speed" in run and np.ptp(run["wind_speed"]) > 0.0:
        channels["wind_speed"] = np.maximum(run["wind_speed"] + rng.normal(0.0, 0.5, len(run)), 0.0)
        channels["wind_from"] = run["wind_from"] + rng.normal(0.0, 5.0 * DEGREE, len(run))
    for name in ("x", "y"):  # at 1 Hz, between which the reader interpolates
        channels[name] = np.interp(read.t, read.t[::2], channels[name][::2])
    channels["x"] = channels["x"] - ANTENNA * np.cos(channels["psi"])
    channels["y"] = channels["y"] - ANTENNA * np.sin(channels["psi"])
    every = slice(None, None, 2)
    channels = {name: values[every] for name, values in channels.items()}
    t = read.t[every]
    made, derived = to_project_conventions(t, channels, Conventions(), run.name)
    return Trial(t, made, name=run.name, kind=run.kind, use=run.use, derived=derived, length=run.length)
