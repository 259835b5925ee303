"""Search of settings by CMA-ES: it finds a known optimum within its budget, is no worse
than the design, and refuses loops with little margin."""

from dataclasses import replace

import pytest

from agents import PID
from agents.controllers.designs import design, tuned
from agents.controllers.registry import CLASSICAL
from agents.suites.benchmark_task import BenchmarkTask
from agents.suites.suite import load_suite, load_tuned
from agents.training.controller_search import (
    SearchBudget,
    has_margin,
    tune_controller,
)
from agents.training.controller_space import search_space
from shipgym.errors import InputError

CALM = BenchmarkTask("calm", "course-keeping", "mariner", "", {"episode_steps": 60})
NOISY = BenchmarkTask(
    "noisy", "course-keeping", "mariner", "", {"episode_steps": 60, "noise": 5.0}
)
PATH = BenchmarkTask("path", "path-following", "mariner", "", {"episode_steps": 60})


def test_a_search_is_reproducible_and_not_worse_than_the_design() -> None:
    budget = SearchBudget(evaluations=30, episodes=4)
    first, second = (tune_controller("pid", NOISY, budget) for _ in range(2))
    assert replace(first, seconds=0.0) == replace(second, seconds=0.0)
    assert first.cost <= first.start_cost
    assert has_margin(design("pid", NOISY, first.settings))


def test_a_loop_with_little_margin_is_refused() -> None:
    plain = PID.from_model(CALM.ship)
    assert has_margin(plain)
    for few in ({"phase_margin_deg": 10.0}, {"gain_margin": 1.2}):
        assert not has_margin(replace(plain, margins=replace(plain.margins, **few)))


@pytest.mark.parametrize("kind", CLASSICAL)
def test_every_search_starts_at_the_design(kind: str) -> None:
    """Where a factor cannot be 0, from a small one."""
    start = {setting.name: setting.start for setting in search_space(kind, PATH)}
    designed, plain = design(kind, PATH, start), design(kind, PATH, {})
    loose = {"rel": 0.6, "abs": 1e-3} if kind == "preview-lq" else {"rel": 1e-6}
    for name, gain in plain.gains.items():
        assert designed.gains[name] == pytest.approx(gain, **loose), name


def test_guidance_leads_the_lq_that_was_tuned_and_needs_a_path() -> None:
    led = design("ilos", PATH, {"lookahead_lengths": 3.0, "lq_integral_lengths": 50.0})
    inner = design("lq", PATH, {"integral_lengths": 50.0})
    assert getattr(led, "autopilot").gains == inner.gains  # noqa: B009
    for ask in (search_space, design):
        with pytest.raises(InputError, match="expected a path for 'ilos'"):
            ask("ilos", CALM)


def test_the_suite_s_settings_make_sane_controllers_for_every_task() -> None:
    suite, found = load_suite(), load_tuned("shipgym-v1")
    for name, kinds in found.items():
        task = suite.task(name).design_task
        for kind, runs in kinds.items():
            assert has_margin(tuned(kind, task, suite.name, len(runs) - 1))
            assert all(one["cost"] <= one["start_cost"] for one in runs)
