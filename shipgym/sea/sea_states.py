"""Sea states of WMO code table 3700, and waves and wind that are taken for them."""

from dataclasses import dataclass

from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError


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


def sea_states() -> dict[str, SeaState]:
    """Sea states by name, from calm to rough.

    Heights, most probable modal periods and sustained winds: Bales 1983, Designing
    ships to the natural environment, Naval Engineers Journal 95(2), open ocean North
    Atlantic (also Lee & Bales, STANAG 4194).
    """
    return {
        "calm": SeaState("calm", 0, 0.0, 0.0, 0.0, 0.0, 0.0),
        "slight": SeaState("slight", 3, 0.5, 1.25, 0.88, 7.5, wind_at_10_m(13.5)),
        "moderate": SeaState("moderate", 4, 1.25, 2.5, 1.88, 8.8, wind_at_10_m(19.0)),
        "rough": SeaState("rough", 5, 2.5, 4.0, 3.25, 9.7, wind_at_10_m(24.5)),
    }


def wind_at_10_m(knots: float) -> float:
    """Wind 10 m above the sea, m/s, by that at 19.5 m, knots.

    The power law of 1/7 is that of the notes to the table.
    """
    metres_per_second = knots * 1852.0 / 3600.0
    return float(metres_per_second * (10.0 / 19.5) ** (1.0 / 7.0))


def find_sea_state(name: str | int) -> SeaState:
    """Sea state by its name or WMO code; InputError for one that is not there."""
    states = sea_states()
    for state in states.values():
        if name in (state.name, state.code) and not isinstance(name, bool):
            return state

    hint = ""
    if isinstance(name, str):
        hint = did_you_mean(name, states)
    names = quoted(states)
    codes = [str(state.code) for state in states.values()]
    listed = ", ".join(codes)
    raise InputError(
        f"sea state: expected one of {names}, or their WMO codes {listed}, got"
        f" {name!r}; for another sea give Weather(wind=Wind(...), waves=Waves(...))"
        f".{hint}"
    )
