"""Ships that coverage is counted on: `square_drag.py` and `inoue.py` of tests/ships."""

from dataclasses import replace

import numpy as np
import pytest

from shipgym import ShipModel, check_ship_model
from shipgym.manoeuvres import turning_circle, turning_indices, zigzag, zigzag_indices
from shipgym.manoeuvres.registry import standard_time
from shipgym.models.linear import is_course_stable, steering_state_space
from tests.ships.inoue import FERRY, INOUE_SHIPS, TANKER, hull
from tests.ships.square_drag import SQUARE_DRAG

SHIPS = {**SQUARE_DRAG, **INOUE_SHIPS}
STATE = {"u": 6.0, "v": 0.0, "r": 0.0, "delta": 0.0}


def rates(ship: ShipModel, **changed: float) -> dict[str, float]:
    """Accelerations at 6 m/s straight ahead but for the changes given."""
    state = {**STATE, "n": ship.service_shaft_speed, **changed}
    found = ship.rates({name: np.array([value]) for name, value in state.items()})
    return {name: float(values[0]) for name, values in found.items()}


@pytest.mark.parametrize("name", SHIPS)
def test_she_is_sound_and_manoeuvres_like_a_ship(name: str) -> None:
    ship = SHIPS[name]()
    found = check_ship_model(ship)
    assert found.problems == found.remarks == ()
    duration, dt = standard_time(ship)
    turn = turning_indices(turning_circle(ship, 35.0, duration, dt))
    first = [
        zigzag_indices(zigzag(ship, a, a, False, duration, dt)).overshoot_1_deg
        for a in (10.0, 20.0)
    ]
    assert 3.0 < turn.tactical_diameter_lengths < 5.5
    assert turn.advance_lengths < 4.5  # MSC.137(76)
    assert 3.0 < first[0] < 12.0
    assert 6.0 < first[1] < 25.0
    assert 0.3 < turn.steady_speed_ratio < 0.7
    assert 5.0 < turn.steady_drift_deg < 25.0


@pytest.mark.parametrize("name", SHIPS)
def test_port_is_the_mirror_image_of_starboard(name: str) -> None:
    ship = SHIPS[name]()
    assert check_ship_model(ship).asymmetry < 1e-12
    starboard, port = (
        zigzag(ship, 20.0, 20.0, first, 300.0, 0.5) for first in (False, True)
    )
    for channel, sign in {
        "x": 1,
        "y": -1,
        "psi": -1,
        "u": 1,
        "v": -1,
        "r": -1,
        "delta": -1,
    }.items():
        np.testing.assert_allclose(port[channel], sign * starboard[channel], atol=1e-8)


@pytest.mark.parametrize("name", SHIPS)
def test_she_keeps_her_service_speed_and_her_course(name: str) -> None:
    ship = SHIPS[name]()
    commands = [0.0, ship.service_shaft_speed][: len(ship.command_names)]
    ahead = ship.simulate(np.full((400, len(commands)), commands), 2.0)
    np.testing.assert_allclose(ahead["u"], ship.particulars["speed"], rtol=1e-9)
    assert not ahead["psi"].any()
    assert is_course_stable(ship)


@pytest.mark.parametrize("name", SHIPS)
def test_forces_have_the_signs_of_a_ship(name: str) -> None:
    ship = SHIPS[name]()
    yaw = 0.4 * 6.0 / ship.particulars["length"]
    still, drifting, turning = rates(ship), rates(ship, v=1.0), rates(ship, r=yaw)
    steered, together = rates(ship, delta=0.3), rates(ship, v=-1.0, r=yaw)
    assert (still["v"], still["r"]) == (0.0, 0.0)
    assert (
        drifting["v"] < 0.0 < steered["r"]
    )  # damped in sway; turned to starboard by starboard rudder
    assert drifting["r"] < 0.0  # the bow turns away from where she drifts
    assert turning["r"] < 0.0
    assert turning["v"] < 0.0  # thrown out of the turn
    assert steered["v"] < 0.0  # the stern, and the ship with it, to port at first
    for one in (steered, together):
        assert one["u"] < still["u"]


def test_hull_coefficients_are_those_of_the_formulas_by_hand() -> None:
    ferry, tanker = hull(FERRY), hull(TANKER)
    assert ferry["Y_v"] == pytest.approx(-(0.129852 + 0.135333), abs=1e-6)
    assert ferry["N_r"] == pytest.approx(-0.044640 + 0.006834, abs=1e-6)
    assert ferry["N_rar"] == pytest.approx(-0.0805 + 0.080448 - 0.033405, abs=1e-6)
    assert ferry["Y_vav"] == pytest.approx(0.048265 - 6.293 * 0.104160, abs=1e-6)
    assert tanker["N_vvr"] == pytest.approx(
        -6.0856 + 18.437622 - 18.518432 + 5.984338, abs=1e-5
    )
    assert tanker["N_vrr"] == pytest.approx(-0.0635 + 0.04414 * 0.308772, abs=1e-6)


def test_hull_forces_in_a_turn_are_the_sum_of_their_terms_in_si_units() -> None:
    """Without rudder the hull's force accelerates the ferry's mass and added mass."""
    ship = INOUE_SHIPS["ferry"]()
    bare = replace(ship, coefficients={**ship.coefficients, "A_R": 0.0})
    p, c, L, m = FERRY, hull(FERRY), 150.0, 1025.0 * 150.0 * 25.0 * 6.2 * 0.58
    u, v, r = 8.0, -1.0, 0.012
    U = float(np.hypot(u, v))
    Y = (
        U * (c["Y_v"] * v + c["Y_r"] * L * r)
        - c["Y_vav"]
        + (c["Y_var"] * v * r + c["Y_rar"] * L * r**2) * L
    )
    N = U * (c["N_v"] * v + c["N_r"] * L * r) + c["N_rar"] * (L * r) ** 2
    N += (c["N_vvr"] * L * r - c["N_vrr"] * (L * r) ** 2) / U
    force, added = 0.5 * 1025.0 * L * 6.2, 0.5 * 1025.0 * L**3
    found = rates(bare, u=u, v=v, r=r)
    vdot, rdot = found["v"], found["r"]
    sway = (
        (m - added * p["Y_vdot"]) * vdot
        - 2.0 * m * rdot
        + (m - added * p["X_udot"]) * u * r
    )
    inertia = m * ((0.25 * L) ** 2 + 2.0**2) - added * L**2 * p["N_rdot"]
    assert sway == pytest.approx(force * Y)
    assert inertia * rdot - 2.0 * m * (vdot + u * r) == pytest.approx(force * L * N)


@pytest.mark.parametrize("name", INOUE_SHIPS)
def test_thrust_falls_with_the_advance_ratio(name: str) -> None:
    """From the acceleration and the resistance: at rest, and by its slope at speed."""
    ship = INOUE_SHIPS[name]()
    c, L, n = ship.coefficients, ship.particulars["length"], ship.service_shaft_speed
    by_thrust = 0.5 * L * c["d"] / (c["screws"] * (1.0 - c["t_P"]) * n**2 * c["D"] ** 4)
    for u in (0.0, 3.0, 6.0):
        forward = (c["m"] + c["m_x"]) * L * rates(ship, u=u)["u"] + c["R"] * u * u
        advance_ratio = (1.0 - c["w_P"]) * u / (n * c["D"])
        assert by_thrust * forward == pytest.approx(c["K_0"] - 0.4 * advance_ratio)


def test_accelerations_with_square_drag_by_hand() -> None:
    ship = SQUARE_DRAG["lively-heavy"]()
    found = rates(ship, u=7.5, v=-1.5, r=0.03, delta=0.5)
    p = ship.particulars
    mass, inertia, v, r = p.mass_prime, p.inertia_prime, -1.5, 0.03 * 120.0
    Y = 7.5 * (-0.0190 * v - 0.0094 * r - 0.0036 * 7.5 * 0.5) + 0.060 * 2.25
    N = 7.5 * (-0.0068 * v - 0.0036 * r + 0.0018 * 7.5 * 0.5) - 0.0030 * 12.96
    X = -0.0165 * 5.4 - 0.0002 * 12.96 - 0.0008 * 7.5**2 * 0.25
    assert found["v"] == pytest.approx(Y / (120.0 * (mass - p["Y_vdot"])))
    assert found["r"] == pytest.approx(N / (120.0**2 * (inertia - p["N_rdot"])))
    assert found["u"] == pytest.approx(X / (120.0 * (mass - p["X_udot"])))


def test_variants_differ_in_stability_and_in_the_weight_of_the_squares() -> None:
    ships = {name: make() for name, make in SQUARE_DRAG.items()}
    slowest = {
        name: np.linalg.eigvals(steering_state_space(ship)[0]).real.max()
        for name, ship in ships.items()
    }
    assert (
        max(slowest["stable-light"], slowest["stable-heavy"])
        < 3.0 * slowest["lively-light"]
        < 0.0
    )
    for kind in ("stable", "lively"):
        assert slowest[f"{kind}-light"] == pytest.approx(
            slowest[f"{kind}-heavy"], rel=0.01
        )
        light, heavy = (
            rates(ships[f"{kind}-{weight}"], r=0.03) for weight in ("light", "heavy")
        )
        assert heavy["r"] < light["r"] < 0.0
