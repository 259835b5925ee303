"""Read a controller file: JSON, versioned, checked field by field.

docs/deployment.md lists the fields.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from agents.controllers.controller import (
    ANY_NUMBER,
    FORMAT,
    PLAIN,
    Bounds,
    Controller,
)
from agents.controllers.helm import HELM, check_wave
from agents.controllers.interface import check_names
from agents.controllers.margins import Margins
from agents.controllers.registry import controller_class, controller_kinds
from shipgym import InputError, ShipModel
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
    unexpected,
)

REMEDY = "design the controller again or take another copy"
#: The kind of file that `agents.policies.policy_file` reads.
LEARNED = "learned"
FINITE = Bounds(-np.inf, np.inf)
FIELDS = ("format", *PLAIN, "model", "margins")


def read_controller(content: Mapping[str, Any], where: str) -> Controller:
    """Make a controller from what `Controller.to_dict` returned.

    Raises InputError, which names the field at fault.
    """
    design = _class_of(content, where)
    further = {
        "arrays": bool(design.arrays),
        "autopilot": design.has_autopilot,
        "ship": design.has_ship,
    }
    expected = (*FIELDS, *[name for name, present in further.items() if present])
    check_keys(content, expected, where, expected)
    with placed(where):
        names = read_names(content["observation_names"])
    more = tuple(name for name in design.may_observe if name in names)
    check_names(names, design.observes + more, f"{where}: observation_names")

    gain_names = design.gain_names or (*design.feedback, *HELM)
    usual = {name: Bounds(*HELM.get(name, ANY_NUMBER)) for name in gain_names}
    gains = {name: design.bounds.get(name, one) for name, one in usual.items()}
    needed = {name: one for name, one in design.bounds.items() if name not in gains}
    rudder = Bounds(-np.pi, np.pi)  # rad
    with placed(where):
        check_table(content["gains"], "gains", gains)
        numbers = _numbers(content["gains"], gains, "gains")
        own = _numbers(content["design"], needed, "design")
        check_wave(numbers.get("wave_period", 0.0), own["dt"])
        return design(
            gains=numbers,
            neutral_rudder=_number(content["neutral_rudder"], rudder, "neutral_rudder"),
            neutral_sway=_number(content["neutral_sway"], ANY_NUMBER, "neutral_sway"),
            margins=_margins(content["margins"]),
            observation_scales=read_scales(content["observation_scales"], names),
            design=own,
            observation_names=names,
            **read_model(content["model"]),
            **_arrays(content.get("arrays", {}), design.arrays),
            **_parts(content, design),
        )


def _class_of(content: Mapping[str, Any], where: str) -> type[Controller]:
    """Class of the kind of controller that a file names."""
    check_keys(content, content, where, ("format", "kind"))
    check_format(content, FORMAT, where)
    known = controller_kinds()
    kind = check_choice(content["kind"], (*known, LEARNED), f"{where}: kind")
    if kind == LEARNED:
        raise InputError(
            f"{where}: kind: expected a classical controller, {quoted(known)},"
            f" got '{kind}'"
        )
    return controller_class(kind)


def _parts(content: Mapping[str, Any], design: type[Controller]) -> dict[str, Any]:
    """Autopilot that guidance leads, and its design model, where it has them."""
    parts: dict[str, Any] = {}
    if design.has_autopilot:
        table = check_table(content["autopilot"], "autopilot")
        parts["autopilot"] = read_controller(table, "autopilot")
    if design.has_ship:
        table = check_table(content["ship"], "ship")
        parts["ship"] = ShipModel.from_dict(table, "ship")
    return parts


def _arrays(value: Any, n_axes: Mapping[str, int]) -> dict[str, Any]:
    """Arrays of numbers by name; their class checks how long they are."""
    table = check_table(value, "arrays", n_axes, n_axes)
    arrays = {}
    for name, n in n_axes.items():
        where = f"arrays.{name}"
        axes = (None,) * n
        array = check_array(table[name], axes, where)
        largest = np.abs(array).max(initial=0.0)
        place = f"{where}: largest"
        check_number(float(largest), place, at_most=ANY_NUMBER.largest)
        arrays[name] = array
    return arrays


def read_model(value: Any) -> dict[str, str]:
    """Name and hash of the model that an agent was made for, as its fields."""
    names = ("name", "sha256")
    table = check_table(value, "model", names)
    return {
        f"model_{name}": check_text(table.get(name), f"model.{name}") for name in names
    }


def read_names(value: Any) -> tuple[str, ...]:
    """Names of observations."""
    if not isinstance(value, list):
        raise unexpected("observation_names", "a list of names", value)
    return tuple(map(str, value))


def read_scales(value: Any, names: tuple[str, ...]) -> tuple[float, ...]:
    """Observation scales, positive numbers, one for each name."""
    where = "observation_scales"
    check_array(value, (len(names),), where)
    bounds = Bounds(1e-9, 1e9)
    scales = [
        _number(one, bounds, f"{where}: '{name}'")
        for name, one in zip(
            names,
            value,
            strict=True,
        )
    ]
    return tuple(scales)


def _number(value: Any, bounds: Bounds, where: str) -> float:
    return check_number(value, where, at_least=bounds.least, at_most=bounds.largest)


def _numbers(value: Any, needed: Mapping[str, Bounds], where: str) -> dict[str, float]:
    """Numbers by name; InputError names one that is needed and missing."""
    table = check_table(value, where)
    for name in needed:
        if name not in table:
            raise InputError(
                f"{where}: expected {quoted(needed)}, got no '{name}'; {REMEDY}"
            )
    return {
        name: _number(number, needed.get(name, FINITE), f"{where}.{name}")
        for name, number in table.items()
    }


def _margins(value: Any) -> Margins:
    """Margins; null is no limit."""
    names = [margin.name for margin in fields(Margins)]
    table = check_table(value, "margins", names, names)
    limits = {
        name: np.inf if limit is None else _number(limit, FINITE, f"margins.{name}")
        for name, limit in table.items()
    }
    return Margins(**limits)
