"""Plain functions on numbers and records, as the engine compiles them, written as C99.

A function is translated for the kinds of its arguments, with all that it calls, hooks
filled as `shipgym.engine.specialise` fills them. Nothing but checked names and numbers
becomes part of the C.
"""

from collections.abc import Mapping
from typing import Any

from agents.export.c_expression import Translated
from agents.export.c_function import FunctionWriter
from agents.export.c_structures import Structures
from agents.export.c_syntax import Kind


class Translator:
    """Writes functions and the structures that they need, each once.

    Parameters
    ----------
    hooks : mapping
        What takes the place of globals of the engine's functions.
    prefix : str
        Beginning of every name in C.
    real : str
        Type of C for numbers, double or float.

    Attributes
    ----------
    structures : Structures
    functions : list of str
        Definitions in an order in which C can read them.
    """

    def __init__(
        self, hooks: Mapping[str, Any], prefix: str, real: str = "double"
    ) -> None:
        self.hooks = hooks
        self.structures = Structures(prefix, real)
        self.functions: list[str] = []
        # None while a function is being written
        self._translated: dict[Any, Translated | None] = {}

    def function(self, function: Any, *kinds: Kind) -> Translated:
        """Write a function for arguments of these kinds, functions among them.

        Raises InputError, naming function and line, for what cannot be written as C.
        """
        translated = self.call(function, *kinds)
        assert translated is not None, "only a function that is being written is open"
        return translated

    def call(self, function: Any, *kinds: Kind) -> Translated | None:
        """A function that another one calls; None if it is still being written."""
        key = (function, kinds)
        if key in self._translated:
            return self._translated[key]

        self._translated[key] = None
        name = self.structures.free_name(function.__name__)
        writer = FunctionWriter(
            function,
            kinds=kinds,
            hooks=self.hooks,
            structures=self.structures,
            translate=self.call,
        )
        text, returns = writer.written(name)
        self.functions.append(text)
        translated = Translated(name, returns)
        self._translated[key] = translated
        return translated
