"""Current, wind and waves as they act on one ship: parameters of its sea."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.constants import GRAVITY
from shipgym.sea.current_wind_waves import Current, Waves, Wind
from shipgym.sea.drift import wave_drift
from shipgym.sea.filters import Filter
from shipgym.sea.gusts import GaussMarkov, gust_filter
from shipgym.sea.harmonics import Harmonics
from shipgym.sea.mobility import mobility_matrix
from shipgym.sea.motions import wave_motion
from shipgym.sea.open_sea import SeaParameters
from shipgym.sea.series import Cosines, Sines
from shipgym.sea.waves import wave_filter
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.ships.manoeuvring_model import ManoeuvringModel

HARMONICS = len(Sines._fields)


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
    areas = wind_curves(model.particulars, wind.coefficients).harmonics(HARMONICS)
    forces = Harmonics(*(0.5 * AIR_DENSITY * series for series in areas))
    by_wind = _accelerations(mobility, forces)
    of_her_own_wind = float(by_wind.X.sum())  # at angle 0
    return sea._replace(
        wind_speed=wind.speed,
        wind_from=_radians(wind.from_deg),
        gust=discrete(gust_filter(wind), step),
        wind_surge=Cosines(*by_wind.X),
        wind_sway=Sines(*by_wind.Y),
        wind_yaw=Sines(*by_wind.N),
        wind_roll=Sines(*by_wind.K),
        still_air=-of_her_own_wind,
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
    slow_drift = GaussMarkov(drift.time_constant, drift.standard_deviation)
    motion = wave_motion(waves, model.particulars)
    by_waves = _accelerations(mobility, drift.harmonics(HARMONICS))
    return sea._replace(
        waves_from=_radians(waves.from_deg),
        wave_frequency=spectrum.peak_frequency,
        wave_number=spectrum.peak_frequency**2 / GRAVITY,
        wave_damping=spectrum.damping,
        wave_ringing=float(np.sqrt(1.0 - spectrum.damping**2)),
        drift=discrete(slow_drift, step),
        drift_surge=Cosines(*by_waves.X),
        drift_sway=Sines(*by_waves.Y),
        drift_yaw=Sines(*by_waves.N),
        drift_roll=Sines(*by_waves.K),
        heading_variance=Cosines(*motion.heading_variance_harmonics(HARMONICS)),
        roll_variance=Cosines(*motion.roll_variance_harmonics(HARMONICS)),
    )


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


def _accelerations(mobility: Floats, forces: Harmonics) -> Harmonics:
    """Series of accelerations in surge, sway, yaw and roll by those of forces."""
    lateral = mobility[1:, 1:] @ np.stack([forces.Y, forces.N, forces.K])
    sway, yaw, roll = lateral
    return Harmonics(mobility[0, 0] * forces.X, sway, yaw, roll)
