"""Two other methods on the papers' cases: an extended Kalman filter, a network.

The filter carries the coefficients as states that do not change and starts them from
zero. The network learns the change of the velocities over a sample from velocities and
rudder, and is stepped. The settings of both were fixed beforehand, not chosen by what
they are evaluated on.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor

from papers import cao2015, song2020, song2020_nomoto
from papers.mei2019 import HARD, WORDS
from papers.mei2019_targets import STEPS_PER_SAMPLE, TURN, our_way, same_hull, virtual
from papers.row import Conclusion, Paper, Row
from papers.zhu2018 import recursive_start
from papers.zhu2018.container_ship import EQUATIONS, UNITS, best_errors
from papers.zhu2018.fits import every, mean_square
from papers.zhu2018.ships import zigzag_trial
from shipgym.manoeuvres import turning_circle, turning_indices
from shipgym.models import load_model
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]
Rate = Callable[
    [Floats, Floats, float], Floats
]  # of states and coefficients, shape (n, runs), and a rudder

STARTS = (
    10.0,
    1.0,
    0.01,
)  # deviation of the coefficients at the start, in parts of a usual size
START = STARTS[0]
# measurement noise where there is none, in parts of a channel's root mean square
EXACT = 1e-3
STEP = 1e-6  # of the differences, in parts of a deviation

#: Names of the turning indices, and where `turning_indices` has them.
ATTRIBUTES = {
    "advance": (WORDS["advance"], "advance_lengths"),
    "tactical": (WORDS["tactical"], "tactical_diameter_lengths"),
}
HIDDEN, DECAY, ITERATIONS = (16, 16), 1e-4, 2000
SEEDS = range(3)


def kalman_history(
    rate: Rate,
    measured: Floats,
    delta: Floats,
    interval: float,
    noise: Floats,
    deviation: Floats,
) -> Floats:
    """Coefficients after each sample by an extended Kalman filter.

    The filter estimates them together with the states.

    Parameters
    ----------
    rate : callable
        Time derivatives of the states from states, coefficients and rudder.
    measured : array of shape (n_samples, n_states)
        Every state is.
    delta : array of shape (n_samples,)
        Rudder.
    interval : float
        s
    noise : array of shape (n_states,)
        Standard deviation of the measurements.
    deviation : array of shape (n_coefficients,)
        Standard deviation of the coefficients at the start, at which they are 0.

    Returns
    -------
    array of shape (n_samples, n_coefficients)
    """
    m = len(noise)
    deviations = np.concatenate([noise, deviation])
    state = np.concatenate([measured[0], np.zeros(len(deviation))])
    covariance = np.diag(deviations**2)
    noise_covariance = np.diag(noise**2)
    # the state itself, and with a small change of each of its components
    step = STEP * deviations
    changes = np.column_stack([np.zeros(len(step)), np.diag(step)])
    history = np.zeros((len(measured), len(deviation)))
    for k in range(1, len(measured)):
        points = state[:, None] + changes
        moved = _advanced(rate, points, m, delta[k - 1 : k + 1], interval)
        predicted = moved[:, 0]
        jacobian = (moved[:, 1:] - predicted[:, None]) / step
        covariance = jacobian @ covariance @ jacobian.T

        innovation = measured[k] - predicted[:m]
        innovation_covariance = covariance[:m, :m] + noise_covariance
        gain = np.linalg.solve(innovation_covariance, covariance[:m]).T
        state = predicted + gain @ innovation
        covariance = covariance - gain @ covariance[:m]
        covariance = 0.5 * (covariance + covariance.T)
        history[k] = state[m:]
    return history


def _advanced(rate: Rate, points: Floats, m: int, delta: Floats, h: float) -> Floats:
    """Runge-Kutta over an interval, the rudder linear in it, coefficients constant."""
    x = points[:m]
    theta = points[m:]
    first, last = delta.tolist()
    middle = 0.5 * (first + last)
    a = rate(x, theta, first)
    b = rate(x + 0.5 * h * a, theta, middle)
    c = rate(x + 0.5 * h * b, theta, middle)
    d = rate(x + h * c, theta, last)
    mean_rate = a + 2.0 * b + 2.0 * c + d
    moved = x + h / 6.0 * mean_rate
    return np.concatenate([moved, theta])


@cache
def nomoto_history(structure: str, start: float = START) -> Floats:
    """Hual Trooper's coefficients from measured yaw rate and heading."""
    trial = song2020_nomoto.trial(structure, noisy=True)
    r, delta = trial["r"], trial["delta"]
    columns = [r, delta] if structure == "nomoto" else [r, r**3, delta]

    def rate(x: Floats, theta: Floats, rudder: float) -> Floats:
        yaw = x[1]
        terms = [yaw, rudder] if structure == "nomoto" else [yaw, yaw**3, rudder]
        return np.array(
            [yaw, sum(c * term for c, term in zip(theta, terms, strict=True))]
        )

    noise = np.array([song2020_nomoto.NOISE["psi"], song2020_nomoto.NOISE["r"]])
    size = np.sqrt(np.mean((0.1 * r) ** 2))  # a yaw rate that changes in 10 s
    deviation = start * size / np.sqrt(np.mean(np.square(columns), axis=1))
    measured = np.column_stack([np.unwrap(trial["psi"]), r])
    return kalman_history(
        rate, measured, delta, song2020_nomoto.INTERVAL, noise, deviation
    )


@cache
def mariner_history(start: float = START) -> Floats:
    """The six parameters of Table 7.3.2 from the noisy zigzag record."""
    trial, length = recursive_start.zigzag_trial(noisy=True), recursive_start.LENGTH
    units = np.array(
        [1 / length, 1.0, 1 / length, 1 / length**2, 1 / length, 1 / length**2]
    )[:, None]

    def rate(x: Floats, theta: Floats, rudder: float) -> Floats:
        v, r = x
        U = np.hypot(recursive_start.SPEED, v)
        terms = np.array([v * U, r * U, rudder * U**2])
        sway, yaw = np.split(theta * units * np.concatenate([terms, terms]), 2)
        return np.array([sway.sum(axis=0), yaw.sum(axis=0)])

    measured = np.column_stack([trial["v"], trial["r"]])
    noise = EXACT * np.sqrt(np.mean(measured**2, axis=0))
    return kalman_history(
        rate,
        measured,
        -trial["delta"],
        recursive_start.INTERVAL,
        noise,
        np.full(6, start),
    )


class Network(NamedTuple):
    """A network that predicts changes of velocities, and its standardisation."""

    weights: Sequence[tuple[Floats, Floats]]
    inputs: tuple[Floats, Floats]
    changes: tuple[Floats, Floats]

    def run(self, trial: Trial, states: Sequence[str]) -> dict[str, Floats]:
        """The velocities of a trial from its first sample and its rudder."""
        mean, size = self.inputs
        middle, change = self.changes
        *hidden, (last_matrix, last_offset) = self.weights
        x = np.array([trial[name][0] for name in states])
        path = np.empty((len(trial), len(states)))
        for k, rudder in enumerate(trial["delta"]):
            path[k] = x
            layer = (np.append(x, rudder) - mean) / size
            for matrix, offset in hidden:
                layer = np.tanh(layer @ matrix + offset)
            output = layer @ last_matrix + last_offset
            x = x + middle + change * output
        return dict(zip(states, path.T, strict=True))


def trained(trials: Sequence[Trial], states: Sequence[str], seed: int) -> Network:
    """A network of two hidden layers on the changes of velocities over a sample."""
    X = np.concatenate(
        [
            np.column_stack([trial[c] for c in (*states, "delta")])[:-1]
            for trial in trials
        ]
    )
    Y = np.concatenate(
        [np.diff([trial[c] for c in states], axis=1).T for trial in trials]
    )
    (mean, size), (middle, change) = (
        (values.mean(axis=0), values.std(axis=0)) for values in (X, Y)
    )
    model = MLPRegressor(
        hidden_layer_sizes=HIDDEN,
        activation="tanh",
        solver="lbfgs",
        alpha=DECAY,
        max_iter=ITERATIONS,
        random_state=seed,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit((X - mean) / size, (Y - middle) / change)
    return Network(
        list(zip(model.coefs_, model.intercepts_, strict=True)),
        (mean, size),
        (middle, change),
    )


@cache
def container_networks() -> tuple[Network, ...]:
    """Sway and yaw of the container ship from her 10/10 zigzag."""
    return tuple(trained([zigzag_trial(10)], ("v", "r"), seed) for seed in SEEDS)


@cache
def mariner_networks() -> tuple[Network, ...]:
    """The Mariner from one 15/15 zigzag."""
    return tuple(
        trained([cao2015.sampled_zigzag()], ("u", "v", "r"), seed) for seed in SEEDS
    )


@cache
def tanker_networks() -> tuple[Network, ...]:
    """KVLCC2 from her zigzags of 10 and 20 deg."""
    return tuple(trained(virtual().trials, ("u", "v", "r"), seed) for seed in SEEDS)


def turned(network: Network, turn: Trial) -> Trial:
    """A turn with positions, as a network steps it under the same rudder."""
    found = network.run(turn, ("u", "v", "r"))
    psi = cumulative_trapezoid(found["r"], turn.t, initial=0) + turn["psi"][0]
    u, v = found["u"], found["v"]
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    x, y = (cumulative_trapezoid(speed, turn.t, initial=0) for speed in (north, east))
    channels = (
        dict(turn.channels)
        | found
        | {
            "psi": psi,
            "x": x + turn["x"][0],
            "y": y + turn["y"][0],
        }
    )
    return Trial(turn.t, channels, name=turn.name, kind=turn.kind, length=turn.length)


def sampled_turn(rudder_deg: float) -> Trial:
    """KVLCC2's turn at the intervals of the zigzags."""
    target = virtual()
    interval = float(target.trials[0].t[1] - target.trials[0].t[0])
    run = turning_circle(
        target.ship,
        rudder_deg,
        duration=TURN * target.travel,
        dt=interval / STEPS_PER_SAMPLE,
    )
    channels = {
        c: run[c][::STEPS_PER_SAMPLE] for c in ("x", "y", "psi", "u", "v", "r", "delta")
    }
    return Trial(
        run.t[::STEPS_PER_SAMPLE],
        channels,
        name=run.name,
        kind=run.kind,
        length=target.ship.particulars.length,
    )


def filter_rows() -> Iterator[Row]:
    """Zhu's Table 7.3.2 and Song's section 3.1 by the filter, from three starts."""
    best = recursive_start.errors(recursive_start.at_best())
    ends = [recursive_start.errors(mariner_history(start)[-1]) for start in STARTS]
    for k, name in enumerate(recursive_start.NAMES):
        yield Row(
            "zhu2018, Table 7.3.2",
            f"{name} by the extended Kalman filter: error, %",
            None,
            float(ends[0][k]),
            float(best[k]),
            note="the filter's equations are the ship's own, integrated accurately",
        )
    worst = [float(np.abs(end).max()) for end in ends]
    yield from _start_rows("zhu2018, Table 7.3.2", worst, float(np.abs(best).max()))
    for structure, truth in song2020_nomoto.TRUTH.items():
        best_found = song2020_nomoto.errors(
            song2020.at_best(structure, noisy=True), truth
        )
        errors = [
            song2020_nomoto.errors(
                dict(
                    zip(
                        truth,
                        nomoto_history(structure, start)[-1].tolist(),
                        strict=True,
                    )
                ),
                truth,
            )
            for start in STARTS
        ]
        for name in truth:
            yield Row(
                f"song2020, Section 3.1, {structure}",
                f"{name} by the extended Kalman filter: error, %",
                None,
                errors[0][name],
                best_found[name],
                note="with the noise of instruments",
            )
        worst = [max(found.values()) for found in errors]
        yield from _start_rows(
            f"song2020, Section 3.1, {structure}", worst, max(best_found.values())
        )


def _start_rows(case: str, worst: Sequence[float], best: float) -> Iterator[Row]:
    for start, error in zip(STARTS, worst, strict=True):
        yield Row(
            case,
            f"largest error by the filter, deviation {start:g} at the start, %",
            None,
            error,
            best,
            note=(
                "deviation of the coefficients at the start, at which they are 0, in"
                " parts of a usual size"
            ),
        )


def network_rows() -> Iterator[Row]:
    """Manoeuvres not learned, as the networks step them."""
    turns = zigzag_trial(20)
    runs = [network.run(turns, ("v", "r")) for network in container_networks()]
    for q in ("v", "r"):
        what = (
            f"20/20 by a neural network: mean squared error, {EQUATIONS[q]}, {UNITS[q]}"
        )
        errors = [mean_square(run, turns, q) for run in runs]
        yield _network_row(
            "zhu2018, Tables 7.4.9, 7.4.10", what, errors, best_errors()[q]
        )
    for name, run in cao2015.MANOEUVRES.items():
        truth, best = run(load_model("mariner")), run(cao2015.at_best())
        sampled = every(truth, 5, name)
        found = [turned(network, sampled) for network in mariner_networks()]
        for channel in ("u", "v", "r", "psi"):
            what = f"{name} by a neural network, {channel}: rms error, % of span"
            errors = [cao2015.off(trial, sampled, channel) for trial in found]
            yield _network_row(
                "cao2015, Figures 3 to 6",
                what,
                errors,
                cao2015.off(best, truth, channel),
            )
    ours = our_way(virtual(), same_hull()).model
    for rudder in (HARD, -HARD):
        turn, best_indices = sampled_turn(rudder), virtual().turn_indices(ours, rudder)
        truths = turning_indices(turn, turn.length)
        indices = [
            turning_indices(turned(network, turn), turn.length)
            for network in tanker_networks()
        ]
        for index, (words, attribute) in ATTRIBUTES.items():
            truth = getattr(truths, attribute)
            errors = [
                100.0 * abs(getattr(found, attribute) / truth - 1.0)
                for found in indices
            ]
            what = (
                f"{rudder:+.0f} deg by a neural network: {words}, size of the error, %"
            )
            best = 100.0 * abs((best_indices[index] or np.nan) / truth - 1.0)
            yield _network_row(
                "mei2019, Tables 6, 7, MMG model as target", what, errors, best
            )


def _network_row(case: str, what: str, errors: Sequence[float], best: float) -> Row:
    note = f"median of {len(errors)} networks, {min(errors):.3g} to {max(errors):.3g}"
    return Row(case, what, None, float(np.median(errors)), best, note=note)


def rows() -> Iterator[Row]:
    """All rows."""
    yield from filter_rows()
    yield from network_rows()


_LARGEST = "largest error by the filter, deviation {:g} at the start, %"
CONCLUSIONS = (
    Conclusion(
        "What a Kalman filter finds depends on values set beforehand (Zhu 2018,"
        " abstract)",
        tuple(
            f"song2020, Section 3.1, norrbin: {_LARGEST.format(start)}"
            for start in STARTS
        ),
        lambda *found: (
            max(row.as_paper for row in found)
            > 10.0 * min(row.as_paper for row in found)
        ),
        "by a factor of ten",
    ),
    Conclusion(
        "The same for a linear model",
        tuple(f"zhu2018, Table 7.3.2: {_LARGEST.format(start)}" for start in STARTS),
        lambda *found: (
            max(row.as_paper for row in found)
            > 10.0 * min(row.as_paper for row in found)
        ),
        "but where the start is left open the filter is better than our recursion",
    ),
    Conclusion(
        "From few data of small rudder angles RM-SVM generalises better than other"
        " methods (Mei 2019)",
        tuple(
            f"mei2019, Tables 6, 7, MMG model as target: {rudder:+.0f} deg by a neural"
            f" network: {words}, size of the error, %"
            for rudder in (HARD, -HARD)
            for words in WORDS.values()
        ),
        lambda *found: (
            sum(row.best for row in found) < sum(row.as_paper for row in found)
        ),
        "by the mean of the four, beside a network taught the same zigzags; the"
        " network's advance to starboard is the better one",
    ),
)
PAPER = Paper(
    "comparators",
    "Two comparators on the papers' cases",
    "An extended Kalman filter that carries the coefficients as states, and a neural"
    f" network of two hidden layers of {HIDDEN[0]}; *at best* is ours. Every row is an"
    " error: the smaller is the better.",
    rows,
    conclusions=CONCLUSIONS,
    ours="the comparator",
)
