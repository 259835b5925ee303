"""Run the notebooks and keep what they print and draw; the site shows them so.

`python scripts/run_notebooks.py` runs all of `notebooks/`, with names behind it those;
it ends with 1 where a cell raises an error. Counters and other metadata that change
with every run are left out.
"""

from __future__ import annotations

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

FOLDER = Path(__file__).parents[1] / "notebooks"
LONGEST = 600  # s, of a cell


def executed(path: Path) -> nbformat.NotebookNode:
    """A notebook with its outputs; CellExecutionError where a cell raises an error."""
    notebook = nbformat.read(path, as_version=4)
    place = {"metadata": {"path": str(FOLDER.parent)}}
    NotebookClient(notebook, timeout=LONGEST, resources=place).execute()
    return notebook


def run(path: Path) -> None:
    """Run a notebook and write it with its outputs."""
    notebook = executed(path)
    for k, cell in enumerate(notebook.cells):
        cell.id = f"cell-{k}"
        cell.metadata = {}
        if cell.cell_type == "code":
            cell.execution_count = None
            for output in cell.outputs:
                output.pop("execution_count", None)
    notebook.metadata = {
        "kernelspec": {
            "display_name": "Python 3",
            "language": "python",
            "name": "python3",
        }
    }
    nbformat.write(notebook, path)


def main(names: list[str]) -> int:
    """Run notebooks by name, by default all; the number that failed."""
    failed = 0
    for path in sorted(FOLDER.glob("*.ipynb")):
        if names and path.stem not in names:
            continue
        try:
            run(path)
            print(f"{path.name}: runs, {path.stat().st_size / 1000:.0f} kB")
        except CellExecutionError as error:
            print(f"{path.name}: {error}")
            failed += 1
    return failed


if __name__ == "__main__":
    sys.exit(min(main(sys.argv[1:]), 1))
