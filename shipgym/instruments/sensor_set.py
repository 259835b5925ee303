"""Sensor sets, shipped and a user's own: files of plain functions on named records."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from shipgym.engine.records import Record
from shipgym.engine.source import Configurable, check_namespace, read_source
from shipgym.instruments import perfect

#: Functions of a sensor set with their arguments, as `perfect` explains them.
FUNCTIONS = {
    "measure": (
        "motion",
        "sea",
        "memory",
        "frequency",
        "interval",
        "settings",
        "random",
    ),
    "readings": ("motion", "sea", "memory"),
}


@dataclass(frozen=True)
class SensorSet(Configurable):
    """Records and functions of a sensor set (`shipgym/instruments/perfect.py`).

    `noise` and `filter`: whether a bridge's instruments are noisy, and whether they
    filter.
    """

    Memory: Record
    measure: Callable[..., Any]
    readings: Callable[..., Any]
    noise: bool = False
    filter: bool = False


def read_sensors(source: Any) -> SensorSet:
    """Read the sensor set of a file or module; InputError if it does not fit."""
    if isinstance(source, SensorSet):
        return source
    namespace, where = read_source(source)
    check_namespace(namespace, where, ("Settings", "Memory"), FUNCTIONS)
    return _sensors_of(namespace, where)


def _sensors_of(namespace: Any, where: str) -> SensorSet:
    return SensorSet(
        name=where,
        source=where,
        Settings=namespace.Settings,
        Memory=namespace.Memory,
        measure=namespace.measure,
        readings=namespace.readings,
    )


@cache
def shipped_sensors(windy: bool, noise: bool, filtered: bool) -> SensorSet:
    """Choose a shipped sensor set: without error in calm water, else a bridge's."""
    if windy or noise or filtered:
        from shipgym.instruments import bridge

        sensors = _sensors_of(bridge, str(bridge.__file__))
        return replace(sensors, noise=noise, filter=filtered)
    place = str(perfect.__file__)
    return _sensors_of(perfect, place)
