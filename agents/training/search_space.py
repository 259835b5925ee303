"""Settings that tuning varies, by algorithm, and their distributions."""

from collections.abc import Mapping, Sequence
from typing import Any

from agents.training.settings import (
    GradientSettings,
    LearningSettings,
    OffPolicySettings,
    PPOSettings,
    changed,
    settings_of,
)
from shipgym.extras import library


def search_space(algorithm: str, fixed: Sequence[str] = ()) -> dict[str, Any]:
    """Return Optuna's distributions by parameter, without those whose setting is fixed.

    They are drawn in this order.
    """
    optuna = library("optuna.distributions", "tune", "tuning needs it")
    real = optuna.FloatDistribution
    integer = optuna.IntDistribution
    choice = optuna.CategoricalDistribution

    space: dict[str, Any] = {}
    if issubclass(settings_of(algorithm), GradientSettings):
        space |= {
            "learning_rate": real(1e-4, 3e-3, log=True),
            "one_minus_gamma": real(1e-3, 0.1, log=True),
            "net_arch": choice(["32 32", "64 64", "128 128"]),
        }
    space |= {
        "activation": choice(["relu", "tanh"]),
        "action_repeat": choice([1, 4, 16]),
    }
    if issubclass(settings_of(algorithm), OffPolicySettings):
        space |= {
            "batch_size": choice([128, 256, 512]),
            "gradient_steps": choice([2, 4, 8, 16]),
            "tau": real(1e-3, 5e-2, log=True),
            "critic_arch": choice(["64 64", "128 128", "256 256"]),
        }
    if algorithm == "ppo":
        space |= {
            "n_steps": choice([16, 32, 64, 128, 256]),
            "minibatches": choice([2, 4, 8, 16]),
            "n_epochs": integer(2, 12),
            "gae_lambda": real(0.85, 1.0),
            "clip_range": real(0.1, 0.4),
            "ent_coef": real(1e-6, 1e-2, log=True),
            "log_std_init": real(-3.0, 0.5),
        }
    if algorithm in ("sac", "tqc"):
        space |= {
            "ent_coef": choice(["auto", "auto_0.1", "auto_0.01"]),
            "target_entropy": real(-3.0, 0.5),
        }
    if algorithm == "tqc":
        space["top_quantiles_to_drop"] = integer(0, 5)
    if algorithm == "td3":
        space |= {
            "action_noise": real(0.03, 0.5, log=True),
            "policy_delay": integer(1, 8),
        }
    varied = {}
    # Parameters that stand for a setting of another name.
    stands_for = {"one_minus_gamma": "gamma", "minibatches": "batch_size"}
    for name, distribution in space.items():
        setting = stands_for.get(name, name)
        if setting not in fixed:
            varied[name] = distribution
    return varied


def with_parameters(
    settings: LearningSettings, parameters: Mapping[str, Any]
) -> LearningSettings:
    """Return the settings that parameters stand for.

    Raises InputError if they conflict with those that are not varied.
    """
    varied = dict(parameters)
    one_minus_gamma = varied.pop("one_minus_gamma", None)
    if one_minus_gamma is not None:
        varied["gamma"] = 1.0 - one_minus_gamma
    for name in ("net_arch", "critic_arch"):
        if name in varied:
            widths = varied[name].split()
            varied[name] = [int(width) for width in widths]

    minibatches = varied.pop("minibatches", None)
    if minibatches is not None and isinstance(settings, PPOSettings):
        before = settings.to_dict()
        n_steps = varied.get("n_steps", before["n_steps"])
        varied["batch_size"] = settings.ships * n_steps // minibatches
    return changed(settings, varied)
