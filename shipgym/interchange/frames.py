"""Trials and episodes as pandas frames and xarray datasets, and back to the very same numbers.

Series are columns: channels by their names, those of an episode by group and name, such
as `states.x`, `commands.delta`, `reward_parts.reward_heading`,
`info.cross_track_error`, `rewards` and `actions.0`. All else is in one attribute, as
JSON, which Parquet and netCDF files keep too.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_table
from shipgym.envs.episode import Episode
from shipgym.envs.episode_file import SERIES, from_file, to_file
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.trials.trial import Trial
from shipgym.trials.units import QUANTITIES, UNITS

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

KEY = "shipgym"  # the attribute of what is no series
OF_STEPS = (
    "commands",
    "reward_parts",
    "rewards",
    "actions",
)  # a value less than there are states
SETTINGS = ("name", "kind", "use", "length", "over_ground", "notes")


def to_frame(recorded: Trial | Episode) -> DataFrame:
    """A trial or an episode as a pandas frame over time, s.

    In the last row of an episode commands, actions and rewards are nan: there is no
    step after its end.
    """
    import pandas as pd

    t, series, facts = taken_apart(recorded)
    frame = pd.DataFrame(padded(series, len(t)), index=pd.Index(t, name="t"))
    frame.attrs[KEY] = facts
    return frame


def from_frame(frame: DataFrame) -> Trial | Episode:
    """The trial or episode that `to_frame` converted; a trial's `raw` is lost.

    Raises InputError for another frame: one of a log is read by `Trial.from_frame`.
    """
    series = {str(name): column.to_numpy() for name, column in frame.items()}
    return put_together(
        frame.index.to_numpy(),
        series,
        frame.attrs,
        "Trial.from_frame reads that of a log",
    )


def to_xarray(recorded: Trial | Episode) -> Dataset:
    """A trial or an episode as an xarray dataset, its dimension `t` (s) and, of an episode's steps, `step`.

    Channels of a trial have their units.
    """
    t, series, facts = taken_apart(recorded)
    variables = {}
    for name, values in series.items():
        units = (
            {"units": next(iter(UNITS[QUANTITIES[name]]))} if name in QUANTITIES else {}
        )
        variables[name] = ("t" if len(values) == len(t) else "step", values, units)
    return library("xarray", "xarray").Dataset(
        variables, {"t": ("t", t, {"units": "s"})}, {KEY: facts}
    )


def from_xarray(dataset: Dataset) -> Trial | Episode:
    """The trial or episode of `to_xarray`; a trial's `raw` is lost. Raises InputError for another dataset."""
    series = {
        str(name): values.to_numpy() for name, values in dataset.data_vars.items()
    }
    return put_together(
        dataset["t"].to_numpy(), series, dataset.attrs, "expected one of to_xarray"
    )


def taken_apart(recorded: Trial | Episode) -> tuple[Floats, dict[str, Floats], str]:
    """Times, s, series by their names, and all else as JSON."""
    if isinstance(recorded, Trial):
        settings = {name: getattr(recorded, name) for name in SETTINGS}
        settings |= {
            "derived": sorted(recorded.derived),
            "repaired": dict(recorded.repaired),
        }
        return recorded.t, dict(recorded.channels), json.dumps({"trial": settings})
    series = {
        f"{group}.{name}": values
        for group in SERIES
        for name, values in getattr(recorded, group).items()
    }
    series["rewards"] = recorded.rewards
    series |= {
        f"actions.{k}": recorded.actions[:, k] for k in range(recorded.actions.shape[1])
    }
    content = to_file(vars(recorded))
    facts = {
        name: value
        for name, value in content.items()
        if name not in (*SERIES, *OF_STEPS)
    }
    return recorded.t, series, json.dumps({"episode": facts})


def padded(series: Mapping[str, Floats], length: int) -> dict[str, Floats]:
    """The series in one length, nan where one has ended."""
    return {
        name: np.append(values, np.full(length - len(values), np.nan))
        for name, values in series.items()
    }


def put_together(
    t: Floats, series: Mapping[str, Floats], attributes: Mapping[Any, Any], remedy: str
) -> Trial | Episode:
    """The trial or episode of `taken_apart`; series of steps may be padded."""
    try:
        facts = check_table(json.loads(attributes[KEY]), KEY)
    except (KeyError, TypeError, ValueError):
        raise InputError(
            f"attribute '{KEY}': none of shipgym's found; {remedy}"
        ) from None
    if "trial" in facts:
        return Trial(t, series, **check_table(facts["trial"], "trial"))
    content = dict(check_table(facts.get("episode"), "episode"))
    content |= {group: {} for group in SERIES} | {"rewards": []}
    actions = []
    for name, values in series.items():
        group, _, own = name.partition(".")
        listed = values[: len(t) - (group in OF_STEPS)].tolist()
        if group == "actions":
            actions.append(listed)
        elif own:
            content.setdefault(group, {})[own] = listed
        else:
            content[group] = listed
    return Episode(**from_file(content | {"actions": np.transpose(actions).tolist()}))
