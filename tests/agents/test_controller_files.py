"""Controller files: read back as they were, and refused with the field at fault named."""

import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from agents import LQ, PID, load_agent
from agents.agent_file import PRETRAINED, find_agent, list_pretrained
from agents.controllers.controller import check_scales, model_hash
from agents.controllers.registry import BUILT_IN, controller_class
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.ships.mariner import mariner
from shipgym.ships.steering import SteeringGear

MARINER = load_model("mariner")
DESIGNS = {
    "pid": PID.from_model(MARINER),
    "lq": LQ.from_model(MARINER),
    "no limit": PID.from_model(replace(MARINER, steering=SteeringGear(40.0, 2.5))),
}


@pytest.mark.parametrize("kind", DESIGNS)
def test_a_file_holds_the_whole_controller(kind, tmp_path):
    controller, path = DESIGNS[kind], tmp_path / "controller.json"
    controller.save(path)
    again = load_agent(path, MARINER)
    assert type(again) is type(controller)
    assert asdict(again) == asdict(controller)
    observations = (
        np.random.default_rng(0).uniform(-1.0, 1.0, (50, 8)).astype(np.float32)
    )
    np.testing.assert_array_equal(
        again.predict(observations)[0], controller.predict(observations)[0]
    )
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_is_standard_json_though_a_margin_has_no_limit(tmp_path):
    path = tmp_path / "controller.json"
    DESIGNS["no limit"].save(path)
    assert DESIGNS["no limit"].margins.gain_margin == math.inf
    assert (
        json.loads(path.read_text(), parse_constant=pytest.fail)["margins"][
            "gain_margin"
        ]
        is None
    )


def test_a_file_that_cannot_be_written_leaves_nothing_behind(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        DESIGNS["pid"].save(tmp_path / "nowhere" / "pid.json")
    assert list(tmp_path.iterdir()) == []


def edited(tmp_path, **changes):
    path = tmp_path / "pid.json"
    DESIGNS["pid"].save(path)
    content = json.loads(path.read_text())
    for field, value in changes.items():
        *parents, name = field.split("__")
        place = content
        for parent in parents:
            place = place[parent]
        if value is None:
            del place[name]
        else:
            place[name] = value
    path.write_text(json.dumps(content))
    return path


NAMES = list(DESIGNS["pid"].observation_names)
SCALES = list(DESIGNS["pid"].observation_scales)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"format": 2},
            "expected format 1, which this version of shipgym reads, got 2",
        ),
        ({"kind": None}, "field 'kind' is missing"),
        (
            {"kind": "pdi"},
            "kind: expected one of 'pid', .*Did you mean 'pid'",
        ),
        ({"gains": None}, "field 'gains' is missing"),
        ({"gain": {}}, "unknown key 'gain'. Did you mean 'gains'"),
        ({"gains__proportional": None}, "gains: 'proportional' is missing"),
        (
            {"gains__proportional": float("nan")},
            "gains.proportional: expected a number",
        ),
        ({"gains__sway": 1.0}, "gains: unknown key 'sway'"),
        ({"neutral_rudder": "1"}, "neutral_rudder: expected a number"),
        ({"margins__gain_margin": "inf"}, "margins.gain_margin: expected"),
        (
            {"margins__phase": 1.0},
            "margins: unknown key 'phase'. Did you mean 'phase_margin_deg'",
        ),
        ({"model__name": ""}, "model.name: expected a non-empty string"),
        ({"design__dt": [1]}, r"design.dt: expected a number"),
        (
            {"observation_names": "sway"},
            "observation_names: 'sway' found, expected a list of names",
        ),
        (
            {"observation_names": [*NAMES[:2], NAMES[3], NAMES[2], *NAMES[4:]]},
            "observation_names: observation 2 is 'sway', expected 'yaw_rate'",
        ),
        (
            {"observation_names": NAMES[:-1]},
            (
                "7 observations found, expected 8; in one and not in the other:"
                " heading_error_integral"
            ),
        ),
        (
            {"observation_scales": SCALES[:5]},
            "observation_scales: 5 found, expected 8 numbers",
        ),
        (
            {"observation_scales": [*SCALES[:7], -1.0]},
            r"scales\[7\] \('heading_error_integral'\): expected",
        ),
    ],
)
def test_a_wrong_field_is_named(changes, message, tmp_path):
    path = edited(tmp_path, **changes)
    with pytest.raises(InputError, match=message) as caught:
        load_agent(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            b'{"format": 1, "kind": "pid", "gai',
            "broken JSON .*line 1 column 30.*cut short",
        ),
        (b"\x89PNG\xff\xfe", "expected a controller file.*binary content"),
        (b"[1, 2]", "expected a table"),
        (b"{}", "field 'format' is missing"),
    ],
)
def test_a_file_that_is_none_is_refused(content, message, tmp_path):
    path = tmp_path / "pid.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        load_agent(path)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="there is no such controller file"):
        load_agent(tmp_path / "pid.json")


def test_an_agent_is_found_by_its_file_its_folder_or_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    DESIGNS["pid"].save(tmp_path / "agent.json")
    (tmp_path / "run").mkdir()
    for name in ("run/agent.json", "pid", "mariner-calm-ppo"):
        (tmp_path / name).write_bytes((tmp_path / "agent.json").read_bytes())
    for name in ("agent.json", "run", "pid", "mariner-calm-ppo"):
        assert load_agent(name).gains == DESIGNS["pid"].gains
    assert find_agent("no.json") == Path("no.json")
    (tmp_path / "mariner-calm-ppo").unlink()
    assert find_agent("mariner-calm-ppo") == PRETRAINED / "mariner-calm-ppo.json"
    known = list_pretrained()
    assert known == sorted(known)
    assert len(known) == len(list(PRETRAINED.glob("*.json")))
    with pytest.raises(InputError) as error:
        load_agent("mariner-clam-ppo")
    assert (
        str(error.value)
        == f"agent: 'mariner-clam-ppo' found, expected a file, or one of {len(known)}"
        f" pretrained agents, such as '{known[0]}'. Did you mean 'mariner-calm-ppo'?"
    )


def test_a_controller_of_another_ship_is_refused_with_the_difference(tmp_path):
    path = tmp_path / "pid.json"
    DESIGNS["pid"].save(path)
    with pytest.raises(
        InputError,
        match=r"model 'mariner': the scale of 'yaw_rate' is 0\.0248.* 0\.0479",
    ):
        load_agent(path, mariner(service_speed=4.0))
    with pytest.raises(
        InputError, match=r"the scale of 'rudder' .*another ship or rudder limit"
    ):
        load_agent(path, replace(MARINER, steering=SteeringGear(35.0, 5.0, 1.0)))


CORPUS = sorted((Path(__file__).parents[1] / "corpus" / "controller").glob("*.json"))


def changed(path, tmp_path, change):
    content = json.loads(path.read_text())
    change(content)
    target = tmp_path / path.name
    target.write_text(json.dumps(content))
    return target


def test_scales_of_observations_agree_within_a_millionth():
    check_scales(["rudder"], [1.0 - 0.95e-6], [1.0], "agent", "hers is {}")
    with pytest.raises(
        InputError, match=r"agent: the scale of 'rudder' is 0\.999999, but hers is 1"
    ):
        check_scales(["rudder"], [1.0 - 1.05e-6], [1.0], "agent", "hers is {}")
    for own in (0.01, 300.0):  # of it, whatever it is
        check_scales(["it"], [own * (1.0 + 0.95e-6)], [own], "agent", "{}")
        with pytest.raises(InputError, match="agent: the scale of 'it' is"):
            check_scales(["it"], [own * (1.0 + 1.05e-6)], [own], "agent", "{}")


def test_there_is_a_file_of_every_kind():
    assert set(BUILT_IN) == {path.stem for path in CORPUS}


@pytest.mark.parametrize("path", CORPUS, ids=lambda path: path.stem)
def test_what_a_kind_needs_of_its_design_is_checked_when_it_is_read(path, tmp_path):
    """Not when it steers: a horizon of 2^32 steps asks for 64 GiB there."""
    kind = controller_class(path.stem)
    for name, (least, largest, default) in kind.ranges.items():
        place = "gains" if name in kind.gain_names else "design"
        for value in (None, "1", least - 1.0, largest * 2.0):
            with pytest.raises(
                InputError, match=rf"{place}.{name}: expected a number >= "
            ):
                load_agent(
                    changed(
                        path,
                        tmp_path,
                        lambda content, v=value, n=name, p=place: content[p].update(
                            {n: v}
                        ),
                    )
                )
        without = changed(
            path, tmp_path, lambda content, n=name, p=place: content[p].pop(n)
        )
        if default is None:
            with pytest.raises(InputError, match=f"{place}: '{name}' is missing"):
                load_agent(without)
        else:
            assert load_agent(without).design[name] == default


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        (
            "lqg",
            lambda arrays: arrays["kalman"][0].append(1.0),
            r"arrays.kalman\[0\]: expected a list of 2 numbers, got 3 entries",
        ),
        (
            "lqg",
            lambda arrays: arrays["kalman"][0].__setitem__(0, 1e5),
            "a sampled pole of size .* below 1",
        ),
        (
            "lqg",
            lambda arrays: arrays["transition"].append([0.0] * 3),
            r"shape \(states, states\)",
        ),
        (
            "lqg",
            lambda arrays: arrays["output"].pop(),
            "arrays.output: expected a list of 2",
        ),
        (
            "mpc",
            lambda arrays: arrays["effect"].__setitem__(3, 0.0),
            "share of an order .* >= 1e-06 and <= 1, got 0$",
        ),
        (
            "mpc",
            lambda arrays: arrays["transition"][3].__setitem__(3, -0.01),
            "stays: expected .* >= 0 and",
        ),
        (
            "mpc",
            lambda arrays: arrays["transition"][3].__setitem__(3, 1.01),
            "stays: expected .* <= 1, got 1.01$",
        ),
        (
            "mpc",
            lambda arrays: arrays["effect"].__setitem__(3, 1.01),
            "followed: expected",
        ),
        (
            "mpc",
            lambda arrays: arrays["transition"][0].__setitem__(0, 9.0),
            "a sampled pole of size",
        ),
        (
            "lqg",
            lambda arrays: arrays["transition"].clear(),
            r"transition: .* of shape \(states, states\)",
        ),
        (
            "lqg",
            lambda arrays: arrays.update(
                transition=np.zeros((4, 4)).tolist(),
                input=[0.0] * 4,
                kalman=[[0.0] * 2] * 4,
                output=[[0.0] * 4] * 2,
            ),
            r"arrays.input: 4 states found, expected one of \(3, 5\)",
        ),
        (
            "lq-scheduled",
            lambda arrays: arrays["speeds"].clear(),
            r"speeds: .* of shape \(speeds\)",
        ),
        (
            "turn-rate",
            lambda arrays: arrays["rates"].sort(reverse=True),
            "rates: .* in rising order",
        ),
        (
            "lq-scheduled",
            lambda arrays: arrays["speeds"].sort(reverse=True),
            "speeds: .* in rising order",
        ),
        (
            "lq-scheduled",
            lambda arrays: arrays["neutral"][0].pop(),
            "expected a list of 2 numbers",
        ),
        (
            "lq-adaptive",
            lambda arrays: arrays["prior"][1].__setitem__(2, 0.0),
            "the yaw acceleration per rudder",
        ),
        (
            "lq-adaptive",
            lambda arrays: arrays["prior"][1].__setitem__(2, 1e30),
            "of magnitude 1e\\+09 at most",
        ),
    ],
)
def test_matrices_that_no_design_has_are_refused(kind, change, message, tmp_path):
    path = next(path for path in CORPUS if path.stem == kind)
    with pytest.raises(InputError, match=message):
        load_agent(changed(path, tmp_path, lambda content: change(content["arrays"])))


def test_guidance_leads_what_keeps_a_heading(tmp_path):
    path = next(path for path in CORPUS if path.stem == "los")
    nested = changed(
        path,
        tmp_path,
        lambda content: content.update(autopilot=json.loads(path.read_text())),
    )
    with pytest.raises(
        InputError, match="autopilot: 'los' found, expected one that keeps a heading"
    ):
        load_agent(nested)


def test_a_model_is_told_by_its_structure_coefficients_particulars_and_gear():
    own = model_hash(MARINER)
    assert len(own) == 64
    assert model_hash(replace(MARINER, name="other", covariance=None)) == own
    others = [
        replace(
            MARINER,
            coefficients={
                **MARINER.coefficients,
                "N_r": 1.001 * MARINER.coefficients["N_r"],
            },
        ),
        replace(MARINER, particulars=replace(MARINER.particulars, draught=7.5)),
        replace(MARINER, steering=replace(MARINER.steering, time_constant=0.3)),
    ]
    assert len({own, *map(model_hash, others)}) == 4


def test_gains_of_many_ships_make_as_many_rows_and_none_where_a_gain_is_none():
    gains = {
        "proportional": np.array([0.0, 2.0]),
        "integral": np.zeros(2),
        "derivative": np.array([3.0, 0.0]),
    }
    row = replace(DESIGNS["pid"], gains=gains).row
    assert row.tolist() == [[0.0, 0.0], [-3.0, 0.0], [0.0, 2.0], [0.0, 0.0], [0.0, 0.0]]
    assert (
        replace(DESIGNS["pid"], gains=dict.fromkeys(gains, 0.0)).row.tolist()
        == [0.0] * 5
    )
