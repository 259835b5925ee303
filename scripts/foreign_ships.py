"""Ships of other equations, their trials, and kept rows: what the studies share."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from sensors import Sensors  # noqa: E402

import shipgym  # noqa: E402 - the folder above has to be found first
from identification import IdentificationResult, identify  # noqa: E402
from identification.judging.selection import RESPONSES  # noqa: E402
from identification.models.refinement import whole_trials  # noqa: E402
from shipgym import ShipModel, Trial  # noqa: E402
from shipgym.errors import InputError  # noqa: E402
from shipgym.manoeuvres import zigzag  # noqa: E402
from tests.ships.foreign import FOREIGN  # noqa: E402

Row = dict[str, Any]
ANGLES = (10.0, 20.0)  # of the zigzags, deg


def ship_of(name: str) -> ShipModel:
    """A ship by name, the truth behind the trials."""
    return FOREIGN[name]() if name in FOREIGN else shipgym.load_model(name)


def ship_names(text: str) -> list[str]:
    """Names of ships, separated by commas, as an argument; exit code 2 for unknown."""
    names = text.split(",")
    for name in names:
        try:
            ship_of(name)
        except InputError as error:
            foreign = ", ".join(FOREIGN)
            raise argparse.ArgumentTypeError(f"{error}; or of {foreign}") from None
    return names


def with_shaft(run: Trial) -> Trial:
    """The trial with a steady shaft where the ship has no shaft."""
    return run if "n" in run else run.with_channels({"n": np.ones(len(run.t))})


def sea_trials(ship: ShipModel, seed: int) -> list[Trial]:
    """Zigzags 10/10 and 20/20 to both sides, with the noise of sensors."""
    travel = ship.particulars["length"] / ship.particulars["speed"]
    dt = min(0.25, travel / 80.0)
    sensors = Sensors(sampling_s=max(min(1.0, travel / 20.0), dt))
    trials = []
    for angle in ANGLES:
        for port in (False, True):
            run = zigzag(ship, angle, angle, port, 35.0 * travel, dt)
            name = f"{angle:.0f} {'port' if port else 'starboard'}"
            noise_seed = 100 * seed + len(trials)
            measured = sensors.measure(with_shaft(run.with_(name=name)), noise_seed)
            trials.append(measured)
    return trials


def identified(
    ship: ShipModel, structure: str, trials: list[Trial], **settings: Any
) -> IdentificationResult:
    """A ship identified by a structure, with the method that `auto` uses for it."""
    if structure in RESPONSES:
        settings["method"] = whole_trials()
    if structure == "grey-box":
        settings |= {"method": "rm-svm", "reference_model": "auto"}
    return identify(
        trials,
        structure,
        particulars=ship.particulars,
        steering=ship.steering,
        **settings,
    )


class KeptRows:
    """Rows of a study in a file of JSON lines: a second call does what is left.

    Parameters
    ----------
    path : Path
        The file; it need not exist.
    case : sequence of str
        Fields of a row that say which case it is.
    """

    def __init__(self, path: Path, case: Sequence[str]) -> None:
        self.path = path
        self.case = tuple(case)
        self.rows: list[Row] = []
        if path.exists():
            lines = path.read_text("utf-8").splitlines()
            self.rows = [json.loads(line) for line in lines]

    def __contains__(self, case: tuple[Any, ...]) -> bool:
        """True if there is a row of a case."""
        return any(case == tuple(row[name] for name in self.case) for row in self.rows)

    def add(self, row: Row) -> None:
        """Add a row, also to the file."""
        self.rows.append(row)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, default=_plain) + "\n")


def _plain(value: Any) -> Any:
    """Array or number of NumPy as JSON has it."""
    return value.tolist()
