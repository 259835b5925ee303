"""Golden section `seas`: what wind, waves and current do to ships of different shapes, without a voyage."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

import shipgym
from shipgym import sea
from shipgym.sea.added_resistance import added_resistance, end_angle
from shipgym.sea.drift import reflection_coefficients, waterline
from shipgym.sea.mobility import mobility_matrix
from shipgym.sea.motions import heading_response, roll_response
from shipgym.sea.waves import draught_attenuation, over_directions
from shipgym.sea.weather_column import weather_column
from shipgym.sea.wind_coefficients import coefficient_names
from shipgym.trials.sensors import SEA_TRIAL, Sensor, Sensors
from tests.golden.store import Floats, numbers_in

SHIPS = ("mariner", "kvlcc2", "container", "tanker")
WAVES = (
    shipgym.Waves(1.7, 6.3, peak_enhancement=2.1),
    shipgym.Waves(4.2, 11.0, spectrum="pierson-moskowitz", spreading="long-crested"),
)
WINDS = tuple(
    shipgym.Wind(speed, spectrum=spectrum)
    for speed in (7.3, 21.0)
    for spectrum in ("harris", "davenport", "norsok")
)
EVERY = 31  # of the angles of curves
CHI = np.radians([3.0, 38.0, 77.0, 131.0, 176.0])
OMEGA = np.array([0.21, 0.47, 0.83, 1.6])


def cases() -> dict[str, str]:
    """Ships, and what belongs to none, by the name of their case."""
    return {name: name for name in (*SHIPS, "alone", "sensors")}


def record(name: str) -> dict[str, Floats]:
    """The numbers of a case."""
    if name == "alone":
        return without_ship()
    return measured() if name == "sensors" else of_ship(shipgym.load_model(name))


def thinned(content: Any, path: str) -> dict[str, Floats]:
    """The numbers of a record of curves, of long ones some."""
    fields = (
        asdict(content)
        if hasattr(content, "__dataclass_fields__")
        else content._asdict()
    )
    found: dict[str, Floats] = {}
    for name, value in fields.items():
        numbers = np.ravel(value)
        if numbers.size and numbers.dtype.kind in "fiub":
            found[f"{path} {name}"] = np.append(
                numbers[:: EVERY if numbers.size > 50 else 1], numbers.mean()
            )
        elif not isinstance(value, str | tuple):
            found |= thinned(value, f"{path} {name}")
    return found


def without_ship() -> dict[str, Floats]:
    """Spectra, filters and the table of sea states."""
    found: dict[str, Floats] = {}
    for number, waves in enumerate(WAVES):
        found[f"waves {number} spectrum"] = sea.wave_spectrum(waves, OMEGA)
        found[f"waves {number} spread"] = over_directions(
            np.cos(np.arange(72) / 9.0) + 0.3, waves
        )[::EVERY]
        found |= thinned(sea.wave_filter(waves), f"waves {number} filter")
    for number, wind in enumerate(WINDS):
        found[f"wind {number} spectrum"] = sea.gust_spectrum(
            OMEGA / 30.0, wind.speed, wind.spectrum
        )
        found[f"wind {number} variance"] = np.array(
            [sea.gust_variance(wind.speed, wind.spectrum)]
        )
        found |= thinned(sea.gust_filter(wind), f"wind {number} filter")
    found["encounter"] = sea.encounter_frequency(OMEGA[:, None], 7.7, CHI).ravel()
    found["attenuation"] = draught_attenuation(OMEGA, 8.3)
    found |= {
        f"{where} {name}": numbers
        for where, state in sea.sea_states().items()
        for name, numbers in numbers_in(asdict(state)).items()
    }
    return found


def of_ship(model: Any) -> dict[str, Floats]:
    """Forces on a ship, her motions, and all that an environment is told of a sea."""
    ship = sea.weather_particulars(model.particulars)
    speed = 0.8 * ship.speed
    found = numbers_in(
        {k: v for k, v in asdict(ship).items() if isinstance(v, float)}, "particulars"
    )
    for kind in coefficient_names():
        found |= thinned(sea.wind_curves(model.particulars, kind), f"wind {kind}")
    found["waterline"] = np.array([*np.ravel(waterline(ship)), end_angle(ship)])
    found["reflection"] = np.concatenate(reflection_coefficients(CHI, ship)).ravel()
    found["resistance"] = added_resistance(OMEGA[:, None], CHI, ship, speed).ravel()
    found["heading"] = heading_response(OMEGA[:, None], CHI, ship).ravel()
    if "phi" in model.state_names:
        found["roll"] = roll_response(OMEGA[:, None], CHI, ship, speed).ravel()
    found["mobility"] = mobility_matrix(model).ravel()
    for number, waves in enumerate(WAVES):
        found |= thinned(
            sea.wave_drift(waves, model.particulars, speed), f"waves {number} drift"
        )
        found |= thinned(
            sea.wave_motion(waves, model.particulars, speed), f"waves {number} motion"
        )
        found |= thinned(
            sea.slow_drift(waves, model.particulars), f"waves {number} slow drift"
        )
        wind = replace(WINDS[2 + number], from_deg=200.0)
        current = shipgym.Current(0.6, towards_deg=70.0, variation=0.2)
        weather = shipgym.Weather(current=current, wind=wind, waves=waves)
        found[f"column {number}"] = np.ravel(
            weather_column(model, weather, 0.4)
        ).astype(float)
    return found


def measured() -> dict[str, Floats]:
    """A trial as instruments show it."""
    trial = shipgym.manoeuvres.zigzag(
        shipgym.load_model("mariner"), 15.0, 10.0, duration=120.0, dt=0.5
    )
    rough = Sensor(
        noise=0.003,
        resolution=0.002,
        drift=0.01,
        drift_time_s=40.0,
        outlier_probability=0.03,
        outlier_size=0.2,
        latency_s=1.3,
    )
    bad = Sensors(
        {"psi": rough, "u": rough}, dropout_probability=0.02, dropout_samples=5.0
    )
    sets = {
        "sea trial": Sensors(),
        "bad": replace(bad, sampling_s=1.5),
        "all": Sensors({name: replace(rough, drift=0.02) for name in SEA_TRIAL}),
    }
    return {
        f"{what} {name}": np.nan_to_num(np.asarray(reading[name])[::3], nan=-1e3)
        for what, sensors in sets.items()
        for reading in [sensors.measure(trial, 5)]
        for name in reading.channels
    }
