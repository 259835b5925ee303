"""What a user says of the weather: the table of sea states, and what is refused."""

import json

import numpy as np
import pytest

from shipgym import Current, InputError, Waves, Weather, Wind
from shipgym.sea.conditions import as_weather


@pytest.mark.parametrize(
    ("name", "height", "period", "knots"),
    [
        ("slight", 0.88, 7.5, 13.5),
        ("moderate", 1.88, 8.8, 19.0),
        ("rough", 3.25, 9.7, 24.5),
    ],
)
def test_sea_states_are_those_of_bales_1983(name, height, period, knots):
    weather = Weather.from_sea_state(name)
    assert weather.waves.significant_height == height
    assert weather.waves.peak_period == period
    assert weather.wind.speed == pytest.approx(
        knots * 0.514444 * (10 / 19.5) ** (1 / 7), rel=1e-5
    )
    assert weather.wind.from_deg == weather.waves.from_deg == 45.0


def test_calm_is_calm_unless_there_is_a_current():
    assert Weather.from_sea_state("calm").calm
    assert Weather(Current(0.0), Wind(0.0), Waves(0.0, 8.0)).calm
    assert not Weather.from_sea_state("calm", current=Current(0.5, 90.0)).calm
    assert not Weather(Current(0.0, variation=0.1)).calm


@pytest.mark.parametrize(
    "weather",
    [
        Weather(),
        Weather.from_sea_state(
            "slight", from_deg=None, current=Current(0.7, 180.0, 0.1, 300.0)
        ),
        Weather(
            wind=Wind(12.0, 30.0, gust=False),
            name="tunnel",
        ),
        Weather(waves=Waves(2.0, 9.0, -30.0, 1.0, spreading="long-crested")),
    ],
)
def test_weather_survives_json(weather):
    assert Weather.from_dict(json.loads(json.dumps(weather.to_dict()))) == weather


STATES = r"expected one of 'calm', .*'rough'; for another sea give .*, got "


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Weather.from_sea_state("moderat"), STATES + "'mod.*mean 'moderate'"),
        (lambda: Weather.from_sea_state(7), f"sea state: {STATES}7"),
        (
            lambda: as_weather("rugh", "task"),
            f"task: .*{STATES}'rugh'.*mean 'rough'",
        ),
        (lambda: as_weather(3, "task"), "task: expected a Weather of shipgym.sea"),
        (lambda: Weather(name=""), "weather name"),
        (lambda: Weather(wind=5.0), r"weather wind: expected shipgym.Wind\(...\) or"),
        (lambda: Weather.from_dict({"winds": {}}), "Did you mean 'wind'"),
        (lambda: Weather.from_dict({"wind": {}}), "weather wind: .*'speed' is missing"),
        (lambda: Wind(5.0, 400.0), "wind from_deg: .*clockwise from north"),
        (lambda: Wind(5.0, gust="yes"), "wind gust: "),
        (lambda: Waves(3.0, 3.0), "expected at most 1.4.* peak_period 3, got 3; steep"),
        (lambda: Waves(np.nan, 8.0), "waves significant_height: "),
        (lambda: Waves(1.0, 0.0), "waves peak_period: .*> 0"),
        (lambda: Waves(1.0, 8.0, peak_enhancement=0.5), "peak_enhancement: .*>= 1"),
        (lambda: Waves(1.0, 8.0, spreading="wide"), "waves spreading: .*'long-crest"),
        (lambda: Current(0.5, time_constant=0.0), "current time_constant: .*in s"),
    ],
)
def test_impossible_weather_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_a_sea_state_by_name_comes_from_north_east():
    weather = as_weather("rough", "weather")
    assert weather == Weather.from_sea_state("rough", 45.0)
    assert as_weather("calm", "weather") == Weather.from_sea_state("calm")
    assert as_weather("rough", "weather", None).wind.from_deg is None
    assert as_weather(None, "weather").calm
    assert as_weather(weather, "weather") is weather
