"""How fast shipgym is, as ratios against named alternatives in the same run, on one core.

python scripts/benchmark_speed.py              a table
python scripts/benchmark_speed.py physics      a part of it
python scripts/benchmark_speed.py --json       the same for programs
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Annotated, Any

import gymnasium
import numpy as np
import typer
from numpy.typing import NDArray
from numpy_ships import numpy_step
from papers.dense_dual import dense_dual_solution
from rich.console import Console
from rich.table import Table

import shipgym
from identification import ArtificialBeeColony, RecursiveLeastSquares, TruncatedLSSVM, TunedLSSVM, identify
from shipgym.checks import check_choice
from shipgym.engine.loops import ship_loop
from shipgym.engine.records import LANES
from shipgym.envs.registration import TASKS, env_id
from shipgym.manoeuvres import zigzag
from shipgym.sea import Current, Waves, Weather, Wind
from shipgym.trials.sensors import Sensors

Floats = NDArray[np.float64]

MODEL = "mariner-tls-svm"
#: Ships whose bare physics is timed, and the aim for them.
FLEET = {
    "mariner": "40 M steps/s, ", MODEL: "40 M steps/s, ", "container": "15 M steps/s, ", "tanker": "",
    "kvlcc2": "",
}  # fmt: skip
SHORT_STEPS, SHORT_REPEATS = 40_960, 200  # ship steps of a few milliseconds, often repeated
STEPS_IN_PYTHON = """
import os, sys, time
import gymnasium, numpy as np, shipgym
env = gymnasium.make("shipgym/CourseKeeping-v0", model=sys.argv[1])
env.reset(seed=0)
action = np.zeros(1, dtype=np.float32)
env.step(action)
least = float("inf")
for _ in range(40):
    start = time.process_time()
    for _ in range(50):
        if any(env.step(action)[2:4]):
            env.reset()
    least = min(least, time.process_time() - start)
print(50 / least)
"""
SYNC_STEPS_IN_PYTHON = """
import sys, time
import gymnasium, numpy as np, shipgym
n = int(sys.argv[3])
env = gymnasium.make_vec(sys.argv[1], num_envs=n, vectorization_mode="sync", model=sys.argv[2])
env.reset(seed=0)
actions = np.zeros((n, 1), dtype=np.float32)
least = float("inf")
for _ in range(5):
    start = time.process_time()
    for _ in range(5):
        env.step(actions)
    least = min(least, time.process_time() - start)
print(5 * n / least)
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
env = SubprocVecEnv([lambda: __import__("gymnasium").make(name)] * n, start_method="spawn")
env.reset()
env.step([env.action_space.sample() for _ in range(n)])
wall = time.perf_counter() - start
env.close()
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(wall, used.ru_utime + used.ru_stime)
"""


@dataclass(frozen=True)
class Row:
    """One measurement: ours, the alternative, and how they compare."""

    what: str
    ours: str
    alternative: str
    ratio: float | None
    aim: str


def best_time(
    work: Callable[[], object], repeats: int = 5, clock: Callable[[], float] = time.process_time
) -> float:
    """Least processor time of some repeats, s.

    Not the clock on the wall, which counts what else the machine does. The caches are shared all the same, so
    that many short repeats are needed to find a moment without other work.
    """
    times = []
    for _ in range(repeats):
        start = clock()
        work()
        times.append(clock() - start)
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


def single_environment(n_steps: int = 1000) -> Row:
    """Steps per second through `gymnasium.make`, against the same files run as plain Python."""
    env = gymnasium.make("shipgym/CourseKeeping-v0", model=MODEL)
    env.reset(seed=0)
    action = np.zeros(1, dtype=np.float32)

    def run() -> None:
        for _ in range(n_steps):
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    compiled = n_steps / best_time(run, SHORT_REPEATS)
    (plain,) = run_python(STEPS_IN_PYTHON, MODEL, NUMBA_DISABLE_JIT="1")
    return Row(
        "single environment, gymnasium.make",
        f"{compiled / 1e3:.0f} k steps/s",
        f"plain Python {plain / 1e3:.2f} k steps/s",
        compiled / plain,
        "300 k steps/s, 30 times",
    )


def native_speed(
    env_id: str, n_envs: int, clock: Callable[[], float] = time.process_time, **options: Any
) -> float:
    """Steps per second of a native vector environment of Gymnasium, by all that its `step` returns."""
    env = gymnasium.make_vec(env_id, num_envs=n_envs, vectorization_mode="vector_entry_point", **options)
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = env.action_space.sample()
    steps = min(max(SHORT_STEPS // n_envs, 1), 500)

    def sail() -> None:
        for _ in range(steps):
            env.step(actions)  # and let go of what it returns, as a learner does that has copied it

    return steps * n_envs / best_time(sail, SHORT_REPEATS, clock)


def native_against_python(task: str, n_envs: int = 64) -> Row:
    """The native vector environment against SyncVectorEnv of the same files run as plain Python."""
    native = native_speed(env_id(task), n_envs, model=MODEL)
    (plain,) = run_python(SYNC_STEPS_IN_PYTHON, env_id(task), MODEL, str(n_envs), NUMBA_DISABLE_JIT="1")
    return Row(
        f"{n_envs} {task}, gymnasium.make_vec",
        f"{native / 1e6:.1f} M steps/s",
        f"SyncVectorEnv in plain Python {plain / 1e3:.2f} k steps/s",
        native / plain,
        "100 times",
    )


def native_against_cart_pole(task: str, n_envs: int = 1024) -> Row:
    """The native vector environment against Gymnasium's own of CartPole."""
    native = native_speed(env_id(task), n_envs, model=MODEL)
    poles = native_speed("CartPole-v1", n_envs)
    return Row(
        f"{n_envs} {task}, gymnasium.make_vec",
        f"{native / 1e6:.1f} M steps/s",
        f"Gymnasium's native CartPole {poles / 1e6:.1f} M steps/s",
        native / poles,
        "3 times",
    )


def learning(task: str) -> Row:
    """Frames per second of PPO with the shipped settings, on two cores, and what part of it is ours."""
    from learning_speed import ppo_speed  # here, because torch takes seconds to import

    frames, share = ppo_speed(env_id(task))
    return Row(
        f"PPO, 256 {task}, two cores",
        f"{frames / 1e3:.1f} k frames/s",
        f"{100.0 * share:.1f} % of the time in the environment",
        None,
        "40 k frames/s, 15 %",
    )


def vector_speed(n_envs: int, task: str = "CourseKeeping", **options: Any) -> float:
    """Environment steps per second of a native vector environment of ours."""
    return native_speed(env_id(task), n_envs, model=MODEL, **options)


def vector_environment(task: str, n_envs: int, aim: str) -> Row:
    """A native vector environment on one core, against one environment at a time."""
    batched, single = vector_speed(n_envs, task), vector_speed(1, task)
    return Row(
        f"{task}, {n_envs} at once",
        f"{batched / 1e6:.1f} M steps/s",
        f"one at a time {single / 1e3:.0f} k steps/s",
        batched / single,
        aim,
    )


def two_threads(n_envs: int = 16384) -> Row:
    """Two threads against one, by the clock on the wall: needs two idle cores."""
    one, two = (vector_speed(n_envs, clock=time.perf_counter, threads=threads) for threads in (1, 2))
    return Row(
        f"CourseKeeping, {n_envs} at once, two threads",
        f"{two / 1e6:.1f} M steps/s",
        f"one thread {one / 1e6:.1f} M steps/s",
        two / one,
        "1.7 times",
    )


def batched_physics(name: str, n_ships: int, aim: str) -> Row:
    """Runge-Kutta steps of the bare ship, one core, against the same equations on NumPy arrays."""
    model = shipgym.load_model(name)
    random = np.random.default_rng(0)
    rudders = np.radians(30.0) * random.uniform(-1.0, 1.0, n_ships)
    states = np.repeat(model.service_state[None], n_ships, axis=0)
    commands = np.column_stack([rudders, np.full(n_ships, model.service_shaft_speed)])
    tiles, ships = n_ships // LANES, model.ship_numbers()[None]
    tiled, orders = (
        np.ascontiguousarray(a.reshape(tiles, LANES, -1).transpose(0, 2, 1)).reshape(tiles, -1)
        for a in (states, commands)
    )
    h, steps = 0.01 * model.particulars["length"] / model.particulars["speed"], SHORT_STEPS // n_ships
    advance, on_arrays = ship_loop(model.vessel, "alike"), numpy_step(model)
    columns, shafts = tuple(np.ascontiguousarray(states.T)), np.ascontiguousarray(commands[:, 1])
    compiled = steps * n_ships / best_time(lambda: advance(tiled, orders, h, steps, ships), SHORT_REPEATS)
    plain = n_ships / best_time(lambda: on_arrays(columns, rudders, shafts, h), SHORT_REPEATS)
    return Row(
        f"physics of {n_ships} ships, {name}",
        f"{compiled / 1e6:.1f} M steps/s",
        f"NumPy {plain / 1e6:.2f} M steps/s",
        compiled / plain,
        f"{aim}10 times",
    )


def weather(n_envs: int) -> Row:
    """A native vector environment with current, wind and waves, against calm water."""
    sea = Weather(current=Current(1.0, variation=0.2), wind=Wind(12.0), waves=Waves(3.25, 9.7))
    rough, calm = vector_speed(n_envs, sea=sea), vector_speed(n_envs)
    return Row(
        f"CourseKeeping, {n_envs} at once, in current, wind and waves",
        f"{rough / 1e6:.1f} M steps/s",
        f"calm {calm / 1e6:.1f} M steps/s",
        rough / calm,
        "0.5",
    )


def kernel_ship(n_envs: int = 1024, centres: int = 64) -> Row:
    """A black-box ship with radial basis functions, against their sums alone on NumPy arrays."""
    ship = shipgym.load_model("kvlcc2-l7")
    trials = [
        zigzag(ship, angle, angle, duration=100.0, dt=0.2, port_first=port).with_(name=f"{angle} {port}")
        for angle in (10, 20)
        for port in (False, True)
    ]
    model = identify(
        trials, kernel="rbf", centres=centres, kernel_length=1.4, C=100.0, particulars=ship.particulars,
        steering=ship.steering,
    ).model  # fmt: skip
    native = native_speed("shipgym/CourseKeeping-v0", n_envs, model=model)
    states = {name: np.full(n_envs, value) for name, value in zip("uvr", (1.0, 0.1, 0.01), strict=True)}
    states["delta"] = np.linspace(-0.5, 0.5, n_envs)
    stage = best_time(lambda: model.table.features("r", states, model.particulars), 50)
    return Row(
        f"CourseKeeping, {n_envs} kernel ships of {centres} centres",
        f"{native / 1e6:.1f} M steps/s",
        f"their centres alone in NumPy {n_envs / (4.0 * stage) / 1e6:.2f} M steps/s",
        native * 4.0 * stage / n_envs,
        "3 M steps/s",
    )


def made_up_regression(n_samples: int, n_terms: int) -> tuple[Floats, Floats]:
    """Correlated features and noisy targets."""
    random = np.random.default_rng(0)
    X = random.standard_normal((n_samples, n_terms)) @ random.standard_normal((n_terms, n_terms))
    return X, X @ random.standard_normal(n_terms) + 0.1 * random.standard_normal(n_samples)


def truncated_fit(n_samples: int, aim: str, n_terms: int = 15) -> Row:
    """TLS-SVM in primal form, its L-curve included, against the dense dual system of LS-SVM."""
    X, y = made_up_regression(n_samples, n_terms)
    primal = best_time(lambda: TruncatedLSSVM(C=1e6).fit(X, y), 200)
    dense = best_time(lambda: dense_dual_solution(X, y, C=1e6), 3 if n_samples < 3000 else 1)
    return Row(
        f"TLS-SVM fit, {n_samples} samples, {n_terms} terms",
        f"{primal * 1e3:.2f} ms",
        f"dense dual solve {dense:.2f} s",
        dense / primal,
        aim,
    )


def bee_colony_search(objective: str, n_samples: int = 1800, n_terms: int = 7) -> Row:
    """Search for C by the bee colony of Zhu 2018 (20 sources, 30 rounds), against ten times the samples."""

    def least(n: int) -> float:
        X, y = made_up_regression(n, n_terms)
        machine = TunedLSSVM(optimiser=ArtificialBeeColony(20, 30, 20), objective=objective)
        return best_time(lambda: machine.fit(X, y), 50)

    once, tenfold = least(n_samples), least(10 * n_samples)
    return Row(
        f"bee colony, {objective} error, {n_samples} samples",
        f"{once * 1e3:.1f} ms",
        f"{10 * n_samples} samples {tenfold * 1e3:.1f} ms",
        tenfold / once,
        "10 ms, ratio at most 10",
    )


def zigzag_run() -> Row:
    """A 20/20 zigzag of 600 s at 0.1 s, the Trial included."""
    ship = shipgym.load_model(MODEL)
    shipgym.manoeuvres.zigzag(ship, 20.0, 20.0)
    seconds = best_time(lambda: shipgym.manoeuvres.zigzag(ship, 20.0, 20.0), 20)
    return Row("zigzag 20/20, 600 s at 0.1 s", f"{1e3 * seconds:.1f} ms", "", None, "5 ms")


def recursive_updates(n_samples: int = 50_000, n_terms: int = 15) -> Row:
    """Recursive least squares with forgetting, sample by sample, against the same update in NumPy."""
    random = np.random.default_rng(0)
    X = random.standard_normal((n_samples, n_terms))
    y = X @ random.standard_normal(n_terms) + 0.1 * random.standard_normal(n_samples)
    machine = RecursiveLeastSquares(forgetting=0.999).update(X[:100], y[:100])

    def in_numpy(n: int = 2000) -> None:
        theta, P = np.zeros(n_terms), 1e6 * np.eye(n_terms)
        for phi, target in zip(X[:n], y[:n], strict=True):
            gain = P @ phi
            gain /= 0.999 + phi @ gain
            theta += gain * (target - phi @ theta)
            P = (P - np.outer(gain, phi @ P)) / 0.999

    compiled = n_samples / best_time(lambda: machine.update(X, y))
    plain = 2000 / best_time(in_numpy)
    return Row(
        f"recursive least squares, {n_terms} coefficients",
        f"{compiled / 1e6:.2f} M updates/s",
        f"NumPy {plain / 1e6:.3f} M updates/s",
        compiled / plain,
        "1 M updates/s",
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


def cold_start(sea: str, aim: str) -> Row:
    """Processor time to the first step of a fresh process, on an empty cache and on a filled one."""
    with tempfile.TemporaryDirectory() as cache:
        (cold,), (warm,) = (run_python(COLD_START, MODEL, sea, SHIPGYM_CACHE=cache) for _ in range(2))
    what = f"first environment, {sea} sea, empty cache"
    return Row(what, f"{cold:.1f} s of processor", f"filled cache {warm:.1f} s", cold / warm, aim)


def cold_workers() -> list[Row]:
    """Workers of stable-baselines3 that start at once on an empty cache, against one; and CartPole's."""

    def used(env_id: str, n: int) -> tuple[float, float]:
        with tempfile.TemporaryDirectory() as cache:
            wall, processor = run_python(WORKERS, env_id, str(n), SHIPGYM_CACHE=cache)
        return wall, processor

    rows = []
    for env, aim in (("shipgym:shipgym/CourseKeeping-v0", "1.3 times"), ("CartPole-v1", "")):
        one, four = used(env, 1), used(env, 4)
        told = (f"{processor:.1f} s of processor, {wall:.0f} s" for wall, processor in (four, one))
        ours, single = told
        what = f"SubprocVecEnv of {env.rpartition('/')[2]}, 4 spawned workers, empty cache"
        rows.append(Row(what, ours, f"one worker {single}", four[1] / one[1], aim))
    return rows


#: What is measured, by group; each is called when it is its turn.
GROUPS: dict[str, list[Callable[[], Row | list[Row]]]] = {
    "environments": [
        single_environment,
        *(
            partial(vector_environment, task, n, aim)
            for task in ("CourseKeeping", "PathFollowing")
            for n, aim in ((64, "15 M steps/s"), (1024, "35 M steps/s"), (4096, "40 M steps/s"))
        ),
        *(partial(weather, n) for n in (1024, 4096)),
        kernel_ship,
        partial(kernel_ship, centres=100),
        two_threads,
        *(partial(native_against_python, task) for task in TASKS),
        *(partial(native_against_cart_pole, task) for task in TASKS[:2]),
    ],
    "learning": [partial(learning, task) for task in TASKS],
    "physics": [
        *(partial(batched_physics, ship, n, aim) for ship, aim in FLEET.items() for n in (1024, 4096)),
        zigzag_run,
    ],
    "identification": [
        partial(truncated_fit, 1800, "500 times"),
        partial(truncated_fit, 6000, "5000 times"),
        *(partial(bee_colony_search, objective) for objective in ("training", "k-fold")),
        recursive_updates,
        refinement,
    ],
    "start": [
        start_up,
        partial(cold_start, "calm", "5 s"),
        partial(cold_start, "moderate", "7 s"),
        cold_workers,
    ],
}


def main(
    groups: Annotated[
        list[str] | None, typer.Argument(help=f"Some of {', '.join(GROUPS)}; by default all.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Measure and print."""
    table = Table("", "shipgym", "against", "ratio", "aim")
    rows: list[Row] = []
    for group in groups or GROUPS:
        for measure in GROUPS[check_choice(group, GROUPS, "group")]:
            measured = measure()
            for row in measured if isinstance(measured, list) else [measured]:
                rows.append(row)
                ratio = "" if row.ratio is None else f"{row.ratio:,.{1 if row.ratio >= 2.0 else 2}f}"
                table.add_row(row.what, row.ours, row.alternative, ratio, row.aim)
        table.add_section()
    if as_json:
        print(json.dumps([asdict(row) for row in rows], indent=1))
    else:
        Console(width=140).print(table)


if __name__ == "__main__":
    typer.run(main)
