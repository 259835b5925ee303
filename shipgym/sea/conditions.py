"""Weather that a user asks for: current, wind and waves together, or a sea state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shipgym.checks import check_table, check_text
from shipgym.errors import InputError

if TYPE_CHECKING:
    from shipgym.sea.current_field import CurrentField
    from shipgym.sea.current_wind_waves import Current, Waves, Wind


@dataclass(frozen=True)
class Weather:
    """Current, wind and waves, each optional, and a name for reports.

    The current is the same everywhere (`Current`) or differs from place to place
    (`CurrentField`).

    Raises InputError for parts that are not of these types.
    """

    current: Current | CurrentField | None = None
    wind: Wind | None = None
    waves: Waves | None = None
    name: str = "weather"

    def __post_init__(self) -> None:
        check_text(self.name, "weather name")
        for name in ("current", "wind", "waves"):
            part = getattr(self, name)
            if part is not None:
                _check_part(part, name)

    @classmethod
    def from_sea_state(
        cls,
        name: str | int,
        from_deg: float | None = 45.0,
        current: Current | None = None,
    ) -> Weather:
        """Wind and waves of WMO code table 3700, with a current if one is given.

        Raises InputError for a sea state that is not in the table.

        Parameters
        ----------
        name : {"calm", "slight", "moderate", "rough", 0, 3, 4, 5}
        from_deg : float or None
            Where wind and waves come from, degrees clockwise from north, by default
            north-east; None: drawn for each episode of an environment.
        current : Current, optional
        """
        from shipgym.sea.current_wind_waves import Waves, Wind
        from shipgym.sea.sea_states import find_sea_state

        state = find_sea_state(name)
        if state.wind_speed == 0.0:
            return cls(current=current, name=state.name)
        waves = Waves(state.significant_height, state.peak_period, from_deg)
        return cls(
            current=current,
            wind=Wind(state.wind_speed, from_deg),
            waves=waves,
            name=state.name,
        )

    @property
    def calm(self) -> bool:
        """True where nothing is on."""
        parts = (self.current, self.wind, self.waves)
        return all(part is None or part.calm for part in parts)

    def to_dict(self) -> dict[str, Any]:
        """Return the parts by name, ready for JSON; :meth:`from_dict` reads it."""
        return {"name": self.name, **asdict(self)}

    @classmethod
    def from_dict(cls, mapping: Mapping[str, Any], where: str = "weather") -> Weather:
        """Read what :meth:`to_dict` wrote; absent parts are off.

        InputError, beginning with `where`, for an unknown key, a missing value or one
        that no weather has.
        """
        kinds = part_types()
        table = check_table(mapping, where, ("name", *kinds))
        parts = {}
        for name, kind in kinds.items():
            content = table.get(name)
            if content is not None:
                parts[name] = _read_part(kind, content, f"{where} {name}")
        name = table.get("name", "weather")
        return cls(**parts, name=name)


def part_types() -> dict[str, type[Any]]:
    """Types of the parts of a weather, by name."""
    from shipgym.sea.current_wind_waves import Current, Waves, Wind

    return {"current": Current, "wind": Wind, "waves": Waves}


def _check_part(part: Any, name: str) -> None:
    from shipgym.sea.current_field import CurrentField

    kind = part_types()[name]
    if name == "current" and isinstance(part, CurrentField):
        return
    if not isinstance(part, kind):
        raise InputError(
            f"weather {name}: expected shipgym.{kind.__name__}(...) or None, got"
            f" {part!r}"
        )


def _read_part(kind: type[Any], content: Any, where: str) -> Any:
    from shipgym.sea.wind_coefficients import WindTable

    known = fields(kind)
    table = check_table(
        content,
        where,
        allowed=[field.name for field in known],
        required=[field.name for field in known if field.default is MISSING],
    )
    values = dict(table)
    coefficients = values.get("coefficients")
    if isinstance(coefficients, Mapping):
        place = f"{where} coefficients"
        values["coefficients"] = WindTable.from_dict(coefficients, place)
    return kind(**values)


def as_weather(
    weather: Weather | str | None, where: str, from_deg: float | None = 45.0
) -> Weather:
    """Return a weather, that of a sea state by name, or calm for None.

    The path of a Python file stands for its current (`CurrentField`).

    InputError, beginning with `where`, for anything else.
    """
    if weather is None:
        return Weather(name="calm")
    if isinstance(weather, Weather):
        return weather
    if not isinstance(weather, str):
        raise InputError(
            f"{where}: expected a Weather of shipgym.sea or the name of a sea state,"
            f" got {weather!r}"
        )
    if weather == "calm":  # the default, which loads no other part of the sea
        return Weather(name="calm")
    if weather.endswith(".py"):
        from shipgym.sea.current_field import CurrentField

        return Weather(current=CurrentField(weather), name=Path(weather).stem)
    try:
        return Weather.from_sea_state(weather, from_deg)
    except InputError as error:
        reason = str(error).removeprefix("sea state: ")
        raise InputError(f"{where}: {reason}") from None
