"""The controller file as it is read: JSON, versioned, checked by fields (listed in docs/deployment.md)."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from agents.controllers.controller import (
    FORMAT,
    NUMBERS,
    SCALES,
    Controller,
    Range,
    check_names,
)
from agents.controllers.linear_loop import Margins
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
    shown,
)

REMEDY = "design the controller again or take another copy"
RUDDER, ANY = Range(-np.pi, np.pi), Range(-np.inf, np.inf)  # rad; any finite number
FIELDS = (
    "format",
    "kind",
    "observation_names",
    "observation_scales",
    "gains",
    "neutral_rudder",
    "neutral_sway",
    "model",
    "margins",
    "design",
)
#: The kind of file that `agents.policies.policy_file` reads.
LEARNED = "learned"


def read_controller(content: Mapping[str, Any], where: str) -> Controller:
    """A classical controller from what `Controller.to_dict` returned; InputError names the field at fault."""
    check_format(content, FORMAT, where)
    if "kind" in content:
        kinds = controller_kinds()
        kind = check_choice(content["kind"], (*kinds, LEARNED), f"{where}: kind")
        if kind == LEARNED:
            raise InputError(
                f"{where}: kind: '{kind}' found, expected a classical one:"
                f" {quoted(kinds)}"
            )
    check_keys(content, content, where, FIELDS)
    design = controller_class(content["kind"])
    has = {
        "arrays": bool(design.arrays),
        "autopilot": design.has_autopilot,
        "ship": design.has_ship,
    }
    expected = (*FIELDS, *(name for name in has if has[name]))
    check_keys(content, expected, where, expected)
    names = content["observation_names"]
    if not isinstance(names, list):
        raise InputError(
            f"{where}: observation_names: {shown(names)} found, expected a list of"
            " names"
        )
    observes = design.observes
    check_names([str(name) for name in names], observes, f"{where}: observation_names")
    known = design.gain_names or tuple(design.feedback)
    gains = {name: design.ranges.get(name, NUMBERS) for name in known}
    needed = {name: one for name, one in design.ranges.items() if name not in gains}
    with placed(where):
        return design(
            gains=_numbers(
                check_table(content["gains"], "gains", known), gains, "gains"
            ),
            neutral_rudder=_number(content["neutral_rudder"], RUDDER, "neutral_rudder"),
            neutral_sway=_number(content["neutral_sway"], NUMBERS, "neutral_sway"),
            margins=_margins(content["margins"]),
            observation_scales=read_scales(content["observation_scales"], observes),
            design=_numbers(content["design"], needed, "design"),
            observation_names=observes,
            **read_model(content["model"]),
            **_arrays(content.get("arrays", {}), design.arrays),
            **_parts(content, design),
        )


def _parts(content: Mapping[str, Any], design: type[Controller]) -> dict[str, Any]:
    """The autopilot that guidance leads, and its design model, where it has them."""
    parts: dict[str, Any] = {}
    if design.has_autopilot:
        parts["autopilot"] = read_controller(
            check_table(content["autopilot"], "autopilot"), "autopilot"
        )
        if parts["autopilot"].has_autopilot:
            kind = parts["autopilot"].kind
            raise InputError(
                f"autopilot: '{kind}' found, expected one that keeps a heading"
            )
    if design.has_ship:
        parts["ship"] = ShipModel.from_dict(
            check_table(content["ship"], "ship"), "ship"
        )
    return parts


def _arrays(value: Any, axes: Mapping[str, tuple[str | int, ...]]) -> dict[str, Any]:
    """Arrays of numbers, whose axes of one name have one length."""
    table = check_table(value, "arrays", axes, axes)
    lengths: dict[str | int, int] = {}
    arrays = {}
    for name, named in axes.items():
        shape = tuple(
            lengths.get(axis) if isinstance(axis, str) else axis for axis in named
        )
        array = check_array(table[name], shape, f"arrays.{name}")
        fits = (
            array.ndim == len(named)
            and array.size > 0
            and np.abs(array).max() <= NUMBERS.largest
        )
        if not (
            fits
            and all(
                lengths.setdefault(a, n) == n
                for a, n in zip(named, array.shape, strict=True)
            )
        ):
            raise InputError(
                f"arrays.{name}: expected numbers of magnitude {NUMBERS.largest:g} at"
                f" most, of shape ({', '.join(map(str, named))}); {REMEDY}"
            )
        arrays[name] = array
    return arrays


def read_model(value: Any) -> dict[str, Any]:
    """Name and hash of the model that an agent was made for, as its fields."""
    table = check_table(value, "model", ("name", "sha256"))
    return {
        f"model_{name}": check_text(table.get(name), f"model.{name}")
        for name in ("name", "sha256")
    }


def read_scales(value: Any, names: tuple[str, ...]) -> tuple[float, ...]:
    """Observation scales, positive numbers, one for each name."""
    if not isinstance(value, list) or len(value) != len(names):
        found = len(value) if isinstance(value, list) else shown(value)
        raise InputError(
            f"observation_scales: {found} found, expected {len(names)} numbers"
        )
    pairs = enumerate(zip(names, value, strict=True))
    return tuple(
        _number(scale, SCALES, f"observation_scales[{i}] ('{name}')")
        for i, (name, scale) in pairs
    )


def _number(value: Any, allowed: Range, where: str) -> float:
    """A number within its range."""
    return check_number(value, where, at_least=allowed.least, at_most=allowed.largest)


def _numbers(value: Any, needed: Mapping[str, Range], where: str) -> dict[str, float]:
    """Numbers by name, all that are needed among them."""
    later = {
        name: one.default for name, one in needed.items() if one.default is not None
    }
    table = later | dict(check_table(value, where))
    for name in needed:
        if name not in table:
            raise InputError(
                f"{where}: '{name}' is missing, expected {quoted(needed)}; {REMEDY}"
            )
    return {
        name: _number(number, needed.get(name, ANY), f"{where}.{name}")
        for name, number in table.items()
    }


def _margins(value: Any) -> Margins:
    """Margins; null is no limit."""
    names = dict.fromkeys((margin.name for margin in fields(Margins)), ANY)
    table = check_table(value, "margins", names)
    finite = {name: 0.0 if number is None else number for name, number in table.items()}
    known = _numbers(finite, names, "margins")
    return Margins(
        **{name: np.inf if table[name] is None else known[name] for name in names}
    )
