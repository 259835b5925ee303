"""The sea as loops read it, as numbers of `SeaParameters`."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.records import flat
from shipgym.sea.conditions import Weather
from shipgym.sea.filters import Filter
from shipgym.sea.open_sea import SeaParameters
from shipgym.sea.series import Cosines, Sines
from shipgym.ships.manoeuvring_model import ManoeuvringModel

STEADY = Filter(0.0, 0.0, 0.0)
NO_COSINES = Cosines(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NO_SINES = Sines(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
CALM = SeaParameters(
    current_speed=0.0,
    current_towards=0.0,
    current=STEADY,
    wind_speed=0.0,
    wind_from=0.0,
    gust=STEADY,
    waves_from=0.0,
    wave_frequency=0.0,
    wave_number=0.0,
    wave_damping=0.0,
    wave_ringing=1.0,
    drift=STEADY,
    still_air=0.0,
    wind_surge=NO_COSINES,
    wind_sway=NO_SINES,
    wind_yaw=NO_SINES,
    wind_roll=NO_SINES,
    drift_surge=NO_COSINES,
    drift_sway=NO_SINES,
    drift_yaw=NO_SINES,
    drift_roll=NO_SINES,
    heading_variance=NO_COSINES,
    roll_variance=NO_COSINES,
)


def weather_column(
    model: ManoeuvringModel, weather: Weather, step: float, water_depth: float = np.inf
) -> Floats:
    """Effect of a weather on a ship, in the order of `SeaParameters`, by her inertia.

    `step`, s, is the time between two states of the sea; the added mass may depend on
    `water_depth`, m. Raises InputError if the ship's particulars are not enough.
    """
    # what calm water does without is loaded where it is needed
    from shipgym.sea.current_wind_waves import Current
    from shipgym.sea.ship_in_weather import with_current, with_waves, with_wind

    sea = CALM
    current = weather.current
    if isinstance(current, Current) and not current.calm:
        sea = with_current(sea, current, step)
    wind = weather.wind
    if wind is not None and not wind.calm:
        sea = with_wind(sea, model, wind, step, water_depth)
    waves = weather.waves
    if waves is not None and not waves.calm:
        sea = with_waves(sea, model, waves, step, water_depth)
    return np.array(flat(sea))
