from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification import IdentificationResult, Refinement, build_samples, identify
from identification.estimators.estimator import FitTask
from identification.models.guard import guarded_fit
from identification.models.methods import get_method
from identification.models.output_error import OutputError, in_bins
from identification.models.refine import refine, term_sizes
from identification.models.segments import (
    compared_channels,
    cut,
    segment_edges,
    smoothed_states,
)
from identification.models.shooting import (
    Shooter,
    about_mean,
    averaged,
    channel_units,
    without_start,
)
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import turning_circle, turning_indices, zigzag
from shipgym.models.simulate import LONGEST_STEP


def parameters(model: ShipModel) -> np.ndarray:
    return model.table.acceleration_matrix(model.particulars) @ np.array(
        list(model.coefficients.values())
    )


@pytest.fixture(scope="module")
def shooter(mariner: ShipModel, cao_zigzag: Trial) -> Shooter:
    channels = compared_channels(mariner, [cao_zigzag])
    return Shooter(mariner, channels, np.abs(parameters(mariner)), free=False)


def test_heading_is_compared_where_all_trials_have_it(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    channels = {name: cao_zigzag[name] for name in cao_zigzag.channels if name != "psi"}
    bare = Trial(cao_zigzag.t, channels)
    assert compared_channels(mariner, [cao_zigzag, cao_zigzag]) == (
        "u",
        "v",
        "r",
        "psi",
    )
    assert compared_channels(mariner, [cao_zigzag, bare]) == ("u", "v", "r")


def test_the_ship_itself_sails_every_segment_as_recorded(
    mariner: ShipModel, cao_zigzag: Trial, shooter: Shooter
) -> None:
    segments = cut([cao_zigzag], mariner, shooter.channels, 3.4, True)
    truth = np.append(np.sign(parameters(mariner)), 0.0)
    shooting = shooter.shoot(truth, segments, shooter.units)
    assert np.median(np.abs(shooting.residuals)) < 1e-8
    assert (
        np.abs(shooting.residuals).max() < 3e-4
    )  # a corner of the rudder inside a sampling step


def test_segments_cover_a_trial_and_the_second_set_begins_half_a_segment_later(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    travel = mariner.particulars["length"] / mariner.particulars["speed"]
    assert (
        len(cut([cao_zigzag], mariner, ("u", "v", "r"), 1e6, True)) == 1
    )  # the whole trial
    segments = cut([cao_zigzag], mariner, ("u", "v", "r"), 4.0, True)
    starts = [segment.times[0] for segment in segments]
    assert starts[0] == 0.0
    half = starts[starts.index(0.0) + 1 :].index(min(starts[1:])) + 1
    assert min(starts[1:]) == pytest.approx(2.0 * travel, abs=0.5)
    assert all(
        segment.inputs[-1, 0] == cao_zigzag.t[-1]
        for segment in (segments[half - 1], segments[-1])
    )
    assert sum(len(s.measured) for s in segments[:half]) == len(cao_zigzag) + half - 1
    block = int(
        0.05 * travel / np.diff(cao_zigzag.t)[0]
    )  # residuals are averaged over 5 % of a ship length
    assert block > 1
    assert segments[0].blocks.tolist() == list(
        range(0, len(segments[0].measured), block)
    )


def test_edges_divide_a_trial_alike() -> None:
    """As many as come nearest to the duration; the second set begins half of it on."""
    t = np.arange(100.0)
    assert segment_edges(t, 33.0, 0.0).tolist() == [0, 33, 66, 99]
    assert segment_edges(t, 38.0, 0.0).tolist() == [0, 33, 66, 99]  # 2.6 of them
    assert segment_edges(t, 33.0, 0.5).tolist() == [
        17,
        58,
        99,
    ]  # 2.5 of them: the last are longer
    assert segment_edges(t, 500.0, 0.0).tolist() == [0, 99]
    assert segment_edges(t, 500.0, 0.5).tolist() == []
    assert segment_edges(t, 4.0, 0.0).tolist() == [
        0,
        99,
    ]  # none of fewer than five samples
    assert segment_edges(t, 99.0 / 19.0, 0.0).tolist()[:3] == [0, 6, 11]
    assert segment_edges(t[:5], 2.0, 0.0).tolist() == [0, 4]


def test_blocks_are_averaged_and_offsets_compared_with_their_mean() -> None:
    values = np.arange(14.0).reshape(7, 2)
    means = averaged(values, np.array([0, 3, 6]), np.array([3, 3, 1]))
    np.testing.assert_allclose(means, [[2.0, 3.0], [8.0, 9.0], [12.0, 13.0]])
    np.testing.assert_allclose(about_mean(np.array([1.0, 2.0, 6.0])), [-2.0, -1.0, 3.0])
    assert about_mean(np.zeros(0)).size == 0


def test_what_a_start_may_explain_is_projected_out() -> None:
    """The rest is that of least squares over the start, and the move its solution."""
    rng = np.random.default_rng(0)
    value, slope = rng.standard_normal(12), rng.standard_normal((12, 5))
    rest, slopes, move = without_start(value, slope, 2)
    best = -np.linalg.lstsq(slope[:, 3:], value)[0]
    np.testing.assert_allclose(move, best, atol=1e-12)
    np.testing.assert_allclose(rest, value + slope[:, 3:] @ best, atol=1e-12)
    np.testing.assert_allclose(slope[:, 3:].T @ slopes, np.zeros((2, 3)), atol=1e-12)
    value[3] = np.nan  # a ship that ran away
    rest, slopes, move = without_start(value, slope, 2)
    np.testing.assert_array_equal(rest, value)
    np.testing.assert_array_equal(move, [0.0, 0.0])
    assert without_start(value, slope, 0)[1].shape == (12, 5)


def test_jacobian_is_that_of_central_differences(
    mariner: ShipModel, cao_zigzag: Trial, shooter: Shooter
) -> None:
    two = [cao_zigzag, cao_zigzag]
    segments = cut(two, mariner, shooter.channels, 4.0, False)[
        1:8:6
    ]  # one of each trial
    at = np.append(1.01 * np.sign(parameters(mariner)), [0.002, -0.001])
    jacobian = shooter.shoot(at, segments, shooter.units).jacobian
    for k in (3, 12, 38, len(at) - 1):
        step = 1e-4 * np.eye(len(at))[k]
        ahead, behind = (
            shooter.shoot(at + s, segments, shooter.units).residuals
            for s in (step, -step)
        )
        slope = (ahead - behind) / 2e-4
        np.testing.assert_allclose(
            jacobian[:, k], slope, atol=2e-4 * np.abs(slope).max()
        )


def test_without_noise_the_refinement_finds_the_ship(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    samples = build_samples([cao_zigzag], mariner.table, mariner.particulars)
    start = guarded_fit(get_method("tls-svm"), FitTask(samples, mariner, [cao_zigzag]))
    for q, estimator in start.estimators.items():
        start.estimators[q] = estimator
        estimator.coef_ = estimator.coef_ * (
            1.0 + 0.03 * np.cos(np.arange(len(estimator.coef_)))
        )
    refined = refine(
        start, FitTask(samples, mariner, [cao_zigzag]), Refinement(pull=0.0), 20.0
    )
    truth = np.array(list(mariner.coefficients.values()))
    found = np.array(list(refined.fit.model.coefficients.values()))
    assert np.median(np.abs(found / truth - 1.0)) < 5e-3
    assert refined.report["cost_after"] < 1e-2 * refined.report["cost_before"]


@pytest.fixture(scope="module")
def refined_fits(
    mariner: ShipModel, record: Callable[..., Trial]
) -> dict[str, list[IdentificationResult]]:
    """Three repetitions of noisy trials, by regression and refined."""
    runs = [
        zigzag(mariner, a, b, duration=400, dt=0.1, port_first=a == 20)
        for a, b in ((10, 10), (20, 20), (30, 20))
    ]
    fits: dict[str, list[IdentificationResult]] = {"ls": [], "output-error": []}
    for seed in range(3):
        trials = [
            record(run, 10, 1.0, 10 * seed + i, name=f"zz{i}")
            for i, run in enumerate(runs)
        ]
        for method, found in fits.items():
            found.append(
                identify(
                    trials,
                    method=method,
                    particulars=mariner.particulars,
                    steering=mariner.steering,
                )
            )
    return fits


def test_refined_coefficients_are_nearer_to_the_truth(
    refined_fits: dict[str, list[IdentificationResult]], mariner: ShipModel
) -> None:
    truth = np.array(list(mariner.coefficients.values()))
    errors = {
        method: (
            np.array([list(fit.coefficients.values()) for fit in fits]) / truth - 1.0
        )
        for method, fits in refined_fits.items()
    }
    size = {
        method: np.sqrt(np.mean(error**2, axis=0)) for method, error in errors.items()
    }
    assert np.median(size["output-error"] / size["ls"]) < 0.8


def test_intervals_of_a_refined_model_hold_the_truth(
    refined_fits: dict[str, list[IdentificationResult]], mariner: ShipModel
) -> None:
    truth = np.array(list(mariner.coefficients.values()))
    hits = [
        np.abs(np.array(list(fit.coefficients.values())) - truth)
        < 1.96 * np.array(list(fit.standard_errors.values()))
        for fit in refined_fits["output-error"]
    ]
    assert np.mean(hits) > 0.88


def test_residuals_are_those_of_the_sensors_and_the_provenance_tells(
    refined_fits: dict[str, list[IdentificationResult]],
) -> None:
    for fit in refined_fits["output-error"]:
        assert fit.stable
        report = (fit.model.provenance or {})["refinement"]
        noise = {"u": 0.03, "v": 0.03, "r": np.radians(0.01), "psi": np.radians(0.05)}
        assert report["residual_rms"] == pytest.approx(noise, rel=0.1)
        assert report["decision"] == "refined"
        assert report["cost_after"] < report["cost_before"]


def test_turns_given_to_the_refinement_alone_hold_the_turn(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    zigzags = [
        record(zigzag(mariner, 10, 10, duration=400, dt=0.1), 10, 1.0, 3, name="zz")
    ]
    turns = [
        record(turning_circle(mariner, side, duration=400), 10, name=f"turn{side}")
        for side in (35.0, -35.0)
    ]
    ship = {"particulars": mariner.particulars, "steering": mariner.steering}
    free = identify(zigzags, method="output-error", **ship)  # type: ignore[arg-type]
    held = identify(zigzags, method=Refinement(extra_trials=turns), **ship)  # type: ignore[arg-type]
    expected = turning_indices(turning_circle(mariner, 35)).tactical_diameter_lengths
    found = [
        turning_indices(turning_circle(fit.model, 35)).tactical_diameter_lengths
        for fit in (free, held)
    ]
    errors = [
        np.inf if diameter is None else abs(diameter / expected - 1.0)
        for diameter in found
    ]
    assert errors[1] < 0.02
    assert errors[1] < errors[0]
    report = (held.model.provenance or {})["refinement"]
    assert [trial["name"] for trial in report["extra_trials"]] == [
        "turn35.0",
        "turn-35.0",
    ]


def test_an_anchor_holds_the_turn_of_the_reference_ship(
    mariner: ShipModel, record: Callable[..., Trial]
) -> None:
    zigzags = [
        record(zigzag(mariner, 10, 10, duration=400, dt=0.1), 10, 1.0, 3, name="zz")
    ]
    fit = identify(
        zigzags,
        method=Refinement(anchor=mariner, anchor_weight=1.0, rudder_offsets=True),
        particulars=mariner.particulars,
        steering=mariner.steering,
    )
    turn = turning_indices(turning_circle(fit.model, 35)).tactical_diameter_lengths
    assert turn == pytest.approx(
        turning_indices(turning_circle(mariner, 35)).tactical_diameter_lengths, rel=0.02
    )
    assert (fit.model.provenance or {})["refinement"]["anchor"] == mariner.name


def test_a_start_that_runs_away_is_kept_and_told(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    samples = build_samples([cao_zigzag], mariner.table, mariner.particulars)
    start = replace(
        guarded_fit(get_method("tls-svm"), FitTask(samples, mariner, [cao_zigzag])),
        stable=False,
    )
    kept = refine(start, FitTask(samples, mariner, [cao_zigzag]), Refinement(), 20.0)
    assert kept.fit is start
    assert kept.report["decision"] == "not refined: the start runs away"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"segment_lengths": 0.0}, r"segment_lengths: .*got 0"),
        ({"segment_lengths": 1e100}, r"segment_lengths: .*got 1e\+100"),
        ({"segment_lengths": 1.05e6}, r"segment_lengths: .*got 1.05e\+06"),
        ({"segment_start": "smoothed"}, "segment_start: .*got 'smoothed'"),
        ({"pull": -1.0}, "pull: .*got -1"),
        ({"extra_weight": float("nan")}, "extra_weight: .*got nan"),
        ({"anchor_weight": 0.0}, "anchor_weight: .*got 0"),
    ],
)
def test_wrong_settings_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Refinement(**settings)  # type: ignore[arg-type]


def test_extra_trials_need_the_channels_of_the_structure(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    lacking = Trial(
        cao_zigzag.t, {c: cao_zigzag[c] for c in ("u", "r", "delta")}, name="lacking"
    )
    with pytest.raises(
        InputError, match=r"extra trial 'lacking': channel 'v' is missing, expected"
    ):
        identify(
            [cao_zigzag],
            method=Refinement(extra_trials=[lacking]),
            particulars=mariner.particulars,
        )


def test_a_term_of_size_one_makes_up_the_whole_change() -> None:
    X = np.array([[1.0, 0.0, 2.0], [-1.0, 0.0, 4.0]])
    samples: Any = SimpleNamespace(
        features={"r": X}, targets={"r": np.array([6.0, 8.0])}
    )
    sizes = term_sizes(samples, "r")
    np.testing.assert_allclose(
        sizes, np.sqrt(50.0) / np.array([1.0, np.inf, np.sqrt(10.0)]), atol=1e-300
    )
    assert sizes[1] > 0.0  # what is not seen is divided by all the same


def test_scores_of_the_same_time_are_added_up_by_trial() -> None:
    """Bins of 2 s from the first of each trial; the staggered set has them twice."""
    segments: Any = [
        SimpleNamespace(trial=0, times=np.array([0.0, 1.0, 2.0, 3.9])),
        SimpleNamespace(trial=0, times=np.array([2.5, 7.0])),
        SimpleNamespace(trial=1, times=np.array([5.0, 6.0, 9.0])),
    ]
    scores = 10.0 ** np.arange(9.0)[:, None]
    first, second = in_bins(scores, segments, 2.0)
    assert first.ravel().tolist() == [11.0, 1100.0 + 1e4, 0.0, 1e5]
    assert second.ravel().tolist() == [1e6, 1e7, 1e8]


def test_settings_of_a_refinement_reach_to_their_bounds_and_stand_apart() -> None:
    for least in (
        {"segment_lengths": 0.1},
        {"segment_lengths": 1e6},
        {"pull": 0.0},
        {"extra_weight": 1e-12},
    ):
        assert Refinement(**least).plain()[next(iter(least))] == next(
            iter(least.values())
        )  # type: ignore[arg-type]
    own = Refinement(pull=0.5, staggered=False)
    assert (own.pull, own.staggered, own.segment_lengths, own.segment_start) == (
        0.5,
        False,
        3.4,
        "free",
    )
    assert (own.extra_weight, own.anchor_weight, own.rudder_offsets, own.anchor) == (
        1.0,
        1e-3,
        False,
        None,
    )


def test_channels_are_compared_in_units_of_the_ship(mariner: ShipModel) -> None:
    ship = mariner.particulars
    rate = ship["speed"] / ship["length"]
    found = channel_units(mariner, ("u", "v", "r", "p", "psi"))
    np.testing.assert_allclose(found, [ship["speed"], ship["speed"], rate, rate, 1.0])


def test_states_are_smoothed_but_for_the_rudder_and_begin_at_the_origin(
    mariner: ShipModel, noisy_trials: list[Trial]
) -> None:
    trial = noisy_trials[0]
    found = dict(
        zip(mariner.state_names, smoothed_states(trial, mariner).T, strict=True)
    )
    assert not found["x"].any()
    assert not found["y"].any()
    np.testing.assert_array_equal(found["delta"], trial["delta"])
    for name in ("psi", "u", "v", "r"):
        assert 0.0 < np.std(found[name] - trial[name]) < 0.5 * np.std(trial[name])
        assert np.std(np.diff(found[name], 2)) < 0.5 * np.std(np.diff(trial[name], 2))


def test_samples_are_an_interval_apart_on_a_fine_enough_grid(
    mariner: ShipModel,
) -> None:
    """Steps of twice the longest are halved; intervals of three are met to rounding."""
    longest = LONGEST_STEP * mariner.travel_time
    t = 2.0 * longest * np.arange(61.0)
    channels = {
        name: np.full(61, 0.1 * k) for k, name in enumerate(("psi", "r", "v", "u"))
    }
    trial = Trial(
        t, {**channels, "delta": 0.01 * np.sin(t), "wind_vdot": 1e-3 * t}, name="even"
    )
    travel = mariner.travel_time
    every = cut([trial], mariner, ("u", "r"), 1e3, False)[0]
    np.testing.assert_allclose(np.diff(every.inputs[:, 0]), longest)
    assert every.samples.tolist() == [k // 2 if k % 2 == 0 else -1 for k in range(121)]
    assert every.weight == 1.0
    for factor in (1.0 - 1e-12, 1.0, 1.0 + 1e-12):
        (third,) = cut(
            [trial],
            mariner,
            ("u", "r"),
            1e3,
            False,
            interval=factor * 6.0 * longest / travel,
        )
        np.testing.assert_allclose(third.measured, np.full((21, 2), [0.3, 0.1]))
        np.testing.assert_allclose(third.inputs[:, 0], every.inputs[:, 0])
        np.testing.assert_allclose(
            third.inputs[:, 1],
            np.interp(third.inputs[:, 0], t, trial["delta"]),
            atol=1e-3,
        )
        assert not third.inputs[
            :, [2, 3, 5]
        ].any()  # no shaft speed, no wind ahead or in yaw
        np.testing.assert_allclose(third.inputs[:, 4], 1e-3 * third.inputs[:, 0])
        np.testing.assert_allclose(
            third.start, [0.0, 0.0, 0.0, 0.3, 0.2, 0.1, 0.0], atol=1e-12
        )
        assert third.times[0] == 0.0


def given_problem(**attributes: Any) -> OutputError:
    """A fit by segments of which some parts are known."""
    shooter: Any = SimpleNamespace(
        term_sizes=np.ones(3), channels=("u", "r"), units=np.array([5.0, 0.1])
    )
    parts = {"further": (), "start": np.zeros(5), "staggered": False} | attributes
    return OutputError(shooter, **parts)


def test_a_pull_counts_by_all_that_is_compared_and_an_offset_by_a_degree() -> None:
    segments = [SimpleNamespace(measured=np.zeros((rows, 3))) for rows in (10, 20)]
    expected = [*[np.sqrt(1e-2 * 90)] * 3, *[180.0 / np.pi] * 2]
    weights = given_problem(fitted=segments).pull_weights(1e-2)
    np.testing.assert_allclose(weights, expected)


def test_scales_are_root_mean_squares_by_sample_of_the_trials_to_fit() -> None:
    """Blocks stand for several samples, here two for eight; extra trials for none."""
    segment = SimpleNamespace(measured=np.zeros((8, 2)), blocks=[0, 4])
    shooting: Any = SimpleNamespace(
        residuals=np.array([1.0, 0.0, 3.0, 0.0, 99.0, 99.0])
    )
    found = given_problem(fitted=[segment]).scales(shooting, np.array([2.0, 0.3]))
    np.testing.assert_allclose(found, [np.sqrt((2.0**2 + 6.0**2) / 8.0), 1e-10])


def test_a_memory_of_yaw_cannot_be_refined(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    with pytest.raises(InputError, match=r"without a memory of yaw, .* got 'nomoto2'"):
        identify(
            [cao_zigzag],
            "nomoto2",
            "output-error",
            particulars=mariner.particulars,
        )
