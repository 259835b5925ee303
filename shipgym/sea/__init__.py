"""Weather: what current, wind and waves do to a ship.

What a user gives is in `conditions`; what becomes of it for one ship in `wind`, `gusts`, `waves`,
`motions`, `drift` and `mobility`. Everything is imported when it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shipgym.sea.conditions import Current, SeaState, Waves, Weather, Wind, sea_states
    from shipgym.sea.drift import WaveDrift, wave_drift
    from shipgym.sea.estimates import weather_particulars
    from shipgym.sea.gusts import GaussMarkov, gust_filter, gust_spectrum, gust_variance
    from shipgym.sea.motions import WaveMotion, wave_motion
    from shipgym.sea.waves import (
        WaveFilter,
        encounter_frequency,
        jonswap,
        pierson_moskowitz,
        slow_drift,
        wave_filter,
        wave_spectrum,
    )
    from shipgym.sea.wind import AIR_DENSITY, WindCurves, wind_curves
    from shipgym.sea.wind_tables import WindTable

_HOME = {
    **dict.fromkeys(("Current", "SeaState", "Waves", "Weather", "Wind", "sea_states"), "conditions"),
    "weather_particulars": "estimates",
    **dict.fromkeys(("GaussMarkov", "gust_filter", "gust_spectrum", "gust_variance"), "gusts"),
    **dict.fromkeys(("WaveDrift", "wave_drift"), "drift"),
    **dict.fromkeys(("WaveMotion", "wave_motion"), "motions"),
    **dict.fromkeys(
        (
            "WaveFilter",
            "encounter_frequency",
            "jonswap",
            "pierson_moskowitz",
            "slow_drift",
            "wave_filter",
            "wave_spectrum",
        ),
        "waves",
    ),
    **dict.fromkeys(("AIR_DENSITY", "WindCurves", "wind_curves"), "wind"),
    "WindTable": "wind_tables",
}

__all__ = [
    "AIR_DENSITY",
    "Current",
    "GaussMarkov",
    "SeaState",
    "WaveDrift",
    "WaveFilter",
    "WaveMotion",
    "Waves",
    "Weather",
    "Wind",
    "WindCurves",
    "WindTable",
    "encounter_frequency",
    "gust_filter",
    "gust_spectrum",
    "gust_variance",
    "jonswap",
    "pierson_moskowitz",
    "sea_states",
    "slow_drift",
    "wave_drift",
    "wave_filter",
    "wave_motion",
    "wave_spectrum",
    "weather_particulars",
    "wind_curves",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'shipgym.sea' has no attribute {name!r}")
    return getattr(import_module(f"shipgym.sea.{_HOME[name]}"), name)
