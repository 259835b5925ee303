"""Current, wind and waves as a user describes them."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from shipgym.checks import check_choice, check_flag, check_number
from shipgym.constants import GRAVITY
from shipgym.errors import InputError
from shipgym.sea.wind_coefficients import WindTable, check_coefficients


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

    speed: float
    towards_deg: float | None = None
    variation: float = 0.0
    time_constant: float = 600.0

    def __post_init__(self) -> None:
        _keep_number(self, "current", "speed", at_least=0.0, at_most=10.0)
        _keep_number(self, "current", "variation", at_least=0.0, at_most=5.0)
        _keep_number(self, "current", "time_constant", above=0.0, hint="in s")
        _keep_direction(self, "current", "towards_deg")

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
        _keep_number(self, "wind", "speed", at_least=0.0, at_most=75.0)
        _keep_direction(self, "wind", "from_deg")
        check_choice(
            self.spectrum,
            ("harris", "davenport", "norsok"),
            "wind spectrum",
        )
        check_coefficients(self.coefficients, "wind coefficients")
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
        _keep_number(self, "waves", "significant_height", at_least=0.0, at_most=20.0)
        _keep_number(self, "waves", "peak_period", above=0.0, at_most=40.0, hint="in s")
        _keep_number(self, "waves", "peak_enhancement", at_least=1.0, at_most=20.0)
        _keep_direction(self, "waves", "from_deg")
        check_choice(
            self.spectrum,
            ("jonswap", "pierson-moskowitz"),
            "waves spectrum",
        )
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

    @property
    def gamma(self) -> float:
        """Peak enhancement of the spectrum: 1 for Pierson-Moskowitz."""
        return self.peak_enhancement if self.spectrum == "jonswap" else 1.0


def _keep_number(part: Any, where: str, name: str, **bounds: Any) -> None:
    """Make a float of a field, which must be within bounds (`check_number`)."""
    number = check_number(getattr(part, name), f"{where} {name}", **bounds)
    object.__setattr__(part, name, number)


def _keep_direction(part: Any, where: str, name: str) -> None:
    """Make a float of a direction, unless it is to be drawn."""
    if getattr(part, name) is not None:
        hint = "degrees clockwise from north"
        _keep_number(part, where, name, at_least=-360.0, at_most=360.0, hint=hint)
