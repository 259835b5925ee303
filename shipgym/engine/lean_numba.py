"""Compiling a loop once: Numba optimises each function on its own, though the loop holds them all.

It makes machine code of every function that a loop calls, nested ones again in each that calls them, and then
of the loop, into which their code is inlined. Within `lean` the functions with the loop's tag are translated
only as far as LLVM's intermediate code: that saves two thirds of the time to compile; the loop's code is the
same.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from llvmlite.binding.newpassmanagers import create_new_function_pass_manager
from numba.core import codegen


@contextmanager
def lean(tag: str, loop: str) -> Iterator[None]:
    """Compile functions whose name ends with `tag`, but for the loop, no further than they are needed.

    Parameters
    ----------
    tag : str
        At the end of the names of all functions that are compiled together.
    loop : str
        Name of the one that is called.
    """
    library, machine = codegen.JITCodeLibrary, codegen.JITCPUCodegen
    kept = {
        name: getattr(owner, name)
        for owner, name in (
            (library, "_optimize_functions"),
            (library, "_optimize_final_module"),
            (library, "_finalize_final_module"),
            (machine, "set_env"),
        )
    }

    passes = create_new_function_pass_manager()  # without these, branches keep loops from being vectorised
    passes.add_sroa_pass()
    passes.add_simplify_cfg_pass()

    def is_inner(name: str) -> bool:
        return name.endswith(tag) and name != loop

    def optimise_functions(self: Any, module: Any) -> None:
        if not self.name.endswith(tag):
            kept["_optimize_functions"](self, module)
            return
        module.data_layout = self._codegen._data_layout
        builder = self._codegen._pass_builder()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def optimise_module(self: Any) -> None:
        if not is_inner(self.name):
            kept["_optimize_final_module"](self)

    def emit(self: Any) -> None:
        if is_inner(self.name):
            self._finalize_dynamic_globals()
            self._finalized = True
        else:
            kept["_finalize_final_module"](self)

    def set_environment(self: Any, name: str, environment: Any) -> None:
        # what has not been emitted has no environment; functions on numbers use none
        if self._engine.is_symbol_defined(name) or self._engine.get_global_value_address(name):
            kept["set_env"](self, name, environment)

    library._optimize_functions, library._optimize_final_module = optimise_functions, optimise_module
    library._finalize_final_module, machine.set_env = emit, set_environment
    try:
        yield
    finally:
        library._optimize_functions = kept["_optimize_functions"]
        library._optimize_final_module = kept["_optimize_final_module"]
        library._finalize_final_module, machine.set_env = kept["_finalize_final_module"], kept["set_env"]
