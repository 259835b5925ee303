"""One table of each paper by numpy alone: a check that needs none of our code."""

import numpy as np
import pytest

L, U0, H = 160.93, 7.7175, 0.1  # m, m/s, s: Cao 2015
#: Derivatives of the Mariner, 1e-5, rudder positive to port (Chislett & Strom-Tejsen).
MARINER = {
    "X": "u -184 uu -110 uuu -215 vv -899 rr 18 dd -95 udd -190 vr 798 vd 93 uvd 93",
    "Y": (
        "0 -4 0u -8 0uu -4 v -1160 r -499 d 278 vvv -8078 ddd -90 vvr 15356 vvd 1190"
        " vdd -4 ud 556 uv -1160 ur -499 uud 278"
    ),
    "N": (
        "0 3 0u 6 0uu 3 v -264 r -166 d -139 vvv 1636 ddd 45 vvr -5483 vvd -489 vdd 13"
        " ud -278 uv -264 ur -166 uud -139"
    ),
}
SURGE_INERTIA = 840e-5
SWAY_YAW_INERTIA = np.array(
    [
        [798e-5 + 748e-5, -0.023 * 798e-5 + 9.354e-5],
        [-0.023 * 798e-5 - 4.646e-5, 39.2e-5 + 43.8e-5],
    ]
)
INVERSE, FASTEST = np.linalg.inv(SWAY_YAW_INERTIA), np.radians(5.0)
#: Errors of Tables 2 to 4, %.
CAO = {
    "X": "u 0 uu 1 uuu 1 vv 0 rr 2 dd 0 udd 1 vr 0 vd 0 uvd 3",
    "Y": (
        "0 1 0u 6 0uu 75 v 0 r 0 d 0 vvv 3 ddd 11 vvr 1 vvd 2 vdd 156 ud 1 uv 1 ur 1"
        " uud 7"
    ),
    "N": (
        "0 0 0u 1 0uu 24 v 0 r 0 d 0 vvv 5 ddd 12 vvr 1 vvd 1 vdd 14 ud 0 uv 0 ur 0"
        " uud 0"
    ),
}


def table(text):
    words = text.split()
    return {term: float(n) for term, n in zip(words[::2], words[1::2], strict=True)}


DERIVATIVES = {q: table(text) for q, text in MARINER.items()}


def terms(names, u, v, r, d):
    """Terms of the Abkowitz model by the instantaneous speed, times U^2."""
    U = (u * u + v * v) ** 0.5
    prime = {"u": (u - U0) / U, "v": v / U, "r": r * L / U, "d": -d, "0": 1.0}
    found = []
    for name in names:
        term = U * U
        for one in name:
            term = term * prime[one]
        found.append(term)
    return found


def mariner_rates(state, order):
    u, v, r, _, d = state.tolist()
    force = {}
    for q, values in DERIVATIVES.items():
        pairs = zip(values.values(), terms(values, u, v, r, d), strict=True)
        force[q] = 1e-5 / L * sum(value * term for value, term in pairs)
    dv, dr = INVERSE @ (force["Y"], force["N"])
    dd = min(max(order - d, -FASTEST), FASTEST)
    return np.array([force["X"] / SURGE_INERTIA, dv, dr / L, r, dd])


def mariner_zigzag():
    """15/15 for 500 s by classical Runge-Kutta, sampled each 0.5 s."""
    angle = np.radians(15.0)
    order, state, states = -angle, np.array([U0, 0.0, 0.0, 0.0, 0.0]), []
    for _ in range(5001):
        states.append(state)
        if np.sign(order) * state[3] >= angle:
            order = -order
        k1 = mariner_rates(state, order)
        k2 = mariner_rates(state + H / 2 * k1, order)
        k3 = mariner_rates(state + H / 2 * k2, order)
        k4 = mariner_rates(state + H * k3, order)
        state = state + H / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return np.array(states)[::5].T


def test_cao_2015_tables_2_to_4():
    """The errors of 40 derivatives by LS-SVM on trapezoidal samples: 39 agree."""
    sampled = mariner_zigzag()
    found = {}
    for q, row, C in (("X", 0, 4e6), ("Y", 1, 6e8), ("N", 2, 6e8)):
        u, v, r, _, d = sampled
        columns = np.array(terms(DERIVATIVES[q], u, v, r, d)).T
        X = 0.5 * 0.5 * (columns[1:] + columns[:-1])
        ridge = X.T @ X + np.eye(X.shape[1]) / C
        found[q] = np.linalg.solve(ridge, X.T @ np.diff(sampled[row]))
    found["X"] *= SURGE_INERTIA * L
    pair = SWAY_YAW_INERTIA @ np.array([found["Y"], L * found["N"]]) * L
    found["Y"], found["N"] = pair
    agree = 0
    for q, coefficients in found.items():
        truth = 1e-5 * np.array(list(DERIVATIVES[q].values()))
        errors = 100.0 * np.abs(coefficients / truth - 1.0)
        printed = np.array(list(table(CAO[q]).values()))
        agree += np.sum(np.abs(errors - printed) <= np.maximum(0.1 * printed, 0.5))
    assert agree >= 39


def test_xu_2020_table_11_is_what_is_put_in():
    """Yaw moment of Table 11 in a tank: least squares can only read it back."""
    truth = np.array([-1.2e-3, 1.87e-3, -8.41e-3, -1e-3, 2.14e-2, -1.69e-2, 1.11e-2])
    t = np.linspace(0.0, 4.0 * np.pi, 500)
    r = np.concatenate([0.3 * np.sin(t), 0.9 * np.sin(t), 0.0 * t, 0.6 * np.sin(t)])
    v = np.concatenate([0.0 * t, 0.0 * t, 0.3 * np.sin(t), 0.2 + 0.1 * np.cos(t)])
    dr, dv = np.gradient(r), np.gradient(v)
    X = np.stack([dr, dv, r, r * abs(r), v, v * abs(r), r * abs(v)], axis=1)
    noise = np.random.default_rng(0).standard_normal(len(X))
    y = X @ truth
    y += 1e-4 * np.std(y) * noise
    assert np.linalg.lstsq(X, y)[0] == pytest.approx(truth, rel=0.02)


def test_zhu_2018_table_7_3_2():
    """RLS from zero misses a22 on a ship integrated by Euler's rule (printed -80 %)."""
    length, U, dt = 161.0, 7.7, 0.5
    truth = np.array([[-0.693, -0.304, 0.207], [-3.41, -2.17, -1.63]])
    units = np.array([[length, 1.0, length], [length**2, length, length**2]])
    per_step = truth * dt / units
    angle, order, delta, psi = np.radians(20.0), -np.radians(20.0), 0.0, 0.0
    motion, rows = np.zeros(2), []
    for _ in range(2000):
        speed = np.hypot(U, motion[0])
        terms_now = np.array([motion[0] * speed, motion[1] * speed, delta * speed**2])
        after = motion + per_step @ terms_now
        rows.append((motion[1], terms_now, after[1]))
        psi += dt * motion[1]
        if -np.sign(order) * psi >= angle:
            order = -order
        delta += dt * np.clip(order - delta, -np.radians(5.0), np.radians(5.0))
        motion = after

    theta, P = np.zeros(4), 1e6 * np.eye(4)
    for r, terms_now, target in rows:
        phi = np.concatenate([[r], terms_now])
        gain = P @ phi / (1.0 + phi @ P @ phi)
        theta = theta + gain * (target - phi @ theta)
        P = P - np.outer(gain, phi @ P)
    a22 = theta[2] * length / dt
    assert -60.0 < 100.0 * (a22 / truth[1, 1] - 1.0) < -15.0


def test_mei_2019_table_4():
    """Correlation of five particulars with KVLCC2's; the tanker is chosen."""
    kvlcc2 = (0.90, 5.52, 2.79, 40.1, 1 / 48.7)
    ships = {
        "Mariner": (0.60, 6.95, 3.10, 20.9, 1 / 83.1),
        "Tanker": (0.83, 6.39, 2.58, 37.0, 1 / 61.0),
        "SR108": (0.56, 6.89, 2.99, 14.1, 1 / 45.8),
        "PCC": (0.55, 5.60, 3.93, 18.0, 1 / 39.8),
    }
    printed = {"Mariner": -0.5758, "Tanker": 0.8510, "SR108": -0.8873, "PCC": -0.7228}
    everyone = np.array([kvlcc2, *ships.values()])
    scaled = everyone / np.linalg.norm(everyone, axis=0)
    found = {
        name: np.corrcoef(scaled[0], row)[0, 1]
        for name, row in zip(ships, scaled[1:], strict=True)
    }
    assert found == pytest.approx(printed, abs=0.03)


def test_song_2020_equation_4_12():
    """As printed the innovation is even: K ends near zero. Odd, it converges."""
    K, T, dt, omega = 0.15, 47.61, 0.4, 0.5
    r, psi, order, rows = 0.0, 0.0, np.radians(10.0), []
    for _ in range(5000):
        after = r + dt * (K * order - r) / T
        rows.append((np.array([r, order]), (after - r) / dt))
        r, psi = after, psi + dt * r
        if np.sign(order) * psi >= np.radians(10.0):
            order = -order
    size = np.sqrt(np.mean([phi**2 for phi, _ in rows], axis=0))
    errors = {}
    for form in ("even", "odd"):
        theta, P = np.zeros(2), 1e6 * np.eye(2)
        for phi, target in rows:
            scaled = phi / size
            e = target - scaled @ theta
            bend = np.tanh(omega * e)
            gain = P @ scaled / (1.0 + scaled @ P @ scaled)
            theta = theta + gain * (bend / omega if form == "odd" else e * bend)
            P = P - np.outer(gain, scaled @ P)
        c_r, c_d = theta / size
        errors[form] = 100.0 * (-c_d / c_r / K - 1.0)
    assert abs(errors["odd"]) < 0.1
    assert errors["even"] < -90.0
