"""A suite of short episodes, as a user writes one."""

import json

TEXT = """
name = "small-v1"

[tasks.calm]
environment = "course-keeping"
model = "mariner"
why = "the easiest"
options = { episode_steps = 40, change_interval_steps = 15 }

[tasks.turns]
environment = "path-following"
model = "mariner-tls-svm"
ship = "mariner"
options = { episode_steps = 60, n_legs = 2 }
sweep = [{ gear = { time_constant = 8.0 } }, { noise = 2.0 }]
"""
SETS = ["ship", "fresh", "model", "sweep-1", "sweep-2"]  # of the task "turns"


def write_suite(folder, text=TEXT, **kept):
    """Write a suite and what is kept beside it: `best`, `tuned`."""
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    for what, content in kept.items():
        (folder / f"small-{what}.json").write_text(json.dumps(content))
    return path
