"""Jobs give the same results wherever they run, outlive their workers, and are not done twice."""

import builtins
import inspect
import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import warnings
from collections import deque
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from functools import partial
from http.server import BaseHTTPRequestHandler, HTTPServer
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from agents.engines import jobs as jobs_module
from agents.engines import local, ray_engine
from agents.engines.job import with_modules
from agents.engines.jobs import HERE, JobEngine, JobError, WorkerDiedError, run_jobs
from agents.engines.ray_engine import check_answers
from agents.engines.serialisation import KeptResults, pack, unpack
from shipgym.errors import InputError

JOBS = """
import os, signal, time
from pathlib import Path
import numpy as np
from shipgym.errors import InputError


def spectrum(job):
    x = np.random.default_rng(job["seed"]).normal(size=(60, 40))
    return {"seed": job["seed"], "values": np.linalg.svd(x, compute_uv=False), "pair": (1, float("inf"))}


def dies_at_first(job):
    mark = Path(job["mark"])
    if job["k"] == 1 and len(mark.read_text()) < job["deaths"]:
        mark.write_text(mark.read_text() + "x")
        os.kill(os.getpid(), signal.SIGKILL)
    return job["k"] ** 2


def logged(job):
    with Path(job["log"]).open("a") as log:
        log.write(f"{job['k']}\\n")
    if job["k"] == job["wrong"]:
        raise InputError("k: 2 found, expected another number")
    return job["k"]


def divides(job):
    return 1 / job["k"]


def threads(job):
    from threadpoolctl import threadpool_info

    np.ones((2, 2)) @ np.ones((2, 2))
    return [[pool["num_threads"] for pool in threadpool_info()], os.environ["OMP_NUM_THREADS"]]


def sleeps(job):
    Path(job["pids"], str(os.getpid())).touch()
    time.sleep(600)
"""


@pytest.fixture
def functions(tmp_path, monkeypatch):
    """A module of job functions that workers find too."""
    (tmp_path / "engine_jobs.py").write_text(JOBS)
    monkeypatch.syspath_prepend(tmp_path)
    import engine_jobs

    yield engine_jobs
    del sys.modules["engine_jobs"]


def same(a, b):
    return json.dumps(pack(a)) == json.dumps(pack(b))


def test_results_are_the_same_wherever_they_were_computed(functions, tmp_path):
    jobs = [{"seed": seed} for seed in (3, 1, 3, 2)]
    alone = run_jobs(functions.spectrum, jobs)
    assert [result["seed"] for result in alone] == [3, 1, 3, 2]
    assert alone[0]["values"] is not alone[2]["values"]
    expected = np.linalg.svd(
        np.random.default_rng(1).normal(size=(60, 40)), compute_uv=False
    )
    np.testing.assert_allclose(alone[1]["values"], expected, rtol=1e-12)
    two = run_jobs(functions.spectrum, jobs, workers=2, keep=tmp_path / "kept")
    told = []
    engine = JobEngine(keep=tmp_path / "kept")
    engine.check()
    resumed = engine.run(
        functions.spectrum, jobs, lambda *progress: told.append(progress)
    )
    assert same(alone, two)
    assert same(alone, resumed)
    assert told


@pytest.mark.skipif(find_spec("ray") is None, reason="ray is not installed")
def test_ray_gives_the_same_results(functions, tmp_path):
    jobs = [{"seed": seed} for seed in range(3)]
    assert same(
        run_jobs(functions.spectrum, jobs, engine="ray", workers=2),
        run_jobs(functions.spectrum, jobs),
    )


def test_a_job_has_one_thread_and_leaves_the_environment_as_it_was(
    functions, monkeypatch
):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    ((numbers, given),) = run_jobs(functions.threads, [{}])
    assert set(numbers) == {1}
    assert given == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def test_progress_counts_equal_jobs_each_and_two_tries_more_are_usual(
    functions, tmp_path
):
    told = []
    run_jobs(
        functions.spectrum,
        [{"seed": 1}] * 3,
        progress=lambda *progress: told.append(progress),
    )
    assert told == [(0, 3), (3, 3)]
    assert len(run_jobs(functions.spectrum, [{"seed": 1}], retries=0)) == 1
    assert inspect.signature(run_jobs).parameters["retries"].default == 2
    assert inspect.signature(run_jobs).parameters["workers"].default == 1


def test_killed_worker_is_replaced(functions, tmp_path):
    mark = tmp_path / "mark"
    mark.touch()
    jobs = [{"k": k, "mark": str(mark), "deaths": 1} for k in range(4)]
    assert run_jobs(functions.dies_at_first, jobs, workers=2) == [0, 1, 4, 9]
    assert mark.read_text() == "x"


def test_job_that_always_kills_its_worker_is_named_and_the_others_are_kept(
    functions, tmp_path
):
    mark = tmp_path / "mark"
    mark.touch()
    jobs = [{"k": k, "mark": str(mark), "deaths": 99} for k in range(2)]
    with pytest.raises(
        WorkerDiedError, match=r'job \{"k": 1, .*its worker died 2 times'
    ):
        run_jobs(
            functions.dies_at_first, jobs, workers=2, retries=1, keep=tmp_path / "kept"
        )
    mark.write_text("x" * 99)
    assert run_jobs(
        functions.dies_at_first, jobs, workers=1, keep=tmp_path / "kept"
    ) == [0, 1]


def test_what_is_kept_is_not_done_again(functions, tmp_path):
    log = tmp_path / "log"
    jobs = [{"k": k, "log": str(log), "wrong": -1} for k in range(4)]
    kept = tmp_path / "kept"
    told = []
    run_jobs(functions.logged, jobs[:3], keep=kept)
    sorted(kept.iterdir())[0].write_text('{"cut short')
    run_jobs(
        functions.logged,
        jobs,
        keep=kept,
        progress=lambda *progress: told.append(progress),
    )
    assert told == [(2, 4), (3, 4), (4, 4)]
    assert len(log.read_text().split()) == 5
    assert len(list(kept.iterdir())) == 4


def test_what_is_kept_is_of_its_function_and_version(functions, tmp_path):
    log, kept = tmp_path / "log", tmp_path / "kept"
    run_jobs(functions.logged, [{"k": 1, "log": str(log), "wrong": -1}], keep=kept)
    (file,) = kept.iterdir()
    assert re.fullmatch(r"[0-9a-f]{24}\.json", file.name)
    text = json.dumps({"k": 1, "log": str(log), "wrong": -1})
    assert KeptResults(kept, functions.logged).load(text) == {"value": 1}
    assert KeptResults(kept, functions.divides).load(text) is None
    file.write_text(json.dumps({**json.loads(file.read_text()), "shipgym": "0.0.1"}))
    assert KeptResults(kept, functions.logged).load(text) is None
    own = KeptResults(kept, functions.spectrum)
    own.save(text, {"value": pack(np.ones(3))})
    assert own.load(text) is not None
    own.save(text, {"value": {"__array__": ["<f8", [3], ""]}})
    assert own.load(text) is None  # broken, and computed again
    (tmp_path / "file").write_text("")
    with pytest.raises(
        InputError,
        match="file: is not a folder, expected one for results; choose another",
    ):
        KeptResults(tmp_path / "file", functions.logged)


def test_wrong_input_of_a_job_is_told_with_the_job(functions, tmp_path):
    jobs = [{"k": k, "log": str(tmp_path / "log"), "wrong": 2} for k in range(4)]
    with pytest.raises(
        InputError, match=r'job 2 \{"k": 2, .*\}: k: 2 found, expected another'
    ):
        run_jobs(functions.logged, jobs)
    with pytest.raises(
        JobError, match=r'job 1 \{"k": 0\}: ZeroDivisionError'
    ) as caught:
        run_jobs(functions.divides, [{"k": 1}, {"k": 0}])
    assert "return 1 / job" in caught.value.__notes__[0]


@pytest.mark.parametrize(
    ("number", "returned"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_workers_end_with_the_process_that_started_them(
    functions, tmp_path, number, returned
):
    pids = tmp_path / "pids"
    pids.mkdir()
    script = (
        "import signal, sys, engine_jobs\nfrom agents.engines.jobs import run_jobs\nif"
        " __name__ == '__main__':\n    signal.signal(signal.SIGINT,"
        " signal.default_int_handler)  # also where it is begun with & \n    jobs ="
        " [{'k': k, 'pids': sys.argv[1]} for k in range(2)]\n    try:\n       "
        " run_jobs(engine_jobs.sleeps, jobs, workers=2)\n    except"
        " KeyboardInterrupt:\n        sys.exit(130)\n"
    )
    (tmp_path / "script.py").write_text(script)
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{Path.cwd()}"}
    with subprocess.Popen(
        [sys.executable, tmp_path / "script.py", pids],
        env=environment,
        stderr=subprocess.PIPE,
    ) as parent:
        end = time.monotonic() + 60
        while len(list(pids.iterdir())) < 2 and time.monotonic() < end:
            time.sleep(0.05)
        parent.send_signal(number)
        try:
            error = parent.communicate(timeout=30)[1]
        finally:
            parent.kill()
    assert parent.returncode == returned, error
    if number == signal.SIGINT:
        assert error == b""
    end = time.monotonic() + 10
    while any(Path("/proc", entry.name).exists() for entry in pids.iterdir()):
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"engine": "rai"}, "Did you mean 'ray'"),
        ({"workers": 0}, "workers: expected .*got 0"),
        ({"retries": -1}, "retries: expected .*got -1"),
        ({"address": "10.0.0.1:6379"}, "it is for engine 'ray'"),
        ({"engine": "ray", "address": "10.0.0.1"}, "expected 'HOST:PORT'"),
        ({"engine": "ray", "address": "10.0.0.1:65536"}, "expected 'HOST:PORT'"),
        ({"engine": "ray", "address": "10.0.0.1:0"}, "expected 'HOST:PORT'"),
        ({"engine": "ray", "address": ":6379"}, "expected 'HOST:PORT'"),
        ({"engine": "ray", "address": "10.0.0.1:ray"}, "expected 'HOST:PORT'"),
        ({"function": lambda job: job}, "top level of a module"),
        ({"function": partial(os.path.join, "a")}, "top level of a module"),
        (
            {"jobs": [{"k": object()}]},
            r"jobs\[0\]: .* found, expected a dict of numbers",
        ),
        ({"jobs": [{"k": math.nan}]}, r"jobs\[0\]"),
        ({"jobs": [3]}, r"jobs\[0\]: 3 found, expected a dict"),
    ],
)
@pytest.mark.skipif(find_spec("ray") is None, reason="ray is not installed")
def test_wrong_arguments(arguments, message):
    given = {"function": os.path.join, "jobs": [{}]} | arguments
    with pytest.raises(InputError, match=message):
        run_jobs(given.pop("function"), given.pop("jobs"), **given)


def test_address_that_does_not_answer():
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        port = silent.getsockname()[1]
        with pytest.raises(
            InputError,
            match=r"no ray cluster answers .* within 10 s \(Connection refused\)",
        ):
            check_answers(f"127.0.0.1:{port}")
        silent.listen()
        with pytest.raises(
            InputError, match=r"no ray cluster answers .* \(no answer that ray"
        ):
            check_answers(f"ray://127.0.0.1:{port}", ray_patience_s=0.2)


def test_what_ray_says_last_is_told(monkeypatch):
    def fails(command, **options):
        raise subprocess.CalledProcessError(
            1, command, stderr="a traceback\nConnectionError: wrong token\n"
        )

    monkeypatch.setattr(ray_engine.subprocess, "run", fails)
    with pytest.raises(
        InputError,
        match=(
            r"no ray cluster answers at 'auto' within 30 s \(ConnectionError: wrong"
            r" token\)"
        ),
    ):
        check_answers("auto")


def test_why_no_cluster_answers_is_told_in_any_case(monkeypatch):
    def patiently(place, timeout):
        raise TimeoutError(f"{timeout:g} s are over")

    monkeypatch.setattr(ray_engine.socket, "create_connection", patiently)
    with pytest.raises(
        InputError, match=r"no ray cluster answers .* within 10 s \(10 s are over\)"
    ):
        check_answers("10.0.0.1:65535")

    def fails(command, **options):
        raise subprocess.CalledProcessError(3, command, stderr="")

    monkeypatch.setattr(ray_engine.subprocess, "run", fails)
    with pytest.raises(
        InputError, match=r"no ray cluster answers .* within 7 s \(exit code 3\)"
    ):
        check_answers("auto", 7.0)


def test_nothing_is_left_where_no_cluster_answers(functions, tmp_path):
    with pytest.raises(InputError, match=r"no ray cluster answers|not installed"):
        run_jobs(
            functions.spectrum,
            [{"n": 1}],
            engine="ray",
            address="127.0.0.1:1",
            keep=tmp_path / "kept" / "in",
        )
    assert not (tmp_path / "kept").exists()


def test_web_server_is_not_taken_for_ray():
    class Page(BaseHTTPRequestHandler):
        def log_message(self, *args):
            """Say nothing."""

    with HTTPServer(("127.0.0.1", 0), Page) as server:
        threading.Thread(target=server.handle_request, daemon=True).start()
        with pytest.raises(
            InputError, match=r"no ray cluster answers .* Is it the right port"
        ):
            check_answers(f"127.0.0.1:{server.server_port}", ray_patience_s=3.0)


def test_packing_keeps_types_shapes_and_bits():
    value = {
        "a": np.arange(6, dtype=">i2").reshape(2, 3)[:, ::2],
        "b": [0.1 + 0.2, -0.0, math.nan, np.float32(0.1), np.True_, None],
        "c": {
            "complex": np.array([1j, math.nan]),
            "empty": np.zeros((0, 3), dtype=np.float32),
        },
    }
    back = unpack(json.loads(json.dumps(pack(value), allow_nan=False)))
    assert back["a"].dtype == ">i2"
    np.testing.assert_array_equal(back["a"], [[0, 2], [3, 5]])
    assert back["b"][:2] == [0.1 + 0.2, -0.0]
    assert math.isnan(back["b"][2])
    assert back["b"][3:] == [float(np.float32(0.1)), True, None]
    np.testing.assert_array_equal(back["c"]["complex"], value["c"]["complex"])
    assert back["c"]["empty"].shape == (0, 3)
    for wrong in (object(), {3: 1}, np.array([None])):
        with pytest.raises(TypeError, match="found in a result"):
            pack(wrong)


def test_a_job_finds_modules_of_the_working_folder_registered(tmp_path, monkeypatch):
    (tmp_path / "named_by_a_user.py").write_text(
        "import builtins\nbuiltins.registered_by_a_user = 7\n"
    )
    monkeypatch.chdir(tmp_path)
    path = list(sys.path)
    done = with_modules(
        lambda job: job["k"] * builtins.registered_by_a_user,
        ["named_by_a_user"],
        {"k": 6},
    )
    monkeypatch.delitem(sys.modules, "named_by_a_user")
    monkeypatch.delattr(builtins, "registered_by_a_user")
    assert done == 42
    assert sys.path == path


def test_a_module_of_the_working_folder_goes_before_others_of_its_name(
    tmp_path, monkeypatch
):
    for name in ("other", "here"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "named_twice.py").write_text(f"where = {name!r}\n")
    monkeypatch.syspath_prepend(tmp_path / "other")
    monkeypatch.chdir(tmp_path / "here")
    found = with_modules(
        lambda job: sys.modules["named_twice"].where, ["named_twice"], {}
    )
    monkeypatch.delitem(sys.modules, "named_twice")
    assert found == "here"


def test_an_engine_refuses_wrong_arguments_before_the_work():
    HERE.check()
    assert JobEngine("local", 1, None, None) == HERE
    for engine, said in (
        (JobEngine("rai"), "Did you mean 'ray'"),
        (
            JobEngine(workers=0),
            "workers: expected .*or None for as many as there are cores.*got 0",
        ),
        (JobEngine(address="10.0.0.1:6379"), "it is for engine 'ray'"),
    ):
        with pytest.raises(InputError, match=said):
            engine.check()


def test_as_many_jobs_at_once_as_asked_or_as_there_are_cores(monkeypatch):
    asked = []

    def in_processes(function, texts, workers, retries):
        asked.append((workers, retries))
        return ((text, {"value": 1}) for text in texts)

    monkeypatch.setattr(jobs_module, "in_processes", in_processes)
    monkeypatch.setattr(jobs_module, "cpu_count", lambda: 7)
    for workers in (5, None):
        assert run_jobs(os.path.join, [{}, {"k": 1}], workers=workers, retries=3) == [
            1,
            1,
        ]
    assert run_jobs(os.path.join, [], workers=5) == []
    assert asked == [(5, 3), (7, 3)]


def test_workers_get_one_job_at_a_time(monkeypatch):
    asked = []

    class Pool:
        def __init__(self, jobs, **options):
            asked.append((jobs, options["pre_dispatch"], options["batch_size"]))
            warnings.warn(
                "2 tasks which were still being processed are cancelled",
                UserWarning,
                stacklevel=1,
            )

        def __call__(self, calls):
            return ((text, {"value": 1}) for _, (_, text), _ in calls)

    threads = []
    monkeypatch.setattr(local, "Parallel", Pool)
    monkeypatch.setattr(
        local,
        "parallel_config",
        lambda backend, **named: threads.append((backend, named)) or nullcontext(),
    )
    for workers, at_once in ((1, 2), (2, 2), (3, 3)):  # one would be this process
        doing = set()
        outcomes = list(local._until_broken(len, deque(["a", "b"]), doing, workers))
        assert (outcomes, doing) == ([("a", {"value": 1}), ("b", {"value": 1})], set())
        assert asked.pop() == (at_once, at_once, 1)
        assert threads.pop() == ("loky", {"inner_max_num_threads": 1})


def test_a_worker_asks_twice_a_second_whether_it_is_still_wanted(monkeypatch):
    parents, slept, ended = [7, 7, 7, 1], [], []
    monkeypatch.setattr(local.os, "getppid", lambda: parents.pop(0))
    monkeypatch.setattr(local.os, "_exit", ended.append)
    monkeypatch.setattr(local.time, "sleep", slept.append)
    monkeypatch.setattr(
        local.threading,
        "Thread",
        lambda target, daemon: SimpleNamespace(start=target, daemon=daemon),
    )
    local._end_with_parent.__wrapped__()
    assert (slept, ended, parents) == ([0.5, 0.5], [1], [])


@pytest.mark.parametrize(
    ("deaths", "retries"), [(0, 2), (2, 2), (3, 2), (1, 0), (1, 1), (2, 1)]
)
def test_jobs_whose_worker_died_are_done_again_the_last_time_alone(
    monkeypatch, deaths, retries
):
    batches, pool = [], Mock()

    def until_broken(function, waiting, doing, workers):
        batches.append(sorted(waiting))
        doing.update(waiting)
        waiting.clear()
        if "bad" in doing and sum("bad" in batch for batch in batches) <= deaths:
            raise BrokenProcessPool
        for text in sorted(doing):
            doing.remove(text)
            yield text, {}

    monkeypatch.setattr(local, "_until_broken", until_broken)
    monkeypatch.setattr(local, "get_reusable_executor", lambda: pool)
    run = local.in_processes(len, ["a", "bad", "c"], 2, retries)
    if deaths > retries:
        named = (
            "bad" if retries else "(a|bad|c)"
        )  # at once it is not known whose fault it was
        with pytest.raises(
            WorkerDiedError, match=rf"job {named}: its worker died {retries + 1} times"
        ):
            list(run)
    else:
        assert sorted(text for text, _ in run) == ["a", "bad", "c"]
        together = min(deaths + 1, max(retries, 1))
        assert batches[:together] == [["a", "bad", "c"]] * together
        assert sorted(batches[together:]) == (
            [["a"], ["bad"], ["c"]] if deaths == retries else []
        )
    pool.shutdown.assert_called_once_with(wait=True, kill_workers=True)


class Ray:
    """As much of ray as the engine needs; jobs are done as soon as one waits for them, the last one first."""

    def __init__(self, resources=None, crash=None):
        self.exceptions = SimpleNamespace(
            WorkerCrashedError=type("WorkerCrashedError", (Exception,), {}),
            OutOfMemoryError=type("OutOfMemoryError", (Exception,), {}),
        )
        self.resources, self.crash = resources or {}, crash
        self.most, self.cancelled, self.options = 0, [], {}
        self.initialised, self.given, self.ended = False, [], 0

    def cluster_resources(self):
        return self.resources

    def remote(self, **options):
        self.options = options
        return lambda function: SimpleNamespace(remote=lambda job, text: text)

    def wait(self, doing, num_returns):
        self.most = max(self.most, len(doing))
        return doing[-num_returns:], doing[:-num_returns]

    def get(self, text):
        if text == "bad":
            raise getattr(self.exceptions, self.crash)
        return text, {"value": 1}

    def cancel(self, text, force):
        self.cancelled.append((text, force))

    def is_initialized(self):
        return self.initialised

    def init(self, **options):
        if self.crash:
            raise RuntimeError("no memory")
        warnings.warn("ray warns of what is coming", FutureWarning, stacklevel=1)
        self.given.append((options, dict(os.environ)))

    def shutdown(self):
        self.ended += 1


@pytest.mark.parametrize(
    ("workers", "resources", "most"),
    [
        (2, {"CPU": 5.0}, 2),
        (None, {"CPU": 3.0}, 3),
        (None, {"CPU": 0.5}, 1),
        (None, {}, 1),
        (9, {}, 5),
    ],
)
def test_ray_gets_as_many_jobs_at_once_as_asked_or_as_it_has_cores(
    monkeypatch, workers, resources, most
):
    ray = Ray(resources)
    monkeypatch.setattr(ray_engine, "_connected", lambda *where: nullcontext(ray))
    done = list(ray_engine.on_ray(len, list("abcde"), workers, None, 4))
    assert sorted(done) == [(text, {"value": 1}) for text in "abcde"]
    assert (ray.most, ray.options, ray.cancelled) == (
        most,
        {"num_cpus": 1, "max_retries": 4},
        [],
    )


@pytest.mark.parametrize("crash", ["WorkerCrashedError", "OutOfMemoryError"])
def test_a_job_that_kills_rays_workers_is_named_and_the_others_are_cancelled(
    monkeypatch, crash
):
    ray = Ray(crash=crash)
    monkeypatch.setattr(ray_engine, "_connected", lambda *where: nullcontext(ray))
    with pytest.raises(WorkerDiedError, match="job bad: its worker died 5 times"):
        list(ray_engine.on_ray(len, ["a", "b", "bad", "c"], 3, None, 4))
    assert ray.cancelled == [("a", True), ("b", True)]


@pytest.fixture
def own_ray(monkeypatch):
    """Ray in place of the installed one, and an environment without its variables."""
    ray = Ray()
    monkeypatch.setitem(sys.modules, "ray", ray)
    for name in ("RAY_USAGE_STATS_ENABLED", "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO"):
        monkeypatch.setenv(name, "1")
        monkeypatch.delenv(name)
    return ray


def test_ray_is_started_here_on_one_thread_each_and_ended(own_ray, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    with ray_engine._connected(3, None) as ray:
        assert (ray, ray.ended) == (own_ray, 0)
    ((options, environment),) = ray.given
    quiet = {"log_to_driver": False, "configure_logging": False}
    assert options == {
        "address": "local",
        "num_cpus": 3,
        "include_dashboard": False,
        **quiet,
    }
    assert environment["OMP_NUM_THREADS"] == environment["MKL_NUM_THREADS"] == "1"
    assert environment["PYTHONPATH"].split(os.pathsep) == [
        path for path in sys.path if path
    ]
    assert environment["RAY_USAGE_STATS_ENABLED"] == "0"  # nothing is told to others
    assert environment["RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO"] == "0"
    assert (os.environ["OMP_NUM_THREADS"], ray.ended) == ("7", 1)
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "1")  # unless the user wishes so
    with ray_engine._connected(3, None):
        assert ray.given[1][1]["RAY_USAGE_STATS_ENABLED"] == "1"


def test_a_cluster_is_asked_for_before_it_is_joined(own_ray, monkeypatch):
    asked = []
    monkeypatch.setattr(ray_engine, "check_answers", asked.append)
    with ray_engine._connected(3, "10.0.0.1:6379"):
        ((options, _),) = own_ray.given
    assert asked == [options.pop("address")] == ["10.0.0.1:6379"]
    assert options == {"log_to_driver": False, "configure_logging": False}


def test_ray_that_runs_already_is_neither_started_nor_ended(own_ray):
    own_ray.initialised = True
    with ray_engine._connected(3, None) as ray:
        assert ray is own_ray
    assert (ray.given, ray.ended) == ([], 0)


def test_ray_that_does_not_start_or_is_not_there_is_told(own_ray, monkeypatch):
    own_ray.crash = "RuntimeError"
    with (
        pytest.raises(
            InputError,
            match="engine: 'ray' found, but it does not start here: no memory",
        ),
        ray_engine._connected(3, None),
    ):
        pass
    monkeypatch.setitem(sys.modules, "ray", None)
    with (
        pytest.raises(
            InputError,
            match="engine: 'ray' found, but it is not installed: pip install",
        ),
        ray_engine._connected(3, None),
    ):
        pass
