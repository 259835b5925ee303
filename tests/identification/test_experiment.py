"""Information adds up, and advised manoeuvres shrink what they promise to."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import shipgym
from identification import advise, build_samples
from shipgym import (
    InputError,
    Particulars,
    ShipModel,
    SteeringGear,
    Trial,
)
from shipgym.manoeuvres import turning_circle, zigzag

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


def test_what_cannot_be_advised_is_named(ship: ShipModel) -> None:
    with pytest.raises(InputError, match=r"coefficient: .*'Y_v'"):
        advise(ship, [gentle(ship)], coefficient="Y_v")
    with pytest.raises(InputError, match="trials: expected those"):
        advise(ship, [])
    with pytest.raises(
        InputError,
        match=r"structure: expected a table of terms, .* got 'container'",
    ):
        advise(shipgym.load_model("container"), [gentle(ship)])
