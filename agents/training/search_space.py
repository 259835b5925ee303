"""What tuning varies, algorithm by algorithm; a setting that is given is left as it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from optuna.distributions import BaseDistribution
from optuna.distributions import CategoricalDistribution as Choice
from optuna.distributions import FloatDistribution as Reals
from optuna.distributions import IntDistribution as Wholes

from agents.training.settings import Settings, changed

ALL: Mapping[str, BaseDistribution] = {
    "learning_rate": Reals(1e-4, 3e-3, log=True),
    "one_minus_gamma": Reals(1e-3, 0.1, log=True),
    "net_arch": Choice(("32 32", "64 64", "128 128")),
    "activation": Choice(("relu", "tanh")),
    "action_repeat": Choice((1, 4, 16)),
}
OFF_POLICY: Mapping[str, BaseDistribution] = {
    "batch_size": Choice((128, 256, 512)),
    "gradient_steps": Choice((2, 4, 8, 16)),
    "tau": Reals(1e-3, 5e-2, log=True),
    "critic_arch": Choice(("64 64", "128 128", "256 256")),
}
ENTROPY: Mapping[str, BaseDistribution] = {
    "ent_coef": Choice(("auto", "auto_0.1", "auto_0.01")),
    "target_entropy": Reals(-3.0, 0.5),
}
#: By algorithm, then by parameter.
SPACES: Mapping[str, Mapping[str, BaseDistribution]] = {
    "ppo": {
        **ALL,
        "n_steps": Choice((16, 32, 64, 128, 256)),
        "minibatches": Choice((2, 4, 8, 16)),
        "n_epochs": Wholes(2, 12),
        "gae_lambda": Reals(0.85, 1.0),
        "clip_range": Reals(0.1, 0.4),
        "ent_coef": Reals(1e-6, 1e-2, log=True),
        "log_std_init": Reals(-3.0, 0.5),
    },
    "sac": {**ALL, **OFF_POLICY, **ENTROPY},
    "td3": {**ALL, **OFF_POLICY, "action_noise": Reals(0.03, 0.5, log=True), "policy_delay": Wholes(1, 8)},
    "tqc": {**ALL, **OFF_POLICY, **ENTROPY, "top_quantiles_to_drop": Wholes(0, 5)},
}
#: Settings that stand behind parameters of other names.
STANDS_FOR = {"one_minus_gamma": "gamma", "minibatches": "batch_size"}


def search_space(algorithm: str, fixed: Sequence[str] = ()) -> dict[str, BaseDistribution]:
    """The parameters that are varied, without those whose setting is fixed."""
    space = SPACES[algorithm]
    return {name: space[name] for name in space if STANDS_FOR.get(name, name) not in fixed}


def with_parameters(settings: Settings, parameters: Mapping[str, Any]) -> Settings:
    """The settings that parameters stand for.

    Raises InputError if they conflict with the settings that are not varied.
    """
    given = {name: value for name, value in parameters.items() if name not in STANDS_FOR}
    if "one_minus_gamma" in parameters:
        given["gamma"] = 1.0 - parameters["one_minus_gamma"]
    for name in given.keys() & {"net_arch", "critic_arch"}:
        given[name] = [int(width) for width in parameters[name].split()]
    if "minibatches" in parameters:
        n_steps = given.get("n_steps", settings.to_dict()["n_steps"])
        given["batch_size"] = settings.ships * n_steps // parameters["minibatches"]
    return changed(settings, given)
