"""The page that replays episodes."""

from agents.rollouts.replay_page import write_replay

__all__ = ["write_replay"]
