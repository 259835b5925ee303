"""Direct search: it finds a known optimum within its budget, and refuses loops that are
not sane."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from direct_search import (
    FIRST_SEED,
    LAWS,
    REFUSED,
    Setting,
    is_sane,
    search,
    search_spaces,
    tunable,
    tune,
)

from agents import PID
from agents.controllers.designs import CLASSICAL, design, design_base, tuned
from agents.rollouts.rollout import episode_costs
from agents.suites.reference import load_tuned
from agents.suites.suite import BenchmarkTask, load_suite
from shipgym.errors import InputError
from shipgym.files import write_json

CALM = BenchmarkTask("calm", "course-keeping", "mariner", "", {"episode_steps": 60})
NOISY = BenchmarkTask(
    "noisy", "course-keeping", "mariner", "", {"episode_steps": 60, "noise": 5.0}
)
PATH = BenchmarkTask("path", "path-following", "mariner", "", {"episode_steps": 60})


def bowl(asked: Mapping[str, float]) -> float:
    return 1.0 + float(np.log(asked["a"] / 3.0) ** 2 + np.log(asked["b"] / 0.05) ** 2)


def test_it_finds_the_bottom_of_a_bowl() -> None:
    found = search(bowl, [[Setting("a", 1.0), Setting("b", 0.1)]], 80)
    assert found.settings["a"] == pytest.approx(3.0, rel=0.02)
    assert found.settings["b"] == pytest.approx(0.05, rel=0.02)
    assert found.cost == pytest.approx(1.0, abs=1e-3)
    assert found.start_cost == bowl({"a": 1.0, "b": 0.1})
    assert found.evaluations <= 80


def test_bounds_budget_and_alternatives_hold() -> None:
    asked: list[float] = []

    def cost(settings: Mapping[str, float]) -> float:
        asked.append(settings["a"])
        return (
            REFUSED
            if settings["a"] < 0.8
            else settings["a"] + (0.0 if "c" in settings else 10.0)
        )

    found = search(
        cost,
        [
            [Setting("a", 1.0, 0.5, 2.0)],
            [Setting("a", 1.0, 0.5, 2.0), Setting("c", 1.0)],
        ],
        25,
    )
    assert "c" in found.settings
    assert found.settings["a"] == pytest.approx(0.8, abs=0.05)
    assert found.start_cost == 11.0
    assert found.evaluations == len(asked) <= 25
    assert all(0.5 <= one <= 2.0 for one in asked)
    with pytest.raises(InputError, match="every start is refused"):
        search(lambda settings: REFUSED, [[Setting("a", 1.0)]], 5)


def test_tuning_is_reproducible_never_worse_than_the_design_and_sane() -> None:
    first, second = (tune("pid", NOISY, evaluations=8, episodes=4) for _ in range(2))
    assert first == second
    assert first.cost < first.start_cost
    controller = design("pid", NOISY, first.settings)
    assert is_sane(controller)
    seeds = FIRST_SEED + np.arange(4)
    assert episode_costs(controller, NOISY.engine(4), seeds).mean() == pytest.approx(
        first.cost, rel=1e-12
    )
    assert episode_costs(
        PID.from_model(CALM.ship), NOISY.engine(4), seeds
    ).mean() == pytest.approx(first.start_cost)


def test_a_loop_with_little_margin_is_not_sane() -> None:
    plain = PID.from_model(CALM.ship)
    assert is_sane(plain)
    assert not is_sane(
        replace(plain, margins=replace(plain.margins, phase_margin_deg=10.0))
    )
    assert not is_sane(replace(plain, margins=replace(plain.margins, gain_margin=1.2)))


@pytest.mark.parametrize("kind", CLASSICAL)
def test_the_search_of_every_controller_starts_at_its_own_design(kind: str) -> None:
    task = PATH if kind in LAWS else CALM
    start = {one.name: one.start for one in search_spaces(kind, task)[0]}
    designed, plain = design(kind, task, start), design(kind, task, {})
    assert designed.design == pytest.approx(plain.design, rel=1e-6)
    for name, gain in plain.gains.items():
        assert designed.gains[name] == pytest.approx(gain, rel=1e-6), name


def test_guidance_needs_a_path() -> None:
    assert tunable(PATH) == CLASSICAL
    assert set(CLASSICAL) - set(tunable(CALM)) == set(LAWS)


def test_guidance_leads_the_lq_that_was_tuned_and_needs_a_path() -> None:
    led = design("los", PATH, {"lookahead_lengths": 3.0, "lq_integral_lengths": 50.0})
    inner = design("lq", PATH, {"integral_lengths": 50.0})
    assert getattr(led, "autopilot").gains == inner.gains  # noqa: B009
    for ask in (search_spaces, lambda kind, task: design(kind, task, {})):
        with pytest.raises(InputError, match="expected a path for 'los'"):
            ask("los", CALM)


def test_settings_found_are_read_from_the_file_of_the_suite(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "tuned.json"
    monkeypatch.setattr("agents.suites.reference.suite_file", lambda suite, what: path)
    found = {
        "pid": {"settings": {"damping": 1.0}, "cost": 2.0},
        "lq": {"settings": {}, "cost": 3.0},
    }
    write_json({"tasks": {"calm": found}}, path)
    assert tuned("best", CALM, "any").kind == "pid"
    assert tuned("pid", CALM, "any").design["damping"] == 1.0
    with pytest.raises(
        InputError, match="for task 'calm' of suite 'any', 'pid', 'lq', got 'lqg'"
    ):
        tuned("lqg", CALM, "any")
    with pytest.raises(
        InputError, match=r"task of suite 'any' with tuned controllers, got 'noisy'"
    ):
        tuned("best", NOISY, "any")


def test_policies_are_not_added_to_slow_controllers_unless_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "tuned.json"
    monkeypatch.setattr("agents.suites.reference.suite_file", lambda suite, what: path)
    costs = {"mpc": 1.0, "lq": 3.0, "pid": 4.0}
    found = {kind: {"settings": {}, "cost": cost} for kind, cost in costs.items()}
    write_json({"tasks": {"calm": found}}, path)
    base = design_base("tuned", replace(CALM, suite="shipgym-v1"))
    assert getattr(base, "kind", None) == "lq"
    del found["lq"], found["pid"]
    write_json({"tasks": {"calm": found}}, path)
    with pytest.raises(
        InputError, match="for task 'calm' of suite 'any', 'mpc', got 'base'"
    ):
        tuned("base", CALM, "any")


def test_the_suite_s_settings_make_sane_controllers_for_every_task() -> None:
    suite, found = load_suite(), load_tuned("shipgym-v1")
    tasks = [task.design_task for task in suite.tasks if task.on == "ship"]
    assert set(found) == {task.name for task in tasks}
    for task in tasks:
        for kind in ("base", "best"):
            assert is_sane(tuned(kind, task, suite.name))
        assert set(found[task.name]) == {"lq", "ilos", "wheel-over"}
        assert all(
            one["cost"] <= one["start_cost"] for one in found[task.name].values()
        )
