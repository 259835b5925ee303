"""What tuning varies, algorithm by algorithm (`hyperparameters/search.toml`), but what is given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution

from agents.training.settings import OffPolicySettings, Settings, changed, hyperparameters, settings_of

#: Settings that stand behind parameters of other names.
STANDS_FOR = {"one_minus_gamma": "gamma", "minibatches": "batch_size"}


def search_space(algorithm: str, fixed: Sequence[str] = ()) -> dict[str, BaseDistribution]:
    """The parameters that are varied, without those whose setting is fixed."""
    tables = hyperparameters("search")
    shared = tables["off-policy"] if issubclass(settings_of(algorithm), OffPolicySettings) else {}
    space = {**tables["all"], **shared, **tables[algorithm]}
    return {
        name: _distribution(one) for name, one in space.items() if STANDS_FOR.get(name, name) not in fixed
    }


def _distribution(given: Any) -> BaseDistribution:
    if isinstance(given, list):
        return CategoricalDistribution(given)
    whole = all(isinstance(given[bound], int) for bound in ("low", "high"))
    return IntDistribution(**given) if whole else FloatDistribution(**given)


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
