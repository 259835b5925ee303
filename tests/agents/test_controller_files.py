"""Controller files: read back as they were, and refused with the field at fault named."""

import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from agents import LQ, PID, load_agent
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
    observations = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 8)).astype(np.float32)
    np.testing.assert_array_equal(again.predict(observations)[0], controller.predict(observations)[0])
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_is_standard_json_though_a_margin_has_no_limit(tmp_path):
    path = tmp_path / "controller.json"
    DESIGNS["no limit"].save(path)
    assert DESIGNS["no limit"].margins.gain_margin == math.inf
    assert json.loads(path.read_text(), parse_constant=pytest.fail)["margins"]["gain_margin"] is None


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
        ({"format": 2}, "format 2 found, this version of shipgym reads format 1"),
        ({"kind": "pdi"}, "kind: 'pdi' found, expected one of 'pid', .*Did you mean 'pid'"),
        ({"gains": None}, "field 'gains' is missing"),
        ({"gain": {}}, "unknown key 'gain'. Did you mean 'gains'"),
        ({"gains__proportional": None}, "gains: 'proportional' is missing"),
        ({"gains__proportional": float("nan")}, "gains.proportional: nan found, expected a number"),
        ({"gains__sway": 1.0}, "gains: unknown key 'sway'"),
        ({"neutral_rudder": "1"}, "neutral_rudder: '1' .* found, expected a number"),
        ({"margins__gain_margin": "inf"}, "margins.gain_margin: 'inf' .* found"),
        ({"margins__phase": 1.0}, "margins: unknown key 'phase'. Did you mean 'phase_margin_deg'"),
        ({"model__name": ""}, "model.name: '' found, expected a text"),
        ({"design__dt": [1]}, r"design.dt: \[1\] found, expected a number"),
        ({"observation_names": "sway"}, "observation_names: 'sway' found, expected a list of names"),
        (
            {"observation_names": [*NAMES[:2], NAMES[3], NAMES[2], *NAMES[4:]]},
            "observation_names: observation 2 is 'sway', expected 'yaw_rate'",
        ),
        (
            {"observation_names": NAMES[:-1]},
            "7 observations found, expected 8; in one and not in the other: heading_error_integral",
        ),
        ({"observation_scales": SCALES[:5]}, "observation_scales: 5 found, expected 8 numbers"),
        ({"observation_scales": [*SCALES[:7], -1.0]}, r"scales\[7\] \('heading_error_integral'\): -1 found"),
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
        (b'{"format": 1, "kind": "pid", "gai', "broken JSON .*line 1 column 30.*cut short"),
        (b"\x89PNG\xff\xfe", "binary content found, expected a controller file"),
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


def test_a_controller_of_another_ship_is_refused_with_the_difference(tmp_path):
    path = tmp_path / "pid.json"
    DESIGNS["pid"].save(path)
    with pytest.raises(InputError, match=r"model 'mariner': the scale of 'yaw_rate' is 0\.0248.* 0\.0479"):
        load_agent(path, mariner(service_speed=4.0))
    with pytest.raises(InputError, match=r"the scale of 'rudder' .*another ship or rudder limit"):
        load_agent(path, replace(MARINER, steering=SteeringGear(35.0, 5.0, 1.0)))
