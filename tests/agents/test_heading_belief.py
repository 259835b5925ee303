"""A heading is believed while rate of turn, rudder and course over ground agree."""

import asyncio
import pickle
from functools import cache

import lying_sentences as study
import numpy as np
import pytest

from agents import PID
from agents.export.heading_belief import HeadingBelief
from agents.export.nmea import NmeaReading
from agents.export.residuals import false_alarms
from agents.export.sensors import HelmSensors, Limits
from agents.export.simulated import simulate_ship
from agents.export.steering import steer
from tests.agents.policies import MARINER
from tests.agents.steering import free_port, no_waiting

PID_MARINER = PID.from_model(MARINER)
LIES = study.lies()
SECONDS = 100.0


@cache
def sailed_honestly(turns):
    bridge = study.Bridge(MARINER, PID_MARINER, turns)
    return bridge, study.honest(bridge, SECONDS)


@pytest.mark.parametrize(
    ("lie", "turns", "alarm"),
    [
        ("heading frozen", False, "stands still"),
        ("heading frozen", True, "stands still"),
        ("heading jumps by 180 deg", False, "disagree"),
        ("heading jumps by -20 deg", True, "disagree"),
        ("heading drifts by 1 deg/s", False, "disagree"),
        ("heading drifts by -1 deg/s", True, "disagree"),
        ("two compasses 60 deg apart, each 0.1 s", False, ""),
        ("two compasses 60 deg apart, each 5 s", True, ""),
        ("heading with noise of 20 deg", False, ""),
        ("rate reversed", True, "disagree"),
        ("rate 0", True, ""),
        ("course jumps by 90 deg", False, "course over ground"),
    ],
)
def test_a_lie_ends_in_an_alarm_within_10_s_and_20_degrees(lie, turns, alarm):
    bridge, true = sailed_honestly(turns)
    found = study.outcome(bridge, LIES[lie](), true)
    assert found.is_in_time, found
    assert alarm in found.alarm


@pytest.mark.parametrize("lie", ["heading frozen", "heading drifts by 1 deg/s"])
def test_it_hands_over_over_tcp_too(lie):
    """One end serves the sentences of a lying ship, the other one steers by them."""
    ship = study.LyingShip(MARINER, weather="rough", seed=1)
    ship.lie, ship.begins = LIES[lie](), 20.0
    address = f"tcp:127.0.0.1:{free_port()}"

    async def both():
        task = asyncio.create_task(simulate_ship(ship, address, duration=60.0))
        await asyncio.sleep(0.05)
        helm = await steer(PID_MARINER, address, heading=0.2, duration=40.0)
        task.cancel()
        return helm

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        helm = runner.run(both())
    assert "heading" in helm.alarm
    assert ship.order == 0.0  # which she centres when orders are invalid


def test_six_deviations_are_left_once_in_years_as_rice_says():
    """Upcrossings of two deviations are counted in noise between 0.1 and 0.15 Hz."""
    random = np.random.default_rng(0)
    n, step = 2**20, 0.5
    frequencies = np.fft.rfftfreq(n, step)
    passes = (frequencies > 0.1) & (frequencies < 0.15)
    noise = random.standard_normal((2, len(passes)))
    spectrum = np.where(passes, noise[0] + 1j * noise[1], 0.0)
    signal = np.fft.irfft(spectrum)
    off = np.abs(signal) > 2.0 * signal.std()
    counted = np.count_nonzero(off[1:] & ~off[:-1]) / (n * step)
    mean_frequency = np.sqrt(np.mean(frequencies[passes] ** 2))
    assert counted == pytest.approx(false_alarms(2.0, 1.0 / mean_frequency), rel=0.05)
    year = 365.25 * 86400.0
    assert 5.0 * year < 1.0 / false_alarms(6.0, 8.0) < 10.0 * year


def told(heading_at, ticks, rate_at=None, rudder_at=lambda now: 0.0, **limits):
    """First doubt and its time, of readings once a second; and the belief."""
    limits = Limits(**limits)
    belief, sensors = HeadingBelief(PID_MARINER, limits), HelmSensors(limits)
    for now in range(ticks):
        readings = {"heading": heading_at(now), "rudder": rudder_at(now)}
        if rate_at is not None:
            readings["yaw_rate"] = rate_at(now)
        for quantity, value in readings.items():
            reading = NmeaReading(quantity, value, "HE")
            sensors.take(reading, float(now))
            belief.take(reading, float(now))
        doubt = belief.doubt(sensors, float(now))
        if doubt:
            return doubt, now, belief
    return "", ticks, belief


DEG = np.radians(1.0)


def test_without_a_rate_gyro_the_rudder_contradicts_a_heading_that_turns_by_itself():
    doubt, at, _ = told(lambda now: 1.0 * DEG * max(0, now - 60), 90)
    assert doubt == "the heading does not answer to the rudder"
    assert at - 60 <= 15


def test_a_heading_that_stands_while_the_rudder_is_put_over_is_not_believed():
    doubt, at, _ = told(
        heading_at=lambda now: 0.5,
        ticks=60,
        rate_at=lambda now: 0.0,
        rudder_at=lambda now: 30.0 * DEG * (now > 20),
    )
    assert doubt == "the heading does not move under rudder"
    assert at - 20 < 15


def test_a_rate_of_turn_that_repeats_a_digit_while_the_compass_swings_is_not_believed():
    def heading(now):
        return 1.8 * DEG * np.sin(0.9 * now)

    def rate(now):
        return 1.8 * DEG * 0.9 * np.cos(0.9 * now)

    assert told(heading, 200, rate)[0] == ""
    doubt, at, _ = told(heading, 200, lambda now: rate(min(now, 100)))
    assert "rate of turn" in doubt
    assert at - 100 <= 10


def test_limits_decide_how_much_noise_is_believed():
    random = np.random.default_rng(0)
    noise = (random.standard_normal(1000) * 0.4 * DEG).tolist()

    def doubt(**limits):
        return told(lambda now: noise[now], 1000, lambda now: 0.0, **limits)[0]

    assert doubt() == ""
    assert doubt(heading_noise_deg=0.05) != ""


def test_it_remembers_a_few_numbers_however_long_it_runs():
    sizes = []
    for ticks in (100, 2000):
        _, _, belief = told(lambda now: 0.3 * DEG * np.sin(now), ticks)
        sizes.append(len(pickle.dumps(belief)))
    assert sizes[1] < sizes[0] + 100
