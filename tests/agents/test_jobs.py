"""Jobs give the same results wherever they run, are kept, and fail with one message."""

import os
import sys
import traceback
from importlib.util import find_spec

import numpy as np
import pytest

from agents.job_results import result_to_json
from agents.jobs import JobEngine, JobError, run_jobs
from shipgym.errors import InputError

JOBS = """
import os, signal, sys, time
from pathlib import Path
import numpy as np
from shipgym.errors import InputError


def spectrum(job):
    x = np.random.default_rng(job["seed"]).normal(size=(60, 40))
    values = np.linalg.svd(x, compute_uv=False)
    return {"seed": job["seed"], "values": values, "pair": (1, float("inf"))}


def dies(job):
    if job["k"] == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return job["k"]


def logged(job):
    with Path(job["log"]).open("a") as log:
        log.write(f"{job['k']}\\n")
    if job["k"] == job["wrong"]:
        raise InputError("k: expected another number, got 2")
    return job["k"]


def divides(job):
    return 1 / job["k"]


def threads(job):
    from threadpoolctl import threadpool_info

    np.ones((2, 2)) @ np.ones((2, 2))
    pools = [pool["num_threads"] for pool in threadpool_info()]
    return [pools, os.environ["OMP_NUM_THREADS"]]


def loaded(job):
    import joblib

    return [spectrum(job), "lz4" in sys.modules, os.getcwd()]
"""
needs_ray = pytest.mark.skipif(find_spec("ray") is None, reason="ray is not installed")


@pytest.fixture
def functions(tmp_path, monkeypatch):
    """A module of job functions that workers find too."""
    home = tmp_path / "home"
    home.mkdir()
    (home / "job_functions.py").write_text(JOBS)
    monkeypatch.syspath_prepend(home)
    import job_functions

    yield job_functions
    del sys.modules["job_functions"]


def test_results_are_the_same_wherever_they_are_computed(functions, tmp_path):
    jobs = [{"seed": seed} for seed in (3, 1, 3, 2)]
    here = run_jobs(functions.spectrum, jobs)
    assert [result["seed"] for result in here] == [3, 1, 3, 2]
    values = np.random.default_rng(1).normal(size=(60, 40))
    expected = np.linalg.svd(values, compute_uv=False)
    np.testing.assert_allclose(here[1]["values"], expected, rtol=1e-12)

    kept = JobEngine(workers=2, keep=tmp_path / "kept")
    assert result_to_json(run_jobs(functions.spectrum, jobs, kept)) == (
        result_to_json(here)
    )
    resumed = run_jobs(functions.spectrum, jobs, JobEngine(keep=tmp_path / "kept"))
    assert result_to_json(resumed) == result_to_json(here)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_job_has_one_thread_and_the_environment_stays(
    workers, functions, monkeypatch
):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    before = dict(os.environ)
    ((numbers, variable),) = run_jobs(
        functions.threads, [{}], JobEngine(workers=workers)
    )
    assert set(numbers) == {1}
    assert variable == "1"
    assert dict(os.environ) == before


@pytest.mark.parametrize("engine", ["local", pytest.param("ray", marks=needs_ray)])
def test_workers_give_the_same_and_import_nothing_from_the_working_folder(
    engine, functions, tmp_path, monkeypatch
):
    """joblib imports lz4 where it is installed; a file of that name is somebody's
    results."""
    (tmp_path / "lz4.py").touch()
    monkeypatch.chdir(tmp_path)
    jobs = [{"seed": seed} for seed in range(5)]
    results = run_jobs(functions.loaded, jobs, JobEngine(engine, 2))
    for (spectrum, is_loaded, folder), job in zip(results, jobs, strict=True):
        assert result_to_json(spectrum) == result_to_json(functions.spectrum(job))
        assert not is_loaded
        assert folder == str(tmp_path)


def test_a_killed_worker_is_one_message_and_finished_jobs_are_kept(
    functions, tmp_path, told
):
    jobs = [{"k": k} for k in range(3)]
    engine = JobEngine(workers=2, keep=tmp_path / "kept")
    run_jobs(functions.dies, jobs[:1], engine)
    with pytest.raises(JobError, match=r"worker process was killed.*try fewer workers"):
        run_jobs(functions.dies, jobs, engine)
    told.clear()
    run_jobs(functions.dies, [jobs[0], jobs[0]], engine)
    assert told == [("jobs done", 2, 2)]


def test_a_kept_result_is_not_computed_again_unless_its_file_is_broken(
    functions, tmp_path, told
):
    log, kept = tmp_path / "log", tmp_path / "kept"
    jobs = [{"k": k, "log": str(log), "wrong": -1} for k in range(4)]
    run_jobs(functions.logged, jobs[:3], JobEngine(keep=kept))
    min(kept.iterdir()).write_text('{"cut short')
    told.clear()
    run_jobs(functions.logged, jobs, JobEngine(keep=kept))
    assert told == [("jobs done", n, 4) for n in (2, 3, 4)]
    assert len(log.read_text().split()) == 5
    assert len(list(kept.iterdir())) == 4


@pytest.mark.parametrize("workers", [1, 2])
def test_the_error_of_a_job_names_it(workers, functions, tmp_path):
    engine = JobEngine(workers=workers)
    jobs = [{"k": k, "log": str(tmp_path / "log"), "wrong": 2} for k in range(4)]
    with pytest.raises(InputError, match=r'job \{"k": 2, .*\}: k: expected another'):
        run_jobs(functions.logged, jobs, engine)
    with pytest.raises(JobError, match=r'job \{"k": 0\}: ZeroDivision') as caught:
        run_jobs(functions.divides, [{"k": 1}, {"k": 0}], engine)
    lines = traceback.format_exception(caught.value)
    assert "return 1 / job" in "".join(lines)


def test_wrong_engines_are_refused():
    with pytest.raises(InputError, match=r"engine: .*Did you mean 'ray'"):
        JobEngine("rai")
    with pytest.raises(InputError, match="it is for engine 'ray'"):
        JobEngine(address="10.0.0.1:6379")


def test_without_ray_its_engine_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InputError, match=r"pip install 'shipgym\[ray\]'"):
        run_jobs(os.path.join, [{}], JobEngine("ray"))
