"""Controller files are read back as they were, or the field at fault is named."""

import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from agents import LQ, PID, load_agent
from agents.agent_file import PRETRAINED, find_agent, list_pretrained
from agents.controllers.interface import model_hash
from agents.controllers.registry import CLASSICAL, controller_class
from shipgym import SteeringGear
from shipgym.errors import InputError
from tests.agents.mariners import MARINER

DESIGNS = {
    "pid": PID.from_model(MARINER),
    "lq": LQ.from_model(MARINER),
    "no limit": PID.from_model(replace(MARINER, steering=SteeringGear(40.0, 2.5))),
}
CORPUS = {
    path.stem: path
    for path in (Path(__file__).parents[1] / "corpus" / "controller").glob("*.json")
}
NAMES = list(DESIGNS["pid"].observation_names)
SCALES = list(DESIGNS["pid"].observation_scales)


SLOW = replace(MARINER, particulars=replace(MARINER.particulars, speed=4.0))


def changed(kind, tmp_path, changes):
    """A file of a kind with fields `outer__inner` changed; None takes one away."""
    content = json.loads(CORPUS[kind].read_text())
    for field, value in changes.items():
        *parents, name = field.split("__")
        place = content
        for parent in parents:
            place = place[parent]
        if value is None:
            del place[name]
        else:
            place[name] = value
    path = tmp_path / f"{kind}.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize("name", DESIGNS)
def test_a_file_holds_the_whole_controller(name, tmp_path):
    controller, path = DESIGNS[name], tmp_path / "controller.json"
    controller.save(path)
    again = load_agent(path, MARINER)
    assert type(again) is type(controller)
    assert asdict(again) == asdict(controller)
    seen = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 8)).astype(np.float32)
    np.testing.assert_array_equal(again.predict(seen)[0], controller.predict(seen)[0])
    assert list(tmp_path.iterdir()) == [path]


SWAPPED = [*NAMES[:2], NAMES[3], NAMES[2], *NAMES[4:]]
#: Kind of file, what is changed in it, and what the message says.
BAD_FILES = [
    ("pid", {"format": 2}, "expected format 1"),
    ("pid", {"kind": None}, "field 'kind' is missing"),
    ("pid", {"kind": "pdi"}, "kind: .*Did you mean 'pid'"),
    ("pid", {"kind": "learned"}, "policy|field"),
    ("pid", {"gains": None}, "field 'gains' is missing"),
    ("pid", {"gain": {}}, "unknown key 'gain'. Did you mean 'gains'"),
    ("pid", {"gains__proportional": None}, "gains: expected .*got no 'proportional'"),
    ("pid", {"gains__proportional": math.nan}, "gains.proportional: .*a number"),
    ("pid", {"gains__integral": 1.01e9}, "gains.integral: .*a number .*<= 1e"),
    ("pid", {"gains__sway": 1.0}, "gains: unknown key 'sway'"),
    ("pid", {"gains__schedule": 2.0}, "gains.schedule: .*<= 1, got 2"),
    ("preview-lq", {"gains__schedule": -1.0}, "gains.schedule: .*>= 0"),
    ("pid", {"gains__wave_period": 61.0}, "gains.wave_period: .*<= 60, got 61"),
    ("lq", {"gains__wave_period": 0.5}, "wave_period: .*two control intervals"),
    ("lq", {"gains__gear_share": 1.5}, "gains.gear_share: .*<= 1"),
    ("pid", {"neutral_rudder": "1"}, "neutral_rudder: .*expected a number"),
    ("pid", {"neutral_rudder": 3.15}, "neutral_rudder: .*<= 3.14"),
    ("pid", {"margins__gain_margin": "inf"}, "margins.gain_margin: "),
    ("pid", {"margins__phase": 1.0}, "margins: .*Did you mean 'phase_margin_deg'"),
    ("pid", {"model__name": ""}, "model.name: "),
    ("pid", {"design__dt": [1]}, "design.dt: .*expected a number"),
    ("pid", {"arrays": {}}, "unknown key 'arrays'"),
    ("pid", {"observation_names": "sway"}, "names: expected a list of names"),
    ("pid", {"observation_names": SWAPPED}, "2: expected 'yaw_rate', got 'sway'"),
    ("pid", {"observation_names": NAMES[:-1]}, "7: .*_integral', got 'none'"),
    (
        "pid",
        {"observation_scales": SCALES[:5]},
        "scales: expected a list of numbers, size 8",
    ),
    ("pid", {"observation_scales": [*SCALES[:7], -1.0]}, "scales: 'heading_error_int"),
    ("lqg", {"arrays__input": [1.0]}, r"arrays: expected .*\(1,\)"),
    ("lqg", {"arrays__kalman": [[2e9] * 2] * 3}, "arrays.kalman: largest"),
    ("lqg", {"arrays__transition": []}, r"arrays: .*\(0, 0\)"),
    (
        "lqg",
        {"arrays__transition": (1.3 * np.eye(3)).tolist()},
        "sampled poles below 1",
    ),
    ("ilos", {"autopilot": 3}, "autopilot: .*expected a table"),
    ("ilos", {"gains__lookahead": 0.0}, "gains.lookahead: .*expected a number"),
    ("mpc", {"ship__coefficients": {}}, "ship: "),
    ("mpc", {"autopilot__kind": "pid"}, "autopilot: "),
]


@pytest.mark.parametrize(("kind", "changes", "message"), BAD_FILES)
def test_a_wrong_field_is_named(kind, changes, message, tmp_path):
    path = changed(kind, tmp_path, changes)
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


def test_guidance_leads_what_keeps_a_heading(tmp_path):
    nested = changed(
        "ilos", tmp_path, {"autopilot": json.loads(CORPUS["ilos"].read_text())}
    )
    with pytest.raises(
        InputError,
        match="autopilot: expected a controller that keeps a heading, got Integral",
    ):
        load_agent(nested)


@pytest.mark.parametrize("kind", CLASSICAL)
def test_what_a_law_needs_is_checked_when_the_file_is_read(kind, tmp_path):
    """Not when it steers: a horizon of 2^32 steps asks for 64 GiB there."""
    design = controller_class(kind)
    for name, (least, largest) in design.bounds.items():
        place = "gains" if name in design.gain_names else "design"
        for value in ("1", least - 1.0, largest * 2.0):
            path = changed(kind, tmp_path, {f"{place}__{name}": value})
            with pytest.raises(
                InputError, match=f"{place}.{name}: .*expected a number >= "
            ):
                load_agent(path)
        path = changed(kind, tmp_path, {f"{place}__{name}": None})
        with pytest.raises(InputError, match=f"{place}: expected .*got no '{name}'"):
            load_agent(path)


def test_an_agent_is_found_by_its_file_its_folder_or_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    DESIGNS["pid"].save(tmp_path / "agent.json")
    (tmp_path / "run").mkdir()
    name = "path-following-ppo"
    for copy in ("run/agent.json", "pid", name):
        (tmp_path / copy).write_bytes((tmp_path / "agent.json").read_bytes())
    for found in ("agent.json", "run", "pid", name):
        assert load_agent(found).gains == DESIGNS["pid"].gains
    assert find_agent("no.json") == Path("no.json")
    (tmp_path / name).unlink()
    assert find_agent(name) == PRETRAINED / f"{name}.json"

    known = list_pretrained()
    assert known == sorted(path.stem for path in PRETRAINED.glob("*.json"))
    with pytest.raises(
        InputError, match=f"got 'path-folowing-ppo'. Did you mean '{name}'"
    ):
        load_agent("path-folowing-ppo")


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (
            SLOW,
            r"'yaw_rate': expected 0\.0479.*, got 0\.0248",
        ),
        (
            replace(MARINER, steering=SteeringGear(35.0, 5.0, 1.0)),
            "'rudder': .*rudder limit",
        ),
    ],
    ids=["slower", "less rudder"],
)
def test_a_controller_of_another_ship_is_refused_with_the_difference(
    model, message, tmp_path
):
    DESIGNS["pid"].save(tmp_path / "pid.json")
    with pytest.raises(InputError, match=f"^model 'mariner': scale of {message}"):
        load_agent(tmp_path / "pid.json", model)


def test_a_model_is_told_by_its_structure_coefficients_particulars_and_gear():
    own = model_hash(MARINER)
    assert len(own) == 64
    assert model_hash(replace(MARINER, name="other", covariance=None)) == own
    yaw = {**MARINER.coefficients, "N_r": 1.001 * MARINER.coefficients["N_r"]}
    others = [
        replace(MARINER, coefficients=yaw),
        replace(MARINER, particulars=replace(MARINER.particulars, draught=7.5)),
        replace(MARINER, steering=replace(MARINER.steering, time_constant=0.3)),
    ]
    assert len({own, *map(model_hash, others)}) == 4
