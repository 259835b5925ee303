"""Train the agent for all ships, and say what it costs on ships that it never saw.

    python scripts/one_for_all.py search --out runs/one-for-all      # the rule of the
    base's settings python scripts/one_for_all.py train --out runs/one-for-all       #
    fleet and runs, what is missing python scripts/one_for_all.py evaluate --out
    runs/one-for-all    # the table of docs/one_for_all.md

The fleet is drawn around the shipped models of container ship, KVLCC2 and tanker
(scripts/fleet.py). The Mariner and the two ships of tests/ships/mmg.py are in no way a
part of it. Each training seed learns on the same fleet; published is the one whose
costs on a second fleet, which nobody learned on, are least. Killed, it goes on with the
training seed that was under way.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from certainty import sea_trials
from direct_search import is_sane, tune
from fleet import Fleet, Learner, Pilots, draw_fleet, learning_ships
from scipy.optimize import minimize
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

import shipgym  # noqa: E402 - the folder above has to be found first
from agents.agent_file import read_agent  # noqa: E402
from agents.controllers.designs import design  # noqa: E402
from agents.policies.network import Network  # noqa: E402
from agents.policies.one_for_all import (  # noqa: E402
    CONTEXT,
    ONE_FOR_ALL,
    RULED,
    OneForAll,
)
from agents.policies.policy_extraction import _network  # noqa: E402
from agents.rollouts.rollout import episode_costs  # noqa: E402
from agents.suites.suite import FIRST_SEED, N_EPISODES, BenchmarkTask  # noqa: E402
from agents.training.algorithms import (  # noqa: E402
    sb3_arguments,
    scaled_rewards,
    set_deviation,
)
from agents.training.run_folder import versions  # noqa: E402
from agents.training.settings import load_settings  # noqa: E402
from identification import identify  # noqa: E402
from shipgym.envs.engine import Engine  # noqa: E402
from shipgym.files import read_json, write_json  # noqa: E402
from shipgym.sea import Current, Weather  # noqa: E402
from tests.ships.mmg import MMG_SHIPS, mmg_ship  # noqa: E402

#: The shipped models around which the fleet is drawn.
BASES = (
    "container-4dof-output-error",
    "container-abc-lssvr",
    "container-two-zigzags",
    "kvlcc2-mmg",
    "kvlcc2-rm-svm",
    "tanker-tls-svm",
)
FLEET_SEED, VALIDATION_SEED = 1, 2
PATHS, SHIPS, LANES = (
    6,
    4,
    5,
)  # around each shipped model: paths, ships on each, and how often she is there
DECISION = 16  # control intervals
SETTINGS = {
    "base": "wheel-over",
    "total_steps": 327_680,
    "ships": 640,
    "n_steps": 32,
    "batch_size": 2048,
    "n_epochs": 6,
    "learning_rate": 3e-4,
    "gamma": 0.92,
    "gae_lambda": 0.95,
    "authority": 0.15,
    "action_repeat": DECISION,
    "log_std_init": -2.0,
    "log_std_end": -3.0,
    "net_arch": [64, 64],
    "reward_scale": 5.0,
}
#: The rule that is searched, powers of a corridor narrower than a ship length: in wider
#: ones the settings are the design's own.
SEARCHED = tuple(f"{name}_power" for name in RULED)
LARGEST_POWER = 4.0
EVALUATIONS, INSANE = (
    80,
    0.02,
)  # of the search; share of ships whose loops may have less than the margins
BUDGET = 24, 16  # of tuning: settings, episodes
RULE, ALONE, SHIPPED = (
    "rule.json",
    "alone.json",
    ROOT / "agents" / "pretrained" / f"{ONE_FOR_ALL}.json",
)
OBSERVED = 15  # quantities: helm, path and turns


def draw_fleets(seed: int, paths: int, ships: int, out: Path) -> list[Fleet]:
    """The fleets of a seed: for each shipped model ships on some paths; kept in the folder."""
    file, random = out / f"fleet-{seed}.json", np.random.default_rng(seed)
    if not file.is_file():
        drawn = [
            draw_fleet(name, ships, random) for name in BASES for _ in range(paths)
        ]
        write_json([fleet.to_dict() for fleet in drawn], file)
    return [Fleet.from_dict(one) for one in json.loads(file.read_text())]


def untrained(fleets: Sequence[Fleet], rule: Mapping[str, float]) -> OneForAll:
    """A policy that adds nothing, with the range of the fleets' contexts."""
    told = np.concatenate([fleet.told for fleet in fleets])
    observed = fleets[0].task.observed(fleets[0].lanes[0].model)[:OBSERVED]
    n_in = OBSERVED + 1 + len(CONTEXT)
    record = {
        "command": "python scripts/one_for_all.py search",
        "validation": 1.0,
        "versions": versions(),
        "fleet": {
            "models": list(BASES),
            "seed": FLEET_SEED,
            "paths": PATHS,
            "ships": SHIPS,
        },
    }
    nothing = Network(((np.zeros((1, n_in), np.float32), np.zeros(1, np.float32)),))
    numbers = np.stack([told.mean(0), told.std(0), told.min(0), told.max(0)], axis=1)
    names = tuple(one.name for one in observed)
    return OneForAll(
        nothing,
        names,
        numbers,
        decision=0.05 * DECISION,
        authority=float(SETTINGS["authority"]),
        rule=rule,
        training=record,
    )


def search(out: Path) -> None:
    """Find the rule of the base's settings on a part of the fleet: least cost over the design's own."""
    fleets = [
        replace(one, lanes=one.lanes[:2])
        for one in draw_fleets(FLEET_SEED, PATHS, SHIPS, out)[::2]
    ]
    zero = [fleet.cost_of(Pilots(fleet.pilots), 0).mean() for fleet in fleets]
    names = SEARCHED
    found: list[tuple[float, dict[str, float]]] = []

    def cost(x: Any) -> float:
        rule = dict(
            zip(names, np.clip(x, -LARGEST_POWER, LARGEST_POWER).tolist(), strict=True)
        )
        try:
            ruled = [fleet.ruled(rule) for fleet in fleets]
            insane = np.mean(
                [not is_sane(pilot) for fleet in ruled for pilot in fleet.pilots]
            )
            if insane > INSANE:
                return 10.0 + float(insane)
            parts = [
                fleet.cost_of(Pilots(fleet.pilots), 0).mean() / one
                for fleet, one in zip(ruled, zero, strict=True)
            ]
        except shipgym.InputError:
            return 20.0
        found.append((float(np.exp(np.mean(np.log(parts)))), rule))
        print(
            f"{len(found):4d} {found[-1][0]:.4f} least"
            f" {min(found, key=lambda one: one[0])[0]:.4f}",
            flush=True,
        )
        return found[-1][0]

    start = np.zeros(len(names))
    simplex = np.vstack([start, start + 0.3 * np.eye(len(names))])
    options = {
        "initial_simplex": simplex,
        "maxfev": EVALUATIONS,
        "xatol": 0.02,
        "fatol": 1e-4,
    }
    minimize(cost, start, method="Nelder-Mead", options=options)
    least, rule = min(found, key=lambda one: one[0])
    others = draw_fleets(VALIDATION_SEED, 2, 4, out)
    held = [fleet.cost_of(Pilots(fleet.pilots)).mean() for fleet in others]
    ruled = [fleet.ruled(rule) for fleet in others]
    parts = [
        fleet.cost_of(Pilots(fleet.pilots)).mean() / one
        for fleet, one in zip(ruled, held, strict=True)
    ]
    second = float(np.exp(np.mean(np.log(parts))))
    rule = {name: round(value, 3) for name, value in rule.items()}
    write_json(
        {
            "rule": rule,
            "cost": least,
            "second_fleet": second,
            "evaluations": len(found),
        },
        out / RULE,
    )
    untrained(draw_fleets(FLEET_SEED, PATHS, SHIPS, out), rule).save(out / ALONE)
    publish((), out)
    print(rule, f"{least:.4f} on the fleet, {second:.4f} on the second")


class Annealing(BaseCallback):
    """Sets the exploration at each rollout and tells of the run."""

    def __init__(self, settings: Any, validation: Any) -> None:
        super().__init__()
        self.settings, self.validation, self.began, self.curve = (
            settings,
            validation,
            time.process_time(),
            [],
        )

    def _on_rollout_start(self) -> None:
        set_deviation(self.model, self.settings)
        if self.num_timesteps // 163_840 > len(self.curve):
            ratio = self.validation(_network(self.model))
            self.curve.append([self.num_timesteps, round(ratio, 4)])
            print(
                f"  {self.num_timesteps:8d} {ratio:.4f}"
                f" {time.process_time() - self.began:6.0f} s",
                flush=True,
            )

    def _on_step(self) -> bool:
        return True


def ratio_on(fleets: Sequence[Fleet], zero: Sequence[Any], agent: OneForAll) -> float:
    """Mean over fleets of the cost over that of wheel-over, each the mean of a fleet's ships."""
    costs = [fleet.cost_of(Learner(agent, fleet, DECISION)) for fleet in fleets]
    return float(
        np.mean(
            [one.mean() / other.mean() for one, other in zip(costs, zero, strict=True)]
        )
    )


def train(seeds: Sequence[int], out: Path) -> None:
    """Train what is missing, and publish the best on the validation fleet."""
    missing = [seed for seed in seeds if not (out / f"{seed}.json").is_file()]
    if missing:
        began = time.process_time()
        rule = read_json(
            out / RULE, "rule", "python scripts/one_for_all.py search makes it"
        )["rule"]
        fleets = [
            one.ruled(rule).times(LANES)
            for one in draw_fleets(FLEET_SEED, PATHS, SHIPS, out)
        ]
        validation = [
            one.ruled(rule) for one in draw_fleets(VALIDATION_SEED, 2, 4, out)
        ]
        zero = [fleet.cost_of(Pilots(fleet.pilots)) for fleet in validation]
        like = untrained(fleets, rule)
        print(
            f"{sum(len(fleet.lanes) for fleet in fleets)} ships,"
            f" {time.process_time() - began:.0f} s"
        )
        for name, numbers in zip(CONTEXT, like.fleet, strict=True):
            print(
                f"  {name:14s}" + " ".join(f"{value:8.3f}" for value in numbers),
                flush=True,
            )
        for seed in missing:
            learn(
                seed, fleets, lambda agent: ratio_on(validation, zero, agent), like, out
            )
    publish(seeds, out)


def publish(seeds: Sequence[int], out: Path) -> None:
    """Ship the best on the validation fleet, the rule alone among them, with the record of all."""
    agents = [read_agent(out / f"{seed}.json") for seed in seeds]
    best = min(
        [read_agent(out / ALONE), *agents], key=lambda one: one.training["validation"]
    )
    runs = [
        {name: one.training[name] for name in ("seed", "validation", "curve")}
        for one in agents
    ]
    replace(best, training={**best.training, "runs": runs}).save(SHIPPED)


def learn(
    seed: int, fleets: Sequence[Fleet], validation: Any, like: OneForAll, out: Path
) -> None:
    """One training seed."""
    print(f"training seed {seed}", flush=True)
    settings, began = (
        load_settings("ppo", "path-following", given=SETTINGS),
        time.process_time(),
    )
    ships = scaled_rewards(learning_ships(fleets, like, DECISION), settings)
    agent = PPO("MlpPolicy", ships, seed=1000 * seed, **sb3_arguments(settings))
    told = Annealing(
        settings, lambda network: validation(replace(like, network=network))
    )
    agent.learn(settings.total_steps, told)
    network = _network(agent)
    ratio = validation(replace(like, network=network))
    record = {
        "algorithm": "ppo",
        "seed": seed,
        "command": f"python scripts/one_for_all.py train --seeds {seed}",
        "fleet": {
            "models": list(BASES),
            "seed": FLEET_SEED,
            "paths": PATHS,
            "ships": SHIPS,
        },
        "settings": settings.to_dict(),
        "steps": agent.num_timesteps,
        "curve": told.curve,
        "validation": round(ratio, 5),
        "versions": versions(),
    }
    replace(like, network=network, training=record).save(out / f"{seed}.json")
    print(
        f"  {agent.num_timesteps:8d} {ratio:.4f} {time.process_time() - began:6.0f} s",
        flush=True,
    )


def unseen(folder: Path) -> list[tuple[str, Path, Any]]:
    """Ships that nothing was learned on: name, file of the model that is known of her, and the ship."""
    found = [
        (
            "mariner",
            ROOT / "shipgym/ships/library/mariner-tls-svm.json",
            shipgym.load_model("mariner"),
        )
    ]
    for name in MMG_SHIPS:
        ship, file = mmg_ship(name), folder / f"{name}-abkowitz.json"
        if not file.is_file():
            trials = sea_trials(ship, "zigzags and turn", 0)
            identify(
                trials, "abkowitz", particulars=ship.particulars, steering=ship.steering
            ).model.save(file)
        found.append((name, file, ship))
    return found


def kinds(ship: Any) -> dict[str, dict[str, Any]]:
    """Options of the paths; `river` was laid down before the shipped rule was run on it."""
    speed, time_of_length = (
        ship.particulars["speed"],
        ship.particulars["length"] / ship.particulars["speed"],
    )
    current = Current(
        0.2 * speed, variation=0.05 * speed, time_constant=20.0 * time_of_length
    )
    sharp = {
        "max_turn_deg": 120.0,
        "turn_radius": 3.0,
        "leg_lengths": [12.0, 18.0],
        "ground": 8.0,
    }
    return {
        "default": {},
        "sharp turns": sharp,
        "current": {"sea": Weather(current=current), "ground": 6.0},
        "narrow": {"corridor": 0.25, "ground": 1.0, "max_turn_deg": 45.0},
        "channel": {
            "corridor": 0.4,
            "ground": 1.5,
            "max_turn_deg": 75.0,
            "turn_radius": 3.5,
        },
        "river": {
            "sea": Weather(current=Current(0.1 * speed)),
            "corridor": 0.6,
            "ground": 2.0,
            "max_turn_deg": 60.0,
        },
    }


def evaluate(out: Path) -> None:
    """Costs of the shipped agent on the unseen ships: what is missing, then the table."""
    results, agent = out / "unseen.json", read_agent(SHIPPED)
    rows: dict[str, Any] = (
        read_json(results, "results", "delete it") if results.is_file() else {}
    )
    for name, file, ship in unseen(out):
        for kind, options in kinds(ship).items():
            row = rows.setdefault(f"{name}, {kind}", {})
            task = BenchmarkTask("", "path-following-v1", str(file), "", options)
            who: dict[str, Any] = {
                "wheel-over": lambda task=task: design("wheel-over", task),
                "tuned": lambda task=task: tuned(task),
                ONE_FOR_ALL: lambda task=task: agent.for_ship(task.ship, task.task),
            }
            for one in [one for one in who if one not in row]:
                engine = Engine(ship, N_EPISODES, task.task)
                row[one] = episode_costs(
                    who[one](), engine, FIRST_SEED + np.arange(N_EPISODES)
                ).tolist()
                print(f"{name}, {kind}: {one} {np.mean(row[one]):.1f}", flush=True)
                write_json(rows, results)
    print(table(rows))


def tuned(task: BenchmarkTask) -> Any:
    """Wheel-over and the LQ that it leads, tuned on the model with the budget of suite shipgym-v2."""
    lq = tune("lq", task, None, *BUDGET).settings
    return design(
        "wheel-over", task, tune("wheel-over", task, {"lq": lq}, *BUDGET).settings
    )


def table(rows: dict[str, Any]) -> str:
    """In Markdown: mean costs, and the agent's over those of the baselines with 95 % intervals."""
    random, lines = (
        np.random.default_rng(0),
        [
            (
                "| ship, path | wheel-over | tuned | one for all | relative to tuned |"
                " relative to wheel-over |"
            ),
            "| --- | --- | --- | --- | --- | --- |",
        ],
    )
    ratios = []
    for name, row in rows.items():
        own, parts = np.array(row[ONE_FOR_ALL]), []
        for other in ("tuned", "wheel-over"):
            base = np.array(row[other])
            drawn = [
                own[which].mean() / base[which].mean()
                for which in random.integers(len(own), size=(1000, len(own)))
            ]
            low, high = np.percentile(drawn, (2.5, 97.5))
            parts.append(f"{own.mean() / base.mean():.3f} ({low:.3f} to {high:.3f})")
        ratios.append(
            [own.mean() / np.mean(row[other]) for other in ("tuned", "wheel-over")]
        )
        costs = " | ".join(
            f"{np.mean(row[who]):.1f}" for who in ("wheel-over", "tuned", ONE_FOR_ALL)
        )
        lines.append(f"| {name} | {costs} | {' | '.join(parts)} |")
    means = " | ".join(f"{one:.3f}" for one in np.exp(np.mean(np.log(ratios), axis=0)))
    return "\n".join([*lines, f"| geometric mean | | | | {means} |"])


def main() -> None:
    """Train or evaluate."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=("search", "train", "evaluate"))
    parser.add_argument(
        "--seeds", default="0,1,2,3,4", help="training seeds, separated by commas"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("runs/one-for-all"), help="folder of the runs"
    )
    asked = parser.parse_args()
    torch.set_num_threads(1)
    warnings.simplefilter("ignore")
    asked.out.mkdir(parents=True, exist_ok=True)
    seeds = [int(seed) for seed in asked.seeds.split(",") if seed]
    if asked.what == "search":
        search(asked.out)
        return
    train(seeds, asked.out) if asked.what == "train" else evaluate(asked.out)


if __name__ == "__main__":
    main()
