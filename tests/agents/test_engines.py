"""Jobs give the same results wherever they run, outlive their workers, and are not done twice."""

import builtins
import inspect
import json
import math
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from agents.engines import ray_engine
from agents.engines.job import with_modules
from agents.engines.jobs import JobEngine, JobError, WorkerDiedError, run_jobs
from agents.engines.ray_engine import check_answers
from agents.engines.serialisation import pack, unpack
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
    expected = np.linalg.svd(np.random.default_rng(1).normal(size=(60, 40)), compute_uv=False)
    np.testing.assert_allclose(alone[1]["values"], expected, rtol=1e-12)
    two = run_jobs(functions.spectrum, jobs, workers=2, keep=tmp_path / "kept")
    told = []
    engine = JobEngine(keep=tmp_path / "kept")
    engine.check()
    resumed = engine.run(functions.spectrum, jobs, lambda *progress: told.append(progress))
    assert same(alone, two)
    assert same(alone, resumed)
    assert told


@pytest.mark.skipif(find_spec("ray") is None, reason="ray is not installed")
def test_ray_gives_the_same_results(functions, tmp_path):
    jobs = [{"seed": seed} for seed in range(3)]
    assert same(
        run_jobs(functions.spectrum, jobs, engine="ray", workers=2), run_jobs(functions.spectrum, jobs)
    )


def test_a_job_has_one_thread_and_leaves_the_environment_as_it_was(functions, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    ((numbers, given),) = run_jobs(functions.threads, [{}])
    assert set(numbers) == {1}
    assert given == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def test_progress_counts_equal_jobs_each_and_two_tries_more_are_usual(functions, tmp_path):
    told = []
    run_jobs(functions.spectrum, [{"seed": 1}] * 3, progress=lambda *progress: told.append(progress))
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


def test_job_that_always_kills_its_worker_is_named_and_the_others_are_kept(functions, tmp_path):
    mark = tmp_path / "mark"
    mark.touch()
    jobs = [{"k": k, "mark": str(mark), "deaths": 99} for k in range(2)]
    with pytest.raises(WorkerDiedError, match=r'job \{"k": 1, .*its worker died 2 times'):
        run_jobs(functions.dies_at_first, jobs, workers=2, retries=1, keep=tmp_path / "kept")
    mark.write_text("x" * 99)
    assert run_jobs(functions.dies_at_first, jobs, workers=1, keep=tmp_path / "kept") == [0, 1]


def test_what_is_kept_is_not_done_again(functions, tmp_path):
    log = tmp_path / "log"
    jobs = [{"k": k, "log": str(log), "wrong": -1} for k in range(4)]
    kept = tmp_path / "kept"
    told = []
    run_jobs(functions.logged, jobs[:3], keep=kept)
    sorted(kept.iterdir())[0].write_text('{"cut short')
    run_jobs(functions.logged, jobs, keep=kept, progress=lambda *progress: told.append(progress))
    assert told == [(2, 4), (3, 4), (4, 4)]
    assert len(log.read_text().split()) == 5
    assert len(list(kept.iterdir())) == 4


def test_wrong_input_of_a_job_is_told_with_the_job(functions, tmp_path):
    jobs = [{"k": k, "log": str(tmp_path / "log"), "wrong": 2} for k in range(4)]
    with pytest.raises(InputError, match=r'job 2 \{"k": 2, .*\}: k: 2 found, expected another'):
        run_jobs(functions.logged, jobs)
    with pytest.raises(JobError, match=r'job 1 \{"k": 0\}: ZeroDivisionError') as caught:
        run_jobs(functions.divides, [{"k": 1}, {"k": 0}])
    assert "return 1 / job" in caught.value.__notes__[0]


@pytest.mark.parametrize(("number", "returned"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_workers_end_with_the_process_that_started_them(functions, tmp_path, number, returned):
    pids = tmp_path / "pids"
    pids.mkdir()
    script = (
        "import signal, sys, engine_jobs\nfrom agents.engines.jobs import run_jobs\n"
        "if __name__ == '__main__':\n"
        "    signal.signal(signal.SIGINT, signal.default_int_handler)  # also where it is begun with & \n"
        "    jobs = [{'k': k, 'pids': sys.argv[1]} for k in range(2)]\n"
        "    try:\n        run_jobs(engine_jobs.sleeps, jobs, workers=2)\n"
        "    except KeyboardInterrupt:\n        sys.exit(130)\n"
    )
    (tmp_path / "script.py").write_text(script)
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{Path.cwd()}"}
    with subprocess.Popen(
        [sys.executable, tmp_path / "script.py", pids], env=environment, stderr=subprocess.PIPE
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
        ({"workers": 0}, "workers: 0 found"),
        ({"retries": -1}, "retries: -1 found"),
        ({"address": "10.0.0.1:6379"}, "it is for engine 'ray'"),
        ({"engine": "ray", "address": "10.0.0.1"}, "expected 'HOST:PORT'"),
        ({"engine": "ray", "address": "10.0.0.1:65536"}, "expected 'HOST:PORT'"),
        ({"engine": "ray", "address": "10.0.0.1:0"}, "expected 'HOST:PORT'"),
        ({"engine": "ray", "address": ":6379"}, "expected 'HOST:PORT'"),
        ({"engine": "ray", "address": "10.0.0.1:ray"}, "expected 'HOST:PORT'"),
        ({"function": lambda job: job}, "top level of a module"),
        ({"jobs": [{"k": object()}]}, r"jobs\[0\]: .* found, expected a dict of numbers"),
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
        with pytest.raises(InputError, match=r"no ray cluster answers .* \(Connection refused\)"):
            check_answers(f"127.0.0.1:{port}")
        silent.listen()
        with pytest.raises(InputError, match=r"no ray cluster answers .* \(no answer that ray"):
            check_answers(f"ray://127.0.0.1:{port}", ray_patience_s=0.2)


def test_what_ray_says_last_is_told(monkeypatch):
    def fails(command, **options):
        raise subprocess.CalledProcessError(1, command, stderr="a traceback\nConnectionError: wrong token\n")

    monkeypatch.setattr(ray_engine.subprocess, "run", fails)
    with pytest.raises(
        InputError, match=r"no ray cluster answers at 'auto' .*\(ConnectionError: wrong token\)"
    ):
        check_answers("auto")


def test_nothing_is_left_where_no_cluster_answers(functions, tmp_path):
    with pytest.raises(InputError, match=r"no ray cluster answers|not installed"):
        run_jobs(
            functions.spectrum, [{"n": 1}], engine="ray", address="127.0.0.1:1", keep=tmp_path / "kept" / "in"
        )
    assert not (tmp_path / "kept").exists()


def test_web_server_is_not_taken_for_ray():
    class Page(BaseHTTPRequestHandler):
        def log_message(self, *args):
            """Say nothing."""

    with HTTPServer(("127.0.0.1", 0), Page) as server:
        threading.Thread(target=server.handle_request, daemon=True).start()
        with pytest.raises(InputError, match=r"no ray cluster answers .* Is it the right port"):
            check_answers(f"127.0.0.1:{server.server_port}", ray_patience_s=3.0)


def test_packing_keeps_types_shapes_and_bits():
    value = {
        "a": np.arange(6, dtype=">i2").reshape(2, 3)[:, ::2],
        "b": [0.1 + 0.2, -0.0, math.nan, np.float32(0.1), np.True_, None],
        "c": {"complex": np.array([1j, math.nan]), "empty": np.zeros((0, 3), dtype=np.float32)},
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
    (tmp_path / "named_by_a_user.py").write_text("import builtins\nbuiltins.registered_by_a_user = 7\n")
    monkeypatch.chdir(tmp_path)
    path = list(sys.path)
    done = with_modules(lambda job: job["k"] * builtins.registered_by_a_user, ["named_by_a_user"], {"k": 6})
    monkeypatch.delitem(sys.modules, "named_by_a_user")
    monkeypatch.delattr(builtins, "registered_by_a_user")
    assert done == 42
    assert sys.path == path
