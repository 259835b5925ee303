"""The controller file as it is read: JSON, versioned, validated field by field.

Format 1:

    format               1
    kind                 "pid", "lq", ... (`agents.controllers.registry`)
    observation_names    what it observes, in order
    observation_scales   physical value of each observation of 1, SI units
    gains                {name: value}, SI units; command = neutral rudder + sum of gain times signal
    neutral_rudder       rad, positive to starboard
    neutral_sway         m/s
    model                {"name", "sha256"}: what it was designed on
    margins              {name: value or null for no limit}
    design               {name: value}: how it was designed
    autopilot            a controller of this format; only of guidance
    ship                 the design model (`shipgym.ships.model_file`); only of guidance that simulates it
    arrays               {name: nested lists}; only kinds that have any, such as an observer's matrices
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from agents.controllers.controller import FORMAT, NUMBERS, SCALES, Controller, Range, check_names
from agents.controllers.linear_loop import Margins
from agents.controllers.registry import controller_class, controller_kinds
from shipgym.checks import (
    check_array,
    check_choice,
    check_format,
    check_keys,
    check_number,
    check_table,
    check_text,
    placed,
    quoted,
    shown,
)
from shipgym.errors import InputError
from shipgym.ships import ShipModel

REMEDY = "design the controller again or take another copy"
RUDDER, ANY = Range(-np.pi, np.pi), Range(-np.inf, np.inf)  # rad; any finite number
FIELDS = (
    "format", "kind", "observation_names", "observation_scales", "gains", "neutral_rudder", "neutral_sway",
    "model", "margins", "design",
)  # fmt: skip
MORE_FIELDS = ("arrays", "autopilot", "ship")  # of kinds that have any
#: Kinds whose files are described in `agents.policies.policy_file`.
POLICIES = ("learned", "shielded", "one-for-all")


def read_controller(content: Mapping[str, Any], where: str) -> Controller:
    """A classical controller from what `Controller.to_dict` returned.

    Raises InputError naming the field at fault.
    """
    check_format(content, FORMAT, where)
    if "kind" in content:
        kinds = controller_kinds()
        kind = check_choice(content["kind"], (*kinds, *POLICIES), f"{where}: kind")
        if kind in POLICIES:
            raise InputError(f"{where}: kind: '{kind}' found, expected a classical one: {quoted(kinds)}")
    check_keys(content, (*FIELDS, *MORE_FIELDS), where)
    _check_all_there(content, FIELDS, where)
    design = controller_class(content["kind"])
    has = {"arrays": bool(design.arrays), "autopilot": design.has_autopilot, "ship": design.has_ship}
    expected = (*FIELDS, *(name for name in MORE_FIELDS if has[name]))
    check_keys(content, expected, where)
    _check_all_there(content, expected, where)
    model = check_table(content["model"], f"{where}: model")
    check_keys(model, ("name", "sha256"), f"{where}: model")
    given = content["observation_names"]
    names = next((some for some in design.alternatives if list(some) == given), design.observes)
    _check_observations(given, names, where)
    more = _arrays(content.get("arrays", {}), design.arrays, f"{where}: arrays")
    if design.has_autopilot:
        at = f"{where}: autopilot"
        more["autopilot"] = read_controller(check_table(content["autopilot"], at), at)
        if more["autopilot"].has_autopilot:
            raise InputError(f"{at}: '{more['autopilot'].kind}' found, expected one that keeps a heading")
    if design.has_ship:
        more["ship"] = ShipModel.from_dict(check_table(content["ship"], f"{where}: ship"), f"{where}: ship")
    gains = dict.fromkeys(design.gain_names or tuple(design.feedback), NUMBERS)
    needed = {name: one for name, one in design.ranges.items() if name not in gains}
    of_gains = {name: design.ranges.get(name, one) for name, one in gains.items()}
    with placed(where):
        return design(
            gains=_numbers(content["gains"], of_gains, f"{where}: gains"),
            neutral_rudder=_number(content["neutral_rudder"], RUDDER, f"{where}: neutral_rudder"),
            neutral_sway=_number(content["neutral_sway"], NUMBERS, f"{where}: neutral_sway"),
            margins=_margins(content["margins"], f"{where}: margins"),
            observation_scales=read_scales(content["observation_scales"], names, where),
            model_name=check_text(model.get("name"), f"{where}: model.name"),
            model_sha256=check_text(model.get("sha256"), f"{where}: model.sha256"),
            design=_design(content["design"], needed, f"{where}: design"),
            observation_names=names,
            **more,
        )


def _check_all_there(content: Mapping[str, Any], expected: tuple[str, ...], where: str) -> None:
    for name in expected:
        if name not in content:
            raise InputError(f"{where}: field '{name}' is missing; a controller file has {quoted(expected)}")


def _arrays(value: Any, axes: Mapping[str, tuple[str | int, ...]], where: str) -> dict[str, Any]:
    """Arrays of numbers, whose axes of one name have one length."""
    table = check_table(value, where)
    check_keys(table, tuple(axes), where)
    lengths: dict[str | int, int] = {}
    arrays = {}
    for name, named in axes.items():
        if name not in table:
            raise InputError(f"{where}: '{name}' is missing, expected {quoted(axes)}")
        shape = tuple(lengths.get(axis) if isinstance(axis, str) else axis for axis in named)
        array = check_array(table[name], shape, f"{where}.{name}")
        fits = array.ndim == len(named) and array.size > 0 and np.abs(array).max() <= NUMBERS.largest
        if not (fits and all(lengths.setdefault(a, n) == n for a, n in zip(named, array.shape, strict=True))):
            raise InputError(
                f"{where}.{name}: expected numbers of magnitude {NUMBERS.largest:g} at most, of shape "
                f"({', '.join(map(str, named))}); {REMEDY}"
            )
        arrays[name] = array
    return arrays


def _check_observations(names: Any, expected: tuple[str, ...], where: str) -> None:
    """The observations must be those of the environment, in its order."""
    if not isinstance(names, list):
        raise InputError(f"{where}: observation_names: {shown(names)} found, expected a list of names")
    check_names([str(name) for name in names], expected, f"{where}: observation_names")


def read_scales(value: Any, names: tuple[str, ...], where: str) -> tuple[float, ...]:
    """Observation scales, positive numbers, one for each name."""
    n = len(names)
    if not isinstance(value, list) or len(value) != n:
        found = len(value) if isinstance(value, list) else shown(value)
        raise InputError(f"{where}: observation_scales: {found} found, expected {n} numbers")
    return tuple(
        _number(scale, SCALES, f"{where}: observation_scales[{i}] ('{names[i]}')")
        for i, scale in enumerate(value)
    )


def _number(value: Any, allowed: Range, where: str) -> float:
    """A number within its range."""
    return check_number(value, where, at_least=allowed.least, at_most=allowed.largest)


def _numbers(value: Any, ranges: Mapping[str, Range], where: str) -> dict[str, float]:
    """A number for each name and none besides."""
    table = check_table(value, where)
    check_keys(table, tuple(ranges), where)
    return _design(table, ranges, where)


def _margins(value: Any, where: str) -> Margins:
    """Margins; null is no limit."""
    names = tuple(margin.name for margin in fields(Margins))
    table = check_table(value, where)
    finite = {name: 0.0 if number is None else number for name, number in table.items()}
    known = _numbers(finite, dict.fromkeys(names, ANY), where)
    return Margins(**{name: np.inf if table[name] is None else known[name] for name in names})


def _design(value: Any, needed: Mapping[str, Range], where: str) -> dict[str, float]:
    """Numbers by name, all that are needed among them."""
    later = {name: one.default for name, one in needed.items() if one.default is not None}
    table = later | dict(check_table(value, where))
    for name in needed:
        if name not in table:
            raise InputError(f"{where}: '{name}' is missing, expected {quoted(needed)}; {REMEDY}")
    return {name: _number(number, needed.get(name, ANY), f"{where}.{name}") for name, number in table.items()}
