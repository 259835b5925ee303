"""The environments' ids."""

from __future__ import annotations

from typing import Any

import gymnasium

#: Keywords of the variants by id, without the version.
VARIANTS: dict[str, dict[str, Any]] = {
    "": {},
    "Discrete": {"action": "rudder-discrete"},
    "Shaft": {"action": "rudder-shaft", "model": "kvlcc2"},
    "Roll": {"roll": True, "roll_weight": 1.0, "model": "container"},
}
TASKS = {"CourseKeeping": "course_keeping", "PathFollowing": "path_following"}


def register_environments() -> None:
    """Register the environments with Gymnasium; a second call changes nothing."""
    for task, module in TASKS.items():
        for variant, options in VARIANTS.items():
            name = f"shipgym/{task}{variant}-v0"
            if name not in gymnasium.registry:
                gymnasium.register(
                    id=name,
                    entry_point=f"shipgym.envs.{module}:{task}Env",
                    vector_entry_point=f"shipgym.envs.{module}:{task}VectorEnv",
                    disable_env_checker=True,  # it checks its actions itself; the tests run check_env
                    kwargs=dict(options),
                )
