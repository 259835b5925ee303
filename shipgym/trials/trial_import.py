"""From the columns of a CSV file to channels in SI units with the project's signs, frame and origin."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError
from shipgym.trials.columns import Source, choose_columns
from shipgym.trials.csv_reader import read_table
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.plausibility import check_consistency, check_heading, check_ranges
from shipgym.trials.units import QUANTITIES, si_factor

RUDDER_SIGNS = ("starboard", "port")
VELOCITY_FRAMES = ("body", "earth")
ORIGINS = ("midship", "cg")
REPAIRS = ("interpolate",)

#: A run of more rows without a value that lasts more median time steps is too long to fill.
LONGEST_HOLE_ROWS = 10
LONGEST_HOLE_STEPS = 20.0
#: Time that goes on by less stands still.
SHORTEST_STEP_S = 1e-9


@dataclass(frozen=True)
class Conventions:
    """Signs, frame and origin of a file, and how missing values are treated: as in `Trial.from_csv`.

    With `repair`, holes of more than 10 rows and 20 time steps are refused all the same; `where` begins the
    messages, such as ``"ship.toml: [conventions]"``.
    """

    rudder_positive: str = "starboard"
    velocity_frame: str = "body"
    origin: str = "midship"
    xg: float | None = None
    repair: str | None = None
    where: str = "conventions"

    def __post_init__(self) -> None:
        check_choice(self.rudder_positive, RUDDER_SIGNS, f"{self.where} rudder_positive")
        check_choice(self.velocity_frame, VELOCITY_FRAMES, f"{self.where} velocity_frame")
        check_choice(self.origin, ORIGINS, f"{self.where} origin")
        if self.repair is not None:
            check_choice(self.repair, REPAIRS, f"{self.where} repair")
        if self.xg is not None:
            check_number(self.xg, f"{self.where} xg")
        elif self.origin == "cg":
            raise InputError(
                f"{self.where} origin: 'cg' found without xg, expected the distance of the centre of gravity "
                'forward of midship, m; give xg, or origin = "midship"'
            )


def import_csv(
    path: Path, columns: Mapping[str, Any] | None, conventions: Conventions
) -> tuple[Floats, dict[str, Floats], frozenset[str], dict[str, int]]:
    """Read a CSV file: time, channels, names of the derived channels and counts of the repaired values.

    The columns are given as :func:`shipgym.trials.columns.choose_columns` takes them. The channels are in SI
    units, with the project's signs, in the body frame, at midship; each has shape (n_samples,). Anything
    wrong with the file is an InputError that names line, column, value and remedy.
    """
    table = read_table(path)
    chosen = choose_columns(table, columns)
    values = table.numbers([column.name for column in chosen.values()])
    source = Source(table, chosen, np.arange(len(values)))
    missing = ~np.isfinite(values)
    values, source = _repaired(values, source, conventions.repair)
    filled = dict(zip(chosen, missing[source.rows].sum(axis=0).tolist(), strict=True))
    recorded = {
        channel: values[:, k] * si_factor(channel, column.unit)
        for k, (channel, column) in enumerate(chosen.items())
    }
    check_ranges(recorded, source)
    t = recorded.pop("t")
    if "psi" in recorded:
        raw_psi = recorded["psi"]
        recorded["psi"] = np.unwrap(raw_psi)
        check_heading(t, recorded["psi"], raw_psi, source)
    check_consistency(t, recorded, conventions.velocity_frame, source)
    channels, derived = to_project_conventions(t, recorded, conventions, str(path))
    repaired = {name: count for name, count in filled.items() if count}
    return t, {name: channels[name] for name in QUANTITIES if name in channels}, derived, repaired


def to_project_conventions(
    t: Floats, recorded: Mapping[str, Floats], conventions: Conventions, where: str
) -> tuple[dict[str, Floats], frozenset[str]]:
    """Convert signs, frame and origin, and derive the channels that follow from others; also their names.

    The recorded channels are in SI units with the file's conventions, the heading without jumps, of shape
    (n_samples,); time is in s. The yaw rate is derived from the heading, surge and sway from position and
    heading, the heading (relative to the start) from the yaw rate where no position is recorded.
    """
    channels = dict(recorded)
    derived: set[str] = set()
    if conventions.rudder_positive == "port":
        channels.update(
            {name: 0.0 - channels[name] for name in ("delta", "delta_command") if name in channels}
        )
    if "psi" in channels and "r" not in channels:
        channels["r"] = time_derivative(t, channels["psi"])
        derived.add("r")
    if "r" in channels and not {"psi", "x", "y"} & channels.keys():
        channels["psi"] = _antiderivative(t, channels["r"])
        derived.add("psi")
    if conventions.velocity_frame == "earth":
        _earth_to_body(channels, derived, where)
    if conventions.origin == "cg":
        _cg_to_midship(channels, conventions.xg or 0.0, where)
    if {"x", "y", "psi"} <= channels.keys() and not {"u", "v"} <= channels.keys():
        north, east = time_derivative(t, channels["x"]), time_derivative(t, channels["y"])
        for name, values in zip(("u", "v"), rotate_to_body(north, east, channels["psi"]), strict=True):
            if name not in channels:
                channels[name] = values
                derived.add(name)
    return channels, frozenset(derived)


def rotate_to_body(north: Floats, east: Floats, psi: Floats) -> tuple[Floats, Floats]:
    """Surge and sway from north and east velocity, m/s, and heading, rad; all of shape (n_samples,)."""
    c, s = np.cos(psi), np.sin(psi)
    return north * c + east * s, east * c - north * s


def _earth_to_body(channels: dict[str, Floats], derived: set[str], where: str) -> None:
    if not {"u", "v"} & channels.keys():
        return
    absent = [name for name in ("u", "v", "psi") if name not in channels or name in derived]
    if absent:
        raise InputError(
            f'{where}: velocity_frame = "earth" found without a recorded {absent[0]}, expected u (north), '
            "v (east) and the heading psi; name their columns, or leave u and v out"
        )
    channels["u"], channels["v"] = rotate_to_body(channels["u"], channels["v"], channels["psi"])


def _cg_to_midship(channels: dict[str, Floats], xg: float, where: str) -> None:
    """Move position, sway and yaw moment from the centre of gravity to midship: v = v_cg - xg r."""
    needed = {"v": "r", "x": "psi", "y": "psi", "N": "Y"}
    for name, other in needed.items():
        if name in channels and other not in channels:
            raise InputError(
                f'{where}: origin = "cg" needs {other} to move {name} to midship; name its column'
            )
    if "v" in channels:
        channels["v"] = channels["v"] - xg * channels["r"]
    if "x" in channels:
        channels["x"] = channels["x"] - xg * np.cos(channels["psi"])
    if "y" in channels:
        channels["y"] = channels["y"] - xg * np.sin(channels["psi"])
    if "N" in channels:
        channels["N"] = channels["N"] + xg * channels["Y"]


def _antiderivative(t: Floats, values: Floats) -> Floats:
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(t, values, k=min(3, t.size - 1)).antiderivative()
    return np.asarray(spline(t) - spline(t[0]), dtype=np.float64)


def _repaired(values: Floats, source: Source, repair: str | None) -> tuple[Floats, Source]:
    """Refuse or fill missing values of shape (n_rows, n_columns), time first, and check the time."""
    names = list(source.columns)
    missing = ~np.isfinite(values)
    rows, columns = np.nonzero(missing)
    if rows.size and (repair is None or missing[:, 0].any()):
        k = int(np.argmax(missing[:, 0])) if repair is not None else int(rows[0])
        channel = names[0] if repair is not None else names[int(columns[0])]
        remedy = (
            "time cannot be interpolated, remove the row"
            if channel == "t"
            else 'repair = "interpolate" fills it from its neighbours, or remove the row'
        )
        found = values[k, names.index(channel)]
        raise InputError(
            f"{source.at(k, channel)}: no value ({found:g}) found, expected a number; {remedy} "
            f"({np.unique(rows).size} of {len(values)} rows lack a value)"
        )
    _check_time(values, source)
    if not rows.size:
        return values, source
    whole = np.flatnonzero(~missing.any(axis=1))
    if whole.size < max(3, len(values) // 2):
        raise InputError(
            f"{source.table.path}: only {whole.size} of {len(values)} rows are without missing values, "
            "expected at least half of them (and 3) to interpolate from; leave out the column that is mostly "
            "empty"
        )
    kept = slice(int(whole[0]), int(whole[-1]) + 1)
    filled = values[kept].copy()
    repaired = Source(source.table, source.columns, source.rows[kept])
    for k in range(1, len(names)):
        _check_holes(filled[:, 0], missing[kept, k], names[k], repaired)
        _fill(filled[:, 0], filled[:, k], unwrap=names[k] == "psi", unit=source.columns[names[k]].unit)
    return filled, repaired


def _check_holes(t: Floats, missing: npt.NDArray[np.bool_], channel: str, source: Source) -> None:
    """Refuse to fill a hole of many rows; the first and the last row are whole."""
    edges = np.flatnonzero(np.diff(missing))
    first, after = edges[::2] + 1, edges[1::2] + 1
    long = (after - first > LONGEST_HOLE_ROWS) & (
        t[after] - t[first - 1] > LONGEST_HOLE_STEPS * np.median(np.diff(t))
    )
    if long.any():
        i = int(np.argmax(long))
        unit = source.columns["t"].unit
        raise InputError(
            f"{source.at(int(first[i]), channel)}: {after[i] - first[i]} rows without a value, over "
            f"{t[after[i]] - t[first[i] - 1]:g} {unit}, expected at most {LONGEST_HOLE_STEPS:g} time steps "
            "to interpolate over; split the file there, or leave out the rows or the column"
        )


def _fill(t: Floats, column: Floats, *, unwrap: bool, unit: str) -> None:
    """Fill the gaps of a column in place, by a shape-preserving cubic (PCHIP) through its neighbours."""
    from scipy.interpolate import PchipInterpolator

    gaps = ~np.isfinite(column)
    if not gaps.any():
        return
    known = column[~gaps]
    if unwrap:
        known = np.unwrap(known, period=2.0 * np.pi / si_factor("psi", unit))
    column[gaps] = PchipInterpolator(t[~gaps], known)(t[gaps])
    column[~gaps] = known


def _check_time(values: Floats, source: Source) -> None:
    t = values[:, 0]
    unit = source.columns["t"].unit
    if t.size < 3:
        raise InputError(
            f"{source.table.path}: {t.size} samples found, expected at least 3 rows below the header; "
            "export the whole manoeuvre"
        )
    back = np.diff(t) <= SHORTEST_STEP_S / si_factor("t", unit)
    if back.any():
        k = int(np.argmax(back))
        verb = "stands still at" if t[k + 1] >= t[k] else f"goes back from {t[k]:.10g} to"
        raise InputError(
            f"{source.at(k + 1, 't')}: time {verb} {t[k + 1]:.10g} {unit}, expected it to increase from row "
            "to row; sort the rows, remove the repeated ones, or split the file into one per run"
        )
