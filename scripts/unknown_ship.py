"""Does learning pay on a ship that is not known? Rules and agents on the same episodes.

    python scripts/unknown_ship.py rules --seconds 60
    python scripts/unknown_ship.py agents --seconds 60 --seeds 3
    python scripts/unknown_ship.py table
    python scripts/unknown_ship.py picture  # docs/images/unknown_ship.png

Each rule is searched by CMA-ES for so many seconds of processor time, each agent learns
for as long: PPO with a history of eight observations, beside a PD that nobody has
tuned. All then steer 100 episodes of ships that neither has seen (`family_seed=1`).
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch
from cma import CMAEvolutionStrategy
from numpy.typing import NDArray
from PIL import Image
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper, VecNormalize

from shipgym.envs.sb3 import ShipVecEnv

Floats = NDArray[np.float64]
Order = Callable[[Floats], Floats]  # from observations (n, 8) to rudders (n,)
ENV = "shipgym:shipgym/UnknownShip-v0"
SEEN, UNSEEN = {"family_seed": 0}, {"family_seed": 1}
RESULTS = Path("unknown_ship_results")
PICTURE = Path(__file__).parents[1] / "docs" / "images" / "unknown_ship.png"
STEPS, SHIPS, HISTORY, EPISODES = 600, 64, 8, 100
INTERVAL = 0.1  # control interval by the scale of time of observations, about
LIMIT = np.radians(35.0)


# ---- rules ---------------------------------------------------------------------------


def heading_error(observations: Floats) -> Floats:
    """Error of the heading, rad, from its sine and cosine."""
    return np.arctan2(observations[:, 0], observations[:, 1])


def pd(gains: Floats, n: int) -> Order:
    """Feedback of error, rate, sway, rudder and integral, the same for every ship."""

    def order(seen: Floats) -> Floats:
        error = heading_error(seen)
        rudder = gains[0] * error - gains[1] * seen[:, 2] + gains[2] * seen[:, 3]
        return (rudder - gains[3] * LIMIT * seen[:, 5]) / LIMIT + gains[4] * seen[:, 7]

    return order


def scheduled(gains: Floats, n: int) -> Order:
    """The same, gains by powers of the speed, and large errors at most a limit."""
    inner = pd(gains, n)

    def order(seen: Floats) -> Floats:
        speed = np.maximum(seen[:, 4], 0.2)
        changed = seen.copy()
        limited = np.clip(heading_error(seen), -abs(gains[7]), abs(gains[7]))
        error = speed ** gains[5] * limited
        changed[:, 0], changed[:, 1] = np.sin(error), np.cos(error)
        changed[:, 2] *= speed ** gains[6]
        return inner(changed)

    return order


class Adaptive:
    """LQ that is designed anew at each interval on Nomoto's equation, by RLS.

    The recursion is that of `identification.estimators.recursive` with forgetting, for
    all ships at once: acceleration of yaw by yaw rate, rudder and 1. Of rdot = -a r + b
    delta, cost error^2 + delta^2 / p^2, the optimal rudder is p error - d r, d = (-a +
    sqrt(a^2 + 2 b p)) / b.
    """

    def __init__(self, gains: Floats, n: int) -> None:
        self.gains = gains
        # before the first samples: the family's mean
        self.theta = np.tile([-gains[1], gains[2], 0.0], (n, 1))
        self.P = np.tile(np.diag([1.0, 1.0, 0.01]) * np.exp(gains[3]), (n, 1, 1))
        self.before: Floats | None = None

    def __call__(self, seen: Floats) -> Floats:
        """Return the rudders of all ships."""
        if self.before is not None:
            self.learn(self.before, seen)
        self.before = seen.copy()
        p = self.gains[0]
        a = -self.theta[:, 0]
        b = np.clip(self.theta[:, 1], 0.05, 5.0)
        d = (-a + np.sqrt(np.maximum(a * a + 2.0 * b * p, 0.0))) / b
        error = np.clip(heading_error(seen), -abs(self.gains[6]), abs(self.gains[6]))
        d *= np.exp(self.gains[4])
        return (p * error - d * seen[:, 2]) / LIMIT + self.gains[5] * seen[:, 7]

    def learn(self, before: Floats, now: Floats) -> None:
        """Take in the last interval."""
        forgetting = 0.995
        rudder = 0.5 * LIMIT * (before[:, 5] + now[:, 5])
        phi = np.stack([before[:, 2], rudder, np.ones(len(now))], axis=1)
        rate = (now[:, 2] - before[:, 2]) / INTERVAL
        moved = np.einsum("nij,nj->ni", self.P, phi)
        gain = moved / (forgetting + np.einsum("ni,ni->n", phi, moved))[:, None]
        missed = rate - np.einsum("ni,ni->n", phi, self.theta)
        self.theta += gain * missed[:, None]
        self.P = (self.P - gain[:, :, None] * moved[:, None, :]) / forgetting
        trace = np.trace(self.P, axis1=1, axis2=2)
        self.P *= np.minimum(1.0, 10.0 / trace)[:, None, None]


class Rule(NamedTuple):
    """A rule with the settings from which its search begins."""

    begin: Callable[[Floats, int], Order]
    start: tuple[float, ...]


RULES = {
    "robust": Rule(pd, (1.5, 1.5, 0.0, 0.0, 0.1)),
    "scheduled": Rule(scheduled, (1.5, 1.5, 0.0, 0.0, 0.1, 0.0, -0.5, 1.0)),
    "adaptive": Rule(Adaptive, (1.5, 0.5, 0.6, 0.0, 0.0, 0.1, 1.0)),
}
BASE = pd(np.array([2.0, 2.0, 0.0, 0.0, 0.0]), 1)


# ---- episodes ------------------------------------------------------------------------


def sail(env: Any, order: Order, seeds: list[int]) -> tuple[Floats, int]:
    """Costs of episodes, shape (n,), and how often control was lost."""
    observations, _ = env.reset(seed=seeds)
    costs = np.zeros(len(seeds))
    lost = np.zeros(len(seeds), dtype=np.bool_)
    for _ in range(STEPS):
        rudder = np.clip(order(observations.astype(np.float64)), -1.0, 1.0)
        actions = rudder.astype(np.float32)[:, None]
        observations, _, terminated, _, info = env.step(actions)
        costs += np.where(lost, 0.0, info["cost"])
        lost |= terminated
    return costs, int(lost.sum())


def judged(name: str, order: Order, **options: Any) -> None:
    """Keep costs and losses on the episodes that are scored."""
    env = gymnasium.make_vec(ENV, num_envs=EPISODES, **UNSEEN, **options)
    costs, lost = sail(env, order, list(range(10**6, 10**6 + EPISODES)))
    RESULTS.mkdir(exist_ok=True)
    np.savez(RESULTS / f"{name}.npz", costs=costs, lost=lost)
    print(f"{name}: {costs.mean():.1f}, lost {lost}", flush=True)


def search(name: str, seconds: float) -> None:
    """Search the settings of a rule, and judge the mean of the last generation."""
    rule = RULES[name]
    env = gymnasium.make_vec(ENV, num_envs=SHIPS, **SEEN)
    search = CMAEvolutionStrategy(list(rule.start), 0.3, {"seed": 1, "verbose": -9})
    end = time.process_time() + seconds
    generation = 0
    while time.process_time() < end:
        first = generation % 4 * SHIPS
        seeds = list(range(first, first + SHIPS))
        asked = search.ask()
        costs = []
        for settings in asked:
            found, _ = sail(env, rule.begin(np.array(settings), SHIPS), seeds)
            costs.append(float(found.mean()))
        search.tell(asked, costs)
        generation += 1
    found = np.asarray(search.mean)
    print(name, generation, "generations:", np.round(found, 3).tolist(), flush=True)
    judged(name, rule.begin(found, EPISODES))


# ---- agents --------------------------------------------------------------------------


class BesideBase(VecEnvWrapper):
    """Ships whose rudder is the base's and half the agent's."""

    def reset(self) -> Any:
        """Begin an episode in each row."""
        self.seen = self.venv.reset()
        return self.seen

    def step_async(self, actions: Any) -> None:
        """Add the base's rudder."""
        self.venv.step_async(with_base(self.seen, actions))

    def step_wait(self) -> Any:
        """Keep what the base has to see next."""
        result = self.venv.step_wait()
        self.seen = result[0]
        return result


def with_base(stacked: Any, actions: Any) -> NDArray[np.float32]:
    """Rudders of the base with half of the agent's, shape (n, 1)."""
    base = np.clip(BASE(stacked[:, -1].astype(np.float64)), -1.0, 1.0)
    rudder = np.clip(base[:, None] + 0.5 * actions, -1.0, 1.0)
    return rudder.astype(np.float32)


class Deadline(BaseCallback):
    """End of learning after some seconds of processor time; less and less exploring."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self.begun = time.process_time()
        self.seconds = seconds

    def _on_step(self) -> bool:
        return time.process_time() - self.begun < self.seconds

    def _on_rollout_end(self) -> None:
        part = (time.process_time() - self.begun) / self.seconds
        policy: Any = self.model.policy
        policy.log_std.data.fill_(-1.0 - 2.0 * min(part, 1.0))


def learn(seed: int, seconds: float) -> None:
    """Let an agent learn, and judge it."""
    lanes = ShipVecEnv(ENV, SHIPS, **SEEN, frame_stack=HISTORY, bounded=False)
    ships = VecNormalize(BesideBase(lanes), norm_obs=False, gamma=0.99)
    agent = PPO(
        "MlpPolicy",
        ships,
        seed=seed,
        n_steps=64,
        batch_size=512,
        n_epochs=5,
        gamma=0.99,
        gae_lambda=0.95,
        learning_rate=5e-4,
        policy_kwargs={"log_std_init": -1.0},
        device="cpu",
    )
    agent.learn(10**9, callback=Deadline(seconds))
    print(f"seed {seed}: {agent.num_timesteps} steps", flush=True)

    def order(stacked: Floats) -> Floats:
        actions, _ = agent.predict(stacked, deterministic=True)
        return with_base(stacked, actions)[:, 0].astype(np.float64)

    judged(f"agent-{seed}", order, frame_stack=HISTORY)


# ---- table ---------------------------------------------------------------------------


def table() -> None:
    """Print costs with their intervals, and differences from the best rule."""
    found = {path.stem: np.load(path) for path in sorted(RESULTS.glob("*.npz"))}
    best = min(RULES, key=lambda name: found[name]["costs"].mean())
    print("| | cost | by the best rule, 95 % | lost |\n| --- | --- | --- | --- |")
    for name, one in found.items():
        difference = one["costs"] - found[best]["costs"]
        width = 1.96 * difference.std(ddof=1) / np.sqrt(EPISODES)
        print(
            f"| {name} | {one['costs'].mean():.1f} | {difference.mean():+.1f} +-"
            f" {width:.1f} | {int(one['lost'])} |"
        )


def picture() -> None:
    """Draw four ships of the family, which one untuned rule steers."""
    env = gymnasium.make_vec(ENV, num_envs=4, render_mode="rgb_array")
    observations, _ = env.reset(seed=[1, 2, 5, 8])
    shown = 130
    for _ in range(shown):
        rudder = np.clip(BASE(observations), -1.0, 1.0)
        observations, *_ = env.step(rudder.astype(np.float32)[:, None])
    size = 600
    montage = Image.new("RGB", (2 * size, 2 * size))
    for number, pixels in enumerate(env.render()):
        row, column = divmod(number, 2)
        montage.paste(Image.fromarray(pixels), (column * size, row * size))
    montage.resize((800, 800)).quantize(64).save(PICTURE, optimize=True)


def main() -> None:
    """Do what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["rules", "agents", "table", "picture"])
    parser.add_argument("--seconds", type=float, default=240.0)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first-seed", type=int, default=0)
    asked = parser.parse_args()
    torch.set_num_threads(1)
    if asked.what == "table":
        table()
    elif asked.what == "picture":
        picture()
    elif asked.what == "rules":
        judged("untuned", BASE)
        for name in RULES:
            search(name, asked.seconds)
    else:
        for seed in range(asked.first_seed, asked.first_seed + asked.seeds):
            learn(seed, asked.seconds)


if __name__ == "__main__":
    main()
