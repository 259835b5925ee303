from .replay_page import write_replay as write_replay
