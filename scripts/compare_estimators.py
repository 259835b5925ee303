"""Lasso, relevance determination and a Gaussian process beside the default method.

`python scripts/compare_estimators.py` fits them to the demo's trials and to zigzags of
two models of KVLCC2, measured elsewhere, which lie beside the checkout, and prints the
errors on the runs that were held out.
"""

from pathlib import Path

from identification import compare_methods
from shipgym import ShipFile

#: Ship files, the structure, the runs to fit, by default those marked so, and those
#: held out.
SHIPS = (
    ("examples/mariner/ship.toml", "abkowitz", (), ()),
    (
        "tests/ships/kvlcc2_hsva.toml",
        "cubic",
        ("Z_10_05.csv", "Z_20_05.csv", "Z_30_05.csv"),
        ("Z_15_05.csv",),
    ),
    (
        "tests/ships/kvlcc2_marin.toml",
        "cubic",
        ("zz_10_m.csv", "zz_20_m.csv", "zz_-10_m.csv"),
        ("zz_-20_m.csv",),
    ),
)


def main() -> None:
    """Print the errors of each method on each ship."""
    root = Path(__file__).parents[1]
    for file, structure, fitted, held in SHIPS:
        ship = ShipFile.load(root / file)
        named = (*fitted, *held)
        trials = [
            trial
            for trial in ship.trials()
            if not named or Path(trial.name).name in named
        ]
        unseen = [trial.name for trial in trials if Path(trial.name).name in held]
        found = compare_methods(
            trials,
            ("tls-svm", "lasso", "ard", "gp", "ekf"),
            [structure],
            particulars=ship.particulars,
            steering=ship.steering,
            hold_out=unseen,
        )
        print(f"{file}, {structure}")
        for fit in found.ranked:
            heading = "ran away"
            if fit.heading_deg is not None:
                heading = f"heading {fit.heading_deg:.2f} deg"
            print(f"  {fit.method}: {heading}, guard passed: {fit.stable}")


if __name__ == "__main__":
    main()
