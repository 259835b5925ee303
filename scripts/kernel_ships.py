"""Kernel ships beside the models that they correct, on simulated noisy zigzags.

python scripts/kernel_ships.py    the table of docs/grey_box.md
"""

from __future__ import annotations

from typing import Any

import numpy as np

import shipgym
from identification import identify
from shipgym.errors import UnstableModelError
from shipgym.manoeuvres import turning_circle, turning_indices, zigzag
from shipgym.trials.sensors import Sensors
from shipgym.trials.trial import Trial

SHIP = "kvlcc2-l7"
#: Rudder, switching heading, whether to port first, use.
PLAN = (
    (10, 10, False, "fit"),
    (10, 10, True, "fit"),
    (20, 20, False, "fit"),
    (20, 20, True, "fit"),
    (15, 15, False, "validate"),
    (30, 20, True, "validate"),
)
FITS: dict[str, dict[str, Any]] = {
    "`abkowitz`, `tls-svm`": {},
    'black box, `kernel = "rbf"`': {"kernel": "rbf"},
    "tanker, `rm-svm`, linear": {
        "method": "rm-svm",
        "structure": "grey-box",
        "reference_model": "tanker",
    },
    'tanker, `rm-svm`, `kernel = "rbf"`': {
        "method": "rm-svm",
        "structure": "grey-box",
        "reference_model": "tanker",
        "kernel": "rbf",
    },
}


def trials(ship: shipgym.ShipModel) -> list[Trial]:
    """The zigzags of the plan as sensors show them."""
    return [
        Sensors(sampling_s=0.5)
        .measure(
            zigzag(ship, rudder, heading, duration=120, dt=0.1, port_first=port), seed
        )
        .with_(name=f"{rudder}/{heading} {'port' if port else 'starboard'}", use=use)
        for seed, (rudder, heading, port, use) in enumerate(PLAN)
    ]


def turns(model: shipgym.ShipModel) -> list[str]:
    """Advance and tactical diameter at 35 degrees to either side."""
    found = []
    for side in (35, -35):
        try:
            turn = turning_indices(turning_circle(model, side, duration=400, dt=0.1))
            found.append(
                f"{turn.advance_lengths:.2f}, {turn.tactical_diameter_lengths:.2f}"
            )
        except UnstableModelError:
            found.append("runs away")
    return found


def main() -> None:
    """Print the table."""
    ship = shipgym.load_model(SHIP)
    measured = trials(ship)
    held_out = [trial.name for trial in measured if trial.use == "validate"]
    print(
        f"| | {' | '.join(f'heading {name}, deg rms' for name in held_out)} | +35 |"
        " -35 |"
    )
    print("| --- |" + " ---: |" * (len(held_out) + 2))
    print(f"| the ship |{' |' * len(held_out)} {' | '.join(turns(ship))} |")
    for name, settings in FITS.items():
        result = identify(
            measured, particulars=ship.particulars, steering=ship.steering, **settings
        )
        errors = [result.metrics["trials"][trial]["rmse"]["psi"] for trial in held_out]
        shown = [f"{np.degrees(error):.1f}" for error in errors]
        print(f"| {name} | {' | '.join([*shown, *turns(result.model)])} |", flush=True)


if __name__ == "__main__":
    main()
