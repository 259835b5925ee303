import signal
from pathlib import Path

import pytest

from identification.progress import PROGRESS

DEMO = Path(__file__).parents[2] / "examples" / "mariner" / "ship.toml"
DRAWS = 24


@pytest.fixture(autouse=True)
def signals():
    """Handlers of signals as before: the command line ignores Ctrl-C at its end."""
    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="session")
def demo():
    return DEMO


@pytest.fixture
def told():
    """What `PROGRESS` is told: stage, units done, total."""
    calls = []
    token = PROGRESS.set(lambda *now: calls.append(now))
    yield calls
    PROGRESS.reset(token)


@pytest.fixture(scope="session")
def chain(tmp_path_factory):
    """The whole chain on the demo's trials, once: the folder written, the result, the
    stages told."""
    from agents.verification.chain import build_autopilot

    folder = tmp_path_factory.mktemp("chain") / "report"
    stages = []
    token = PROGRESS.set(lambda *told: stages.append(told))
    result = build_autopilot(DEMO, folder, draws=DRAWS, seed=1)
    PROGRESS.reset(token)
    return folder, result, stages


@pytest.fixture(scope="session")
def unstable_ship(tmp_path_factory):
    """A ship file whose one fitted trial, a turning circle, cannot tell 40 coefficients
    apart."""
    head, *trials = DEMO.read_text().replace("tls-svm", "ls").split("[[trials]]")
    uses = [text.replace('"fit"', '"validate"') for text in trials]
    uses = [
        t.replace('"validate"', '"fit"') if "turning_circle" in t else t for t in uses
    ]
    text = "[[trials]]".join([head, *uses])
    path = tmp_path_factory.mktemp("unstable") / "ship.toml"
    path.write_text(text.replace('file = "', f'file = "{DEMO.parent}/'))
    return path
