"""Controllers by their names in `--controllers`, files and the setting `base`."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, TypeVar

from shipgym.checks import check_choice
from shipgym.errors import InputError

if TYPE_CHECKING:
    from agents.controllers.controller import Controller

#: Module and class of the controllers of this package by kind; they are imported when
#: they are first used.
_HOMES = {
    "pid": "agents.controllers.pid:PID",
    "lq": "agents.controllers.lq:LQ",
    "lqg": "agents.controllers.lqg:LQG",
    "ilos": "agents.controllers.line_of_sight:IntegralLineOfSight",
    "wheel-over": "agents.controllers.wheel_over:WheelOver",
    "preview-lq": "agents.controllers.preview_lq:PreviewLQ",
    "mpc": "agents.controllers.mpc:MPC",
}
#: Those first that others build on.
CLASSICAL = tuple(_HOMES)
C = TypeVar("C", bound="Controller")

#: Controllers that users registered.
_REGISTERED: dict[str, type[Controller]] = {}


def register_controller(controller: type[C]) -> type[C]:
    """Register a controller by its `kind`.

    The command line, files, the benchmark and learning then know it. Raises InputError
    if it is not such a class, or there is another controller of that kind.

    Parameters
    ----------
    controller : type
        A subclass of `Controller` with a `kind` and `from_model(model, *, dt=None,
        ...)`. To be found by workers it is to be at the top level of a module that they
        can import.

    Returns
    -------
    type
        The same, so that this may be a decorator.
    """
    from agents.controllers.controller import Controller

    where = "register_controller"
    if not (isinstance(controller, type) and issubclass(controller, Controller)):
        raise InputError(
            f"{where}: expected a subclass of agents.Controller, got {controller!r}"
        )
    kind = controller.kind
    name = controller.__name__
    reserved = set(",=+:/{}*. ")
    if not kind or reserved & set(kind):
        raise InputError(
            f"{where}: {name}.kind: expected a name such as 'my-lq', got '{kind}'"
        )
    if not callable(getattr(controller, "from_model", None)):
        raise InputError(
            f"{where}: {name}: expected a class method 'from_model(model, *, dt=None,"
            " ...)', got none"
        )
    other = _HOMES.get(kind) or _home(_REGISTERED.get(kind, controller))
    if other != _home(controller):
        raise InputError(
            f"{where}: {name}.kind: expected one that is free, got '{kind}', which is"
            f" that of {other}"
        )
    if kind not in _HOMES:
        _REGISTERED[kind] = controller
    return controller


def _home(controller: type[Controller]) -> str:
    return f"{controller.__module__}:{controller.__qualname__}"


def controller_kinds() -> tuple[str, ...]:
    """Kinds of all controllers, those of users last."""
    return (*CLASSICAL, *_REGISTERED)


def registered_modules() -> tuple[str, ...]:
    """Modules of users' controllers, for other processes to import."""
    return tuple({controller.__module__: None for controller in _REGISTERED.values()})


def controller_class(kind: str, where: str = "controller") -> type[Controller]:
    """Class of a kind of controller; InputError, with the nearest kind, if unknown."""
    check_choice(kind, controller_kinds(), where)
    if kind in _REGISTERED:
        return _REGISTERED[kind]
    module, _, name = _HOMES[kind].partition(":")
    home = import_module(module)
    controller: type[Controller] = getattr(home, name)
    return controller
