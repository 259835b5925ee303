"""`shipgym export`: controllers, policies and models for use outside Python."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

if TYPE_CHECKING:
    from agents.export.c99 import Source


def export_command(
    what: Annotated[
        str,
        Argument(
            metavar="AGENT|MODEL",
            help="File of a controller, policy or model, or a shipped name.",
        ),
    ],
    onnx: Annotated[
        Path | None,
        Option(metavar="OUT.ONNX", help="Write a learned policy as an ONNX graph."),
    ] = None,
    c: Annotated[
        Path | None, Option("--c", metavar="FOLDER", help="Write C99: NAME.h, NAME.c.")
    ] = None,
    fmu: Annotated[
        Path | None, Option(metavar="OUT.FMU", help="Write an FMU for co-simulation.")
    ] = None,
    fmi: Annotated[str, Option(help="Version of the FMU: 3.0 or 2.0.")] = "3.0",
    name: Annotated[
        str | None, Option(help="Name in C and FMU; default: the file's name.")
    ] = None,
    depth: Annotated[
        float, Option(metavar="M", help="For a model: water depth; default: deep.")
    ] = inf,
    floats: Annotated[
        bool, Option("--float", help="C99 in single precision; default: double.")
    ] = False,
) -> None:
    """Write an autopilot or a ship model as C99 or FMU.

    Learned policies also as ONNX.
    """
    from agents.cli.terminal import answer, say, warn
    from shipgym.errors import InputError

    has_source = c is not None or fmu is not None
    if onnx is None and not has_source:
        raise InputError(
            "nothing to write: give --c FOLDER, --fmu OUT.FMU or --onnx OUT.ONNX"
        )
    if not has_source and (name is not None or depth != inf):
        raise InputError(
            "--name, --depth: expected with --c or --fmu, got neither; leave them out"
        )
    if fmu is None and fmi != "3.0":
        raise InputError(f"--fmi: expected with --fmu, got {fmi} alone; leave it out")
    if floats and c is None:
        raise InputError(
            "--float: expected with --c, got no --c; leave it out, the numbers of an"
            " FMU are double"
        )

    in_c = None
    in_fmu = None
    if c is not None:
        in_c = _source(what, name, depth, "float" if floats else "double")
    if fmu is not None:
        in_fmu = _source(what, name, depth, "double")

    source = in_c or in_fmu
    if source is not None:
        for note in source.notes:
            warn(note)
    with _sigterm_ends_in_order():
        _write(
            what,
            in_c,
            in_fmu,
            c=c,
            fmu=fmu,
            fmi=fmi,
            onnx=onnx,
        )

    written = [str(path) for path in (onnx, c, fmu) if path is not None]
    answer({"written": written})
    say(*(f"written: {path}" for path in written))


@contextmanager
def _sigterm_ends_in_order() -> Iterator[None]:
    """End on SIGTERM as on Ctrl-C: what is half-written is removed."""

    def leave(number: int, _: Any) -> None:
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _write(
    what: str,
    in_c: Source | None,
    in_fmu: Source | None,
    *,
    c: Path | None,
    fmu: Path | None,
    fmi: str,
    onnx: Path | None,
) -> None:
    """Check all files before any is written; write first what may still fail."""
    from agents.agent_file import load_agent
    from agents.export.fmu import check_fmu_name, write_fmu
    from agents.output import check_file, check_folder, whole_folder
    from agents.policies.onnx_export import onnx_model
    from shipgym.files import write_bytes

    texts = {}
    if in_c is not None:
        texts = {f"{in_c.name}.h": in_c.header, f"{in_c.name}.c": in_c.source}
    if fmu is not None:
        check_fmu_name(fmu)
    for file in (fmu, onnx):
        if file is not None:
            check_file(file)
    if c is not None:
        check_folder(c, texts)

    graph = onnx_model(load_agent(what)) if onnx is not None else None
    if fmu is not None and in_fmu is not None:
        write_fmu(in_fmu, fmu, fmi)
    if onnx is not None and graph is not None:
        write_bytes(graph.SerializeToString(), onnx)
    if c is not None:
        with whole_folder(c, texts) as draft:
            for file_name, text in texts.items():
                (draft / file_name).write_text(text, encoding="utf-8")


def _source(what: str, name: str | None, depth: float, real: str) -> Source:
    """C99 of the controller, policy or model of a file or a name."""
    from agents.agent_file import list_pretrained, load_agent
    from agents.export.autopilot_c99 import autopilot_source
    from agents.export.ship_c99 import ship_source
    from shipgym.errors import InputError
    from shipgym.files import read_json
    from shipgym.models import load_model

    file = Path(what)
    is_agent = what in list_pretrained()
    if file.suffix == ".json":
        expected = "file of a controller or a model"
        is_agent |= "kind" in read_json(file, expected, "take another copy")
    if not is_agent:
        return ship_source(load_model(what), name or file.stem, depth, real)
    if depth != inf:
        raise InputError(
            f"--depth: expected none for an autopilot, got {depth:g} for {what}; leave"
            " it out"
        )
    return autopilot_source(load_agent(what), name or file.stem, real)
