"""Golden section `rollouts`: what episodes cost, how courses and paths are kept, replays, the suites."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from agents import LQ, PID, WheelOver
from agents.rollouts import metrics, replay_series
from agents.rollouts.course_keeping import sail, step_response
from agents.rollouts.episodes import recorded
from agents.rollouts.rollout import episode_costs, rollout
from agents.suites.reference import best_costs, load_tuned, reference_costs
from agents.suites.suite import BenchmarkTask, load_suite, parse_suite
from shipgym import ShipModel, load_model
from shipgym.tasks.task import Task
from tests.golden.store import Floats, numbers_in, vector

#: Commands are in single precision.
TOLERANCES = {"": 1e-5}
SUITE = """
name = "mine-v1"
[tasks.a]
environment = "course-keeping"
model = "mariner"
options = { noise = 0.7, dt = 1.3 }
[tasks.b]
environment = "path-following"
model = "mariner-tls-svm"
ship = "mariner"
sea = { current = { speed = 0.5, towards_deg = 90.0 } }
far = { rudder_weight = 0.7, gear = { rudder_rate_deg_s = 1.7 }, sea = "rough" }
"""


def cases() -> list[str]:
    """Parts of the package."""
    return [
        "courses",
        "paths",
        "ends",
        "failing",
        "fleet",
        "steps",
        "replay",
        "functions",
        "suites",
    ]


def record(case: str) -> dict[str, Floats]:
    """The values of a case."""
    found: dict[str, Floats] = globals()[f"of_{case}"]()
    return found


class Failing:
    """PID that gives one ship no number at the fifth step, and raises an error at the twelfth."""

    def __init__(self, model: ShipModel) -> None:
        self.inner, self.calls = PID.from_model(model), 0

    def predict(self, observation: Any, state: Any = None, *more: Any) -> Any:
        """Commands of a policy of a user."""
        self.calls += 1
        action, _ = self.inner.predict(observation)
        if self.calls == 5:
            action[1] = np.nan
        if self.calls == 12:
            raise ValueError("no such thing")
        return action, state


def figures(policy: Any, task: BenchmarkTask, seeds: int = 3) -> dict[str, Floats]:
    """Figures of a few episodes."""
    return dict(metrics.evaluate(policy, task, np.arange(seeds)).figures)


def keeping(**options: Any) -> BenchmarkTask:
    """Course keeping with the Mariner."""
    return BenchmarkTask(
        "keeping",
        "course-keeping",
        "mariner",
        options={"episode_steps": 190, **options},
    )


def of_courses() -> dict[str, Floats]:
    """Course changes under LQ in noise, and under PID that steers hard, in two seas."""
    model = load_model("mariner")
    hard = PID.from_model(model)
    hard = replace(
        hard, gains={**hard.gains, "derivative": 0.4 * hard.gains["derivative"]}
    )
    calm = figures(
        LQ.from_model(model), keeping(course_changes_deg=[20.0, -33.0], noise=1.0)
    )
    found = {f"lq {name}": values for name, values in calm.items()}
    rough = figures(hard, keeping(course_change_deg=47.0))
    return found | {f"pid {name}": values for name, values in rough.items()}


def of_paths() -> dict[str, Floats]:
    """Paths under wheel-over, and under one whose turns are late, so that she leaves the corridor."""
    options = {"episode_steps": 700, "n_legs": 2, "corridor": 0.35, "ground": 0.9}
    found = {}
    for name, more in {
        "in time": {},
        "late": {"reach_lengths": 0.02, "lookahead_lengths": 6.0},
    }.items():
        task = BenchmarkTask("path", "path-following", "mariner", options=options)
        guide = WheelOver.from_model(task.ship, task=task.task, **more)
        found |= {
            f"{name} {one}": values for one, values in figures(guide, task).items()
        }
        found[f"{name} worst"] = vector(metrics.worst_step_cost(task.task))
    return found


def of_ends() -> dict[str, Floats]:
    """Episodes in which control is lost, of a ship with a shaft."""
    task = BenchmarkTask(
        "lost",
        "course-keeping",
        "kvlcc2",
        options={"max_heading_error_deg": 13.0, "course_change_deg": 12.5},
    )
    weak = PID.from_model(task.ship, frequency=0.06)
    weak = replace(weak, gains={**weak.gains, "derivative": 0.0, "proportional": -0.1})
    found = figures(weak, task) | {"worst": vector(metrics.worst_step_cost(task.task))}
    return found | {"costs": episode_costs(weak, task.engine(2), np.array([4, 9]))}


def of_failing() -> dict[str, Floats]:
    """What is charged for a policy that fails, when it is tolerated, and what is kept of its episodes."""
    task = keeping(episode_steps=30)
    found = figures(Failing(task.ship), task)
    run = rollout(
        Failing(task.ship), task.engine(3), np.arange(3), record=True, tolerant=True
    )
    kept = recorded(Failing(task.ship), task, [3, 4, 5], samples=10)
    parts = {
        "costs": run.costs,
        "failed": vector(run.failed),
        "sailing": run.steps,
        "kept": kept.costs,
    }
    parts["lengths"] = vector(
        [-1 if one is None else one.n_steps for one in kept.episodes]
    )
    parts["asked"] = vector(
        [len(run.actions), len(run.rewards), len(run.states["psi"]), len(run.failure)]
    )
    return found | parts


def ships() -> list[ShipModel]:
    """The Mariner, and one with another rudder."""
    model = load_model("mariner")
    changed = {
        name: value * (0.8 if name.endswith("_d") else 1.0)
        for name, value in model.coefficients.items()
    }
    return [model, replace(model, coefficients=changed)]


def of_fleet() -> dict[str, Floats]:
    """Episodes of two ships, with seeds for each, and of one with a table of seeds."""
    pilot, task = LQ.from_model(ships()[0]), Task.of("CourseKeeping", episode_steps=90)
    many = sail(pilot, ships(), task, [[3, 4, 5], [6, 7, 8]])
    found = {f"many {name}": vector(values) for name, values in vars(many).items()}
    alone = sail(pilot, ships()[0], task, [[3], [8]])
    both = sail(pilot, ships(), task, 5)
    return found | {
        "alone": vector(alone.cost),
        "both": vector(both.cost),
        "shape": vector(alone.cost.shape),
    }


def of_steps() -> dict[str, Floats]:
    """Responses to steps of the set-point to both sides, of given length and of the usual."""
    pilot = LQ.from_model(ships()[0])
    usual, port = (
        step_response(pilot, ships()),
        step_response(pilot, ships()[1], -13.0, duration=47.3),
    )
    hard = step_response(
        PID.from_model(ships()[0]),
        ships()[0],
        60.0,
        task=Task.of("CourseKeeping", dt=1.7),
    )
    rows = {"usual": usual, "port": port, "hard": hard}
    return {
        f"{name} {part}": vector(np.atleast_2d(values)[:, ::9])
        for name, one in rows.items()
        for part, values in one._asdict().items()
    }


def of_replay() -> dict[str, Floats]:
    """What the page of replays shows of episodes on a course, and on a path of a ship that rolls."""
    calm, sea = keeping(episode_steps=40), {"sea": "moderate", "episode_steps": 50}
    path = BenchmarkTask(
        "path", "path-following", "container", options={**sea, "roll": True}
    )
    found = {}
    for name, task in {"course": calm, "path": path}.items():
        policy: Any = PID.from_model(task.ship)
        one, other = recorded(policy, task, [2, 3], samples=15).episodes
        for k, episode in enumerate(one_ for one_ in (one, other) if one_ is not None):
            run = replay_series.run(f"{k}", episode)
            shown = len(replay_series.quantities([run]))
            found |= numbers_in({**run, "shown": shown}, f"{name} {k}")
    return found


def of_functions() -> dict[str, Floats]:
    """Reversals, figures of steps, sums and quotients of numbers made up."""
    t = np.linspace(0.0, 20.0, 200)
    angle = np.stack(
        [0.1 * np.sin(t), 0.004 * np.sin(3.0 * t) + 0.01 * np.sin(t), 0.02 * t], axis=-1
    )
    going = t[1:, None] < [15.0, 20.0, 20.0]
    swings = [
        np.exp(-0.2 * t) * np.cos(t),
        -0.4 * np.exp(-0.05 * t) * np.cos(1.3 * t),
        0.3 + 0.0 * t,
        0.1 * np.exp(-t),
    ]
    return {
        "reversals": metrics.reversals(angle, going),
        "fine": metrics.reversals(angle, going, 0.002),
        "changes": vector([metrics.step_figures(error, 0.7) for error in swings]),
        "total": metrics.total(angle[:3]),
        "nothing": metrics.total(angle[:0]),
        "ratio": metrics.ratio(np.array([1.3, 2.0]), np.array([0.7, 0.0])),
        "rounded": vector(
            replay_series.rounded(
                np.array([1234.56789123, -0.00012345678912, 0.0, 7e-10])
            )
        ),
    }


def of_suites() -> dict[str, Floats]:
    """Tasks of the suites: their scales, intervals and weights, the ships behind them, best costs."""
    found: dict[str, Floats] = {}
    own, tasks = parse_suite(SUITE, "mine").tasks, load_suite().tasks
    for task in (*tasks[:9], *own):
        ship, asked, _ = task.evaluation
        gear = [ship.steering.limit, ship.steering.rate, ship.steering.time_constant]
        scales = [one.scale for one in asked.observed(ship)]
        told = [
            asked.interval(ship),
            asked.episode_steps,
            asked.rudder_weight,
            len(task.design_task.name),
            len(task.env_id),
        ]
        found[f"{task.on} {task.name}"] = vector(
            [*gear, *scales, *told, *task.seeds[[0, -1]]]
        )
    found |= numbers_in(reference_costs("shipgym-v1"), "reference")
    found["best"] = best_costs(tasks[0])[::9]
    return found | numbers_in(load_tuned("shipgym-v1")["sharp-turns"], "tuned")
