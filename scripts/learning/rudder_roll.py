"""Rules for rudder-roll damping: PD with roll rate, LQ, and LQG by encounter.

Each has numbers that are searched. All damp roll only as far as it has grown: below
three degrees roll costs nothing (automatic gain control: van Amerongen, van der Klugt
& van Nauta Lemke 1990, Rudder roll stabilization for ships, Automatica 26).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from scipy.linalg import expm, solve_discrete_are

import shipgym
from shipgym.arrays import Floats
from shipgym.models.linear import straight_running

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "rudder_roll.png"
ID = "shipgym/RudderRoll-v0"
SHIP = shipgym.load_model("container-stiff")
DT, LIMIT = 1.0, SHIP.steering.limit
STATES = ("v", "r", "p", "phi", "psi", "delta")
SWAY, YAW_RATE, ROLL_RATE, ROLL, HEADING, RUDDER = range(6)
#: Encounter frequencies of designs, rad/s, and damping of the wave model.
ENCOUNTERS = np.linspace(0.35, 0.85, 6)
WAVE_DAMPING = 0.1


class Rule(NamedTuple):
    """A rule with numbers: where their search starts, and the policy that they make."""

    start: tuple[float, ...]
    make: Any  # (numbers) -> function of (signals, memory)


def signals(seen: Floats) -> Floats:
    """States of `STATES` from observations in SI units; the heading is minus its error.

    Shape (n, 6).
    """
    error = np.arctan2(seen[:, 0], seen[:, 1])
    columns = [seen[:, 3], seen[:, 2], seen[:, 9], seen[:, 8], -error, seen[:, 5]]
    return np.stack(columns, axis=-1)


def grown(roll: Floats, mean_square: Floats, band: Floats) -> tuple[Floats, Floats]:
    """Part of the damping that roll has grown to need, and its mean square after."""
    update = DT / 20.0
    after = mean_square + update * (roll**2 - mean_square)
    level = np.degrees(np.sqrt(after))
    return np.clip((level - band[0]) / max(band[1], 0.01), 0.0, 1.0), after


# ---- PD and a band-pass of the roll rate ------------------------------------------


def pd_band_pass(numbers: Floats) -> Any:
    """PD on a smooth heading, and feedback of the roll rate in a band."""
    error_gain, rate_gain, roll_gain, roll_rate_gain, smooth, slow, *band = numbers
    smoothing = DT / (DT + np.exp(smooth))
    leaking = DT / (DT + np.exp(slow))

    def law(x: Floats, memory: Any) -> tuple[Floats, Any]:
        if memory is None:
            memory = x[:, HEADING], x[:, YAW_RATE], x[:, ROLL], 0.0 * x[:, ROLL]
        heading, rate, mean_roll, square = memory
        heading = heading + smoothing * (x[:, HEADING] - heading)
        rate = rate + smoothing * (x[:, YAW_RATE] - rate)
        mean_roll = mean_roll + leaking * (x[:, ROLL] - mean_roll)
        roll = x[:, ROLL] - mean_roll
        part, square = grown(roll, square, np.array(band))
        course = -error_gain * heading - 10.0 * rate_gain * rate
        damping = roll_gain * roll + 10.0 * roll_rate_gain * x[:, ROLL_RATE]
        return course + part * damping, (heading, rate, mean_roll, square)

    return law


# ---- linear quadratic designs -----------------------------------------------------


def flow(encounter: float) -> Floats:
    """Rates of the states, of the waves' two, and of the order that is held."""
    rates = np.zeros((9, 9))
    rates[:6, [0, 1, 2, 3, 4, 5, 8]] = linear_ship()
    rates[ROLL_RATE, 7] = 1.0  # the second state of the waves is their acceleration
    rates[6, 7] = encounter
    rates[7, 6] = -encounter
    rates[7, 7] = -2.0 * WAVE_DAMPING * encounter
    return rates


@cache
def linear_ship() -> Floats:
    """Rates of the states by themselves and by the order, shape (6, 7)."""
    state = straight_running(SHIP).state(SHIP)
    command = np.array([0.0, SHIP.service_shaft_speed])
    rows = [SHIP.state_names.index(name) for name in STATES]
    small = 1e-5
    columns = []
    for k in (*rows, None):
        rates = []
        for step in (small, -small):
            at, given = state.copy(), command.copy()
            if k is None:
                given[0] += step
            else:
                at[k] += step
            rates.append(SHIP.derivatives(at, given)[rows])
        columns.append((rates[0] - rates[1]) / (2.0 * small))
    return np.stack(columns, axis=-1)


def gain_of(A: Floats, B: Floats, weights: Floats) -> Floats:
    """Gain of LQ: weights (logarithms) of roll, heading, rudder and its rate."""
    roll, heading, rudder, rate = np.exp(weights)
    n = len(A)
    Q = np.zeros((n, n))
    Q[ROLL, ROLL] = roll
    Q[HEADING, HEADING] = heading
    Q[RUDDER, RUDDER] = rudder + rate
    N = np.zeros((n, 1))
    N[RUDDER] = -rate
    R = np.array([[rate]])
    P = solve_discrete_are(A, B, Q, R, s=N)
    return np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A + N.T)[0]


def split(gain: Floats) -> tuple[Floats, Floats]:
    """Gains on what keeps the course, and on roll and waves."""
    of_roll = np.zeros(len(gain))
    of_roll[[ROLL_RATE, ROLL]] = gain[[ROLL_RATE, ROLL]]
    of_roll[6:] = gain[6:]
    return gain - of_roll, of_roll


def lq_roll(numbers: Floats) -> Any:
    """LQ with feedback of all states."""
    held = expm(DT * flow(0.6))
    course, damping = split(gain_of(held[:6, :6], held[:6, 8:], numbers[:4]))

    def law(x: Floats, memory: Any) -> tuple[Floats, Any]:
        square = 0.0 * x[:, ROLL] if memory is None else memory
        part, square = grown(x[:, ROLL], square, numbers[4:])
        return -x @ course - part * (x @ damping), square

    return law


class Designs(NamedTuple):
    """LQG of each encounter frequency, stacked."""

    A: Floats  # shape (n, 8, 8)
    B: Floats  # shape (n, 8)
    kalman: Floats  # shape (n, 8, 6)
    course: Floats  # shape (n, 8), gains
    damping: Floats  # shape (n, 8)


def designs(weights: Floats) -> Designs:
    """Design LQG at each encounter frequency."""
    found = []
    output = np.eye(6, 8)
    noise = np.diag([0.05, 1e-3, 2e-4, 2e-4, 5e-3, 1e-3]) ** 2
    process = np.diag([0.02, 2e-4, 1e-4, 1e-5, 1e-5, 1e-4, 0.0, 0.0]) ** 2
    for encounter in ENCOUNTERS:
        held = expm(DT * flow(encounter))
        A = held[:8, :8]
        B = held[:8, 8:]
        moment = 5e-3  # rad/s2, standard deviation of the waves' acceleration
        waves = np.zeros((8, 8))
        waves[6:, 6:] = np.eye(2) * 2.0 * WAVE_DAMPING * encounter * DT * moment**2
        P = solve_discrete_are(A.T, output.T, process + waves, noise)
        kalman = P @ output.T @ np.linalg.inv(output @ P @ output.T + noise)
        found.append((A, B[:, 0], kalman, *split(gain_of(A, B, weights))))
    return Designs(*(np.array(part) for part in zip(*found, strict=True)))


def lqg_by_encounter(numbers: Floats) -> Any:
    """LQG with a wave model, of the encounter whose filter predicts roll best."""
    bank = designs(numbers[:4])
    forgetting = DT / 60.0

    def law(x: Floats, memory: Any) -> tuple[Floats, Any]:
        n = len(x)
        if memory is None:
            first = np.concatenate([x, np.zeros((n, 2))], axis=1)
            expected = np.repeat(first[None], len(ENCOUNTERS), axis=0)
            memory = expected, np.zeros((len(ENCOUNTERS), n)), np.zeros(n)
        expected, surprise, square = memory
        off = x - expected[..., :6]
        now = expected + np.einsum("eij,enj->eni", bank.kalman, off)
        missed = (off[..., ROLL_RATE] ** 2) - surprise
        surprise = surprise + forgetting * missed
        best = np.argmin(surprise, axis=0)

        part, square = grown(x[:, ROLL], square, numbers[4:])
        chosen = now[best, np.arange(n)]
        course = np.sum(bank.course[best] * chosen, axis=-1)
        damping = np.sum(bank.damping[best] * chosen, axis=-1)
        order = np.clip(-course - part * damping, -LIMIT, LIMIT)
        expected = np.einsum("eij,enj->eni", bank.A, now)
        expected = expected + bank.B[:, None, :] * order[None, :, None]
        return order, (expected, surprise, square)

    return law


#: Weights as logarithms, and roll in degrees from which damping begins and its width.
START = (0.0, 1.0, -2.0, 0.0, 0.5, 1.0)
RULES = {
    "PD": Rule((1.7, 0.0, 0.5, -0.2, 0.0, 3.0, 0.5, 1.0), pd_band_pass),
    "LQ": Rule(START, lq_roll),
    "LQG": Rule(START, lqg_by_encounter),
}


# ---- a picture --------------------------------------------------------------------


def draw() -> None:
    """Write docs/images/rudder_roll.png: roll and rudder with and without damping."""
    import matplotlib.pyplot as plt

    figure, (above, below) = plt.subplots(2, sharex=True, figsize=(7.0, 3.6))
    for name, part in (("course only", 0.0), ("with damping", 1.0)):
        numbers = np.array(RULES["PD"].start)
        numbers[2:4] *= part
        roll, rudder = sailed(pd_band_pass(numbers))
        above.plot(roll, label=name, linewidth=0.8)
        below.plot(rudder, linewidth=0.8)
    above.axhspan(-3.0, 3.0, alpha=0.12)
    above.set_ylabel("roll, deg")
    above.legend(loc="upper right", ncols=2)
    below.set_ylabel("rudder, deg")
    below.set_xlabel("time, s")
    figure.tight_layout()
    figure.savefig(PICTURE, dpi=90)


def sailed(law: Any) -> tuple[Floats, Floats]:
    """Roll and rudder of one episode, deg."""
    envs = gymnasium.make_vec(ID, num_envs=1)
    seen, _ = envs.reset(seed=3)
    memory = None
    states = []
    for _ in range(599):
        x = signals(seen * envs.observation_scales)
        states.append(np.degrees(x[0, [ROLL, RUDDER]]))
        order, memory = law(x, memory)
        command = np.clip(order / LIMIT, -1.0, 1.0)
        seen, *_ = envs.step(command[:, None].astype(np.float32))
    roll, rudder = np.transpose(states)
    return roll, rudder


if __name__ == "__main__":
    draw()
