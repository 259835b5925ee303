"""The sea as loops read it: what current, wind and waves do to a ship, as numbers of `SeaParameters`.

The inverse of a ship's inertia (`mobility_matrix`) makes accelerations of the forces.
"""

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.records import flat
from shipgym.errors import InputError
from shipgym.sea.conditions import Waves, Weather, Wind
from shipgym.sea.drift import wave_drift
from shipgym.sea.estimates import GRAVITY, weather_particulars
from shipgym.sea.gusts import GaussMarkov, gust_filter
from shipgym.sea.harmonics import Harmonics
from shipgym.sea.motions import wave_motion
from shipgym.sea.open_sea import Cosines, Filter, SeaParameters, Sines
from shipgym.sea.waves import wave_filter
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.ships.inertia import inertia
from shipgym.ships.manoeuvring_model import ManoeuvringModel
from shipgym.ships.term_table import Structure

HARMONICS = len(Sines._fields)
FLAT, NONE, STEADY = (
    Cosines(*[0.0] * (HARMONICS + 1)),
    Sines(*[0.0] * HARMONICS),
    Filter(0.0, 0.0, 0.0),
)
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
    wind_surge=FLAT,
    wind_sway=NONE,
    wind_yaw=NONE,
    wind_roll=NONE,
    drift_surge=FLAT,
    drift_sway=NONE,
    drift_yaw=NONE,
    drift_roll=NONE,
    heading_variance=FLAT,
    roll_variance=FLAT,
)


def as_weather(
    weather: Weather | str | None, where: str, from_deg: float | None = 45.0
) -> Weather:
    """A weather itself, that of a sea state by name, or calm; InputError for anything else."""
    if weather is None:
        return Weather(name="calm")
    if isinstance(weather, Weather):
        return weather
    if not isinstance(weather, str):
        raise InputError(
            f"{where}: {weather!r} found, expected a Weather of shipgym.sea or the name"
            " of a sea state"
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

    `step`, s, is the time between two states of the sea; the added mass may depend on
    `water_depth`, m. Raises InputError if the ship's particulars are not enough.
    """
    sea, current, wind, waves = CALM, weather.current, weather.wind, weather.waves
    if current is not None and not current.calm:
        varying = _filter(GaussMarkov(current.time_constant, current.variation), step)
        towards = _direction(current.towards_deg)
        sea = sea._replace(
            current_speed=current.speed, current_towards=towards, current=varying
        )
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
    shock = process.standard_deviation * float(
        np.sqrt(-np.expm1(-2.0 * step / process.time_constant))
    )
    return Filter(
        float(np.exp(-step / process.time_constant)), shock, process.standard_deviation
    )


def _with_wind(
    sea: SeaParameters,
    model: ManoeuvringModel,
    wind: Wind,
    step: float,
    mobility: Floats,
) -> SeaParameters:
    areas = wind_curves(model.particulars, wind.coefficients).harmonics(HARMONICS)
    forces = Harmonics(*(0.5 * AIR_DENSITY * series for series in areas))
    surge, sway, yaw, roll = _accelerations(mobility, forces)
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
    sea: SeaParameters,
    model: ManoeuvringModel,
    waves: Waves,
    step: float,
    mobility: Floats,
) -> SeaParameters:
    spectrum = wave_filter(waves)
    drift, motion = (
        wave_drift(waves, model.particulars),
        wave_motion(waves, model.particulars),
    )
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


def _accelerations(
    mobility: Floats, forces: Harmonics
) -> tuple[Floats, Floats, Floats, Floats]:
    """Series of the accelerations in surge (cosines), sway, yaw and roll (sines) by those of the forces."""
    lateral = mobility[1:, 1:] @ np.stack([forces.Y, forces.N, forces.K])
    return mobility[0, 0] * forces.X, lateral[0], lateral[1], lateral[2]


def mobility_matrix(model: ManoeuvringModel, water_depth: float = np.inf) -> Floats:
    """Inverse of mass and added mass, from X, Y, N, K to accelerations, SI units, shape (4, 4).

    The accelerations are those in surge, sway, yaw and roll. An identified model
    divides by the inertia of its particulars, given or estimated, a reference ship by
    that of its own equations (the tanker's depends on the depth, m). A structure
    without an equation of surge keeps its speed, one without sway or yaw does not drift
    or turn: their rows and columns are 0. So is roll where the model has none; a
    structure with an equation of roll, or a ship of the user's that rolls, has that
    inertia which the roll period and the metacentric height tell. Raises InputError
    that names what mass and added mass lack.
    """
    if isinstance(model.dynamics, Structure):
        weather_particulars(model.particulars)  # says what is missing
    mass = np.zeros((4, 4))
    try:
        mass[:3] = inertia(model, water_depth)
    except InputError as error:
        raise InputError(f"weather without the particulars it needs: {error}") from None
    axes = [0, 1, 2, 3] if "phi" in model.state_names else [0, 1, 2]
    if isinstance(model.dynamics, Structure):
        axes = [
            "uvrp".index(equation)
            for equation in model.dynamics.equations
            if equation in "uvrp"
        ]
    if model.structure == "container":
        mass[3] = _container_roll(model, mass)
    elif 3 in axes:
        mass[3, 3] = roll_inertia(model)
    matrix = np.zeros((4, 4))
    matrix[np.ix_(axes, axes)] = np.linalg.inv(mass[np.ix_(axes, axes)])
    return matrix


def roll_inertia(model: ManoeuvringModel) -> float:
    """Inertia in roll of the ship and the water that rolls with it, kg m2: m g GM (T / 2 pi)^2."""
    ship = weather_particulars(model.particulars)
    stiffness = ship.require("mass") * GRAVITY * ship.require("metacentric_height")
    return stiffness * (ship.require("roll_period") / (2.0 * np.pi)) ** 2


def _container_roll(model: ManoeuvringModel, mass: Floats) -> Floats:
    """Row of roll in Son & Nomoto's equations, whose inertia is symmetric."""
    numbers, p = model.coefficients, model.particulars
    unit = 0.5 * p.require("water_density") * p.length**5
    return np.array([0.0, mass[1, 3], 0.0, (numbers["Ix"] + numbers["Jx"]) * unit])
