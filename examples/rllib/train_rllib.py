"""PPO of RLlib learns to keep a course with a ship of shipgym, and is compared with LQ
afterwards."""

import argparse
import logging
import time
from typing import Any

import gymnasium as gym
import numpy as np
import ray
import torch
from numpy.typing import NDArray
from ray.cluster_utils import Cluster
from ray.rllib.algorithms.algorithm import Algorithm
from ray.rllib.algorithms.ppo import PPOConfig
from ray.tune.registry import register_env

import shipgym
from agents import LQ, sail


class Steersman:
    """The mean of what RLlib's policy does, as shipgym's controllers answer."""

    def __init__(self, module: Any) -> None:
        self.module = module

    def predict(
        self,
        observation: NDArray[np.float32],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], None]:
        """Rudder for each ship, as a share of its limit; deterministic always."""
        with torch.no_grad():
            answer = self.module.forward_inference(
                {"obs": torch.as_tensor(observation)}
            )
        # the logarithm of the deviation follows
        mean = answer["action_dist_inputs"][:, :1]
        return np.clip(mean.numpy(), -1.0, 1.0), None


def read_options() -> argparse.Namespace:
    """Options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--model", default="mariner", help="name of a shipped model, or a model file"
    )
    parser.add_argument("--iterations", type=int, default=12)
    parser.add_argument(
        "--runners", type=int, default=0, help="processes that sail; 0: this one"
    )
    parser.add_argument(
        "--address",
        help="of a Ray cluster on which shipgym is installed; auto: this one's",
    )
    parser.add_argument(
        "--nodes", type=int, default=0, help="start a cluster of so many nodes here"
    )
    return parser.parse_args()


def started_cluster(nodes: int) -> Cluster:
    """A cluster of nodes with a processor each, on this computer."""
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    for _ in range(nodes - 1):
        cluster.add_node(num_cpus=1)
    return cluster


def made_algorithm(model: str, runners: int) -> Algorithm:
    """PPO that keeps the course of a ship."""
    register_env(
        "course-keeping",
        lambda config: gym.make("shipgym:shipgym/CourseKeeping-v0", **config),
    )
    config = (
        PPOConfig()
        .environment("course-keeping", env_config={"model": model})
        .env_runners(
            num_env_runners=runners,
            num_envs_per_env_runner=16,
            rollout_fragment_length="auto",
        )
        .training(
            lr=1e-3,
            gamma=0.99,
            train_batch_size_per_learner=4096,
            minibatch_size=512,
            num_epochs=5,
            vf_clip_param=1e6,
        )
        .rl_module(model_config={"fcnet_hiddens": [64, 64], "fcnet_activation": "relu"})
        .debugging(seed=1, log_level="ERROR")
    )
    return config.build_algo()


def train(algorithm: Algorithm, iterations: int) -> None:
    """Train for some iterations, and print how it goes."""
    begin = time.perf_counter()
    for iteration in range(1, iterations + 1):
        found = algorithm.train()["env_runners"]
        steps = found["num_env_steps_sampled_lifetime"]
        mean_return = found.get("episode_return_mean")
        shown = "of no episode"
        if mean_return is not None and not np.isnan(mean_return):
            shown = f"{mean_return:.2f}"
        print(
            f"iteration {iteration}: {steps:.0f} steps, mean return {shown}",
            flush=True,
        )
    seconds = time.perf_counter() - begin
    print(f"{steps / seconds:.0f} steps per second, {seconds:.0f} s")


def compare(algorithm: Algorithm, model: str) -> None:
    """Run the same 100 episodes with the agent and with LQ, and print their costs."""
    ship = shipgym.load_model(model)
    seeds = 1_000_000 + np.arange(100)
    controllers = {
        "RLlib PPO": Steersman(algorithm.get_module()),
        "LQ": LQ.from_model(ship),
    }
    for name, controller in controllers.items():
        episodes = sail(controller, ship, seeds=seeds)
        cost = episodes.cost.mean()
        rmse = episodes.heading_rmse_deg.mean()
        print(f"{name}: mean cost {cost:.3f}, heading rmse {rmse:.2f} deg")


def main() -> None:
    """Train for some iterations, then run the same 100 episodes as LQ."""
    options = read_options()
    logging.getLogger("ray").setLevel(logging.ERROR)
    cluster = started_cluster(options.nodes) if options.nodes else None
    address = cluster.address if cluster else options.address
    ray.init(address=address or "local", log_to_driver=False)

    algorithm = made_algorithm(options.model, options.runners)
    nodes = algorithm.env_runner_group.foreach_env_runner(
        lambda _: ray.get_runtime_context().get_node_id(),
        local_env_runner=not options.runners,
    )
    print(f"{len(nodes)} processes sail on {len(set(nodes))} nodes", flush=True)
    train(algorithm, options.iterations)
    compare(algorithm, options.model)

    algorithm.stop()
    ray.shutdown()
    if cluster:
        cluster.shutdown()


if __name__ == "__main__":
    main()
