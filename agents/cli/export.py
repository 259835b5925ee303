"""`shipgym export`: controllers, policies and models for use outside Python."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from agents.cli.terminal import answer, say
from shipgym.errors import InputError

if TYPE_CHECKING:
    from agents.export.source import Source


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
        Path | None,
        Option(metavar="OUT.FMU", help="Write an FMU for co-simulation, FMI 2.0."),
    ] = None,
    name: Annotated[
        str | None, Option(help="Name in C and FMU; default: the file's name.")
    ] = None,
    depth: Annotated[
        float, Option(metavar="M", help="For a model: water depth; default: deep.")
    ] = inf,
) -> None:
    """Write an autopilot or a ship model as C99 or FMU, a learned policy as ONNX."""
    from agents.agent_file import load_agent
    from agents.export.fmu import check_fmu_name, write_fmu
    from agents.output import check_file, check_folder, whole_folder
    from agents.policies.onnx_export import onnx_model
    from shipgym.files import write_bytes

    has_source = c is not None or fmu is not None
    if onnx is None and not has_source:
        raise InputError(
            "nothing to write: give --c FOLDER, --fmu OUT.FMU or --onnx OUT.ONNX"
        )
    if not has_source and (name is not None or depth != inf):
        raise InputError(
            "--name, --depth: expected with --c or --fmu, got neither; leave them out"
        )
    graph = onnx_model(load_agent(what)) if onnx is not None else None
    source = _source(what, name, depth) if has_source else None
    files = {}
    if source is not None:
        files = {f"{source.name}.h": source.header, f"{source.name}.c": source.source}
    # all are checked before the first is written
    if fmu is not None:
        check_fmu_name(fmu)
    for file in (fmu, onnx):
        if file is not None:
            check_file(file)
    if c is not None:
        check_folder(c, files)
    if source is not None and fmu is not None:
        write_fmu(source, fmu)
    if graph is not None and onnx is not None:
        write_bytes(graph.SerializeToString(), onnx)
    if c is not None:
        with whole_folder(c, files) as draft:
            for file_name, text in files.items():
                (draft / file_name).write_text(text, encoding="utf-8")
    written = [str(path) for path in (onnx, c, fmu) if path is not None]
    answer({"written": written})
    say(*(f"written: {path}" for path in written))


def _source(what: str, name: str | None, depth: float) -> Source:
    """C99 of the controller, policy or model of a file or a name."""
    from agents.agent_file import list_pretrained, load_agent
    from agents.export.autopilot import autopilot_source
    from agents.export.ship_c99 import ship_source
    from shipgym.files import kind_of
    from shipgym.models import load_model

    file = Path(what)
    is_agent = what in list_pretrained() or kind_of(file) == "controller file"
    if not is_agent:
        return ship_source(load_model(what), name or file.stem, depth)
    if depth != inf:
        raise InputError(
            f"--depth: expected none for an autopilot, got {depth:g} for {what}; leave"
            " it out"
        )
    return autopilot_source(load_agent(what), name or file.stem)
