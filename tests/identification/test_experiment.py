"""Information adds up, and advised manoeuvres shrink what they promise to."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import shipgym
from identification import build_samples
from identification.design.experiment import (
    advise,
    standard_candidates,
)
from shipgym import (
    InputError,
    Particulars,
    ShipModel,
    SteeringGear,
    Trial,
    UnstableModelError,
)
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.ships import get_structure

PARTICULARS = Particulars(length=160.93, speed=7.7175)
COEFFICIENTS = {"c_r": -1 / 30.0, "c_r3": -4000.0 / 30.0, "c_d": 0.05 / 30.0}
SIGMA = 2e-5  # noise of the yaw rate, rad/s


@pytest.fixture(scope="module")
def ship() -> ShipModel:
    return ShipModel(
        "virtual", "norrbin", PARTICULARS, SteeringGear(35.0, 5.0, 1.0), COEFFICIENTS
    )


def recorded(run: Trial, name: str, seed: int = 0) -> Trial:
    channels = {c: run[c].copy() for c in ("x", "y", "psi", "u", "v", "r", "delta")}
    channels["r"] += SIGMA * np.random.default_rng(seed).standard_normal(len(run))
    return Trial(run.t, channels, name=name)


def gentle(ship: ShipModel, seed: int = 0) -> Trial:
    return recorded(zigzag(ship, 5, 5, duration=600, dt=0.5), "gentle", seed)


def test_the_advised_manoeuvre_really_shrinks_the_error_in_a_refit(
    ship: ShipModel,
) -> None:
    """A gentle zigzag hardly shows the cubic term; refits show which trial helps."""
    first = gentle(ship)
    times = {"duration": 600.0, "dt": 0.5}
    candidates = {
        "zigzag 5/5": partial(zigzag, rudder_deg=5.0, heading_deg=5.0, **times),
        "zigzag 20/20": partial(zigzag, rudder_deg=20.0, heading_deg=20.0, **times),
        "turning circle 10": partial(turning_circle, rudder_deg=10.0, **times),
    }
    advice = advise(ship, [first], candidates)
    assert advice.coefficient == "c_r3"

    def scatter(name: str) -> float:
        found = []
        for seed in range(12):
            runs = [
                gentle(ship, seed),
                recorded(candidates[name](ship), name, 100 + seed),
            ]
            samples = build_samples(
                runs, ship.table, PARTICULARS, "integral", 4, smoothing="none"
            )
            coefficients = np.linalg.lstsq(
                samples.features["r"], samples.targets["r"], rcond=None
            )[0]
            found.append(coefficients[1])
        return float(np.std(found))

    errors = {name: scatter(name) for name in candidates}
    assert advice.chosen == (min(errors, key=lambda name: errors[name]),)
    assert advice.after["c_r3"] < 0.2 * advice.before["c_r3"]


def test_advice_for_an_identified_mariner_of_forty_coefficients() -> None:
    mariner = shipgym.load_model("mariner")
    run = zigzag(mariner, 10, 10, duration=400, dt=0.5)
    trial = Trial(
        run.t,
        {c: run[c] for c in ("x", "y", "psi", "u", "v", "r", "delta")},
        name="10/10",
    )
    advice = advise(mariner, [trial], criterion="D")
    assert set(advice.before) == set(get_structure("abkowitz").coefficient_names)
    assert "zigzag 5/5" not in advice.chosen
    assert advice.trials[0].condition_number["r"] > 30.0
    assert set(advice.steps[0]) == set(standard_candidates(mariner))


def test_what_cannot_be_advised_is_named(ship: ShipModel) -> None:
    with pytest.raises(InputError, match="criterion"):
        advise(ship, [gentle(ship)], criterion="A")
    with pytest.raises(InputError, match=r"coefficient: .*'Y_v'"):
        advise(ship, [gentle(ship)], coefficient="Y_v")
    for criterion in ("D",):
        with pytest.raises(
            InputError,
            match=f"expected none with criterion '{criterion}', which is of all",
        ):
            advise(
                ship,
                [gentle(ship)],
                criterion=criterion,
                coefficient=next(iter(ship.coefficients)),
            )
    with pytest.raises(InputError, match="trials: expected those"):
        advise(ship, [])
    with pytest.raises(
        InputError,
        match=r"structure: expected a table of terms, .* got 'container'",
    ):
        advise(shipgym.load_model("container"), [gentle(ship)])


def test_candidates_that_no_ship_survives_are_refused(ship: ShipModel) -> None:
    def lost(model: ShipModel) -> Trial:
        raise UnstableModelError("lost", 1.0, {})

    with pytest.raises(
        InputError,
        match="candidates: expected one that model 'virtual' can simulate, got 1",
    ):
        advise(ship, [gentle(ship)], {"hard": lost})
    both = {"hard": lost, "gentle": gentle}
    assert list(advise(ship, [gentle(ship)], both).steps[0]) == ["gentle"]
    with pytest.raises(InputError, match="number: expected at least 1, got 0"):
        advise(ship, [gentle(ship)], number=0)
