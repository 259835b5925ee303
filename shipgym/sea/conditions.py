"""The weather a user asks for: current, wind and waves, and the sea states of the WMO."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from shipgym.checks import (
    check_choice,
    check_flag,
    check_number,
    check_table,
    check_text,
    did_you_mean,
    quoted,
)
from shipgym.errors import InputError
from shipgym.sea.wind import WindTable, check_coefficients

GUST_SPECTRA = ("harris", "davenport", "norsok")
WAVE_SPECTRA = ("jonswap", "pierson-moskowitz")
SPREADINGS = ("cosine-squared", "long-crested")


@dataclass(frozen=True)
class Current:
    """A current that is the same everywhere, steady or slowly varying; InputError for values that none has.

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

    speed: float
    towards_deg: float | None = None
    variation: float = 0.0
    time_constant: float = 600.0

    def __post_init__(self) -> None:
        _check(self, "current", "towards_deg", speed=(0.0, 10.0), variation=(0.0, 5.0))
        check_number(
            self.time_constant, "current time_constant", above=0.0, hint="in s"
        )

    @property
    def calm(self) -> bool:
        """Whether no water flows."""
        return self.speed == 0.0 and self.variation == 0.0


@dataclass(frozen=True)
class Wind:
    """A mean wind with gusts; InputError for values that no wind has.

    Parameters
    ----------
    speed : float
        Mean over an hour, 10 m above the sea, m/s.
    from_deg : float or None
        Direction it comes from, degrees clockwise from north; None: drawn for each
        episode of an environment.
    gust : bool
        Whether the speed varies about its mean.
    spectrum : {"harris", "davenport", "norsok"}
        Of the gusts (`shipgym.sea.gusts`).
    coefficients : str or WindTable
        "blendermann" (type of ship guessed from its fullness), "blendermann-" and a
        type of `BLENDERMANN`, "isherwood", or a table of your own.
    """

    speed: float
    from_deg: float | None = None
    gust: bool = True
    spectrum: Literal["harris", "davenport", "norsok"] = "harris"
    coefficients: str | WindTable = "blendermann"

    def __post_init__(self) -> None:
        _check(self, "wind", "from_deg", speed=(0.0, 75.0))
        check_choice(self.spectrum, GUST_SPECTRA, "wind spectrum")
        check_coefficients(self.coefficients, "wind coefficients")
        check_flag(self.gust, "wind gust")

    @property
    def calm(self) -> bool:
        """Whether no wind blows."""
        return self.speed == 0.0


@dataclass(frozen=True)
class Waves:
    """An irregular sea; InputError for values that none has, such as waves steeper than they can be.

    Parameters
    ----------
    significant_height : float
        Hs, four times the standard deviation of the elevation, m.
    peak_period : float
        Tp, period of the peak of the spectrum, s.
    from_deg : float or None
        Where they come from, degrees clockwise from north; None: drawn for each episode
        of an environment.
    spectrum : {"jonswap", "pierson-moskowitz"}
        Of a growing or of a fully developed sea.
    peak_enhancement : float
        gamma of JONSWAP, 1 to 20.
    spreading : {"cosine-squared", "long-crested"}
        How the energy is spread over directions about the mean: (2 / pi) cos^2 within
        90 degrees to either side, as wind seas are (DNV-RP-C205, section 3.5.8), or not
        at all, as in a tank or a swell.
    """

    significant_height: float
    peak_period: float
    from_deg: float | None = None
    spectrum: Literal["jonswap", "pierson-moskowitz"] = "jonswap"
    peak_enhancement: float = 3.3
    spreading: Literal["cosine-squared", "long-crested"] = "cosine-squared"

    def __post_init__(self) -> None:
        _check(
            self,
            "waves",
            "from_deg",
            significant_height=(0.0, 20.0),
            peak_enhancement=(1.0, 20.0),
        )
        check_number(
            self.peak_period, "waves peak_period", above=0.0, at_most=40.0, hint="in s"
        )
        check_choice(self.spectrum, WAVE_SPECTRA, "waves spectrum")
        check_choice(self.spreading, SPREADINGS, "waves spreading")
        length = 9.80665 * self.peak_period**2 / (2.0 * math.pi)
        if self.significant_height > length / 10.0:
            raise InputError(
                f"waves significant_height: {self.significant_height:g} found with"
                f" peak_period {self.peak_period:g}, expected at most"
                f" {length / 10.0:.3g} m: steeper waves break; give a lower height or a"
                " longer period"
            )

    @property
    def calm(self) -> bool:
        """Whether the sea is flat."""
        return self.significant_height == 0.0

    @property
    def gamma(self) -> float:
        """Peak enhancement of the spectrum: 1 for Pierson-Moskowitz."""
        return self.peak_enhancement if self.spectrum == "jonswap" else 1.0


@dataclass(frozen=True)
class SeaState:
    """One row of the table of sea states."""

    name: str  # in the words of WMO code table 3700
    code: int  # its number there
    # range of the significant height in that code, m
    lowest: float
    highest: float
    # Hs, m, and Tp, s, taken
    significant_height: float
    peak_period: float
    wind_speed: float  # 10 m above the sea, m/s


def _wind_at_10_m(knots: float) -> float:
    """Wind at 10 m from the one at 19.5 m by the power law of 1/7 that the table's notes give, m/s."""
    return float(knots * 1852.0 / 3600.0 * (10.0 / 19.5) ** (1.0 / 7.0))


# Heights, most probable modal periods and sustained winds: Bales 1983, Designing ships
# to the natural environment, Naval Engineers Journal 95(2), open ocean North Atlantic
# (also Lee & Bales, STANAG 4194).
_SEA_STATES = (
    SeaState("calm", 0, 0.0, 0.0, 0.0, 0.0, 0.0),
    SeaState("slight", 3, 0.5, 1.25, 0.88, 7.5, _wind_at_10_m(13.5)),
    SeaState("moderate", 4, 1.25, 2.5, 1.88, 8.8, _wind_at_10_m(19.0)),
    SeaState("rough", 5, 2.5, 4.0, 3.25, 9.7, _wind_at_10_m(24.5)),
)


def sea_states() -> dict[str, SeaState]:
    """Sea states by name, from calm to rough."""
    return {state.name: state for state in _SEA_STATES}


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
        for part, kind in _PARTS.items():
            value = getattr(self, part)
            if value is not None and not isinstance(value, kind):
                raise InputError(
                    f"weather {part}: {value!r} found, expected"
                    f" shipgym.{kind.__name__}(...) or None"
                )

    @classmethod
    def from_sea_state(
        cls,
        name: str | int,
        from_deg: float | None = 45.0,
        current: Current | None = None,
    ) -> Weather:
        """Wind and waves of WMO code table 3700: "calm", "slight", "moderate", "rough", or 0, 3, 4, 5.

        Wind and waves come from `from_deg`, degrees clockwise from north, by default
        north-east; None: drawn anew for each episode of an environment. A current may
        be given beside them. Raises InputError for a sea state that is not in the
        table.
        """
        state = _find_sea_state(name)
        if state.wind_speed == 0.0:
            return cls(current=current, name=state.name)
        waves = Waves(state.significant_height, state.peak_period, from_deg)
        return cls(current, Wind(state.wind_speed, from_deg), waves, state.name)

    @property
    def calm(self) -> bool:
        """Whether nothing is on."""
        return all(
            part is None or part.calm for part in (self.current, self.wind, self.waves)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the parts by name, ready for JSON; :meth:`from_dict` reads it."""
        return {"name": self.name} | {
            part: None if getattr(self, part) is None else asdict(getattr(self, part))
            for part in _PARTS
        }

    @classmethod
    def from_dict(cls, mapping: Mapping[str, Any], where: str = "weather") -> Weather:
        """Read what :meth:`to_dict` wrote; absent parts are off.

        InputError, beginning with `where`, for an unknown key, a missing value or one
        that no weather has.
        """
        table = check_table(mapping, where, ("name", *_PARTS))
        parts = {
            part: _part(kind, table.get(part), f"{where} {part}")
            for part, kind in _PARTS.items()
        }
        return cls(**parts, name=table.get("name", "weather"))


_PARTS: dict[str, type[Any]] = {"current": Current, "wind": Wind, "waves": Waves}
_NEEDED = {
    Current: ("speed",),
    Wind: ("speed",),
    Waves: ("significant_height", "peak_period"),
}


def _part(kind: type[Any], content: Any, where: str) -> Any:
    if content is None:
        return None
    values = dict(
        check_table(content, where, tuple(kind.__dataclass_fields__), _NEEDED[kind])
    )
    if isinstance(values.get("coefficients"), Mapping):
        values["coefficients"] = WindTable.from_dict(
            values["coefficients"], f"{where} coefficients"
        )
    return kind(**values)


def _find_sea_state(name: str | int) -> SeaState:
    for state in _SEA_STATES:
        if not isinstance(name, bool) and name in (state.name, state.code):
            return state
    codes = ", ".join(str(state.code) for state in _SEA_STATES)
    hint = did_you_mean(name, sea_states()) if isinstance(name, str) else ""
    raise InputError(
        f"sea state: {name!r} found, expected one of {quoted(sea_states())}, or their"
        f" WMO codes {codes}; for another sea give Weather(wind=Wind(...),"
        f" waves=Waves(...)).{hint}"
    )


def _check(
    part: Any, where: str, direction: str, **bounds: tuple[float, float]
) -> None:
    """Make numbers of a part's fields, which must be within their bounds, and of its direction, if any."""
    given = {} if getattr(part, direction) is None else {direction: (-360.0, 360.0)}
    for name, (low, high) in (bounds | given).items():
        hint = "degrees clockwise from north" if name == direction else ""
        value = check_number(
            getattr(part, name),
            f"{where} {name}",
            at_least=low,
            at_most=high,
            hint=hint,
        )
        object.__setattr__(part, name, value)
