"""An older name: any `Controller` may remember, by a `record` or a `memory_size` of its own."""

from agents.controllers.controller import Controller as Stateful

__all__ = ["Stateful"]
