"""Machine code of a loop in a file: named by all it depends on, so never stale, and checked when read."""

from __future__ import annotations

import hashlib
import os
import pickle
import tempfile
from pathlib import Path
from typing import Any

from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from shipgym.engine.cache_folder import warn_of

SUFFIX = ".loop"
DIGEST = 32  # bytes of a SHA-256, at the beginning of a file


class DiskCache(NullCache):  # type: ignore[misc]
    """What Numba asks of a cache, for one loop.

    Parameters
    ----------
    folder : Path
        Of the cache; it need not be writable.
    tag : str
        Hash of everything that the loop depends on.
    signature : str
        Of its arguments.
    """

    def __init__(self, folder: Path, tag: str, signature: str) -> None:
        short = hashlib.sha256(signature.encode()).hexdigest()[:8]
        self.path = folder / f"{tag}-{short}{SUFFIX}"
        self._content: bytes | None = None

    def ready(self) -> bool:
        """Whether machine code is on disk, and whole."""
        try:
            content = self.path.read_bytes()
        except OSError:
            return False
        whole = hashlib.sha256(content[DIGEST:]).digest() == content[:DIGEST]
        self._content = content[DIGEST:] if whole else None
        return whole

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled loop, if it was found ready; None: it is to be compiled."""
        if self._content is None:
            return None
        content, self._content = self._content, None
        target_context.refresh()
        return CompileResult._rebuild(target_context, *pickle.loads(content))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, where the folder may be written; a file is there whole or not at all."""
        if data.library.has_dynamic_globals:  # addresses of this process
            return
        content = dumps(data._reduce())
        try:
            number, name = tempfile.mkstemp(dir=self.path.parent, suffix=".new")
            try:
                with os.fdopen(number, "wb") as file:
                    file.write(hashlib.sha256(content).digest() + content)
                Path(name).chmod(0o644)  # others may use it
                Path(name).replace(self.path)
            finally:
                Path(name).unlink(missing_ok=True)
        except OSError as error:
            warn_of(self.path.parent, error)
