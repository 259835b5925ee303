"""Plain functions on numbers and records, as the engine compiles them, written as C99.

A function is run on nodes in place of numbers, once for each way through its branches:
what it computes of them is its C. It is written for the kinds of its arguments, with
all that it calls, hooks filled as `shipgym.engine.specialise` fills them. Only checked
names and numbers become part of the C.
"""

import inspect
import sys
import textwrap
import traceback
from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial, reduce
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from agents.export.c_structures import Rows, Struct, Structures
from agents.export.c_syntax import (
    COMPARISONS,
    FUNCTIONS,
    LOGIC,
    OPERATORS,
    TAKEN,
    comment,
    free,
    literal,
)
from shipgym import InputError
from shipgym.engine.records import row_of
from shipgym.engine.specialise import named_globals

MOST_WAYS = 128  # through the branches of one function, and conditions on each


class Translated(NamedTuple):
    """A function that was written as C."""

    name: str
    returns: Any  # kind


class Translator:
    """Writes functions and the structures that they need, each once.

    Parameters
    ----------
    hooks : mapping
        What takes the place of globals of the engine's functions.
    prefix : str
        Beginning of every name in C.

    Attributes
    ----------
    structures : Structures
    """

    def __init__(self, hooks: Mapping[str, Any], prefix: str) -> None:
        self.hooks = hooks
        self.structures = Structures(prefix)
        self._texts: dict[str, str] = {}  # by name, in an order that C can read
        self._wanted: set[str] = set()
        # None while a function is being written
        self._written: dict[Any, Translated | None] = {}

    @property
    def functions(self) -> list[str]:
        """Definitions of the functions that were asked for, and of what they call."""
        kept: list[str] = []
        for name, text in reversed(self._texts.items()):
            is_called = any(f"{name}(" in other for other in kept)
            if name in self._wanted or is_called:
                kept.append(text)
        return kept[::-1]

    def function(self, function: Any, *values: Any) -> Translated:
        """Write a function for arguments such as these values, functions among them.

        Raises InputError, naming function and line, for what cannot be written as C.
        """
        found = self.call(function, *values)
        self._wanted.add(found.name)
        return found

    def call(self, function: Any, *values: Any) -> Translated:
        """Write a function that another one calls."""
        kinds = tuple([self.structures.kind_of(value) for value in values])
        key = (function, kinds)
        if key not in self._written:
            self._written[key] = None
            name = self.structures.free_name(function.__name__)
            text, returns = FunctionWriter(self, function, kinds).written(name)
            self._texts[name] = text
            self._written[key] = Translated(name, returns)
        found = self._written[key]
        if found is None:
            raise TypeError("a function that calls itself")
        return found


class Node(NDArrayOperatorsMixin):
    """A number or a structure in C that is computed of others.

    `text`: in C, with %s for each of the nodes `parts`; `sign`: the operator between
    them, empty for what needs no brackets.
    """

    def __init__(self, writer: Any, text: str, parts: tuple[Any, ...], kind: Any):
        self.writer = writer
        self.text = text
        self.parts = parts
        self.kind = kind
        self.sign = ""
        self.hint = ""  # name that it has in Python

    def __bool__(self) -> bool:
        return bool(self.writer.choose(self))

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any) -> Any:
        return self.writer.applied(ufunc, *inputs)

    def __array_function__(self, function: Any, _: Any, inputs: Any, more: Any) -> Any:
        return self.writer.applied(function, *inputs, **more)


class Callee(NamedTuple):
    """A function that is called in C where it is called in Python."""

    kind: Any
    writer: Any

    def __call__(self, *given: Any, **named: Any) -> Any:
        """Result of a call in C."""
        bound = inspect.signature(self.kind).bind(*given, **named)
        bound.apply_defaults()
        return self.writer.called(self.kind, list(bound.arguments.values()))


class Module(NamedTuple):
    """A module whose functions are called in C."""

    module: ModuleType
    writer: Any

    def __getattr__(self, name: str) -> Any:
        return self.writer.in_c(getattr(self.module, name))


class FunctionWriter:
    """Runs a function on nodes, and writes what it returns."""

    def __init__(self, c: Translator, function: Any, kinds: Sequence[Any]) -> None:
        self.c = c
        self.function = function
        self.kinds = kinds
        self.nodes: dict[Any, Node] = {}  # in an order in which C can compute them
        self.decisions: tuple[bool, ...] = ()
        self.asked: list[Node] = []  # conditions on this way
        self.answers: dict[int, bool] = {}
        self.n_ways = 0

    def written(self, name: str) -> tuple[str, Any]:
        """Text of the function under a name in C, and the kind that it returns."""
        try:
            names = list(inspect.signature(self.function).parameters)
            arguments = []
            for argument, kind in zip(names, self.kinds, strict=True):
                if isinstance(kind, FunctionType):
                    arguments.append(Callee(kind, self))
                else:
                    node = self.node(free(argument, TAKEN), (), kind)
                    arguments.append(self.unfolded(node))
            run = partial(self._copy(), *arguments)
            result = self.folded(self._by_ways(run, ()))
            returns = self.c.structures.kind_of(result)
        except InputError:
            raise
        except Exception as error:
            raise self._refusal(error) from error
        return self._text(name, result), returns

    def _copy(self) -> Callable[..., Any]:
        """The function, with names for what it calls that write C."""
        function = self.function
        names = {
            "__name__": function.__module__,
            "min": partial(self._smaller, np.minimum),
            "max": partial(self._smaller, np.maximum),
            "int": partial(self.applied, int),
            "float": partial(self.applied, float),
        }
        used = named_globals(function, self.c.hooks)
        names |= {name: self.in_c(value) for name, value in used}
        return FunctionType(
            function.__code__,
            names,
            function.__name__,
            function.__defaults__,
        )

    def in_c(self, value: Any) -> Any:
        """What a global of the function stands for."""
        if value is row_of:
            return self._entry
        if isinstance(value, Hashable) and value in FUNCTIONS:
            return partial(self.applied, value)
        if isinstance(value, ModuleType) and value is not np:
            return Module(value, self)
        return Callee(value, self) if isinstance(value, FunctionType) else value

    # Ways through branches.

    def _by_ways(self, run: Callable[[], Any], decisions: tuple[bool, ...]) -> Any:
        """Result of a function whose first conditions are decided so."""
        self.n_ways += 1
        self.decisions, self.asked, self.answers = decisions, [], {}
        result = self._named(run)
        asked = self.asked
        for number in reversed(range(len(decisions), len(asked))):
            before = decisions + (True,) * (number - len(decisions))
            other = self._by_ways(run, (*before, False))
            result = self._either(asked[number], result, other)
        return result

    def choose(self, condition: Node) -> bool:
        """Decide a condition, the same one always alike on one way."""
        number = len(self.asked)
        if max(number, self.n_ways) > MOST_WAYS:
            raise TypeError("a loop by a condition, or too many branches")
        if id(condition) not in self.answers:
            self.asked.append(condition)
            is_new = number >= len(self.decisions)
            self.answers[id(condition)] = is_new or self.decisions[number]
        return self.answers[id(condition)]

    def _either(self, condition: Node, yes: Any, no: Any) -> Any:
        """One of two results, number by number."""
        if isinstance(yes, tuple):
            pairs = zip(yes, no, strict=True)
            parts = [self._either(condition, a, b) for a, b in pairs]
            return type(yes)(*parts) if hasattr(yes, "_fields") else tuple(parts)
        is_constant = not isinstance(yes, Node) and not isinstance(no, Node)
        if yes is no or (is_constant and yes == no):
            return yes
        return self.applied(np.where, condition, yes, no)

    def _named(self, run: Callable[[], Any]) -> Any:
        """Run, and name nodes as the function's variables."""
        code = self.function.__code__

        def note(frame: Any, event: str, _: Any) -> None:
            if event == "return" and frame.f_code is code:
                for name, value in frame.f_locals.items():
                    if isinstance(value, Node) and value.parts and not value.hint:
                        value.hint = name

        before = sys.getprofile()
        sys.setprofile(note)
        try:
            return run()
        finally:
            sys.setprofile(before)

    # Nodes.

    def node(self, text: str, parts: Sequence[Any], kind: Any) -> Node:
        """Node of a text and its parts, the same one for the same; numbers go in."""
        within = tuple([one for one in parts if isinstance(one, Node)])
        shown = ["%s" if isinstance(one, Node) else literal(one) for one in parts]
        text = text % tuple(shown)
        key = (text, *map(id, within))
        if key not in self.nodes:
            self.nodes[key] = Node(self, text, within, kind)
        return self.nodes[key]

    def applied(self, function: Any, *values: Any, **more: Any) -> Any:
        """An operator or a function of numbers."""
        if not any(isinstance(value, Node) for value in values):
            return function(*values, **more)
        kinds = {self.c.structures.kind_of(value) for value in values}
        if function in OPERATORS:
            return self._operation(OPERATORS[function], values, kinds)
        if function is np.where:
            return self._choice(*values)
        if function is float:
            return self._choice(values[0], 1.0, 0.0) if kinds == {bool} else values[0]
        if function is int:
            return self.node("trunc(%s)", values, float)
        if kinds != {float} or more:
            raise TypeError("a function of other than numbers")
        exponent = values[-1]
        if function is np.power and isinstance(exponent, int) and exponent > 0:
            return self.node(f"whole_power(%s, {exponent})", values[:1], float)
        blanks = ", ".join(["%s"] * len(values))
        return self.node(f"{FUNCTIONS[function]}({blanks})", values, float)

    def _operation(self, sign: str, values: Sequence[Any], kinds: set[Any]) -> Node:
        if kinds != {bool if sign in LOGIC else float}:
            raise TypeError("numbers where conditions are expected, or the reverse")
        is_condition = sign in LOGIC or sign in COMPARISONS
        text = f"%s {sign} %s" if len(values) == 2 else f"{sign}%s"
        made = self.node(text, values, bool if is_condition else float)
        made.sign = sign if len(values) == 2 else "!"
        return made

    def _choice(self, test: Any, yes: Any, no: Any) -> Any:
        if not isinstance(test, Node):
            return yes if test else no
        if yes is True and no is False:
            return test
        if yes is False and no is True:
            return self.applied(np.invert, test)
        made = self.node(
            "%s ? %s : %s",
            (test, yes, no),
            self.c.structures.kind_of(yes),
        )
        made.sign = "?"
        return made

    def _smaller(self, function: Any, *values: Any) -> Any:
        return reduce(partial(self.applied, function), values)

    def _entry(self, table: Node, row: Any) -> Node:
        """Number of a table."""
        if isinstance(row, Node):
            return self.node("%s[(int)(%s)]", (table, row), float)
        return self.node(f"%s[{int(row)}]", (table,), float)

    def called(self, function: Any, values: Sequence[Any]) -> Any:
        """Call of another function."""
        written = self.c.call(function, *values)
        passed = [self.folded(one) for one in values if not isinstance(one, Callee)]
        blanks = ", ".join(["%s"] * len(passed))
        made = self.node(f"{written.name}({blanks})", passed, written.returns)
        return self.unfolded(made)

    def unfolded(self, node: Node) -> Any:
        """Record of the numbers of a structure; a number as it is."""
        kind = node.kind
        if not isinstance(kind, Struct):
            return node
        members = []
        for label, part in zip(kind.labels, kind.kinds, strict=True):
            member = self.node(f"%s.{label.name}", (node,), part)
            members.append(self.unfolded(member))
        return kind.made(members)

    def folded(self, value: Any) -> Any:
        """Structure of a record; a number as it is."""
        if not isinstance(value, tuple):
            return value
        kind = self.c.structures.kind_of(value)
        parts = [self.folded(part) for part in value]
        first = parts[0] if parts else None
        if isinstance(first, Node) and len(first.parts) == 1:
            (whole,) = first.parts
            unfolded = self.unfolded(whole) if whole.kind == kind else ()
            if unfolded and all(map(same, unfolded, value)):
                return whole
        inside = ", ".join([f".{label.name} = %s" for label in kind.labels])
        text = f"({self.c.structures.type(kind)}){{{inside or 0}}}"
        return self.node(
            text,
            parts,
            kind,
        )

    # Text.

    def _text(self, name: str, result: Any) -> str:
        """Definition of the function in C."""
        structures = self.c.structures
        uses = self._uses(result)
        names = {}
        parameters = []
        lines = []
        arguments = inspect.signature(self.function).parameters
        for argument, kind in zip(arguments, self.kinds, strict=True):
            if isinstance(kind, FunctionType):
                continue
            variable = free(argument, TAKEN)
            gap = "" if isinstance(kind, Rows) else " "
            parameters.append(f"{structures.type(kind)}{gap}{variable}")
            node = self.nodes[variable,]
            names[id(node)] = variable
            if not uses[id(node)]:
                lines.append(f"(void){variable};")

        taken = {*TAKEN, *names.values()}
        for node in self.nodes.values():
            if is_variable(node, uses) and id(node) not in names:
                declared = structures.type(node.kind)
                hint = node.hint or getattr(node.kind, "name", "part").lower()
                variable = free(hint, taken)
                taken.add(variable)
                lines.append(f"const {declared} {variable} = {written(node, names)};")
                names[id(node)] = variable
        lines.append(f"return {written(result, names)};")

        summary = (self.function.__doc__ or "").strip().partition("\n")[0]
        returned = structures.type(structures.kind_of(result))
        head = f"static {returned} {name}({', '.join(parameters) or 'void'}) {{"
        body = [
            textwrap.fill(
                line,
                width=110,
                initial_indent="    ",
                subsequent_indent="        ",
                break_long_words=False,
                break_on_hyphens=False,
            )
            for line in lines
        ]
        above = [f"/* {comment(summary)} */"] if summary else []
        return "\n".join([*above, head, *body, "}\n"])

    def _uses(self, result: Any) -> Counter[int]:
        """How often each node is used for a result."""
        uses = Counter([id(result)])
        for node in reversed(self.nodes.values()):
            if uses[id(node)]:
                uses.update(map(id, node.parts))
        return uses

    def _refusal(self, error: Exception) -> InputError:
        """Message for what cannot be written."""
        code = self.function.__code__
        line, said = 1, str(error)
        for frame in traceback.extract_tb(error.__traceback__):
            if (frame.filename, frame.name) == (code.co_filename, code.co_name):
                line = int(frame.lineno or 1) - code.co_firstlineno + 1
                said = f"{(frame.line or '')[:80]!r} ({error})"
        return InputError(
            f"{self.function.__module__}.{self.function.__name__}, line {line}:"
            " expected arithmetic, comparisons, records and functions made of these,"
            f" got {said}, which cannot be written as C"
        )


def same(a: Any, b: Any) -> bool:
    """Return True for the same node, or records of the same nodes."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return a is b


def is_variable(node: Node, uses: Counter[int]) -> bool:
    """Return True for a node that is computed once and has a name."""
    n_uses = uses[id(node)]
    is_call = isinstance(node.kind, Struct) and node.text[0] not in "(%"
    is_member = node.text.startswith("%s.") and not node.hint
    if n_uses == 0 or is_member:
        return False
    return n_uses > 1 or is_call or bool(node.hint)


def written(node: Any, names: Mapping[int, str]) -> str:
    """Text of a node, of names where it has variables."""
    if not isinstance(node, Node):
        return literal(node)
    if id(node) in names:
        return names[id(node)]
    parts = []
    for part in node.parts:
        text = written(part, names)
        is_single = not (node.sign and part.sign) or id(part) in names
        parts.append(text if is_single else f"({text})")
    return node.text % tuple(parts)
