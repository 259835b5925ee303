"""Made-up regressions and short trials that the golden sections of identification look at,
and their numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

import shipgym
from identification.reading import full_name, identify_arguments
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import zigzag
from tests.golden.store import Floats, numbers_in

SMALL, KEPT = 1e9, 2.0**-16  # of `packed`
NOISE = {
    "x": 1.0,
    "y": 1.0,
    "psi": 1e-3,
    "u": 0.03,
    "v": 0.03,
    "r": 2e-4,
    "delta": 1e-3,
}
CHANNELS = ("x", "y", "psi", "u", "v", "r", "delta")


def numbers_of(
    content: Any, path: str = "", left_out: tuple[str, ...] = ()
) -> dict[str, Floats]:
    """All numbers of results, however nested: those of arrays, of dataclasses and of trials too.

    What is None has none.
    """
    return numbers_in(_plain(content), path, left_out)


def packed(content: Any, left_out: tuple[str, ...] = ()) -> Floats:
    """All numbers of results in a row, of which the smallest weigh nearly as much as the largest.

    Kept are 1e-5 of a number, and 1e-14 of one that is nearly 0.
    """
    rows = numbers_of(content, left_out=left_out).values()
    numbers = np.concatenate([np.zeros(0), *rows])
    return np.round(np.arcsinh(SMALL * numbers) / KEPT) * KEPT


def words_of(content: Any, path: str = "", left_out: tuple[str, ...] = ()) -> list[str]:
    """All texts of results, a line or more each, behind where they stand."""
    content = _plain(content)
    if isinstance(content, str):
        return [f"{path}: {content}"]
    if isinstance(content, Mapping):
        own = {
            key: value
            for key, value in content.items()
            if not any(part in key for part in left_out)
        }
    else:
        own = dict(enumerate(content)) if isinstance(content, list) else {}
    return [
        line
        for key, value in own.items()
        for line in words_of(value, f"{path}.{key}", left_out)
    ]


def _plain(content: Any) -> Any:
    if isinstance(content, Trial):
        return {
            "t": content.t.tolist(),
            **{name: row.tolist() for name, row in content.channels.items()},
        }
    if is_dataclass(content) and not isinstance(content, type):
        return {
            item.name: _plain(getattr(content, item.name)) for item in fields(content)
        }
    if isinstance(content, Mapping):
        return {
            str(key): _plain(value)
            for key, value in content.items()
            if value is not None
        }
    if isinstance(content, np.ndarray | np.generic):
        return np.asarray(content, dtype=float).reshape(-1).tolist()
    if isinstance(content, list | tuple | set | frozenset):
        return [_plain(value) for value in content]
    return content


@dataclass(frozen=True, eq=False)
class Parts:
    """A golden section in parts, each a function that returns numbers and words, which is called once.

    Attributes
    ----------
    functions : mapping
        By the name of a case.
    left_out : tuple of str
        Parts of the names of what differs from computer to computer.
    """

    functions: Mapping[str, Callable[[], dict[str, Any]]]
    left_out: tuple[str, ...] = ()

    def cases(self) -> list[str]:
        """Names of the cases."""
        return list(self.functions)

    @cache  # noqa: B019 - there are a few, which live as long as the program
    def content(self, case: str) -> dict[str, Any]:
        """What a case comes to, numbers and texts."""
        return self.functions[case]()

    def record(self, case: str) -> dict[str, Floats]:
        """The numbers of a case."""
        return numbers_of(self.content(case), left_out=self.left_out)

    def texts(self, case: str) -> str:
        """The texts of a case."""
        return "\n".join(words_of(self.content(case), left_out=self.left_out))


def refused(call: Callable[[], Any]) -> str:
    """The words of a refusal."""
    try:
        call()
    except InputError as error:
        return str(error)
    return ""


def sampled(values: Floats, count: int = 12) -> Floats:
    """Some of many values, and the mean square of all."""
    rows = np.linspace(0, len(values) - 1, min(count, len(values))).astype(int)
    return np.append(values[rows], np.mean(values**2))


@cache
def regression() -> tuple[Floats, Floats]:
    """Six features of different size, two of them nearly collinear, and targets with noise and outliers."""
    random = np.random.default_rng(3)
    X = random.uniform(-1.0, 1.3, (45, 6)) * [1.0, 0.2, 7.0, 0.03, 1.0, 2.0]
    X[:, 4] = 0.7 * X[:, 0] - 2.0 * X[:, 1] + 1e-4 * X[:, 4]
    y = X @ [0.5, -3.0, 0.2, 4.0, 0.3, -0.7] + 0.4 + random.uniform(-0.05, 0.07, len(X))
    y[[7, 30]] += [1.5, -2.0]
    return X, y


@cache
def mariner() -> ShipModel:
    """The ship of the trials."""
    return shipgym.load_model("mariner")


def noisy(
    run: Trial, seed: int, every: int = 1, noise: float = 1.0, **changes: Any
) -> Trial:
    """What sensors would have recorded of a simulated trial; their errors are evenly distributed."""
    random, t = np.random.default_rng(seed), run.t[::every]
    channels = {
        name: (
            run[name][::every] + noise * NOISE[name] * random.uniform(-1.7, 1.7, len(t))
        )
        for name in CHANNELS
    }
    if "n_command" in run:
        channels["n"] = run["n_command"][::every]
    return Trial(t, channels, kind=run.kind, **{"name": run.name, **changes})


@cache
def trials() -> tuple[Trial, ...]:
    """Two short zigzags to fit and one held out, with noise."""
    plan = (
        (20.0, 15.0, False, "fit"),
        (10.0, 10.0, True, "fit"),
        (15.0, 20.0, False, "validate"),
    )
    return tuple(
        noisy(
            zigzag(mariner(), rudder, heading, duration=240.0, dt=1.0, port_first=port),
            k,
            name=f"runs/{k}",
            use=use,
        )
        for k, (rudder, heading, port, use) in enumerate(plan)
    )


def asked(options: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `identify` from options by the names that a ship file has, and from objects."""
    words, objects = dict[str, Any](), dict[str, Any]()
    for name, value in options.items():
        is_object = name == "method" and not isinstance(value, str)
        if is_object or name in ("particulars", "steering"):
            objects[name] = value
        else:
            words[full_name(name, "golden", "kernel" in options)] = value
    return identify_arguments(words) | objects
