"""What `import shipgym` gives, and what it costs."""

import subprocess
import sys

import gymnasium
import pytest

import shipgym
import shipgym.manoeuvres
import shipgym.sea


@pytest.mark.parametrize("package", [shipgym, shipgym.sea, shipgym.manoeuvres])
def test_every_public_name_is_there(package):
    for name in package.__all__:
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError, match="weathr"):
        _ = package.weathr


def test_the_import_registers_environments_and_loads_nothing_that_compiles():
    code = (
        "import sys, shipgym; sys.exit(any(name in sys.modules for name in ('numba',"
        " 'scipy', 'control', 'plotly', 'torch')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert "shipgym/CourseKeeping-v0" in gymnasium.registry
