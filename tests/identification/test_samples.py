from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identification import IdentificationResult, Samples, build_samples, identify
from identification.samples.gaps import between_gaps
from identification.samples.integrals import (
    broken_spline,
    step_integrals,
    twice_integrated,
)
from identification.samples.rudder import straight
from identification.samples.samples import default_window, without_memory
from shipgym import InputError, Particulars, ShipModel, Trial
from shipgym.manoeuvres import zigzag
from shipgym.models.simulate import open_loop


def mismatch(model: ShipModel, samples: Samples) -> float:
    """Largest violation of the regression by the truth, by the largest change."""
    table = model.table
    theta = table.acceleration_matrix(model.particulars) @ np.array(
        list(model.coefficients.values())
    )
    worst, first = 0.0, 0
    for q in table.equations:
        size = samples.features[q].shape[1]
        left = samples.targets[q] - samples.features[q] @ theta[first : first + size]
        worst = max(worst, float(np.abs(left).max() / np.abs(samples.targets[q]).max()))
        first += size
    return worst


@pytest.mark.parametrize(
    ("structure", "bound"), [("euler", 1e-1), ("integral", 2e-2), ("spline", 3e-5)]
)
def test_true_coefficients_satisfy_the_regression(
    mariner: ShipModel, cao_zigzag: Trial, structure: str, bound: float
) -> None:
    samples = build_samples([cao_zigzag], mariner.table, mariner.particulars, structure)
    assert len(samples) == 1000
    assert bound / 100 < mismatch(mariner, samples) < bound


def test_irregular_samples_and_windows_satisfy_it_too(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    fine = record(zigzag(mariner, 15, 15, duration=300, dt=0.1), name="fine")
    rows = np.sort(np.random.default_rng(0).choice(len(fine), 900, replace=False))
    sparse = Trial(
        fine.t[rows], {name: values[rows] for name, values in fine.channels.items()}
    )
    for window in (1, 7):
        samples = build_samples(
            [sparse], mariner.table, mariner.particulars, window=window
        )
        assert mismatch(mariner, samples) < 1e-4
        assert samples.window == window


def test_trials_are_stacked_with_their_own_steps_and_never_across(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    run = zigzag(mariner, 20, 20, duration=200, dt=0.1)
    trials = [record(run, every=5, name="a"), record(run, every=10, name="b")]
    samples = build_samples(trials, mariner.table, mariner.particulars)
    assert np.bincount(samples.trial).tolist() == [400, 200]
    assert np.unique(samples.duration.round(9)).tolist() == [0.5, 1.0]
    assert mismatch(mariner, samples) < 1e-4


def test_window_follows_the_noise(
    mariner: ShipModel, cao_zigzag: Trial, noisy_trials: list[Trial]
) -> None:
    p = mariner.particulars
    clean = build_samples([cao_zigzag], mariner.table, p)
    noisy = build_samples(noisy_trials[:1], mariner.table, p)
    assert clean.window == 1
    assert noisy.window == int(p["length"] / p["speed"] / 3.0)  # samples are 1 s apart


def test_wrong_arguments_are_named(mariner: ShipModel, cao_zigzag: Trial) -> None:
    def build(**arguments: object) -> None:
        build_samples([cao_zigzag], mariner.table, mariner.particulars, **arguments)  # type: ignore[arg-type]

    with pytest.raises(
        InputError,
        match=r"samples: .*'euler', 'integral', 'spline'",
    ):
        build(samples="cubic")
    with pytest.raises(InputError, match=r"window: expected .*got 0"):
        build(window=0)
    with pytest.raises(
        InputError,
        match="'zigzag_15_15': expected more samples than the window of 1001",
    ):
        build(window=1001)


def without(trial: Trial, *holes: tuple[float, float]) -> Trial:
    """The trial without its samples in some intervals of time."""
    kept = np.all(
        [(trial.t < start) | (trial.t >= end) for start, end in holes], axis=0
    )
    return Trial(
        trial.t[kept], {c: v[kept] for c, v in trial.channels.items()}, name="holes.csv"
    )


@pytest.mark.parametrize(
    "hole", [(100.0, 150.0), (203.0, 253.0), (120.3, 220.0), (496.0, 499.9)]
)
def test_a_hole_in_the_record_spoils_nothing(
    mariner: ShipModel,
    cao_zigzag: Trial,
    cao_fit: IdentificationResult,
    hole: tuple[float, float],
) -> None:
    broken = without(cao_zigzag, hole)
    fit = identify([broken], particulars=mariner.particulars)
    for name, value in fit.coefficients.items():
        assert value == pytest.approx(cao_fit.coefficients[name], rel=0.01), name
    truth = zigzag(mariner, 20, 20, duration=400)
    predicted = open_loop(fit.model, truth)
    assert np.abs(predicted["psi"] - truth["psi"]).max() < np.radians(0.01)


@pytest.mark.parametrize("structure", ["euler", "integral", "spline"])
@pytest.mark.parametrize("window", [1, 4])
def test_no_row_spans_a_gap(
    mariner: ShipModel, cao_zigzag: Trial, structure: str, window: int
) -> None:
    p = mariner.particulars
    broken = without(cao_zigzag, (100.0, 104.0), (105.0, 150.0), (300.0, 302.0))
    samples = build_samples([broken], mariner.table, p, structure, window=window)
    assert samples.duration.max() <= (window - 1) * 0.5 + 2.5 + 1e-9  # 2 s are no gap
    for start, end in ((100.0, 104.0), (105.0, 150.0)):
        assert not np.any(
            (samples.start < start) & (samples.start + samples.duration > end)
        )
    assert not np.any(
        (samples.start > 99.9) & (samples.start < 150.0)
    )  # too few samples to tell


def test_noisy_pieces_are_smoothed_each_by_itself(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    run = record(
        zigzag(mariner, 20, 20, duration=500, dt=0.1), every=5, noise=1.0, name="noisy"
    )
    fit = identify([without(run, (150.0, 250.0))], particulars=mariner.particulars)
    truth = zigzag(mariner, 20, 20, duration=400)
    error = open_loop(fit.model, truth)["psi"] - truth["psi"]
    assert np.sqrt(np.mean(error**2)) < np.radians(1.0)


def test_a_change_of_the_time_step_is_no_gap(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    fine = record(zigzag(mariner, 15, 15, duration=300, dt=0.1), name="fine")
    rows = np.concatenate([np.arange(2000), np.arange(2000, 3000, 20)])
    mixed = Trial(fine.t[rows], {c: v[rows] for c, v in fine.channels.items()})
    assert (
        len(build_samples([mixed], mariner.table, mariner.particulars))
        == len(mixed) - 1
    )


def test_irregular_samples_lose_next_to_nothing(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    rows = np.random.default_rng(1).random(len(cao_zigzag)) < 0.6
    sparse = Trial(
        cao_zigzag.t[rows], {c: v[rows] for c, v in cao_zigzag.channels.items()}
    )
    samples = build_samples([sparse], mariner.table, mariner.particulars)
    assert len(samples) > 0.97 * len(sparse)
    assert mismatch(mariner, samples) < 2e-3


def test_a_record_of_nothing_but_gaps_is_refused(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    holes = [(start + 4.0, start + 20.0) for start in np.arange(0.0, 500.0, 20.0)]
    message = r"holes\.csv': expected 10 samples somewhere .* got 2[45] gaps"
    with pytest.raises(InputError, match=message):
        build_samples([without(cao_zigzag, *holes)], mariner.table, mariner.particulars)


def test_a_gap_is_a_step_of_more_than_five_usual_ones() -> None:
    """And of more than 0.15 of a ship length, here 1.5 s; pieces have 10 samples."""
    ship = Particulars(length=50.0, speed=5.0)

    def pieces(step: float, pause: float, first: int = 30) -> list[int]:
        t = step * np.arange(60.0)
        t[first:] += pause - step
        return [
            len(piece) for piece in between_gaps(Trial(t, {"u": np.ones(60)}), ship)
        ]

    assert pieces(0.5, 2.5) == [60]  # five usual steps
    assert pieces(0.5, 2.6) == [30, 30]
    assert pieces(0.1, 1.5) == [60]  # many steps, but a short time
    assert pieces(0.1, 1.6) == [30, 30]
    assert pieces(0.5, 9.0, first=9) == [51]  # too short a piece is left out
    assert pieces(0.5, 9.0, first=10) == [10, 50]


def test_six_long_steps_on_end_are_another_rate_and_five_are_gaps() -> None:
    """The usual step is the median of the eleven around, where that is longer."""
    ship = Particulars(length=50.0, speed=5.0)

    def pieces(*long: int) -> list[int]:
        steps = np.full(99, 0.5)
        steps[list(long)] = 3.0
        t = np.concatenate([[0.0], np.cumsum(steps)])
        return [
            len(piece) for piece in between_gaps(Trial(t, {"u": np.ones(100)}), ship)
        ]

    assert pieces(*range(40, 46)) == [100]
    assert pieces(*range(40, 45)) == [41, 55]
    assert pieces(34, *range(40, 45)) == [
        35,
        55,
    ]  # the sixth is not among the eleven around the fifth


def test_euler_takes_the_start_of_each_step_and_the_trapezoid_rule_its_mean() -> None:
    """Steps of 1 and 3 s; a moment is the integral times half the step."""
    t, channels = np.array([0.0, 1.0, 4.0]), {"u": np.array([2.0, 4.0, 10.0])}
    for rule, expected in (("euler", [2.0, 12.0]), ("integral", [3.0, 21.0])):
        found = step_integrals(t, channels, lambda c: {"u": c["u"][:, None]}, rule)
        np.testing.assert_allclose(found.terms["u"][:, 0], expected)
        moments = np.multiply(expected, [0.5, 1.5])
        np.testing.assert_allclose(found.moments["u"][:, 0], moments)


def test_an_integral_is_integrated_again_from_the_first_sample() -> None:
    """Of 6 t: t^3 over each step, and 3 t^2 within it."""
    t = np.array([0.0, 1.0, 3.0, 4.0])
    integrals = np.diff(3.0 * t**2)[:, None]
    moments = (np.diff(t**3) - 3.0 * t[:-1] ** 2 * np.diff(t))[:, None]
    np.testing.assert_allclose(
        twice_integrated(t, integrals, moments)[:, 0], [1.0, 26.0, 37.0]
    )


def test_a_spline_through_few_samples_is_cubic_from_four_on() -> None:
    t, fine = np.arange(4.0), np.linspace(0.0, 3.0, 31)
    no_corners = straight(t, np.zeros(4))
    np.testing.assert_allclose(
        broken_spline(t, t**3, no_corners)(fine), fine**3, atol=1e-12
    )
    three = broken_spline(t[:3], t[:3] ** 3, no_corners)(fine[:21])
    np.testing.assert_allclose(
        three, np.interp(fine[:21], t[:3], t[:3] ** 3), atol=1e-12
    )


def test_a_window_is_a_third_of_a_ship_length_or_a_twentieth_of_a_trial_at_most() -> (
    None
):
    """Of noise alone; a ship of 30 m at 3 m/s sails a third of her length in 3.3 s."""
    ship, rng = Particulars(length=30.0, speed=3.0), np.random.default_rng(0)

    def window(count: int, step: float) -> int:
        channels = {name: rng.standard_normal(count) for name in "uvr"}
        return default_window(Trial(step * np.arange(count), channels), ship)

    assert window(400, 0.5) == 6
    assert window(100, 0.5) == 5
    assert window(39, 0.5) == 1
    assert window(400, 9.0) == 1


def test_the_memory_of_a_trial_falls_out_of_one_window_less_the_next() -> None:
    """Mean accelerations of windows of 1 and 3 s, times the mean of both: 2 s."""
    samples = Samples(
        {"r": np.array([[1.0], [6.0], [4.0]])},
        {"r": np.array([2.0, 9.0, 1.0])},
        np.array([0.0, 1.0, 4.0]),
        np.array([1.0, 3.0, 1.0]),
        np.zeros(3, dtype=np.int64),
        1,
    )
    found = without_memory(samples)
    np.testing.assert_allclose(
        found.features["r"][:, 0], [2.0 * (2.0 - 1.0), 2.0 * (4.0 - 2.0)]
    )
    np.testing.assert_allclose(
        found.targets["r"], [2.0 * (3.0 - 2.0), 2.0 * (1.0 - 3.0)]
    )
    np.testing.assert_array_equal(found.start, [0.0, 1.0])
    with pytest.raises(InputError, match="window: expected at least two windows"):
        without_memory(samples.select(np.arange(3) == 2))


@pytest.mark.parametrize(
    ("corner", "smoothness"), [(5.3, 0), (5.3, 1), (9.8, 0), (1.4, 0), (7.0, 0)]
)
def test_a_spline_breaks_where_the_rudder_does(corner: float, smoothness: int) -> None:
    """Beyond a jump of the rudder's rate a square grows, of its acceleration a cube."""
    t, fine = np.arange(13.0), np.linspace(0.0, 12.0, 241)

    def motion(times: np.ndarray) -> np.ndarray:
        return (
            2.0
            - 0.3 * times
            + 0.01 * times**3
            + np.maximum(times - corner, 0.0) ** (2 + smoothness)
        )

    smooth = straight(t, np.zeros(13))
    broken = replace(
        smooth, corners=np.array([corner]), smoothness=np.array([smoothness])
    )
    np.testing.assert_allclose(
        broken_spline(t, motion(t), broken)(fine), motion(fine), atol=1e-9
    )
    assert np.abs(broken_spline(t, motion(t), smooth)(fine) - motion(fine)).max() > 1e-3


def test_corners_that_leave_too_few_samples_for_a_spline_are_passed_over() -> None:
    """Beside an end, or the third in a step; the spline meets all samples still."""
    t, values = np.arange(9.0), np.random.default_rng(0).standard_normal(9)
    for corners in ([0.02], [7.98], [4.1, 4.3, 4.6], [4.1, 4.3, 4.6, 4.8]):
        rudder = replace(
            straight(t, np.zeros(9)),
            corners=np.array(corners),
            smoothness=np.zeros(len(corners), dtype=int),
        )
        spline = broken_spline(t, values, rudder)
        np.testing.assert_allclose(spline(t), values, atol=1e-9)
        assert np.abs(spline(np.linspace(0.0, 8.0, 161))).max() < 10.0
