"""The first lines that a reader copies."""

import os
import re
import subprocess
import sys
from pathlib import Path

from shipgym import ShipFile, example_ship

ROOT = Path(__file__).parents[2]


def test_the_lines_of_the_readme_work_outside_a_checkout(tmp_path):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 100
    code = "".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    for large, small in {
        "learn(20_000)": "learn(64)",
        "episodes=10": "episodes=1",
    }.items():
        assert large in code
        code = code.replace(large, small)
    answer = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "100"},
    )
    assert answer.returncode == 0, answer.stderr
    assert "N_r " in answer.stdout
    assert answer.stdout.endswith("['lq', 'mine']\n")


def test_the_files_that_the_readme_names_are_there():
    for link in re.findall(
        r"\]\(([^)#:]+)\)", (ROOT / "README.md").read_text(encoding="utf-8")
    ):
        assert (ROOT / link).is_file(), link


def test_the_packaged_example_is_part_of_the_demo_and_small():
    folder = example_ship().parent
    trials = sorted(folder.glob("*.csv"))
    assert sum(path.stat().st_size for path in folder.iterdir()) < 300_000
    assert [trial.use for trial in ShipFile.load(example_ship()).trials()] == [
        "fit",
        "fit",
        "validate",
    ]
    for path in trials:
        assert (
            path.read_bytes()
            == (ROOT / "examples" / "mariner" / path.name).read_bytes()
        )
