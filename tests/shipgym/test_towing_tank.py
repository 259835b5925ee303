"""Virtual captive tests."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import shipgym
from shipgym import InputError, Trial, load_model
from shipgym.manoeuvres import towing_tank
from shipgym.manoeuvres.towing_tank import Tank

SMALL = 1e-4  # of the speed: so small that only the linear derivatives are felt
L, U, RHO = 160.93, 7.7175, 1025.0
FORCE = 0.5 * RHO * L**2 * U**2
UNIT = {"X": FORCE, "Y": FORCE, "N": FORCE * L}


@pytest.fixture(scope="module")
def mariner():
    return load_model("mariner")


def derivatives(
    trial: Trial, force: str, velocity: str, unit: float
) -> tuple[float, float]:
    """Prime derivatives by velocity and acceleration.

    The parts of a force in and out of phase.
    """
    swing = (trial[velocity] - trial[velocity].mean()) / unit
    acceleration = np.gradient(swing, trial.t, edge_order=2) * L / U
    regressors = np.stack([np.ones(len(trial)), swing, acceleration], axis=-1)[1:-1]
    _, slow, fast = np.linalg.lstsq(
        regressors, trial[force][1:-1] / UNIT[force], rcond=None
    )[0]
    return float(slow), float(fast)


# Chislett & Strom-Tejsen 1965, times 1e5: m' = 798, m'xG' = -18.354, Iz' = 39.2
@pytest.mark.parametrize(
    ("force", "by_velocity", "by_acceleration"),
    [("Y", -1160, -(798 + 748)), ("N", -264, -(-18.354 - 4.646))],
)
def test_pure_sway_of_mariner(mariner, force, by_velocity, by_acceleration):
    """Y_v and N_v in phase with the sway speed.

    Mass and added mass against the sway acceleration.
    """
    trial = towing_tank.pure_sway(mariner, SMALL * U, tank=Tank(samples=1000))
    slow, fast = derivatives(trial, force, "v", U)
    assert slow * 1e5 == pytest.approx(by_velocity, rel=1e-4)
    assert fast * 1e5 == pytest.approx(by_acceleration, rel=1e-4)


@pytest.mark.parametrize(
    ("force", "by_velocity", "by_acceleration"),
    [("Y", -499, -(-18.354 + 9.354)), ("N", -166, -(39.2 + 43.8))],
)
def test_pure_yaw_of_mariner(mariner, force, by_velocity, by_acceleration):
    """Y_r - m' u' and N_r - m'xG' u' are one coefficient each in Mariner's tables."""
    trial = towing_tank.pure_yaw(
        mariner, np.degrees(SMALL * U / L), tank=Tank(samples=1000)
    )
    slow, fast = derivatives(trial, force, "r", U / L)
    assert slow * 1e5 == pytest.approx(by_velocity, rel=1e-4)
    assert fast * 1e5 == pytest.approx(by_acceleration, rel=1e-4)


def test_pure_surge_of_mariner(mariner):
    trial = towing_tank.pure_surge(mariner, SMALL * U, tank=Tank(samples=1000))
    slow, fast = derivatives(trial, "X", "u", U)
    assert slow * 1e5 == pytest.approx(-184, rel=1e-4)
    assert fast * 1e5 == pytest.approx(-(798 + 42), rel=1e-4)


def test_without_the_ship_s_own_inertia_the_water_s_derivatives_are_left(mariner):
    """Y_vdot' = -748e-5, N_rdot' = -43.8e-5, Y_r' = -499e-5 + m' = 299e-5."""
    tank = Tank(samples=1000, model_inertia=False)
    sway = towing_tank.pure_sway(mariner, SMALL * U, tank=tank)
    yaw = towing_tank.pure_yaw(mariner, np.degrees(SMALL * U / L), tank=tank)
    assert derivatives(sway, "Y", "v", U)[1] * 1e5 == pytest.approx(-748, rel=1e-4)
    assert derivatives(yaw, "N", "r", U / L)[1] * 1e5 == pytest.approx(-43.8, rel=1e-4)
    assert derivatives(yaw, "Y", "r", U / L)[0] * 1e5 == pytest.approx(299, rel=1e-4)


def test_samples_of_whole_cycles_with_both_ends_and_of_every_angle(mariner):
    """By default three periods of 10 ship lengths each, 200 samples a period, and a
    second at an angle.
    """
    swing = towing_tank.pure_sway(mariner, 0.5)
    np.testing.assert_allclose(swing.t, np.linspace(0.0, 30.0 * L / U, 601))
    assert (swing["v"][0], swing["v"][100], swing["v"][-1]) == pytest.approx(
        (0.5, -0.5, 0.5)
    )
    drift = towing_tank.static_drift(mariner, [4.0, -8.0])
    np.testing.assert_allclose(drift.t, np.arange(400) / 200.0)
    assert np.degrees(np.arctan2(-drift["v"], drift["u"])) == pytest.approx(
        np.repeat([4.0, -8.0], 200)
    )


@pytest.mark.parametrize("drift_deg", [-12.0, 4.0, 9.0])
def test_static_drift_of_mariner_with_rudder_by_hand(mariner, drift_deg):
    """The whole polynomial of the sway force at a drift angle with 10 degrees of
    rudder.
    """
    trial = towing_tank.static_drift(mariner, [drift_deg], tank=Tank(rudder_deg=10.0))
    v, u, d = (
        -np.sin(np.radians(drift_deg)),
        np.cos(np.radians(drift_deg)) - 1.0,
        -np.radians(10.0),
    )
    expected = (
        -4
        - 8 * u
        - 4 * u**2
        - 1160 * v
        - 8078 * v**3
        - 1160 * u * v
        + 278 * d
        - 90 * d**3
        + 1190 * v**2 * d
        - 4 * v * d**2
        + 556 * u * d
        + 278 * u**2 * d
    )
    np.testing.assert_allclose(trial["Y"] / FORCE * 1e5, expected, rtol=1e-10)


def test_yaw_with_drift_of_mariner_by_hand(mariner):
    """The cross terms X_vr and Y_vvr at the largest yaw rate, where the yaw
    acceleration is zero.
    """
    rate, drift = 0.2, np.radians(8.0)
    trial = towing_tank.yaw_with_drift(mariner, np.degrees(rate * U / L), 8.0)
    v, u, r = -np.sin(drift), np.cos(drift) - 1.0, rate
    surge = -184 * u - 110 * u**2 - 215 * u**3 - 899 * v**2 + 18 * r**2 + 798 * v * r
    sway = (
        -4
        - 8 * u
        - 4 * u**2
        - 1160 * v
        - 8078 * v**3
        - 1160 * u * v
        - 499 * r
        - 499 * u * r
        + 15356 * v**2 * r
    )
    assert trial["X"][0] / FORCE * 1e5 == pytest.approx(surge, rel=1e-10)
    assert trial["Y"][0] / FORCE * 1e5 == pytest.approx(sway, rel=1e-10)


@pytest.mark.parametrize(
    "name", ["mariner", "container", "tanker", "kvlcc2", "kvlcc2-l7"]
)
def test_at_service_speed_thrust_and_resistance_balance(name):
    trial = towing_tank.static_drift(load_model(name), [0.0, 5.0])
    assert abs(trial["X"][0]) < 1e-3 * abs(trial["Y"][-1])


def test_drift_forces_of_kvlcc2_s_hull_by_hand():
    """Without rudder the hull's polynomials are left.

    rho L d U^2 / 2 (Y_v v + Y_vvv v^3), N with L more.
    """
    model = load_model("kvlcc2-l7")
    bare = replace(model, coefficients={**model.coefficients, "A_R": 0.0})
    trial = towing_tank.static_drift(bare, [10.0])
    v = -np.sin(np.radians(10.0))
    unit = 0.5 * 1000.0 * 7.0 * 0.46 * 1.179**2
    assert trial["Y"][0] == pytest.approx(unit * (-0.315 * v - 1.607 * v**3), rel=1e-9)
    assert trial["N"][0] == pytest.approx(
        unit * 7.0 * (-0.137 * v - 0.030 * v**3), rel=1e-9
    )


def test_the_container_s_roll_is_not_in_her_sway_force():
    """The lever of the added mass couples roll to sway.

    The force on a ship held upright does not know it.
    """
    model = load_model("container")
    level = replace(model, coefficients={**model.coefficients, "ly": 0.0})
    held, other = (towing_tank.pure_sway(ship, 0.5)["Y"] for ship in (model, level))
    np.testing.assert_allclose(held, other, rtol=1e-9)


def test_the_tanker_s_added_mass_grows_in_shallow_water():
    """At a depth of 1.5 draughts z = 2.

    Mass (m22 - 2 Y_vdotz) = 2.794 mass in sway instead of 2.02.
    """
    model = load_model("tanker")
    tank = Tank(water_depth=1.5 * 18.46)
    mass = model.particulars["mass"]
    assert towing_tank.inertia(model, tank.water_depth)[1, 1] == pytest.approx(
        2.794 * mass
    )
    assert towing_tank.inertia(model)[1, 1] == pytest.approx(2.02 * mass)
    shallow, deep = (
        towing_tank.pure_sway(model, 0.5, tank=tank),
        towing_tank.pure_sway(model, 0.5),
    )
    assert shallow["Y"].std() > 1.5 * deep["Y"].std()


def test_noise_is_part_of_each_force_and_replays(mariner):
    clean = towing_tank.pure_sway(mariner, 0.8)
    noisy, again = (
        towing_tank.pure_sway(mariner, 0.8, tank=Tank(noise=0.05, seed=3, cycles=30))
        for _ in range(2)
    )
    assert noisy.sha256 == again.sha256
    rest = noisy["Y"][: len(clean)] - clean["Y"]
    assert rest.std() == pytest.approx(
        0.05 * np.sqrt((clean["Y"] ** 2).mean()), rel=0.1
    )
    np.testing.assert_array_equal(noisy["v"][: len(clean)], clean["v"])


def test_a_force_trial_is_a_file_like_any_other(mariner, tmp_path):
    trial = towing_tank.pure_yaw(mariner, 0.3)
    trial.to_csv(tmp_path / "yaw.csv")
    again = Trial.from_csv(tmp_path / "yaw.csv", kind="captive")
    assert again.sha256 == trial.sha256
    assert (trial.kind, trial.length) == ("captive", L)
    assert "pure_yaw" in dir(shipgym.manoeuvres.towing_tank)


def test_a_balance_at_the_centre_of_gravity_is_moved_to_midship(mariner, tmp_path):
    """The moment about midship is that about the centre of gravity and xG Y.

    Kilonewtons are converted.
    """
    trial = towing_tank.static_drift(mariner, [8.0])
    xg = mariner.particulars["xg"]
    channels = {"Y": trial["Y"], "N": trial["N"] - xg * trial["Y"]}
    Trial(trial.t, {name: values / 1000.0 for name, values in channels.items()}).to_csv(
        tmp_path / "run.csv"
    )
    columns = {
        "t": "t",
        "Y": {"column": "Y", "unit": "kN"},
        "N": {"column": "N", "unit": "kN m"},
    }
    again = Trial.from_csv(tmp_path / "run.csv", columns, origin="cg", xg=xg)
    np.testing.assert_allclose(again["Y"], trial["Y"], rtol=1e-12)
    np.testing.assert_allclose(again["N"], trial["N"], rtol=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda m: towing_tank.static_drift(m, []),
            "drift_deg: expected at least one angle",
        ),
        (
            lambda m: towing_tank.static_drift(m, [200.0]),
            r"drift_deg\[0\]: expected .* got 200",
        ),
        (lambda m: towing_tank.pure_surge(m, 20.0), "amplitude: expected .* got 20"),
        (
            lambda m: towing_tank.pure_sway(m, 0.5, period_s=-1.0),
            "period_s: expected .* got -1",
        ),
        (lambda m: towing_tank.pure_yaw(m, 0.0), "amplitude_deg_s: expected .* got 0"),
        (
            lambda m: towing_tank.pure_sway(m, 0.5, tank=Tank(rudder_deg=80.0)),
            "tank rudder_deg: expected .* got 80",
        ),
        (
            lambda m: towing_tank.pure_sway(m, 0.5, tank=Tank(shaft_speed=1.0)),
            "has no shaft",
        ),
        (
            lambda m: towing_tank.pure_sway(m, 0.5, tank=Tank(water_depth=20.0)),
            "deep-water model",
        ),
        (lambda m: Tank(noise=-0.1), "tank noise: expected .* got -0.1"),
        (lambda m: Tank(samples=2), "tank samples: expected .* got 2"),
    ],
)
def test_wrong_arguments(mariner, call, message):
    with pytest.raises(InputError, match=message):
        call(mariner)


def test_the_track_is_the_integral_of_the_velocity():
    """Over a cycle of yaw with drift.

    Velocities turned by the heading, summed along the way.
    """
    mariner = load_model("mariner")
    trial = towing_tank.yaw_with_drift(
        mariner, 0.5, 8.0, period_s=200.0, tank=Tank(samples=400, cycles=1)
    )
    way = (trial["u"] + 1j * trial["v"]) * np.exp(1j * trial["psi"])
    track = cumulative_trapezoid(way, trial.t, initial=0.0)
    np.testing.assert_allclose(trial["x"] + 1j * trial["y"], track, atol=0.05)
    assert np.ptp(trial["y"]) > 50.0
    np.testing.assert_allclose(
        trial["psi"], cumulative_trapezoid(trial["r"], trial.t, initial=0.0), atol=1e-4
    )


@pytest.mark.parametrize(
    ("name", "beyond", "least"),
    [
        ("speed", 0.0, 0.1),
        ("shaft_speed", 0.0, 0.1),
        ("cycles", 0, 1),
        ("samples", 7, 8),
        ("noise", -0.1, 0.0),
        ("seed", -1, 0),
    ],
)
def test_tanks_that_cannot_be_are_refused(name, beyond, least):
    assert getattr(Tank(**{name: least}), name) == least
    with pytest.raises(InputError, match=rf"tank {name}: expected .* got"):
        Tank(**{name: beyond})


def test_motions_that_cannot_be_towed_are_refused(mariner):
    with pytest.raises(InputError, match=r"hold_s: expected .* got 0"):
        towing_tank.static_drift(mariner, [5.0], hold_s=0.0)
    with pytest.raises(InputError, match=r"drift_deg\[1\]: expected .* got 181"):
        towing_tank.static_drift(mariner, [5.0, 181.0])
    with pytest.raises(InputError, match="drift_deg: expected at least one angle"):
        towing_tank.static_drift(mariner, [])
    for motion in (towing_tank.pure_surge, towing_tank.pure_sway, towing_tank.pure_yaw):
        with pytest.raises(InputError, match=r"amplitude.*: expected .* got 0"):
            motion(mariner, 0.0)
        with pytest.raises(InputError, match=r"period_s: expected .* got 0"):
            motion(mariner, 0.1, 0.0)
