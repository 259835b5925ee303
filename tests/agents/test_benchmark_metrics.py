from types import SimpleNamespace

import numpy as np
import pytest

from agents.rollouts.metrics import (
    evaluate,
    path_following,
    steering,
    succeeded,
    worst_step_cost,
)
from agents.suites.benchmark_task import BenchmarkTask

KEEPING = BenchmarkTask(
    "keeping", "course-keeping", "mariner", options={"episode_steps": 250}
)
PATH = BenchmarkTask(
    "path", "path-following", "mariner", options={"episode_steps": 450, "n_legs": 1}
)
SEEDS = np.arange(1_000_000, 1_000_006)


class Steers:
    """Hands back what a function makes of the number of the call and the
    observations."""

    def __init__(self, answer):
        self.answer, self.calls = answer, 0

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.calls += 1
        return self.answer(self.calls - 1, observation), state


def steady(rudder):
    return Steers(lambda call, seen: np.full((len(seen), 1), rudder, dtype=np.float32))


def test_figures_of_steering_and_of_paths_by_hand():
    """Two episodes of 4 and 2 intervals of 3 s; what is recorded later or at the
    beginning does not count."""
    sailing = np.array([[1, 1], [1, 1], [1, 0], [1, 0]], dtype=np.bool_)
    run = SimpleNamespace(
        sailing=sailing,
        steps=sailing.sum(axis=0).astype(float),
        dt=3.0,
        costs=np.zeros(2),
        task=PATH.task,
    )
    run.histories = {
        "delta": np.radians([[0, 0], [2, 1], [-2, 1], [1, 9], [1, 0]]),
        "heading_error": np.radians([[9, 9], [3, -1], [4, 1], [0, 9], [0, 9]]),
        "cross_track": np.array(
            [[9.0, 9.0], [3.0, -1.0], [-4.0, 1.0], [0.0, 9.0], [0.0, 9.0]]
        ),
        "in_corridor": np.array([[0, 0], [1, 1], [0, 1], [0, 0], [1, 0]]),
        "success": np.array([[0, 0], [0, 0], [0, 1], [1, 0], [1, 0]]),
    }
    turned = steering(run)
    assert turned["heading_rmse_deg"] == pytest.approx([2.5, 1.0])
    assert turned["rudder_travel_deg_min"] == pytest.approx([9.0 / 0.2, 1.0 / 0.1])
    assert turned["rudder_reversals_min"] == pytest.approx([2.0 / 0.2, 0.0])
    followed = {name: values.tolist() for name, values in path_following(run).items()}
    assert followed == {
        "cross_track_rmse_m": [2.5, 1.0],
        "outside_corridor": [0.5, 0.0],
    }
    assert succeeded(run).tolist() == [1.0, 1.0]


FAILURES = {
    "nan for one ship": (
        lambda call, seen: np.where(
            (np.arange(len(seen)) == 1) & (call >= 50), np.nan, 0.0
        ).reshape(-1, 1)
    ),
    "another shape": lambda call, seen: np.zeros((len(seen), 1 if call < 50 else 2)),
    "an error": lambda call, seen: (
        np.zeros((len(seen), 1)) / (0 if call < 0 else 1)
        if call < 50
        else {}["missing"]
    ),
    "no numbers": lambda call, seen: (
        np.zeros((len(seen), 1)) if call < 50 else [["port"]] * len(seen)
    ),
}


@pytest.mark.parametrize("how", FAILURES)
def test_a_controller_that_fails_is_charged_for_the_rest_and_the_others_go_on(how):
    sails, _ = evaluate(steady(0.0), KEEPING, SEEDS[:3])
    found, run = evaluate(Steers(FAILURES[how]), KEEPING, SEEDS[:3])
    concerned = (
        np.array([False, True, False])
        if how == "nan for one ship"
        else np.ones(3, dtype=np.bool_)
    )
    assert (found["failed"] > 0.0).tolist() == concerned.tolist()
    assert "step 50" in run.failure
    steps = run.steps
    assert (steps[concerned] == 50.0).all()
    np.testing.assert_allclose(
        found["cost_end"][concerned],
        (250 - 50) * worst_step_cost(KEEPING.task),
        rtol=1e-12,
    )
    for name, values in found.items():
        np.testing.assert_array_equal(
            values[~concerned], sails[name][~concerned], err_msg=name
        )
