"""Rewards of goals, many at once, as stable-baselines3's HER asks for them."""

from typing import Any

from shipgym.engine.hooks import goal_reward, load_goal, load_task_settings
from shipgym.engine.records import LANES


def reward_goals(achieved: Any, desired: Any, settings: Any, rewards: Any) -> None:
    """Reward goals achieved for those desired.

    Tiles hold 64 goals each, whole vectors, so that a reward does not depend on how
    many there are. Of settings there is a tile for each of theirs, or one for all.
    """
    for tile in range(len(rewards)):
        of_tile = settings[tile % len(settings)]
        for lane in range(LANES):
            task_settings = load_task_settings(of_tile, lane)
            reached = load_goal(achieved[tile], lane)
            wanted = load_goal(desired[tile], lane)
            rewards[tile, lane] = goal_reward(reached, wanted, task_settings)
