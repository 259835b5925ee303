"""Wrong command lines are refused with one message, and leave nothing."""

import random
import subprocess
import sys
from pathlib import Path

import pytest

from tests.agents import wrong_commands

ROOT = Path(__file__).parents[2]
SAMPLE = random.Random(0).sample(list(wrong_commands.lines()), 60)


def test_wrong_commands_are_refused_with_one_message_and_nothing_written(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert wrong_commands.faults(SAMPLE) == {}


def test_there_are_many_wrong_commands():
    assert len(list(wrong_commands.lines())) >= 500


@pytest.mark.parametrize("words", [["--help"], ["doctor", "--json"]])
def test_an_output_that_cannot_be_written_is_told(words):
    with Path("/dev/full").open("w") as full:
        answer = subprocess.run(
            [sys.executable, "-m", "agents.cli", *words],
            cwd=ROOT,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert answer.returncode == 1
    assert (
        answer.stderr
        == "error: the output cannot be written (No space left on device)\n"
    )
