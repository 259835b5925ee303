"""Machine code of a loop in a file: named by all it depends on, so never stale, and checked when read."""

import hashlib
import pickle
from pathlib import Path
from typing import Any

from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from shipgym.engine.cache_folder import LOOP, read_loop, tell, warn_of, write_loop
from shipgym.errors import InputError


class DiskCache(NullCache):  # type: ignore[misc]
    """What Numba asks of a cache, for one loop, in a folder that need not be writable.

    `tag` is the hash of everything that the loop depends on, `signature` that of its
    arguments.
    """

    def __init__(self, folder: Path, tag: str, signature: str) -> None:
        short = hashlib.sha256(signature.encode()).hexdigest()[:8]
        self.path = folder / f"{tag}-{short}{LOOP}"
        self._content: bytes | None = None

    def ready(self) -> bool:
        """Whether machine code is on disk, and whole."""
        self._content = None
        try:
            self._content = read_loop(self.path)
        except OSError:
            pass
        except ValueError as error:
            tell(
                f"{self.path.parent}: a compiled loop {error}; it is compiled again"
                " (see shipgym doctor)"
            )
        return self._content is not None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled loop, if it was found ready; None: it is to be compiled."""
        if self._content is None:
            return None
        content, self._content = self._content, None
        target_context.refresh()
        try:
            return CompileResult._rebuild(target_context, *pickle.loads(content))
        except Exception as error:  # whatever the inside of another Numba may raise
            tell(
                f"{self.path}: cannot be loaded ({type(error).__name__}: {error}); it"
                " is compiled again"
            )
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, where the folder may be written."""
        if data.library.has_dynamic_globals:  # addresses of this process
            return
        try:
            write_loop(dumps(data._reduce()), self.path)
        except InputError as error:
            warn_of(self.path.parent, error.__cause__ or error)
