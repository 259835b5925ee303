import importlib.util
from pathlib import Path

import numpy as np
import pytest

from shipgym import load_model

SCRIPT = Path(__file__).parents[2] / "scripts" / "make_demo_trials.py"


@pytest.fixture(scope="module")
def script():
    import sys

    spec = importlib.util.spec_from_file_location("make_demo_trials", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_the_shipped_trials_are_those_the_script_writes(script, demo):
    rng = np.random.default_rng([script.SEED, 0])
    logged = script.log(script.sail(load_model("mariner"), script.ORDERS[0], rng), rng)
    shipped = np.loadtxt(demo.parent / script.ORDERS[0].file, delimiter=",", skiprows=1)
    assert shipped == pytest.approx(
        logged, abs=0.051
    )  # the rudder is logged to 0.1 deg


def test_the_demo_is_small(demo):
    assert sum(path.stat().st_size for path in demo.parent.iterdir()) < 600_000
