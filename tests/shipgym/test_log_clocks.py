"""Channels on one clock, late channels, logs of several files, and cuts."""

import math

import numpy as np
import pytest

from shipgym.errors import InputError
from shipgym.trials.clock_offsets import clock_offset, reverses, rudder_clock_offset
from shipgym.trials.cuts import check_cut, cut_log
from shipgym.trials.late_channels import (
    check_circle,
    find_late_channels,
    is_corrected,
)
from shipgym.trials.resampling import Log, Signal, have_own_clocks, on_one_clock
from shipgym.trials.trial import Trial

NAN, DEGREE = math.nan, math.pi / 180.0


def test_channels_at_different_rates_have_clocks_of_their_own():
    fast, slow = np.ones(6), np.array([1.0, NAN, 1.0, NAN, 1.0, NAN])
    holed = np.array([1.0] * 5 + [NAN])

    def own(*channels):
        named = {str(k): values for k, values in enumerate(channels)}
        return have_own_clocks(np.zeros(channels[0].size), named)

    assert own(fast, slow)
    assert not own(fast, fast)
    assert not own(fast[:4], slow[:4])  # two values are no clock
    assert not own(holed, slow)  # a row without a value is a hole


def test_channels_at_different_rates_are_read_each_where_it_has_values(tmp_path):
    path = tmp_path / "run.csv"
    rows = [f"{k / 2},{1.0 + k / 10},{'' if k % 2 else k / 2}" for k in range(20)]
    path.write_text("\n".join(["t,u,x", *rows]))
    trial = Trial.from_csv(path)
    np.testing.assert_allclose(trial.t, np.arange(10.0))  # the slower one's
    np.testing.assert_allclose(trial["u"], 1.0 + trial.t / 5.0)
    path.write_text("\n".join(["t,u,x", "0,1,0", *(f"{k},1," for k in range(1, 9))]))
    with pytest.raises(InputError, match="expected a number, got no value"):
        Trial.from_csv(path)
    swapped = [rows[0], rows[1], rows[4], rows[3], rows[2], *rows[5:]]
    path.write_text("\n".join(["t,u,x", *swapped]))
    with pytest.raises(
        InputError, match=r"line 6 .* expected time to increase between"
    ):
        Trial.from_csv(path)


def ramp(*parts):
    """A signal that is its own time, sampled in some spans with a step each."""
    t = np.concatenate([np.arange(first, last, step) for first, last, step in parts])
    return Signal(t, t)


def test_the_slowest_channel_of_the_motion_gives_the_clock_and_holes_stay():
    signals = {
        "delta": ramp((0.0, 30.5, 0.5)),
        "psi": ramp((1.0, 11.0, 1.0), (18.0, 40.0, 1.0)),
        "wind_speed": ramp((0.0, 28.0, 9.0)),
    }
    log = on_one_clock(signals, "log.csv")
    assert log.t.tolist() == [*range(1, 11), *range(18, 31)]  # all of the motion known
    for name in ("delta", "psi"):
        np.testing.assert_allclose(log.channels[name], log.t)
    np.testing.assert_allclose(log.channels["wind_speed"], np.minimum(log.t, 27.0))
    assert log.notes == ["psi has 1 holes, of up to 8 s; nothing is put there"]
    for hole, notes in ((6.0, 0), (6.1, 1)):  # six usual steps are none
        signals["psi"] = ramp((0.0, 11.0, 1.0), (10.0 + hole, 40.0, 1.0))
        assert len(on_one_clock(signals, "log.csv").notes) == notes
    signals["psi"] = ramp((50.0, 80.0, 1.0))
    with pytest.raises(
        InputError, match="got 0 moments that delta, psi have in common"
    ):
        on_one_clock(signals, "log.csv")


# --- what is late


@pytest.mark.parametrize("offset", [0.0, 40.0])
def test_only_what_goes_there_and_back_three_times_shows_a_delay(offset):
    t = np.linspace(0.0, 1.0, 400)
    assert reverses(offset + np.sin(4.5 * np.pi * t))
    assert not reverses(offset + np.sin(2.5 * np.pi * t))
    assert not reverses(offset + t)
    assert not reverses(offset + np.sin(4.5 * np.pi * t), least=2.1)
    for middle, counts in (
        (0.49, False),
        (0.51, True),
    ):  # beyond a quarter of its range
        sides = offset + np.repeat([1.0, -1.0, middle, -1.0], 50)
        assert reverses(sides) == counts
    odd = np.r_[np.repeat([1.0, -1.0, 1.0, -1.0], 98), np.full(4, 30.0)]
    assert reverses(odd, 1.99)  # outliers do not count
    assert not reverses(odd, 2.01)


@pytest.mark.parametrize("n", [20, 200_035])
def test_too_short_and_too_long_records_show_no_delay(n):
    """Less than 60 or more than 200 000 windows, and 15 s at either end."""
    t = np.arange(float(n))
    assert clock_offset(t, np.sin(0.1 * t), 0.1 * np.cos(0.1 * t), {}) is None


@pytest.fixture(scope="module")
def zigzag():
    """Heading, yaw rate and rudder of a first-order ship, s and rad."""
    t = np.arange(0.0, 400.0, 0.5)
    delta = 0.3 * np.sign(np.sin(0.07 * t))
    r = np.zeros(t.size)
    for k in range(t.size - 1):
        r[k + 1] = r[k] + 0.5 * (0.05 * delta[k] - r[k]) / 12.0
    return t, {"psi": np.cumsum(0.5 * r), "r": r, "delta": delta}


def late(zigzag, **delays):
    """A log some of whose channels are late, s."""
    t, channels = zigzag
    moved = {
        name: np.interp(t - delays.get(name, 0.0), t, values)
        for name, values in channels.items()
    }
    return Log(t, moved, "log.csv", [])


@pytest.mark.parametrize("delay", [-3.0, 1.5, 4.0])
def test_a_delay_is_found_within_its_error(zigzag, delay):
    log = late(zigzag, r=delay, delta=delay)
    t, channels = zigzag
    rate = clock_offset(t, channels["psi"], log.channels["r"], {})
    rudder = rudder_clock_offset(t, channels["r"], log.channels["delta"])
    assert rate.late == pytest.approx(delay, abs=0.3)
    assert rudder.late == pytest.approx(delay, abs=0.5)
    assert min(rate.certainty, rudder.certainty) > 5.0


@pytest.mark.parametrize(
    ("delay", "choice", "is_one_clock", "corrected"),
    [
        (0.55, None, True, False),
        (4.0, "keep", True, False),
        (4.0, "correct", True, True),
        (4.0, None, False, True),
    ],
)
def test_a_late_yaw_rate_is_left_or_corrected(
    zigzag, delay, choice, is_one_clock, corrected
):
    rate, *_ = find_late_channels(late(zigzag, r=delay))
    assert rate.channel == "r"
    assert rate.delay == pytest.approx(delay, abs=0.3)
    assert rate.evidence.startswith(f"the yaw rate is {rate.delay:.2f} s late against")
    assert is_corrected(rate, choice, "log", is_one_clock=is_one_clock) == corrected


def test_a_large_delay_on_one_clock_and_a_rudder_of_the_other_sign_are_refused(zigzag):
    assert [one for one in find_late_channels(late(zigzag)) if one.channel == "r"] == []
    rate, *_ = find_late_channels(late(zigzag, r=4.0))
    with pytest.raises(InputError, match="log: expected one clock, got one of which"):
        is_corrected(rate, None, "log", is_one_clock=True)
    log = late(zigzag)
    log.channels["delta"] *= -1.0
    with pytest.raises(InputError, match="a yaw acceleration that follows the rudder"):
        find_late_channels(log)


@pytest.mark.parametrize(("others", "against"), [(10, True), (11, False)])
def test_a_circle_has_its_rudder_on_one_side_for_nine_tenths_of_the_time(
    others, against
):
    delta = np.full(100, 0.2)
    delta[:others] = -0.1
    psi = -np.linspace(0.0, 2.0, 100)

    def is_refused(psi, delta):
        log = Log(np.arange(100.0), {"psi": psi, "delta": delta}, "log.csv", [])
        try:
            check_circle(log)
        except InputError as error:
            return "turns away from the rudder" in str(error)
        return False

    assert is_refused(psi, delta) == is_refused(-psi, -delta) == against
    assert not is_refused(-psi, delta)


# --- no delay where there is none


def zigzag_of_first_order(K, T, noise_deg, step, seed):
    """Log of a 20/20 zigzag with T rdot + r = K delta and a noisy gyro compass."""
    dt, rate = 0.1, 2.5 * DEGREE
    random = np.random.default_rng(seed)
    n = int(50.0 * T / dt)
    psi, r, delta = np.zeros(n), np.zeros(n), np.zeros(n)
    order = 20.0 * DEGREE
    for k in range(n - 1):
        if order * psi[k] > 0.0 and abs(psi[k]) >= abs(order):
            order = -order
        move = np.clip(order - delta[k], -rate * dt, rate * dt)
        delta[k + 1] = delta[k] + move
        r[k + 1] = r[k] + dt * (K * delta[k] - r[k]) / T
        psi[k + 1] = psi[k] + dt * r[k + 1]
    every = round(step / dt)
    noise = noise_deg * DEGREE * random.standard_normal(psi[::every].size)
    channels = {"psi": psi[::every] + noise, "delta": delta[::every]}
    return Log(np.arange(noise.size) * step, channels, "log.csv", [])


@pytest.mark.parametrize("noise_deg", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("step", [0.5, 1.0, 2.0])
def test_a_noisy_compass_makes_no_rudder_late(noise_deg, step):
    """`python scripts/clock_offsets.py` counts it on nine ships."""
    for seed, (K, T) in enumerate([(0.15, 8.0), (0.05, 12.0), (0.08, 25.0)]):
        log = zigzag_of_first_order(K, T, noise_deg, step, seed)
        refused = [one for one in find_late_channels(log) if not one.is_small]
        assert refused == []


# --- parts


def log(start=None, **channels):
    return Log(np.arange(0.0, 601.0), channels, "log.csv", [], start=start)


@pytest.mark.parametrize(
    "cut",
    ["psi", [], 3, [[1, 2, 3]], [[1]], [1, 2], [[1, None]], [[True, 2]], [[1, 2], 3]],
)
def test_what_is_no_cut_is_refused(cut):
    with pytest.raises(InputError, match='trials 1 cut: expected cut = "rudder", or'):
        check_cut(cut, "trials 1")
    for right in ("rudder", [[1, 2.5]], [["09:30", "2024-05-31 09:31"], [1, 2]]):
        check_cut(right, "trials 1")


MORNING = 9.5 * 3600.0


@pytest.mark.parametrize(
    ("cut", "start", "parts"),
    [
        ([[10, 20], [30, 32]], None, [slice(10, 21), slice(30, 33)]),
        ([["09:31", "09:32"]], MORNING, [slice(60, 121)]),
        ([["23:59", "00:01"]], 86280.0, [slice(60, 181)]),  # over midnight
        ([["1970-01-05 00:01", "1970-01-05 00:02"]], 345600.0, [slice(60, 121)]),
    ],
)
def test_stretches_are_those_asked_for(cut, start, parts):
    assert cut_log(cut, log(start), "") == parts


@pytest.mark.parametrize(
    ("cut", "start", "message"),
    [
        ([[10, 11]], None, r"from 0 to 600 s, got 10 to 11, which holds no trial"),
        ([[700, 800]], MORNING, "from 0 to 600 s, 09:30:00 to 09:40:00, got"),
        ([["09:31", "09:32"]], None, "which has no clock, got '09:31'"),
        ([["noon", "09:32"]], MORNING, "expected cut = .*, got 'noon'"),
        (
            "rudder",
            None,
            "more than 3 deg from its usual place for over 30 s, got none",
        ),
    ],
)
def test_stretches_that_hold_no_trial_are_refused(cut, start, message):
    with pytest.raises(InputError, match=message):
        cut_log(cut, log(start), "trials 1")


def test_a_manoeuvre_lasts_from_before_the_rudder_moves_until_it_is_quiet():
    delta = np.zeros(601)
    for begin, end in ((100, 140), (190, 199), (200, 205)):  # quiet for under a minute
        delta[begin:end] = 3.1 * DEGREE
    delta[300:310] = 20.0 * DEGREE  # too short for a manoeuvre
    delta[400:432] = -10.0 * DEGREE
    parts = cut_log("rudder", log(delta=delta + 5.0 * DEGREE), "")
    assert parts == [slice(70, 235), slice(370, 462)]
    for begin, count in ((199, 1), (200, 2)):
        delta = np.zeros(601)
        delta[100:140] = delta[begin:240] = 4.0 * DEGREE
        assert len(cut_log("rudder", log(delta=delta), "")) == count
