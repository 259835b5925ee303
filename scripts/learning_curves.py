"""Learning curves of PPO from scratch, with seeds, against classical autopilots.

    python scripts/learning_curves.py          six runs of a minute, and the picture
    python scripts/learning_curves.py --draw   the picture alone

The picture is docs/images/learning_curves.png, its data
build/learning_curves.json. Costs are means of a hundred episodes
held out.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from agents.controllers.designs import design
from agents.training.evaluation import HeldOut
from agents.training.plan import EVALUATION_SEED, N_EVALUATIONS
from agents.training.request import TrainingRequest, make_plan
from agents.training.training import train
from shipgym.files import make_folder, read_json, write_json

ROOT = Path(__file__).parents[1]
FOUND, PICTURE = (
    ROOT / "build" / "learning_curves.json",
    ROOT / "docs" / "images" / "learning_curves.png",
)
SEEDS = (0, 1, 2)
#: Classical autopilots by id.
CLASSICAL = {
    "shipgym/CourseKeeping-v0": ("lq",),
    "shipgym/PathFollowing-v0": ("ilos", "wheel-over"),
}
SETTINGS = {"base": "none", "total_steps": 1_000_000, "evaluate_every": 32_768}


def curves() -> dict[str, Any]:
    """Of each id, costs of the classical autopilots and evaluations of the runs."""
    found: dict[str, Any] = (
        dict(read_json(FOUND, "results", "remove it")) if FOUND.exists() else {}
    )
    for env_id, classical in CLASSICAL.items():
        task = make_plan(TrainingRequest("ppo", environment=env_id)).task
        held_out = HeldOut(task, EVALUATION_SEED, N_EVALUATIONS)
        lines = {name: held_out.cost(design(name, task)) for name in classical}
        runs = found.setdefault(
            env_id, {"model": task.model, "classical": lines, "runs": []}
        )["runs"]
        for seed in SEEDS[len(runs) :]:
            before = time.process_time()
            result = train(
                make_plan(
                    TrainingRequest(
                        "ppo", environment=env_id, settings=SETTINGS, seed=seed
                    )
                )
            )
            seconds = time.process_time() - before
            run = {
                "seed": seed,
                "processor_s": round(seconds, 1),
                "best_cost": result.best_cost,
            }
            print(f"{env_id}: {lines}, {run}", flush=True)
            points = [[row["steps"], row["cost"]] for row in result.curve]
            runs.append(run | {"curve": points})
            make_folder(FOUND.parent)
            write_json(found, FOUND)
    return found


def draw(found: dict[str, Any]) -> None:
    """Cost against decisions, a line a seed; classical autopilots are level lines."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, len(found), figsize=(9.0, 3.6), layout="constrained")
    for axis, (env_id, about) in zip(axes, found.items(), strict=True):
        for run in about["runs"]:
            steps, costs = zip(*run["curve"], strict=True)
            axis.plot(
                [step / 1e3 for step in steps],
                costs,
                lw=1.1,
                label=f"PPO, seed {run['seed']}",
            )
        for style, (name, cost) in zip(
            ("-", "--"), about["classical"].items(), strict=False
        ):
            axis.axhline(cost, color="black", lw=1.0, ls=style, label=name)
        axis.set_title(f"{env_id}, {about['model']}", fontsize=9)
        axis.set(xlabel="decisions, thousands", yscale="log")
        axis.set_ylabel("cost of an episode")
        axis.grid(alpha=0.3, which="both")
        axis.legend(fontsize=8)
    figure.savefig(PICTURE, dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    draw(
        dict(read_json(FOUND, "results", "run it without --draw"))
        if "--draw" in sys.argv
        else curves()
    )
