"""Each structure finds itself back from trials of its own virtual ship."""

from __future__ import annotations

import numpy as np
import pytest

import shipgym
from identification import identify
from shipgym import Particulars, ShipModel, SteeringGear, Trial, list_structures
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.ships import get_structure, structures

L, U0, N0 = 160.93, 7.7175, 1.2
PARTICULARS = Particulars(length=L, speed=U0)  # accelerations need no mass
GEAR = SteeringGear(35.0, 5.0, 1.0)
OTHERS = (
    "abkowitz",
    "abkowitz-full",
    "surge",
    "surge-perturbed",
    "mmg4dof",
    "pmm38",
    "pmm18",
    "grey-box",
    "mmg",
)
STEERED = [name for name in list_structures() if name not in OTHERS]

LINEAR = {
    "b_v": -0.06,
    "b_r": -2.3,
    "b_d": -0.08,
    "c_v": -1e-3,
    "c_r": -0.104,
    "c_d": 3.7e-3,
}
SWAY = {"b_|v|v": -0.02, "b_|r|v": -3.0, "b_|v|r": -0.9, "b_|r|r": -60.0}
YAW = {"c_|v|v": -2e-4, "c_|r|v": -0.03, "c_|v|r": -0.03, "c_|r|r": -3.0}
PRIME = {
    "b_v": -0.693,
    "b_r": -0.304,
    "b_d": -0.207,
    "c_v": -3.41,
    "c_r": -3.6,
    "c_d": 1.63,
}
CUBIC = {
    "a_n2": 0.045,
    "a_nu": -0.02,
    "a_u2": -0.025,
    "a_v2": -0.3,
    "a_vr": 0.5,
    "a_r2": 0.02,
    "a_n2d2": -0.1,
    "b_n2": 0.0005,
    "b_Uv": -0.7,
    "b_Ur": -0.3,
    "b_v3/U": -4.0,
    "b_v2r/U": 1.0,
    "b_vr2/U": -1.0,
    "b_r3/U": 0.1,
    "b_n2d": -0.15,
    "b_nud": -0.05,
    "b_n2d3": 0.05,
    "c_n2": -0.002,
    "c_Uv": -3.0,
    "c_Ur": -2.2,
    "c_v3/U": 3.0,
    "c_v2r/U": -9.0,
    "c_vr2/U": -2.0,
    "c_r3/U": -0.5,
    "c_n2d": 1.1,
    "c_nud": 0.5,
    "c_n2d3": -0.4,
}


def own(name: str) -> dict[str, float]:
    """Coefficients of a ship of about the Mariner's manners."""
    known = {
        "nomoto": {"c_r": -1 / 30.0, "c_d": 0.05 / 30.0},
        # K = 0.185 1/s, T1 = 118 s, T2 = 7.8 s, T3 = 18.5 s: Mariner, Fossen 2011,
        # table 7.2
        "nomoto2": {
            "c_r": -1 / 118.0 - 1 / 7.8,
            "c_d": 0.185 * 18.5 / (118.0 * 7.8),
            "e_r": -1 / (118.0 * 7.8),
            "e_d": 0.185 / (118.0 * 7.8),
        },
        "norrbin": {"c_r": -1 / 30.0, "c_r3": -4000.0 / 30.0, "c_d": 0.05 / 30.0},
        "nomoto-bias": {"c_0": 1e-4, "c_r": -1 / 30.0, "c_d": 0.05 / 30.0},
        "norrbin-bias": {
            "c_0": 1e-4,
            "c_r": -1 / 30.0,
            "c_r3": -4000.0 / 30.0,
            "c_d": 0.05 / 30.0,
        },
        "linear-steering": PRIME,
        "linear": {"a_0": -2e-3, "a_du": -0.05, "b_0": 1e-3, "c_0": 5e-4} | PRIME,
        "cubic": CUBIC,
    }
    pool = LINEAR | SWAY | YAW
    return known.get(name) or {
        c: pool[c] for c in get_structure(name).coefficient_names
    }


def ship_of(name: str, coefficients: dict[str, float]) -> ShipModel:
    shaft = N0 if "n" in get_structure(name).command_names else 0.0
    return ShipModel(
        name, name, PARTICULARS, GEAR, coefficients, service_shaft_speed=shaft
    )


def recorded(run: Trial, name: str, every: int = 5, use: str = "fit") -> Trial:
    """What noiseless sensors record of a run: the shaft speed held, no orders."""
    names = {
        "n_command" if c == "n" else c: c
        for c in ("x", "y", "psi", "u", "v", "r", "delta", "n")
    }
    names |= {"n": "n"} if "n" in run.channels else {}
    channels = {
        channel: run[name][::every]
        for name, channel in names.items()
        if name in run.channels
    }
    return Trial(run.t[::every], channels, name=name, kind=run.kind, use=use)


def weaves(ship: ShipModel) -> list[Trial]:
    """The rudder to both sides in turn, twenty seconds on each: no loop to compile."""
    sides = np.repeat([1.0, -1.0] * 15, 200)
    runs = {}
    for angle, first in ((10, 1.0), (20, -1.0), (35, 1.0)):
        orders = np.full((len(sides), len(ship.command_names)), N0)
        orders[:, 0] = first * np.radians(angle) * sides
        runs[angle] = ship.simulate(orders, 0.1)
    return [recorded(run, f"weave_{angle}") for angle, run in runs.items()]


@pytest.mark.parametrize("name", STEERED)
def test_a_ship_of_each_structure_is_recovered(name: str) -> None:
    ship = ship_of(name, own(name))
    fit = identify(weaves(ship), name, particulars=PARTICULARS)
    assert fit.stable
    for coefficient, value in ship.coefficients.items():
        assert fit.coefficients[coefficient] == pytest.approx(value, rel=5e-4), (
            coefficient
        )
    assert all(
        np.degrees(trial["rmse"]["r"]) < 2e-4
        for trial in fit.metrics["trials"].values()
    )
    assert f"Coefficients of accelerations, {ship.table.normalisation}" in fit.summary()


def test_the_container_ship_is_predicted_by_four_terms_as_well_as_zhu_printed() -> None:
    """10/10 predicts 20/20; Zhu 2018 prints 0.0472 m2/s2 of sway, 0.0162 deg2/s2."""
    ship = shipgym.load_model("container")
    fit_to, predicted = (
        recorded(zigzag(ship, a, a, duration=600, dt=0.1), f"{a}", every=10)
        for a in (10, 20)
    )
    fit = identify(
        [fit_to, predicted.with_(use="validate")],
        "steering5",
        particulars=ship.particulars,
    )
    rmse = fit.metrics["trials"]["20"]["rmse"]
    assert rmse["v"] ** 2 < 0.0472
    assert np.degrees(rmse["r"]) ** 2 < 0.0162


def test_a_registered_table_is_identified_by_its_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(structures, "REGISTERED_STRUCTURES", {})
    shipgym.register_structure(
        "drag", {"u": "du, r^2", "r": "r, |r| r, delta"}, source="a user's own"
    )
    ship = ship_of(
        "drag",
        {"a_du": -0.01, "a_r2": -300.0, "c_r": -0.03, "c_|r|r": -3.0, "c_d": 2e-3},
    )
    fit = identify(weaves(ship), "drag", particulars=PARTICULARS)
    for coefficient, value in ship.coefficients.items():
        assert fit.coefficients[coefficient] == pytest.approx(value, rel=1e-4), (
            coefficient
        )


def test_full_third_order_holds_the_turn_of_an_unstable_ship() -> None:
    """The tanker, unstable on course: 0.3 deg of heading, 11 by the Mariner form."""
    ship = shipgym.load_model("tanker")
    travel = ship.particulars["length"] / ship.particulars["speed"]
    runs = [
        zigzag(
            ship,
            rudder,
            heading,
            port_first=port,
            duration=25 * travel,
            dt=0.05 * travel,
        )
        for rudder, heading, port in (
            (10, 10, False),
            (20, 20, True),
            (30, 10, False),
            (35, 20, True),
        )
    ]
    turn = turning_circle(ship, 25, duration=15 * travel, dt=0.05 * travel)
    trials = [run.with_(name=f"zigzag-{k}") for k, run in enumerate(runs)]
    trials.append(turn.with_(name="turn", use="validate"))
    missed = {}
    for structure in ("abkowitz", "abkowitz-full"):
        fit = identify(
            trials, structure, particulars=ship.particulars, steering=ship.steering
        )
        missed[structure] = np.degrees(fit.metrics["trials"]["turn"]["rmse"]["psi"])
    assert missed["abkowitz"] > 8.0
    assert missed["abkowitz-full"] < 1.0
