"""The environments' ids."""

from __future__ import annotations

import gymnasium


def register_environments() -> None:
    """Register the environments with Gymnasium; a second call changes nothing."""
    if "shipgym/CourseKeeping-v0" not in gymnasium.registry:
        gymnasium.register(
            id="shipgym/CourseKeeping-v0",
            entry_point="shipgym.envs.course_keeping:CourseKeepingEnv",
            disable_env_checker=True,  # it checks its actions itself; the tests run check_env
        )
