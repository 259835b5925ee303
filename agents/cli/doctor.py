"""Checks of `shipgym doctor`: versions, compiled ships, optional packages, names."""

import importlib.metadata
import platform
import re
import tempfile
from pathlib import Path
from typing import NamedTuple

from rich.text import Text

import shipgym
from shipgym.engine.cache import CACHE_VARIABLE, cache_folder

#: Colours of the states of a finding: it works; an optional package is not installed;
#: something does not work.
COLOURS = {"fine": "green", "absent": "dim", "wrong": "bold red"}


class Finding(NamedTuple):
    """The result of one check."""

    what: str  # was checked
    state: str  # a key of `COLOURS`
    detail: str  # what was found and, where needed, what to do

    def line(self) -> Text:
        """One line for the terminal."""
        return Text.assemble(
            (f"{self.state:<6}", COLOURS[self.state]),
            f"  {self.what:<20} {self.detail}",
        )


def examine_installation() -> list[Finding]:
    """All findings of `shipgym doctor`, in order."""
    system = (
        f"{shipgym.__version__}, Python {platform.python_version()},"
        f" {platform.platform()}"
    )
    findings = [Finding("shipgym", "fine", system)]
    for extra, names in declared_packages().items():
        if extra == "":
            for name in names:
                findings.append(package_finding(name, [name], "wrong", "shipgym"))
        elif extra not in ("dev", "docs"):
            remedy = f"'shipgym[{extra}]'"
            findings.append(package_finding(f"extra {extra}", names, "absent", remedy))

    findings.append(cache_finding())
    for name in ("shipgym", "identification", "agents"):
        findings.append(name_finding(name))
    return findings


def declared_packages() -> dict[str, list[str]]:
    """Packages that shipgym needs, by extra; those of no extra under an empty name."""
    try:
        requirements = importlib.metadata.requires("shipgym") or []
    except importlib.metadata.PackageNotFoundError:  # run from a checkout
        return {}
    packages: dict[str, list[str]] = {}
    for line in requirements:
        name = re.match(r"[\w.-]+", line)
        if name is None or name[0] == "shipgym":
            continue
        of_extra = re.search(r'extra == "(\w+)"', line)
        extra = of_extra[1] if of_extra else ""
        packages.setdefault(extra, []).append(name[0])
    return packages


def package_finding(
    what: str, names: list[str], otherwise: str, remedy: str
) -> Finding:
    """Versions of packages; `otherwise` is the state if one is missing."""
    versions = []
    missing = []
    for name in names:
        try:
            version = importlib.metadata.version(name)
            versions.append(version if name == what else f"{name} {version}")
        except importlib.metadata.PackageNotFoundError:
            missing.append(name)
    if missing:
        detail = f"{', '.join(missing)} not installed: pip install {remedy}"
        return Finding(what, otherwise, detail)
    return Finding(what, "fine", ", ".join(versions))


def cache_finding() -> Finding:
    """Place of the cache of compiled ships, and whether it can be written."""
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder):
            return Finding("cache", "fine", str(folder))
    except OSError as error:
        return Finding(
            "cache",
            "wrong",
            f"{folder} cannot be written ({error.strerror}): what it lacks is compiled"
            f" again in each process; set {CACHE_VARIABLE} to a folder that can be",
        )


def name_finding(name: str) -> Finding:
    """Check that no other package has an import name.

    `agents` is also the import name of other packages.
    """
    what = f"import {name}"
    packages = importlib.metadata.packages_distributions().get(name, ())
    others = sorted(set(packages) - {"shipgym"})
    if others:
        return Finding(
            what,
            "wrong",
            f"also a package of {', '.join(others)}, they overwrite each other: use an"
            " environment without",
        )

    return Finding(
        what,
        "fine",
        str(Path(shipgym.__file__).parents[1] / name),
    )
