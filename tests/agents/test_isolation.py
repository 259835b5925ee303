"""Contestants steer from processes of their own, which are handed no ship."""

import numpy as np
import pytest

from agents import benchmark
from agents.benchmarking.isolated import ContestantError, IsolatedPolicy
from agents.suites.suite import load_suite

CODE = """
import inspect, os, time
import numpy as np
import shipgym
from agents import LQ

class Helm:
    def __init__(self, task, bad=None):
        self.lq = LQ.from_model(task.ship, dt=task.task.interval(task.ship))
        self.bad = bad
    def predict(self, seen, state=None, starts=None, deterministic=True):
        if self.bad:
            self.bad()
        return self.lq.predict(seen, state, starts, deterministic)

def curious(task):
    names = [frame.filename for frame in inspect.stack()]
    assert not any("cells.py" in name for name in names), names
    assert task.true_ship == "" and task.suite == ""
    return Helm(task)

def dies(task):
    return Helm(task, lambda: os._exit(7))

def hangs(task):
    return Helm(task, lambda: time.sleep(60))

def prints(task):
    return Helm(task, lambda: print("here I am"))

def asks(task):
    helm = Helm(task)
    helm.ship = shipgym.load_model("mariner")
    return helm

def raises(task):
    raise ValueError("not today")
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "contestants.py").write_text(CODE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_one_that_fails_is_lost_and_named_and_the_others_go_on(folder):
    names = ["curious", "dies", "prints", "asks", "raises"]
    entries = {name: f"contestants:{name}" for name in names}
    entries["lq"] = "lq"
    result = benchmark(entries, tasks="sharp-turns", episodes=2)
    found = result.cells("sharp-turns")

    assert found["curious"]["cost"] == found["lq"]["cost"]
    raised = "raises could not run sharp-turns: ValueError: not today"
    assert raised in result.failures
    expected = {
        "dies": "ended with code 7 while steering",
        "prints": "wrote to standard output: 'here I am'",
        "asks": "asked for the true ship",
    }
    for name, why in expected.items():
        assert found[name]["failed"] == 2
        assert why in found[name]["failure"]
        assert found[name]["cost"]["value"] > found["lq"]["cost"]["value"]


def test_one_that_hangs_is_given_up(folder):
    task = load_suite().task("sharp-turns")
    policy = IsolatedPolicy("contestants:hangs", task, command_s=0.5)
    seen = np.zeros((1, len(task.task.observed(task.ship))))
    for _ in range(2):
        with pytest.raises(ContestantError, match=r"no answer within 0\.5 s"):
            policy.predict(seen)
