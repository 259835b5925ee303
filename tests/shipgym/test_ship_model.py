"""ShipModel: simulation, sampling, and its file."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import shipgym
from shipgym import InputError, ShipModel, UnstableModelError
from shipgym.models.simulate import open_loop
from shipgym.ships import Envelope


@pytest.fixture(scope="module")
def mariner() -> ShipModel:
    return shipgym.load_model("mariner")


@pytest.fixture
def identified(mariner) -> ShipModel:
    """A model with everything that an identified one has."""
    values = np.array(list(mariner.coefficients.values()))
    random = np.random.default_rng(1)
    root = (
        np.diag(np.abs(values))
        @ (np.eye(40) + 0.1 * random.standard_normal((40, 40)))
        * 0.05
    )
    samples = random.standard_normal((4, 500)) * [[0.5], [0.3], [0.005], [0.1]] + [
        [7],
        [0],
        [0],
        [0],
    ]
    return replace(
        mariner,
        covariance=root @ root.T,
        envelope=Envelope.from_samples(*samples),
        provenance={"method": "x"},
    )


def test_a_measured_rudder_reproduces_the_simulation(mariner):
    commands = np.repeat([[0.3], [-0.3], [0.1]], 400, axis=0)
    trial = mariner.simulate(commands, 0.1)
    again = open_loop(mariner, trial)
    for name in ("psi", "u", "v", "r"):
        np.testing.assert_allclose(
            again[name], trial[name], rtol=0.0, atol=2e-3 * np.ptp(trial[name])
        )


def test_a_runaway_model_is_an_error_with_time_and_state(mariner):
    wild = replace(
        mariner, coefficients={**mariner.coefficients, "N_r": 0.01, "N_vvr": 5.0}
    )
    with pytest.raises(UnstableModelError, match="runs away after") as caught:
        wild.simulate(np.full((5000, 1), 0.5), 0.1)
    assert 0.0 < caught.value.time_s < 500.0
    assert np.all(np.isfinite(list(caught.value.state.values())))


def test_draws_have_the_covariance(identified):
    draws = np.array(
        [list(model.coefficients.values()) for model in identified.sample(4000, seed=0)]
    )
    scale = np.sqrt(np.diag(identified.covariance))
    mean = np.array(list(identified.coefficients.values()))
    np.testing.assert_allclose((draws.mean(axis=0) - mean) / scale, 0.0, atol=0.08)
    difference = np.cov(draws.T) / np.outer(
        scale, scale
    ) - identified.covariance / np.outer(scale, scale)
    assert np.abs(difference).max() < 0.1
    again = identified.sample(2, seed=0)[1].coefficients
    np.testing.assert_allclose(list(again.values()), draws[1], rtol=1e-12)


def test_the_file_gives_the_model_back(identified, tmp_path):
    identified.save(tmp_path / "model.json")
    again = ShipModel.load(tmp_path / "model.json")
    assert again.coefficients == identified.coefficients
    assert dict(again.particulars) == dict(identified.particulars)
    assert again.steering == identified.steering
    assert again.provenance == identified.provenance
    np.testing.assert_array_equal(again.covariance, identified.covariance)
    np.testing.assert_array_equal(again.ship_numbers(), identified.ship_numbers())
    assert list(tmp_path.iterdir()) == [tmp_path / "model.json"]


def changed(*path, value):
    """A model file with another value in one place."""

    def apply(fields):
        place = fields
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value
        return json.dumps(fields)

    return apply


def without(*path):
    """A model file without one field."""

    def apply(fields):
        place = fields
        for key in path[:-1]:
            place = place[key]
        place.pop(path[-1])
        return json.dumps(fields)

    return apply


COVARIANCE = ("covariance", 3)
CASES = [
    (lambda fields: json.dumps(fields)[:5000], "broken JSON"),
    (without("coefficients", "Y_v"), "the 40 of its structure; missing: 'Y_v'"),
    (changed("coefficients", "Y_v", value="much"), r"coefficients\.Y_v: .* got 'much'"),
    (changed("format", value=7), "expected format 1"),
    (without("steering"), "field 'steering' is missing"),
    (changed("steering", "rudder_limit_deg", value=-5), "rudder_limit_deg: expected"),
    (without(*COVARIANCE), "covariance: expected a list of numbers, size 40 x 40"),
    (without(*COVARIANCE, 2), "covariance: expected a list of numbers, size 40 x 40"),
    (changed(*COVARIANCE, 2, value="1.0"), "covariance: expected a list of numbers"),
    (changed(*COVARIANCE, 2, value=1.0), "covariance: expected a symmetric matrix"),
    (changed(*COVARIANCE, 3, value=-1.0), "covariance: expected no negative variance"),
    (changed("envelope", "channels", value=["u"]), r"envelope\.channels: expected"),
    (changed("envelope", "low", value=[0, 1]), r"envelope\.low"),
    (changed("normalisation", value="bis"), "normalisation: expected one of 'prime'"),
    (changed("pickle", value="gASV"), "unknown key 'pickle'"),
    (changed("particulars", "length", value=-3), "length"),
    (without("particulars", "speed"), "speed is needed and not known"),
    (without("particulars", "mass"), "mass"),
    (changed("particulars", "estimated", value=3), "estimated: expected"),
    (changed("particulars", "N_vdot", value=0.9), "inertia"),
    (changed("structure", "quantity", value="power"), "quantity: expected"),
    (changed("structure", "equations", "w", value=[]), "unknown key 'w'"),
    (
        changed("structure", "equations", "u", 0, "powers", "w", value=1),
        "expected symbols of 'u', .* got 'w'",
    ),
    (lambda _: "[1, 2]", "expected a table"),
    (lambda _: "[" * 100_000, "expected at most 20 levels"),
]


@pytest.mark.parametrize(
    ("content", "message"), CASES, ids=[message for _, message in CASES]
)
def test_a_wrong_file_is_refused_by_field(identified, tmp_path, content, message):
    path = tmp_path / "model.json"
    identified.save(path)
    path.write_text(content(json.loads(path.read_text())))
    with pytest.raises(InputError, match=message) as caught:
        ShipModel.load(path)
    assert str(path) in str(caught.value)


def test_binary_and_missing_files_are_refused(tmp_path):
    (tmp_path / "model.json").write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match="binary content"):
        ShipModel.load(tmp_path / "model.json")
    with pytest.raises(InputError, match="no such model file"):
        shipgym.load_model(tmp_path / "other.json")


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 2 * np.pi), st.floats(0.2, 3.0), st.floats(0.01, 1.0))
def test_an_ellipsoid_holds_its_samples(angle, stretch, spread):
    random = np.random.default_rng(3)
    points = random.standard_normal((200, 4)) * [1.0, stretch, spread, 0.1]
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points[:, 1:3] = points[:, 1:3] @ turn
    envelope = Envelope.from_samples(*points.T)
    distances = envelope.distance(*points.T)
    assert distances.max() == pytest.approx(1.0)
    away = envelope.centre + 3.0 * (points[distances.argmax()] - envelope.centre)
    assert envelope.distance(*away) == pytest.approx(3.0)


def test_states_and_commands_that_are_none_are_refused():
    mariner, tanker = shipgym.load_model("mariner"), shipgym.load_model("tanker")
    state = mariner.service_state
    for states, commands, message in (
        (
            state[:-1],
            [0.0],
            r"state: expected shape \(..., 7\) for x, y, psi.* got \(6,\)",
        ),
        (0.0, [0.0], r"state: expected"),
        (
            state,
            [0.0, 0.0],
            r"command: expected shape \(..., 1\) for delta, got \(2,\)",
        ),
        (
            np.where(state > 0.0, np.inf, state),
            [0.0],
            "state: expected finite numbers",
        ),
        (
            state,
            [10.0],
            "command: row 0: expected a rudder in rad .not degrees. .* got 10",
        ),
    ):
        with pytest.raises(InputError, match=message):
            mariner.derivatives(states, commands)
    with pytest.raises(
        InputError,
        match=r"command: row 1: expected a shaft speed in 1/s \(not rpm\) .* got 80",
    ):
        tanker.derivatives(tanker.service_state, [[0.0, 1.0], [0.0, 80.0]])
    with pytest.raises(
        InputError, match=r"water_depth: expected more than the draught .* got 18 m"
    ):
        tanker.derivatives(tanker.service_state, tanker.service_command, 18.0)
    many = mariner.derivatives(np.tile(state, (2, 3, 1)), np.zeros((3, 1)))
    assert many.shape == (2, 3, 7)


def test_a_coefficient_that_is_changed_counts():
    model = shipgym.load_model("mariner")
    orders = np.full((50, 1), 0.2)
    before = model.simulate(orders, dt=1.0)["r"][-1]
    model.coefficients["N_r"] *= 2.0
    assert model.simulate(orders, dt=1.0)["r"][-1] != pytest.approx(before)
