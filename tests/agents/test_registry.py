"""A controller of one's own is one file and its registration: files, benchmark, workers
and bases know it."""

import re
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from agents import LQ, benchmark, check_controller, load_agent, register_controller
from agents.controllers import registry
from agents.controllers.controller import Controller
from agents.controllers.law import HelmMemory, linear_law
from agents.suites.suite import find_task
from agents.training.algorithms import design_base
from shipgym import load_model
from shipgym.errors import InputError
from tests.agents.policies import random_policy

MINE = """
from dataclasses import dataclass
from agents import Controller, register_controller
from agents.controllers.linear_loop import sample_ship
from shipgym.tasks.scales import control_interval


@register_controller
@dataclass(frozen=True, eq=False)
class PD(Controller):
    kind = "my-pd"
    feedback = {
        "proportional": ("heading_error", 1.0),
        "derivative": ("yaw_rate", -1.0),
    }

    @classmethod
    def from_model(cls, model, *, dt=None, proportional=1.0):
        ship = sample_ship(model, dt or control_interval(model))
        gains = {"proportional": proportional, "derivative": 10.0 * proportional}
        return cls.designed(model, ship, gains=gains, design={})
"""


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A file in a temporary folder that registers a controller."""
    (tmp_path / "my_controllers.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_REGISTERED", {})
    path = list(sys.path)
    yield "my_controllers"
    sys.modules.pop("my_controllers", None)
    sys.path[:] = path


class LastOrder(NamedTuple):
    """What `Sluggish` remembers."""

    order: float
    helm: HelmMemory


class Sluggish(LQ):
    """Half of its last order goes into the next one."""

    memory_record = LastOrder

    def steer(self, seen, memory):
        plain, helm = linear_law(seen, memory.helm, self.parameters)
        order = 0.5 * (plain + memory.order)
        return order, LastOrder(order, helm)


def test_a_controller_of_ones_own_is_one_file(mine, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    import my_controllers

    ship = load_model("mariner")
    controller = my_controllers.PD.from_model(ship)
    check_controller(controller, ship)
    controller.save(tmp_path / "pd.json")
    again = load_agent(tmp_path / "pd.json", ship)
    assert type(again) is my_controllers.PD
    assert again.gains == controller.gains
    task = find_task("sharp-turns")
    assert isinstance(design_base("my-pd", task), my_controllers.PD)
    results = [
        benchmark(
            "my-pd,lq,file=pd.json",
            tasks=["sharp-turns"],
            episodes=2,
            workers=workers,
        )
        for workers in (1, 2)
    ]
    for result in results:
        costs = result.figures("my-pd", "sharp-turns")
        np.testing.assert_array_equal(costs, results[0].figures("my-pd", "sharp-turns"))
        assert (costs > result.figures("lq", "sharp-turns")).all()


def test_what_is_no_controller_is_refused():
    class Nameless(Controller):
        pass

    class Clashing(LQ):
        pass

    for wrong, message in (
        (3, "expected a subclass of agents.Controller"),
        (Nameless, "Nameless.kind: expected a name"),
        (Clashing, "got 'lq', which is that of agents.controllers.lq:LQ"),
    ):
        with pytest.raises(InputError, match=re.escape(message)):
            register_controller(wrong)


@pytest.mark.parametrize("kind", registry.CLASSICAL)
def test_our_own_keep_their_kind_and_are_documented(kind):
    controller = registry.controller_class(kind)
    assert controller.kind == kind
    assert register_controller(controller) is controller
    page = (Path(__file__).parents[2] / "docs" / "controllers.md").read_text()
    assert f"`{controller.__name__}`" in page


def test_a_kind_is_a_name_and_no_other_controller_s(monkeypatch):
    monkeypatch.setattr(registry, "_REGISTERED", {})

    def of_kind(kind):
        return type("Mine", (LQ,), {"kind": kind, "__module__": "mine"})

    for kind in ("", "my lq", "my,lq", "my/lq"):
        with pytest.raises(
            InputError,
            match=f"Mine.kind: expected a name such as 'my-lq', got '{kind}'",
        ):
            register_controller(of_kind(kind))
    first = of_kind("my-lq")
    assert register_controller(first) is register_controller(first) is first
    assert registry.controller_kinds()[-1] == "my-lq"
    assert registry.registered_modules() == ("mine",)
    assert registry.controller_class("my-lq") is first


def test_a_base_is_a_classical_controller_of_a_file_or_none(tmp_path):
    task = find_task("sharp-turns")
    made = LQ.from_model(task.ship, integral_lengths=33.0)
    made.save(tmp_path / "mine.json")
    base = design_base(str(tmp_path / "mine.json"), task)
    assert base.gains == made.gains
    assert design_base("none", task) is None
    random_policy(task.ship).save(tmp_path / "learned.json")
    with pytest.raises(
        InputError,
        match=r"learned\.json: expected a classical controller, got a learned",
    ):
        design_base(str(tmp_path / "learned.json"), task)
