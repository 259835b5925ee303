"""Options by name, as in a ship file or command line, become objects of `identify`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from identification import (
    LSSVM,
    KernelResidual,
    Preprocessing,
    PriorKnowledge,
    Refinement,
    Sampling,
    TruncatedLSSVM,
    Uncertainty,
)
from identification.pipeline.options import (
    identify_arguments,
    read_table,
)
from shipgym import InputError

WHERE = "ship.toml: [identify]"


def read(table: dict[str, Any]) -> dict[str, Any]:
    return identify_arguments(read_table(table, WHERE))


@pytest.mark.parametrize(
    ("table", "name", "expected"),
    [
        ({"samples": "euler"}, "samples", Sampling("euler")),
        ({"window": 3}, "samples", Sampling(window=3)),
        (
            {"samples": {"rule": "integral", "window": 3}},
            "samples",
            Sampling("integral", 3),
        ),
        ({"samples.window": 3}, "samples", Sampling(window=3)),
        ({"repair": True}, "preprocessing", Preprocessing(repair=True)),
        ({"preprocessing": "none"}, "preprocessing", Preprocessing("none")),
        ({"uncertainty": "posterior"}, "uncertainty", Uncertainty("posterior")),
        ({"model_error": False}, "uncertainty", Uncertainty(model_error=False)),
        (
            {"kernel": "rbf", "centres": 9, "kernel.C": 3.0, "length": 2.0},
            "kernel",
            KernelResidual(centres=9, C=3.0, length=2.0),
        ),
        ({"structure": "nomoto"}, "structure", "nomoto"),
        ({"method": "ls"}, "method", "ls"),
        (
            {"current": {"north": 0.1, "east": 0.2}},
            "current",
            {"north": 0.1, "east": 0.2},
        ),
    ],
)
def test_a_stage_is_its_word_its_settings_or_a_table(
    table: dict[str, Any], name: str, expected: Any
) -> None:
    assert read(table)[name] == expected


def test_a_prior_has_a_strength_of_its_own() -> None:
    found = read({"structure": "mmg", "prior": "tanker", "strength": 0.1})["prior"]
    assert isinstance(found, PriorKnowledge)
    assert (found.source, found.strength) == ("tanker", 0.1)


def test_settings_are_those_of_the_method_that_is_named() -> None:
    usual = read({"rank": 12, "C": np.inf})["method"]
    assert isinstance(usual, TruncatedLSSVM)
    assert (usual.rank, usual.C) == (12, np.inf)
    named = read({"method": "ls-svm", "scale": False, "method.C": 3.0})["method"]
    assert isinstance(named, LSSVM)
    assert (named.scale, named.C) == (False, 3.0)
    table = {"name": "output-error", "pull": 0.1}
    refined = read({"method": table})["method"]
    assert isinstance(refined, Refinement)
    assert refined.pull == 0.1


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"rnak": 3}, r"rnak: .*Did you mean 'rank'\?"),
        ({"preprocesing": "none"}, r"Did you mean 'preprocessing'\?"),
        ({"samples.rank": 3}, r"samples\.rank: "),
        ({"rank": 3.5}, r"rank: .*3.5"),
        ({"C": "1e6"}, r"C: .*'1e6'"),
        ({"scale": "yes"}, r"scale: .*'yes'"),
        ({"repair": 1}, "repair: "),
        ({"window": 0}, "window: "),
        ({"method": "abc-lssvr", "bounds": [1.0]}, r"bounds: .*such as"),
        ({"method": "abc-lssvr", "folds": 2.5}, r"folds: .*2.5"),
        (
            {"method": {"name": "abc-lssvr", "optimiser": {"name": "abc", "round": 3}}},
            r"optimiser: .*round",
        ),
        ({"method": "pso-lssvr", "seed": -1}, "seed: "),
        ({"foo": 1}, r"foo: .*There are .*window.*rank"),
        ({"structure": 3}, r"structure: .*3"),
        ({"name": " "}, "name: "),
        ({"method": "lsq"}, r"method: .*'lsq'"),
        ({"current": "tide"}, r"current: .*'tide'"),
        ({"strength": -1.0}, r"prior\.strength: "),
        ({"centres": 101}, "centres: "),
        ({"model_error": "no"}, "model_error: "),
    ],
)
def test_a_wrong_option_is_named_with_its_place(
    table: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read(table)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"epsilon": 0.1}, r"epsilon: .*'tls-svm'"),
        ({"method": "ls", "C": 1.0}, r"C: .*'ls'"),
        ({"method": "map", "C": 1.0}, r"C: .*'map'"),
        ({"centres": 9}, r"centres: .*kernel"),
    ],
)
def test_options_that_do_not_belong_together_are_refused(
    table: dict[str, Any], message: str
) -> None:
    values = read_table(table, WHERE)
    with pytest.raises(InputError, match=message):
        identify_arguments(values)
