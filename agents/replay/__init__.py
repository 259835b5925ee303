"""The page that replays episodes."""

from agents.replay.page import write_replay

__all__ = ["write_replay"]
