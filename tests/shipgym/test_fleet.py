"""Container ship, tanker and KVLCC2 against the MSS toolbox and the published form
(../shared/reference)."""

from dataclasses import replace

import numpy as np
import pytest

from shipgym import ShipModel, load_model, manoeuvres
from tests.shipgym.reference import table


def container_row(
    u, v, r, x, y, psi, p, phi, delta, n, delta_command, n_command, *rates
):
    """State, command and rates of a row in our order and units; the toolbox has rpm."""
    *others, p_dot, phi_dot, delta_dot, n_dot = rates
    u_dot, v_dot, r_dot, x_dot, y_dot, psi_dot = others
    expected = [
        x_dot,
        y_dot,
        psi_dot,
        u_dot,
        v_dot,
        r_dot,
        p_dot,
        phi_dot,
        delta_dot,
        n_dot / 60,
    ]
    return (
        [x, y, psi, u, v, r, p, phi, delta, n / 60],
        [delta_command, n_command / 60],
        expected,
    )


def tanker_row(u, v, r, x, y, psi, delta, n, delta_command, n_command, depth, *rates):
    """State, command, rates and depth; the toolbox's rudder is positive to port."""
    u_dot, v_dot, r_dot, x_dot, y_dot, psi_dot, delta_dot, n_dot = rates
    expected = [x_dot, y_dot, psi_dot, u_dot, v_dot, r_dot, -delta_dot, n_dot / 60]
    return (
        [x, y, psi, u, v, r, -delta, n / 60],
        [-delta_command, n_command / 60],
        expected,
        depth,
    )


# the second row has the shaft below 18 rpm
CONTAINER = [
    (
        4.98912279063591,
        0.499276421736138,
        0.0124865233043288,
        -1512.23620147254,
        -1593.25979789705,
        2.70724061535968,
        0.0282350866218125,
        -0.0196277776125746,
        -0.0294264178425493,
        89.3928954440687,
        0.0206866215710838,
        132.011090990532,
        0.0522655845034039,
        -0.0337535289578942,
        -0.00152473402831129,
        -4.73591374457325,
        1.6467082764659,
        0.0124841181671537,
        -0.00130972507509572,
        0.0282350866218125,
        0.0501130394136331,
        60 * (132.011090990532 - 89.3928954440687) / 60 * 89.3928954440687 / 60 / 5.65,
    ),
    (
        6.03864737066765,
        -1.17190450771868,
        0.0141814797445314,
        -1379.18367735636,
        1729.02652179201,
        2.93414957947155,
        0.0065406311244854,
        0.220820707496305,
        -0.0936365701931937,
        6.56571573036577,
        -0.0383203789495308,
        74.7684242817076,
        -0.0418590823735167,
        0.0167601016254026,
        -0.00223513914347979,
        -5.67368033089455,
        2.36264421453462,
        0.0138371253086416,
        -0.0183114865418724,
        0.00654063112448539,
        0.0553161912436629,
        (74.7684242817076 - 6.56571573036577) / 18.83,
    ),
]

# the second row is in very shallow water
TANKER = [
    (
        5.49030052638621,
        -1.07886084165628,
        0.00768227611108917,
        1103.40300035019,
        3155.05713923105,
        -0.994530324078971,
        -0.0114745500254942,
        75.1834116481104,
        0.00354929883767126,
        28.3938619639945,
        137.416143903219,
        -0.0099724741259201,
        0.00149895677989801,
        -8.6576090247494e-05,
        2.08701885021692,
        -5.1915019892643,
        0.00768227611108917,
        0.0150238488631654,
        -0.935790993682317,
    ),
    (
        6.57906119919723,
        0.57238095262376,
        0.00341485221161143,
        -1534.27179775906,
        -3147.93987782346,
        -1.62541611500054,
        0.50243669363863,
        41.2282820036695,
        0.50243669363863,
        84.8390609289674,
        40.7420054194697,
        -0.00121908731977836,
        -0.0111229872899441,
        -0.000465622175017064,
        0.212359085345544,
        -6.60049769612717,
        0.00341485221161143,
        -0.0406661715714679,
        0.77543435992661,
    ),
]


def weak(name):
    """A ship with 10 degrees of rudder at most."""
    model = load_model(name)
    return replace(model, steering=replace(model.steering, rudder_limit_deg=10.0))


@pytest.mark.parametrize("row", CONTAINER)
def test_quoted_rows_of_the_container_ship(row):
    state, command, expected = container_row(*row)
    np.testing.assert_allclose(
        weak("container").derivatives(state, command), expected, rtol=1e-10
    )


@pytest.mark.parametrize("row", TANKER)
def test_quoted_rows_of_the_tanker(row):
    state, command, expected, depth = tanker_row(*row)
    rates = weak("tanker").derivatives(state, command, water_depth=depth)
    np.testing.assert_allclose(rates, expected, rtol=1e-10)


MODEL_STATE = (
    1.28816006817002,
    0.0377516720983244,
    -0.0038618251898478,
    0.224888115042733,
)
SHIP_STATE = (
    3.3578867532232,
    0.114961926976131,
    0.00734564928274089,
    0.00772106236413008,
)


@pytest.mark.parametrize(
    ("ship", "state", "n", "expected"),
    [
        (
            "kvlcc2-l7",
            MODEL_STATE,
            10.8532517036481,
            (-0.00742457323619287, -0.00861722011006149, 0.00448031124716304),
        ),
        (
            "kvlcc2",
            SHIP_STATE,
            1.68450101953431,
            (0.0152436101539732, -0.00801784894791814, -0.000243699776273127),
        ),
    ],
)
def test_quoted_rows_of_kvlcc2(ship, state, n, expected):
    rates = load_model(ship).derivatives([0.0, 0.0, 0.0, *state], [state[-1], n])
    np.testing.assert_allclose(rates[3:6], expected, rtol=1e-10)


def test_all_rows_of_the_container_ship():
    for row in table("container_derivatives.csv"):
        state, command, expected = container_row(*list(row)[1:23])
        np.testing.assert_allclose(
            weak("container").derivatives(state, command), expected, rtol=1e-10
        )


def test_all_rows_of_the_tanker():
    for row in table("tanker_derivatives.csv"):
        state, command, expected, depth = tanker_row(*list(row)[1:20])
        rates = weak("tanker").derivatives(state, command, water_depth=depth)
        np.testing.assert_allclose(rates, expected, rtol=1e-10)


def test_all_rows_of_kvlcc2():
    for row in table("kvlcc2_derivatives.csv"):
        ship = load_model("kvlcc2" if row["is_full_scale"] else "kvlcc2-l7")
        state = [
            0.0,
            0.0,
            row["psi_rad"],
            row["u_m_s"],
            row["v_m_s"],
            row["r_rad_s"],
            row["delta_rad"],
        ]
        rates = ship.derivatives(state, [row["delta_rad"], row["n_rps"]])
        names = ("u_m_s2", "v_m_s2", "r_rad_s2")
        expected = [row[f"paperform_dot_{name}"] for name in names]
        np.testing.assert_allclose(rates[3:6], expected, rtol=1e-10)


COLUMNS = {
    "x": "x_m",
    "y": "y_m",
    "psi": "psi_rad",
    "u": "u_m_s",
    "v": "v_m_s",
    "r": "r_rad_s",
    "p": "p_rad_s",
    "phi": "phi_rad",
    "delta": "delta_rad",
}
DEEP = 1e6  # m, the depth of the tanker's reference runs
RUNS = {
    "container_turning_35": lambda: manoeuvres.turning_circle(
        weak("container"), 35, 1000
    ),
    "container_zigzag_10_10": lambda: manoeuvres.zigzag(
        weak("container"), 10, 10, duration=800, switch="step"
    ),
    "container_zigzag_20_20": lambda: manoeuvres.zigzag(
        weak("container"), 20, 20, duration=1000, switch="step"
    ),
    "tanker_turning_35": lambda: manoeuvres.turning_circle(
        weak("tanker"), 35, 1500, water_depth=DEEP
    ),
    "tanker_zigzag_10_10": lambda: manoeuvres.zigzag(
        weak("tanker"), 10, 10, duration=1000, switch="step", water_depth=DEEP
    ),
    "tanker_dmax35_zigzag_20_20": lambda: manoeuvres.zigzag(
        load_model("tanker"),
        20,
        20,
        duration=1000,
        switch="step",
        water_depth=DEEP,
    ),
    "kvlcc2_L7_paperform_turning_35": lambda: manoeuvres.turning_circle(
        load_model("kvlcc2-l7"), 35, 200, 0.02
    ),
    "kvlcc2_L7_paperform_zigzag_20_20": lambda: manoeuvres.zigzag(
        load_model("kvlcc2-l7"), 20, 20, duration=160, dt=0.02, switch="step"
    ),
}


@pytest.mark.parametrize("name", RUNS)
def test_trajectories_are_the_reference_s(name):
    expected, trial = table(f"{name}.csv"), RUNS[name]()
    sign = -1.0 if name.startswith("tanker") else 1.0
    for channel, column in COLUMNS.items():
        if channel in trial.channels:
            own = trial[channel][::5] * (sign if channel == "delta" else 1.0)
            span = np.ptp(expected[column])
            np.testing.assert_allclose(
                own, expected[column], rtol=0.0, atol=1e-6 * span
            )


@pytest.mark.parametrize(
    ("model", "rudder", "duration", "advance", "tactical"),
    [
        (load_model("container"), 35, 1000, 3.25, 4.09),
        (load_model("tanker"), 35, 1500, 3.24, 3.13),
        (load_model("kvlcc2-l7"), 35, 200, 3.08, 3.12),
        (load_model("kvlcc2-l7"), -35, 200, 3.09, 3.10),
    ],
    ids=lambda value: value.name if isinstance(value, ShipModel) else None,
)
def test_turning_circles(model, rudder, duration, advance, tactical):
    dt = model.particulars["length"] / model.particulars["speed"] / 300.0
    indices = manoeuvres.turning_indices(
        manoeuvres.turning_circle(model, rudder, duration, dt)
    )
    assert indices.advance_lengths == pytest.approx(advance, abs=0.01)
    assert indices.tactical_diameter_lengths == pytest.approx(tactical, abs=0.01)


def test_the_tanker_turns_wider_in_shallow_water():
    """At 30 m, starting from 7.588 m/s: advance 3.12 L, tactical diameter 3.22 L."""
    slow = replace(
        load_model("tanker"),
        particulars=replace(load_model("tanker").particulars, speed=7.588415331336),
    )
    shallow = manoeuvres.turning_indices(
        manoeuvres.turning_circle(slow, 35, 1500, water_depth=30.0)
    )
    assert shallow.advance_lengths == pytest.approx(3.12, abs=0.01)
    assert shallow.tactical_diameter_lengths == pytest.approx(3.22, abs=0.01)


@pytest.mark.parametrize("name", ["container", "tanker", "kvlcc2", "kvlcc2-l7"])
def test_the_service_state_is_steady_straight_running(name):
    model = load_model(name)
    rates = dict(
        zip(
            model.state_names,
            model.derivatives(model.service_state, model.service_command),
            strict=True,
        )
    )
    speed, length = model.particulars["speed"], model.particulars["length"]
    assert abs(rates["u"]) * length / speed**2 < 1e-5
    assert (
        abs(rates["r"]) * length**2 / speed**2 < 1e-2
    )  # the tanker's propeller pushes it to port


@pytest.mark.parametrize("name", ["container", "kvlcc2"])
def test_a_reference_ship_survives_its_file(name, tmp_path):
    model = load_model(name)
    model.save(tmp_path / "model.json")
    again = ShipModel.load(tmp_path / "model.json")
    np.testing.assert_array_equal(
        again.derivatives(model.service_state, model.service_command + 0.1),
        model.derivatives(model.service_state, model.service_command + 0.1),
    )
