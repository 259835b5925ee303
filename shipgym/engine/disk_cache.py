"""Numba's on-disk cache under names that hash their contents, so that nothing in it is ever stale."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.sigutils import normalize_signature


class _Place:
    """What Numba asks of a place: here a folder, under a name that hashes all that is in the file."""

    def __init__(self, folder: Path) -> None:
        self._folder = str(folder)

    def ensure_cache_path(self) -> None:
        """The folder is there; it need not be writable."""

    def get_cache_path(self) -> str:
        """The folder."""
        return self._folder

    def get_source_stamp(self) -> str:
        """A constant: other sources have other names."""
        return "content"

    def get_disambiguator(self) -> str:
        """Empty: names differ already."""
        return ""


class _Results(CompileResultCacheImpl):  # type: ignore[misc]
    """Compiled functions as bytes, in files of a given name."""

    def __init__(self, folder: Path, tag: str) -> None:
        self._lineno = 0
        self._filename_base = tag
        self._locator = _Place(folder)


class DiskCache(FunctionCache):  # type: ignore[misc]
    """The cache of one loop.

    Parameters
    ----------
    function : function
        The loop.
    folder : Path
        Of the cache.
    tag : str
        Hash of everything that the loop depends on.
    """

    def __init__(self, function: Any, folder: Path, tag: str) -> None:
        self._name = repr(function)
        self._py_func = function
        self._impl = _Results(folder, tag)
        self._cache_path = str(folder)
        self._cache_file = IndexDataCacheFile(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )
        self._folder, self._tag = folder, tag
        self.enable()

    def holds(self, signature: str) -> bool:
        """Whether machine code for the signature is on disk."""
        return (self._folder / f"{self._tag}.nbi").is_file()

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, where the folder may be written."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            warnings.warn(
                f"{self._folder}: cannot be written ({error.strerror}), so ships are compiled anew each time",
                stacklevel=2,
            )


__all__ = ["DiskCache", "normalize_signature"]
