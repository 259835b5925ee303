"""Load agents by their files, whatever their kind, and pretrained ones by name."""

from __future__ import annotations

from os.path import isfile
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from agents.controllers.controller import Controller
from agents.controllers.controller_file import LEARNED, REMEDY, read_controller
from shipgym import InputError, ShipModel, load_model
from shipgym.checks import did_you_mean
from shipgym.files import expecting, read_json

if TYPE_CHECKING:
    from agents.policies.policy import LearnedPolicy

    Agent: TypeAlias = Controller | LearnedPolicy

PRETRAINED = Path(__file__).parent / "pretrained"


def load_agent(path: str | Path, model: ShipModel | str | Path | None = None) -> Agent:
    """Read the file of a controller or of a learned policy; neither needs torch.

    Parameters
    ----------
    path : str or Path
        A file, or the name of a pretrained agent, `path-following-ppo`
        (`list_pretrained`).
    model : ShipModel, str or Path, optional
        The ship to steer, or its name or file; one with other observation scales is
        refused.

    Returns
    -------
    Controller or LearnedPolicy
        As it was saved.

    Raises
    ------
    InputError
        Naming the file and the field at fault, or the difference to the model.
    """
    file = find_agent(path)
    if file.suffix == ".zip":
        raise InputError(
            f"{path}: expected a file that runs no code, got one of stable-baselines3;"
            " load it there, and write LearnedPolicy.from_sb3(agent).save('agent.json')"
        )
    agent: Agent
    with expecting("controller file", file):
        content = read_json(file, "controller file", REMEDY)
        if content.get("kind") == LEARNED:
            from agents.policies.policy_file import read_policy

            agent = read_policy(content, file)
        else:
            agent = read_controller(content, str(path))

    if model is not None:
        ship = load_model(model)
        agent.check_fits_model(ship)
    return agent


def list_pretrained() -> list[str]:
    """Names of the agents that come with the package, each TASK-ALGORITHM."""
    return sorted(file.stem for file in PRETRAINED.glob("*.json"))


def find_agent(name: str | Path) -> Path:
    """Return the file of an agent.

    `name` is a file, the folder of a run, or the name of a pretrained agent. Raises
    InputError if it is none of them, with the nearest pretrained name.
    """
    path = Path(name)
    if path.suffix == ".json" or isfile(path):
        return path
    run_agent = "agent.json"  # of a training's folder
    of_run = path / run_agent
    if isfile(of_run):
        return of_run

    known = list_pretrained()
    if str(name) not in known:
        raise InputError(
            f"agent: expected a file, or one of {len(known)} pretrained agents, such as"
            f" '{known[0]}', got '{name}'.{did_you_mean(str(name), known)}"
        )
    return PRETRAINED / f"{name}.json"
