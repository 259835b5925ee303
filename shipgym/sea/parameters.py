"""The sea as a ship meets it: what current, wind and waves do to her, as numbers of `SeaParameters`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shipgym.engine.records import flat
from shipgym.errors import InputError
from shipgym.sea.conditions import Current, Waves, Weather, Wind
from shipgym.sea.drift import wave_drift
from shipgym.sea.gusts import GaussMarkov, gust_filter
from shipgym.sea.harmonics import Harmonics
from shipgym.sea.motions import wave_motion
from shipgym.sea.open_sea import Cosines, Filter, SeaParameters, Sines
from shipgym.sea.waves import wave_filter
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.ships.particulars import Particulars

Floats = NDArray[np.float64]
GRAVITY = 9.80665
HARMONICS = len(Sines._fields)
FLAT = Cosines(*[0.0] * (HARMONICS + 1))
NONE = Sines(*[0.0] * HARMONICS)
STEADY = Filter(0.0, 0.0, 0.0)
CALM = SeaParameters(
    current_speed=0.0, current_towards=0.0, current=STEADY, wind_speed=0.0, wind_from=0.0, gust=STEADY,
    waves_from=0.0, wave_frequency=0.0, wave_number=0.0, wave_damping=0.0, wave_ringing=1.0, drift=STEADY,
    still_air=0.0, wind_surge=FLAT, wind_sway=NONE, wind_yaw=NONE, wind_roll=NONE, drift_surge=FLAT,
    drift_sway=NONE, drift_yaw=NONE, drift_roll=NONE, heading_variance=FLAT, roll_variance=FLAT,
)  # fmt: skip


def as_weather(weather: Weather | str | None, where: str, from_deg: float | None = 45.0) -> Weather:
    """A weather itself, that of a sea state by name, or calm.

    Raises
    ------
    InputError
        For anything else.
    """
    if weather is None:
        return Weather(name="calm")
    if isinstance(weather, Weather):
        return weather
    if not isinstance(weather, str):
        raise InputError(
            f"{where}: {weather!r} found, expected a Weather of shipgym.sea or the name of a sea state"
        )
    try:
        return Weather.from_sea_state(weather, from_deg)
    except InputError as error:
        reason = str(error).removeprefix("sea state: ")
        raise InputError(f"{where}: {reason}") from None


def sea_parameters(
    particulars: Particulars, mobility: Floats | None, weather: Weather, step: float
) -> SeaParameters:
    """What a weather does to a ship.

    Parameters
    ----------
    particulars : Particulars
        Of the ship.
    mobility : array of shape (4, 4)
        Her inverse inertia, by which forces become accelerations; not needed in a current alone.
    weather : Weather
        Parts that are calm do nothing.
    step : float
        Between two states of the sea, s.

    Returns
    -------
    SeaParameters

    Raises
    ------
    InputError
        If the ship's particulars are not enough.
    """
    sea = CALM
    current, wind, waves = weather.current, weather.wind, weather.waves
    if current is not None and not current.calm:
        sea = _with_current(sea, current, step)
    if wind is not None and not wind.calm:
        assert mobility is not None
        sea = _with_wind(sea, particulars, wind, step, mobility)
    if waves is not None and not waves.calm:
        assert mobility is not None
        sea = _with_waves(sea, particulars, waves, step, mobility)
    return sea


def sea_numbers(sea: SeaParameters) -> Floats:
    """Parameters in the order of their rows, shape (n_rows,)."""
    return np.array(flat(sea))


def needs_mobility(weather: Weather) -> bool:
    """Whether there are forces, beside a current."""
    return any(part is not None and not part.calm for part in (weather.wind, weather.waves))


def _direction(degrees: float | None) -> float:
    """In rad; not a number where it is to be drawn."""
    return float("nan") if degrees is None else float(np.radians(degrees))


def _filter(process: GaussMarkov, step: float) -> Filter:
    """A first-order process in steps."""
    shock = process.standard_deviation * float(np.sqrt(-np.expm1(-2.0 * step / process.time_constant)))
    return Filter(float(np.exp(-step / process.time_constant)), shock, process.standard_deviation)


def _with_current(sea: SeaParameters, current: Current, step: float) -> SeaParameters:
    return sea._replace(
        current_speed=current.speed,
        current_towards=_direction(current.towards_deg),
        current=_filter(GaussMarkov(current.time_constant, current.variation), step),
    )


def _with_wind(
    sea: SeaParameters, particulars: Particulars, wind: Wind, step: float, mobility: Floats
) -> SeaParameters:
    forces = wind_curves(particulars, wind.coefficients).harmonics(HARMONICS)
    X, Y, N, K = (0.5 * AIR_DENSITY * series for series in forces)
    surge, sway, yaw, roll = _accelerations(mobility, Harmonics(X, Y, N, K))
    return sea._replace(
        wind_speed=wind.speed,
        wind_from=_direction(wind.from_deg),
        gust=_filter(gust_filter(wind), step),
        wind_surge=Cosines(*surge),
        wind_sway=Sines(*sway),
        wind_yaw=Sines(*yaw),
        wind_roll=Sines(*roll),
        still_air=-float(surge.sum()),  # of the wind she makes herself, at angle 0
    )


def _with_waves(
    sea: SeaParameters, particulars: Particulars, waves: Waves, step: float, mobility: Floats
) -> SeaParameters:
    spectrum = wave_filter(waves)
    drift, motion = wave_drift(waves, particulars), wave_motion(waves, particulars)
    surge, sway, yaw, heel = _accelerations(mobility, drift.harmonics(HARMONICS))
    return sea._replace(
        waves_from=_direction(waves.from_deg),
        wave_frequency=spectrum.peak_frequency,
        wave_number=spectrum.peak_frequency**2 / GRAVITY,
        wave_damping=spectrum.damping,
        wave_ringing=float(np.sqrt(1.0 - spectrum.damping**2)),
        drift=_filter(GaussMarkov(drift.time_constant, drift.standard_deviation), step),
        drift_surge=Cosines(*surge),
        drift_sway=Sines(*sway),
        drift_yaw=Sines(*yaw),
        drift_roll=Sines(*heel),
        heading_variance=Cosines(*motion.heading_variance_harmonics(HARMONICS)),
        roll_variance=Cosines(*motion.roll_variance_harmonics(HARMONICS)),
    )


def _accelerations(mobility: Floats, forces: Harmonics) -> tuple[Floats, Floats, Floats, Floats]:
    """Series of the accelerations in surge (cosines), sway, yaw and roll (sines) by those of the forces."""
    lateral = mobility[1:, 1:] @ np.stack([forces.Y, forces.N, forces.K])
    return mobility[0, 0] * forces.X, lateral[0], lateral[1], lateral[2]
