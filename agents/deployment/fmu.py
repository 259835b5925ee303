"""FMUs for co-simulation, FMI 2.0 and 3.0: exported C and a binary of it."""

import os
import platform
import shutil
import subprocess
import tempfile
import uuid
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from agents.deployment.c99 import Source, render
from shipgym import InputError
from shipgym.checks import check_choice
from shipgym.drafts import atomic_path, draft_folder


def write_fmu(source: Source, path: str | Path, fmi: str = "3.0") -> None:
    """Write a ship or an autopilot as an FMU.

    `source`: of `ship_source` or `autopilot_source`; `path`: NAME.fmu; `fmi`: version
    of the standard, "3.0" or "2.0". Raises InputError for another version, a folder in
    its place, or if there is no C compiler or no FMPy, whose headers of the standard
    are needed.
    """
    versions = ("2.0", "3.0")
    check_choice(fmi, versions, "fmi")
    path = Path(path)
    if path.suffix != ".fmu":
        raise InputError(
            f"{str(path)[:200]}: expected a name that ends in .fmu, as importers do,"
            f" got one that ends in {path.suffix[:20]!r}"
        )

    name = source.name
    files = _texts(source, fmi)
    machine = platform.machine()
    folder = f"{machine}-linux"
    if fmi == "2.0" and machine == "x86_64":
        folder = "linux64"
    with atomic_path(path) as draft:
        binary = ZipInfo(f"binaries/{folder}/{name}.so")
        compiled = _compiled(files, name)
        with ZipFile(draft, "w", ZIP_DEFLATED) as archive:
            archive.writestr(binary, compiled, ZIP_DEFLATED)
            for file, text in files.items():
                archive.writestr(ZipInfo(file), text, ZIP_DEFLATED)


def _texts(source: Source, fmi: str) -> dict[str, str]:
    """Texts of an FMU by their names in its archive."""
    version = int(fmi[0])
    name = source.name
    content = source.header + source.source + fmi
    token = uuid.uuid5(uuid.NAMESPACE_URL, content)
    title = f"Ship {name}" if source.ship else f"Autopilot {name}"
    data: dict[str, Any] = {
        **vars(source),
        "fmi": version,
        "token": str(token),
        "title": title,
    }
    texts = {}
    for header in _headers(version):
        texts[f"sources/{header.name}"] = header.read_text(encoding="utf-8")
    texts |= {
        f"sources/{name}.h": source.header,
        f"sources/{name}.c": source.source,
        "sources/fmu.c": render("fmu.c.j2", **data),
        "modelDescription.xml": render("modelDescription.xml.j2", **data),
    }
    if version == 3:
        build = render("buildDescription.xml.j2", **data)
        texts["sources/buildDescription.xml"] = build
    return texts


def _headers(version: int) -> list[Path]:
    """Headers of the standard, which FMPy holds."""
    spec = find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise InputError(
            "fmpy is not installed, an FMU needs its headers: pip install"
            " 'shipgym[fmu]'"
        )
    folder = Path(spec.origin).parent / "c-code"
    return sorted(folder.glob(f"fmi{version}*.h"))


def _compiled(files: dict[str, str], name: str) -> bytes:
    """The shared library of the sources."""
    compiler = shutil.which(os.environ.get("CC", "gcc"))
    if compiler is None or platform.system() != "Linux":
        raise InputError(
            "compiler: expected gcc on Linux, or the compiler that CC names, got none;"
            " an FMU holds a binary"
        )
    flags = ("-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off")
    command = [compiler, *flags, "fmu.c", f"{name}.c", "-o", "fmu.so", "-lm"]
    compiling_s = 120.0
    home = Path(tempfile.gettempdir(), "shipgym-fmu")
    with draft_folder(home) as folder:  # that of a killed process is removed
        for file, text in files.items():
            path = Path(folder, Path(file).name)
            path.write_text(text, encoding="utf-8")
        done = subprocess.run(
            command,
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=compiling_s,
            check=False,
        )
        if done.returncode:
            raise InputError(f"{compiler}: cannot compile the FMU: {done.stderr[:400]}")
        return Path(folder, "fmu.so").read_bytes()
