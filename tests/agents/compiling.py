"""Exported C, compiled and loaded for tests."""

import ctypes
import subprocess

FLAGS = [
    "-std=c99",
    "-O2",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-pedantic",
    "-shared",
    "-fPIC",
]


def built(folder, name, header, source):
    """Shared library of a header and a source; whatever gcc warns of is an error."""
    (folder / f"{name}.h").write_text(header)
    (folder / f"{name}.c").write_text(source)
    command = ["gcc", *FLAGS, f"{name}.c", "-o", f"{name}.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    return ctypes.CDLL(str(folder / f"{name}.so"))
