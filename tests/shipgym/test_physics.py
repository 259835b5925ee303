"""What holds for every ship: symmetry, energy, invariance, scaling by Froude, order of
the integrator."""

from dataclasses import replace

import numpy as np
import pytest

import shipgym
from shipgym import Particulars, manoeuvres
from shipgym.models import converted_model
from shipgym.ships import Structure
from shipgym.ships.inertia import inertia

SHIPS = ("mariner", "container", "container-stiff", "tanker", "kvlcc2", "kvlcc2-l7")
MIRRORED = ("y", "psi", "v", "r", "p", "phi", "delta")


def ship_time(model):
    return model.particulars["length"] / model.particulars["speed"]


def symmetric(name):
    """The ship without what makes her sides differ: propeller walk, and KVLCC2's flow
    straightening."""
    model = shipgym.load_model(name)
    changes = {
        "mariner": {
            key: 0.0 for key in model.coefficients if key[:3] in ("Y_0", "N_0")
        },
        "container": {},
        "tanker": {"Y_T": 0.0, "N_T": 0.0},
        "kvlcc2": {"gamma_minus": 0.5, "gamma_plus": 0.5, "C_2_port": 1.6},
    }[
        (
            model.structure
            if model.structure in ("container", "tanker", "kvlcc2")
            else "mariner"
        )
    ]
    return replace(model, coefficients={**model.coefficients, **changes})


@pytest.mark.parametrize("name", SHIPS)
def test_port_mirrors_starboard_on_a_ship_that_is_symmetric(name):
    model = symmetric(name)
    dt = ship_time(model) / 50
    runs = [
        manoeuvres.zigzag(model, 20, 20, port, 500 * dt, dt, must_reverse=False)
        for port in (False, True)
    ]
    starboard, port = runs
    for channel, values in starboard.channels.items():
        if not channel.endswith("_command"):
            sign = -1.0 if channel in MIRRORED else 1.0
            atol = 1e-8 * max(np.ptp(values), 1e-12)
            np.testing.assert_allclose(
                port[channel], sign * values, rtol=1e-10, atol=atol, err_msg=channel
            )


@pytest.mark.parametrize("name", SHIPS)
def test_halving_the_step_divides_the_error_by_sixteen(name):
    """With a rudder that starts off amidships and stays there, so that the motion is
    smooth."""
    model = shipgym.load_model(name)
    start = model.service_state.copy()
    start[model.state_names.index("delta")] = 0.05
    compared = [c for c in model.state_names if c not in ("x", "y", "n", "delta")]
    scale = {
        "u": model.particulars["speed"],
        "v": model.particulars["speed"],
        "psi": 1.0,
        "phi": 1.0,
    }

    def end(steps):
        dt = ship_time(model) / steps
        orders = np.repeat(model.service_command[None], 3 * steps, axis=0)
        orders[:, 0] = 0.05
        trial = model.simulate(orders, dt, start)
        return np.array(
            [trial[c][-1] / scale.get(c, 1.0 / ship_time(model)) for c in compared]
        )

    exact = end(512)
    ratio = np.linalg.norm(end(16) - exact) / np.linalg.norm(end(32) - exact)
    assert 12.0 < ratio < 24.0


def kinetic_energy(model, trial):
    """Of ship and entrained water: half of nu' M nu, with the symmetric part of M."""
    mass = inertia(model)
    nu = np.array([trial[name] for name in "uvr"])
    energy = 0.5 * np.einsum("in,ij,jn->n", nu, mass[:3, :3], nu)
    if "p" in trial.channels:
        numbers, p = model.coefficients, model.particulars
        unit = 0.5 * p["water_density"] * p["length"] ** 3
        roll = (numbers["Ix"] + numbers["Jx"]) * unit * p["length"] ** 2
        righting = 9.81 * p["water_density"] * 21222.0 * 0.3
        energy += mass[1, 3] * trial["v"] * trial["p"] + 0.5 * roll * trial["p"] ** 2
        energy += 0.5 * righting * trial["phi"] ** 2
    return energy


@pytest.mark.parametrize("name", ["container", "tanker", "kvlcc2"])
@pytest.mark.parametrize(("drift_deg", "turn"), [(-15.0, 0.3), (0.0, 0.0), (10.0, 0.3)])
def test_a_ship_without_thrust_loses_energy(name, drift_deg, turn):
    """From straight, drifting and turning states with the shaft at rest; heeling counts
    as stored energy."""
    model = shipgym.load_model(name)
    speed, angle = model.particulars["speed"], np.radians(drift_deg)
    values = {
        "u": speed * np.cos(angle),
        "v": -speed * np.sin(angle),
        "r": turn / ship_time(model),
    }
    start = np.array([values.get(state, 0.0) for state in model.state_names])
    dt = ship_time(model) / 100
    trial = model.simulate(np.zeros((1000, 2)), dt, start)
    energy = kinetic_energy(model, trial)
    assert np.diff(energy).max() < 1e-9 * energy[0]
    assert energy[-1] < 0.7 * energy[0]


@pytest.mark.parametrize(
    "name",
    [
        name
        for name in SHIPS
        if isinstance(shipgym.load_model(name).dynamics, Structure)
    ],
)
@pytest.mark.parametrize("size", [1 / 23.0])
def test_a_ship_scaled_by_froude_sails_the_same_track_in_ship_lengths(name, size):
    """Speeds and times go with the root of the length."""
    ship = shipgym.load_model(name)
    particulars = Particulars(
        length=ship.particulars["length"] * size,
        speed=ship.particulars["speed"] * np.sqrt(size),
    )
    gear = replace(
        ship.steering,
        rudder_rate_deg_s=ship.steering.rudder_rate_deg_s / np.sqrt(size),
        time_constant=ship.steering.time_constant * np.sqrt(size),
    )
    other = converted_model(ship, particulars, gear, ship.service_shaft_speed)
    one = manoeuvres.turning_circle(ship, 35, 400.0, 0.5)
    two = manoeuvres.turning_circle(
        other, 35, 400.0 * np.sqrt(size), 0.5 * np.sqrt(size)
    )
    np.testing.assert_allclose(two["psi"], one["psi"], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(two["x"] / size, one["x"], rtol=1e-8, atol=1e-6)
    np.testing.assert_allclose(two["u"] / np.sqrt(size), one["u"], rtol=1e-9)


def test_inertia_of_each_ship_is_that_of_her_source():
    """KVLCC2 of Yasukawa & Yoshimura 2015, S175 of Son & Nomoto 1981, the Esso tanker
    in 37 m; by hand."""
    mass, added = 312.6e6, 0.5 * 1000.0 * 320.0**2 * 20.8
    yaw = mass * (80.0**2 + 11.2**2)
    expected = np.array(
        [
            [mass + 0.022 * added, 0.0, 0.0, 0.0],
            [0.0, mass + 0.223 * added, mass * 11.2, 0.0],
            [0.0, mass * 11.2, yaw + 0.011 * added * 320.0**2, 0.0],
        ]
    )
    kvlcc2 = shipgym.load_model("kvlcc2")
    np.testing.assert_allclose(inertia(kvlcc2)[:3], expected)

    unit, L = 0.5 * 1025.0 * 175.0**3, 175.0
    container = shipgym.load_model("container")
    found = inertia(container) / unit
    assert found[0, 0] == pytest.approx(0.00792 + 0.000238)
    assert found[1] == pytest.approx(
        [0.0, 0.00792 + 0.007049, 0.007049 * 0.05 * L, -0.007049 * 0.0313 * L]
    )
    assert found[2] == pytest.approx(
        [0.0, 0.007049 * 0.05 * L, (0.000456 + 0.000419) * L**2, 0.0]
    )

    tanker = shipgym.load_model("tanker")
    shallow = 18.46 / (37.0 - 18.46)
    in_tons = np.diag(inertia(tanker, 37.0)[:3, :3]) / 225.5e6
    yaw = (0.1232 + 0.0045 * shallow) * 304.8**2
    np.testing.assert_allclose(
        in_tons, [1.05 + 0.05 * shallow, 2.02 + 0.387 * shallow, yaw]
    )
