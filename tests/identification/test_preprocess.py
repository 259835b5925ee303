from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline

from identification import identify
from identification.regression.preprocess import (
    median,
    noise_level,
    outliers,
    repair,
    repaired,
    savitzky_golay,
    smooth,
    smooth_kinematics,
    smoothed_channels,
)
from identification.regression.preprocess.filters import Reinsch
from identification.regression.preprocess.noise import is_noisy, noise_ratio
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag


def signal(noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5, 1.5, 600))
    truth = np.sin(t / 20.0)
    return t, truth, truth + noise * rng.standard_normal(600)


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 1e-1])
def test_noise_level_is_found_at_irregular_times(noise: float) -> None:
    t, _, values = signal(noise)
    assert noise_level(t, values) == pytest.approx(noise, rel=0.15)


def test_smooth_signal_has_no_noise_and_is_left_alone() -> None:
    t, truth, _ = signal(0.0)
    assert noise_level(t, truth) < 1e-5
    assert smooth(t, truth) is not None
    np.testing.assert_array_equal(smooth(t, truth), truth)


def test_smoothing_takes_away_more_than_half_of_the_noise() -> None:
    t, truth, values = signal(0.05)
    assert np.std(smooth(t, values) - truth) < 0.4 * 0.05


def test_smoothing_spline_is_that_of_scipy() -> None:
    t, _, values = signal(0.05)
    np.testing.assert_allclose(
        Reinsch(t).smoothed(values, 30.0), make_smoothing_spline(t, values, lam=30.0)(t), atol=1e-9
    )


@pytest.mark.parametrize("smoother", [savitzky_golay, median])
def test_filters_take_away_noise(smoother: Callable[..., np.ndarray]) -> None:
    t, truth, values = signal(0.05)
    assert np.std(smoother(t, values) - truth) < 0.75 * 0.05


def test_median_takes_away_spikes_and_keeps_steps() -> None:
    step = np.repeat([0.0, 1.0], 50)
    spiked = step.copy()
    spiked[[20, 70]] = 9.0
    np.testing.assert_array_equal(median(np.arange(100.0), spiked), step)


def test_savitzky_golay_keeps_cubics() -> None:
    t = np.linspace(-1.0, 1.0, 101)
    np.testing.assert_allclose(savitzky_golay(t, t**3 - t, 11), t**3 - t, atol=1e-12)


def test_outliers_and_short_dropouts_are_repaired_and_told(noisy_trials: list[Trial]) -> None:
    trial = noisy_trials[0]
    u = trial["u"].copy()
    u[[50, 200]] += 3.0
    kept = np.ones(len(trial), dtype=bool)
    kept[100:103] = False
    wrong = Trial(trial.t[kept], {c: v[kept] for c, v in (dict(trial.channels) | {"u": u}).items()}, name="w")
    mended = repaired(wrong)
    assert mended.raw is wrong
    assert mended.repaired["u"] >= 5
    np.testing.assert_allclose(mended.t, trial.t)
    assert np.abs(mended["u"] - trial["u"]).max() < 0.2
    assert repaired(mended)["u"].max() < 9.0


def test_the_first_and_the_last_sample_may_be_outliers() -> None:
    t = np.arange(200.0)
    u = np.sin(0.05 * t) + 1e-3 * np.random.default_rng(0).standard_normal(200)
    u[[0, -1]] += 0.5
    assert np.flatnonzero(outliers(t, u, may_step=False)).tolist() == [0, 199]
    found = repaired(Trial(t, {"u": u, "delta": u}, name="ends"))
    assert found.repaired == {"u": 2}
    assert found["u"][[0, -1]] == pytest.approx(u[[1, -2]])
    for inside in (1, -2):
        spiked = np.sin(0.05 * t)
        spiked[inside] += 0.5
        assert np.flatnonzero(outliers(t, spiked, may_step=False)).tolist() == [inside % 200]
    for clean in (0.1 * t, np.sin(0.05 * t), np.abs(t - 196.0), np.minimum(t, 5.0), np.exp(-0.3 * t)):
        assert not outliers(t, clean, may_step=False).any()
    gap = np.append(t[:-40], t[-1])
    assert not outliers(gap, 0.1 * gap, may_step=False).any()


def test_a_rudder_put_over_at_the_first_or_the_last_sample_is_no_outlier() -> None:
    t = np.arange(0.0, 600.0, 10.0)
    for angles in ([0.0, 23.0, *[35.0] * 58], [*[10.0] * 59, 20.0]):
        delta = np.radians(angles)
        assert repaired(Trial(t, {"delta": delta}, name="rudder"))["delta"].tolist() == delta.tolist()


def test_clean_trials_are_left_alone(cao_zigzag: Trial) -> None:
    assert repaired(cao_zigzag) is cao_zigzag
    assert cao_zigzag.raw is cao_zigzag


def test_kalman_smoother_makes_velocities_better_and_keeps_the_record(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    run = zigzag(mariner, 20, 20, duration=200, dt=0.1)
    truth, noisy = record(run, 10), record(run, 10, 1.0, 5)
    smoothed = smooth_kinematics(noisy)
    assert smoothed.raw is noisy
    for channel in ("psi", "r", "u", "v"):
        before, after = (np.std(trial[channel] - truth[channel]) for trial in (noisy, smoothed))
        assert after < 0.7 * before


@pytest.mark.parametrize("channel", ["psi", "r"])
def test_kalman_smoother_takes_a_heading_or_a_yaw_rate_alone(
    mariner: ShipModel, record: Callable[..., Trial], channel: str
) -> None:
    run = zigzag(mariner, 20, 20, duration=200, dt=0.1)
    truth, noisy = (
        Trial(one.t, {channel: one[channel], "delta": one["delta"]}, name="alone")
        for one in (record(run, 10), record(run, 10, 1.0, 5))
    )
    before, after = (np.std(one[channel] - truth[channel]) for one in (noisy, smooth_kinematics(noisy)))
    assert after < 0.7 * before


@pytest.mark.parametrize("channels", [("x", "y"), ("v",)])
def test_kalman_smoother_takes_positions_or_sway_alone(
    mariner: ShipModel, record: Callable[..., Trial], channels: tuple[str, ...]
) -> None:
    run = zigzag(mariner, 20, 20, duration=200, dt=0.1)
    truth, noisy = (
        Trial(one.t, {name: one[name] for name in (*channels, "psi", "r", "delta")}, name="some")
        for one in (record(run, 10), record(run, 10, 1.0, 5))
    )
    smoothed = smooth_kinematics(noisy)
    for channel in channels:
        before, after = (np.std(trial[channel] - truth[channel]) for trial in (noisy, smoothed))
        assert after < 0.7 * before


def test_preprocessing_that_does_not_exist_is_refused(mariner: ShipModel, cao_zigzag: Trial) -> None:
    with pytest.raises(InputError, match="preprocessing: 'fourier'"):
        identify([cao_zigzag], preprocessing="fourier", particulars=mariner.particulars)


def test_noise_is_told_by_the_change_over_a_window() -> None:
    """White noise of 0.1 on a ramp of 0.5 a sample: sqrt(2) 0.1 by the root mean square of the change."""
    t = np.arange(20_000.0)
    values = 0.5 * t + 0.1 * np.random.default_rng(0).standard_normal(len(t))
    for window in (1, 10):
        change = np.hypot(0.5 * window, np.sqrt(2.0) * 0.1)
        assert noise_ratio(t, values, window) == pytest.approx(np.sqrt(2.0) * 0.1 / change, rel=0.03)
    assert noise_ratio(t, np.ones(len(t))) == 0.0
    assert noise_ratio(t[:1], values[:1]) == 0.0
    assert is_noisy(t, [t, values])
    assert not is_noisy(t, [t, 2.0 * t])


def test_dropouts_of_up_to_ten_steps_are_filled() -> None:
    """At the usual step, straight where the channel is; a longer one stays a gap."""
    t = np.arange(200.0)
    for missing, filled in ((1, True), (9, True), (10, False)):
        kept = (t < 50.0) | (t >= 50.0 + missing)
        found = repaired(Trial(t[kept], {"u": 3.0 + 0.01 * t[kept]}, name="holes"))
        if filled:
            np.testing.assert_allclose(found.t, t)
            np.testing.assert_allclose(found["u"], 3.0 + 0.01 * t)
            assert found.repaired == {"u": missing}
        else:
            assert len(found) == kept.sum()


def test_an_outlier_is_six_times_the_noise_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(repair, "noise_level", lambda t, values: 0.1)
    for size, found in ((0.59, []), (0.61, [20]), (-0.61, [20])):
        values = np.where(np.arange(50) == 20, size, 0.0)
        assert np.flatnonzero(outliers(np.arange(50.0), values)).tolist() == found


def test_a_tenth_of_a_channel_may_be_outliers(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.arange(200.0)
    for count in (20, 21):
        monkeypatch.setattr(repair, "outliers", lambda *_, n=count, **more: t < n)
        if count == 20:
            assert repaired(Trial(t, {"u": t})).repaired == {"u": 20}
    with pytest.raises(InputError, match="21 of 200 samples of u would be outliers, expected at most a"):
        repaired(Trial(t, {"u": t}))


def test_a_channel_of_outliers_is_refused() -> None:
    t = np.arange(400.0)
    clean = np.sin(0.05 * t) + 1e-3 * np.random.default_rng(0).standard_normal(400)
    for every, refused in ((35, False), (25, True)):  # three beside each other, 9 and 12 % of all
        spiked = clean + np.where((t % every >= 10.0) & (t % every < 13.0) & (t < 390.0), 5.0, 0.0)
        trial = Trial(t, {"u": spiked}, name="spiked")
        if refused:
            with pytest.raises(InputError, match=r"samples of u would be outliers, expected at most a tenth"):
                repaired(trial)
        else:
            found = repaired(trial)
            np.testing.assert_allclose(found["u"], clean, atol=0.05)
            assert found.raw is not None


def test_channels_are_smoothed_as_named_but_for_the_rudder() -> None:
    t, _, values = signal(0.05)
    trial = Trial(t, {"u": 5.0 + values, "delta": np.where(t % 100.0 < 50.0, 0.1, -0.1)}, name="noisy")
    for name, one in (("spline", smooth), ("savgol", savitzky_golay), ("median", median)):
        found = smoothed_channels(trial, ["u", "delta"], name)
        np.testing.assert_array_equal(found["u"], one(t, trial["u"]))
        assert not np.array_equal(found["u"], trial["u"])
        np.testing.assert_array_equal(found["delta"], trial["delta"])
    np.testing.assert_array_equal(smoothed_channels(trial, ["u"], "none")["u"], trial["u"])
    with pytest.raises(InputError, match="preprocessing: 'splines' found"):
        smoothed_channels(trial, ["u"], "splines")
