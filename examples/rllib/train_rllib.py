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
        mean = answer["action_dist_inputs"][
            :, :1
        ]  # the logarithm of the deviation follows
        return np.clip(mean.numpy(), -1.0, 1.0), None


def main() -> None:
    """Train for some iterations, then run the same 100 episodes as LQ."""
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
    options = parser.parse_args()
    logging.getLogger("ray").setLevel(logging.ERROR)
    if options.nodes:
        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
        for _ in range(options.nodes - 1):
            cluster.add_node(num_cpus=1)
        options.address = cluster.address
    ray.init(address=options.address or "local", log_to_driver=False)
    register_env(
        "course-keeping",
        lambda config: gym.make("shipgym:shipgym/CourseKeeping-v0", **config),
    )
    config = (
        PPOConfig()
        .environment("course-keeping", env_config={"model": options.model})
        .env_runners(
            num_env_runners=options.runners,
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
    algorithm = config.build_algo()
    places = algorithm.env_runner_group.foreach_env_runner(
        lambda _: ray.get_runtime_context().get_node_id(),
        local_env_runner=not options.runners,
    )
    print(f"{len(places)} processes sail on {len(set(places))} nodes", flush=True)
    begin = time.perf_counter()
    for iteration in range(1, options.iterations + 1):
        found = algorithm.train()["env_runners"]
        episode = found.get("episode_return_mean")
        told = (
            "of no episode"
            if episode is None or np.isnan(episode)
            else f"{episode:.2f}"
        )
        print(
            f"iteration {iteration}: {found['num_env_steps_sampled_lifetime']:.0f}"
            f" steps, mean return {told}",
            flush=True,
        )
    seconds = time.perf_counter() - begin
    print(
        f"{found['num_env_steps_sampled_lifetime'] / seconds:.0f} steps per second,"
        f" {seconds:.0f} s"
    )
    ship = shipgym.load_model(options.model)
    seeds = 1_000_000 + np.arange(100)
    for name, controller in (
        ("RLlib PPO", Steersman(algorithm.get_module())),
        ("LQ", LQ.from_model(ship)),
    ):
        episodes = sail(controller, ship, seeds=seeds)
        rmse = episodes.heading_rmse_deg.mean()
        print(
            f"{name}: mean cost {episodes.cost.mean():.3f}, heading rmse {rmse:.2f} deg"
        )
    algorithm.stop()
    ray.shutdown()
    if options.nodes:
        cluster.shutdown()


if __name__ == "__main__":
    main()
