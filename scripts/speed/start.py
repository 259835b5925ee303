"""From a fresh process to the first step, with a filled and with an empty cache."""

from __future__ import annotations

import tempfile

import numpy as np

from speed.measure import MODEL, Row, run_python

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

COLD_START = """
import sys, time
import gymnasium, numpy as np, shipgym
env = gymnasium.make("shipgym/CourseKeeping-v0", model=sys.argv[1], sea=sys.argv[2])
env.reset(seed=0)
env.step(np.zeros(1, dtype=np.float32))
print(time.process_time())
"""

WORKERS = """
import resource, sys, time
import gymnasium
from stable_baselines3.common.vec_env import SubprocVecEnv

name, n = sys.argv[1], int(sys.argv[2])
start = time.perf_counter()
makers = [lambda: __import__("gymnasium").make(name)] * n
env = SubprocVecEnv(makers, start_method="spawn")
env.reset()
env.step([env.action_space.sample() for _ in range(n)])
wall = time.perf_counter() - start
env.close()
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(wall, used.ru_utime + used.ru_stime)
"""


def start_up() -> list[Row]:
    """Import, and `gymnasium.make` up to a step with a warm cache, in new processes."""
    code = FIRST_STEP.format(model=MODEL)
    runs = np.array([run_python(code) for _ in range(5)])
    imported, first_step = runs.min(axis=0)
    (bare,) = run_python(
        "import time; s = time.perf_counter(); import gymnasium;"
        " print(time.perf_counter() - s)"
    )
    return [
        Row(
            "import shipgym",
            f"{imported:.2f} s",
            f"import gymnasium {bare:.2f} s",
            imported / bare,
            "0.3 s",
        ),
        Row(
            "import to first step, warm cache", f"{first_step:.2f} s", "", None, "0.6 s"
        ),
    ]


def cold_start(sea: str, aim: str) -> Row:
    """Processor time to the first step of a new process, on empty and filled caches."""
    with tempfile.TemporaryDirectory() as cache:
        (cold,), (warm,) = (
            run_python(COLD_START, MODEL, sea, SHIPGYM_CACHE=cache) for _ in range(2)
        )
    what = f"first environment, {sea} sea, empty cache"
    return Row(
        what,
        f"{cold:.1f} s of processor",
        f"filled cache {warm:.1f} s",
        cold / warm,
        aim,
    )


def cold_workers() -> list[Row]:
    """Time of stable-baselines3's workers started at once without cache; CartPole's."""

    def taken(env_id: str, n: int) -> tuple[float, float]:
        with tempfile.TemporaryDirectory() as cache:
            wall, processor = run_python(WORKERS, env_id, str(n), SHIPGYM_CACHE=cache)
        return wall, processor

    rows = []
    for env, aim in (
        ("shipgym:shipgym/CourseKeeping-v0", "1.3 times"),
        ("CartPole-v1", ""),
    ):
        one, four = taken(env, 1), taken(env, 4)
        ours, single = (
            f"{wall:.1f} s, {processor:.1f} s of processor"
            for wall, processor in (four, one)
        )
        what = (
            f"SubprocVecEnv of {env.rpartition('/')[2]}, 4 spawned workers, empty cache"
        )
        rows.append(Row(what, ours, f"one worker {single}", four[0] / one[0], aim))
    return rows
