"""Checkpoints: all is compared with the agent's own before it is restored; no path is
opened."""

import copy
import json
import random
import struct

import numpy as np
import pytest
import torch
from safetensors import safe_open

from agents.training import run_folder
from agents.training.algorithms import make_agent
from agents.training.checkpoints import (
    agent_state,
    check_weights,
    restore_agent,
)
from agents.training.evaluation import check_evaluations
from agents.training.likeness import check_like
from agents.training.nested_values import (
    CONTENT,
    SHA256,
    read_values,
    write_values,
)
from agents.training.request import TrainingRequest, make_plan
from shipgym.errors import InputError

SHORT = {"episode_steps": 20, "change_interval_steps": 10}
OWN = {
    "base": "none",
    "ships": 4,
    "learning_starts": 16,
    "gradient_steps": 1,
    "batch_size": 8,
    "critic_arch": [8],
    "net_arch": [8],
    "total_steps": 40,
    "buffer_size": 80,
}
PLAN = make_plan(TrainingRequest("sac", options=SHORT, settings=OWN))


@pytest.fixture(scope="module")
def memory(tmp_path_factory):
    """Of an agent that has learned a little, as it comes from its file."""
    agent = make_agent(PLAN, None)
    agent.learn(40)
    path = tmp_path_factory.mktemp("kept") / "checkpoint.safetensors"
    write_values(agent_state(agent), path)
    return read_values(path, "checkpoint")


@pytest.fixture(scope="module")
def fresh():
    return make_agent(PLAN, None)


def test_what_fits_is_put_back(fresh, memory):
    restore_agent(fresh, copy.deepcopy(memory))
    assert fresh.num_timesteps == 40
    again = agent_state(fresh)
    assert torch.equal(
        again["parameters"]["policy"]["actor.mu.weight"],
        memory["parameters"]["policy"]["actor.mu.weight"],
    )
    np.testing.assert_array_equal(
        again["ships"][1]["states"], memory["ships"][1]["states"]
    )
    assert again["replay"]["pos"] == memory["replay"]["pos"] == 10


def test_random_numbers_go_on_where_they_were(fresh, memory):
    random.getrandbits(8)
    np.random.rand(3)
    torch.rand(3)
    fresh.action_space.sample()
    restore_agent(fresh, copy.deepcopy(memory))
    found, kept = agent_state(fresh)["random"], memory["random"]
    assert (found["python"], found["actions"]) == (kept["python"], kept["actions"])
    assert found["numpy"][1].tolist() == kept["numpy"][1].tolist()
    assert found["numpy"][2] == kept["numpy"][2]
    assert torch.equal(found["torch"], kept["torch"])


def test_of_an_optimiser_only_rates_and_moments_are_put_back(fresh, memory):
    changed = copy.deepcopy(memory)
    (group,) = changed["parameters"]["actor.optimizer"]["param_groups"]
    group |= {
        "lr": 0.25,
        "eps": "evil",
        "params": [7],
        "of another version of torch": [1],
    }
    restore_agent(fresh, changed)
    (found,) = fresh.get_parameters()["actor.optimizer"]["param_groups"]
    assert (found["lr"], found["eps"], found["params"]) == (
        0.25,
        1e-8,
        [0, 1, 2, 3, 4, 5],
    )


ROW = {"steps": 0, "seconds": 1.0, "cost": 2.0, "mean_return": None}
WEIGHT = ["parameters", "policy", "actor.mu.weight"]


def kept(table, *path):
    """The table that a path leads to."""
    for key in path:
        table = table[key]
    return table


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (["parameters"], "/etc/passwd", "expected a table of 4, got '/etc/passwd'"),
        (WEIGHT, "/etc/passwd", "expected Tensor of torch.float32, shape (1, 8), got"),
        (WEIGHT, torch.zeros(8, 1), "got Tensor of torch.float32, shape (8, 1)"),
        (WEIGHT, np.zeros((1, 8), np.float32), "got ndarray of float32, shape (1, 8)"),
        (["parameters", "actor.optimizer", "state", 99], {}, "expected a table of"),
        (
            ["parameters", "actor.optimizer", "state", 0, "exp_avg"],
            torch.zeros(3),
            "state[0].exp_avg: expected Tensor of torch.float32",
        ),
        (
            ["parameters", "actor.optimizer", "param_groups"],
            [],
            "param_groups: expected list of 1, got list of 0",
        ),
        (["variables", "log_ent_coef"], 0.5, "expected Tensor of torch.float32"),
        (["counters", "num_timesteps"], -1, "num_timesteps: expected int, got -1"),
        (["counters", "_last_obs"], None, "expected ndarray of float32, shape (4, 8)"),
        (["episodes"], [{"r": 1.0, "l": 5}], "episodes[0]: expected a table of 3"),
        (["episodes"], "rlt", "agent.episodes: expected list of 0, got 'rlt'"),
        (["successes"], [float("inf")], "agent.successes[0]: expected float, got inf"),
        (["ships", 0, "var"], "x", "agent.ships[0].var: expected float, got 'x'"),
        (["ships", 1, "states"], np.zeros(3), "got ndarray of float64, shape (3,)"),
        (["replay"], None, "agent.replay: expected a table of 8, got None"),
        (["replay", "actions"], None, "expected ndarray of float32, shape (0, 4, 1)"),
        (
            ["replay", "actions"],
            np.zeros((99, 4, 1), np.float32),
            "replay.actions: exp",
        ),
        (["replay", "pos"], 11, "agent.replay: expected 11 steps by its position 11"),
        (["replay", "full"], True, "agent.replay: expected 20 steps"),
        (
            ["random", "numpy"],
            ("MT19937", np.zeros(624, np.uint32), 10**6, 0, 0.0),
            "expected a position of at most 624, got 1000000",
        ),
        (["random", "python"], (3, (1, 2), None), "expected tuple of 625"),
        (["random", "torch"], torch.zeros(5056, dtype=torch.uint8), "agent.random: "),
        (["random", "actions", "bit_generator"], "os", "expected 'PCG64', got 'os'"),
    ],
)
def test_what_does_not_fit_is_named(fresh, memory, path, value, said):
    changed = copy.deepcopy(memory)
    kept(changed, *path[:-1])[path[-1]] = value
    with pytest.raises(ValueError) as error:  # noqa: PT011 - its message is compared
        restore_agent(fresh, changed)
    assert said in str(error.value)


def test_weights_with_which_outputs_overflow_are_refused(fresh, memory):
    changed = copy.deepcopy(memory)
    changed["parameters"]["policy"]["actor.mu.weight"][0, 0] = 1e30
    with pytest.raises(
        ValueError,
        match=r"policy\.actor\.mu\.weight: expected numbers of magnitude 1e\+09",
    ):
        restore_agent(fresh, changed)


@pytest.mark.parametrize("wrong", [np.nan, -np.inf])
@pytest.mark.parametrize(
    ("path", "where"),
    [
        (("ships", 1, "states"), "agent.ships[1].states"),
        (("ships", 0, "old_obs"), "agent.ships[0].old_obs"),
        (("replay", "rewards"), "agent.replay.rewards"),
        (("counters", "_last_obs"), "agent.counters._last_obs"),
        (WEIGHT, "agent.parameters.policy.actor.mu.weight"),
        (("parameters", "actor.optimizer", "state", 0, "exp_avg"), "state[0].exp_avg"),
    ],
)
def test_numbers_that_are_infinite_or_nan_are_refused(
    fresh, memory, path, where, wrong
):
    changed = copy.deepcopy(memory)
    numbers = kept(changed, *path)
    first = (0,) * numbers.ndim
    numbers[first] = wrong
    with pytest.raises(ValueError) as error:  # noqa: PT011 - its message is compared
        restore_agent(fresh, changed)
    expected = f"{where}: expected a finite number at {list(first)}, got {wrong}"
    assert str(error.value).endswith(expected)


def test_numbers_of_ships_without_bound_stay_so(fresh, memory):
    """The depth of deep water is infinite, and so are the limits of an unknown
    operating envelope."""
    assert np.isinf(memory["ships"][1]["ships"]).any()
    restore_agent(fresh, copy.deepcopy(memory))


def test_observations_that_no_environment_shows_are_refused(fresh, memory):
    changed = copy.deepcopy(memory)
    changed["counters"]["_last_obs"][0, 0] = 3.0
    with pytest.raises(
        ValueError, match=r"_last_obs: expected numbers within the bounds"
    ):
        restore_agent(fresh, changed)


def test_weights_reach_to_a_thousand_millions_and_deviations_to_e_to_the_20th():
    allowed = {
        "weight": torch.tensor([1e9, -1e9]),
        "log_std": torch.tensor([-20.0, 20.0]),
        "steps": 3,
    }
    check_weights({"policy": allowed | {"counts": torch.tensor([2**40])}})
    for name, value, most in (
        ("weight", 1.05e9, r"1e\+09"),
        ("log_std", 20.5, "20"),
        ("log_std", -21.0, "20"),
    ):
        wrong = {"policy": allowed, "actor": {name: torch.tensor([0.0, value])}}
        with pytest.raises(
            ValueError,
            match=rf"^parameters\.actor\.{name}: .* of magnitude {most} at most$",
        ):
            check_weights(wrong)


@pytest.mark.parametrize("memory", [None, "/etc/passwd", [], {}, {"parameters": {}}])
def test_what_is_no_memory_is_refused(fresh, memory):
    with pytest.raises(ValueError, match=r"^agent: expected a table of 8, got "):
        restore_agent(fresh, memory)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"curve": [{"steps": 1}]}, r"run.curve\[0\]: expected a table of 4"),
        ({"curve": [{**ROW, "mean_return": "low"}]}, "mean_return: .*got 'low'"),
        ({"curve": [{**ROW, "cost": None}]}, r"run.curve\[0\].cost: expected float"),
        ({"best_steps": -1}, "run.best_steps: expected int, got -1"),
        ({"seconds": float("nan")}, "run.seconds: expected float, got nan"),
        ({"more": 1}, "run: expected a table of 4, got a table of 5"),
    ],
)
def test_a_run_of_another_form_is_refused(change, said):
    record = {
        "best_cost": 2.0,
        "best_steps": 0,
        "curve": [ROW, {**ROW, "mean_return": -1.0}],
        "seconds": 3.0,
    }
    check_evaluations(record)
    check_evaluations({**record, "best_cost": None, "curve": []})
    with pytest.raises(ValueError, match=said):
        check_evaluations({**record, **change})


def rewritten(path, change):
    """A file with other metadata and tensors: its header is changed and what follows
    stays."""
    whole = path.read_bytes()
    (length,) = struct.unpack("<Q", whole[:8])
    header = json.loads(whole[8 : 8 + length])
    change(header)
    text = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + whole[8 + length :])


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "values.safetensors"
    write_values(
        {"a": np.arange(3.0), "b": (1, 2.5, None, "x", True), 4: [torch.ones(2)]}, path
    )
    return path


def test_values_of_every_kind_come_back_as_they_were(tmp_path):
    inner = {"x": np.arange(6.0).reshape(2, 3).T, "y": np.float32(0.5)}
    value = {
        "a": inner,
        "b": {"x": np.arange(3)},
        "c": [inner["x"][0], [inner["x"][1]]],
        "d": np.int64(3),
    }
    write_values(value, tmp_path / "values.safetensors")
    found = read_values(tmp_path / "values.safetensors", "thing")
    np.testing.assert_array_equal(found["a"]["x"], [[0.0, 3.0], [1.0, 4.0], [2.0, 5.0]])
    assert found["b"]["x"].tolist() == [0, 1, 2]  # of the same name in another table
    assert [found["c"][0].tolist(), found["c"][1][0].tolist()] == [
        [0.0, 3.0],
        [1.0, 4.0],
    ]
    assert (found["a"]["y"], found["d"]) == (0.5, 3)
    write_values([np.ones(1)], tmp_path / "list.safetensors")
    assert read_values(tmp_path / "list.safetensors", "thing")[0].tolist() == [1.0]


def test_what_cannot_be_written_is_named(tmp_path):
    with pytest.raises(TypeError, match=r"^a\.b\.1: object cannot be written$"):
        write_values({"a": {"b": [1, object()]}}, tmp_path / "values.safetensors")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("found", "own"),
    [
        (0, 7),
        (np.int64(2), 0),
        (np.float32(1.0), -2.0),
        (0.0, 3.0),
        (np.zeros(2), np.ones(2)),
        ((), ()),
    ],
)
def test_numbers_of_a_kind_are_alike(found, own):
    check_like(found, own, "place")


@pytest.mark.parametrize(
    ("found", "own"),
    [
        (-1, 0),
        (1.0, 0),
        (0, 1.0),
        (np.inf, 1.0),
        (np.zeros(2), np.zeros(3)),
        ([], ()),
        ("a", "b"),
    ],
)
def test_numbers_of_other_kinds_are_not(found, own):
    with pytest.raises(ValueError, match=r"^place: expected .*, got "):
        check_like(found, own, "place")


def test_values_that_have_changed_are_refused(file):
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(
        InputError,
        match=(
            r"values.safetensors: not a thing.*its SHA-256 is not that of its content"
        ),
    ):
        read_values(file, "thing")
    file.write_bytes(whole)
    rewritten(
        file, lambda header: header["__metadata__"].update({CONTENT: '{"array": "a"}'})
    )
    with pytest.raises(InputError, match="its SHA-256 is not that of its content"):
        read_values(file, "thing")
    with safe_open(file, "numpy") as found:
        assert found.metadata().keys() == {CONTENT, SHA256}


@pytest.mark.parametrize("kind", ["F8_E4M3", "F8_E5M2", "F8_E8M0", "I8", "XX"])
def test_tensors_of_other_types_are_refused_in_one_message(file, kind):
    rewritten(file, lambda header: header["a"].update({"dtype": kind, "shape": [24]}))
    with pytest.raises(
        InputError, match=rf"^[^\n]*not a thing, or one that is cut short [^\n]*{kind}"
    ):
        read_values(file, "thing")


@pytest.mark.parametrize(
    "content",
    [
        "",
        "[",
        '{"array": "none"}',
        '{"code": "x"}',
        '{"dict": 3}',
        '{"list": 3}',
        '{"list": [], "dict": []}',
        "{}",
        '{"list": [' * 21 + "]}" * 21,
        '{"list": [' * 10**5 + "]}" * 10**5,
    ],
)
def test_values_of_another_form_are_refused(file, content):
    def change(header):
        header["__metadata__"] = {CONTENT: content}

    rewritten(file, change)
    with pytest.raises(InputError, match="not a thing, or one that is cut short"):
        read_values(file, "thing")


def test_a_file_that_is_not_there_or_has_no_content(file, tmp_path):
    with pytest.raises(InputError, match="there is no such thing"):
        read_values(tmp_path / "none.safetensors", "thing")
    with pytest.raises(InputError, match="expected a thing, got a folder"):
        read_values(tmp_path, "thing")
    rewritten(file, lambda header: header.pop("__metadata__"))
    with pytest.raises(InputError, match="not a thing"):
        read_values(file, "thing")


def test_values_within_values_are_read_twenty_deep(tmp_path):
    def nested(depth):
        return [nested(depth - 1)] if depth else 3

    write_values(nested(20), tmp_path / "deep.safetensors")
    assert read_values(tmp_path / "deep.safetensors", "thing") == nested(20)
    write_values(nested(21), tmp_path / "deeper.safetensors")
    with pytest.raises(InputError, match="'list' found among its values, 20 deep"):
        read_values(tmp_path / "deeper.safetensors", "thing")


@pytest.fixture
def run(tmp_path):
    run_folder.begin_folder(tmp_path / "run", PLAN, "shipgym train sac")
    return tmp_path / "run"


def test_a_run_is_read_as_it_was_begun(run):
    assert run_folder.read_plan(run).configuration() == PLAN.configuration()
    content = json.loads((run / "run.json").read_text())
    assert (content["command"], content["threads"]) == ("shipgym train sac", 1)
    run_folder.check_resumable(run, PLAN)
    assert run_folder.other_versions(run) == []


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (["format"], 2, "expected format 1, which this version of shipgym reads"),
        (["versions"], None, "field 'versions' is missing; start a new run in another"),
        (["more"], 1, "unknown key 'more'"),
        (["configuration"], 3, "configuration: expected a table"),
        (["configuration", "seed"], None, "configuration: 'seed' is missing"),
        (["configuration", "seed"], "3", "configuration.seed: expected"),
        (["configuration", "seed"], 801, "seed: expected"),
        (["configuration", "settings", "gamma"], None, "field 'gamma' is missing"),
        (["configuration", "model_sha256"], "0", "model_sha256: expected '0', got"),
        (["threads"], 0, "threads: expected"),
    ],
)
def test_a_broken_file_of_a_run_is_refused(run, place, value, said):
    content = json.loads((run / "run.json").read_text())
    inside = kept(content, *place[:-1])
    inside[place[-1]] = value
    if value is None:
        del inside[place[-1]]
    (run / "run.json").write_text(json.dumps(content))
    with pytest.raises(InputError) as error:
        run_folder.read_plan(run)
    assert str(error.value).startswith(str(run))
    assert said in str(error.value)


def test_a_new_run_begins_in_a_new_or_an_empty_folder(run, tmp_path):
    run_folder.check_new(tmp_path / "new")
    (tmp_path / "empty").mkdir()
    run_folder.check_new(tmp_path / "empty")
    file = tmp_path / "file"
    file.write_text("mine")
    for wrong, said in (
        (run, "run: contains a run already; resume it with --resume"),
        (tmp_path, "exists and is not a training run; name another folder"),
        (file, "file: exists and is not a training run; name another folder"),
        (file / "run", "file cannot be written to; choose another folder"),
    ):
        with pytest.raises(InputError, match=said):
            run_folder.check_new(wrong)
