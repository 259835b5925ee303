"""The kinds of files that are read, a line each in `KINDS`.

A new reader joins with a line: its name, the function that reads a path, and what is
done with the result, so that a field which nobody checked fails here. Small sound files
of the kind go into `tests/corpus/NAME`.
"""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from agents import load_agent, load_results
from agents.cli.benchmark_tables import ranking_tables
from agents.suites.suite import parse_suite
from agents.training.settings import load_settings, read_settings_file
from fuzzing.reading import Kind
from shipgym import Episode, ShipFile, ShipModel, Trial
from shipgym.files import LARGEST_TOML, read_bytes
from shipgym.trials.guesses import guess_trial

SHOWN = Console(file=io.StringIO(), width=120)


def written(fields: Any) -> None:
    """What was read can be written again."""
    json.dumps(fields, allow_nan=False).encode()


def use_model(model: ShipModel) -> None:
    """Accelerations of a ship that sails straight ahead, and of one that turns."""
    written(model.to_dict())
    with np.errstate(all="ignore"):
        model.derivatives(model.service_state, model.service_command)
        if model.covariance is not None:
            model.sample(1, 0)


def use_agent(agent: Any) -> None:
    """Commands for three ships, again with what it remembers, and its file."""
    n = len(agent.observation_names)
    seen = np.linspace(-0.9, 0.8, 3 * n).reshape(3, n)
    state = None
    for _ in range(0 if getattr(agent, "has_ship", False) else 3):  # hers is a search
        with np.errstate(all="ignore"):
            action, state = agent.predict(seen, state, np.array([False, True, False]))
        if action.shape[0] != 3 or not np.all(np.abs(action) <= 1.0):
            raise AssertionError(f"commands {action.tolist()}")
    written(
        agent.file_fields()[0] if hasattr(agent, "file_fields") else agent.to_dict()
    )
    if hasattr(agent, "loop"):
        with np.errstate(all="ignore"):
            agent.loop()


def use_results(result: Any) -> None:
    """The tables that are printed, and every figure."""
    if result is None:  # to be computed again
        return
    for table in ranking_tables(result):
        SHOWN.print(table)
    result.to_frame()
    written(result.summary)


def use_episode(episode: Episode) -> None:
    """As a trial."""
    if episode.n_steps > 1:
        episode.to_trial()


def use_ship(trials: list[Trial]) -> None:
    """All channels are finite."""
    for trial in filter(None, trials):  # none where a decision is needed
        if not all(
            np.isfinite(values).all() for values in (trial.t, *trial.channels.values())
        ):
            raise AssertionError(f"{trial.name}: not finite")


def read_suite(path: Path) -> Any:
    """A suite from its text."""
    return parse_suite(
        read_bytes(path, "suite", LARGEST_TOML).decode("utf-8", "replace"), path.name
    )


def read_settings(path: Path) -> Any:
    """Settings as `shipgym train --settings` takes them."""
    return load_settings("ppo", given=read_settings_file(path, "ppo")).to_dict()


KINDS = (
    Kind(
        "ship-file",
        lambda path: ShipFile.load(path).trials(),
        use_ship,
        main="ship.toml",
        slow=3,
    ),
    Kind("trial", lambda path: [Trial.from_csv(path)], use_ship),
    Kind("log", lambda path: [guess_trial(path).trial], use_ship, slow=4),
    Kind("model", ShipModel.load, use_model, slow=2),
    Kind("controller", load_agent, use_agent),
    Kind("policy", load_agent, use_agent, main="agent.json", slow=4),
    Kind("episode", Episode.load, use_episode),
    Kind("results", load_results, use_results, main="results.json", slow=8),
    Kind("suite", read_suite, slow=2),
    Kind("settings", read_settings, slow=8),
)
