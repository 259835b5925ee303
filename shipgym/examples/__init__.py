"""What comes with the package to try it out: a ship's trials, and tasks to copy.

Importing it registers the tasks, `"shipgym.examples:examples/Berth-v0"` for example.
Files that end in `_rule` hold a rule that steers a task.
"""

from pathlib import Path

from shipgym.checks import check_choice
from shipgym.envs.registration import register_file

FOLDER = Path(__file__).parent
TASKS = ("berth", "fairway", "river")


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
    known = sorted(path.parent.name for path in FOLDER.glob("*/ship.toml"))
    return FOLDER / check_choice(name, known, "example ship") / "ship.toml"


for task in TASKS:
    register_file(f"examples/{task.capitalize()}-v0", FOLDER / f"{task}.py")
