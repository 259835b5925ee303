"""Weather as a user describes it: current, wind and waves, or a sea state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from shipgym.checks import (
    bounded,
    check_choice,
    check_flag,
    check_table,
    check_text,
    keep_numbers,
    placed,
    read_fields,
)
from shipgym.constants import GRAVITY
from shipgym.errors import InputError


def _direction() -> Any:
    """Field of a direction; None is to be drawn."""
    hint = "degrees clockwise from north"
    return bounded(None, at_least=-360.0, at_most=360.0, hint=hint)


@dataclass(frozen=True)
class Current:
    """A current that is the same everywhere, steady or slowly varying.

    Raises InputError for values that no current has.

    Parameters
    ----------
    speed : float
        Mean, m/s.
    towards_deg : float or None
        Direction it flows to, degrees clockwise from north; None: drawn for each
        episode of an environment.
    variation : float
        Standard deviation of each of the north and east components about the mean, m/s;
        0 is steady.
    time_constant : float
        Of the first-order Gauss-Markov process of the variation, s.
    """

    speed: float = bounded(at_least=0.0, at_most=10.0)
    towards_deg: float | None = _direction()
    variation: float = bounded(0.0, at_least=0.0, at_most=5.0)
    time_constant: float = bounded(600.0, above=0.0, hint="in s")

    def __post_init__(self) -> None:
        keep_numbers(self, "current ")

    @property
    def calm(self) -> bool:
        """True where no water flows."""
        return self.speed == 0.0 and self.variation == 0.0


@dataclass(frozen=True)
class Wind:
    """A mean wind with gusts.

    Raises InputError for values that no wind has.

    Parameters
    ----------
    speed : float
        Mean over an hour, 10 m above the sea, m/s.
    from_deg : float or None
        Direction it comes from, degrees clockwise from north; None: drawn for each
        episode of an environment.
    gust : bool
        True for a speed that varies about its mean.
    """

    speed: float = bounded(at_least=0.0, at_most=75.0)
    from_deg: float | None = _direction()
    gust: bool = True

    def __post_init__(self) -> None:
        keep_numbers(self, "wind ")
        check_flag(self.gust, "wind gust")

    @property
    def calm(self) -> bool:
        """True where no wind blows."""
        return self.speed == 0.0


@dataclass(frozen=True)
class Waves:
    """An irregular sea.

    Raises InputError for values that no sea has, such as waves steeper than they can
    be.

    Parameters
    ----------
    significant_height : float
        Hs, four times the standard deviation of the elevation, m.
    peak_period : float
        Tp, period of the peak of the spectrum, s.
    from_deg : float or None
        Where they come from, degrees clockwise from north; None: drawn for each episode
        of an environment.
    peak_enhancement : float
        gamma of the JONSWAP spectrum, 1 to 20; 1 is a fully developed sea (Pierson &
        Moskowitz).
    spreading : {"cosine-squared", "long-crested"}
        How the energy is spread over directions about the mean: (2 / pi) cos^2 within
        90 degrees to either side, as wind seas are (DNV-RP-C205, section 3.5.8), or not
        at all, as in a tank or a swell.
    """

    significant_height: float = bounded(at_least=0.0, at_most=20.0)
    peak_period: float = bounded(above=0.0, at_most=40.0, hint="in s")
    from_deg: float | None = _direction()
    peak_enhancement: float = bounded(3.3, at_least=1.0, at_most=20.0)
    spreading: Literal["cosine-squared", "long-crested"] = "cosine-squared"

    def __post_init__(self) -> None:
        keep_numbers(self, "waves ")
        check_choice(
            self.spreading,
            ("cosine-squared", "long-crested"),
            "waves spreading",
        )
        wave_length = GRAVITY * self.peak_period**2 / (2.0 * math.pi)
        highest = wave_length / 10.0
        if self.significant_height > highest:
            raise InputError(
                f"waves significant_height: expected at most {highest:.3g} m with"
                f" peak_period {self.peak_period:g}, got {self.significant_height:g};"
                " steeper waves break: give a lower height or a longer period"
            )

    @property
    def calm(self) -> bool:
        """True where the sea is flat."""
        return self.significant_height == 0.0


PARTS: dict[str, type[Any]] = {"current": Current, "wind": Wind, "waves": Waves}


# ---- sea states ------------------------------------------------------------


#: Hs, m, most probable modal period, s, and sustained wind at 19.5 m, knots, by the
#: words of WMO code table 3700: Bales 1983, Designing ships to the natural environment,
#: Naval Engineers Journal 95(2), open ocean North Atlantic (also Lee & Bales, STANAG
#: 4194). "calm" has none of them.
SEA_STATES = {
    "slight": (0.88, 7.5, 13.5),
    "moderate": (1.88, 8.8, 19.0),
    "rough": (3.25, 9.7, 24.5),
}


def wind_at_10_m(knots: float) -> float:
    """Wind 10 m above the sea, m/s, by that at 19.5 m, knots.

    The power law of 1/7 is that of the notes to the table.
    """
    metres_per_second = knots * 1852.0 / 3600.0
    return float(metres_per_second * (10.0 / 19.5) ** (1.0 / 7.0))


# ---- weather ------------------------------------------------------------


@dataclass(frozen=True)
class Weather:
    """Current, wind and waves, each optional, and a name for reports.

    Raises InputError for parts that are not of these types.
    """

    current: Current | None = None
    wind: Wind | None = None
    waves: Waves | None = None
    name: str = "weather"

    def __post_init__(self) -> None:
        check_text(self.name, "weather name")
        for name, kind in PARTS.items():
            part = getattr(self, name)
            if isinstance(part, kind) or part is None:
                continue
            raise InputError(
                f"weather {name}: expected shipgym.{kind.__name__}(...) or None, got"
                f" {part!r}"
            )

    @classmethod
    def from_sea_state(
        cls,
        name: str,
        from_deg: float | None = 45.0,
        current: Current | None = None,
    ) -> Weather:
        """Wind and waves of WMO code table 3700, with a current if one is given.

        Raises InputError for a sea state that is not in the table.

        Parameters
        ----------
        name : {"calm", "slight", "moderate", "rough"}
        from_deg : float or None
            Where wind and waves come from, degrees clockwise from north, by default
            north-east; None: drawn for each episode of an environment.
        current : Current, optional
        """
        own = "; for another sea give Weather(wind=Wind(...), waves=Waves(...))"
        check_choice(name, ("calm", *SEA_STATES), "sea state", own)
        if name == "calm":
            return cls(current=current, name=name)
        height, period, knots = SEA_STATES[name]
        wind = Wind(wind_at_10_m(knots), from_deg)
        waves = Waves(height, period, from_deg)
        return cls(current, wind, waves, name)

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
        table = check_table(
            mapping,
            where,
            ("name", *PARTS),
        )
        parts = {}
        for name, kind in PARTS.items():
            content = table.get(name)
            if content is not None:
                parts[name] = read_fields(kind, content, f"{where} {name}")
        name = table.get("name", "weather")
        return cls(**parts, name=name)


def as_weather(
    weather: Weather | Mapping[str, Any] | str | None,
    where: str,
    from_deg: float | None = 45.0,
) -> Weather:
    """Return a weather, one from its parts, that of a sea state, or calm for None.

    InputError, beginning with `where`, for anything else.
    """
    if weather is None:
        return Weather(name="calm")
    if isinstance(weather, Weather):
        return weather
    if isinstance(weather, Mapping):
        return Weather.from_dict(weather, where)
    if not isinstance(weather, str):
        raise InputError(
            f"{where}: expected a Weather of shipgym.sea or the name of a sea state,"
            f" got {weather!r}"
        )
    with placed(where):
        return Weather.from_sea_state(weather, from_deg)
