"""`shipgym export`: controllers, learned policies and ship models for use outside Python."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agents.cli.command import answered

if TYPE_CHECKING:
    from agents.deployment.c99 import Source


@answered
def export_command(
    what: Annotated[
        str,
        typer.Argument(
            metavar="AGENT|MODEL", help="A file of a controller, policy or model, or a shipped name."
        ),
    ],
    onnx: Annotated[
        Path | None, typer.Option(metavar="OUT.ONNX", help="Write a learned policy as an ONNX graph.")
    ] = None,
    c: Annotated[
        Path | None, typer.Option("--c", metavar="FOLDER", help="Write C99: NAME.h and NAME.c.")
    ] = None,
    fmu: Annotated[
        Path | None, typer.Option(metavar="OUT.FMU", help="Write an FMU for co-simulation.")
    ] = None,
    fmi: Annotated[str, typer.Option(help="Version of the FMU: 3.0 or 2.0.")] = "3.0",
    name: Annotated[
        str | None, typer.Option(help="By which C and FMU know it; default: that of the file.")
    ] = None,
    depth: Annotated[
        float | None, typer.Option(metavar="M", help="Of a model: depth of the water, m; default: deep.")
    ] = None,
) -> None:
    """Write an autopilot or a ship model as C99, as an FMU or, of a learned policy, as ONNX."""
    from agents.agent_file import load_agent
    from agents.cli.terminal import out as console
    from agents.cli.terminal import warn
    from shipgym.errors import InputError

    if onnx is None and c is None and fmu is None:
        raise InputError("nothing to write: give --c FOLDER, --fmu OUT.FMU or --onnx OUT.ONNX")
    if onnx is not None:
        from agents.policies.onnx_export import export_onnx

        export_onnx(load_agent(what), onnx)
        console.print(f"written: {onnx}", soft_wrap=True)
    if c is None and fmu is None:
        return
    from agents.deployment.fmu import write_fmu
    from agents.output import check_folder, whole_folder

    source = _source(what, name, depth)
    for note in source.notes:
        warn(note)
    if c is not None:
        files = {f"{source.name}.h": source.header, f"{source.name}.c": source.source}
        check_folder(c, files)
        with whole_folder(c, files) as draft:
            for file, text in files.items():
                (draft / file).write_text(text, encoding="utf-8")
        console.print(f"written: {c}", soft_wrap=True)
    if fmu is not None:
        write_fmu(source, fmu, fmi)
        console.print(f"written: {fmu}", soft_wrap=True)


def _source(what: str, name: str | None, depth: float | None) -> Source:
    """C99 of whatever a file or a name stands for."""
    from agents.agent_file import list_pretrained, load_agent
    from agents.deployment.c99 import autopilot_source, ship_source
    from shipgym.files import read_json
    from shipgym.ships import load_model

    file = Path(what)
    named = name or file.stem
    remedy = "write it again or take another copy"
    if what in list_pretrained() or (
        file.suffix == ".json" and "kind" in read_json(file, "file of a controller or a model", remedy)
    ):
        return autopilot_source(load_agent(what), named)
    return ship_source(load_model(what), named, float("inf") if depth is None else depth)
