"""The search of the bound from clairvoyance: costs fall, are true, and are kept."""

import json

import numpy as np
import pytest
from clairvoyance import main
from rudder_search.kept import Kept, steer_all
from rudder_search.lanes import Lanes, replayed_cost
from rudder_search.search import N_LANES, Search, bfgs

from agents.benchmarking.entries import read_entries
from agents.suites.suite import N_EPISODES, load_suite
from tests.agents.small_suite import write_suite


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bound")


@pytest.fixture(scope="module")
def suite(folder):
    known = {
        "rule_costs": [1.0] * N_EPISODES,
        "costs": [1e6] * N_EPISODES,
        "by": ["lq"] * N_EPISODES,
    }
    return write_suite(folder, best={"turns": known})


def search(suite, out, seconds, *more):
    asked = ("--suite", str(suite), "--tasks", "turns", "--controllers", "lq")
    return main([*asked, "--out", str(out), "--seconds", str(seconds), *more])


def test_an_interrupted_search_goes_on_and_writes_costs_that_are_true(suite, folder):
    out = folder / "out"
    assert search(suite, out, 0.001) == 0
    task = load_suite(suite).task("turns")
    begun = Kept.read(out / "turns.npz", {"task": "turns"})
    assert not begun.arrays["visits"].any()
    spent = begun.about["spent"]
    assert search(suite, out, spent + 0.5) == 0

    kept = Kept.read(out / "turns.npz", {"task": "turns"})
    costs = kept.arrays["costs"]
    assert kept.arrays["visits"].any()
    assert (costs <= begun.arrays["costs"]).all()
    assert costs.sum() < begun.arrays["costs"].sum()
    written = json.loads((folder / "small-best.json").read_text())["turns"]
    assert written["costs"] == pytest.approx(costs, abs=1e-9)
    assert set(written["by"]) == {"search from lq"}

    lowered = int(np.argmax(kept.arrays["visits"]))
    best = kept.arrays["best"][lowered]
    again = replayed_cost(task, int(task.seeds[lowered]), best)
    assert again == pytest.approx(costs[lowered], abs=1e-9)


def test_visits_depend_on_their_seed_alone(suite):
    task = load_suite(suite).task("turns")
    begun = Kept.begin({}, steer_all(read_entries("lq"), task))
    others = begun.arrays["starts"][:, 0]
    lanes = Lanes(task, N_LANES)
    first, again, other = (
        Search(lanes, seed).visit(begun.found(0), int(task.seeds[0]), others)
        for seed in (0, 0, 1)
    )
    assert first.visits == 1
    assert first.cost < begun.found(0).cost
    assert first.cost == again.cost
    assert first.cost != other.cost
    assert (first.best == again.best).all()


def test_steps_of_a_quadratic_give_its_inverse_hessian():
    hessian = np.array([[4.0, 1.0], [1.0, 3.0]])
    inverse = np.eye(2)
    for moved in np.tile(np.eye(2), (40, 1)):
        inverse = bfgs(inverse, moved, hessian @ moved)
    np.testing.assert_allclose(inverse @ hessian, np.eye(2), atol=1e-6)
    unchanged = bfgs(inverse, np.ones(2), -np.ones(2))
    assert (unchanged == inverse).all()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--tasks", "turn"], "task"),
        (["--seconds", "0"], "seconds"),
        (["--controllers", "nobody"], "controllers"),
        (["--seed", "7"], "turns.npz: seed: expected 7, got 0; give another --out"),
        (["--suite", "shipgym-v9"], "suite"),
    ],
)
def test_wrong_input_is_named_in_one_line(suite, folder, capsys, given, said):
    kept = Kept.begin(
        {"task": "turns", "suite": load_suite(suite).sha256, "seed": 0},
        steer_all(read_entries("lq"), load_suite(suite).task("turns")),
    )
    out = folder / "refused"
    out.mkdir(exist_ok=True)
    kept.about |= {"controllers": "lq", "spent": 0.0}
    kept.save(out / "turns.npz")
    assert search(suite, out, 1, *given) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1


@pytest.mark.parametrize("content", [b"no file of numpy", b"", b"PK\x03\x04 cut"])
def test_a_broken_file_is_named(suite, folder, capsys, content):
    out = folder / "broken"
    out.mkdir(exist_ok=True)
    (out / "turns.npz").write_bytes(content)
    assert search(suite, out, 1) == 2
    assert "turns.npz: expected a file of this search" in capsys.readouterr().err
