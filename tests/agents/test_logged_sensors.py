"""Designs take noise and waves from what the trials of their model show."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, LQG, PID
from agents.controllers.designs import design
from agents.suites.benchmark_task import BenchmarkTask
from identification.samples.logged_sensors import noise_and_waves
from shipgym import Trial, manoeuvres
from shipgym.errors import InputError
from shipgym.instruments.noise import SEA_TRIAL
from tests.agents.mariners import LENGTH_TIME, MARINER

NOISE = {"psi": SEA_TRIAL["heading"], "r": SEA_TRIAL["yaw_rate"]}


def logs(weather, noise, seed):
    """Zigzags 10/10 and 20/20, with so many times the noise of a sea trial."""
    random = np.random.default_rng(seed)
    found = []
    for angle in (10.0, 20.0):
        run = manoeuvres.zigzag(
            MARINER, angle, angle, duration=600.0, weather=weather, seed=10 * seed
        )
        t = run.t[::5]
        channels = {}
        for name, level in NOISE.items():
            waves = run[f"{name}_wave"] if weather else 0.0
            drawn = noise * level * random.standard_normal(len(t))
            channels[name] = (run[name] + waves)[::5] + drawn
        found.append(Trial(t, channels, name=f"{angle:.0f}"))
    return found


def with_provenance(**found):
    return replace(MARINER, provenance=found)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("noise", [1.0, 5.0])
def test_trials_show_the_noise_and_a_sea_alone_a_period(noise, seed):
    calm = noise_and_waves(logs(None, noise, seed), LENGTH_TIME)
    rough = noise_and_waves(logs("rough", noise, seed), LENGTH_TIME)
    for name in ("psi", "r"):
        for found in (calm, rough):
            shown = found["noise"][name] / NOISE[name]
            assert shown == pytest.approx(noise, rel=0.4)
    assert "wave_period" not in calm
    assert rough["wave_period"] == pytest.approx(8.1, abs=0.9)


@pytest.mark.parametrize("kind", [PID, LQG])
def test_a_design_expects_the_noise_of_its_model_s_trials(kind):
    def expected(multiple, **settings):
        level = multiple * NOISE["r"]
        model = with_provenance(noise={"psi": 0.0, "r": level})
        return kind.from_model(model, **settings).design["noise"]

    assert kind.from_model(MARINER).design["noise"] == 1.0
    assert [expected(m) for m in (0.1, 3.0, 30.0)] == pytest.approx([1.0, 3.0, 10.0])
    assert expected(3.0, noise=2.0) == 2.0
    place = r"^model 'mariner': provenance\.noise"
    with pytest.raises(InputError, match=rf"{place}\.r: .*expected a number"):
        kind.from_model(with_provenance(noise={"r": "loud"}))
    with pytest.raises(InputError, match=f"{place}: expected a table"):
        kind.from_model(with_provenance(noise="loud"))


@pytest.mark.parametrize("kind", [PID, LQ])
def test_a_period_in_the_trials_is_filtered_unless_another_is_given(kind):
    model = with_provenance(wave_period=8.0)
    assert kind.from_model(model).gains["wave_period"] == 8.0
    assert kind.from_model(model, wave_period=9.0).gains["wave_period"] == 9.0
    calm = kind.from_model(model, wave_period=0.0)
    assert calm.gains == kind.from_model(MARINER).gains
    too_short = with_provenance(wave_period=1.0)  # for the control interval
    assert kind.from_model(too_short).gains["wave_period"] == 0.0
    assert np.isfinite(kind.from_model(model).margins.delay_margin_s)


@pytest.mark.parametrize("kind", [PID, LQ, LQG])
@pytest.mark.parametrize("period", [1e9, 61.0, -1.0, "8"])
def test_a_period_of_no_sea_in_a_model_is_refused(kind, period):
    with pytest.raises(
        InputError, match=r"'mariner': provenance\.wave_period: .*<= 60"
    ):
        kind.from_model(with_provenance(wave_period=period))


@pytest.mark.parametrize(("period", "filtered"), [(3.0, 0.0), (8.0, 8.0)])
def test_a_sea_that_the_interval_cannot_follow_is_not_filtered(period, filtered):
    sea = {"name": "sea", "waves": {"significant_height": 0.5, "peak_period": period}}
    task = BenchmarkTask("sea", "course-keeping", "kvlcc2", options={"sea": sea})
    assert design("lq", task).gains["wave_period"] == filtered
