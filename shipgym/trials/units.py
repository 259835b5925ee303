"""Channels of a trial and the units in which a file may hold them."""

import math

from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import shipped_toml

DEGREE, KNOT = math.pi / 180.0, 1852.0 / 3600.0

#: Factor from each unit to SI, by the quantity measured. The first unit of each is the SI one.
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "unix": 1.0, "unix ms": 1e-3},
    "length": {"m": 1.0, "km": 1000.0, "ft": 0.3048, "nm": 1852.0},
    "angle": {"rad": 1.0, "deg": DEGREE},
    "angular rate": {"rad/s": 1.0, "deg/s": DEGREE, "deg/min": DEGREE / 60.0},
    "speed": {"m/s": 1.0, "knots": KNOT, "kn": KNOT, "km/h": 1.0 / 3.6},
    "shaft speed": {"rps": 1.0, "rpm": 1.0 / 60.0},
    "force": {"N": 1.0, "kN": 1000.0},
    "moment": {"N m": 1.0, "kN m": 1000.0},
    "latitude or longitude": {"deg": 1.0, "ddmm.mm": 1.0},  # the second, as in NMEA 0183, by `read_angles`
    "acceleration": {"m/s^2": 1.0},
    "angular acceleration": {"rad/s^2": 1.0, "deg/s^2": DEGREE},
}

_CHANNELS = shipped_toml("shipgym.trials", "channels.toml")

#: The quantity that each channel measures.
QUANTITIES: dict[str, str] = {name: row["quantity"] for name, row in _CHANNELS.items()}

#: What a file may hold and a trial does not: position, speed and course over ground, speed through the water.
INPUTS = tuple(name for name, row in _CHANNELS.items() if "log_only" in row)

#: Names of the channels of a trial, without time.
CHANNELS: tuple[str, ...] = tuple(name for name in QUANTITIES if name not in ("t", *INPUTS))

#: Largest magnitude of each channel that can be a ship's, or a small model's; SI units.
LIMITS: dict[str, float] = {
    name: row["largest"] * (UNITS[row["quantity"]][row["unit"]] if "unit" in row else 1.0)
    for name, row in _CHANNELS.items()
}


def check_channel(name: str, where: str, *, time: bool = True) -> str:
    """Return `name`, which must be that of a channel (or ``t``, unless `time` is false)."""
    known = tuple(QUANTITIES) if time else CHANNELS  # a file's, or a trial's
    if name not in known:
        hint = did_you_mean(str(name), known)
        raise InputError(f"{where}: unknown channel {name!r}.{hint} Known channels: {quoted(known)}")
    return name


def si_unit(channel: str) -> str:
    """Return the SI unit of a channel, such as ``"rad/s"`` for ``r``."""
    return next(iter(UNITS[QUANTITIES[channel]]))


def si_factor(channel: str, unit: str, where: str = "unit") -> float:
    """The factor from `unit` to the SI unit of a channel; `where` begins the message about a wrong unit."""
    quantity = QUANTITIES[channel]
    fitting = UNITS[quantity]
    if isinstance(unit, str) and unit in fitting:
        return fitting[unit]
    others = [other for other, units in UNITS.items() if isinstance(unit, str) and unit in units]
    hint = f" '{unit}' is a unit of {others[0]}" if others else did_you_mean(str(unit), fitting)
    raise InputError(f"{where}: unit {unit!r} found, expected a unit of {quantity}: {quoted(fitting)}.{hint}")
