"""Train the agents of `agents/pretrained`, one for each registered environment.

    python scripts/train_pretrained.py [FOLDER]

Each learns on the ship that its environment has by default. Of a run the policy that
costs least on held-out episodes is shipped, with the command that makes it again.
Killed at any moment, the script goes on where it was.
"""

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from agents.agent_file import PRETRAINED, load_agent
from agents.cli import app

#: What the agents add to; in course keeping there is next to nothing to gain on LQ.
BASES = {"shipgym/CourseKeeping-v0": "none", "shipgym/PathFollowing-v0": "preview-lq"}


def main(runs: Path) -> None:
    """Train what is missing, and write the agents with their records."""
    for environment, base in BASES.items():
        words = ["train", "ppo", "--env", environment, "--set", f"base={base}", "--out"]
        folder = runs / environment
        resumed = ["--resume"] if (folder / "run.json").is_file() else []
        app([*words, str(folder), *resumed], standalone_mode=False)
        policy: Any = load_agent(folder / "agent.json")
        command = shlex.join(["shipgym", *words, "run"])
        curve = [[steps, round(cost, 3)] for steps, cost in policy.training["curve"]]
        record = {**policy.training, "command": command, "curve": curve}
        name = f"{record['environment']}-ppo.json"
        replace(policy, training=record).save(PRETRAINED / name)


if __name__ == "__main__":
    main(Path(sys.argv[1] if sys.argv[1:] else "runs/pretrained"))
