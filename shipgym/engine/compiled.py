"""How the kernels are compiled for one ship, cached on disk and never stale.

The folder `shipgym/kernels` is copied into the user's cache under a name that hashes its contents,
the ship's `accelerations.py`, the versions of Python and Numba and the processor; Numba's own on-disk
cache lies beside the copied files. Where there is weather, `open_sea.py` is its `weather.py`, and an
environment's task, `course_keeping.py` say, is its `task.py`. The folder is written beside its target and
renamed, so any number of processes may compile at once.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib
import importlib.util
import os
import platform
import shutil
import sys
import tempfile
import warnings
from functools import cache
from pathlib import Path
from types import ModuleType

from platformdirs import user_cache_path

KERNELS = Path(__file__).parents[1] / "kernels"
CACHE_VARIABLE = "SHIPGYM_CACHE"


@cache
def kernel(accelerations: str, name: str, weather: bool = False, task: str | None = None) -> ModuleType:
    """One file of kernels, compiled together with a ship.

    Parameters
    ----------
    accelerations : str
        Source of the ship's `accelerations.py`.
    name : str
        File of `shipgym/kernels`, without its ending.
    weather : bool
        Whether there is current, wind or waves.
    task : str, optional
        File of `shipgym/kernels` with an environment's task, without its ending.

    Returns
    -------
    module
        With the compiled functions of that file.
    """
    return importlib.import_module(f"{_package(accelerations, weather, task)}.{name}")


@cache
def _package(accelerations: str, weather: bool, task: str | None) -> str:
    """Name of the imported package that holds the kernels of one ship."""
    files = {path.name: path.read_bytes() for path in sorted(KERNELS.glob("*.py"))}
    files["accelerations.py"] = accelerations.encode()
    if weather:
        files["weather.py"] = files["open_sea.py"]
    if task is not None:
        files["task.py"] = files[f"{task}.py"]
    name = f"shipgym_kernels_{_fingerprint(files)}"
    folder = _write_once(name, files)
    spec = importlib.util.spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None
    assert spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    sys.modules[name] = package
    spec.loader.exec_module(package)
    return name


def _fingerprint(files: dict[str, bytes]) -> str:
    """Hash of everything that the machine code depends on."""
    import llvmlite.binding as llvm
    import numba

    digest = hashlib.sha256()
    machine = (
        platform.python_version(), numba.__version__, platform.machine(), llvm.get_host_cpu_name(),
        str(sorted(llvm.get_host_cpu_features().items())),
    )  # fmt: skip
    for word in machine:
        digest.update(word.encode() + b"\0")
    for name, content in files.items():
        digest.update(name.encode() + b"\0" + content + b"\0")
    return digest.hexdigest()[:24]


def _write_once(name: str, files: dict[str, bytes]) -> Path:
    """The folder in the cache, written now if it is not there yet."""
    home = Path(os.environ.get(CACHE_VARIABLE) or user_cache_path("shipgym"))
    folder = home / name
    if folder.is_dir():
        return folder
    try:
        home.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=".draft-", dir=home))
    except OSError as error:
        warnings.warn(
            f"{home}: cannot be written ({error.strerror}), so ships are compiled anew in each process. "
            f"Set {CACHE_VARIABLE} to a folder that can.",
            stacklevel=2,
        )
        draft = Path(tempfile.mkdtemp(prefix="shipgym-"))
        atexit.register(shutil.rmtree, draft, ignore_errors=True)
        folder = draft / name
        folder.mkdir()
        _write(folder, files)
        return folder
    _write(draft, files)
    try:
        draft.rename(folder)
    except OSError:  # another process was first
        shutil.rmtree(draft)
    return folder


def _write(folder: Path, files: dict[str, bytes]) -> None:
    for name, content in files.items():
        (folder / name).write_bytes(content)
