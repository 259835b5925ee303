"""Weather as the kernels read it: rows of a ship's tile that tell what current, wind and waves do to her."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError
from shipgym.kernels import layout
from shipgym.kernels import weather_rows as rows
from shipgym.sea.conditions import Current, Waves, Weather, Wind
from shipgym.sea.drift import wave_drift
from shipgym.sea.gusts import GaussMarkov, gust_filter
from shipgym.sea.harmonics import Harmonics
from shipgym.sea.mobility import mobility_matrix
from shipgym.sea.motions import wave_motion
from shipgym.sea.waves import wave_filter
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.ships.manoeuvring_model import ManoeuvringModel

Floats = NDArray[np.float64]
GRAVITY = 9.80665


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


def weather_column(
    model: ManoeuvringModel, weather: Weather, step: float, water_depth: float = np.inf
) -> Floats:
    """Rows that tell a ship's weather, in the order of `shipgym.kernels.weather_rows`.

    Parameters
    ----------
    model : ManoeuvringModel
        The ship; forces become accelerations by her inertia.
    weather : Weather
        Parts that are calm do nothing.
    step : float
        Between two states of the weather, s.
    water_depth : float
        m; where the added mass depends on it.

    Returns
    -------
    array of shape (n_rows,)

    Raises
    ------
    InputError
        If the ship's particulars are not enough.
    """
    column = np.zeros(layout.row(layout.COEFFICIENTS - layout.WEATHER))
    current, wind, waves = weather.current, weather.wind, weather.waves
    if current is not None and not current.calm:
        _current(column, current, step)
    if wind is not None and not wind.calm:
        _wind(column, model, wind, step, mobility_matrix(model, water_depth))
    column[_at(rows.WAVE_RINGING)] = 1.0
    if waves is not None and not waves.calm:
        _waves(column, model, waves, step, mobility_matrix(model, water_depth))
    return column


def _at(offset: int) -> int:
    """Place in the column of a row of the tile."""
    return layout.row(offset - layout.WEATHER)


def _direction(degrees: float | None) -> float:
    """In rad; not a number where it is to be drawn."""
    return float("nan") if degrees is None else float(np.radians(degrees))


def _filter(column: Floats, kept: int, process: GaussMarkov, step: float) -> None:
    """Three rows of a first-order process: part kept over a step, deviation of what is added, and its own."""
    decay = float(np.exp(-step / process.time_constant))
    shock = process.standard_deviation * float(np.sqrt(-np.expm1(-2.0 * step / process.time_constant)))
    column[_at(kept) : _at(kept) + 3] = decay, shock, process.standard_deviation


def _current(column: Floats, current: Current, step: float) -> None:
    column[_at(rows.CURRENT_SPEED)] = current.speed
    column[_at(rows.CURRENT_TOWARDS)] = _direction(current.towards_deg)
    _filter(column, rows.CURRENT_KEPT, GaussMarkov(current.time_constant, current.variation), step)


def _wind(column: Floats, model: ManoeuvringModel, wind: Wind, step: float, mobility: Floats) -> None:
    column[_at(rows.WIND_SPEED)] = wind.speed
    column[_at(rows.WIND_FROM)] = _direction(wind.from_deg)
    _filter(column, rows.GUST_KEPT, gust_filter(wind), step)
    forces = wind_curves(model.particulars, wind.coefficients).harmonics(rows.HARMONICS)
    X, Y, N, K = (0.5 * AIR_DENSITY * series for series in forces)
    surge, sway, yaw, roll = _accelerations(mobility, Harmonics(X, Y, N, K))
    column[_at(rows.WIND_SURGE) : _at(rows.DRIFT_SURGE)] = np.concatenate([surge, sway, yaw, roll])
    column[_at(rows.STILL_AIR)] = -surge.sum()  # of the wind she makes herself, at angle 0


def _waves(column: Floats, model: ManoeuvringModel, waves: Waves, step: float, mobility: Floats) -> None:
    spectrum = wave_filter(waves)
    column[_at(rows.WAVES_FROM)] = _direction(waves.from_deg)
    column[_at(rows.WAVE_FREQUENCY)] = spectrum.peak_frequency
    column[_at(rows.WAVE_NUMBER)] = spectrum.peak_frequency**2 / GRAVITY
    column[_at(rows.WAVE_DAMPING)] = spectrum.damping
    column[_at(rows.WAVE_RINGING)] = np.sqrt(1.0 - spectrum.damping**2)
    drift = wave_drift(waves, model.particulars)
    _filter(column, rows.DRIFT_KEPT, GaussMarkov(drift.time_constant, drift.standard_deviation), step)
    surge, sway, yaw, heel = _accelerations(mobility, drift.harmonics(rows.HARMONICS))
    motion = wave_motion(waves, model.particulars)
    heading = motion.heading_variance_harmonics(rows.HARMONICS)
    roll = motion.roll_variance_harmonics(rows.HARMONICS)
    column[_at(rows.DRIFT_SURGE) :] = np.concatenate([surge, sway, yaw, heel, heading, roll])


def _accelerations(mobility: Floats, forces: Harmonics) -> tuple[Floats, Floats, Floats, Floats]:
    """Series of the accelerations in surge (cosines), sway, yaw and roll (sines) by those of the forces."""
    lateral = mobility[1:, 1:] @ np.stack([forces.Y, forces.N, forces.K])
    return mobility[0, 0] * forces.X, lateral[0], lateral[1], lateral[2]
