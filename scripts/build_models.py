"""Identify the models in the box again, from trials in the repository or simulated with sensor noise.

python scripts/build_models.py [folder]       by default shipgym/models/library
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import shipgym
from identification import IdentificationResult, identify
from shipgym import ShipModel, Trial
from shipgym.manoeuvres import zigzag
from shipgym.models.catalogue import LIBRARY
from shipgym.simulation.sensors import Sensors

EXAMPLES = Path(__file__).parents[1] / "examples"

SEED = 2019
STEP = 0.25  # simulation, s
SAMPLING = 1.0  # the logger, s
DURATION = 900.0  # s
ZIGZAGS = ((10, False), (10, True), (20, False), (20, True))  # rudder and heading, degrees; port first


def mariner_tls_svm() -> IdentificationResult:
    """Identify the Mariner class ship from its noisy zigzags, by truncated LS-SVM on spline samples."""
    ship = shipgym.ShipFile.load(EXAMPLES / "mariner" / "ship.toml")
    return identify(
        ship.trials(), particulars=ship.particulars, steering=ship.steering, name="mariner-tls-svm"
    )


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
    return tuple(
        _logged(shipgym.load_model("kvlcc2"), angle, port, SEED + k)
        for k, (angle, port) in enumerate(ZIGZAGS)
    )


def _logged(ship: ShipModel, angle: float, port_first: bool, seed: int) -> Trial:
    run = zigzag(ship, angle, angle, duration=DURATION, dt=STEP, port_first=port_first)
    named = run.with_(name=f"zigzag {angle}/{angle}, {'port' if port_first else 'starboard'} first")
    return Sensors(sampling_s=SAMPLING).measure(named, seed)


MODELS = (mariner_tls_svm, kvlcc2_rm_svm, kvlcc2_nomoto)


def build(folder: Path) -> None:
    """Write every identified model into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for make in MODELS:
        result = make()
        result.model.save(folder / f"{result.model.name}.json")
        print(result.summary())


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else LIBRARY)
