"""Write the corpus of the fuzz: one small sound file of everything that is read.

PYTHONPATH=scripts python -m fuzzing.make_corpus    into tests/corpus

Files that are there stay as they are: the corpus also says that what was written once
can still be read.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from papers.xu2020_tank import xu_ship
from pynmea2 import NMEASentence

import agents
import shipgym
from agents.controllers.registry import CLASSICAL, controller_class
from agents.policies.network import Layer, Network
from agents.policies.policy import LearnedPolicy
from agents.suites.suite import FOLDER
from shipgym import Episode, Particulars, ShipFile, ShipModel
from shipgym.tasks.scales import OBSERVATION_NAMES, observation_scales

CORPUS = Path(__file__).parents[2] / "tests" / "corpus"
EXAMPLE = Path(shipgym.__file__).parent / "examples" / "mariner"
ROWS = 40  # of a trial
COASTER = Particulars(
    length=28.9,
    beam=9.6,
    draught=2.7,
    mass=417e3,
    speed=5.0,
    xg=-0.5,
    yaw_gyradius=7.2,
    water_density=1025.0,
)


def trials(folder: Path) -> None:
    """The example's ship file with the beginning of two of its trials."""
    ship = folder / "ship-file" / "mariner"
    ship.mkdir(parents=True)
    text = (
        (EXAMPLE / "ship.toml")
        .read_text()
        .partition('[[trials]]\nfile = "zigzag_15_15.csv"')[0]
    )
    (ship / "ship.toml").write_text(text)
    for name in ("zigzag_20_20.csv", "zigzag_35_30_port.csv"):
        lines = (EXAMPLE / name).read_text().splitlines(keepends=True)
        (ship / name).write_text("".join(lines[: ROWS + 1]))
    trial = ShipFile.load(ship / "ship.toml").trials()[0]
    (folder / "trial").mkdir()
    trial.to_csv(folder / "trial" / "own.csv")
    rows = [
        f"{0.5 * k};{0.1 * k:.2f};0,0{k % 5};{np.sin(k):.3f}".replace(".", ",")
        for k in range(ROWS)
    ]
    (folder / "trial" / "semicolons.csv").write_text(
        "\n".join(["t;psi;r;delta", *rows])
    )


def logs(folder: Path) -> None:
    """Logs of each kind: ISO time, positions and rudder; NMEA 0183 with checksums."""
    import pandas as pd
    from scipy.io import savemat

    folder.joinpath("log").mkdir()
    t = np.arange(ROWS)
    psi = 30.0 + 10.0 * np.sin(0.1 * t)
    frame = pd.DataFrame(
        {
            "time": [f"2024-05-31T09:30:{k:02d}Z" for k in t],
            "lat": [f"57°{41.0 + 0.003 * k:.4f}'N" for k in t],
            "lon": [f"011°{44.0 + 0.003 * k:.4f}'E" for k in t],
            "psi [deg]": psi.round(1),
            "sog [kn]": np.where(t % 2, np.nan, 13.1),
            "cog [deg]": np.where(t % 2, np.nan, psi.round(1) + 2.0),
            "rudder [deg]": (10.0 * np.cos(0.1 * t)).round(1),
        }
    )
    frame.to_csv(folder / "log" / "bridge.csv", index=False)
    frame.to_excel(folder / "log" / "bridge.xlsx", index=False)
    frame.to_parquet(folder / "log" / "bridge.parquet")
    savemat(
        folder / "log" / "bridge.mat",
        {"t": t, "psi": np.radians(psi), "r": np.gradient(np.radians(psi))},
    )
    places = [
        f"57{41.0 + 0.003 * k:07.4f},N,01144.0000,E,13.1,{psi[k] + 2.0:.1f},310524"
        for k in t
    ]
    fields = [
        sentence
        for k in t
        for sentence in (
            ("GP", "RMC", f"0930{k:02d},A,{places[k]},,,A"),
            ("HE", "HDT", f"{psi[k]:.1f},T"),
            ("TI", "ROT", "3.0,A"),
            ("RI", "RSA", f"{k % 7:.1f},A,,"),
            ("WI", "MWV", "030.0,R,10.0,M,A"),
            ("VW", "VHW", ",T,,M,13.6,N,,K"),
        )
    ]
    texts = [f"{talker}{kind},{text}" for talker, kind, text in fields]
    lines = [f"${text}*{NMEASentence.checksum(text):02X}" for text in texts]
    (folder / "log" / "bridge.nmea").write_text("\r\n".join(lines) + "\r\n")


def models(folder: Path) -> None:
    """Tables of terms with and without covariance, grey box, captive tests."""
    folder.joinpath("model").mkdir()
    for name in ("mariner-nomoto", "kvlcc2-rm-svm", "mariner"):
        shipgym.load_model(name).save(folder / "model" / f"{name}.json")
    xu_ship(COASTER).save(folder / "model" / "captive.json")


def controllers(folder: Path) -> None:
    """One of every kind."""
    folder.joinpath("controller").mkdir()
    for kind in CLASSICAL:
        made: Any = controller_class(kind)
        leads_lq = made.has_ship or kind == "preview-lq"
        led = agents.LQ if leads_lq else agents.PID
        given = {"autopilot": led.from_model(SHIP)} if made.has_autopilot else {}
        made.from_model(SHIP, **given).save(folder / "controller" / f"{kind}.json")


def network(*sizes: int) -> Network:
    """Weights at random."""
    random = np.random.default_rng(0)
    layers = []
    for n_in, n_out in pairwise(sizes):
        weight = random.normal(0, 0.3, (n_out, n_in)).astype(np.float32)
        bias = random.normal(0, 0.1, n_out).astype(np.float32)
        layers.append(Layer(weight, bias))
    return Network(tuple(layers))


def policies(folder: Path) -> None:
    """Learned, and residual with a frame stack."""
    common: dict[str, Any] = {
        "observation_names": OBSERVATION_NAMES,
        "observation_scales": tuple(observation_scales(SHIP).tolist()),
        "model_name": SHIP.name,
        "training": {"algorithm": "ppo", "steps": 10},
    }
    learned = LearnedPolicy(network(8, 4, 1), **common)
    residual = LearnedPolicy(
        network(17, 4, 1),
        base=agents.PID.from_model(SHIP),
        authority=0.5,
        frame_stack=2,
        action_repeat=2,
        **common,
    )
    discrete = LearnedPolicy(network(8, 4, 9), action="rudder-discrete", **common)
    made: dict[str, Any] = {
        "learned": learned,
        "residual": residual,
        "discrete": discrete,
    }
    for name, policy in made.items():
        folder.joinpath("policy", name).mkdir(parents=True)
        policy.save(folder / "policy" / name / "agent.json")


def episode(folder: Path) -> None:
    """A few steps along a path."""
    n = 6
    names = ("x", "y", "psi", "u", "v", "r", "delta")
    states = {
        name: np.linspace(0.1, 1.0 / 3.0, n + 1) + k for k, name in enumerate(names)
    }
    made = Episode(
        environment="shipgym/PathFollowing-v0",
        model="mariner",
        dt=0.5,
        length=160.93,
        beam=23.17,
        rudder_limit=0.7,
        states=states,
        commands={"delta": np.full(n, 0.1)},
        actions=np.full((n, 1), 0.1),
        rewards=-np.ones(n),
        reward_parts={"reward_heading": -np.ones(n)},
        info={"cross_track": np.linspace(0.0, 1.0, n + 1)},
        corridor=60.0,
        waypoints=np.array([[0.0, 0.0], [1000.0, 1.0 / 3.0]]),
        arguments={"model": "mariner", "sea": {"wind": None}},
        seed=7,
        number=3,
        truncated=True,
        success=True,
    )
    folder.joinpath("episode").mkdir()
    made.save(folder / "episode" / "path.json")


def results(folder: Path) -> None:
    """A benchmark of two controllers."""
    made = agents.benchmark(
        "pid,lq", tasks=["sharp-turns", "course-unstable"], episodes=3
    )
    folder.joinpath("results").mkdir()
    made.save(folder / "results" / "two")


def texts(folder: Path) -> None:
    """Files of suites and of settings."""
    folder.joinpath("suite").mkdir()
    text = (FOLDER / "shipgym-v1.toml").read_text()
    names = ("course-unstable", "failing-gear", "sharp-turns")
    tables = ["[tasks." + part for part in text.split("\n[tasks.")[1:]]
    chosen = [
        one
        for one in tables
        if one.startswith(tuple(f"[tasks.{name}" for name in names))
    ]
    (folder / "suite" / "three.toml").write_text(
        'name = "three"\n\n' + "\n".join(chosen)
    )
    folder.joinpath("settings").mkdir()
    (folder / "settings" / "ppo.toml").write_text(
        'gamma = 0.98\nnet_arch = [64, 64]\nlog_std_end = "learned"\nbase ='
        ' "lq"\nauthority = 0.5\n'
    )


MAKERS: tuple[Callable[[Path], None], ...] = (
    trials,
    logs,
    models,
    controllers,
    policies,
    episode,
    results,
    texts,
)
SHIP: ShipModel = shipgym.load_model("mariner")

if __name__ == "__main__":
    CORPUS.mkdir(exist_ok=True)
    draft = CORPUS.with_name(".corpus.draft")
    shutil.rmtree(draft, ignore_errors=True)
    draft.mkdir()
    for make in MAKERS:
        make(draft)
    for path in sorted(draft.rglob("*")):
        there = CORPUS / path.relative_to(draft)
        if path.is_file() and not there.exists():
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, there)
    shutil.rmtree(draft)
