"""The sea as loops read it: what current, wind and waves do to a ship, as numbers of `SeaParameters`."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.records import flat
from shipgym.errors import InputError
from shipgym.sea.conditions import Current, Waves, Weather, Wind
from shipgym.sea.drift import wave_drift
from shipgym.sea.estimates import GRAVITY
from shipgym.sea.gusts import GaussMarkov, gust_filter
from shipgym.sea.harmonics import Harmonics
from shipgym.sea.mobility import mobility_matrix
from shipgym.sea.motions import wave_motion
from shipgym.sea.open_sea import Cosines, Filter, SeaParameters, Sines
from shipgym.sea.waves import wave_filter
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.ships.manoeuvring_model import ManoeuvringModel

HARMONICS = len(Sines._fields)
FLAT, NONE, STEADY = Cosines(*[0.0] * (HARMONICS + 1)), Sines(*[0.0] * HARMONICS), Filter(0.0, 0.0, 0.0)
CALM = SeaParameters(
    current_speed=0.0, current_towards=0.0, current=STEADY, wind_speed=0.0, wind_from=0.0, gust=STEADY,
    waves_from=0.0, wave_frequency=0.0, wave_number=0.0, wave_damping=0.0, wave_ringing=1.0, drift=STEADY,
    still_air=0.0, wind_surge=FLAT, wind_sway=NONE, wind_yaw=NONE, wind_roll=NONE, drift_surge=FLAT,
    drift_sway=NONE, drift_yaw=NONE, drift_roll=NONE, heading_variance=FLAT, roll_variance=FLAT,
)  # fmt: skip


def as_weather(weather: Weather | str | None, where: str, from_deg: float | None = 45.0) -> Weather:
    """A weather itself, that of a sea state by name, or calm; InputError for anything else."""
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
    """What a weather does to a ship, in the order of `SeaParameters`, per her inertia.

    `step`, s, is the time between two states of the sea; the added mass may depend on `water_depth`, m.
    Raises InputError if the ship's particulars are not enough.
    """
    sea, current, wind, waves = CALM, weather.current, weather.wind, weather.waves
    if current is not None and not current.calm:
        sea = _with_current(sea, current, step)
    if wind is not None and not wind.calm:
        sea = _with_wind(sea, model, wind, step, mobility_matrix(model, water_depth))
    if waves is not None and not waves.calm:
        sea = _with_waves(sea, model, waves, step, mobility_matrix(model, water_depth))
    return np.array(flat(sea))


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
    sea: SeaParameters, model: ManoeuvringModel, wind: Wind, step: float, mobility: Floats
) -> SeaParameters:
    forces = wind_curves(model.particulars, wind.coefficients).harmonics(HARMONICS)
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
    sea: SeaParameters, model: ManoeuvringModel, waves: Waves, step: float, mobility: Floats
) -> SeaParameters:
    spectrum = wave_filter(waves)
    drift, motion = wave_drift(waves, model.particulars), wave_motion(waves, model.particulars)
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
