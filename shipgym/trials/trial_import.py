"""From the columns of a file to channels in SI units with the project's signs, frame and origin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number, quoted
from shipgym.errors import InputError
from shipgym.trials.clock_offsets import corrected_clocks
from shipgym.trials.clock_texts import read_angles, read_clock, zone_seconds
from shipgym.trials.columns import Column, Source, choose_columns
from shipgym.trials.csv_reader import MISSING_WORDS, Table, is_number
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.mistakes import check_log, check_overlap, find_outliers
from shipgym.trials.navigation import Instruments, correct_offsets, local_metres, rotate_to_body, to_midship
from shipgym.trials.plausibility import check_consistency, check_heading, check_ranges
from shipgym.trials.resampling import have_own_clocks, on_one_clock, own_clock
from shipgym.trials.units import QUANTITIES, si_factor, si_unit

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
    instruments: Instruments = Instruments()

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


class Imported(NamedTuple):
    """What is read from one table or several, in SI units, with the project's signs, at midship."""

    t: Floats
    channels: dict[str, Floats]  # by name, shape (n_samples,)
    derived: frozenset[str]
    repaired: dict[str, int]  # how many values of a channel were filled in
    over_ground: bool | None
    notes: tuple[str, ...]
    start: float | None  # clock at t = 0 as the file has it, s since 1970 or of the day


class _Recorded(NamedTuple):
    """The chosen columns of one table, in SI units, on their own clocks."""

    series: dict[str, tuple[Floats, Floats]]  # time and values of each channel
    source: Source
    filled: dict[str, int]
    start: float | None  # as in `Imported`, but in UTC


def import_tables(
    tables: Sequence[Table], columns: Mapping[str, Any] | None, conventions: Conventions
) -> Imported:
    """Read channels from the tables of one trial, as a rule one.

    The columns are given as :func:`shipgym.trials.columns.choose_columns` takes them. The channels are in SI
    units, with the project's signs, in the body frame, at midship; each has shape (n_samples,). Anything
    wrong with a file is an InputError that names line, column, value and remedy.
    """
    chosen = [choose_columns(table, columns, len(tables) > 1) for table in tables]
    gnss = any("lat" in one for one in chosen)
    recorded = [_recorded(*pair, conventions.repair) for pair in zip(tables, chosen, strict=True)]
    series, source, where = _joined(recorded), recorded[0].source, str(tables[0].path)
    t, values, gaps = on_one_clock(series, where)
    late, notes = corrected_clocks(
        t, _signed(values, conventions), series, conventions.instruments.clock_offsets, where
    )
    if late:
        t, values, gaps = on_one_clock(late, where)
    notes = [*(note for table in tables for note in getattr(table, "notes", ())), *gaps, *notes]
    check_consistency(t, values, conventions.velocity_frame, source)
    notes += check_log(t, values, conventions.instruments, source, gnss)
    channels, derived, over_ground, more = to_project_conventions(t, values, conventions, where)
    repaired = {name: n for one in recorded for name, n in one.filled.items() if n and name in channels}
    start = recorded[0].start
    if start is not None:
        start += float(zone_seconds(chosen[0]["t"].zone, where))
    ordered = {name: channels[name] for name in QUANTITIES if name in channels}
    return Imported(t, ordered, derived, repaired, over_ground, (*notes, *more), start)


def _recorded(table: Table, chosen: dict[str, Column], repair: str | None) -> _Recorded:
    """Read the chosen columns of a table, check them, and fill what is missing where that is asked for."""
    t, start = _read_times(table, chosen)
    values = np.column_stack([t, _read_numbers(table, chosen)])
    if {"lat", "lon"} <= chosen.keys():
        values = _with_local_positions(table, chosen, values, repair)
    source = Source(table, chosen, np.arange(len(values)))
    present = np.isfinite(values)
    own_clocks = have_own_clocks(present[:, 1:])
    filled: dict[str, int] = {}
    if not own_clocks:
        values, source = _repaired(values, source, repair)
        filled = dict(zip(chosen, (~present)[source.rows].sum(axis=0).tolist(), strict=True))
    recorded = {
        channel: values[:, k] * si_factor(channel, column.unit)
        for k, (channel, column) in enumerate(chosen.items())
    }
    check_ranges(recorded, source)
    t = recorded.pop("t")
    if {"sog", "cog"} <= recorded.keys():
        speed, course = recorded.pop("sog"), recorded.pop("cog")
        recorded |= {"ground_north": speed * np.cos(course), "ground_east": speed * np.sin(course)}
    series = {channel: (t, column) for channel, column in recorded.items()}
    if own_clocks:
        series = {channel: own_clock(channel, t, column, source) for channel, column in recorded.items()}
    if "psi" in series:
        clock, raw_psi = series["psi"]
        series["psi"] = clock, np.unwrap(raw_psi)
        rows = source.rows[np.isfinite(recorded["psi"])]
        check_heading(clock, series["psi"][1], raw_psi, replace(source, rows=rows))
    return _Recorded(series, source, filled, start)


def _read_times(table: Table, chosen: dict[str, Column]) -> tuple[Floats, float | None]:
    """Time of each row in the unit of its column, and the clock at zero in UTC where the column has one.

    The column is noted to be in seconds where it holds texts or counts from 1970.
    """
    column = chosen["t"]
    if column.name not in table.header or not (cells := table.texts(column.name)):
        return table.numbers([column.name])[:, 0], None
    dates = None if column.date is None else table.texts(column.date)
    first = next((cell for cell in cells if cell.lower() not in MISSING_WORDS), "0")
    if dates is None and is_number(first):
        values = table.numbers([column.name])[:, 0]
        if not column.unit.startswith("unix"):
            return values, None
        values = values * si_factor("t", column.unit)
    else:
        try:
            values, _ = read_clock(cells, dates)
        except ValueError as error:
            row = next((k for k, cell in enumerate(cells) if cell in str(error)), 0)
            raise InputError(
                f"{table.path}: {table.place(row)}, column '{column.name}': no time that can be read: "
                f"{str(error)!r} found, expected seconds, ISO 8601 (2024-05-31T09:30:00), or a time of day "
                "with "
                f'its date in a column of its own: t = {{ column = "{column.name}", date = "..." }}'
            ) from None
    chosen["t"] = replace(column, unit="s")
    known = values[np.isfinite(values)]
    zero = float(known[0]) if known.size else 0.0
    return values - zero, zero - zone_seconds(column.zone, str(table.path))


def _read_numbers(table: Table, chosen: Mapping[str, Column]) -> Floats:
    """The other columns, shape (n_rows, n_columns), latitude and longitude in degrees whatever they are "
    "in.
    """
    angles = [name for name in ("lat", "lon") if name in chosen]
    names = [column.name for channel, column in chosen.items() if channel not in ("t", *angles)]
    numbers = iter(table.numbers(names).T)
    return np.column_stack(
        [
            _read_position(table, column) if channel in angles else next(numbers)
            for channel, column in chosen.items()
            if channel != "t"
        ]
    )


def _read_position(table: Table, column: Column) -> Floats:
    minutes = column.unit != "deg"
    cells = ["" if cell.lower() in MISSING_WORDS else cell for cell in table.texts(column.name)]
    try:
        return read_angles(cells, minutes)
    except ValueError as error:
        found = str(error)
    try:
        return table.numbers([column.name])[:, 0]
    except InputError:
        row = cells.index(found) if found in cells else 0
        raise InputError(
            f"{table.path}: {table.place(row)}, column '{column.name}': {found!r} found, expected a latitude "
            "or "
            "longitude in degrees (57.6872), degrees and minutes (57°41.234'N) or ddmm.mmm (5741.234N)"
        ) from None


def _with_local_positions(
    table: Table, chosen: dict[str, Column], values: Floats, repair: str | None
) -> Floats:
    """The columns with metres from the first position as x and y in place of latitude and longitude."""
    names = list(chosen)
    lat, lon = (values[:, names.index(name)] for name in ("lat", "lon"))
    source = Source(table, dict(chosen), np.arange(len(values)))
    check_ranges({"lat": lat, "lon": lon}, source)
    here = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon) & np.isfinite(values[:, 0]))
    local = np.full((2, lat.size), np.nan)
    if here.size:
        local[:, here] = local_metres(lat[here], lon[here], (lat[here[0]], lon[here[0]]))
        far = find_outliers(values[here, 0] * si_factor("t", chosen["t"].unit), local[:, here], source, here)
        if far.size and repair is None:
            k = int(far[0])
            raise InputError(
                f"{source.at(k, 'lat')}: position {lat[k]:.5f}, {lon[k]:.5f} found, an outlier that no ship "
                f"reaches from the positions beside it ({far.size} of {here.size}); empty it, or leave such "
                "ones "
                'out with repair = "interpolate"'
            )
        local[:, far] = np.nan
    for name, new, column in (("lat", "x", local[0]), ("lon", "y", local[1])):
        values[:, names.index(name)] = column
        names[names.index(name)] = new
    columns = [
        replace(column, unit=si_unit(name)) if name in ("x", "y") else column
        for name, column in zip(names, chosen.values(), strict=True)
    ]
    chosen.clear()
    chosen.update(zip(names, columns, strict=True))
    return values


def _joined(recorded: Sequence[_Recorded]) -> dict[str, tuple[Floats, Floats]]:
    """The channels of all tables on the clock of the first."""
    series = dict(recorded[0].series)
    base = recorded[0]
    for other in recorded[1:]:
        shift = (other.start or 0.0) - (base.start or 0.0)
        paths = base.source.table.path, other.source.table.path
        if (base.start is None) != (other.start is None):
            raise InputError(
                f"{paths[1]}: its time does not count as that of {paths[0]}, one of them has no clock, "
                "expected "
                "both to count from one moment; log clock time in both"
            )
        clocks = [clock for clock, _ in base.series.values()]
        first, last = min(clock[0] for clock in clocks), max(clock[-1] for clock in clocks)
        clock = next(iter(other.series.values()))[0]
        check_overlap(first, last, clock + shift, paths, other.source.columns["t"].name)
        twice = series.keys() & other.series.keys()
        if twice:
            raise InputError(
                f"{paths[1]}: {quoted(sorted(twice))} stands in {paths[0]} too, expected each channel in one "
                "file; name its column in [columns] by that file's header alone"
            )
        series |= {name: (clock + shift, values) for name, (clock, values) in other.series.items()}
    return series


def to_project_conventions(
    t: Floats, recorded: Mapping[str, Floats], conventions: Conventions, where: str
) -> tuple[dict[str, Floats], frozenset[str], bool | None, list[str]]:
    """Convert signs, frame and origin, and derive the channels that follow from others.

    The recorded channels are in SI units with the file's conventions, the heading without jumps, of shape
    (n_samples,); time is in s. The yaw rate is derived from the heading, surge and sway from position and
    heading, the heading (relative to the start) from the yaw rate where no position is recorded. Returns the
    channels, the names of the derived ones, whether surge and sway are over ground, and remarks.
    """
    channels = _signed(recorded, conventions)
    derived: set[str] = set()
    notes = correct_offsets(t, channels, conventions.instruments, where)
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
    water = "stw" in channels
    notes += to_midship(t, channels, derived, conventions.instruments, where)
    over_ground = False if water else (conventions.velocity_frame == "earth" and "u" in recorded) or None
    return channels, frozenset(derived), over_ground, notes


def _signed(recorded: Mapping[str, Floats], conventions: Conventions) -> dict[str, Floats]:
    """The channels with a rudder that is positive to starboard."""
    turned = ("delta", "delta_command") if conventions.rudder_positive == "port" else ()
    return {name: 0.0 - values if name in turned else values for name, values in recorded.items()}


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
