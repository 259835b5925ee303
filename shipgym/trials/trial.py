"""One recorded manoeuvre, in SI units and the project's signs; CSV in and out."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats, integral
from shipgym.checks import (
    check_choice,
    check_finite,
    check_number,
    check_text,
    did_you_mean,
    quoted,
)
from shipgym.errors import InputError
from shipgym.files import write_text
from shipgym.trials.axes import plot
from shipgym.trials.columns import parse_columns
from shipgym.trials.conventions import Conventions, Installation
from shipgym.trials.cuts import cut_log, kind_of
from shipgym.trials.plausibility.agreement import turning_gain
from shipgym.trials.readers.frames import read_frame
from shipgym.trials.readers.kinds import read_log
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.resampling import FEWEST_SAMPLES, Log
from shipgym.trials.trial_import import import_table
from shipgym.trials.units import (
    CHANNELS,
    DEGREE,
    LARGEST_MAGNITUDES,
    check_channel,
)

#: Kinds of manoeuvre that a trial may name.
KINDS = (
    "zigzag",
    "turning-circle",
    "spiral",
    "pull-out",
    "straight",
    "captive",
    "random",
)

_RUDDERS = {"delta", "delta_command"}

#: What a trial is used for.
USES = ("fit", "validate", "skip")


class Trial:
    """One recorded or simulated manoeuvre, immutable.

    Channels, all in SI units: ``x`` north and ``y`` east of midship (m), heading
    ``psi`` (rad, clockwise, without jumps), surge ``u`` and sway ``v`` of midship (m/s;
    forward, to starboard), yaw rate ``r`` and roll rate ``p`` (rad/s), heel ``phi``
    (rad), rudder ``delta`` (rad, positive steers to starboard) and shaft speed ``n``
    (rev/s), with the orders ``delta_command`` and ``n_command``; of captive tests the
    forces ``X`` ahead and ``Y`` to starboard (N) and the yaw moment ``N`` about midship
    (N m). Simulated in weather: first-order motion in waves ``psi_wave`` and
    ``r_wave``, which is not in psi and r, the current
    ``current_north`` and ``current_east`` (m/s) and the wind ``wind_speed`` (m/s) and
    ``wind_from`` (rad). Raises InputError for unknown channels, lengths that differ,
    values that are not finite, or time that goes back.

    Parameters
    ----------
    t : array-like of shape (n_samples,)
        Time, s, strictly increasing; the steps may differ. At least three samples.
    channels : mapping of str to array-like of shape (n_samples,)
        Values of each channel.
    name : str, optional
        Name of the trial; for a file its file name.
    kind : str, optional
        The manoeuvre, where known, as in `KINDS`: "zigzag", "turning-circle", "spiral",
        "pull-out", "straight", "captive" or "random".
    use : {"fit", "validate", "skip"}, optional
        What the trial is for.
    derived : collection of str, optional
        Names of the channels that were not measured but computed from others.
    length : float, optional
        Length of the ship between perpendiculars, m; indices of manoeuvres are given in
        it.
    repaired : mapping of str to int, optional
        How many values of a channel were filled in, because they were missing or
        outliers.
    raw : Trial, optional
        The trial before it was smoothed or repaired.
    over_ground : bool, optional
        Whether `u` and `v` are velocities over ground, with the current in them, and
        not through the water. By default where one of them was derived, as it is from
        positions.
    notes : sequence of str, optional
        Remarks of the reader: what it corrected, left out or found amiss.
    magnetic : bool, optional
        Whether the heading counts from magnetic north.
    """

    t: Floats
    channels: Mapping[str, Floats]
    name: str
    kind: str | None
    use: str
    derived: frozenset[str]
    length: float | None
    repaired: Mapping[str, int]
    over_ground: bool
    notes: tuple[str, ...]
    magnetic: bool

    def __init__(
        self,
        t: npt.ArrayLike,
        channels: Mapping[str, npt.ArrayLike],
        *,
        name: str = "trial",
        kind: str | None = None,
        use: str = "fit",
        derived: Collection[str] = (),
        length: float | None = None,
        repaired: Mapping[str, int] | None = None,
        raw: Trial | None = None,
        over_ground: bool | None = None,
        notes: Sequence[str] = (),
        magnetic: bool = False,
    ) -> None:
        check_text(name, "trial: name")
        where = f"trial '{name}'"
        times = _frozen_array(t, f"{where}: t")
        _check_time(times, where)
        if not channels:
            raise InputError(
                f"{where}: expected at least one channel of {quoted(CHANNELS)}, got"
                " none"
            )
        arrays = {}
        for channel, values in channels.items():
            check_channel(channel, where, time=False)
            arrays[channel] = _frozen_array(values, f"{where}: {channel}", times.size)
        _check_angles(times, arrays, where)
        if kind is not None:
            check_kind(kind, f"{where}: kind")
        check_choice(use, USES, f"{where}: use")
        if length is not None:
            length = check_number(length, f"{where}: length", above=0.0)
        if over_ground is None:
            over_ground = "u" in derived or "v" in derived
        vars(self).update(
            t=times,
            channels=MappingProxyType(arrays),
            name=name,
            kind=kind,
            use=use,
            derived=frozenset(derived),
            length=length,
            repaired=MappingProxyType(dict(repaired or {})),
            over_ground=bool(over_ground),
            notes=tuple(notes),
            magnetic=magnetic,
            _raw=raw,
        )

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(
            f"a trial is immutable: {name} cannot be set; `with_` returns a changed"
            " copy"
        )

    @property
    def raw(self) -> Trial:
        """The trial before it was smoothed or repaired; itself where it was not."""
        raw: Trial | None = vars(self)["_raw"]
        return self if raw is None else raw.raw

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.t[-1] - self.t[0])

    @property
    def sha256(self) -> str:
        """Hash of time and channels, independent of formatting, name, kind and use."""
        digest = hashlib.sha256()
        for name in ("t", *sorted(self.channels)):
            digest.update(name.encode() + b"\0")
            digest.update(self[name].astype("<f8").tobytes())
        return digest.hexdigest()

    def __len__(self) -> int:
        return int(self.t.size)

    def __contains__(self, channel: object) -> bool:
        return channel == "t" or channel in self.channels

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(Trial, **self._settings()), (self.t, dict(self.channels))

    def __getitem__(self, channel: str) -> Floats:
        if channel == "t":
            return self.t
        if channel not in self.channels:
            hint = did_you_mean(str(channel), self.channels)
            raise InputError(
                f"trial '{self.name}': no channel '{channel}'.{hint} Channels present:"
                f" {quoted(self.channels)}"
            )
        return self.channels[channel]

    def __repr__(self) -> str:
        return (
            f"Trial(name={self.name!r}, kind={self.kind!r}, use={self.use!r},"
            f" samples={len(self)}, duration={self.duration:g} s,"
            f" channels={list(self.channels)})"
        )

    def _settings(self) -> dict[str, Any]:
        """The keyword arguments that make this trial of its channels."""
        names = ("name", "kind", "use", "derived", "length", "over_ground", "notes")
        settings = {name: getattr(self, name) for name in (*names, "magnetic")}
        repaired = dict(self.repaired)
        return settings | {"repaired": repaired, "raw": vars(self)["_raw"]}

    def with_(self, **changes: Any) -> Trial:
        """Return a copy with a changed name, kind, use, length or ``over_ground``."""
        return Trial(self.t, self.channels, **(self._settings() | changes))

    def with_channels(
        self,
        channels: Mapping[str, npt.ArrayLike],
        *,
        t: npt.ArrayLike | None = None,
        repaired: Mapping[str, int] | None = None,
    ) -> Trial:
        """Return a copy with some channels replaced; this trial is its raw one.

        With other times `t`, s, all channels are given. `repaired` counts filled values
        by channel, on top of those filled before. Raises InputError as for a new trial.
        """
        counts = Counter(self.repaired) + Counter(repaired)
        settings = self._settings() | {"raw": self, "repaired": counts}
        times = self.t if t is None else t
        return Trial(times, {**self.channels, **channels}, **settings)

    def part(self, rows: slice, name: str | None = None) -> Trial:
        """Trial of some samples, without kind and use, by the same or another name."""
        channels = {name: values[rows] for name, values in self.channels.items()}
        return Trial(self.t[rows], channels, name=self.name if name is None else name)

    @classmethod
    def from_csv(
        cls,
        path: str | Path | LogTable,
        columns: Mapping[str, str | Mapping[str, str]] | None = None,
        rudder_positive: str = "starboard",
        velocity_frame: str = "body",
        *,
        frame: str = "ned",
        origin: str = "midship",
        xg: float | None = None,
        repair: str | None = None,
        name: str | None = None,
        kind: str | None = None,
        use: str = "fit",
        length: float | None = None,
        sensors: Mapping[str, Any] | None = None,
    ) -> Trial:
        """Read a trial from a log and convert it to SI units and the project's signs.

        Channels that follow from others are derived where absent: ``r`` from ``psi``;
        ``u`` and ``v`` from ``sog`` and ``cog``, else from position; ``psi`` from ``r``
        where there is no position (relative to the start). ``lat`` and ``lon`` become
        ``x`` and ``y``; ``stw``, speed through the water, is ``u``. An InputError for
        anything wrong with file or arguments names file, line, column, value and
        remedy.

        Parameters
        ----------
        path : str or Path
            CSV with one header line, NMEA 0183 or 2000, Signal K, Excel (.xlsx),
            Parquet or MATLAB (.mat).
        columns : mapping of str to str or mapping, optional
            For each channel (``t`` included) its column, or ``{"column": name, "unit":
            unit}``. By default every column that is named like a channel, in SI units.
            Of ``t`` also ``"date"``.
        rudder_positive : {"starboard", "port"}
            Side to which a positive rudder angle of the file steers.
        velocity_frame : {"body", "earth"}
            Frame of columns u and v: "earth" means north and east velocity.
        frame : {"ned", "enu"}
            Frame of angles and positions: "enu", as of ROS, counts headings from east
            and, with yaw rates and sway, to port, and has x east and y north.
        origin : {"midship", "cg"}
            Point whose position and velocity the file holds; "cg" needs `xg`.
        xg : float, optional
            Centre of gravity forward of midship, m.
        repair : {"interpolate"}, optional
            Fill missing values (nan, empty cells) from their neighbours, but for holes
            of more than six steps; rows at either end that lack a value are left out.
            Without it a missing value is an error.
        name, kind, use, length : optional
            As in :class:`Trial`; the name is the file's by default.
        sensors : mapping, optional
            The table ``[sensors]`` of a ship file.
        """
        where = f"{path.path if isinstance(path, LogTable) else path}:"
        conventions = Conventions(
            rudder_positive=rudder_positive,
            velocity_frame=velocity_frame,
            frame=frame,
            origin=origin,
            xg=xg,
            repair=repair,
            where=where,
            installation=Installation.from_mapping(sensors or {}, f"{where} sensors"),
        )
        table = read_log(path)
        chosen = None if columns is None else parse_columns(columns, f"{where} columns")
        log = import_table(table, chosen, conventions)
        own_name = table.path.name if name is None else name
        return trial_of(log, own_name, kind=kind, use=use, length=length)

    @classmethod
    def from_frame(
        cls,
        frame: Any,
        columns: Mapping[str, str | Mapping[str, str]] | None = None,
        **settings: Any,
    ) -> Trial:
        """Read a trial from a pandas frame.

        An index other than a count of rows is a column. `columns` and the other
        keywords are those of :meth:`from_csv`. Raises InputError as that does.
        """
        return cls.from_csv(read_frame(frame), columns, **settings)

    def plot(self, channel: str = "psi", ax: Any = None, **line: Any) -> Any:
        """Draw a channel over time on axes of matplotlib, and return these.

        Raises InputError if the trial has no such channel.

        Parameters
        ----------
        channel : str
            A channel, "speed" or "drift"; or "path": the track from above.
        ax : matplotlib.axes.Axes, optional
            By default the current ones.
        line : dict
            Settings of matplotlib's line, such as ``label`` or ``color``.
        """
        return plot(self.t, self.channels, channel, ax, **line)

    def to_csv(self, path: str | Path) -> None:
        """Write time and channels in SI units; :meth:`from_csv` reads the same numbers.

        The file, replaced where it exists, is never there in part. InputError if it
        cannot be written.
        """
        names = ["t", *self.channels]
        rows = np.column_stack([self[name] for name in names]).tolist()
        lines = [",".join(names), *(",".join(map(repr, row)) for row in rows), ""]
        write_text("\n".join(lines), Path(path))


def check_kind(kind: Any, where: str) -> None:
    """Refuse a kind of manoeuvre that is not known."""
    use = (
        " (of a zigzag the overshoots are measured, of a turning-circle advance and"
        " tactical diameter)"
    )
    check_choice(kind, KINDS, where, use)


def trial_of(log: Log, name: str, samples: slice = slice(None), **facts: Any) -> Trial:
    """Trial of some samples of a log; `facts` are its kind, use and length."""
    return Trial(
        log.t[samples],
        {channel: values[samples] for channel, values in log.channels.items()},
        name=name,
        derived=log.derived,
        repaired=log.repaired,
        over_ground=log.over_ground,
        notes=log.notes,
        magnetic=log.magnetic,
        **facts,
    )


def cut_trials(cut: Any, log: Log, name: str, where: str, **facts: Any) -> list[Trial]:
    """Trials of the stretches of a cut log (:func:`.cut_log`), named by seconds.

    One that was given no kind has that which its rudder and heading show.
    """
    trials = []
    for samples in cut_log(cut, log, where):
        first, last = log.t[samples][[0, -1]]
        trial = trial_of(log, f"{name} {first:.0f}-{last:.0f} s", samples, **facts)
        if trial.kind is None and {"delta", "psi"} <= trial.channels.keys():
            trial = trial.with_(kind=kind_of(trial["delta"], trial["psi"]))
        trials.append(trial)
    return trials


def _check_time(
    t: Floats,
    where: str,
) -> None:
    if t.size < FEWEST_SAMPLES:
        raise InputError(
            f"{where}: expected at least {FEWEST_SAMPLES} samples, got {t.size}"
        )
    stands_still = np.diff(t) <= 0.0
    if stands_still.any():
        sample = int(np.argmax(stands_still)) + 1
        raise InputError(
            f"{where}: sample {sample}: expected strictly increasing time, got"
            f" {t[sample]:g} after {t[sample - 1]:g} s"
        )


def _check_angles(t: Floats, channels: Mapping[str, Floats], where: str) -> None:
    """Refuse arrays of a rudder, heading or yaw rate in degrees."""
    for name in channels.keys() & _RUDDERS:
        values = channels[name]
        k = int(np.argmax(np.abs(values)))
        if abs(values[k]) > (1.0 + 1e-9) * LARGEST_MAGNITUDES[name]:
            raise _in_degrees(where, name, f" ({values[k]:g} in sample {k})")
    if {"psi", "r"} <= channels.keys():
        swept = integral(t, channels["r"])
        gain = abs(turning_gain(t, channels["psi"], swept))
        in_degrees = {"psi": gain * DEGREE, "r": gain / DEGREE}
        for name, factor in in_degrees.items():
            if 0.5 < factor < 2.0:
                raise _in_degrees(where, name, ", by psi and r together")


def _in_degrees(where: str, name: str, evidence: str) -> InputError:
    return InputError(
        f"{where}: {name}: expected an array in radians, got one that is likely in"
        f" degrees{evidence}; give numpy.radians({name})"
    )


def _frozen_array(values: npt.ArrayLike, where: str, size: int | None = None) -> Floats:
    """Return `values` as a read-only copy of shape (n_samples,), all finite."""
    hint = 'leave such samples out, or import the file with repair = "interpolate"'
    array = check_finite(values, where, hint)
    is_flat = array.ndim == 1
    if not is_flat:
        raise InputError(
            f"{where}: expected an array of shape (n_samples,), got {array.shape}"
        )
    if size not in (None, array.size):
        raise InputError(f"{where}: expected {size} samples as in t, got {array.size}")
    return array
