from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline
from scipy.ndimage import median_filter
from scipy.signal import savgol_filter
from scipy.stats import multivariate_normal

from identification import identify
from identification.samples.preprocess import (
    median,
    noise_level,
    outliers,
    repaired,
    savitzky_golay,
    smooth,
    smoothed_channels,
)
from identification.samples.preprocess.filters import Reinsch
from identification.samples.preprocess.kalman import LinearSystem
from identification.samples.preprocess.kinematics import (
    heading_motion,
    plane_motion,
    smooth_kinematics,
)
from identification.samples.preprocess.noise import is_noisy, noise_ratio
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
        Reinsch(t).smoothed(values, 30.0),
        make_smoothing_spline(t, values, lam=30.0)(t),
        atol=1e-9,
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


def test_outliers_and_short_dropouts_are_repaired_and_told(
    noisy_trials: list[Trial],
) -> None:
    trial = noisy_trials[0]
    u = trial["u"].copy()
    u[[50, 200]] += 3.0
    kept = np.ones(len(trial), dtype=bool)
    kept[100:103] = False
    wrong = Trial(
        trial.t[kept],
        {c: v[kept] for c, v in (dict(trial.channels) | {"u": u}).items()},
        name="w",
    )
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
        assert np.flatnonzero(outliers(t, spiked, may_step=False)).tolist() == [
            inside % 200
        ]
    for clean in (
        0.1 * t,
        np.sin(0.05 * t),
        np.abs(t - 196.0),
        np.minimum(t, 5.0),
        np.exp(-0.3 * t),
    ):
        assert not outliers(t, clean, may_step=False).any()
    gap = np.append(t[:-40], t[-1])
    assert not outliers(gap, 0.1 * gap, may_step=False).any()


def test_a_rudder_put_over_at_the_first_or_the_last_sample_is_no_outlier() -> None:
    t = np.arange(0.0, 600.0, 10.0)
    for angles in ([0.0, 23.0, *[35.0] * 58], [*[10.0] * 59, 20.0]):
        delta = np.radians(angles)
        assert (
            repaired(Trial(t, {"delta": delta}, name="rudder"))["delta"].tolist()
            == delta.tolist()
        )


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
        before, after = (
            np.std(trial[channel] - truth[channel]) for trial in (noisy, smoothed)
        )
        assert after < 0.7 * before


@pytest.mark.parametrize(
    ("recorded", "better"),
    [("psi", "psi"), ("r", "r"), ("x y psi r", "x y"), ("v psi r", "v")],
)
def test_kalman_smoother_takes_the_channels_there_are(
    mariner: ShipModel, record: Callable[..., Trial], recorded: str, better: str
) -> None:
    run = zigzag(mariner, 20, 20, duration=200, dt=0.1)
    truth = record(run, 10)
    noisy = record(run, 10, 1.0, 5)
    channels = {name: noisy[name] for name in (*recorded.split(), "delta")}
    smoothed = smooth_kinematics(Trial(noisy.t, channels, name="some"))
    for channel in better.split():
        before = np.std(noisy[channel] - truth[channel])
        assert np.std(smoothed[channel] - truth[channel]) < 0.7 * before


def test_preprocessing_that_does_not_exist_is_refused(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    with pytest.raises(InputError, match=r"preprocessing: expected .*got 'fourier'"):
        identify([cao_zigzag], preprocessing="fourier", particulars=mariner.particulars)


def test_noise_is_told_by_the_change_over_a_window() -> None:
    """White noise of 0.1 on a ramp of 0.5 a sample: sqrt(2) 0.1 by its change."""
    t = np.arange(20_000.0)
    values = 0.5 * t + 0.1 * np.random.default_rng(0).standard_normal(len(t))
    for window in (1, 10):
        change = np.hypot(0.5 * window, np.sqrt(2.0) * 0.1)
        assert noise_ratio(t, values, window) == pytest.approx(
            np.sqrt(2.0) * 0.1 / change, rel=0.03
        )
    assert noise_ratio(t, np.ones(len(t))) == 0.0
    assert noise_ratio(t[:1], values[:1]) == 0.0
    assert is_noisy(t, [t, values])
    assert not is_noisy(t, [t, 2.0 * t])


@pytest.mark.parametrize("step", [0.1, 10.0])
@pytest.mark.parametrize(
    ("hole", "missing"),
    [(1.0, 0), (1.45, 0), (1.55, 1), (2.0, 1), (10.0, 9), (10.45, 9), (10.52, 0)],
)
def test_steps_of_one_and_a_half_to_ten_and_a_half_usual_ones_are_filled(
    step: float, hole: float, missing: int
) -> None:
    """At the usual step, straight where the channel is; a longer one stays a gap."""
    usual = np.arange(60.0)
    t = step * np.concatenate([usual, usual + usual[-1] + hole])
    straight = 3.0 + 0.01 * t
    found = repaired(Trial(t, {"u": straight}, name="hole"))
    assert len(found) == len(t) + missing
    assert set(t) <= set(found.t)
    assert found.repaired == ({"u": missing} if missing else {})
    inside = found.t[59 : 61 + missing]
    np.testing.assert_allclose(np.diff(inside), step * hole / (missing + 1))
    np.testing.assert_allclose(found["u"], 3.0 + 0.01 * found.t)


def chequered(t: np.ndarray, noise: float) -> np.ndarray:
    """A record of known `noise_level`: alternating values, of the cubic's weights."""
    gain = np.sqrt(1.0 + 2.0 * (4.0 / 6.0) ** 2 + 2.0 * (1.0 / 6.0) ** 2)
    size = noise * 0.6745 * gain / (1.0 + 8.0 / 6.0 + 2.0 / 6.0)
    return size * (-1.0) ** np.arange(len(t))


def test_an_outlier_is_several_times_the_noise_away() -> None:
    t = np.arange(200.0)
    record = chequered(t, 0.1)
    assert noise_level(t, record) == pytest.approx(0.1)
    usual_step = 2.0 * np.abs(record[0])
    median = median_filter(record, 7)[20]
    for threshold in (6.0, 20.0):
        allowed = 0.1 * threshold + 3.5 * usual_step
        for size, found in ((0.99, []), (1.01, [20]), (-1.01, [20])):
            values = record.copy()
            values[20] = median + size * allowed
            assert np.flatnonzero(outliers(t, values, threshold)).tolist() == found


def test_a_channel_of_outliers_is_refused() -> None:
    t = np.arange(400.0)
    clean = np.sin(0.05 * t) + 1e-3 * np.random.default_rng(0).standard_normal(400)
    for every, refused in (
        (35, False),
        (25, True),
    ):  # three beside each other, 9 and 12 % of all
        spiked = clean + np.where(
            (t % every >= 10.0) & (t % every < 13.0) & (t < 390.0), 5.0, 0.0
        )
        trial = Trial(t, {"u": spiked}, name="spiked")
        if refused:
            with pytest.raises(
                InputError,
                match=r"spiked': expected at most a tenth of u to be outliers, got 4",
            ):
                repaired(trial)
        else:
            found = repaired(trial)
            np.testing.assert_allclose(found["u"], clean, atol=0.05)
            assert found.raw is not None


def test_channels_are_smoothed_as_named_but_for_the_rudder() -> None:
    t, _, values = signal(0.05)
    trial = Trial(
        t,
        {"u": 5.0 + values, "delta": np.where(t % 100.0 < 50.0, 0.1, -0.1)},
        name="noisy",
    )
    for name, one in (
        ("spline", smooth),
        ("savgol", savitzky_golay),
        ("median", median),
    ):
        found = smoothed_channels(trial, ["u", "delta"], name)
        np.testing.assert_array_equal(found["u"], one(t, trial["u"]))
        assert not np.array_equal(found["u"], trial["u"])
        np.testing.assert_array_equal(found["delta"], trial["delta"])
    np.testing.assert_array_equal(
        smoothed_channels(trial, ["u"], "none")["u"], trial["u"]
    )
    with pytest.raises(InputError, match=r"preprocessing: expected .*got 'splines'"):
        smoothed_channels(trial, ["u"], "splines")


def test_what_is_sound_stays_to_the_bit_beside_what_is_repaired() -> None:
    t = np.cumsum(np.random.default_rng(3).uniform(0.9, 1.1, 200))
    truth = 3.0 + np.sin(t / 7.0)
    spiked = truth.copy()
    spiked[[50, 120]] += 9.0
    kept = np.arange(200) != 80
    found = repaired(
        Trial(t[kept], {"u": spiked[kept], "wind_speed": truth[kept]}, name="spiked")
    )
    sound = np.flatnonzero(kept & ~np.isin(np.arange(200), [50, 120]))
    at = np.searchsorted(found.t, t[sound])
    assert len(found) == 200
    np.testing.assert_array_equal(found["u"][at], truth[sound])
    np.testing.assert_array_equal(found["wind_speed"][at], truth[sound])
    assert found.repaired == {"u": 3, "wind_speed": 1}
    for phase in range(12):  # the last sample too, where a polynomial ends
        wave = 3.0 + np.sin(t / 7.0 + phase)
        assert repaired(Trial(t[kept], {"u": wave[kept]}))["u"][-1] == wave[-1]
    gusts = repaired(
        Trial(t, {"u": truth, "wind_speed": spiked}, name="gusts")
    )  # of the wind none is one
    np.testing.assert_array_equal(gusts["wind_speed"], spiked)


def test_rounding_is_no_outlier_on_a_channel_without_noise() -> None:
    """Up to a thousand-millionth of what the channel changes by."""
    t = np.arange(100.0)
    for off, found in (
        (0.95e-9, []),
        (1.05e-9, [70]),
        (-0.95e-9, []),
        (-1.05e-9, [70]),
    ):
        values = np.minimum(t, 40.0)
        values[70] += 40.0 * off
        assert np.flatnonzero(outliers(t, values)).tolist() == found


def test_a_sample_may_be_off_by_what_the_channel_moves_in_half_the_width() -> None:
    """On a clean ramp of one a sample: three and a half from the median of seven."""
    t = np.arange(60.0)
    for off, found in ((4.45, []), (4.55, [30]), (-4.45, []), (-4.55, [30])):
        values = t.copy()
        values[30] += off  # the median goes with it by one sample
        assert np.flatnonzero(outliers(t, values)).tolist() == found


@pytest.mark.parametrize("end", [0, -1])
def test_an_end_is_an_outlier_beyond_seven_times_the_largest_step_inside(
    end: int,
) -> None:
    """Where the step in time to it is longer, so much more; never less."""
    for wait, size, found in (
        (1.0, 0.68, False),
        (1.0, 0.72, True),
        (3.0, 2.05, False),
        (3.0, 2.15, True),
        (0.5, 0.68, False),
        (0.5, 0.72, True),
    ):
        t = np.arange(40.0)
        t[end] = t[1] - wait if end == 0 else t[-2] + wait
        values = 0.1 * np.arange(40.0)
        values[end] = values[1] + size if end == 0 else values[-2] - size
        flags = np.zeros(40, dtype=bool)
        flags[end] = found
        np.testing.assert_array_equal(outliers(t, values, may_step=False), flags)
        assert not outliers(t, values).any()


def test_ends_are_compared_in_records_of_21_samples() -> None:
    for count, found in ((20, []), (21, [0])):
        values = 0.01 * np.arange(count) ** 2 / count
        values[0] += 5.0
        flags = outliers(np.arange(float(count)), values, may_step=False)
        assert np.flatnonzero(flags).tolist() == found


def test_five_samples_tell_noise_and_four_do_not() -> None:
    """One of the five off by 1: 1 / sqrt(70 / 36) of the spread, by a median."""
    spike = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    assert noise_level(np.arange(5.0), spike) == pytest.approx(
        6.0 / np.sqrt(70.0) / 0.6745
    )
    assert noise_level(np.arange(4.0), spike[:4]) == 0.0
    assert noise_ratio(np.arange(4.0), spike[:4]) == 0.0
    zigzag = np.array([0.0, 1.0, -1.0, 1.0, 0.0])
    assert not np.array_equal(smooth(np.arange(5.0), zigzag), zigzag)
    np.testing.assert_array_equal(smooth(np.arange(4.0), zigzag[:4]), zigzag[:4])


def test_a_width_that_is_given_is_used_on_clean_and_on_short_records() -> None:
    t = np.linspace(0.0, 4.0, 20)
    for values in (np.exp(t), np.random.default_rng(0).standard_normal(20)):
        filtered = savitzky_golay(t, values, 7)
        np.testing.assert_allclose(filtered, savgol_filter(values, 7, 3), atol=1e-12)
        assert not np.array_equal(filtered, values)
        np.testing.assert_array_equal(savitzky_golay(t, values), values)


@pytest.mark.parametrize(("unevenness", "even"), [(0.95e-3, True), (1.05e-3, False)])
def test_steps_alike_to_a_thousandth_are_even(unevenness: float, even: bool) -> None:
    steps = np.full(99, 0.5)
    steps[40] += 0.5 * unevenness
    t = np.concatenate([[0.0], np.cumsum(steps)])
    values = np.random.default_rng(0).standard_normal(100)
    assert (
        np.array_equal(savitzky_golay(t, values, 9), savgol_filter(values, 9, 3))
        == even
    )


def linear_system(n: int) -> tuple[LinearSystem, np.ndarray]:
    """A system of two states and two channels of which one measurement is missing."""
    rng = np.random.default_rng(5)
    system = LinearSystem(
        transitions=np.tile([[1.0, 0.7], [-0.1, 0.95]], (n - 1, 1, 1)),
        process=np.tile([[0.02, 0.005], [0.005, 0.03]], (n - 1, 1, 1)),
        observation=np.array([[1.0, 0.2], [0.0, 1.0]]),
        variances=np.array([0.1, 0.3]),
        start=np.array([0.4, -0.7]),
        start_variances=np.array([2.0, 0.5]),
    )
    measured = rng.uniform(-1.0, 1.0, (n, 2))
    measured[3, 1] = np.nan
    return system, measured


def test_the_kalman_smoother_is_the_conditional_mean_of_all_states() -> None:
    """The joint normal distribution of states and measurements gives the same."""
    n = 8
    system, measured = linear_system(n)
    means, cross = [system.start], np.zeros((n, n, 2, 2))
    cross[0, 0] = np.diag(system.start_variances)
    for k in range(1, n):
        F = system.transitions[k - 1]
        means.append(F @ means[-1])
        for i in range(k):
            cross[k, i] = F @ cross[k - 1, i]
            cross[i, k] = cross[k, i].T
        cross[k, k] = F @ cross[k - 1, k - 1] @ F.T + system.process[k - 1]
    covariance = cross.transpose(0, 2, 1, 3).reshape(2 * n, 2 * n)
    mean = np.concatenate(means)

    known = np.isfinite(measured.ravel())
    H = np.kron(np.eye(n), system.observation)[known]
    expected = H @ mean
    spread = H @ covariance @ H.T + np.diag(np.tile(system.variances, n)[known])
    errors = measured.ravel()[known] - expected
    smoothed = mean + covariance @ H.T @ np.linalg.solve(spread, errors)
    np.testing.assert_allclose(system.smoothed(measured).ravel(), smoothed)
    likelihood = system.filtered(measured).log_likelihood
    constant = 0.5 * len(errors) * np.log(2.0 * np.pi)
    assert likelihood - constant == pytest.approx(
        multivariate_normal(cov=spread).logpdf(errors)
    )


def test_a_ship_of_constant_acceleration_goes_where_mechanics_say() -> None:
    """Ahead on a heading of 30 deg: x by half a t^2."""
    t, psi = np.array([0.0, 2.0]), np.radians([30.0, 30.0])
    state = [1.0, 2.0, 3.0, -0.5, 0.2, 0.4]
    ahead, aside = 3.0 * 2.0 + 0.5 * 0.2 * 4.0, -0.5 * 2.0 + 0.5 * 0.4 * 4.0
    cosine, sine = np.cos(psi[0]), np.sin(psi[0])
    x = 1.0 + ahead * cosine - aside * sine
    y = 2.0 + ahead * sine + aside * cosine
    moved = plane_motion(t, psi).transitions[0] @ state
    np.testing.assert_allclose(moved, [x, y, 3.4, 0.3, 0.2, 0.4])
    turned = heading_motion(t).transitions[0] @ [1.0, 3.0, 0.2]
    np.testing.assert_allclose(turned, [7.4, 3.4, 0.2])


def test_the_covariance_of_a_motion_is_the_integral_of_white_noise() -> None:
    t = np.array([0.0, 2.0])
    later = np.linspace(0.0, 2.0, 20_001)
    kernel = np.stack([0.5 * later**2, later, np.ones_like(later)])
    expected = np.trapezoid(kernel[:, None] * kernel, later)
    np.testing.assert_allclose(heading_motion(t).process[0], expected, rtol=1e-6)
    plane = plane_motion(t, np.zeros(2)).process[0]
    np.testing.assert_allclose(
        plane[2:, 2:], np.kron(expected[1:, 1:], np.eye(2)), rtol=1e-6
    )
    assert not plane[:2].any()


def test_a_clean_yaw_rate_gives_the_heading_at_which_a_ship_moves() -> None:
    """Positions on a circle are smoothed to that circle without a recorded heading."""
    t, rng = np.arange(0.0, 120.0), np.random.default_rng(0)
    psi = 0.02 * t
    x, y = 250.0 * np.sin(psi), 250.0 * (1.0 - np.cos(psi))
    noisy_x = x + 2.0 * rng.standard_normal(len(t))
    noisy_y = y + 2.0 * rng.standard_normal(len(t))
    channels = {"r": np.full(len(t), 0.02), "x": noisy_x, "y": noisy_y}
    smoothed = smooth_kinematics(Trial(t, channels, name="gyro"))
    np.testing.assert_allclose(smoothed["r"], 0.02)
    assert np.std(smoothed["x"] - x) < 1.0
    assert np.std(smoothed["y"] - y) < 1.0


def test_the_smoother_finds_the_roughness_of_a_long_record() -> None:
    """The first 500 samples tell; a ship that turns slowly is smoothed more."""
    t = 2.0 * np.arange(701.0)
    truth = 0.3 * np.sin(t / 50.0)
    r = truth + 0.05 * np.random.default_rng(0).standard_normal(701)
    smoothed = smooth_kinematics(Trial(t, {"r": r}, name="long"))
    assert np.std(smoothed["r"] - truth) < 0.4 * 0.05
    with pytest.raises(InputError, match="expected the heading psi or the yaw rate r"):
        smooth_kinematics(Trial(t, {"u": r}, name="no heading"))
