"""Commands on learned policies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents.cli.command import answered


@answered
def export_command(
    agent: Annotated[Path, typer.Argument(metavar="AGENT.JSON", help="A learned policy's file.")],
    onnx: Annotated[Path, typer.Option(metavar="OUT.ONNX", help="The file to write.")],
) -> None:
    """Write a learned policy as an ONNX file, observation to action; torch is not needed."""
    from agents.agent_file import load_agent
    from agents.cli.terminal import out as console
    from agents.policies.onnx_export import export_onnx

    export_onnx(load_agent(agent), onnx)
    console.print(f"written: {onnx}", soft_wrap=True)
