"""Machine code of a loop in a file, named by all that it depends on."""

import hashlib
import pickle
from pathlib import Path
from typing import Any

from shipgym.engine.cache_folder import LOOP, read_loop, tell, warn_of, write_loop
from shipgym.engine.numba_import import load_numba
from shipgym.errors import InputError


class CachedLoop:
    """A loop's file, in a folder that need not be writable.

    `tag` is the hash of everything that the loop depends on, `signature` that of its
    arguments.
    """

    def __init__(self, folder: Path, tag: str, signature: str) -> None:
        short = hashlib.sha256(signature.encode()).hexdigest()[:8]
        self.path = folder / f"{tag}-{short}{LOOP}"

    def load(self, loop: Any) -> Any:
        """Return the compiled loop, None if it is not there or cannot be used."""
        try:
            content = read_loop(self.path)
        except OSError:
            return None
        except ValueError as error:
            tell(
                f"{self.path.parent}: a compiled loop {error}; it is compiled again"
                " (see shipgym doctor)"
            )
            return None
        dispatcher = load_numba().njit(loop)
        from numba.core.compiler import CompileResult

        dispatcher.targetctx.refresh()
        try:
            result = CompileResult._rebuild(
                dispatcher.targetctx, *pickle.loads(content)
            )
        except Exception as error:  # of the internals of another Numba
            tell(
                f"{self.path}: cannot be loaded ({type(error).__name__}: {error}); it"
                " is compiled again"
            )
            return None
        dispatcher.add_overload(result)
        dispatcher.disable_compile()
        return dispatcher

    def save(self, dispatcher: Any) -> None:
        """Store a compiled loop if the folder is writable."""
        (result,) = dispatcher.overloads.values()
        if result.library.has_dynamic_globals:  # addresses of this process
            return
        try:
            from numba.core.serialize import dumps

            write_loop(dumps(result._reduce()), self.path)
        except InputError as error:
            warn_of(self.path.parent, error.__cause__ or error)
