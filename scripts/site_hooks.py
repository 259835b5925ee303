"""Hooks of the site: equations as MathML, notebooks as pages.

mkdocs calls these functions (`hooks` in `mkdocs.yml`). Equations are drawn by the
browser itself, so that no script is loaded from elsewhere.
"""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
BLOCK = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)


def on_files(files: Any, config: Any) -> Any:
    """Add a page for each notebook."""
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        files.append(
            File.generated(
                config, f"notebooks/{path.stem}.md", content=notebook_page(path)
            )
        )
    return files


def on_page_content(content: str, **_: Any) -> str:
    """Replace the equations of a page."""
    content = INLINE.sub(lambda found: convert(html.unescape(found[1])), content)
    return BLOCK.sub(
        lambda found: f'<div class="equation">{_block(html.unescape(found[1]))}</div>',
        content,
    )


def _block(latex: str) -> str:
    return convert(latex.strip(), display="block")


def notebook_page(path: Path) -> str:
    """A notebook as Markdown: text, code, and its outputs when last executed."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    parts = []
    for cell in cells:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
        else:
            parts += [f"```python\n{source}\n```", *map(_output, cell["outputs"])]
    return "\n\n".join(parts) + "\n"


def _output(output: dict[str, Any]) -> str:
    data = output.get("data", {})
    if picture := data.get("image/png"):
        return (
            '<img alt="what the code above draws"'
            f' src="data:image/png;base64,{picture.strip()}">'
        )
    text = "".join(output.get("text", data.get("text/plain", "")))
    return f"```text\n{text.rstrip()}\n```"
