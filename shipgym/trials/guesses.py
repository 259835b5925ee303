"""Which column of a log holds which channel, guessed by its name and size, with the reason of each guess."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shipgym.errors import InputError
from shipgym.trials.csv_reader import Table
from shipgym.trials.navigation import NO_OFFSETS
from shipgym.trials.tables import read_log
from shipgym.trials.trial import Trial, read_trials
from shipgym.trials.trial_import import RUDDER_SIGNS, Conventions
from shipgym.trials.units import QUANTITIES, UNITS

#: Names of columns of each channel, in lower case, in the order in which they are tried.
NAMES: dict[str, str] = {
    "t": r"t|time.*|zeit.*|utc.*|timestamp|date.?time|clock", "lat": r"lat.*|breite.*|pos.*lat.*",
    "lon": r"lon.*|lng|länge.*|pos.*lon.*", "sog": r"sog.*|speed.?over.?ground.*|.*gps.?speed.*",
    "cog": r"cog.*|course.?over.?ground.*|track.*", "stw": r"stw.*|speed.?(through|thr).*|log.?speed.*|vlw.*",
    "psi": r"psi.*|head.*|hdg.*|hdt.*|gyro.*|yaw|yaw.?angle.*|kurs.*", "r": r"r|rot.*|rate.?of.?turn.*|yaw.?rate.*",
    "delta_command": r"delta_command|.*rudder.*(order|command|cmd|set).*",
    "delta": r"delta.*|rudder.*|rsa.*|ruder.*|helm.*", "n": r"n|rpm.*|rps.*|shaft.*|revs.*|drehzahl.*",
    "wind_speed": r".*wind.*(speed|geschw).*", "wind_from": r".*wind.*(dir|from|richt).*",
    "x": r"x|x0|north.*", "y": r"y|y0|east.*", "u": r"u|surge.*", "v": r"v|sway.*", "phi": r"phi|roll|heel.*",
}  # fmt: skip
#: Units as they stand in names of columns.
_UNITS = {
    "deg/min": r"(deg|°)/min", "deg/s": r"(deg|°)/s", "rad/s": r"rad/s", "rpm": r"rpm|1/min|/min", "rps": r"rps|1/s",
    "knots": r"kn|kts?|knots?", "km/h": r"km/?h", "m/s": r"m/s|mps", "deg": r"deg|degrees|°", "rad": r"rad",
}  # fmt: skip
#: Where the name has no unit: the size from which a channel cannot be in SI units, and what it is in then.
_LARGE = {"angle": (6.3, "deg"), "angular rate": (0.2, "deg/min"), "shaft speed": (10.0, "rpm"), "speed": (1e9, "m/s")}
_RUDDERS = ("delta", "delta_command", "phi")
_LARGEST_RUDDER = 1.0  # rad


class Guess(NamedTuple):
    """The column of a channel."""

    channel: str
    column: str
    unit: str
    reason: str

    @property
    def quoted(self) -> str:
        """The name of the column as TOML has it."""
        return json.dumps(self.column, ensure_ascii=False)

    @property
    def entry(self) -> dict[str, str]:
        """As a ship file has it."""
        return {"column": self.column, "unit": self.unit}


def guess_columns(table: Table) -> list[Guess]:
    """The channels of a table; none where no column has a name that is known."""
    found: dict[str, Guess] = {}
    for channel, pattern in NAMES.items():
        for name in table.header:
            bare = re.sub(r"[\[(].*", "", name.lower().replace("_", " ")).strip()
            if re.fullmatch(pattern, bare) and name not in {one.column for one in found.values()}:
                found[channel] = _guess(table, channel, name)
                break
    return list(found.values())


def _guess(table: Table, channel: str, name: str) -> Guess:
    quantity = QUANTITIES[channel]
    told = re.split(r"[\[( _]", name.lower().strip(" ])"))[-1]
    for unit, pattern in _UNITS.items():
        if unit in UNITS[quantity] and re.fullmatch(pattern, told):
            return Guess(channel, name, unit, "by its name")
    if quantity not in _LARGE:
        try:
            unix = channel == "t" and np.nanmin(table.numbers(name)) > 1e8
        except (InputError, ValueError):
            unix = False
        return Guess(channel, name, "unix" if unix else next(iter(UNITS[quantity])), "by what is in it")
    limit, unit = (_LARGEST_RUDDER, "deg") if channel in _RUDDERS else _LARGE[quantity]
    largest = float(np.nanmax(np.abs(table.numbers(name)), initial=0.0))
    unit = unit if largest > limit else next(iter(UNITS[quantity]))
    return Guess(channel, name, unit, f"by its size, up to {largest:.4g}")


def guess_trial(path: str | Path) -> tuple[list[Guess], str, Trial]:
    """The columns of a log, the side to which a positive rudder steers, and the log read so.

    Raises InputError, as the readers do, for a log that can be read with neither sign of the rudder.
    """
    table = read_log(path)
    guesses = [] if table.time_unit != "s" else guess_columns(table)
    columns = {one.channel: one.entry for one in guesses} or None
    first: InputError | None = None
    for side in RUDDER_SIGNS:
        conventions = Conventions(rudder_positive=side, instruments=NO_OFFSETS, where=f"{path}:")
        try:
            return guesses, side, read_trials([table], columns, conventions, name=Path(path).name)[0]
        except InputError as error:
            first = first or error
            if "rudder_positive" not in str(error):
                break
    raise InputError(str(first))


def ship_file_data(path: Path) -> dict[str, Any]:
    """What the template of a ship file is filled with, for a log and others that have its columns."""
    guesses, side, trial = guess_trial(path)
    speed = np.hypot(trial["u"], trial["v"]) if {"u", "v"} <= trial.channels.keys() else None
    fastest = None if speed is None else float(np.quantile(speed, 0.9))
    return {"guesses": guesses, "side": side, "trial": trial, "speed": fastest}
