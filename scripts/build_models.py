"""Identify the models in the box again, from trials in the repository or simulated with sensor noise.

python scripts/build_models.py [folder]       by default shipgym/ships/library
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from certainty import holds, index_intervals, true_indices

import shipgym
from identification import IdentificationResult, identify
from shipgym import ShipModel, Trial
from shipgym.manoeuvres import zigzag
from shipgym.ships.catalogue import LIBRARY
from shipgym.trials.sensors import Sensors

EXAMPLES = Path(__file__).parents[1] / "examples"

STEP = 0.25  # simulation, s
SAMPLING = 1.0  # the logger, s
DURATION = 900.0  # s
DRAWS, NORMAL = 100, 1.96  # models drawn from each; standard errors of a 95 % interval
#: Rudder and heading, degrees, and whether port first.
KVLCC2_ZIGZAGS = ((10, 10, False), (10, 10, True), (20, 20, False), (20, 20, True))
CONTAINER_ZIGZAGS = ((10, 10, False), (20, 20, False), (20, 10, True), (35, 30, True))


def mariner_tls_svm() -> IdentificationResult:
    """Identify the Mariner class ship from its noisy zigzags, by truncated LS-SVM on spline samples."""
    ship = shipgym.ShipFile.load(EXAMPLES / "mariner" / "ship.toml")
    return identify(
        ship.trials(), particulars=ship.particulars, steering=ship.steering, name="mariner-tls-svm"
    )


def mariner_nomoto() -> IdentificationResult:
    """Identify Nomoto's form of the Mariner, Norrbin's with its cubic, from the same zigzags."""
    ship = shipgym.ShipFile.load(EXAMPLES / "mariner" / "ship.toml")
    return identify(
        ship.trials(), structure="norrbin", particulars=ship.particulars, steering=ship.steering,
        name="mariner-nomoto",
    )  # fmt: skip


def container_abc_lssvr() -> IdentificationResult:
    """Identify the container ship, which heels, as one that does not, by LS-SVR with C by bee colony.

    C by the error of stretches of time held out, since the training error that Zhu 2018 minimises only drives
    it to its bound.
    """
    ship = shipgym.load_model("container")
    return identify(
        container_trials(), method="abc-lssvr", particulars=ship.particulars, steering=ship.steering,
        name="container-abc-lssvr",
    )  # fmt: skip


def container_nomoto() -> IdentificationResult:
    """Identify Nomoto's form of the container ship, Norrbin's with its cubic, from the same zigzags."""
    ship = shipgym.load_model("container")
    return identify(
        container_trials(), structure="norrbin", method="abc-lssvr", particulars=ship.particulars,
        steering=ship.steering, name="container-nomoto",
    )  # fmt: skip


def kvlcc2_rm_svm() -> IdentificationResult:
    """Identify KVLCC2 at full scale on top of her 7 m model's equations, by RM-SVM from noisy zigzags.

    That is where a tank's model meets the sea trials: hull and rudder are those of the model, wake and
    friction are not.
    """
    ship = shipgym.load_model("kvlcc2")
    return identify(
        kvlcc2_trials(), structure="grey-box", method="rm-svm", reference_model="kvlcc2-l7",
        particulars=ship.particulars, steering=ship.steering, name="kvlcc2-rm-svm",
        service_shaft_speed=ship.service_shaft_speed,
    )  # fmt: skip


def kvlcc2_nomoto() -> IdentificationResult:
    """Identify Nomoto's form of KVLCC2 from the same zigzags.

    It is Norrbin's, with a cubic of the yaw rate: linearised about straight running the ship is stable to
    starboard and unstable to port, on the verge of both, so that K and T of the linear form mean nothing.
    """
    ship = shipgym.load_model("kvlcc2")
    return identify(
        kvlcc2_trials(), structure="norrbin", particulars=ship.particulars, steering=ship.steering,
        name="kvlcc2-nomoto",
    )  # fmt: skip


@cache
def kvlcc2_trials() -> tuple[Trial, ...]:
    """Zigzags of 10 and 20 degrees to both sides, as the sensors of a sea trial log them."""
    return _logged("kvlcc2", KVLCC2_ZIGZAGS, 2019)


@cache
def container_trials() -> tuple[Trial, ...]:
    """Zigzags from 10 degrees to the limit of the rudder, as the sensors of a sea trial log them."""
    return _logged("container", CONTAINER_ZIGZAGS, 2018)


def _logged(name: str, zigzags: Sequence[tuple[int, int, bool]], seed: int) -> tuple[Trial, ...]:
    ship, trials = shipgym.load_model(name), []
    for k, (rudder, heading, port) in enumerate(zigzags):
        run = zigzag(ship, rudder, heading, duration=DURATION, dt=STEP, port_first=port)
        named = run.with_(name=f"zigzag {rudder}/{heading}, {'port' if port else 'starboard'} first")
        trials.append(Sensors(sampling_s=SAMPLING).measure(named, seed + k))
    return tuple(trials)


MODELS = (
    mariner_tls_svm, mariner_nomoto, container_abc_lssvr, container_nomoto, kvlcc2_rm_svm, kvlcc2_nomoto,
)  # fmt: skip


def build(folder: Path) -> None:
    """Write every identified model into a folder, and print how often their intervals hold the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for make in MODELS:
        result = make()
        result.model.save(folder / f"{result.model.name}.json")
        print(result.summary())
        rows.append(coverage(result.model))
    print("| name | factor | derivatives | indices |\n| --- | --- | --- | --- |", *rows, sep="\n")


def coverage(model: ShipModel) -> str:
    """A row of docs/identified_models.md: true derivatives and indices inside a model's 95 % intervals."""
    ship = shipgym.load_model(model.name.partition("-")[0])
    known = "-"
    if ship.structure == model.structure:
        errors = np.subtract(*(list(one.coefficients.values()) for one in (model, ship)))
        inside = np.abs(errors) <= NORMAL * np.sqrt(np.diag(model.covariance))
        known = f"{inside.sum()} of {len(inside)}"
    held = holds(index_intervals(model, DRAWS), true_indices(ship))
    factor = model.provenance["model_error"]["factor"]
    return f"| `{model.name}` | {factor:.2f} | {known} | {sum(held.values())} of {len(held)} |"


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else LIBRARY)
