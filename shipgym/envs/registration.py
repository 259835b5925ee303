"""The environments' ids, and tasks of your own."""

from pathlib import Path
from typing import Any

import gymnasium

from shipgym.checks import check_text
from shipgym.errors import InputError
from shipgym.python_files import file_options

ENTRY_POINT = "shipgym.envs.ship_env:ShipEnv"  # of every environment
#: Waves of sea states 4 and 5 from abeam to the quarter, by height and period.
ROLLING_SEAS = [
    {
        "waves": {
            "significant_height": height,
            "peak_period": period,
            "from_deg": from_deg,
        }
    }
    for height, period in ((1.9, 8.8), (2.6, 9.2))
    for from_deg in (-125.0, -110.0, -95.0, -80.0, 80.0, 95.0, 110.0, 125.0)
]
#: Keywords of each environment by its id.
ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "shipgym/CourseKeeping-v0": {"task": "CourseKeeping"},
    "shipgym/CourseKeepingDiscrete-v0": {
        "task": "CourseKeeping",
        "action": "rudder-discrete",
        "action_repeat": 10,  # half a ship length: DQN looks few decisions ahead
    },
    "shipgym/CourseKeepingShaft-v0": {
        "task": "CourseKeeping",
        "action": "rudder-shaft",
        "model": "kvlcc2-mmg",
    },
    "shipgym/RudderRoll-v0": {
        "task": "CourseKeeping",
        "model": "container-stiff",
        "roll": True,
        "sea": ROLLING_SEAS,
        "rudder_rate_range": (2.5, 5.0),
        "first_course_deg": 5.0,
        "course_change_deg": 0.0,
        "heading_scale_deg": 5.0,
        "rudder_weight": 0.01,
        "rudder_rate_weight": 0.0005,
        "roll_weight": 1.0,
        "roll_scale_deg": 5.0,
        "roll_free_deg": 3.0,
        "speed_weight": 1.0,
        "bounded": 100.0,
    },
    "shipgym/UnknownShip-v0": {
        "task": "CourseKeeping",
        "model": "container-two-zigzags",
        "model_uncertainty": "covariance",
        "loading_range": (0.8, 1.1),
        "speed_range": (0.6, 1.0),
        "rudder_rate_range": (2.0, 5.0),
        "sea": ["calm", "slight", "moderate"],
        "course_change_deg": 60.0,
        "change_interval_steps": 100,
        "max_heading_error_deg": 120.0,
        "bounded": 20.0,
    },
    "shipgym/PathFollowing-v0": {
        "task": "PathFollowing",
        "model": "container-abc-lssvr",
    },
    "shipgym/PathFollowingDiscrete-v0": {
        "task": "PathFollowing",
        "action": "rudder-discrete",
        "model": "kvlcc2-tanker-rm-svm",
    },
    "shipgym/PathFollowingShaft-v0": {
        "task": "PathFollowing",
        "action": "rudder-shaft",
        "model": "tanker-tls-svm",
    },
    "shipgym/PathFollowingRoll-v0": {
        "task": "PathFollowing",
        "roll": True,
        "roll_weight": 1.0,
        "model": "container-4dof-output-error",
    },
    "shipgym/Encounter-v0": {
        "task": "Encounter",
        "model": "container-two-zigzags",
        "bounded": False,
    },
}


def env_id(task: str) -> str:
    """Return the id of a shipped task's environment, without a variant."""
    return f"shipgym/{task}-v0"


def register_environments() -> None:
    """Register the environments with Gymnasium; a second call changes nothing."""
    for name, options in ENVIRONMENTS.items():
        _register(name, options)


def register_task(env_id: str, task: str | Path | Any, **options: Any) -> None:
    """Register a task of your own, so that `gym.make` and `gym.make_vec` know it.

    It is run in plain Python and compiled, which takes some seconds, once. Raises
    InputError if the task does not meet the contract, cannot be compiled or does not
    fit the ship, or the id is in use; nothing is registered then.

    Parameters
    ----------
    env_id : str
        Such as "harbour/TurningBasin-v0".
    task : str, Path or module
        The file of the task (`shipgym.tasks.contract`). Give its path, and worker
        processes find it too.
    **options
        Keywords of the environment that differ from their defaults, and from those
        that the file names in `OPTIONS`.
    """
    from shipgym.engine.source import kept_source
    from shipgym.envs.ship_env import ShipEnv

    given = {**file_options(task), **options, "task": kept_source(task)}
    for name in given.keys() & {"reward", "sensors", "sea"}:
        given[name] = kept_source(given[name])
    known = gymnasium.registry.get(check_text(env_id, "env_id"))
    if known is not None and known.kwargs != given:
        raise InputError(
            f"{env_id}: expected an unused id, got one registered for"
            f" {known.kwargs.get('task')!r}; give another name or version"
        )
    env = ShipEnv(**given)
    env.close()
    try:
        _register(env_id, given)
    except gymnasium.error.Error as error:
        raise InputError(
            f"env_id: expected an id such as 'harbour/{env.task.name}-v0', got"
            f" {env_id!r}: {error}"
        ) from None


def register_file(env_id: str, path: Path) -> None:
    """Register a task of a file, untried."""
    _register(env_id, {"task": str(path), **file_options(path)})


def registered() -> dict[str, dict[str, Any]]:
    """Keywords of the environments of shipgym, shipped and users' own, by their ids."""
    found = {}
    for name, spec in gymnasium.registry.items():
        if spec.entry_point == ENTRY_POINT and "task" in spec.kwargs:
            found[name] = spec.kwargs
    return found


def _register(env_id: str, options: dict[str, Any]) -> None:
    if env_id in gymnasium.registry:
        return
    gymnasium.register(
        id=env_id,
        entry_point=ENTRY_POINT,
        vector_entry_point="shipgym.envs.ship_vector_env:ShipVectorEnv",
        # it checks its actions itself; the tests run check_env
        disable_env_checker=True,
        kwargs=options,
    )
