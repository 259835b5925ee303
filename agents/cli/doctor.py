"""What `shipgym doctor` checks: versions, the cache of compiled ships, optional packages, names."""

import importlib.metadata
import importlib.util
import os
import platform
import re
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rich.text import Text

import shipgym
from agents.output import locks_and_drafts
from shipgym.engine.cache_folder import (
    CACHE_VARIABLE,
    cache_folder,
    loop_fault,
    open_folder,
)

OTHERS = ("dev", "docs")  # extras that are no part of what users do
MARKS = {
    "fine": ("ok", "green"),
    "absent": ("absent", "dim"),
    "left": ("left", "yellow"),
    "wrong": ("wrong", "bold red"),
}
OURS = ("shipgym", "identification", "agents")


@dataclass(frozen=True)
class Finding:
    """The result of one check."""

    what: str
    #: "fine"; "absent": an option that is not installed; "left": something that may be
    #: removed; "wrong": something does not work
    state: str
    detail: str  # what was found and, where needed, what to do

    def line(self) -> Text:
        """One line for the terminal."""
        mark, style = MARKS[self.state]
        return Text.assemble((f"{mark:<6}", style), f"  {self.what:<20} {self.detail}")


def examine_installation() -> list[Finding]:
    """Everything that `shipgym doctor` reports, in order."""
    system = (
        f"{shipgym.__version__}, Python {platform.python_version()},"
        f" {platform.platform()}"
    )
    needed = _declared()
    return [
        Finding("shipgym", "fine", system),
        *(_installed(name, [name], "wrong", "shipgym") for name in needed.pop("", [])),
        *(
            _installed(f"extra {extra}", names, "absent", f"'shipgym[{extra}]'")
            for extra, names in needed.items()
            if extra not in OTHERS
        ),
        Finding("cache", *_cache()),
        *left_findings(),
        *(name_finding(name) for name in OURS),
    ]


def _declared() -> dict[str, list[str]]:
    """The distributions that shipgym declares to need, by extra, those of no extra by an empty text."""
    found: dict[str, list[str]] = {}
    with suppress(
        importlib.metadata.PackageNotFoundError
    ):  # run from a checkout without installing it
        for line in importlib.metadata.requires("shipgym") or ():
            name, _, extra = re.fullmatch(
                r'([\w.-]+)(.*?extra == "(\w+)")?.*', line
            ).groups()  # type: ignore[union-attr]
            if name != "shipgym":
                found.setdefault(extra or "", []).append(name)
    return found


def _installed(what: str, names: list[str], otherwise: str, remedy: str) -> Finding:
    """Versions of distributions, or which of them are missing."""
    versions, missing = [], []
    for name in names:
        try:
            version = importlib.metadata.version(name)
            versions.append(version if name == what else f"{name} {version}")
        except importlib.metadata.PackageNotFoundError:
            missing.append(name)
    if missing:
        return Finding(
            what, otherwise, f"{', '.join(missing)} not installed: pip install {remedy}"
        )
    return Finding(what, "fine", ", ".join(versions))


def _cache() -> tuple[str, str]:
    """Whether compiled ships can be kept, so that a second start is fast, where they are, and how much."""
    folder, kept = cache_folder(), ""
    try:
        folder = open_folder()
        files = [path for path in folder.iterdir() if path.is_file()]
        kept = (
            f"{folder}, {len(files)} files,"
            f" {sum(path.stat().st_size for path in files) / 1e6:.1f} MB"
        )
        if wrong := [
            f"{path.name} {why}" for path in files if (why := loop_fault(path))
        ]:
            told = (
                f"{kept}, {len(wrong)} of them not usable: {wrong[0]}; delete what is"
                " not, or wait until"
            )
            return "wrong", f"{told} it is compiled again"
        with tempfile.NamedTemporaryFile(dir=folder):
            pass
    except ValueError as error:
        return "wrong", str(error)
    except OSError as error:
        if (
            folder.is_dir()
            and os.access(folder, os.R_OK | os.X_OK)
            and any(folder.iterdir())
        ):
            return (
                "fine",
                f"{kept}, to be read only: what is missing is compiled in memory",
            )
        told = (
            f"{folder} cannot be written ({error.strerror}): every process compiles its"
            " ships again"
        )
        return "wrong", f"{told}; set {CACHE_VARIABLE} to a folder that can be"
    return "fine", kept


def left_findings() -> list[Finding]:
    """Folders in use, and what dead processes left: here, one level below, and in the cache."""
    here = Path.cwd()
    return [
        Finding("left over" if dead else "in use", "left" if dead else "fine", told)
        for folder in [
            here,
            *(path for path in sorted(here.iterdir()) if path.is_dir()),
            cache_folder(),
        ]
        for told, dead in locks_and_drafts(folder)
    ]


def name_finding(name: str) -> Finding:
    """Whether an import name is this project's alone; `agents` is also that of other distributions."""
    what = f"import {name}"
    others = sorted(
        {*importlib.metadata.packages_distributions().get(name, ())} - {"shipgym"}
    )
    if others:
        told = f"also a package of {', '.join(others)}, they overwrite each other"
        return Finding(what, "wrong", f"{told}: use an environment without")
    found = importlib.util.find_spec(name)
    folder = (
        None
        if found is None or found.origin is None
        else Path(found.origin).resolve().parent
    )
    home = Path(shipgym.__file__).resolve().parents[1]
    if folder is None or folder.parent != home:
        return Finding(
            what,
            "wrong",
            f"leads to {folder}, expected {home / name}: install shipgym again",
        )
    return Finding(what, "fine", os.fspath(folder))
