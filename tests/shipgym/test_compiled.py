"""Compiled kernels: the same numbers as plain Python, one folder a ship, any number of processes."""

import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
from shipgym.engine.generator import accelerations_source
from shipgym.kernels import trigonometry

import shipgym
from shipgym.engine import compiled
from tests.shipgym.outer import outer

sin_cos, wrap = outer(trigonometry.sin_cos), outer(trigonometry.wrap)
small_sin_cos, small_cosine = outer(trigonometry.small_sin_cos), outer(trigonometry.small_cosine)

FLY = """
import numpy as np, shipgym
from shipgym.envs.engine import Engine
engine = Engine(shipgym.load_model("mariner"), 2)
engine.reset([1, 2])
for k in range(30):
    observations, *_ = engine.step(np.full((2, 1), np.sin(k)))
trial = shipgym.load_model("mariner").simulate(np.full((50, 1), 0.2), 0.5)
print(repr([*observations[1].tolist(), float(trial["r"][-1]), float(trial["psi"][-1])]))
"""


def run(code: str, **environment: str) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return result.stdout.strip()


def test_without_compiling_the_numbers_are_the_same():
    compiled_run, plain_run = eval(run(FLY)), eval(run(FLY, NUMBA_DISABLE_JIT="1"))
    np.testing.assert_allclose(plain_run, compiled_run, rtol=1e-6, atol=1e-9)


def test_processes_may_compile_at_once(tmp_path):
    code = "import shipgym; shipgym.load_model('mariner').kernel('trajectories'); print('done')"
    environment = {**os.environ, "SHIPGYM_CACHE": str(tmp_path), "NUMBA_DISABLE_JIT": "1"}
    workers = [
        subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE)
        for _ in range(3)
    ]
    assert [worker.communicate()[0] for worker in workers] == [b"done\n"] * 3
    assert len(list(tmp_path.iterdir())) == 1


def test_an_edited_kernel_or_another_ship_gets_a_folder_of_its_own():
    files = {"motion.py": b"a", "accelerations.py": b"b"}
    names = {
        compiled._fingerprint(files),
        compiled._fingerprint({**files, "motion.py": b"c"}),
        compiled._fingerprint({**files, "accelerations.py": b"c"}),
    }
    assert len(names) == 3


def test_a_cache_that_cannot_be_written_is_said_and_survived(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.warns(UserWarning, match="compiled anew in each process"):
        folder = compiled._write_once("ships", {"__init__.py": b""})
    assert (folder / "__init__.py").is_file()


def test_each_coefficient_is_read_once_and_what_terms_share_is_taken_out():
    source = accelerations_source(shipgym.load_model("mariner").table)
    for row in range(40):
        assert source.count(f"COEFFICIENTS + {row} *") == 1
    sums = "".join(line for line in source.splitlines() if "dot =" in line).replace("* LANES", "")
    assert sums.count(" * ") < 80  # of 40 terms with 93 factors and as many coefficients


def test_sine_and_cosine_to_the_last_digits():
    angles = np.linspace(-500.0, 500.0, 20001)
    ours = np.array([sin_cos(angle) for angle in angles])
    np.testing.assert_allclose(ours[:, 0], np.sin(angles), rtol=0.0, atol=5e-15)
    np.testing.assert_allclose(ours[:, 1], np.cos(angles), rtol=0.0, atol=5e-15)


def test_wrapped_angles_are_the_same_direction():
    angles = np.linspace(-30.0, 30.0, 997)
    wrapped = np.array([wrap(angle) for angle in angles])
    assert np.all((wrapped >= -np.pi) & (wrapped < np.pi))
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)


def test_importing_shipgym_leaves_the_heavy_libraries_alone():
    heavy = ("numba", "scipy", "control", "torch", "stable_baselines3", "plotly", "sklearn")
    code = f"import shipgym, sys; print([name for name in {heavy!r} if name in sys.modules])"
    assert run(code) == "[]"


def test_no_warnings_when_kernels_are_loaded():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert shipgym.load_model("mariner").kernel("trajectories").simulate is not None


def test_small_angles_have_the_sine_and_cosine_of_the_library():
    x = np.linspace(-np.pi / 2, np.pi / 2, 2001)
    found = np.array([small_sin_cos(angle) for angle in x])
    np.testing.assert_allclose(found, np.stack([np.sin(x), np.cos(x)], axis=1), rtol=0.0, atol=4e-16)
    np.testing.assert_allclose([small_cosine(angle) for angle in x], np.cos(x), rtol=0.0, atol=4e-16)
    assert small_sin_cos(np.pi) == pytest.approx((0.0, -1.0), abs=3e-9)


def test_a_table_is_written_once_for_all_models_that_share_it():
    model = shipgym.load_model("mariner-tls-svm")
    sources = {id(draw.accelerations_source) for draw in model.sample(5, 0)}
    assert sources == {id(model.accelerations_source)}
