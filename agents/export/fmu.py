"""FMUs for co-simulation, FMI 2.0 and 3.0: exported C and a binary of it."""

import os
import platform
import shutil
import subprocess
import uuid
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from agents.export.c99 import Source, render
from agents.export.c_syntax import comment
from agents.export.fmu_variables import fmu_variables, unit_definitions
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
    check_fmu_name(path)
    name = source.name
    files = _texts(source, fmi)
    folder = _binary_folder(fmi)
    binary = ZipInfo(f"binaries/{folder}/{name}.so")
    with atomic_path(path) as draft:
        compiled = _compiled(files, name, path)
        with ZipFile(draft, "w", ZIP_DEFLATED) as archive:
            archive.writestr(binary, compiled, ZIP_DEFLATED)
            for file, text in files.items():
                archive.writestr(ZipInfo(file), text, ZIP_DEFLATED)


def check_fmu_name(path: Path) -> None:
    """Refuse a file whose name importers would not take; InputError gives another."""
    shown = str(path)[:200]
    if path.is_dir():
        raise InputError(
            f"{shown}: expected a file to write to, got a folder; give a name in it,"
            " such as ship.fmu"
        )
    if path.suffix != ".fmu":
        other = path.stem if path.suffix.lower() == ".fmu" else path.name
        better = "ship" if path.name.startswith(".") else other[:100]
        raise InputError(
            f"{shown}: expected a name that ends in .fmu, as importers do, got"
            f" {path.name[:100]!r}; call it {better}.fmu"
        )


def _binary_folder(fmi: str) -> str:
    """Folder of the binary for this computer, as the version of the standard has it."""
    machine = platform.machine()
    if fmi == "2.0" and machine == "x86_64":
        return "linux64"
    return f"{machine}-linux"


def _texts(source: Source, fmi: str) -> dict[str, str]:
    """Texts of an FMU by their names in its archive."""
    version = int(fmi[0])
    name = source.name
    content = source.header + source.source + fmi
    token = uuid.uuid5(uuid.NAMESPACE_URL, content)
    variables = fmu_variables(source)
    wrapper = f"{name}_fmi.c"
    data: dict[str, Any] = {
        **vars(source),
        "fmi": version,
        "token": str(token),
        "title": comment(source.title),
        "wrapper": wrapper,
        "variables": variables,
        "units": unit_definitions(variables),
    }
    texts = {}
    for header in _headers(version):
        texts[f"sources/{header.name}"] = header.read_text(encoding="utf-8")
    if f"sources/{name}.h" in texts:
        raise InputError(
            f"name: expected another than that of a header of FMI, got {name!r}; give"
            " another with --name"
        )
    texts |= {
        f"sources/{name}.h": source.header,
        f"sources/{name}.c": source.source,
        f"sources/{wrapper}": render("fmu.c.j2", **data),
        "modelDescription.xml": render("modelDescription.xml.j2", **data),
        "documentation/index.html": render("documentation.html.j2", **data),
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


def _compiled(files: dict[str, str], name: str, path: Path) -> bytes:
    """The shared library of the sources, compiled in a folder that stands by a path.

    What a killed process leaves of it the next export to this place removes.
    """
    compiler = shutil.which(os.environ.get("CC", "gcc"))
    if compiler is None or platform.system() != "Linux":
        raise InputError(
            "compiler: expected gcc on Linux, or the compiler that CC names, got none;"
            " an FMU holds a binary"
        )
    flags = ("-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off")
    sources = [f"{name}_fmi.c", f"{name}.c"]
    library = f"{name}.so"
    command = [compiler, *flags, *sources, "-o", library, "-lm"]
    compiling_s = 120.0
    with draft_folder(path.with_suffix(".build")) as folder:
        for file, text in files.items():
            if file.startswith("sources/"):
                (folder / Path(file).name).write_text(text, encoding="utf-8")
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                capture_output=True,
                text=True,
                timeout=compiling_s,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise InputError(
                f"{compiler}: expected the FMU compiled within {compiling_s:g} s, got"
                " no end; try again when the computer is less busy"
            ) from None
        compiled = folder / library
        if done.returncode or not compiled.is_file():
            raise InputError(f"{compiler}: cannot compile the FMU: {done.stderr[:400]}")
        return compiled.read_bytes()
