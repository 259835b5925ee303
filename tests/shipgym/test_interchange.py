"""To other libraries and back: nothing is lost, and their own programs say the same."""

import json
import re

import gymnasium
import numpy as np
import pandas
import pytest

import shipgym
from shipgym import Episode, InputError, Trial, interchange, load_model
from shipgym.envs.ship_env import ShipEnv
from shipgym.interchange import minari_datasets
from shipgym.ships.catalogue import kvlcc2_l7

TRIAL = Trial(
    [0.0, 0.1, 0.3],
    {"psi": [0.0, 0.1, 0.3], "delta": [0.1, 1 / 3, 0.0]},
    name="a",
    kind="zigzag",
    use="validate",
    derived=["psi"],
    length=7.0,
    repaired={"psi": 1},
    notes=["one", "two"],
)
FACTS = (
    "name",
    "kind",
    "use",
    "derived",
    "length",
    "repaired",
    "over_ground",
    "notes",
    "sha256",
)
CARD = {
    "author": "a",
    "author_email": "b",
    "code_permalink": "c",
    "description": "d",
    "algorithm_name": "e",
}


@pytest.fixture(scope="module")
def episodes(tmp_path_factory):
    """Two of one environment, the second one cut off and begun without a seed of its own."""
    folder = tmp_path_factory.mktemp("recorded")
    env = shipgym.RecordEpisode(
        gymnasium.make("shipgym/CourseKeeping-v0", max_episode_steps=5), folder
    )
    for seed, steps in ((3, 5), (None, 2)):
        env.reset(seed=seed)
        for k in range(steps):
            env.step(np.array([0.1 * k], dtype=np.float32))
    env.close()
    return [Episode.load(path) for path in sorted(folder.glob("*.json"))]


def same(one, other):
    return json.dumps(content(one)) == json.dumps(content(other))


def content(episode):
    from shipgym.envs.episode_file import to_file

    return to_file(vars(episode))


@pytest.mark.parametrize("form", ["frame", "xarray"])
def test_trials_and_episodes_come_back_from_frames_and_datasets(form, episodes):
    there, back = (
        getattr(interchange, f"to_{form}"),
        getattr(interchange, f"from_{form}"),
    )
    trial = back(there(TRIAL))
    assert [getattr(trial, name) for name in FACTS] == [
        getattr(TRIAL, name) for name in FACTS
    ]
    assert all(same(one, back(there(one))) for one in episodes)


def test_a_frame_says_what_it_holds_in_parquet_too(tmp_path, episodes):
    interchange.to_frame(episodes[0]).to_parquet(tmp_path / "episode.parquet")
    frame = pandas.read_parquet(tmp_path / "episode.parquet")
    assert same(interchange.from_frame(frame), episodes[0])
    assert frame.index.tolist() == episodes[0].t.tolist()
    assert np.isnan(frame["rewards"].iloc[-1])
    assert frame["rewards"].sum() == pytest.approx(episodes[0].rewards.sum())


def test_a_dataset_has_units():
    dataset = interchange.to_xarray(TRIAL)
    assert (dataset["psi"].units, dataset["t"].units) == ("rad", "s")


def test_a_frame_of_something_else_is_refused():
    with pytest.raises(
        InputError,
        match=r"none of shipgym's found; Trial\.from_frame reads that of a log",
    ):
        interchange.from_frame(pandas.DataFrame({"psi": [0.0, 1.0]}))


def test_minari_has_the_observations_and_gives_the_episodes_back(
    tmp_path, monkeypatch, episodes
):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    closed, close = [], ShipEnv.close
    monkeypatch.setattr(ShipEnv, "close", lambda env: closed.append(env) or close(env))
    dataset = interchange.to_minari(episodes, "shipgym/mariner/test-v0", **CARD)
    assert len(closed) == 1
    assert [len(one) for one in dataset] == [5, 2]
    assert dataset[0].observations.shape == (6, *dataset.observation_space.shape)
    env = dataset.recover_environment()
    assert dataset[0].observations[0] == pytest.approx(env.reset(seed=3)[0])
    assert (dataset[0].truncations.tolist(), dataset[1].terminations.any()) == (
        [False] * 4 + [True],
        False,
    )
    assert all(map(same, interchange.from_minari(dataset), episodes))
    env.close()


def test_an_episode_that_ran_otherwise_is_no_dataset(tmp_path, monkeypatch, episodes):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    other = Episode(**(vars(episodes[0]) | {"rewards": episodes[0].rewards - 1.0}))
    with pytest.raises(
        InputError, match=r"episodes\[0\]: cost .* when run again"
    ) as refused:
        interchange.to_minari([other], "shipgym/mariner/other-v0", **CARD)
    again, recorded = (
        float(word) for word in re.findall(r" (-?[\d.]+) ", str(refused.value))
    )
    assert again == pytest.approx(-episodes[0].rewards.sum(), rel=1e-4)
    assert recorded == pytest.approx(again + episodes[0].n_steps, rel=1e-4)
    unknown = Episode(**(vars(episodes[0]) | {"seed": None}))
    with pytest.raises(InputError, match=r"episodes\[1\]: no seed found"):
        interchange.to_minari(
            [episodes[0], unknown], "shipgym/mariner/other-v0", **CARD
        )
    longer = Episode(**(vars(episodes[0]) | {"arguments": {"max_episode_steps": 9}}))
    for several in ([], [episodes[0], longer]):
        with pytest.raises(
            InputError,
            match=f"of {len(several)} environments found, expected all of one",
        ):
            interchange.to_minari(several, "shipgym/mariner/other-v0", **CARD)


@pytest.mark.parametrize("name", ["mariner", "mariner-tls-svm", "container"])
def test_parameters_of_mss_come_back(name):
    model = load_model(name)
    back = interchange.from_mss(json.loads(json.dumps(interchange.to_mss(model))))
    assert dict(back.coefficients) == pytest.approx(dict(model.coefficients))
    assert (back.steering, back.structure) == (model.steering, model.structure)
    for known in ("length", "mass", "xg", "yaw_gyradius", "speed", "Y_vdot", "N_rdot"):
        assert back.particulars[known] == pytest.approx(model.particulars[known])


def test_parameters_have_the_names_and_signs_of_the_files_of_mss():
    mariner, container = (
        interchange.to_mss(load_model(name)) for name in ("mariner", "container")
    )
    named = {
        "m": 798e-5,
        "Iz": 39.2e-5,
        "xG": -0.023,
        "Nvdot": 4.646e-5,
        "Xrv": 798e-5,
        "Yvu": -1160e-5,
        "Nd": -139e-5,
        "Yvvd": 1190e-5,
        "Xudd": -190e-5,
        "N0uu": 3e-5,
        "U0": 7.7175,
    }
    assert {key: mariner[key] for key in named} == pytest.approx(named)
    rolling = {
        "Xphiphi": -0.00020,
        "Yvvphi": 0.04605,
        "Krphiphi": 0.00003569,
        "kk": 0.631,
        "cRrrv": 1.96,
        "alphay": 0.05,
        "ga": 0.088,
    }
    assert {key: container[key] for key in rolling} == rolling


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"Nvd": 1.0}, "MSS parameters: unknown key 'Nvd'"),
        ({"Nd": "much"}, "MSS parameters: Nd: expected a number, got 'much'"),
        ({"Xphiphi": 1.0}, "MSS parameters: unknown key"),
    ],
)
def test_wrong_parameters_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        interchange.from_mss(interchange.to_mss(load_model("mariner")) | changes)
    with pytest.raises(
        InputError, match="structure 'kvlcc2' found, expected abkowitz or container"
    ):
        interchange.to_mss(load_model("kvlcc2"))


def test_the_turn_of_shipmmg_is_ours():
    """At 35 deg, with the rudder at 15.8 deg/s, as `scripts/ecosystem.py shipmmg` simulates it there."""
    ship = kvlcc2_l7("shipmmg")
    parameters = interchange.to_shipmmg(ship)
    assert parameters["basic_params"]["m"] == 3.27 * 1025.0
    n, gear = ship.service_shaft_speed, ship.steering
    back = interchange.from_shipmmg(parameters, 1.179, shaft_speed=n, steering=gear)
    assert dict(back.coefficients) == pytest.approx(dict(ship.coefficients), abs=1e-12)
    turn = back.simulate(np.tile([np.radians(35.0), n], (1000, 1)), 0.2)
    theirs = {
        "u": 0.410837,
        "v": -0.143888,
        "r": 0.055712,
        "x": 4.9501,
        "y": 12.2047,
        "psi": 11.48811,
    }
    assert {name: turn[name][-1] for name in theirs} == pytest.approx(theirs, rel=2e-4)


def test_published_kvlcc2_is_not_that_of_shipmmg():
    with pytest.raises(InputError, match="whose wake is another"):
        interchange.to_shipmmg(load_model("kvlcc2-l7"))
    fields = interchange.to_shipmmg(kvlcc2_l7("shipmmg"))
    del fields["basic_params"]["η"]
    with pytest.raises(InputError, match="basic_params: field 'η' is missing"):
        interchange.from_shipmmg(fields, 1.179)


def test_k_and_t_come_back():
    kt = interchange.to_shipmmg(load_model("mariner"))
    assert kt["kt_params"] == pytest.approx({"K": 0.1848, "T": 107.2}, rel=1e-3)
    ship = interchange.from_shipmmg(kt, 7.7175, length=160.93)
    assert interchange.to_shipmmg(ship)["kt_params"] == pytest.approx(kt["kt_params"])


def test_a_ship_of_shipmmg_keeps_what_her_parameters_say():
    """KVLCC2's model of 7 m is 1.27 m broad; shipmmg knows neither shaft speed nor steering gear."""
    ship = kvlcc2_l7("shipmmg")
    parameters = interchange.to_shipmmg(ship)
    basic = parameters["basic_params"]
    assert basic["B"] == ship.particulars["beam"]
    assert basic["I_zG"] == pytest.approx(basic["m"] * (7.0 / 4.0) ** 2)
    assert basic["η"] == pytest.approx(basic["D_p"] / ship.coefficients["H_R"])
    back = interchange.from_shipmmg(parameters, 1.179)
    assert (back.name, back.service_shaft_speed) == ("shipmmg", 0.0)
    assert (back.particulars["beam"], back.particulars["speed"]) == (basic["B"], 1.179)
    assert back.steering == shipgym.SteeringGear()
    assert back.coefficients["volume"] == pytest.approx(3.27)


def test_a_set_of_mss_has_its_inertia_about_midship():
    """That of a mass in one point, xG ahead of midship, leaves no gyradius."""
    mariner = load_model("mariner")
    known = interchange.to_mss(mariner)
    p = mariner.particulars
    assert known["Iz"] == pytest.approx(
        known["m"] * ((p["yaw_gyradius"] / p["length"]) ** 2 + known["xG"] ** 2)
    )
    back = interchange.from_mss(known)
    assert (
        back.name,
        back.particulars["water_density"],
        back.steering.time_constant,
    ) == ("mss", 1025.0, 1.0)
    for share, gyradius in ((4.0, np.sqrt(3.0)), (2.0, 1.0)):
        changed = interchange.from_mss(
            known | {"Iz": share * known["m"] * known["xG"] ** 2}
        )
        assert changed.particulars["yaw_gyradius"] == pytest.approx(-gyradius * p["xg"])
    with pytest.raises(InputError, match=r"yaw_gyradius: expected .*got 0"):
        interchange.from_mss(known | {"Iz": 0.9 * known["m"] * known["xG"] ** 2})


def test_rewards_that_are_run_again_may_differ_by_rounding(monkeypatch, episodes):
    """By one part in a million; here a made-up environment that says what it is asked."""
    episode = episodes[0]

    class Again:
        def __init__(self, factor):
            self.rewards = iter(factor * episode.rewards)

        def reset(self, seed=None):
            return np.zeros(3), {}

        def step(self, action):
            return np.zeros(3), next(self.rewards), False, False, {}

    shown = minari_datasets._observations(Again(1.0 + 9e-7), episode, "episodes[0]")
    assert shown.shape == (episode.n_steps + 1, 3)
    worst = np.abs(episode.rewards).max()
    off = 1.0 + 1.05e-6 * (1.0 + 1.0 / worst)
    with pytest.raises(InputError, match=r"episodes\[0\]: cost"):
        minari_datasets._observations(Again(off), episode, "episodes[0]")
