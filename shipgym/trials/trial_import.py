"""From the columns of a file to channels in SI units with the project's signs, frame and origin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_choice, check_number, quoted
from shipgym.errors import InputError
from shipgym.trials import navigation, plausibility
from shipgym.trials.clock_offsets import corrected_clocks
from shipgym.trials.clock_texts import read_angles, read_clock, zone_seconds
from shipgym.trials.columns import Column, Source, choose_columns
from shipgym.trials.csv_reader import Table, is_number
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.resampling import (
    Log,
    Series,
    have_own_clocks,
    on_one_clock,
    own_clock,
)
from shipgym.trials.units import QUANTITIES, si_factor

RUDDER_SIGNS = ("starboard", "port")
_REPAIRED = (("repair", "interpolate"),)

#: A run of more rows without a value that lasts more median time steps is too long to
#: fill.
LONGEST_HOLE_ROWS = 10
LONGEST_HOLE_STEPS = 20.0
#: Time that goes on by less stands still.
SHORTEST_STEP_S = 1e-9


@dataclass(frozen=True)
class Conventions:
    """Signs, frame and origin of a file, and how missing values are treated: as in `Trial.from_csv`.

    With `repair`, holes of more than 10 rows and 20 time steps are refused all the
    same; `where` begins the messages, such as ``"ship.toml: [conventions]"``.
    """

    rudder_positive: str = "starboard"
    velocity_frame: str = "body"
    origin: str = "midship"
    xg: float | None = None
    repair: str | None = None
    where: str = "conventions"
    instruments: navigation.Instruments = navigation.NO_OFFSETS

    def __post_init__(self) -> None:
        check_choice(
            self.rudder_positive, RUDDER_SIGNS, f"{self.where} rudder_positive"
        )
        check_choice(
            self.velocity_frame, ("body", "earth"), f"{self.where} velocity_frame"
        )
        check_choice(self.origin, ("midship", "cg"), f"{self.where} origin")
        if self.repair is not None:
            check_choice(self.repair, ("interpolate",), f"{self.where} repair")
        if self.xg is not None:
            check_number(self.xg, f"{self.where} xg")
        elif self.origin == "cg":
            raise InputError(
                f"{self.where} origin: 'cg' found without xg, expected the distance of"
                " the centre of gravity forward of midship, m; give xg, or origin ="
                ' "midship"'
            )


class _Recorded(NamedTuple):
    """The chosen columns of one table, in SI units, on their own clocks."""

    series: Series
    source: Source
    filled: dict[str, int]
    start: float | None  # as in `Log`, but in UTC


def import_tables(
    tables: Sequence[Table], columns: Mapping[str, Any] | None, conventions: Conventions
) -> Log:
    """Read channels from the tables of one log, as a rule one.

    The columns are given as :func:`shipgym.trials.columns.choose_columns` takes them.
    The channels have the project's signs and are in the body frame, at midship.
    Anything wrong with a file is an InputError that names line, column, value and
    remedy.
    """
    tools = conventions.instruments
    chosen = [choose_columns(table, columns, len(tables) > 1) for table in tables]
    gnss = any("lat" in one for one in chosen)
    recorded = [
        _recorded(*pair, conventions.repair)
        for pair in zip(tables, chosen, strict=True)
    ]
    series, source, where = _joined(recorded), recorded[0].source, str(tables[0].path)
    if conventions.rudder_positive == "port":
        for name in {"delta", "delta_command"} & series.keys():
            series[name] = series[name][0], 0.0 - series[name][1]
    log = on_one_clock(series, where)
    told = plausibility.check_log(log, tools, source, gnss)
    late, found = corrected_clocks(log, series, tools.clock_offsets)
    if late:
        log = on_one_clock(late, where)
    log.notes = [
        *(note for table in tables for note in table.notes),
        *log.notes,
        *told,
        *found,
    ]
    plausibility.check_consistency(log, conventions.velocity_frame, source)
    to_project_conventions(log, conventions)
    log.channels = {
        name: log.channels[name] for name in QUANTITIES if name in log.channels
    }
    filled = {name: n for one in recorded for name, n in one.filled.items()}
    log.repaired = {name: n for name, n in filled.items() if n and name in log.channels}
    if (start := recorded[0].start) is not None:
        log.start = start + zone_seconds(chosen[0]["t"].zone, where)
    return log


def _recorded(table: Table, chosen: dict[str, Column], repair: str | None) -> _Recorded:
    """Read the chosen columns of a table, check them, and fill what is missing where that is asked for."""
    for name, other in (("lat", "lon"), ("lon", "lat"), ("sog", "cog"), ("cog", "sog")):
        if name in chosen and other not in chosen:
            raise InputError(
                f"{table.path}: columns: {name} found without {other}, expected both;"
                " name its column"
            )
    t, start = _read_times(table, chosen)
    numbers = {
        c: table.numbers(column.name)
        for c, column in chosen.items()
        if c not in ("t", "lat", "lon")
    }
    filled: dict[str, int] = {}
    if "lat" in chosen:
        positions, outliers = _local_positions(table, chosen, t, repair)
        numbers |= positions
        filled = dict.fromkeys(positions, outliers)
        chosen |= {
            new: replace(chosen.pop(old), unit="m")
            for new, old in (("x", "lat"), ("y", "lon"))
        }
    values = np.column_stack([t, *numbers.values()])
    source = Source(
        table, {name: chosen[name] for name in ("t", *numbers)}, np.arange(len(values))
    )
    present = np.isfinite(values)
    own_clocks = bool(present[:, 0].all()) and have_own_clocks(present[:, 1:])
    if not own_clocks:
        values, source = _repaired(values, source, repair)
        filled = dict(
            zip(
                source.columns,
                (~present)[source.rows].sum(axis=0).tolist(),
                strict=True,
            )
        )
    recorded = {
        channel: values[:, k] * si_factor(channel, column.unit)
        for k, (channel, column) in enumerate(source.columns.items())
    }
    plausibility.check_ranges(recorded, source)
    t = recorded.pop("t")
    series = {
        channel: own_clock(channel, t, column, source) if own_clocks else (t, column)
        for channel, column in recorded.items()
    }
    for name in {"psi", "wind_from"} & series.keys():
        clock, raw = series[name]
        series[name] = clock, np.unwrap(raw)
        if name == "psi":
            rows = source.rows[np.isfinite(recorded["psi"])]
            plausibility.check_heading(
                clock, series["psi"][1], raw, replace(source, rows=rows)
            )
    if "sog" in series:
        (clock, speed), (_, course) = series.pop("sog"), series.pop("cog")
        if speed.size != course.size:
            raise InputError(
                f"{table.path}: sog has {speed.size} values and cog {course.size},"
                " expected both in a row"
            )
        series["ground_north"] = clock, speed * np.cos(course)
        series["ground_east"] = clock, speed * np.sin(course)
    return _Recorded(series, source, filled, start)


def _read_times(table: Table, chosen: dict[str, Column]) -> tuple[Floats, float | None]:
    """Time of each row in the unit of its column, and the clock at zero in UTC where the column has one.

    The column is in seconds from now on where it holds texts or counts from 1970.
    """
    column = chosen["t"]
    cells = table.texts(column.name)
    if column.date is not None:
        cells = [
            f"{date} {time}".strip()
            for date, time in zip(table.texts(column.date), cells, strict=True)
        ]
    if is_number(next(filter(None, cells), "0").replace(",", ".")):
        values = table.numbers(column.name)
        if not column.unit.startswith("unix"):
            return values, None
        values = values * si_factor("t", column.unit)
    else:
        try:
            values, _ = read_clock(cells)
        except ValueError as error:
            row = cells.index(str(error)) if str(error) in cells else 0
            raise InputError(
                f"{table.path}: {table.place(row)}, column '{column.name}': no time"
                " that can be read: "
                f"{cells[row][:40]!r} found, expected a number, ISO 8601"
                " (2024-05-31T09:30:00), or a time of "
                f'day with its date beside it: t = {{ column = "{column.name}", date ='
                ' "..." }'
            ) from None
    chosen["t"] = replace(column, unit="s")
    zero = float(next(iter(values[np.isfinite(values)]), 0.0))
    return values - zero, zero - zone_seconds(column.zone, str(table.path))


def _read_position(table: Table, column: Column) -> Floats:
    """Degrees of latitude or longitude in whatever form."""
    cells = table.texts(column.name)
    try:
        return read_angles(cells, column.unit != "deg")
    except ValueError as error:
        if is_number(str(error)):  # such as 1e-05
            return table.numbers(column.name)
        row = cells.index(str(error)) if str(error) in cells else 0
        raise InputError(
            f"{table.path}: {table.place(row)}, column '{column.name}': {str(error)!r}"
            " found, expected degrees (57.6872), degrees and minutes (57°41.234'N) or"
            " ddmm.mmm (5741.234N)"
        ) from None


def _local_positions(
    table: Table, chosen: dict[str, Column], t: Floats, repair: str | None
) -> tuple[dict[str, Floats], int]:
    """North and east of the first position, m, nan where there is none, and the number of outliers."""
    lat, lon = (_read_position(table, chosen[name]) for name in ("lat", "lon"))
    source = Source(table, chosen, np.arange(t.size))
    here = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon) & np.isfinite(t))
    local, far = np.full((2, t.size), np.nan), here[:0]
    if here.size:
        plausibility.check_ranges({"lat": lat, "lon": lon}, source)
        local[:, here] = navigation.local_metres(
            lat[here], lon[here], (lat[here[0]], lon[here[0]])
        )
        seconds = t[here] * si_factor("t", chosen["t"].unit)
        far = plausibility.find_outliers(seconds, local[:, here], source, here)
        if far.size and repair is None:
            k = int(far[0])
            raise InputError(
                f"{source.at(k, 'lat')}: position {lat[k]:.5f}, {lon[k]:.5f} found, an"
                f" outlier that no ship reaches from those beside it ({far.size} of"
                f" {here.size} are); empty its cells, or leave such rows to be filled"
                ' with repair = "interpolate"',
                _REPAIRED,
            )
        local[:, far] = np.nan
    return dict(zip(("x", "y"), local, strict=True)), far.size


def _joined(recorded: Sequence[_Recorded]) -> Series:
    """The channels of all tables on the clock of the first."""
    base, series = recorded[0], dict(recorded[0].series)
    for other in recorded[1:]:
        path = other.source.table.path
        if (base.start is None) != (other.start is None):
            raise InputError(
                f"{path}: one of the files of this log has a clock and the other has"
                " not, expected times that count from one moment in both"
            )
        if twice := series.keys() & other.series.keys():
            raise InputError(
                f"{path}: {quoted(sorted(twice))} is also in another file of this log,"
                " expected each in one; rename the column that is not to be read"
            )
        shift = (other.start or 0.0) - (base.start or 0.0)
        moved = {
            name: (clock + shift, values)
            for name, (clock, values) in other.series.items()
        }
        plausibility.check_overlap(series, moved, path, other.source.columns["t"].name)
        series |= moved
    return series


def to_project_conventions(log: Log, conventions: Conventions) -> None:
    """Convert frame and origin, and derive the channels that follow from others.

    The channels are in the file's frame, the heading without jumps, the rudder positive
    to starboard. The yaw rate is derived from the heading, surge and sway from velocity
    over ground or position, the heading (relative to the start) from the yaw rate where
    no position is recorded.
    """
    channels, earth = log.channels, conventions.velocity_frame == "earth"
    log.over_ground = (
        False if "stw" in channels else (earth and "u" in channels) or None
    )
    navigation.correct_offsets(log, conventions.instruments)
    if "psi" in channels and "r" not in channels:
        log.derive("r", time_derivative(log.t, channels["psi"]))
    if "r" in channels and not {"psi", "x", "y"} & channels.keys():
        from scipy.interpolate import make_interp_spline

        turned = make_interp_spline(
            log.t, channels["r"], k=min(3, log.t.size - 1)
        ).antiderivative()
        log.derive(
            "psi", np.asarray(turned(log.t) - turned(log.t[0]), dtype=np.float64)
        )
    if earth:
        _earth_to_body(log)
    if conventions.origin == "cg":
        _cg_to_midship(log, conventions.xg or 0.0)
    navigation.to_midship(log, conventions.instruments)


def _earth_to_body(log: Log) -> None:
    channels = log.channels
    if not {"u", "v"} & channels.keys():
        return
    absent = [
        name
        for name in ("u", "v", "psi")
        if name not in channels or name in log.derived
    ]
    if absent:
        raise InputError(
            f'{log.where}: velocity_frame = "earth" found without a recorded'
            f" {absent[0]}, expected u (north), v (east) and the heading psi; name"
            " their columns, or leave u and v out"
        )
    u, v, psi = (channels[name] for name in ("u", "v", "psi"))
    channels["u"], channels["v"] = navigation.rotate_to_body(u, v, psi)


def _cg_to_midship(log: Log, xg: float) -> None:
    """Move position, sway and yaw moment from the centre of gravity, `xg` forward of midship, to midship."""
    channels = log.channels
    needed = {"v": "r", "x": "psi", "y": "psi", "N": "Y"}
    for name, other in needed.items():
        if name in channels and other not in channels:
            raise InputError(
                f'{log.where}: origin = "cg" needs {other} to move {name} to midship;'
                " name its column"
            )
    arms: Any = {
        "v": lambda r: -r,
        "x": lambda h: -np.cos(h),
        "y": lambda h: -np.sin(h),
        "N": lambda Y: Y,
    }
    for name in arms.keys() & channels.keys():
        channels[name] = channels[name] + xg * arms[name](channels[needed[name]])


def _repaired(
    values: Floats, source: Source, repair: str | None
) -> tuple[Floats, Source]:
    """Refuse or fill missing values of shape (n_rows, n_columns), time first, and check the time."""
    names = list(source.columns)
    missing = ~np.isfinite(values)
    rows, columns = np.nonzero(missing)
    if rows.size and (repair is None or missing[:, 0].any()):
        k, c = (
            (int(rows[0]), int(columns[0]))
            if repair is None
            else (int(np.argmax(missing[:, 0])), 0)
        )
        remedy = (
            "time cannot be interpolated, remove the row"
            if names[c] == "t"
            else (
                'repair = "interpolate" fills it from its neighbours, or remove the row'
            )
        )
        raise InputError(
            f"{source.at(k, names[c])}: no value ({values[k, c]:g}) found, expected a"
            f" number; {remedy} ({np.unique(rows).size} of {len(values)} rows lack a"
            " value)",
            _REPAIRED if names[c] != "t" else (),
        )
    _check_time(values, source)
    if not rows.size:
        return values, source
    whole = np.flatnonzero(~missing.any(axis=1))
    if whole.size < max(3, len(values) // 2):
        raise InputError(
            f"{source.table.path}: only {whole.size} of {len(values)} rows have no"
            " missing values, expected at least half of them (and 3) to interpolate"
            " from; leave out the column that is mostly empty"
        )
    kept = slice(int(whole[0]), int(whole[-1]) + 1)
    filled = values[kept].copy()
    repaired = Source(source.table, source.columns, source.rows[kept])
    for k in range(1, len(names)):
        _check_holes(filled[:, 0], missing[kept, k], names[k], repaired)
        _fill(
            filled[:, 0],
            filled[:, k],
            unwrap=names[k] == "psi",
            unit=source.columns[names[k]].unit,
        )
    return filled, repaired


def _check_holes(t: Floats, missing: Flags, channel: str, source: Source) -> None:
    """Refuse to fill a hole of many rows; the first and the last row are whole."""
    edges = np.flatnonzero(np.diff(missing))
    first, after = edges[::2] + 1, edges[1::2] + 1
    rows, span = after - first, t[after] - t[first - 1]
    long = (rows > LONGEST_HOLE_ROWS) & (
        span > LONGEST_HOLE_STEPS * np.median(np.diff(t))
    )
    if long.any():
        i = int(np.argmax(long))
        raise InputError(
            f"{source.at(int(first[i]), channel)}: {rows[i]} rows without a value, over"
            f" {span[i]:g} {source.columns['t'].unit}, expected at most"
            f" {LONGEST_HOLE_STEPS:g} time steps to interpolate over; split the file"
            " there, or leave out the rows or the column"
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
            f"{source.table.path}: {t.size} samples found, expected at least 3 rows"
            " below the header; export the whole manoeuvre"
        )
    back = np.diff(t) <= SHORTEST_STEP_S / si_factor("t", unit)
    if back.any():
        k = int(np.argmax(back))
        verb = (
            "stands still at" if t[k + 1] >= t[k] else f"goes back from {t[k]:.10g} to"
        )
        raise InputError(
            f"{source.at(k + 1, 't')}: time {verb} {t[k + 1]:.10g} {unit}, expected it"
            " to increase from row to row; sort the rows, remove the repeated ones, or"
            " split the file into one per run"
        )
