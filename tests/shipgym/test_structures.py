"""Tables of terms: the compiled accelerations, the regression features and the inertia
agree.
"""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import shipgym
from shipgym import InputError, Particulars, ShipModel, SteeringGear, list_structures
from shipgym.engine.motion import Motion, Ship
from shipgym.ships import Structure, Term, get_structure, structures

pytestmark = pytest.mark.interpreted

FORCES = {"normalisation": "prime", "quantity": "force"}

PRINTED = [name for name in list_structures() if name not in ("grey-box", "mmg")]
FREE = [name for name in PRINTED if not get_structure(name).captive]


def virtual_ship(name: str, **coefficients: float) -> ShipModel:
    """The Mariner's size and speed in a structure.

    Coefficients that are not given are 0.
    """
    table = get_structure(name)
    mariner = shipgym.load_model("mariner").particulars
    return ShipModel(
        name="virtual",
        structure=name,
        particulars=(
            mariner
            if table.quantity == "force"
            else Particulars(length=160.93, speed=7.7175)
        ),
        steering=SteeringGear(35.0, 5.0, 1.0),
        coefficients=dict.fromkeys(table.coefficient_names, 0.0) | coefficients,
        service_shaft_speed=1.2 if "n" in table.command_names else 0.0,
    )


@pytest.mark.parametrize("name", sorted(FREE))
def test_accelerations_of_every_structure_are_written_from_its_features(name):
    table = get_structure(name)
    random = np.random.default_rng(0)
    model = virtual_ship(name, **{c: random.normal() for c in table.coefficient_names})
    theta = table.numbers(
        model.coefficients, model.particulars, model.service_shaft_speed
    )
    state = {
        "u": 6.0,
        "v": -0.9,
        "r": -0.01,
        "p": 0.02,
        "phi": -0.1,
        "q": 1e-3,
        "delta": 0.2,
        "n": 1.1,
    }
    channels = {symbol: np.array([value]) for symbol, value in state.items()}
    expected, row = (
        {"u": 0.0, "v": 0.9 * 7.7175 / 160.93, "r": 0.01 * 7.7175 / 160.93},
        0,
    )
    for equation, terms in table.equations.items():
        features = table.features(
            equation, channels, model.particulars, model.service_shaft_speed
        )[0]
        expected[equation] = features @ theta[row : row + len(terms)]
        row += len(terms)
    u, v, r, delta = (float(channels[symbol][0]) for symbol in ("u", "v", "r", "delta"))
    expected["r"] += state["q"] if "q" in table.equations else 0.0
    motion = Motion(
        0.0, 0.0, 0.0, u, v, r, state["p"], state["phi"], state["q"], delta, 1.1
    )
    ship = Ship(
        160.93, 7.7175, 0.6, 0.1, 1.0, model.service_shaft_speed, np.inf, 7.7175
    )
    plain = model.compiled.functions["accelerations"]
    found = plain(motion, model.compiled.coefficients(*theta), ship)
    np.testing.assert_allclose(
        found, [expected.get(q, 0.0) for q in "uvrpq"], rtol=1e-12
    )


def test_nomoto_turns_at_the_rate_k_delta_after_some_time_constants():
    """T rdot + r = K delta, K = 0.031 1/s, T = 30.2487 s (Zhu 2018, Table 7.4.8)."""
    K, T = 0.031, 30.2487
    ship = virtual_ship("nomoto", c_r=-1.0 / T, c_d=K / T)
    start = [0.0, 0.0, 0.0, 7.0, 0.5, 0.0, 0.1]
    trial = ship.simulate(np.full((600, 1), 0.1), 0.5, start)
    np.testing.assert_allclose(
        trial["r"], K * 0.1 * (1.0 - np.exp(-trial.t / T)), rtol=1e-6, atol=1e-12
    )
    assert np.all(trial["u"] == 7.0)  # no surge: the speed stays
    np.testing.assert_allclose(
        trial["v"], 0.5 * np.exp(-trial.t * 7.7175 / 160.93), rtol=1e-6
    )
    assert np.all(
        ship.simulate(np.full((600, 1), 0.1), 0.5)["v"] == 0.0
    )  # no sway: no drift


def test_linear_steering_has_the_form_of_astrom_and_kallstrom():
    """The Mariner of Zhu 2018, equation A.9 and table 7.3.1, rudder turned positive to
    starboard.
    """
    a11, a12, a21, a22, b11, b21 = -0.693, -0.304, -3.41, -2.17, -0.207, 1.63
    ship = virtual_ship(
        "linear-steering", b_v=a11, b_r=a12, b_d=b11, c_v=a21, c_r=a22, c_d=b21
    )
    v, r, delta, U, L = 0.3, 0.004, 0.1, np.hypot(7.0, 0.3), 160.93
    expected = [
        a11 * v * U / L + a12 * r * U + b11 * delta * U**2 / L,
        a21 * v * U / L**2 + a22 * r * U / L + b21 * delta * U**2 / L**2,
    ]
    found = ship.derivatives([0.0, 0.0, 0.0, 7.0, v, r, delta], [delta])[3:6]
    np.testing.assert_allclose(found, [0.0, *expected], rtol=1e-12)


def test_surge_reaches_the_speed_at_which_thrust_meets_resistance():
    """From rest, and with the shaft astern, udot = -4e-4 |u| u + 0.0165 |n| n."""
    ship = virtual_ship("surge", **{"a_|u|u": -4e-4, "a_|n|n": 0.0165})
    speed = np.sqrt(0.0165 / 4e-4)
    ahead = ship.simulate(np.tile([0.0, 1.0], (4000, 1)), 0.5, np.zeros(7))
    np.testing.assert_allclose(
        ahead["u"], speed * np.tanh(np.sqrt(4e-4 * 0.0165) * ahead.t), rtol=1e-8
    )
    stop = ship.simulate(np.tile([0.0, -1.0], (40, 1)), 0.5)
    assert np.all(np.diff(stop["u"]) < 0.0)
    np.testing.assert_array_equal(ahead["psi"], 0.0)


def test_a_table_is_registered_in_a_line_and_saved_with_its_models(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(structures, "REGISTERED_STRUCTURES", {})
    table = shipgym.register_structure(
        "mine", {"v": "v, |v| v, delta", "r": "v, r, r^2 v/U, delta"}
    )
    assert (
        shipgym.register_structure(
            "mine", {"v": "v, |v| v, delta", "r": "v, r, r^2 v/U, delta"}
        )
        == table
    )
    ship = virtual_ship(
        "mine", **{"b_v": -0.05, "c_r": -0.1, "c_d": 0.002, "c_r2v/U": 0.1}
    )
    ship.save(tmp_path / "mine.json")
    monkeypatch.undo()
    with pytest.raises(InputError, match=r"structure: .* got 'mine'"):
        get_structure("mine")
    for elsewhere in (
        shipgym.load_model(tmp_path / "mine.json"),
        pickle.loads(pickle.dumps(ship)),
    ):
        assert elsewhere.simulate([[0.2]] * 20, 1.0)["r"][-1] > 0.0


@pytest.mark.parametrize(
    ("equations", "others", "message"),
    [
        ({"r": "r, delat"}, {}, "got 'delat' in 'delat'.*Did you mean 'delta'"),
        ({"r": "r,, delta"}, {}, "between two commas, got nothing"),
        ({"r": "r^10"}, {}, r"got 'r\^10'"),
        ({"r": "1/v"}, {}, "equations.r: term '1/v': power of 'v': expected"),
        ({"w": "u"}, {}, "some of 'u', 'v', 'r', 'p', 'q' in this order, got 'w'"),
        ({"r": "r, phi"}, {}, "an equation of roll 'p' where terms have roll"),
        ({"q": "r, delta"}, {}, "the memory 'q' of yaw with an equation 'r'"),
        ({"r": "r", "p": "p, phi"}, FORCES, "accelerations in a table with roll"),
        ({"r": "v r, r v"}, {}, "expected each term once, got 'rv' twice"),
        ({"r": ()}, {}, "expected 1 to 200 terms, got none"),
        ({"r": ["v", "r"]}, {}, "a formula in one text, or Terms, got 'v'"),
        ({"r": 3}, {}, "equations.r: expected formulas .* got 3"),
        ("r, delta", {}, "expected a table of keys and values"),
        ({"r": "U r"}, {"normalisation": "prime"}, "no 'U', which is 1 in the prime"),
        ({"r": "r"}, {"normalisation": "prim"}, "Did you mean 'prime'"),
        ({"r": "r"}, {"quantity": "force"}, "forces in the 'prime' or 'service' norm"),
        ({"v": "v", "r": "r"}, FORCES, "the same terms in the same order in 'v' and"),
        ({"r": "r"}, {"source": ""}, "source: expected a non-empty string"),
        ({"r": "r"}, {"name": "nomoto"}, "a new one, got 'nomoto', which is another"),
        ({"r": "r"}, {"name": "container"}, "got 'container', which is another"),
    ],
)
def test_a_table_that_cannot_be_is_refused(equations, others, message):
    with pytest.raises(InputError, match=message):
        shipgym.register_structure(**{"name": "mine", "equations": equations} | others)


def test_a_table_of_unknown_symbols_becomes_no_program():
    """The symbols of a table are looked up, whatever the names of its terms are."""
    named = Term("__import__('os')", (("r", 1),))
    table = Structure("mine", "own", {"r": (named,)}, "si", "acceleration")
    ship = ShipModel(
        "mine",
        "mine",
        Particulars(length=100.0, speed=5.0),
        SteeringGear(),
        {f"c_{named.name}": -0.1},
        dynamics=table,
    )
    rates = ship.derivatives([0.0, 0.0, 0.0, 5.0, 0.0, 0.2, 0.0], [0.0])
    assert rates[5] == pytest.approx(-0.02)
    with pytest.raises(InputError, match="expected symbols of 'u'"):
        replace(table, equations={"r": (Term("r", (("__class__", 1),)),)})


@pytest.mark.parametrize(
    "name", ["mariner", "container", "tanker", "kvlcc2-tanker-rm-svm", "kvlcc2-mmg"]
)
def test_accelerations_in_plain_python_are_those_that_are_compiled(name):
    """At a few states of a hard turn, for every shipped ship."""
    ship = shipgym.load_model(name)
    U0, length = ship.particulars["speed"], ship.particulars["length"]
    channels = {
        "u": U0 * np.array([0.9, 0.6, 0.4]),
        "v": U0 * np.array([-0.1, 0.2, 0.05]),
        "r": U0 / length * np.array([0.3, -0.6, 0.1]),
        "p": U0 / length * np.array([0.1, 0.0, -0.1]),
        "phi": np.array([0.05, -0.1, 0.0]),
        "q": (U0 / length) ** 2 * np.array([0.1, -0.2, 0.0]),
        "delta": np.array([0.3, -0.5, 0.1]),
        "n": np.full(3, ship.service_shaft_speed),
    }
    compiled = ship.rates(channels)
    for k in range(3):
        plain = ship.plain_rates({name: one[k] for name, one in channels.items()})
        for quantity in {"u", "v", "r", "p", "q", "n"} & compiled.keys():
            assert plain[quantity] == pytest.approx(
                compiled[quantity][k], rel=1e-9, abs=1e-12 * U0**2 / length
            )
