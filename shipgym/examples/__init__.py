"""Ship files with recorded trials that come with the package, to try it out."""

from pathlib import Path

from shipgym.checks import check_choice


def example_ship(name: str = "mariner") -> Path:
    """Path of a ship file with trials that comes with the package.

    Returns its path, for `shipgym.ShipFile.load` and the commands that take a ship
    file. Raises InputError for another name.

    Parameters
    ----------
    name : {"mariner"}
        The ship: "mariner" is a cargo ship of the Mariner class with three simulated
        zigzags as a sea trial would log them, two to fit and one to validate.
    """
    folder = Path(__file__).parent
    known = sorted(path.parent.name for path in folder.glob("*/ship.toml"))
    return folder / check_choice(name, known, "example ship") / "ship.toml"
