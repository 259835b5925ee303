"""Exported C, compiled and loaded for tests."""

import ctypes
import shutil
import subprocess

STRICT = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-Wconversion",
    "-Wdouble-promotion",
    "-pedantic",
]
FLAGS = [*STRICT, "-O2", "-shared", "-fPIC"]
#: Clang, where it is installed, reads what gcc compiles.
CLANG = shutil.which("clang")


def built(folder, name, header, source):
    """Shared library of a header and a source; a warning of a compiler is an error."""
    (folder / f"{name}.h").write_text(header, encoding="utf-8")
    (folder / f"{name}.c").write_text(source, encoding="utf-8")
    if CLANG:
        command = [CLANG, *STRICT, "-fsyntax-only", f"{name}.c"]
        subprocess.run(command, cwd=folder, check=True)
    command = ["gcc", *FLAGS, f"{name}.c", "-o", f"{name}.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    return ctypes.CDLL(str(folder / f"{name}.so"))
