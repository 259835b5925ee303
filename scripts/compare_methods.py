"""When the methods of the papers win: errors of each in manoeuvres that it never saw.

    python scripts/compare_methods.py [--ships bulk-carrier,kcs] [--seed 1]

Each ship is identified from zigzags 10/10 and 20/20 to both sides, with the noise of
sensors, by each method of the table and by `auto`. Printed are the root mean square
errors of the heading, deg, in a turn at full rudder and in a zigzag 30/30, neither of
which was fitted, as "turn / zigzag"; "-" where the model runs away or cannot be fitted.
"""

from __future__ import annotations

import argparse
import warnings
from typing import Any

import numpy as np
from foreign_ships import sea_trials, ship_names, ship_of, with_shaft

from identification import identify
from identification.models.refinement import whole_trials
from identification.samples.prediction import predict
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import turning_circle, zigzag

SHIPS = "naval-vessel,bulk-carrier,supply-vessel,inland-ship,kcs,kvlcc2"
GREY_BOX = {"structure": "grey-box", "reference_model": "auto"}
#: Arguments of `identify` by the name of the row.
METHODS: dict[str, dict[str, Any]] = {
    "`auto`": {"structure": "auto"},
    "`norrbin`, output error": {"structure": "norrbin", "method": whole_trials()},
    "`abkowitz`, least squares": {"structure": "abkowitz", "method": "ls"},
    "`abkowitz`, `tls-svm` (Xu 2020)": {"structure": "abkowitz"},
    "`abkowitz`, `abc-lssvr` (Zhu 2018)": {
        "structure": "abkowitz",
        "method": "abc-lssvr",
    },
    "`cubic`, `tls-svm`": {"structure": "cubic"},
    "`cubic`, output error from it": {"structure": "cubic", "method": "output-error"},
    "`grey-box`, `rm-svm` (Mei 2019)": {**GREY_BOX, "method": "rm-svm"},
    "`grey-box`, kernel": {**GREY_BOX, "kernel": "rbf"},
    "`mmg`, prior": {"structure": "mmg"},
}


def unseen(ship: ShipModel) -> list[Trial]:
    """A turn at full rudder and a zigzag 30/30 of the true ship."""
    travel = ship.travel_time
    dt = travel / 50.0
    rudder = min(30.0, ship.steering.rudder_limit_deg)
    full = min(35.0, ship.steering.rudder_limit_deg)
    turn = turning_circle(ship, full, 20.0 * travel, dt)
    weave = zigzag(ship, rudder, rudder, False, 25.0 * travel, dt)
    return [with_shaft(turn), with_shaft(weave)]


def cell(ship: ShipModel, trials: list[Trial], arguments: dict[str, Any]) -> str:
    """Errors of a method on a ship, as the table has them."""
    known = {"particulars": ship.particulars, "steering": ship.steering}
    try:
        model = identify(trials, **known, **arguments).model
    except InputError:
        return "-"
    errors = []
    for trial in unseen(ship):
        run = predict(model, trial)
        if run is None:
            return "-"
        off = np.degrees(run["psi"] - trial["psi"])
        errors.append(float(np.sqrt(np.mean(off**2))))
    return " / ".join(f"{error:.1f}" for error in errors)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--ships", type=ship_names, default=ship_names(SHIPS))
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    trials = {name: sea_trials(ship_of(name), asked.seed) for name in asked.ships}
    print("|", *asked.ships, "", sep=" | ")
    print("|", *["---"] + ["---:"] * len(asked.ships), "", sep=" | ")
    for method, arguments in METHODS.items():
        row = [cell(ship_of(name), trials[name], arguments) for name in asked.ships]
        print("|", method, "|", " | ".join(row), "|", flush=True)


if __name__ == "__main__":
    main()
