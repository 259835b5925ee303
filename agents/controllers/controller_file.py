"""Read a controller file: JSON, versioned, checked field by field.

docs/deployment.md lists the fields.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from agents.controllers.controller import ANY_NUMBER, FORMAT, Bounds, Controller
from agents.controllers.interface import check_names
from agents.controllers.margins import Margins
from agents.controllers.registry import controller_class, controller_kinds
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
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
#: The kind of file that `agents.policies.policy_file` reads.
LEARNED = "learned"
FINITE = Bounds(-np.inf, np.inf)
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


def read_controller(content: Mapping[str, Any], where: str) -> Controller:
    """Make a controller from what `Controller.to_dict` returned.

    Raises InputError, which names the field at fault.
    """
    design = _class_of(content, where)
    expected = (*FIELDS, *_further_fields(design))
    check_keys(content, expected, where, expected)
    names = _names(content["observation_names"], where)
    further = tuple(name for name in design.may_observe if name in names)
    check_names(names, design.observes + further, f"{where}: observation_names")

    rudder = Bounds(-np.pi, np.pi)  # rad
    with placed(where):
        return design(
            gains=_gains(content["gains"], design),
            neutral_rudder=_number(content["neutral_rudder"], rudder, "neutral_rudder"),
            neutral_sway=_number(content["neutral_sway"], ANY_NUMBER, "neutral_sway"),
            margins=_margins(content["margins"]),
            observation_scales=read_scales(content["observation_scales"], names),
            design=_design(content["design"], design),
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


def _further_fields(design: type[Controller]) -> list[str]:
    """Fields that a kind of controller has in addition to `FIELDS`."""
    fields_of_kind = {
        "arrays": bool(design.arrays),
        "autopilot": design.has_autopilot,
        "ship": design.has_ship,
    }
    return [name for name, present in fields_of_kind.items() if present]


def _names(value: Any, where: str) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise InputError(
            f"{where}: observation_names: expected a list of names, got {shown(value)}"
        )
    names = [str(name) for name in value]
    return tuple(names)


def _gains(value: Any, design: type[Controller]) -> dict[str, float]:
    bounds = {}
    for name in _gain_names(design):
        bounds[name] = design.bounds.get(name, ANY_NUMBER)
    table = check_table(value, "gains", bounds)
    return _numbers(table, bounds, "gains")


def _design(value: Any, design: type[Controller]) -> dict[str, float]:
    """Design settings: any numbers, those that the law needs within their bounds."""
    table = check_table(value, "design")
    gains = _gain_names(design)
    needed = {}
    for name, bounds in design.bounds.items():
        if name not in gains:
            needed[name] = bounds
    return _numbers(table, needed, "design")


def _gain_names(design: type[Controller]) -> tuple[str, ...]:
    return design.gain_names or tuple(design.feedback)


def _parts(content: Mapping[str, Any], design: type[Controller]) -> dict[str, Any]:
    """Autopilot that guidance leads, and its design model, where it has them."""
    parts: dict[str, Any] = {}
    if design.has_autopilot:
        table = check_table(content["autopilot"], "autopilot")
        autopilot = read_controller(table, "autopilot")
        if autopilot.has_autopilot:
            raise InputError(
                "autopilot: expected a controller that keeps a heading, got"
                f" '{autopilot.kind}'"
            )
        parts["autopilot"] = autopilot
    if design.has_ship:
        table = check_table(content["ship"], "ship")
        parts["ship"] = ShipModel.from_dict(table, "ship")
    return parts


def _arrays(value: Any, axes_of: Mapping[str, tuple[str | int, ...]]) -> dict[str, Any]:
    """Arrays of numbers, whose axes of one name have one length."""
    table = check_table(value, "arrays", axes_of, axes_of)
    lengths: dict[str, int] = {}  # of named axes
    arrays = {}
    for name, axes in axes_of.items():
        where = f"arrays.{name}"
        array = check_array(table[name], _shape(axes, lengths), where)
        if not _has_axes(array, axes, lengths) or not _is_bounded(array):
            largest = ANY_NUMBER.largest
            expected = ", ".join(map(str, axes))
            raise InputError(
                f"{where}: expected numbers of magnitude {largest:g} at most, of shape"
                f" ({expected}), got shape {array.shape}; {REMEDY}"
            )
        arrays[name] = array
    return arrays


def _shape(
    axes: tuple[str | int, ...], lengths: Mapping[str, int]
) -> tuple[int | None, ...]:
    """Lengths of axes; None for a named one whose length is not known yet."""
    shape = []
    for axis in axes:
        length = lengths.get(axis) if isinstance(axis, str) else axis
        shape.append(length)
    return tuple(shape)


def _has_axes(
    array: Floats, axes: tuple[str | int, ...], lengths: dict[str, int]
) -> bool:
    """Compare an array's axes with those expected; keep lengths of named ones."""
    if array.ndim != len(axes) or array.size == 0:
        return False
    for axis, length in zip(axes, array.shape, strict=True):
        if isinstance(axis, str) and lengths.setdefault(axis, length) != length:
            return False
    return True


def _is_bounded(array: Floats) -> bool:
    return bool(np.abs(array).max() <= ANY_NUMBER.largest)


def read_model(value: Any) -> dict[str, str]:
    """Name and hash of the model that an agent was made for, as its fields."""
    names = ("name", "sha256")
    table = check_table(value, "model", names)
    texts = {}
    for name in names:
        text = table.get(name)
        texts[f"model_{name}"] = check_text(text, f"model.{name}")
    return texts


def read_scales(value: Any, names: tuple[str, ...]) -> tuple[float, ...]:
    """Observation scales, positive numbers, one for each name."""
    where = "observation_scales"
    expected = f"expected {len(names)} numbers"
    if not isinstance(value, list):
        raise InputError(f"{where}: {expected}, got {shown(value)}")
    if len(value) != len(names):
        raise InputError(f"{where}: {expected}, got {len(value)}")

    bounds = Bounds(1e-9, 1e9)
    scales = []
    for i, name in enumerate(names):
        place = f"{where}[{i}] ('{name}')"
        scale = _number(value[i], bounds, place)
        scales.append(scale)
    return tuple(scales)


def _number(value: Any, bounds: Bounds, where: str) -> float:
    return check_number(value, where, at_least=bounds.least, at_most=bounds.largest)


def _numbers(
    table: Mapping[str, Any], needed: Mapping[str, Bounds], where: str
) -> dict[str, float]:
    """Numbers by name; InputError names one that is needed and missing."""
    for name in needed:
        if name not in table:
            raise InputError(
                f"{where}: expected {quoted(needed)}, got no '{name}'; {REMEDY}"
            )
    numbers = {}
    for name, value in table.items():
        bounds = needed.get(name, FINITE)
        numbers[name] = _number(value, bounds, f"{where}.{name}")
    return numbers


def _margins(value: Any) -> Margins:
    """Margins; null is no limit."""
    needed = {margin.name: FINITE for margin in fields(Margins)}
    table = dict(check_table(value, "margins", needed))
    unlimited = {}
    for name in list(table):
        if table[name] is None:
            del table[name], needed[name]
            unlimited[name] = np.inf
    return Margins(**_numbers(table, needed, "margins"), **unlimited)
