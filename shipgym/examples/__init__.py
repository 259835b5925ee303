"""What comes with the package to try it out: a ship's trials, and tasks to copy.

Importing it registers the tasks, `"shipgym.examples:examples/Berth-v0"` for example.
Files that end in `_rule` hold a rule that steers a task.
"""

from pathlib import Path

from shipgym.envs.registration import register_file

FOLDER = Path(__file__).parent
TASKS = ("berth", "river")


def example_ship() -> Path:
    """Path of a ship file with trials that comes with the package.

    It is for `shipgym.ShipFile.load` and the commands that take a ship file: a cargo
    ship of the Mariner class with three simulated zigzags as a sea trial would log
    them, two to fit and one to validate.
    """
    return FOLDER / "mariner" / "ship.toml"


for task in TASKS:
    register_file(f"examples/{task.capitalize()}-v0", FOLDER / f"{task}.py")
