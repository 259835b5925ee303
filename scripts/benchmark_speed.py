"""How fast shipgym is, as ratios against named alternatives in the same run, on one core.

python scripts/benchmark_speed.py            a table
python scripts/benchmark_speed.py --json     the same for programs
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import gymnasium
import numpy as np
import typer
from rich.console import Console
from rich.table import Table

import shipgym
from identification import TruncatedLSSVM, identify
from identification.lssvm import dense_dual_solution
from shipgym.envs.course_keeping import CourseKeepingEngine
from shipgym.envs.course_keeping_task import CourseKeepingTask
from shipgym.manoeuvres import zigzag
from shipgym.simulation.sensors import Sensors

MODEL = "mariner-tls-svm"
STEPS_IN_PYTHON = """
import os, sys, time
import gymnasium, numpy as np, shipgym
env = gymnasium.make("shipgym/CourseKeeping-v0", model=sys.argv[1])
env.reset(seed=0)
action = np.zeros(1, dtype=np.float32)
env.step(action)
start = time.perf_counter()
for _ in range(2000):
    if any(env.step(action)[2:4]):
        env.reset()
print(2000 / (time.perf_counter() - start))
"""
FIRST_STEP = """
import time
start = time.perf_counter()
import gymnasium, numpy as np, shipgym
imported = time.perf_counter() - start
env = gymnasium.make("shipgym/CourseKeeping-v0", model="{model}")
env.reset(seed=0)
env.step(np.zeros(1, dtype=np.float32))
print(imported, time.perf_counter() - start)
"""


@dataclass(frozen=True)
class Row:
    """One measurement: ours, the alternative, and how they compare."""

    what: str
    ours: str
    alternative: str
    ratio: float | None
    aim: str


def best_time(work: Callable[[], object], repeats: int = 5) -> float:
    """Least time of some repeats, s."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def run_python(code: str, *arguments: str, **environment: str) -> list[float]:
    """Numbers that a fresh Python process prints."""
    result = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return [float(word) for word in result.stdout.split()]


def single_environment(n_steps: int = 200_000) -> Row:
    """Steps per second through `gymnasium.make`, against the same files run as plain Python."""
    env = gymnasium.make("shipgym/CourseKeeping-v0", model=MODEL)
    env.reset(seed=0)
    action = np.zeros(1, dtype=np.float32)

    def fly() -> None:
        for _ in range(n_steps):
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    compiled = n_steps / best_time(fly, 3)
    (plain,) = run_python(STEPS_IN_PYTHON, MODEL, NUMBA_DISABLE_JIT="1")
    return Row(
        "single environment, gymnasium.make",
        f"{compiled / 1e3:.0f} k steps/s",
        f"plain Python {plain / 1e3:.2f} k steps/s",
        compiled / plain,
        "300 k steps/s, 30 times",
    )


def batched_environment(n_envs: int) -> Row:
    """Environment steps per second of the batch engine, one core, against the single environment."""
    task = CourseKeepingTask(episode_steps=10**9)
    engine = CourseKeepingEngine(shipgym.load_model(MODEL), n_envs, task)
    alone = CourseKeepingEngine(shipgym.load_model(MODEL), 1, task)
    steps, actions, action = (
        3_000_000 // n_envs,
        np.zeros((n_envs, 1), np.float32),
        np.zeros((1, 1), np.float32),
    )
    batched = steps * n_envs / best_time(lambda: [engine.step(actions) for _ in range(steps)], 3)
    single = 20_000 / best_time(lambda: [alone.step(action) for _ in range(20_000)], 3)
    return Row(
        f"{n_envs} ships in one batch",
        f"{batched / 1e6:.1f} M steps/s",
        f"one ship at a time {single / 1e3:.0f} k steps/s",
        batched / single,
        "",
    )


def truncated_fit(n_samples: int = 6000, n_terms: int = 15) -> Row:
    """TLS-SVM in primal form against the dense dual system of LS-SVM."""
    random = np.random.default_rng(0)
    X = random.standard_normal((n_samples, n_terms)) @ random.standard_normal((n_terms, n_terms))
    y = X @ random.standard_normal(n_terms) + 0.1 * random.standard_normal(n_samples)
    primal = best_time(lambda: TruncatedLSSVM(C=1e6).fit(X, y), 20)
    dense = best_time(lambda: dense_dual_solution(X, y, C=1e6), 1)
    return Row(
        f"TLS-SVM fit, {n_samples} samples, {n_terms} terms",
        f"{primal * 1e3:.1f} ms",
        f"dense dual solve {dense:.2f} s",
        dense / primal,
        "1000 times",
    )


def refinement() -> Row:
    """Refinement of a 40-coefficient model on four noisy trials, against the regression it starts from."""
    ship = shipgym.load_model("mariner")
    plan = ((10, 10), (15, 15), (20, 20), (30, 20))
    trials = [
        Sensors(sampling_s=1.0)
        .measure(zigzag(ship, *angles, duration=400.0), seed)
        .with_(name=f"zigzag {seed}")
        for seed, angles in enumerate(plan)
    ]

    def fit(method: str) -> float:
        return best_time(
            lambda: identify(trials, method=method, particulars=ship.particulars, steering=ship.steering), 2
        )

    refined, start = fit("output-error"), fit("tls-svm")
    return Row(
        "identify by output error, 40 coefficients, 4 trials",
        f"{refined:.1f} s",
        f"its start, TLS-SVM {start:.2f} s",
        start / refined,
        "10 s",
    )


def start_up() -> list[Row]:
    """Import, and `gymnasium.make` up to the first step with a warm cache, in fresh processes."""
    code = FIRST_STEP.format(model=MODEL)
    runs = np.array([run_python(code) for _ in range(5)])
    imported, first_step = runs.min(axis=0)
    (bare,) = run_python(
        "import time; s = time.perf_counter(); import gymnasium; print(time.perf_counter() - s)"
    )
    return [
        Row(
            "import shipgym", f"{imported:.2f} s", f"import gymnasium {bare:.2f} s", imported / bare, "0.3 s"
        ),
        Row("import to first step, warm cache", f"{first_step:.2f} s", "", None, "0.6 s"),
    ]


def main(as_json: bool = typer.Option(False, "--json", help="Print JSON instead of a table.")) -> None:
    """Measure and print."""
    rows = [
        single_environment(),
        *(batched_environment(n) for n in (64, 1024, 4096)),
        truncated_fit(),
        refinement(),
        *start_up(),
    ]
    if as_json:
        print(json.dumps([asdict(row) for row in rows], indent=1))
        return
    table = Table("", "shipgym", "against", "ratio", "aim")
    for row in rows:
        ratio = "" if row.ratio is None else f"{row.ratio:,.1f}"
        table.add_row(row.what, row.ours, row.alternative, ratio, row.aim)
    Console(width=140).print(table)


if __name__ == "__main__":
    typer.run(main)
