"""The MMG form: its equations, its priors, and what trials tell of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from identification import (
    IdentificationResult,
    TruncatedLSSVM,
    identify,
)
from identification.models.maximum_a_posteriori import mmg_prior, reference_coefficients
from shipgym import InputError, Particulars, ShipModel, Trial
from shipgym.engine.motion import Motion, Ship
from shipgym.manoeuvres import turning_circle, turning_indices
from shipgym.models import load_model
from shipgym.ships import container, kvlcc2, mmg
from shipgym.ships.particulars import ADDED_MASSES
from tests.ships.mmg import MMG_SHIPS, mmg_ship

L7 = mmg.SHIP.particulars


def ship_of(changes: Mapping[str, float], particulars: Particulars = L7) -> ShipModel:
    """KVLCC2 in the general form, some coefficients changed."""
    known = mmg.standard_form(
        kvlcc2.SHIP.coefficients, 1.179, kvlcc2.SHIP.service_shaft_speed
    )
    return ShipModel(
        "mmg",
        "mmg",
        particulars,
        mmg.SHIP.steering,
        known | dict(changes),
        service_shaft_speed=kvlcc2.SHIP.service_shaft_speed,
    )


def at(model: ShipModel, motion: Motion) -> np.ndarray:
    """Accelerations by the plain functions."""
    length, speed = model.particulars.length, model.particulars["speed"]
    ship = Ship(
        length, speed, 0.6, 0.3, 0.0, model.service_shaft_speed, math.inf, speed
    )
    numbers = mmg.Coefficients(
        *model.dynamics.numbers(model.coefficients, model.particulars).tolist()
    )
    return np.array(mmg.accelerations(motion, numbers, ship)[:3])


def motions(count: int = 200) -> list[Motion]:
    """States of hard manoeuvres."""
    random, found = np.random.default_rng(0), []
    for _ in range(count):
        u = 1.179 * random.uniform(0.2, 1.1)
        v, r = 0.3 * u * random.uniform(-1, 1), 0.8 * u / 7.0 * random.uniform(-1, 1)
        delta, n = random.uniform(-0.6, 0.6), 11.85 * random.uniform(0.5, 1.2)
        found.append(Motion(0.0, 0.0, 0.0, u, v, r, 0.0, 0.0, 0.0, delta, n))
    return found


def test_terms_beyond_the_standard_form_act_as_they_are_named() -> None:
    motion = Motion(0.0, 0.0, 0.0, 0.7, -0.15, 0.07, 0.0, 0.0, 0.0, 0.4, 11.85)
    mirrored = motion._replace(v=-motion.v, r=-motion.r, delta=-motion.delta)
    plain = at(ship_of({}), motion)
    helm = at(ship_of({"delta_0": 0.1}), motion._replace(delta=0.3))
    np.testing.assert_allclose(helm, plain, rtol=1e-12)
    assert (
        at(ship_of({"c_R": 0.8}), motion)[2] > plain[2]
    )  # a stronger rudder to starboard
    slower = at(ship_of({"speed_power": 0.5}), motion)[2] - plain[2]
    speed = math.hypot(motion.u, motion.v) / 1.179
    less = (
        at(ship_of({"Y_r": 0.083 * speed**0.5, "N_r": -0.049 * speed**0.5}), motion)[2]
        - plain[2]
    )
    assert slower == pytest.approx(less, rel=1e-9)
    sides = {"C_2_side": 0.0, "gamma_R_side": 0.0}
    for name in (
        "N_absr",
        "N_rr",
        "Y_0",
        "N_0",
    ):  # even in r: without them port and starboard are alike
        ship = ship_of(sides | {name: 0.01})
        assert np.abs(at(ship, motion) - at(ship, mirrored) * [1, -1, -1])[2] > 1e-4
    alike = at(ship_of(sides), motion) - at(ship_of(sides), mirrored) * [1, -1, -1]
    np.testing.assert_allclose(alike, 0.0, atol=1e-15)


def test_formulas_give_about_what_was_measured_of_kvlcc2() -> None:
    """Zhou's added mass is the published one; the hull's derivatives are near."""
    estimated = frozenset(ADDED_MASSES)
    prior = mmg_prior(
        "yoshimura",
        replace(L7, rudder_area=None, rudder_aspect_ratio=None, estimated=estimated),
    )
    mean, own = prior.mean, ship_of({}).coefficients
    assert [round(mean[name], 3) for name in ("my", "Jz")] == [own["my"], own["Jz"]]
    assert mean["mx"] == pytest.approx(own["mx"], abs=0.002)
    for name, within in (
        ("Y_v", 0.1),
        ("Y_r", 0.02),
        ("Y_vvv", 0.15),
        ("N_v", 0.01),
        ("N_r", 0.005),
        ("N_rrr", 0.01),
    ):
        assert mean[name] == pytest.approx(own[name], abs=within)
    assert mean["f_alpha"] == pytest.approx(2.747, abs=0.5)
    assert prior.ship.estimated >= {"rudder_area", "rudder_aspect_ratio"}
    assert not prior.remarks
    heavy = mmg_prior(
        "yoshimura", replace(L7, Y_vdot=-0.02, estimated=estimated - {"Y_vdot"})
    ).mean  # given, not estimated
    assert (heavy["my"], heavy["mx"]) == pytest.approx((0.02 * 7.0 / 0.46, mean["mx"]))
    ahead = Motion(0.0, 0.0, 0.0, 1.179, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 11.85159)
    for source in (
        "yoshimura",
        "kvlcc2-l7",
    ):  # at service speed thrust balances resistance
        found = mmg_prior(source, L7)
        assert at(ship_of(found.mean, found.ship), ahead)[0] == pytest.approx(
            0.0, abs=1e-12
        )


def test_formulas_claim_no_more_than_published_ships_bear_out() -> None:
    """Deviations are at least the rms of published coefficients less the formula's."""
    ships = [load_model("kvlcc2-l7"), *map(mmg_ship, MMG_SHIPS)]
    forms = [(ship.particulars, reference_coefficients(ship)) for ship in ships]
    s175 = load_model(
        "container"
    )  # by rho L^2 / 2; her rudder straightens the flow by another law
    own, by_draught = (
        s175.coefficients,
        s175.particulars.length / s175.particulars.require("draught"),
    )
    hull_terms = {
        name
        for name in own
        if name in mmg.IDENTIFIED and (name[1] == "_" or name[0] in "mJ")
    }
    rudder_terms = {"a_H", "x_H", "epsilon", "kappa"}
    form = {name: by_draught * own[name] for name in hull_terms - rudder_terms}
    form |= {name: own[name] for name in rudder_terms}
    form |= {
        "R_0": -by_draught * own["X_uu"],
        "w_P0": own["wp"],
        "t_R": 1.0 - own["c_RX"],
    }
    form["f_alpha"] = 6.13 * container.ASPECT_RATIO / (2.25 + container.ASPECT_RATIO)
    forms.append((s175.particulars, form))
    priors = [
        mmg_prior("yoshimura", replace(ship, **dict.fromkeys(ADDED_MASSES)))
        for ship, _ in forms
    ]
    for k, name in enumerate(mmg.IDENTIFIED):
        apart = [
            form[name] - prior.mean[name]
            for (_, form), prior in zip(forms, priors, strict=True)
            if name in form
        ]
        assert np.sqrt(np.mean(np.square(apart))) <= priors[0].deviation[k], name


TRUTH = {
    "Y_v": -0.33,
    "N_r": -0.046,
    "N_v": -0.125,
    "thrust": 0.9,
    "c_R": 0.6,
    "delta_0": 0.01,
    "kappa": 0.55,
    "R_0": 0.02,
    "speed_power": 0.3,
    "N_vvr": -0.33,
    "l_R": -0.75,
    "gamma_R": 0.55,
}


def sailed(ship: ShipModel, rudder_deg: float, leg_s: float, seed: int) -> Trial:
    """Rudder reversed at intervals, as in a zigzag, with noise of a model basin."""
    steps = np.arange(1000)
    order = np.radians(rudder_deg) * np.where(
        steps // round(leg_s / 0.15) % 2 == 0, 1.0, -1.0
    )
    order[:20] = 0.0
    run = ship.simulate(
        np.column_stack([order, np.full(len(steps), ship.service_shaft_speed)]), 0.15
    )
    random = np.random.default_rng(seed)
    noise = {"u": 0.003, "v": 0.003, "r": 3e-4, "psi": 1e-3, "delta": 0.0, "n": 0.0}
    channels = {
        c: run[c] + s * random.standard_normal(len(run)) for c, s in noise.items()
    }
    return Trial(run.t, channels, name=f"rudder {rudder_deg:g}")


@pytest.fixture(scope="module")
def fitted() -> tuple[ShipModel, IdentificationResult]:
    ship = ship_of(TRUTH)
    trials = [
        sailed(ship, *run, seed)
        for seed, run in enumerate([(10, 12), (20, 9), (30, 8)])
    ]
    turn = sailed(ship, 35.0, 1000.0, 9).with_(name="turn", use="validate")
    arguments: dict[str, Any] = {
        "particulars": L7,
        "steering": ship.steering,
        "prior": "kvlcc2-l7",
    }
    return ship, identify([*trials, turn], "mmg", **arguments)


def test_coefficients_are_recovered_within_their_errors(
    fitted: tuple[ShipModel, IdentificationResult],
) -> None:
    ship, found = fitted
    errors = found.standard_errors
    off = np.array(
        [
            (found.coefficients[c] - ship.coefficients[c]) / errors[c]
            for c in mmg.IDENTIFIED
        ]
    )
    assert np.mean(np.abs(off) < 1.96) > 0.9
    assert np.abs(off).max() < 3.0
    for name in (
        "thrust",
        "R_0",
        "kappa",
    ):  # what the trials tell better than the prior
        assert abs(found.coefficients[name] - TRUTH[name]) < 0.6 * abs(
            mmg.SHIP.coefficients[name] - TRUTH[name]
        )
    assert (
        np.degrees(found.metrics["trials"]["turn"]["rmse"]["psi"]) < 6.0
    )  # of 600 deg
    assert found.stable
    assert [errors[name] for name in mmg.KNOWN] == [0.0] * len(mmg.KNOWN)
    provenance = found.model.provenance or {}
    assert (provenance["method"], provenance["prior"]) == ("map", "kvlcc2-l7")
    assert set(provenance["errors_held_out"]) == {"1", "2", "3"}


def test_models_drawn_hold_the_turn_that_no_trial_shows(
    fitted: tuple[ShipModel, IdentificationResult],
) -> None:
    ship, found = fitted
    truth, *drawn = (
        turn_lengths(model) for model in (ship, *found.model.sample(40, 0))
    )
    low, high = np.percentile(drawn, [2.5, 97.5], axis=0)
    assert np.all((low < truth) & (truth < high))
    assert np.all((high - low) / truth < 0.25)  # and say something


def turn_lengths(model: ShipModel) -> tuple[float, float]:
    """Advance and tactical diameter of a 35 deg turn, ship lengths."""
    travel = model.particulars.length / model.particulars["speed"]
    found = turning_indices(
        turning_circle(model, 35.0, duration=20 * travel, dt=0.05 * travel), 7.0
    )
    assert found.advance_lengths is not None
    assert found.tactical_diameter_lengths is not None
    return found.advance_lengths, found.tactical_diameter_lengths


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "ls"}, r"method: .*'mmg'.*'ls'"),
        ({"method": TruncatedLSSVM(rank=3)}, r"method: .*'mmg'.*'tls-svm'"),
        ({"reference_model": "kvlcc2"}, r"reference_model: .*'mmg'.*'kvlcc2'"),
        (
            {"prior": "mariner"},
            r"expected a ship in the MMG form, .* got 'mariner'",
        ),
        ({"prior": "clarke"}, r"'clarke'"),
    ],
)
def test_options_it_does_not_have(options: dict[str, Any], message: str) -> None:
    trial = sailed(ship_of({}), 20.0, 9.0, 0)
    with pytest.raises(InputError, match=message):
        identify([trial], "mmg", particulars=L7, steering=mmg.SHIP.steering, **options)
