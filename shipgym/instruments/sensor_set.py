"""A sensor set of a user's own: a file of plain functions on named records, as those beside this one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from shipgym.checks import check_keys
from shipgym.engine.records import Record
from shipgym.tasks.contract import Setting
from shipgym.tasks.settings import keywords, make_settings
from shipgym.tasks.source import check_namespace, check_settings, read_source

FUNCTIONS = {
    "measure": ("motion", "sea", "memory", "frequency", "interval", "settings", "random"),
    "readings": ("motion", "sea", "memory"),
}


@dataclass(frozen=True)
class SensorSet:
    """Records and functions of a sensor set (`shipgym/instruments/perfect.py`).

    Attributes
    ----------
    source : str
        Where it was read from, for messages.
    Settings, Memory : type
        Its records.
    measure, readings : callable
        Its functions.
    """

    source: str
    Settings: Record
    Memory: Record
    measure: Callable[..., Any]
    readings: Callable[..., Any]

    @cached_property
    def settings(self) -> dict[str, Setting]:
        """Bounds of each setting by its keyword."""
        return {name: setting for name, setting, _ in keywords(self.Settings)}

    def make_settings(self, options: Mapping[str, Any]) -> Any:
        """Settings by keywords, checked.

        Raises
        ------
        InputError
            For an unknown keyword, or a value out of its range.
        """
        check_keys(options, self.settings, f"{self.source} options")
        return make_settings(self.Settings, options)


def read_sensors(source: Any) -> SensorSet:
    """The sensor set of a file or module.

    Raises
    ------
    InputError
        If something is missing or of another form, naming it.
    """
    if isinstance(source, SensorSet):
        return source
    namespace, where = read_source(source)
    records = ("Settings", "Memory")
    check_namespace(namespace, where, records, FUNCTIONS)
    check_settings(namespace.Settings, where)
    return SensorSet(where, *(getattr(namespace, name) for name in (*records, *FUNCTIONS)))
