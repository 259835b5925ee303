"""The notebooks run, and print what the site shows."""

import pytest
from run_notebooks import FOLDER, executed

NAMES = sorted(path.name for path in FOLDER.glob("*.ipynb"))


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_runs(name):
    cells = [one for one in executed(FOLDER / name).cells if one.cell_type == "code"]
    shown = [output.output_type for cell in cells for output in cell.outputs]
    assert {"execute_result", "display_data", "stream"} & {*shown}
    assert "error" not in shown
