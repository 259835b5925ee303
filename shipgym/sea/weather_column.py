"""Current, wind and waves as they act on one ship: numbers of `SeaParameters`."""

from functools import lru_cache

import numpy as np

from shipgym.arrays import Floats
from shipgym.constants import GRAVITY
from shipgym.engine.record_code import zeros
from shipgym.engine.records import flat
from shipgym.sea.conditions import Current, Waves, Weather, Wind
from shipgym.sea.drift import wave_drift
from shipgym.sea.filters import Filter, GaussMarkov
from shipgym.sea.harmonics import Curves, cosine_coefficients, harmonics
from shipgym.sea.mobility import mobility_matrix, roll_stiffness
from shipgym.sea.motions import wave_motion
from shipgym.sea.open_sea import Response, SeaParameters
from shipgym.sea.series import Cosines, Sines
from shipgym.sea.waves import slow_drift, wave_filter
from shipgym.sea.wind import AIR_DENSITY, gust_filter, wind_curves
from shipgym.ships.manoeuvring_model import ManoeuvringModel

HARMONICS = len(Sines._fields)
CALM: SeaParameters = zeros(SeaParameters)()._replace(wave_ringing=1.0)


@lru_cache(maxsize=256)
def weather_column(
    model: ManoeuvringModel, weather: Weather, step: float, water_depth: float = np.inf
) -> Floats:
    """Effect of a weather on a ship, in the order of `SeaParameters`, by her inertia.

    `step`, s, is the time between two states of the sea; the added mass may depend on
    `water_depth`, m. Raises InputError if the ship's particulars are not enough.
    """
    sea = CALM
    current = weather.current
    if current is not None and not current.calm:
        sea = with_current(sea, current, step)
    wind = weather.wind
    if wind is not None and not wind.calm:
        sea = with_wind(sea, model, wind, step, water_depth)
    waves = weather.waves
    if waves is not None and not waves.calm:
        sea = with_waves(sea, model, waves, step, water_depth)
    return np.array(flat(sea))


def with_current(sea: SeaParameters, current: Current, step: float) -> SeaParameters:
    """Parameters of a sea with a current."""
    variation = GaussMarkov(current.time_constant, current.variation)
    return sea._replace(
        current_speed=current.speed,
        current_towards=_radians(current.towards_deg),
        current=discrete(variation, step),
    )


def with_wind(
    sea: SeaParameters,
    model: ManoeuvringModel,
    wind: Wind,
    step: float,
    water_depth: float,
) -> SeaParameters:
    """Parameters of a sea with a wind, and what it does to a ship."""
    mobility = mobility_matrix(model, water_depth)
    curves = wind_curves(model.particulars)
    by_wind = _response(mobility, harmonics(curves, HARMONICS, 0.5 * AIR_DENSITY))
    return sea._replace(
        wind_speed=wind.speed,
        wind_from=_radians(wind.from_deg),
        gust=discrete(gust_filter(wind), step),
        by_wind=by_wind,
        still_air=-sum(by_wind.surge),  # of her own wind, at angle 0
    )


def with_waves(
    sea: SeaParameters,
    model: ManoeuvringModel,
    waves: Waves,
    step: float,
    water_depth: float,
) -> SeaParameters:
    """Parameters of a sea with waves, and what they do to a ship."""
    mobility = mobility_matrix(model, water_depth)
    spectrum = wave_filter(waves)
    drift = wave_drift(waves, model.particulars)
    heading, slope = wave_motion(waves, model.particulars)
    return sea._replace(
        waves_from=_radians(waves.from_deg),
        wave_frequency=spectrum.peak_frequency,
        wave_number=spectrum.peak_frequency**2 / GRAVITY,
        wave_damping=spectrum.damping,
        wave_ringing=float(np.sqrt(1.0 - spectrum.damping**2)),
        drift=discrete(slow_drift(waves, model.particulars), step),
        by_waves=_response(mobility, harmonics(drift, HARMONICS)),
        heading_variance=_variances(heading),
        roll_variance=_variances((roll_stiffness(model) * mobility[3, 3]) ** 2 * slope),
    )


def _variances(curve: Floats) -> Cosines:
    """Series of variances over the angle of the waves.

    It may be slightly negative where they are 0: the kernel clips it there.
    """
    return Cosines(*cosine_coefficients(curve, HARMONICS))


def discrete(process: GaussMarkov, step: float) -> Filter:
    """First-order process in steps of so many seconds."""
    steps = step / process.time_constant
    deviation = process.standard_deviation
    added = float(np.sqrt(-np.expm1(-2.0 * steps)))
    return Filter(
        kept=float(np.exp(-steps)),
        shock=deviation * added,
        deviation=deviation,
    )


def _radians(degrees: float | None) -> float:
    """Direction in rad; NaN where it is to be drawn."""
    return float("nan") if degrees is None else float(np.radians(degrees))


def _response(mobility: Floats, forces: Curves) -> Response:
    """Series of accelerations in surge, sway, yaw and roll by those of forces."""
    lateral = mobility[1:, 1:] @ np.stack(forces[1:])
    surge = mobility[0, 0] * forces.X
    return Response(Cosines(*surge), *(Sines(*series) for series in lateral))
