"""One clear error where a public function was given an argument of a wrong type."""

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from types import UnionType
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

from shipgym.checks import shown
from shipgym.errors import InputError

Function = TypeVar("Function", bound=Callable[..., Any])


def typed(function: Function) -> Function:
    """Explain an error that comes of an argument which its annotation does not allow.

    Arguments are looked at once the function has failed: what works stays free of
    checks. InputError then names the argument; any other error stays as it is.
    """

    @functools.wraps(function)
    def wrapped(*given: Any, **named: Any) -> Any:
        try:
            return function(*given, **named)
        except (TypeError, AttributeError, ValueError, KeyError, IndexError) as error:
            if isinstance(error, InputError):
                raise
            if fault := _fault(function, given, named):
                raise InputError(fault) from error
            raise

    return cast(Function, wrapped)


def _fault(function: Any, given: Any, named: Any) -> str:
    """Words for the first argument of a wrong type; empty if there is none."""
    try:
        bound = inspect.signature(function).bind(*given, **named)
    except TypeError:  # too many arguments, or too few, as Python says
        return ""
    for name, value in bound.arguments.items():
        annotation = bound.signature.parameters[name].annotation
        expected = _evaluated(annotation, function)
        if expected is not None and not _fits(value, expected):
            words = annotation if isinstance(annotation, str) else _words(annotation)
            return f"{name}: expected {words}, got {shown(value)}"
    return ""


def _evaluated(annotation: Any, function: Any) -> Any:
    """The type of an annotation; None for none, or of a name that is not imported."""
    if annotation is inspect.Parameter.empty:
        return None
    if not isinstance(annotation, str):
        return annotation
    names: dict[str, Any] = {}  # of types that modules import only for annotations
    for home in ("shipgym", "shipgym.ships"):
        module = import_module(home)
        names |= {name: getattr(module, name) for name in dir(module)}
    try:
        return eval(annotation, {**names, **inspect.unwrap(function).__globals__})
    except (NameError, AttributeError, TypeError):
        return None


def _words(annotation: Any) -> str:
    return str(getattr(annotation, "__name__", annotation)).rpartition(".")[2]


def _fits(value: Any, expected: Any) -> bool:
    """True unless a value is certainly not of a type."""
    origin = get_origin(expected)
    inner = get_args(expected)
    if origin in (Union, UnionType):
        if set(get_args(ArrayLike)) <= set(inner):
            return _is_numeric(value) or (value is None and type(None) in inner)
        return any(_fits(value, one) for one in inner)
    if expected is Any:
        return True
    if expected is None or expected is type(None):
        return value is None
    if origin is Literal:
        return value in inner
    if origin is np.ndarray:
        return _is_numeric(value)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return isinstance(value, Mapping)
    if isinstance(origin, type) and issubclass(origin, Sequence):
        if isinstance(value, str | bytes) or not hasattr(value, "__len__"):
            return False
        return not inner or all(_fits(one, inner[0]) for one in list(value)[:100])
    if origin is Callable:
        return callable(value)
    if origin is not None:
        return not isinstance(origin, type) or isinstance(value, origin)
    if expected is float:
        return _is_numeric(value) and np.ndim(value) == 0
    if expected is int:
        return isinstance(value, int | np.integer) and bool(abs(int(value)) < 2**63)
    return not isinstance(expected, type) or _is_instance(value, expected)


def _is_instance(value: Any, expected: type) -> bool:
    is_protocol = getattr(expected, "_is_protocol", False)
    if not is_protocol:
        return isinstance(value, expected)
    for name in vars(expected):
        is_public = not name.startswith("_")
        if is_public and not hasattr(value, name):
            return False
    return True


def _is_numeric(value: Any) -> bool:
    """True for finite numbers, alone or in a regular array."""
    try:
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        return False
    kind = np.asarray(value).dtype.kind
    is_finite = np.isfinite(numbers)
    return kind in "fiu" and bool(is_finite.all())
