"""FMUs for co-simulation, FMI 2.0 and 3.0: the exported C with its sources and a binary for this computer."""

import os
import platform
import shutil
import subprocess
import tempfile
import uuid
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from agents.deployment.c99 import Source, render
from shipgym import InputError
from shipgym.checks import check_choice
from shipgym.drafts import atomic_path

VERSIONS = ("2.0", "3.0")
FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off")
COMPILING_S = 120.0


def write_fmu(source: Source, path: str | Path, fmi: str = "3.0") -> None:
    """Write a ship or an autopilot as an FMU.

    `source`: of `ship_source` or `autopilot_source`; `path`: NAME.fmu; `fmi`: version
    of the standard, "3.0" or "2.0". Raises InputError for another version, a folder in
    its place, or if there is no C compiler or no FMPy, whose headers of the standard
    are needed.
    """
    version, path = int(check_choice(fmi, VERSIONS, "fmi")[0]), Path(path)
    if path.suffix != ".fmu":
        raise InputError(
            f"{str(path)[:200]}: found, expected a name that ends in .fmu, as"
            " importers do"
        )
    files = {
        f"sources/{one.name}": one.read_text(encoding="utf-8")
        for one in _headers(version)
    }
    token = str(uuid.uuid5(uuid.NAMESPACE_URL, source.header + source.source + fmi))
    data = {"fmi": version, "token": token, **vars(source)}
    title = f"{'Ship' if source.ship else 'Autopilot'} {source.name}"
    files |= {
        f"sources/{source.name}.h": source.header,
        f"sources/{source.name}.c": source.source,
        "sources/fmu.c": render("fmu.c.j2", **data),
        "modelDescription.xml": render("modelDescription.xml.j2", title=title, **data),
    }
    if version == 3:
        files["sources/buildDescription.xml"] = render(
            "buildDescription.xml.j2", **data
        )
    machine = platform.machine()
    folder = "linux64" if version == 2 and machine == "x86_64" else f"{machine}-linux"
    with atomic_path(path) as draft:
        binary = _compiled(files, source.name)
        with ZipFile(draft, "w", ZIP_DEFLATED) as archive:
            archive.writestr(
                ZipInfo(f"binaries/{folder}/{source.name}.so"), binary, ZIP_DEFLATED
            )
            for name, text in files.items():
                archive.writestr(ZipInfo(name), text, ZIP_DEFLATED)


def _headers(version: int) -> list[Path]:
    spec = find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise InputError(
            "fmpy is not installed, an FMU needs its headers: pip install"
            " 'shipgym[fmu]'"
        )
    return sorted((Path(spec.origin).parent / "c-code").glob(f"fmi{version}*.h"))


def _compiled(files: dict[str, str], name: str) -> bytes:
    """The shared library of the sources."""
    compiler = shutil.which(os.environ.get("CC", "gcc"))
    if compiler is None or platform.system() != "Linux":
        raise InputError(
            "no C compiler for Linux found, expected gcc, or the one that CC names: an"
            " FMU holds a binary"
        )
    with tempfile.TemporaryDirectory() as folder:
        for one, text in files.items():
            (Path(folder) / Path(one).name).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "fmu.c", f"{name}.c", "-o", "fmu.so", "-lm"]
        done = subprocess.run(
            command,
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=COMPILING_S,
            check=False,
        )
        if done.returncode:
            raise InputError(f"{compiler}: cannot compile the FMU: {done.stderr[:400]}")
        return (Path(folder) / "fmu.so").read_bytes()
