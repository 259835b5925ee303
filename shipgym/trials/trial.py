"""One recorded manoeuvre: its channels in SI units and the project's signs, from CSV and back."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from shipgym.checks import check_choice, check_number, check_text, did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import write_text
from shipgym.trials.trial_import import Conventions, import_csv
from shipgym.trials.units import CHANNELS, check_channel

Array = npt.NDArray[np.float64]

#: Kinds of manoeuvre that a trial may name; `shipgym.manoeuvres.register_manoeuvre` adds a user's own.
KINDS = ["zigzag", "turning-circle", "spiral", "pull-out", "straight", "captive", "random"]

#: What a trial is used for.
USES = ("fit", "validate", "skip")


class Trial:
    """One recorded or simulated manoeuvre, immutable.

    Channels, all in SI units: ``x`` north and ``y`` east of midship (m), heading ``psi`` (rad, clockwise,
    without jumps), surge ``u`` and sway ``v`` of midship (m/s; forward, to starboard), yaw rate ``r`` and
    roll rate ``p`` (rad/s), heel ``phi`` (rad), rudder ``delta`` (rad, positive steers to starboard) and
    shaft speed ``n`` (rev/s), with the orders ``delta_command`` and ``n_command``; of captive tests the
    forces ``X`` ahead and ``Y`` to starboard (N) and the yaw moment ``N`` about midship (N m). Simulated in
    weather: first-order motion in waves ``psi_wave``, ``r_wave``, ``phi_wave`` and ``p_wave``, which is not
    in psi, r, phi and p, the current ``current_north`` and ``current_east`` (m/s) and the wind
    ``wind_speed`` (m/s) and ``wind_from`` (rad).

    Parameters
    ----------
    t : array-like of shape (n_samples,)
        Time, s, strictly increasing; the steps may differ. At least three samples.
    channels : mapping of str to array-like of shape (n_samples,)
        Values of each channel.
    name : str, optional
        Name of the trial; for a file its file name.
    kind : {"zigzag", "turning-circle", "spiral", "pull-out", "straight", "captive", "random"}, optional
        The manoeuvre, where known.
    use : {"fit", "validate", "skip"}, optional
        What the trial is for.
    derived : collection of str, optional
        Names of the channels that were not measured but computed from others.
    length : float, optional
        Length of the ship between perpendiculars, m; indices of manoeuvres are given in it.
    repaired : mapping of str to int, optional
        How many values of a channel were filled in, because they were missing or outliers.
    raw : Trial, optional
        The trial before it was smoothed or repaired.

    Raises
    ------
    InputError
        For unknown channels, lengths that differ, values that are not finite, or time that goes back.
    """

    __slots__ = ("_channels", "_derived", "_kind", "_length", "_name", "_raw", "_repaired", "_t", "_use")

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
    ) -> None:
        self._name = check_text(name, "trial: name")
        where = f"trial '{name}'"
        self._kind = None if kind is None else check_choice(kind, KINDS, f"{where}: kind")
        self._use = check_choice(use, USES, f"{where}: use")
        self._length = None if length is None else check_number(length, f"{where}: length", above=0.0)
        self._t = _frozen_array(t, f"{where}: t")
        _check_time(self._t, where)
        if not channels:
            raise InputError(f"{where}: no channel found, expected at least one of {quoted(CHANNELS)}")
        arrays: dict[str, Array] = {}
        for channel, values in channels.items():
            check_channel(channel, where, time=False)
            arrays[channel] = _frozen_array(values, f"{where}: {channel}")
            if arrays[channel].shape != self._t.shape:
                raise InputError(
                    f"{where}: {channel} has {arrays[channel].size} samples, expected {self._t.size} as in t"
                )
        self._channels = arrays
        self._derived = frozenset(derived)
        if not self._derived <= arrays.keys():
            unknown = quoted(sorted(self._derived - arrays.keys()))
            raise InputError(f"{where}: derived: {unknown} found, expected some of {quoted(arrays)}")
        self._repaired = dict(repaired or {})
        self._raw = raw

    @property
    def t(self) -> Array:
        """Time, s, of shape (n_samples,), read-only."""
        return self._t

    @property
    def channels(self) -> Mapping[str, Array]:
        """The channels by name, without time, read-only; each of shape (n_samples,)."""
        return MappingProxyType(self._channels)

    @property
    def name(self) -> str:
        """Name of the trial; for one of a ship file its file name as written there."""
        return self._name

    @property
    def kind(self) -> str | None:
        """The manoeuvre, or None where it is not known."""
        return self._kind

    @property
    def use(self) -> str:
        """``"fit"``, ``"validate"`` or ``"skip"``."""
        return self._use

    @property
    def derived(self) -> frozenset[str]:
        """Names of the channels that were computed from others."""
        return self._derived

    @property
    def length(self) -> float | None:
        """Length of the ship between perpendiculars, m, or None where it is not known."""
        return self._length

    @property
    def repaired(self) -> Mapping[str, int]:
        """How many values were filled in, by channel, where any were."""
        return MappingProxyType(self._repaired)

    @property
    def raw(self) -> Trial:
        """The trial as it was recorded: before it was smoothed or repaired, itself where it was not."""
        return self if self._raw is None else self._raw.raw

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self._t[-1] - self._t[0])

    @property
    def sha256(self) -> str:
        """Hash of time and channels, independent of the file's formatting and of name, kind and use."""
        digest = hashlib.sha256()
        for channel, values in (("t", self._t), *sorted(self._channels.items())):
            digest.update(channel.encode() + b"\0" + values.astype("<f8").tobytes())
        return digest.hexdigest()

    def __len__(self) -> int:
        return int(self._t.size)

    def __contains__(self, channel: object) -> bool:
        return channel == "t" or channel in self._channels

    def __reduce__(self) -> tuple[Any, ...]:
        settings = {
            "name": self._name,
            "kind": self._kind,
            "use": self._use,
            "derived": self._derived,
            "length": self._length,
            "repaired": self._repaired,
            "raw": self._raw,
        }
        return _restore, (self._t, self._channels, settings)

    def __getitem__(self, channel: str) -> Array:
        if channel == "t":
            return self._t
        try:
            return self._channels[channel]
        except KeyError:
            raise InputError(
                f"trial '{self._name}': no channel '{channel}'.{did_you_mean(str(channel), self._channels)} "
                f"Channels present: {quoted(self._channels)}"
            ) from None

    def __repr__(self) -> str:
        return (
            f"Trial(name={self._name!r}, kind={self._kind!r}, use={self._use!r}, samples={len(self)}, "
            f"duration={self.duration:g} s, channels={list(self._channels)})"
        )

    def with_(self, **changes: Any) -> Trial:
        """Return a copy with another ``name``, ``kind``, ``use`` or ``length``.

        Raises
        ------
        InputError
            For anything else.
        """
        settings: dict[str, Any] = {
            "name": self._name,
            "kind": self._kind,
            "use": self._use,
            "length": self._length,
        }
        unknown = changes.keys() - settings.keys()
        if unknown:
            raise InputError(
                f"trial '{self._name}': cannot change {quoted(sorted(unknown))}, only name, kind, use, length"
            )
        return Trial(
            self._t,
            self._channels,
            derived=self._derived,
            repaired=self._repaired,
            raw=self._raw,
            **(settings | changes),
        )

    def with_channels(
        self,
        channels: Mapping[str, npt.ArrayLike],
        *,
        t: npt.ArrayLike | None = None,
        repaired: Mapping[str, int] | None = None,
    ) -> Trial:
        """Return a copy with some channels replaced, of which this trial is the raw one.

        Parameters
        ----------
        channels : mapping of str to array-like of shape (n_samples,)
            Those that change; all of them where `t` is given.
        t : array-like of shape (n_samples,), optional
            Other times, s.
        repaired : mapping of str to int, optional
            How many values were filled in, by channel, on top of those filled before.

        Raises
        ------
        InputError
            As for a new trial.
        """
        counts = dict(self._repaired)
        for name, count in (repaired or {}).items():
            counts[name] = counts.get(name, 0) + count
        return Trial(
            self._t if t is None else t,
            {**self._channels, **channels},
            name=self._name,
            kind=self._kind,
            use=self._use,
            derived=self._derived,
            length=self._length,
            repaired=counts,
            raw=self,
        )

    @classmethod
    def from_csv(
        cls,
        path: str | Path,
        columns: Mapping[str, str | Mapping[str, str]] | None = None,
        rudder_positive: str = "starboard",
        velocity_frame: str = "body",
        *,
        origin: str = "midship",
        xg: float | None = None,
        repair: str | None = None,
        name: str | None = None,
        kind: str | None = None,
        use: str = "fit",
        length: float | None = None,
    ) -> Trial:
        """Read a trial from a CSV file and convert it to SI units and the project's signs.

        Channels that are absent and follow from others are derived and listed in :attr:`derived`: ``r`` from
        ``psi``; ``u`` and ``v`` from ``x``, ``y`` and ``psi``; ``psi`` from ``r`` where there is no position
        (heading relative to the start).

        Parameters
        ----------
        path : str or Path
            The file: one header line; comma, semicolon or tab; UTF-8.
        columns : mapping of str to str or mapping, optional
            For each channel (``t`` included) its column, or ``{"column": name, "unit": unit}``. By default
            every column that is named like a channel, in SI units.
        rudder_positive : {"starboard", "port"}
            Side to which a positive rudder angle of the file steers.
        velocity_frame : {"body", "earth"}
            Frame of columns u and v: "earth" means north and east velocity.
        origin : {"midship", "cg"}
            Point whose position and velocity the file holds; "cg" needs `xg`.
        xg : float, optional
            Centre of gravity forward of midship, m.
        repair : {"interpolate"}, optional
            Fill missing values (nan, empty cells) from their neighbours; rows at either end that lack a value
            are left out. Without it a missing value is an error.
        name, kind, use, length : optional
            As in :class:`Trial`; the name is the file's by default.

        Raises
        ------
        InputError
            For anything wrong with file or arguments, naming file, line, column, value and remedy.
        """
        conventions = Conventions(
            rudder_positive=rudder_positive,
            velocity_frame=velocity_frame,
            origin=origin,
            xg=xg,
            repair=repair,
            where=f"{path}:",
        )
        t, channels, derived, repaired = import_csv(Path(path), columns, conventions)
        return cls(
            t,
            channels,
            name=Path(path).name if name is None else name,
            kind=kind,
            use=use,
            derived=derived,
            length=length,
            repaired=repaired,
        )

    def to_csv(self, path: str | Path) -> None:
        """Write time and all channels in SI units; :meth:`from_csv` reads back the very same numbers.

        The file is written beside its target and then renamed, so that it is never there in part.

        Parameters
        ----------
        path : str or Path
            The file to write; one that exists is replaced.

        Raises
        ------
        InputError
            Where the file cannot be written.
        """
        names = ["t", *self._channels]
        rows = zip(*(self[name].tolist() for name in names), strict=True)
        text = "\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]) + "\n"
        write_text(text, Path(path))


def _restore(t: Array, channels: Mapping[str, Array], settings: Mapping[str, Any]) -> Trial:
    return Trial(t, channels, **settings)


def _frozen_array(values: npt.ArrayLike, where: str) -> Array:
    """Return `values` as a read-only copy of shape (n_samples,), all finite."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{where}: expected an array of numbers") from None
    if array.ndim != 1:
        raise InputError(f"{where}: array of shape {array.shape} found, expected (n_samples,)")
    bad = ~np.isfinite(array)
    if bad.any():
        index = int(np.argmax(bad))
        raise InputError(
            f"{where}: {array[index]} found at sample {index}, expected finite numbers; leave such samples "
            'out, or import the file with repair = "interpolate"'
        )
    array.setflags(write=False)
    return array


def _check_time(t: Array, where: str) -> None:
    if t.size < 3:
        raise InputError(f"{where}: {t.size} samples found, expected at least 3")
    back = np.diff(t) <= 0.0
    if back.any():
        index = int(np.argmax(back))
        raise InputError(
            f"{where}: t goes from {t[index]:g} to {t[index + 1]:g} s at sample {index + 1}, "
            "expected strictly increasing time"
        )
