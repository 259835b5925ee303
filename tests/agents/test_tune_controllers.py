"""The script that makes the suite's result files: when the oracle flies again."""

import argparse
import importlib.util
from pathlib import Path

import pytest

from agents.benchmarking import direct_search
from agents.suites.suite import BenchmarkTask
from shipgym.json_file import read_json, write_json

SCRIPT = Path(__file__).parents[2] / "scripts" / "tune_controllers.py"
CALM = BenchmarkTask("calm", "course-keeping", "mariner", "", {"episode_steps": 30})
ASKED = argparse.Namespace(suite="any", oracle_episodes=100, again=False)


@pytest.fixture
def script(tmp_path, monkeypatch):
    spec = importlib.util.spec_from_file_location("tune_controllers", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for place in (module, direct_search):
        monkeypatch.setattr(place, "tuned_file", lambda suite: tmp_path / f"{suite}-tuned.json")
    return module


def test_the_oracle_flies_again_only_where_the_new_best_costs_less_than_it(script, monkeypatch):
    flown = []

    def fly(task, start, cost, asked):
        flown.append((start.kind, cost))
        return {"oracle": 0.9 * cost, "oracle_episodes": 100}

    def refer(**costs):
        found = {kind: {"settings": {}, "cost": cost} for kind, cost in costs.items()}
        write_json({"tasks": {"calm": found}}, script.tuned_file("any"))
        script.refer(CALM, ASKED)
        return read_json(script.reference_file("any"), "reference file", "")["calm"]

    monkeypatch.setattr(script, "fly", fly)
    first = refer(pid=1.0, lq=2.0)
    assert first["best_classical"] == {"name": "pid", "cost": first["pid"]}
    assert refer(pid=1.0, lq=2.0) == first
    assert [kind for kind, _ in flown] == ["pid"]
    second = refer(pid=1.0, lq=0.5)  # lq is now the best, and dearer than 0.9 times pid
    assert second["best_classical"]["name"] == "lq"
    assert second["best_classical"]["cost"] != first["pid"]
    assert second["oracle"] == first["oracle"]
    assert len(flown) == 1
    write_json({"calm": {**second, "oracle": 1.1 * first["pid"]}}, script.reference_file("any"))
    third = refer(pid=0.1, lq=0.5)
    assert flown[1:] == [("pid", first["pid"])]
    assert third["oracle"] == first["oracle"]
