"""FMUs for co-simulation, FMI 2.0: exported C and a binary of it."""

import os
import platform
import shutil
import subprocess
import uuid
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from agents.export.c_syntax import comment
from agents.export.source import Source, render
from shipgym import InputError
from shipgym.drafts import atomic_path, draft_folder

#: Powers of base units, by the units of inputs and outputs.
UNITS = {
    "s": {"s": 1},
    "m": {"m": 1},
    "rad": {"rad": 1},
    "m/s": {"m": 1, "s": -1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "1/s": {"s": -1},
}


def write_fmu(source: Source, path: str | Path) -> None:
    """Write a ship or an autopilot as an FMU.

    `source`: of `ship_source` or `autopilot_source`; `path`: NAME.fmu. Raises
    InputError for a folder in its place, or if there is no C compiler or no FMPy, whose
    headers of the standard are needed.
    """
    path = Path(path)
    check_fmu_name(path)
    files = _texts(source)
    machine = platform.machine()
    folder = "linux64" if machine == "x86_64" else f"{machine}-linux"
    binary = ZipInfo(f"binaries/{folder}/{source.name}.so")
    with atomic_path(path) as draft:
        compiled = _compiled(files, source.name, path)
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
        raise InputError(
            f"{shown}: expected a name that ends in .fmu, as importers do, got"
            f" {path.name[:100]!r}; call it {path.stem.lstrip('.')[:100]}.fmu"
        )


def _texts(source: Source) -> dict[str, str]:
    """Texts of an FMU by their names in its archive."""
    name = source.name
    wrapper = f"{name}_fmi.c"
    data = {
        **source._asdict(),
        "token": uuid.uuid5(uuid.NAMESPACE_URL, source.header + source.source),
        "title": comment(source.title),
        "wrapper": wrapper,
        "variables": [*source.inputs.items(), *source.outputs.items()],
        "units": UNITS,
    }
    texts = {
        f"sources/{header.name}": header.read_text(encoding="utf-8")
        for header in _headers()
    }
    if f"sources/{name}.h" in texts:
        raise InputError(
            f"name: expected another than that of a header of FMI, got {name!r}; give"
            " another with --name"
        )
    return texts | {
        f"sources/{name}.h": source.header,
        f"sources/{name}.c": source.source,
        f"sources/{wrapper}": render("fmu.c.j2", **data),
        "modelDescription.xml": render("modelDescription.xml.j2", **data),
    }


def _headers() -> list[Path]:
    """Headers of the standard, which FMPy holds."""
    spec = find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise InputError(
            "fmpy is not installed, an FMU needs its headers: pip install"
            " 'shipgym[fmu]'"
        )
    folder = Path(spec.origin).parent / "c-code"
    return sorted(folder.glob("fmi2*.h"))


def _compiled(files: dict[str, str], name: str, path: Path) -> bytes:
    """The shared library of the sources, compiled in a folder that stands by a path.

    The next export to this place removes what a killed process leaves.
    """
    compiler = shutil.which(os.environ.get("CC", "gcc"))
    if compiler is None or platform.system() != "Linux":
        raise InputError(
            "compiler: expected gcc on Linux, or the compiler that CC names, got none;"
            " an FMU holds a binary"
        )
    command = [
        *(compiler, "-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off"),
        *(f"{name}_fmi.c", f"{name}.c", "-o", "ship.so", "-lm"),
    ]
    with draft_folder(path.with_suffix(".build")) as folder:
        for file, text in files.items():
            if file.startswith("sources/"):
                (folder / Path(file).name).write_text(text, encoding="utf-8")
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, check=False
        )
        compiled = folder / "ship.so"
        if done.returncode or not compiled.is_file():
            raise InputError(f"{compiler}: cannot compile the FMU: {done.stderr[:400]}")
        return compiled.read_bytes()
