"""`shipgym export`: controllers, learned policies and ship models for use outside Python."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from agents.cli.command import answered

if TYPE_CHECKING:
    from agents.deployment.c99 import Source


@answered
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
) -> None:
    """Write an autopilot or a ship model as C99 or FMU. Learned policies also as ONNX."""
    from agents.agent_file import load_agent
    from agents.cli.terminal import answer, say, warn
    from agents.deployment.fmu import write_fmu
    from agents.output import check_file, check_folder, whole_folder
    from agents.policies.onnx_export import onnx_model
    from shipgym.errors import InputError
    from shipgym.files import write_bytes

    if not (onnx or c or fmu):
        raise InputError(
            "nothing to write: give --c FOLDER, --fmu OUT.FMU or --onnx OUT.ONNX"
        )
    if not (c or fmu) and (name, depth) != (None, inf):
        raise InputError(
            "--name and --depth found, which are for --c and --fmu alone; leave"
            " them out"
        )
    if not fmu and fmi != "3.0":
        raise InputError(f"--fmi: {fmi} found, which is for --fmu alone; leave it out")
    if c or fmu:
        source = _source(what, name, depth)
        for note in source.notes:
            warn(note)
        texts = {f"{source.name}.h": source.header, f"{source.name}.c": source.source}
    for file in filter(None, (fmu, onnx)):
        check_file(file)
    if c:
        check_folder(c, texts)
    graph = onnx_model(load_agent(what)) if onnx else None
    if fmu:  # first what may still fail
        write_fmu(source, fmu, fmi)
    if onnx and graph:
        write_bytes(graph.SerializeToString(), onnx)
    if c:
        with whole_folder(c, texts) as draft:
            for name, text in texts.items():
                (draft / name).write_text(text, encoding="utf-8")
    written = [str(path) for path in (onnx, c, fmu) if path]
    answer({"written": written})
    say(*(f"written: {path}" for path in written))


def _source(what: str, name: str | None, depth: float) -> Source:
    """C99 of whatever a file or a name stands for."""
    from agents.agent_file import list_pretrained, load_agent
    from agents.deployment.autopilot_c99 import autopilot_source
    from agents.deployment.ship_c99 import ship_source
    from shipgym.errors import InputError
    from shipgym.files import read_json
    from shipgym.ships import load_model

    file, what_it_is = Path(what), "file of a controller or a model"
    content = (
        read_json(file, what_it_is, "take another copy")
        if file.suffix == ".json"
        else {}
    )
    if "kind" in content or what in list_pretrained():
        if depth != inf:
            raise InputError(
                f"--depth: {depth:g} found, but {what} is an autopilot; leave it out"
            )
        return autopilot_source(load_agent(what), name or file.stem)
    return ship_source(load_model(what), name or file.stem, depth)
