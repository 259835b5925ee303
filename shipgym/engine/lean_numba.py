"""Compiling a loop once: Numba optimises and emits each function on its own, though the loop holds them all.

Numba makes machine code of every function that a loop calls, nested ones again in each
that calls them, and then of the loop, into which their code is inlined. Here what loops
call is translated once in a process, only as far as LLVM's intermediate code, and
linked into each loop; and passes that find nothing in functions on numbers and records
are left out. The loop's code is the same, but for the length of its vectors.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import CodeType
from typing import Any

import numba.np.linalg
from llvmlite import ir
from llvmlite.binding.newpassmanagers import create_new_function_pass_manager
from numba.core import codegen, types
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager
from numba.core.types.functions import BaseFunction

from shipgym.engine.specialise import CALLED

Replace = Callable[[Any, str, Any], None]

# Passes, by Numba's names, for `with`, array expressions, `literally`, parallel loops,
# functions in functions
IDLE = (
    "with_lifting",
    "nopython_rewrites",
    "Rewrite dynamic raises",
    "find_literally",
    "literal_unroll",
    "annotate_types",
    "dump_parfor_diagnostics",
    "nopython_supported_feature_validation",
)
# What is replaced of Numba's inside; of a version without it loops are compiled in
# Numba's own way
INSIDE = {
    codegen.JITCodeLibrary: (
        "_optimize_functions",
        "_optimize_final_module",
        "finalize",
        "_finalize_dynamic_globals",
    ),
    codegen.JITCPUCodegen: ("set_env",),
    codegen.CPUCodeLibrary: ("add_ir_module",),
    BaseFunction: ("get_call_type",),
}
# Signatures of operators on numbers, by Numba's types of operator and numbers
OPERATORS: dict[Any, Any] = {}
# LLVM halves the vectors of processors that slow down when a few long ones are used;
# loops use nothing else
LONG_VECTORS = '"prefer-vector-width"="512"'
# Loops that are a long chain of dependent operations: of two vectors of 256 bits
# neither waits for the other. Such a loop must not sum over lanes, since the hint lets
# LLVM take sums in another order.
CHAINS, TWO_VECTORS = ("sail_lanes", "conclude_lanes", "advance_tile"), 8
CLOSURES = ("inline_closure_likes", "make_function_op_code_to_jit_function")


@contextmanager
def lean(loop: str) -> Iterator[None]:
    """Compile the functions that the one called `loop` calls no further than needed."""
    with _replaced() as replace:
        if all(
            hasattr(owner, name) for owner, names in INSIDE.items() for name in names
        ):
            _link_once(replace, loop)
            _look_up_operators(replace)
            _use_long_vectors(replace, loop)
        yield


def without_scipy() -> None:
    """Start Numba without SciPy, whose BLAS it would look for: half a second.

    Functions that multiply matrices ask for it again when they are compiled.
    """
    if "numba.np.arraymath" in sys.modules:
        return
    with _replaced() as replace:
        replace(numba.np.linalg, "ensure_blas", lambda: None)
        import numba.np.arraymath as arraymath

    arraymath.ensure_blas = numba.np.linalg.ensure_blas


@contextmanager
def _replaced() -> Iterator[Replace]:
    """A function that replaces attributes until the end."""
    kept = []

    def replace(owner: Any, name: str, value: Any) -> None:
        kept.append((owner, name, getattr(owner, name)))
        setattr(owner, name, value)

    try:
        yield replace
    finally:
        for owner, name, value in reversed(kept):
            setattr(owner, name, value)


def _link_once(replace: Replace, loop: str) -> None:
    library, machine = codegen.JITCodeLibrary, codegen.JITCPUCodegen
    optimise, finish, set_env = (
        library._optimize_functions,
        library.finalize,
        machine.set_env,
    )
    optimise_final = library._optimize_final_module
    passes = (
        create_new_function_pass_manager()
    )  # without these, branches keep loops from being vectorised
    passes.add_sroa_pass()
    passes.add_simplify_cfg_pass()

    def optimise_functions(self: Any, module: Any) -> None:
        if not (self.name == loop or self.name.endswith(CALLED)):
            optimise(self, module)
            return
        module.data_layout = self._codegen._data_layout
        builder = self._codegen._pass_builder()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def finalize(self: Any) -> None:
        if self.name.endswith(CALLED):
            self._finalize_dynamic_globals()
            self._finalized, self._shared_module = True, self._final_module
            for function in self._final_module.functions:
                if not function.is_declaration:
                    function.linkage = "linkonce_odr"
            return
        if self.name == loop:
            # callers first, since what nobody calls yet is not linked
            self._linking_libraries = list(reversed(_beneath(self, {})))
        finish(self)

    def optimise_module(self: Any) -> None:
        if (
            self.name == loop
        ):  # no symbol is defined by two loops, which may both come from files
            for function in self._final_module.functions:
                if CALLED in function.name and not function.is_declaration:
                    function.name += f".{loop}"
        optimise_final(self)

    def set_environment(self: Any, name: str, environment: Any) -> None:
        # what has not been emitted has no environment; functions on numbers use none
        if self._engine.is_symbol_defined(
            name
        ) or self._engine.get_global_value_address(name):
            set_env(self, name, environment)

    replace(library, "_optimize_functions", optimise_functions)
    replace(library, "_optimize_final_module", optimise_module)
    replace(library, "finalize", finalize)
    replace(machine, "set_env", set_environment)


def _look_up_operators(replace: Replace) -> None:
    """Go through Numba's rules for an operator on numbers, and say which did not fit, only once."""
    find = BaseFunction.get_call_type

    def signature(self: Any, context: Any, args: Any, kws: Any) -> Any:
        asked = (self, *args, *dict(kws).items())
        if asked not in OPERATORS:
            found: Any = find(self, context, args, kws)
            # what Numba writes in Python is compiled anew where options differ
            written = any(
                found.args in getattr(rule, "_compiled_overloads", ())
                for rule in self.templates
            )
            if written or not all(
                isinstance(one, types.Number | types.Boolean) for one in args
            ):
                return found
            OPERATORS[asked] = found
        return OPERATORS[asked]

    replace(BaseFunction, "get_call_type", signature)


def _use_long_vectors(replace: Replace, loop: str) -> None:
    add_module = codegen.CPUCodeLibrary.add_ir_module

    def add_with_long_vectors(self: Any, module: Any) -> None:
        if self.name == loop or self.name.endswith(CALLED):
            features = self._codegen._tm_features
            twice = (
                self.name.startswith(CHAINS)
                and "+avx2" in features
                and "+avx512f" not in features
            )
            for function in module.functions:
                if not function.is_declaration:
                    set.add(
                        function.attributes, LONG_VECTORS
                    )  # its own `add` knows no attributes of targets
                    if twice:
                        _lengthen(function, TWO_VECTORS)
        add_module(self, module)

    replace(codegen.CPUCodeLibrary, "add_ir_module", add_with_long_vectors)


def _lengthen(function: Any, lanes: int) -> None:
    """Ask LLVM to take this many lanes of the function's loops at once."""
    width = function.module.add_metadata(
        ["llvm.loop.vectorize.width", ir.Constant(ir.IntType(32), lanes)]
    )
    for block in _turning_back(function.entry_basic_block, (), set()):
        loop = function.module.add_metadata([width, block.name])
        loop.operands = loop, width  # its first entry tells it from other loops
        block.terminator.set_metadata("llvm.loop", loop)


def _turning_back(block: Any, path: tuple[Any, ...], seen: set[Any]) -> Iterator[Any]:
    """Blocks that end with a branch back to where a path has come from."""
    seen.add(block)
    path = (*path, block)
    for target in block.terminator.operands:
        if target in path:
            yield block
        elif hasattr(target, "terminator") and target not in seen:
            yield from _turning_back(target, path, seen)


def _beneath(library: Any, found: dict[Any, None]) -> dict[Any, None]:
    """Libraries that one calls and those beneath them that were not linked, each after what it calls."""
    for other in library._linking_libraries:
        if other not in found:
            if other.name.endswith(CALLED):
                _beneath(other, found)
            found[other] = None
    return found


class LeanCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler for functions on numbers and records."""

    def define_pipelines(self) -> list[PassManager]:
        """Numba's passes without those that have nothing to do."""
        (default,) = super().define_pipelines()
        code = self.state.func_id.code
        idle = (
            IDLE
            if any(isinstance(c, CodeType) for c in code.co_consts)
            else IDLE + CLOSURES
        )
        passes = PassManager(default.pipeline_name)
        passes.passes = [
            found for found in default.passes if found[0].name() not in idle
        ]
        passes.finalize()
        return [passes]
